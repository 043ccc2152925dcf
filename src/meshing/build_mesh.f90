!> The mesh of the scene from the mesh as read, and what can be wrong with it as a whole.
module build_mesh_mod
  use cards_mod, only: keep_reading, note, reader_t, report
  use hexahedron8_mod, only: eta_node, xi_node, zeta_node
  use inverted_elements_mod, only: jacobians_of
  use constraints_mod, only: constraints_t
  use kinds_mod, only: wp
  use cells_mod, only: cells, has_middles, hexahedron_nodes
  use connectivity_mod, only: connectivity_t, nodes_of_element, nodes_of_hexahedron, &
    some_elements
  use mesh_draft_mod, only: mesh_draft_t, names_of_planes, not_a_coordinate, &
    solids
  use mesh_mod, only: find_bodies, kind_c3d8, mesh_t
  use scene_mod, only: material_t
  use sets_mod, only: model_t
  use text_mod, only: to_text
  implicit none
  private

  public :: mark_used_nodes, note_unused_nodes, check_elements, check_locking, build_mesh

  real(wp), parameter :: never = huge(1.0_wp)
  real(wp), parameter :: noise_from(size(cells)) = 1.0e-9_wp + [0.5_wp, 0.499_wp, 0.48_wp, never, &
    0.49_wp, 0.495_wp, 0.49_wp, never, never, 0.495_wp]
  !! Poisson's ratio up to which the pressures of a flat block on a ball are off by at most a fifth
  !! of the largest in the mean, two elements across the radius of contact
  !! (tests/cases/test_locking.py has the block), of each cell with full integration of
  !! displacements alone; never: such elements do not lock. Those of the 8-node hexahedron, from
  !! 0.495 on, are left to the note. [-]
  character(*), parameter :: without_locking(size(cells)) = [character(14) :: 'C3D8B', 'C3D20R', &
    'C3D10', '', 'C3D8B or C3D10', 'C3D10', 'C3D8B or C3D10', '', '', 'C3D10']
  !! solid elements to take in the place of those of a cell

contains

  !> Which nodes an element has. None is a reference node yet.
  subroutine mark_used_nodes(model)
    type(model_t), intent(inout) :: model
    integer :: e

    allocate (model%used(model%mesh%n_nodes), model%reference(model%mesh%n_nodes))
    allocate (model%rigid(model%mesh%n_nodes), source=.false.)
    allocate (model%turned(model%mesh%n_nodes), source=0)
    model%used = .false.
    model%reference = .false.
    do e = 1, model%mesh%n_elements
      model%used(nodes_of_element(model%mesh%connectivity, e)) = .true.
    end do
  end subroutine mark_used_nodes

  !> Note the nodes that neither an element nor an obstacle has, and no equation names.
  !>
  !> They, as an *ELEMENT card without data does, say that elements were taken out of the deck.
  subroutine note_unused_nodes(reader, model)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(inout) :: model
    integer :: i, n, first, n_nodes !! of the deck: without those that stand for rotations

    n = 0
    first = 0
    n_nodes = model%mesh%n_nodes
    if (allocated(model%mesh%between)) n_nodes = model%mesh%n_given
    n_nodes = n_nodes - model%n_added
    do i = 1, model%mesh%n_nodes
      if (model%used(i) .or. model%reference(i) .or. model%rigid(i) .or. model%joined(i) .or. &
        model%turned(i) > 0) cycle
      if (is_another(i)) cycle
      n = n + 1
      if (first == 0) first = i
    end do
    if (n == 0 .or. model%mesh%n_elements == 0) return
    model%mesh%taken_out = .true.
    call note(reader, to_text(n)//' of '//to_text(n_nodes)// &
      ' nodes belong to no element (the first: node '//to_text(model%mesh%node_id(first))//')')

  contains

    !> Whether a node is taken as another one in its place.
    logical function is_another(node)
      integer, intent(in) :: node

      is_another = .false.
      if (.not. allocated(model%mesh%nodes%instead)) return
      if (node <= size(model%mesh%nodes%instead)) is_another = model%mesh%nodes%instead(node) /= &
        node
    end function is_another
  end subroutine note_unused_nodes

  !> Report elements that are turned inside out or flat.
  subroutine check_elements(reader, draft)
    type(reader_t), intent(inout) :: reader
    type(mesh_draft_t), intent(in) :: draft
    real(wp) :: x(3, hexahedron_nodes), least
    real(wp), allocatable :: determinants(:)
    integer :: e, nodes(hexahedron_nodes)

    allocate (determinants(0))
    do e = 1, draft%n_elements
      ! Elements with undefined nodes were given one node eight times: they were reported.
      nodes = nodes_of_hexahedron(draft%connectivity, e)
      if (nodes(1) == nodes(2)) cycle
      x = draft%coordinates(:, nodes)
      if (any(x >= not_a_coordinate)) cycle
      if (is_box(x) .and. .not. has_middles(draft%connectivity%cell(e))) cycle
      determinants = jacobians_of(draft%coordinates, draft%connectivity, e)
      least = minval(determinants)
      if (least > 0.0_wp) cycle
      if (.not. keep_reading(reader)) return
      if (maxval(determinants) <= 0.0_wp) then
        call report(reader, draft%element_position(e), 'element '//to_text(draft%element_id(e))// &
          ' is inside out or flat (Jacobian '//to_text(least, 3)//'): wrong order of its nodes?')
      else
        call report(reader, draft%element_position(e), 'element '//to_text(draft%element_id(e))// &
          ' is too distorted: its Jacobian reaches '//to_text(least, 3)//misplaced_middle(draft, e))
      end if
    end do
  end subroutine check_elements

  !> Words on the node farthest from the middle of its edge, as part of the edge; none where the
  !> element is distorted with straight edges, too, or has no such nodes.
  function misplaced_middle(draft, e) result(words)
    type(mesh_draft_t), intent(in) :: draft
    integer, intent(in) :: e
    character(:), allocatable :: words
    real(wp), allocatable :: x(:, :) !! with all nodes in the middles of edges
    real(wp) :: off, farthest
    integer :: k, worst

    words = ''
    associate (cell => cells(draft%connectivity%cell(e)), &
               nodes => nodes_of_element(draft%connectivity, e))
      allocate (x, source=draft%coordinates)
      farthest = 0.0_wp
      worst = 0
      do k = 1, cell%n_nodes - cell%n_corners
        associate (ends => nodes(cell%edge(:, k)), middle => nodes(cell%n_corners + k))
          x(:, middle) = 0.5_wp*(x(:, ends(1)) + x(:, ends(2)))
          off = norm2(draft%coordinates(:, middle) - x(:, middle))/ &
            max(norm2(x(:, ends(2)) - x(:, ends(1))), tiny(1.0_wp))
          if (off <= farthest) cycle
          farthest = off
          worst = k
        end associate
      end do
      if (worst == 0) return
      if (any(jacobians_of(x, draft%connectivity, e) <= 0.0_wp)) return
      associate (ends => nodes(cell%edge(:, worst)))
        words = '; node '//to_text(draft%node_id(nodes(cell%n_corners + worst)))//' is '// &
          to_text(farthest, 2)//' edges from the middle of the edge of nodes '// &
          to_text(draft%node_id(ends(1)))//' and '//to_text(draft%node_id(ends(2)))// &
          ': wrong order of its mid-side nodes?'
      end associate
    end associate
  end function misplaced_middle

  !> Elements of a nearly incompressible material that lock: noted, and refused where contact
  !> pressures of theirs are noise. docs/theory.md section 8.
  subroutine check_locking(reader, draft, materials, material)
    type(reader_t), intent(inout) :: reader
    type(mesh_draft_t), intent(in) :: draft
    type(material_t), intent(in) :: materials(:)
    integer, intent(in) :: material(:) !! (n_elements) index into the materials; below 1: none
    ! From here on forces are a tenth too large; less the rounding of the constants. [-]
    real(wp), parameter :: stiff = 0.45_wp + 1.0e-9_wp
    real(wp) :: poisson
    integer :: e

    if (size(material) < draft%n_elements) return
    do e = 1, draft%n_elements
      associate (cell => draft%connectivity%cell(e))
        if (material(e) < 1 .or. draft%element_kind(e) /= kind_c3d8) cycle
        if (noise_from(cell) >= never) cycle
        associate (elastic => materials(material(e))%law%elastic)
          ! Without a Poisson's ratio, or its numbers could not be read.
          if (.not. elastic%is_isotropic .or. .not. elastic%shear > 0.0_wp) cycle
          poisson = 0.5_wp*elastic%lambda/(elastic%lambda + elastic%shear)
        end associate
        if (.not. poisson > stiff) cycle
        if (poisson > noise_from(cell)) then
          call report(reader, draft%element_position(e), 'element '// &
            to_text(draft%element_id(e))//' is a '//trim(cells(cell)%name)// &
            ", and locks with a Poisson's ratio of "//to_text(poisson, 4)//': mesh with '// &
            instead_of(draft%plane, cell))
        else
          call note(reader, 'elements of the '//trim(cells(cell)%name)// &
            " are too stiff with a Poisson's ratio of "//to_text(poisson, 4)//'; '// &
            instead_of(draft%plane, cell)//' would not be')
        end if
      end associate
      return
    end do
  end subroutine check_locking

  !> The elements that do not lock in the place of those of a cell.
  pure function instead_of(plane, cell) result(types)
    integer, intent(in) :: plane !! solids, plane_strain and its kin
    integer, intent(in) :: cell  !! row of the table of cells
    character(:), allocatable :: types

    if (plane /= solids) then
      types = names_of_planes(plane)//'8R'
    else
      types = trim(without_locking(cell))
    end if
  end function instead_of

  !> Whether an element is a box along the axes, its corners in their order: then all is well with
  !> it, and its sixteen determinants need not be computed.
  pure logical function is_box(x)
    real(wp), intent(in) :: x(3, hexahedron_nodes) !! nodes [length]
    integer :: a

    is_box = all(x(:, 7) > x(:, 1))
    do a = 1, hexahedron_nodes
      is_box = is_box .and. abs(x(1, a) - x(1, merge(1, 7, xi_node(a) < 0.0_wp))) <= 0.0_wp &
        .and. abs(x(2, a) - x(2, merge(1, 7, eta_node(a) < 0.0_wp))) <= 0.0_wp &
        .and. abs(x(3, a) - x(3, merge(1, 7, zeta_node(a) < 0.0_wp))) <= 0.0_wp
    end do
  end function is_box

  !> Fill the mesh; the draft is given up.
  subroutine build_mesh(draft, material, constraints, mesh)
    type(mesh_draft_t), intent(inout) :: draft
    type(constraints_t), intent(in) :: constraints
    integer, allocatable, intent(inout) :: material(:) !! (n_elements), given up
    type(mesh_t), intent(inout) :: mesh !! its springs in
    integer :: e

    mesh%n_nodes = draft%n_nodes
    mesh%n_stand_ins = draft%n_stand_ins
    mesh%n_elements = draft%n_elements
    mesh%coordinates = draft%coordinates(:, :draft%n_nodes)
    mesh%origin = draft%origin
    mesh%sector_angle = draft%sector_angle
    mesh%parts = draft%parts
    mesh%plane = draft%plane
    mesh%thickness = draft%thickness
    mesh%is_thickness_given = draft%is_thickness_given
    deallocate (draft%coordinates)
    mesh%node_id = draft%node_id(:draft%n_nodes)
    deallocate (draft%node_id)
    mesh%connectivity = some_elements(draft%connectivity, [(e, e=1, draft%n_elements)])
    draft%connectivity = connectivity_t()
    if (allocated(draft%piece_id)) then
      call move_alloc(draft%piece_id, mesh%element_id)
    else
      mesh%element_id = draft%element_id(:draft%n_elements)
    end if
    deallocate (draft%element_id)
    mesh%n_given = draft%n_nodes
    if (allocated(draft%between)) then
      mesh%n_given = draft%n_given
      call move_alloc(draft%between, mesh%between)
      call move_alloc(draft%place, mesh%place)
      if (allocated(draft%hangs)) mesh%hangs = [draft%hangs, &
        spread(.false., 1, draft%n_nodes - size(draft%hangs))]
    end if
    mesh%element_kind = draft%element_kind(:draft%n_elements)
    deallocate (draft%element_kind)
    call move_alloc(material, mesh%material)
    call move_alloc(draft%skin, mesh%skin)
    call find_bodies(mesh, constraints)
  end subroutine build_mesh

end module build_mesh_mod
