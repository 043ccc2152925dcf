!> Bolts that are cut at a surface of their elements (*PRE-TENSION SECTION).
!>
!> The nodes of the surface are doubled: elements on its side get the new ones, x+ for x-. The parts
!> move against each other along the normal n alone, by the displacement delta of a reference node:
!>
!>     u+ = u- + n delta
!>
!> A force on the reference node along dof 1 is the tension of the bolt. docs/theory.md section 11.
module pretension_mod
  use cards_mod, only: reader_t, report
  use cells_mod, only: cells
  use connectivity_mod, only: all_nodes_of_face, nodes_of_element, nodes_of_face
  use equal_columns_mod, only: number_columns
  use equation_list_mod, only: add_equation, equation_list_t
  use faces_mod, only: face_area_vectors
  use growing_lists_mod, only: append
  use kinds_mod, only: wp
  use local_refinement_mod, only: parents_of
  use mesh_draft_mod, only: add_node_beside
  use sets_mod, only: extend_marks, model_t
  use sorting_mod, only: sort_ascending
  use text_mod, only: to_text
  implicit none
  private

  public :: section_t, cut_at_section, join_sections

  !> A *PRE-TENSION SECTION.
  type :: section_t
    integer :: node = 0                !! the reference node; 0: an error was reported
    character(:), allocatable :: surface_name
    real(wp) :: normal(3) = 0.0_wp
    !! from the elements of the surface outwards; 0: as the mean [-]
    integer, allocatable :: faces(:, :) !! (2,n) element, face 1..6
    integer, allocatable :: twins(:, :) !! (2,k) the node of the elements of the surface, the other
    integer :: position = 0, surface_position = 0, node_position = 0 !! in the deck
  end type section_t

  real(wp), parameter :: rounding = 1.0e-12_wp !! components of unit normals below it are 0 [-]

contains

  !> Double the nodes of a section; report a section that does not cut a body.
  subroutine cut_at_section(reader, model, section)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(inout) :: model
    type(section_t), intent(inout) :: section
    logical, allocatable :: is_cut(:)
    integer, allocatable :: owner(:, :) !! (2,m) element, node of a section
    integer, allocatable :: parent(:)   !! (m) elements at a node that faces connect
    integer, allocatable :: side(:)     !! (m) of a root: 1 that of the surface, 2 the other
    integer, allocatable :: new_node(:)
    integer :: i, k, n_before
    logical :: ok

    allocate (section%twins(2, 0))
    allocate (is_cut(0:model%mesh%n_nodes), source=.false.)
    do i = 1, size(section%faces, 2)
      is_cut(all_nodes_of_face(model%mesh%connectivity, section%faces(1, i), section%faces(2, &
        i))) = .true.
    end do
    is_cut(0) = .false.
    call refuse_hanging_nodes(reader, model, section, is_cut, ok)
    if (.not. ok) return
    call find_sides(reader, model, section, is_cut, owner, parent, side, ok)
    if (ok) call find_normal(reader, model, section, ok)
    if (.not. ok) return
    n_before = model%mesh%n_nodes
    allocate (new_node(n_before), source=0)
    do k = 1, size(owner, 2)
      if (side(root_of(parent, k)) /= 1) cycle
      associate (node => owner(2, k))
        if (new_node(node) == 0) then
          call add_node_beside(model%mesh, node, section%position, ok)
          if (.not. ok) then
            call report(reader, section%position, 'there is no room for another node')
            return
          end if
          new_node(node) = model%mesh%n_nodes
          section%twins = reshape([section%twins, new_node(node), node], &
            [2, size(section%twins, 2) + 1])
        end if
        associate (first => model%mesh%connectivity%first(owner(1, k)), &
                   last => model%mesh%connectivity%first(owner(1, k) + 1) - 1)
          where (model%mesh%connectivity%node(first:last) == node) &
            model%mesh%connectivity%node(first:last) = new_node(node)
        end associate
      end associate
    end do
    call extend_marks(model, model%mesh%n_nodes - n_before, .true.)
    if (allocated(model%mesh%hangs)) model%mesh%hangs = [model%mesh%hangs, &
      spread(.false., 1, model%mesh%n_nodes - size(model%mesh%hangs))]
    if (.not. allocated(model%twins)) allocate (model%twins(2, 0))
    model%twins = reshape([model%twins, section%twins], &
      [2, size(model%twins, 2) + size(section%twins, 2)])
  end subroutine cut_at_section

  !> The unit normal: what the deck says, or the mean of the faces, each by its area.
  subroutine find_normal(reader, model, section, ok)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(section_t), intent(inout) :: section
    logical, intent(out) :: ok !! false: an error was reported
    real(wp) :: mean(3), vector(3), total
    integer, allocatable :: nodes(:)
    integer :: i

    mean = 0.0_wp
    total = 0.0_wp
    do i = 1, size(section%faces, 2)
      nodes = all_nodes_of_face(model%mesh%connectivity, section%faces(1, i), section%faces(2, i))
      vector = sum(face_area_vectors(model%mesh%coordinates(:, pack(nodes, nodes > 0))), 2)
      mean = mean + vector
      total = total + norm2(vector)
    end do
    ok = norm2(mean) > sqrt(epsilon(1.0_wp))*total
    if (.not. ok) then
      call report(reader, section%surface_position, 'the faces of '//section%surface_name// &
        ' have no mean normal: they surround a volume')
      return
    end if
    if (.not. norm2(section%normal) > 0.0_wp) section%normal = mean
    section%normal = section%normal/norm2(section%normal)
    where (abs(section%normal) < rounding) section%normal = 0.0_wp
    section%normal = section%normal/norm2(section%normal)
  end subroutine find_normal

  !> Report a section beside which elements are refined on one side only.
  subroutine refuse_hanging_nodes(reader, model, section, is_cut, ok)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(section_t), intent(in) :: section
    logical, intent(in) :: is_cut(0:)
    logical, intent(out) :: ok !! false: an error was reported
    integer :: node

    ok = .true.
    if (.not. allocated(model%mesh%hangs)) return
    do node = 1, size(model%mesh%hangs)
      if (.not. model%mesh%hangs(node)) cycle
      ok = .not. (is_cut(node) .or. any(is_cut(parents_of(model%mesh%between(:, node - &
        model%mesh%n_given)))))
      if (ok) cycle
      call report(reader, section%position, 'elements are refined beside some faces of '// &
        section%surface_name//' only: refine all around it, or farther from it')
      return
    end do
  end subroutine refuse_hanging_nodes

  !> Find which side of a section each element is on. Elements that share a face are on the same
  !> side, unless the face belongs to the section.
  subroutine find_sides(reader, model, section, is_cut, owner, parent, side, ok)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(section_t), intent(in) :: section
    logical, intent(in) :: is_cut(0:)
    integer, allocatable, intent(out) :: owner(:, :), parent(:), side(:)
    logical, intent(out) :: ok !! false: an error was reported
    integer, allocatable :: key(:, :), face(:, :), number(:), first(:)
    logical, allocatable :: of_section(:), is_met(:)
    integer :: e, f, i, j, n, m, a, b
    integer :: corners(4)

    n = 0
    m = 0
    allocate (face(2, 64), owner(2, 64))
    allocate (first(model%mesh%n_elements), source=0)
    do e = 1, model%mesh%n_elements
      associate (nodes => nodes_of_element(model%mesh%connectivity, e))
        if (.not. any(is_cut(nodes))) cycle
        first(e) = m + 1
        do i = 1, size(nodes)
          if (.not. is_cut(nodes(i)) .or. any(nodes(:i - 1) == nodes(i))) cycle
          call append(owner, m, [e, nodes(i)])
        end do
      end associate
      do f = 1, cells(model%mesh%connectivity%cell(e))%n_faces
        if (any(is_cut(nodes_of_face(model%mesh%connectivity, e, f)))) call append(face, n, &
          [e, f])
      end do
    end do
    owner = owner(:, :m)
    allocate (key(4, n), of_section(n), is_met(n))
    do i = 1, n
      corners = nodes_of_face(model%mesh%connectivity, face(1, i), face(2, i))
      call sort_ascending(corners)
      key(:, i) = corners
      of_section(i) = .false.
    end do
    call number_columns(key, number)
    do i = 1, size(section%faces, 2)
      do j = 1, n
        if (any(face(:, j) /= section%faces(:, i))) cycle
        ok = .not. of_section(number(j))
        of_section(number(j)) = .true.
        if (ok) cycle
        call report(reader, section%surface_position, section%surface_name//' names a face of '// &
          'element '//to_text(model%mesh%element_id(face(1, j)))//' from both of its sides', &
          'name the faces of the elements on one side of the cut')
        return
      end do
    end do
    parent = [(i, i=1, m)]
    is_met = .false.
    do i = 1, n
      if (number(i) == i) cycle
      is_met(number(i)) = .true.
      if (of_section(number(i))) cycle
      associate (nodes => all_nodes_of_face(model%mesh%connectivity, face(1, i), face(2, i)))
        do j = 1, size(nodes)
          if (.not. is_cut(nodes(j))) cycle
          a = root_of(parent, at(face(1, i), nodes(j)))
          b = root_of(parent, at(face(1, number(i)), nodes(j)))
          parent(max(a, b)) = min(a, b)
        end do
      end associate
    end do
    allocate (side(m), source=0)
    ok = .true.
    do i = 1, size(section%faces, 2)
      associate (nodes => all_nodes_of_face(model%mesh%connectivity, section%faces(1, i), &
                 section%faces(2, i)))
        do j = 1, size(nodes)
          if (nodes(j) > 0) side(root_of(parent, at(section%faces(1, i), nodes(j)))) = 1
        end do
      end associate
    end do
    do i = 1, n
      if (.not. of_section(number(i)) .or. .not. ok) cycle
      if (.not. is_met(number(i))) then
        ok = .false.
        call report(reader, section%surface_position, 'element '//to_text( &
          model%mesh%element_id(face(1, i)))//' has a face of '//section%surface_name// &
          ' with no element behind it: a section cuts through a body', &
          'name the faces of the elements on one side of the cut, within the bolt')
        return
      end if
      if (any([(all(section%faces(:, j) == face(:, i)), j=1, size(section%faces, 2))])) cycle
      associate (nodes => all_nodes_of_face(model%mesh%connectivity, face(1, i), face(2, i)))
        do j = 1, size(nodes)
          if (nodes(j) == 0) cycle
          if (side(root_of(parent, at(face(1, i), nodes(j)))) /= 1) cycle
          ok = .false.
          call report(reader, section%surface_position, section%surface_name// &
            ' does not cut through the body: elements connect its sides at node '// &
            to_text(model%mesh%node_id(nodes(j))), 'name the faces of all elements on one side '// &
            'of the cut, and none of those on the other')
          return
        end do
      end associate
    end do

  contains

    !> Where an element's node of the section stands.
    pure integer function at(element, node)
      integer, intent(in) :: element, node

      at = first(element)
      do while (owner(2, at) /= node)
        at = at + 1
      end do
    end function at

  end subroutine find_sides

  pure integer function root_of(parent, i) result(root)
    integer, intent(in) :: parent(:)
    integer, intent(in) :: i

    root = i
    do while (parent(root) /= root)
      root = parent(root)
    end do
  end function root_of

  !> The equations of sections, behind those of the deck and of couplings.
  pure subroutine join_sections(sections, equations)
    type(section_t), intent(in) :: sections(:)
    type(equation_list_t), intent(inout) :: equations
    integer :: k, i, dof

    do k = 1, size(sections)
      if (.not. allocated(sections(k)%twins)) cycle
      associate (of => sections(k))
        do i = 1, size(of%twins, 2)
          do dof = 1, 3
            call add_equation(equations, of%position, [of%twins(:, i), of%node], [dof, dof, 1], &
              [1.0_wp, of%normal(dof)])
          end do
        end do
      end associate
    end do
  end subroutine join_sections

end module pretension_mod
