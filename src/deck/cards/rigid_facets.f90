!> Rigid bodies of facets: which elements they have, and the obstacles that their surfaces make.
module rigid_facets_mod
  use cards_mod, only: keep_reading, note, reader_t, report, report_missing_element
  use diagnostics_mod, only: quoted
  use equal_columns_mod, only: number_columns
  use facet_shape_mod, only: facet_is_flat
  use kinds_mod, only: wp
  use lookup_mod, only: find_id
  use mesh_draft_mod, only: is_connector, mesh_draft_t, no_facet, not_a_coordinate, &
    refused_element, rigid_facet, shell_facet, solids
  use obstacles_mod, only: obstacle_of_facets, obstacle_t
  use read_rigid_bodies_mod, only: rigid_bodies_t
  use sets_mod, only: find_set, model_t, report_unknown
  use small_matrix_mod, only: cross
  use surface_list_mod, only: has_facets, surface_list_t
  use text_mod, only: to_text
  implicit none
  private

  public :: find_facets, make_obstacles

  integer, parameter :: max_wrong = 5 !! wrong facets that have a message each

contains

  !> Find the facets of each rigid body, when sets are read.
  subroutine find_facets(reader, model, bodies)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(rigid_bodies_t), intent(inout) :: bodies
    integer :: b, set, n_wrong

    allocate (bodies%of_facet(model%mesh%n_skipped), source=0)
    allocate (bodies%node(4, model%mesh%n_skipped), source=0)
    n_wrong = 0
    do b = 1, size(bodies%list)
      associate (body => bodies%list(b))
        if (len(body%set) == 0 .or. body%is_solid) cycle
        set = find_set(model%element_sets, body%set)
        if (set == 0) then
          call report_unknown(reader, model%element_sets, body%position, body%set)
          cycle
        end if
        associate (of_set => model%element_sets%list(set))
          if (of_set%n > 0) then
            call report(reader, body%position, 'element set '//quoted(body%set)// &
              ' has solid elements (element '//to_text(model%mesh%element_id(of_set%members(1)))// &
              ') and others: a rigid body consists of solid elements or of facets (R3D3, R3D4, '// &
              'S3, S4)')
            if (of_set%n_skipped > 0) bodies%of_facet(of_set%skipped(:of_set%n_skipped)) = b
          else if (of_set%n_skipped == 0) then
            if (.not. of_set%flawed) call report(reader, body%position, 'element set '// &
              quoted(body%set)//' has no elements')
          else
            call take_facets(reader, model, of_set%skipped(:of_set%n_skipped), b, bodies, n_wrong)
          end if
        end associate
      end associate
    end do
    call report_left(reader, model%mesh, bodies)
  end subroutine find_facets

  !> Give a rigid body its facets.
  subroutine take_facets(reader, model, facets, b, bodies, n_wrong)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    integer, intent(in) :: facets(:)      !! indices into the skipped elements
    integer, intent(in) :: b
    type(rigid_bodies_t), intent(inout) :: bodies
    integer, intent(inout) :: n_wrong     !! wrong facets so far
    character(:), allocatable :: problem
    integer :: i

    problem = ''
    do i = 1, size(facets)
      associate (f => facets(i), draft => model%mesh)
        if (bodies%of_facet(f) == b) cycle ! named twice
        if (draft%plane /= solids) then
          bodies%of_facet(f) = b ! that a plane has no facets is reported with the rigid body
          cycle
        end if
        if (bodies%of_facet(f) > 0) then
          problem = 'belongs to the rigid bodies of '// &
            quoted(bodies%list(bodies%of_facet(f))%set)//' and '//quoted(bodies%list(b)%set)
        else
          call check_facet(model, f, bodies%node(:, f), problem)
        end if
        bodies%of_facet(f) = b
        if (problem == '') cycle
        n_wrong = n_wrong + 1
        if (n_wrong > max_wrong .or. .not. keep_reading(reader)) return
        call report(reader, draft%skipped_position(f), 'element '//to_text(draft%skipped_id(f))// &
          ' '//problem)
      end associate
    end do
  end subroutine take_facets

  !> The nodes of a facet; `problem` is empty unless they make none.
  subroutine check_facet(model, f, node, problem)
    type(model_t), intent(in) :: model
    integer, intent(in) :: f              !! index into the skipped elements
    integer, intent(out) :: node(4)
    character(:), allocatable, intent(out) :: problem
    integer :: last, n, i, k

    node = 0
    problem = ''
    associate (draft => model%mesh)
      if (draft%skipped_kind(f) == refused_element) return
      n = draft%skipped_corners(f)
      if (draft%skipped_kind(f) == no_facet .or. is_connector(draft%skipped_kind(f))) then
        problem = 'is no facet of a rigid body: R3D3, R3D4, S3 and S4 are'
        return
      end if
      last = draft%n_skipped_nodes
      if (f < draft%n_skipped) last = draft%skipped_first(f + 1) - 1
      if (last - draft%skipped_first(f) + 1 /= n) then
        problem = 'has '//to_text(n)//' nodes, found '// &
          to_text(last - draft%skipped_first(f) + 1)
        return
      end if
      do i = 1, n
        associate (id => draft%skipped_nodes(draft%skipped_first(f) + i - 1))
          k = find_id(draft%nodes, draft%node_id, id)
          if (k == 0) then
            problem = 'names node '//to_text(id)//', which is not defined'
          else if (any(node(:i - 1) == k)) then
            problem = 'names node '//to_text(id)//' twice'
          else if (model%used(k)) then
            problem = 'is a facet of a rigid body, and its node '//to_text(id)// &
              ' belongs to a solid element: a rigid body shares no nodes with others'
          end if
          if (problem /= '') return
          node(i) = k
        end associate
      end do
      if (any(draft%coordinates(:, node(:n)) >= not_a_coordinate)) return
      if (facet_is_flat(draft%coordinates(:, node(:n)))) problem = 'is flat or folded: its '// &
        'normal does not point to one side, or it has no area'
    end associate
  end subroutine check_facet

  !> Report rigid elements that no rigid body takes; shells are skipped then.
  subroutine report_left(reader, draft, bodies)
    type(reader_t), intent(inout) :: reader
    type(mesh_draft_t), intent(in) :: draft
    type(rigid_bodies_t), intent(in) :: bodies
    integer :: f, n_rigid, n_shells, first

    n_rigid = 0
    n_shells = 0
    first = 0
    do f = 1, draft%n_skipped
      if (bodies%of_facet(f) > 0) cycle
      if (draft%skipped_kind(f) == shell_facet) n_shells = n_shells + 1
      if (draft%skipped_kind(f) /= rigid_facet) cycle
      n_rigid = n_rigid + 1
      if (first == 0) first = f
    end do
    if (n_shells > 0 .and. size(bodies%list) > 0) call note(reader, to_text(n_shells)// &
      ' elements of shells that no *RIGID BODY takes are skipped: only solids are supported')
    if (n_rigid == 0 .or. any(bodies%list%ref_node == 0)) return
    call report(reader, draft%skipped_position(first), to_text(n_rigid)//' rigid elements '// &
      '(R3D3, R3D4) belong to no *RIGID BODY, ELSET=, REF NODE= (the first: element '// &
      to_text(draft%skipped_id(first))//')')
  end subroutine report_left

  !> Append an obstacle for each surface of facets. Where everything outside may touch, closed
  !> facets that no surface has are obstacles, too.
  subroutine make_obstacles(reader, model, takes_all, bodies, surfaces, obstacles)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    logical, intent(in) :: takes_all
    type(rigid_bodies_t), intent(inout) :: bodies
    type(surface_list_t), intent(inout) :: surfaces !! get their obstacles
    type(obstacle_t), allocatable, intent(inout) :: obstacles(:)
    type(obstacle_t), allocatable :: all(:)
    integer, allocatable :: sides(:, :)
    integer :: k, n, i, b
    logical :: ok

    n = 0
    do k = 1, surfaces%n
      if (has_facets(surfaces, k)) n = n + 1
    end do
    allocate (all(size(obstacles) + n + size(bodies%list)))
    n = size(obstacles)
    do i = 1, n
      all(i) = obstacles(i)
    end do
    do k = 1, surfaces%n
      if (.not. has_facets(surfaces, k)) cycle
      call find_body(reader, model, bodies, surfaces, k, b, ok)
      n = n + 1
      if (.not. ok) then
        all(n)%name = surfaces%list(k)%name
        cycle
      end if
      bodies%list(b)%is_seen = .true.
      surfaces%obstacle(k) = n
      all(n) = obstacle_of_sides(model%mesh, bodies, surfaces%list(k)%name, &
        surfaces%sides(k)%facet, bodies%list(b)%ref_node)
      i = size(surfaces%sides(k)%facet, 2) - size(all(n)%facet, 2)
      if (i > 0) call note(reader, to_text(i)//' facets of surface '// &
        quoted(surfaces%list(k)%name)//' repeat others and count once')
    end do
    do b = 1, size(bodies%list)
      if (bodies%list(b)%is_seen .or. len(bodies%list(b)%set) == 0 .or. &
        bodies%list(b)%is_solid) cycle
      if (.not. any(bodies%of_facet == b)) cycle ! was reported
      if (any(surfaces%flawed(:surfaces%n)) .or. model%mesh%plane /= solids) cycle
      if (takes_all) then
        call find_outside(model%mesh, bodies, b, sides)
        if (size(sides, 2) > 0) then
          n = n + 1
          all(n) = obstacle_of_sides(model%mesh, bodies, bodies%list(b)%set, sides, &
            bodies%list(b)%ref_node)
          cycle
        end if
      end if
      call report(reader, bodies%list(b)%position, 'no *SURFACE has facets of rigid body '// &
        quoted(bodies%list(b)%set)//trim(merge(', and they are not closed', repeat(' ', 25), &
        takes_all))//': it can touch nothing', &
        'a surface of a rigid body: *SURFACE, NAME=name with the line '//bodies%list(b)%set// &
        ', SPOS')
    end do
    all = all(:n)
    call move_alloc(all, obstacles)
  end subroutine make_obstacles

  !> The outer sides of the facets of a rigid body that are closed and all turned outwards, or all
  !> inwards: each edge is of two of them, once in each direction.
  subroutine find_outside(draft, bodies, b, sides)
    type(mesh_draft_t), intent(in) :: draft
    type(rigid_bodies_t), intent(in) :: bodies
    integer, intent(in) :: b
    integer, allocatable, intent(out) :: sides(:, :) !! (2,n) as of sides_t; none: they are not so
    integer, allocatable :: facets(:), edge(:, :), first(:)
    integer :: i, k, n, m
    real(wp) :: volume

    allocate (sides(2, 0))
    facets = pack([(i, i=1, size(bodies%of_facet))], bodies%of_facet == b)
    allocate (edge(2, 8*size(facets)))
    m = 0
    volume = 0.0_wp
    do i = 1, size(facets)
      associate (node => bodies%node(:, facets(i)))
        n = count(node > 0)
        do k = 1, n
          m = m + 1
          edge(:, m) = [node(k), node(1 + mod(k, n))]
        end do
        do k = 3, n
          associate (a => draft%coordinates(:, node(1)), c => draft%coordinates(:, node(k - 1)), &
                     d => draft%coordinates(:, node(k)))
            volume = volume + dot_product(a, cross(c, d))
          end associate
        end do
      end associate
    end do
    edge(:, m + 1:2*m) = edge([2, 1], :m)
    call number_columns(edge(:, :2*m), first)
    do i = 1, m
      if (first(i) /= i .or. first(m + i) > m) return
    end do
    sides = reshape([(facets(i), merge(1, 2, volume > 0.0_wp), i=1, size(facets))], &
      [2, size(facets)])
  end subroutine find_outside

  !> The rigid body whose facets a surface has.
  subroutine find_body(reader, model, bodies, surfaces, k, b, ok)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(rigid_bodies_t), intent(in) :: bodies
    type(surface_list_t), intent(inout) :: surfaces !! becomes flawed where there is not one
    integer, intent(in) :: k          !! the surface
    integer, intent(out) :: b
    logical, intent(out) :: ok        !! false: a mistake was reported
    integer :: i

    b = 0
    associate (facets => surfaces%sides(k)%facet(1, :), draft => model%mesh)
      ok = size(facets) > 0
      do i = 1, size(facets)
        if (i == 1) b = bodies%of_facet(facets(i))
        ok = bodies%of_facet(facets(i)) == b .and. b > 0
        if (ok) cycle
        if (bodies%of_facet(facets(i)) == 0) then
          ! Rigid elements without a rigid body were reported, and facets of cards with mistakes.
          if (draft%skipped_kind(facets(i)) /= rigid_facet .and. .not. &
              any(bodies%list%ref_node == 0)) call report_missing_element(reader, &
            draft%skipped_position(facets(i)), 'element '// &
            to_text(draft%skipped_id(facets(i)))//' of surface '// &
            quoted(surfaces%list(k)%name)//' belongs to no *RIGID BODY')
        else
          call report(reader, bodies%list(bodies%of_facet(facets(i)))%position, 'surface '// &
            quoted(surfaces%list(k)%name)//' has facets of two rigid bodies: element '// &
            to_text(draft%skipped_id(facets(i)))//' is of another than element '// &
            to_text(draft%skipped_id(facets(1))))
        end if
        exit
      end do
    end associate
    if (.not. ok) surfaces%flawed(k) = .true.
  end subroutine find_body

  !> The facets of a surface, turned to its side, with corners of their own.
  type(obstacle_t) function obstacle_of_sides(draft, bodies, name, sides, ref_node) result(obstacle)
    type(mesh_draft_t), intent(in) :: draft
    type(rigid_bodies_t), intent(in) :: bodies
    character(*), intent(in) :: name
    integer, intent(in) :: sides(:, :) !! (2,n) as of sides_t
    integer, intent(in) :: ref_node
    integer, allocatable :: corner_of(:), nodes(:), facet(:, :)
    integer :: i, a, n, corners, node(4)

    allocate (corner_of(draft%n_nodes), source=0)
    allocate (nodes(4*size(sides, 2)))
    allocate (facet(4, size(sides, 2)), source=0)
    n = 0
    do i = 1, size(sides, 2)
      node = bodies%node(:, sides(1, i))
      corners = count(node > 0)
      if (sides(2, i) == 2) node(:corners) = node(corners:1:-1)
      do a = 1, corners
        if (corner_of(node(a)) == 0) then
          n = n + 1
          nodes(n) = node(a)
          corner_of(node(a)) = n
        end if
        facet(a, i) = corner_of(node(a))
      end do
    end do
    obstacle = obstacle_of_facets(name, draft%coordinates(:, nodes(:n)), facet, ref_node)
  end function obstacle_of_sides

end module rigid_facets_mod
