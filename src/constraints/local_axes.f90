!> Local directions at nodes, as *TRANSFORM gives them: what the deck says along these, said along
!> x, y, z. docs/theory.md (11.14).
!>
!> Where local directions are axes, turned about or not, a local degree of freedom is one along an
!> axis. At another node what supports or equations say of it,
!>
!>     sum over i of a(l,i) u_i = right-hand side     one for each local direction l that they name,
!>
!> is solved for as many of its degrees of freedom, which depend on the others. Supports prescribe
!> the right-hand side: the displacement of a node that stands in for the local directions. Forces
!> along these are put on it, too, and go over to x, y, z with the loads.
module local_axes_mod
  use cards_mod, only: keep_reading, reader_t, report
  use constraints_mod, only: constraints_t
  use equation_list_mod, only: add_equation, dof_in_words, equation_list_t, &
    held_though_dependent
  use kinds_mod, only: wp
  use loads_mod, only: load_step_t, nodal_value_t
  use mesh_draft_mod, only: add_node_beside
  use scene_mod, only: local_axes_t
  use sets_mod, only: model_t
  use small_matrix_mod, only: cross
  use text_mod, only: to_text
  implicit none
  private

  public :: transform_t, transforms_t, gives_directions, take_transforms, along_directions

  real(wp), parameter :: apart = 1.0e-8_wp    !! sine of the least angle between two points [-]
  real(wp), parameter :: nothing = 1.0e-14_wp !! of a direction: rounding [-]
  real(wp), parameter :: on_axis = 1.0e-9_wp  !! of the way to the axis' points: on it [-]
  real(wp), parameter :: regular = 1.0e-10_wp !! of a direction: what can be solved for [-]

  !> A *TRANSFORM.
  type :: transform_t
    integer :: position = 0                     !! in the deck
    logical :: cylindrical = .false.            !! else rectangular
    real(wp) :: a(3) = 0.0_wp, b(3) = 0.0_wp    !! its two points [length]
  end type transform_t

  !> All of a deck.
  type :: transforms_t
    type(transform_t), allocatable :: list(:)
    integer, allocatable :: of_node(:) !! (n_nodes) 0: x, y, z; not allocated: no node has any other
  end type transforms_t

  ! What local directions at a node come to.
  integer, parameter :: in_place = 1 !! nothing else moves the node: its values are local ones
  integer, parameter :: along_axes = 2
  integer, parameter :: aslant = 3

  !> A node of which the deck names local degrees of freedom.
  type :: local_node_t
    integer :: node = 0
    integer :: kind = aslant
    integer :: stand_in = 0               !! 0: none is needed
    integer :: position = 0               !! of the *TRANSFORM
    real(wp) :: axes(3, 3) = 0.0_wp       !! rows: local directions [-]
    integer :: dof(3) = 0                 !! along axes: the axis of each direction
    logical :: held(3) = .false., loaded(3) = .false.
    integer :: equation(3) = 0            !! of the deck's, whose first term each is
  end type local_node_t

  !> The right-hand side of what is said along a local direction.
  type :: side_t
    integer :: n = 0
    integer, allocatable :: node(:), dof(:) !! (n)
    real(wp), allocatable :: weight(:)      !! (n) [-]
  end type side_t

contains

  !> Whether the two points give directions: an axis, or a plane through the origin.
  pure logical function gives_directions(transform)
    type(transform_t), intent(in) :: transform

    associate (a => transform%a, b => transform%b)
      if (transform%cylindrical) then
        gives_directions = norm2(b - a) > epsilon(1.0_wp)*max(norm2(a), norm2(b))
      else
        gives_directions = norm2(cross(a, b)) > apart*norm2(a)*norm2(b)
      end if
    end associate
  end function gives_directions

  !> Vectors at nodes, given along x, y, z: along the local directions of each node.
  pure subroutine along_directions(transforms, coordinates, vectors)
    type(transforms_t), intent(in) :: transforms
    real(wp), intent(in) :: coordinates(:, :) !! (3,n_nodes) [length]
    real(wp), intent(inout) :: vectors(:, :)  !! (3,n_nodes)
    real(wp) :: axes(3, 3)
    integer :: node
    logical :: ok

    if (.not. allocated(transforms%of_node)) return
    do node = 1, min(size(vectors, 2), size(transforms%of_node))
      if (transforms%of_node(node) == 0) cycle
      associate (transform => transforms%list(transforms%of_node(node)))
        if (.not. gives_directions(transform)) cycle
        call find_axes(transform, coordinates(:, node), axes, ok)
      end associate
      if (ok) vectors(:, node) = matmul(axes, vectors(:, node))
    end do
  end subroutine along_directions

  !> Say along x, y, z what equations and steps say along local directions. Nodes that stand in for
  !> these are added to the mesh, behind all others.
  subroutine take_transforms(reader, model, transforms, n_deck, ties, equations, steps, axes)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(inout) :: model
    type(transforms_t), intent(inout) :: transforms
    integer, intent(in) :: n_deck                    !! equations of the deck; then of couplings
    type(constraints_t), intent(in) :: ties
    type(equation_list_t), intent(inout) :: equations
    type(load_step_t), intent(inout) :: steps(:)
    type(local_axes_t), allocatable, intent(out) :: axes(:) !! not allocated: none
    type(local_node_t), allocatable :: list(:)
    integer :: number(model%mesh%n_nodes), n_mistakes, node

    if (.not. allocated(transforms%of_node)) return
    if (allocated(model%mesh%hangs)) call leave_out_hanging(model, transforms, steps)
    if (allocated(equations%cyclic)) call leave_out_sides(model, transforms, equations, steps)
    n_mistakes = reader%diagnostics%n_mistakes
    do node = 1, size(number)
      if (model%rotation_node(node) == 0) cycle
      transforms%of_node(model%rotation_node(node)) = transforms%of_node(node)
    end do
    call find_nodes(transforms, n_deck, equations, steps, list, number)
    call choose_ways(reader, model, transforms, n_deck, ties, equations, list)
    if (reader%diagnostics%n_mistakes > n_mistakes) return
    call add_stand_ins(reader, model, list)
    if (reader%diagnostics%n_mistakes > n_mistakes) return
    call turn_equations(reader, model, list, number, n_deck, equations)
    call turn_values(list, number, steps)
    call list_axes(list, axes)
  end subroutine take_transforms

  !> Nodes that hang go with others, which have local directions: they have none, and no support
  !> along them.
  pure subroutine leave_out_hanging(model, transforms, steps)
    type(model_t), intent(in) :: model
    type(transforms_t), intent(inout) :: transforms
    type(load_step_t), intent(inout) :: steps(:)
    logical :: leaves(size(transforms%of_node))

    leaves = .false.
    leaves(:size(model%mesh%hangs)) = model%mesh%hangs
    leaves = leaves .and. transforms%of_node > 0
    where (leaves) transforms%of_node = 0
    call leave_out_supports(leaves, steps)
  end subroutine leave_out_hanging

  !> Supports along local directions at the first side of a sector, where its partner is held alike
  !> along directions that are turned as the sector is: they follow from those.
  pure subroutine leave_out_sides(model, transforms, equations, steps)
    type(model_t), intent(in) :: model
    type(transforms_t), intent(in) :: transforms
    type(equation_list_t), intent(in) :: equations
    type(load_step_t), intent(inout) :: steps(:)
    logical :: leaves(size(transforms%of_node))
    real(wp) :: turn(3, 3), axes(3, 3), of_partner(3, 3)
    integer :: c, k, partner
    logical :: ok(2)

    leaves = .false.
    turn = 0.0_wp
    associate (all => equations%list, x => model%mesh%coordinates, of => transforms%of_node)
      do c = 1, all%n
        if (.not. any(equations%cyclic == equations%position(c))) cycle
        if (all%dof(c) == 1) turn = 0.0_wp
        do k = all%first(c), all%first(c + 1) - 1
          turn(all%dof(c), all%master_dof(k)) = all%weight(k)
        end do
        partner = all%master(all%first(c))
        if (all%dof(c) < 3 .or. partner == all%node(c)) cycle
        if (min(of(partner), of(all%node(c))) == 0) cycle
        call find_axes(transforms%list(of(all%node(c))), x(:, all%node(c)), axes, ok(1))
        call find_axes(transforms%list(of(partner)), x(:, partner), of_partner, ok(2))
        leaves(all%node(c)) = ok(1) .and. ok(2) .and. maxval(abs(matmul(axes, turn) - &
          of_partner)) <= apart .and. are_held_alike(steps, all%node(c), partner)
      end do
    end associate
    call leave_out_supports(leaves, steps)
  end subroutine leave_out_sides

  !> Take away what supports prescribe of some nodes.
  pure subroutine leave_out_supports(leaves, steps)
    logical, intent(in) :: leaves(:)             !! (n_nodes)
    type(load_step_t), intent(inout) :: steps(:)
    integer :: step

    do step = 1, size(steps)
      associate (boundary => steps(step)%boundary)
        steps(step)%boundary = pack(boundary, .not. leaves(boundary%node))
      end associate
    end do
  end subroutine leave_out_supports

  !> Whether all steps prescribe the same of two nodes, degree by degree.
  pure logical function are_held_alike(steps, one, other) result(alike)
    type(load_step_t), intent(in) :: steps(:)
    integer, intent(in) :: one, other !! nodes
    real(wp), parameter :: rounding = 1.0e-12_wp !! of a value [-]
    integer :: step, i

    alike = .true.
    do step = 1, size(steps)
      associate (b => steps(step)%boundary)
        if (count(b%node == one) /= count(b%node == other)) alike = .false.
        do i = 1, size(b)
          if (b(i)%node /= one) cycle
          alike = alike .and. any(b%node == other .and. b%dof == b(i)%dof .and. b%amplitude == &
            b(i)%amplitude .and. (b%fixed .eqv. b(i)%fixed) .and. abs(b%value - b(i)%value) <= &
            rounding*abs(b(i)%value))
        end do
      end associate
    end do
  end function are_held_alike

  !> The nodes of which steps or equations of the deck name local degrees of freedom, in ascending
  !> order.
  pure subroutine find_nodes(transforms, n_deck, equations, steps, list, number)
    type(transforms_t), intent(in) :: transforms
    integer, intent(in) :: n_deck
    type(equation_list_t), intent(in) :: equations
    type(load_step_t), intent(in) :: steps(:)
    type(local_node_t), allocatable, intent(out) :: list(:)
    integer, intent(out) :: number(:)     !! (n_nodes) in the list, 0 of others
    logical, dimension(3, size(number)) :: held, loaded, named
    integer :: equation(3, size(number)), step, c, k, node, n

    held = .false.
    loaded = .false.
    named = .false.
    equation = 0
    do step = 1, size(steps)
      do k = 1, size(steps(step)%boundary)
        held(steps(step)%boundary(k)%dof, steps(step)%boundary(k)%node) = .true.
      end do
      do k = 1, size(steps(step)%forces)
        loaded(steps(step)%forces(k)%dof, steps(step)%forces(k)%node) = .true.
      end do
    end do
    associate (all => equations%list)
      do c = n_deck, 1, -1
        equation(all%dof(c), all%node(c)) = c
        do k = all%first(c), all%first(c + 1) - 1
          named(all%master_dof(k), all%master(k)) = .true.
        end do
      end do
    end associate
    named = named .or. held .or. loaded .or. equation > 0
    number = 0
    n = 0
    do node = 1, size(number)
      if (transforms%of_node(node) == 0 .or. .not. any(named(:, node))) cycle
      n = n + 1
      number(node) = n
    end do
    allocate (list(n))
    do node = 1, size(number)
      if (number(node) == 0) cycle
      associate (new => list(number(node)))
        new%node = node
        new%held = held(:, node)
        new%loaded = loaded(:, node)
        new%equation = equation(:, node)
        new%position = transforms%list(transforms%of_node(node))%position
      end associate
    end do
  end subroutine find_nodes

  !> The directions at each node, and what they come to; report what cannot have any.
  subroutine choose_ways(reader, model, transforms, n_deck, ties, equations, list)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(transforms_t), intent(in) :: transforms
    integer, intent(in) :: n_deck
    type(constraints_t), intent(in) :: ties
    type(equation_list_t), intent(in) :: equations
    type(local_node_t), intent(inout) :: list(:)
    logical, dimension(3, model%mesh%n_nodes) :: depends, named !! by ties and couplings
    integer :: k, l, told
    logical :: ok

    depends = .false.
    named = .false.
    told = 0
    call mark(ties, 1)
    call mark(equations%list, n_deck + 1)
    do k = 1, size(list)
      if (.not. keep_reading(reader)) return
      associate (of => list(k), node => list(k)%node)
        call find_axes(transforms%list(transforms%of_node(node)), model%mesh%coordinates(:, node), &
          of%axes, ok)
        if (.not. ok) then
          call tell(of%position, 'node '//to_text(model%mesh%node_id(node))//' lies on the '// &
            'axis: no direction leads away from it there')
        else if (.not. (model%used(node) .or. any(named(:, node)))) then
          of%kind = in_place
        else if (.not. (model%used(node) .or. all(named(:, node)))) then
          call tell(of%position, dof_in_words(model, node, findloc(named(:, node), .false., &
            dim=1))//' is not coupled: only where all are can the node have local directions')
        else
          call find_axis_of_each(of)
          ok = .not. any(depends(:, node)) .or. of%kind == along_axes
          if (.not. ok .and. (any(of%held) .or. any(of%equation > 0))) call tell(of%position, &
            'node '//to_text(model%mesh%node_id(node))//' goes with others, by a tie or a '// &
            'coupling: along local directions it can neither be held nor be the first term of '// &
            'an equation')
        end if
        l = findloc(of%held .and. of%equation > 0, .true., dim=1)
        if (l > 0 .and. of%kind == aslant) call tell(equations%position(of%equation(l)), &
          dof_in_words(model, node, l)//held_though_dependent)
      end associate
    end do

  contains

    !> Of a card the first is enough.
    subroutine tell(position, message)
      integer, intent(in) :: position
      character(*), intent(in) :: message

      if (position /= told) call report(reader, position, message)
      told = position
    end subroutine tell

    subroutine mark(constraints, first)
      type(constraints_t), intent(in) :: constraints
      integer, intent(in) :: first !! constraint that is looked at
      integer :: c, m

      do c = first, constraints%n
        depends(constraints%dof(c), constraints%node(c)) = .true.
        named(constraints%dof(c), constraints%node(c)) = .true.
        do m = constraints%first(c), constraints%first(c + 1) - 1
          named(constraints%master_dof(m), constraints%master(m)) = .true.
        end do
      end do
    end subroutine mark

  end subroutine choose_ways

  !> The local directions at a place.
  pure subroutine find_axes(transform, x, axes, ok)
    type(transform_t), intent(in) :: transform
    real(wp), intent(in) :: x(3)         !! [length]
    real(wp), intent(out) :: axes(3, 3)  !! rows [-]
    logical, intent(out) :: ok           !! false: on the axis
    real(wp) :: arm(3), way

    ok = .true.
    associate (a => transform%a, b => transform%b)
      if (transform%cylindrical) then
        axes(3, :) = (b - a)/norm2(b - a)
        arm = x - a
        way = max(norm2(arm), norm2(b - a))
        arm = arm - dot_product(arm, axes(3, :))*axes(3, :)
        ok = norm2(arm) > on_axis*way
        if (.not. ok) arm = [1.0_wp, 0.0_wp, 0.0_wp]
        axes(1, :) = arm/norm2(arm)
      else
        axes(1, :) = a/norm2(a)
        axes(3, :) = cross(a/norm2(a), b/norm2(b))
        axes(3, :) = axes(3, :)/norm2(axes(3, :))
      end if
      axes(2, :) = cross(axes(3, :), axes(1, :))
    end associate
    where (abs(axes) <= nothing) axes = 0.0_wp
  end subroutine find_axes

  !> Which axis each local direction is, if all are axes.
  pure subroutine find_axis_of_each(of)
    type(local_node_t), intent(inout) :: of
    integer :: l

    of%kind = aslant
    if (count(abs(of%axes) > 0.0_wp) > 3) return
    of%kind = along_axes
    do l = 1, 3
      of%dof(l) = maxloc(abs(of%axes(l, :)), dim=1)
    end do
  end subroutine find_axis_of_each

  !> Add the nodes that stand in for local directions which are held or loaded.
  subroutine add_stand_ins(reader, model, list)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(inout) :: model
    type(local_node_t), intent(inout) :: list(:)
    integer :: k
    logical :: ok

    do k = 1, size(list)
      if (list(k)%kind /= aslant .or. .not. (any(list(k)%held) .or. any(list(k)%loaded))) cycle
      call add_node_beside(model%mesh, list(k)%node, list(k)%position, ok)
      if (.not. ok) then
        call report(reader, list(k)%position, 'there is no room for the nodes of local directions')
        return
      end if
      model%mesh%n_stand_ins = model%mesh%n_stand_ins + 1
      list(k)%stand_in = model%mesh%n_nodes
    end do
  end subroutine add_stand_ins

  !> The deck's equations between degrees of freedom along x, y, z, those that say what supports
  !> hold aslant, then those of couplings.
  subroutine turn_equations(reader, model, list, number, n_deck, equations)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(local_node_t), intent(in) :: list(:)
    integer, intent(in) :: number(:) !! (n_nodes) in the list, 0 of others
    integer, intent(in) :: n_deck
    type(equation_list_t), intent(inout) :: equations
    type(equation_list_t) :: turned
    type(side_t) :: side
    integer :: c, k, first, n_mistakes
    real(wp) :: factor

    n_mistakes = reader%diagnostics%n_mistakes
    do c = 1, n_deck
      if (reader%diagnostics%n_mistakes > n_mistakes) return
      associate (node => equations%list%node(c), dof => equations%list%dof(c))
        side = side_of(equations%list, c, list, number)
        first = dof
        factor = 1.0_wp
        if (number(node) > 0) then
          associate (of => list(number(node)))
            if (of%kind == aslant) then
              if (of%equation(dof) /= c) call report(reader, equations%position(c), &
                dof_in_words(model, node, dof)//' depends on others already, by an equation: '// &
                'it can be the first term of one equation only')
              cycle
            end if
            if (of%kind == along_axes) then
              first = of%dof(dof)
              factor = of%axes(dof, first)
            end if
          end associate
        end if
        call add_equation(turned, equations%position(c), [node, side%node], [first, side%dof], &
          factor*side%weight)
      end associate
    end do
    do k = 1, size(list)
      if (list(k)%kind == aslant) call solve_node(reader, model, list(k), equations, list, number, &
        turned)
      if (reader%diagnostics%n_mistakes > n_mistakes) return
    end do
    do c = n_deck + 1, equations%list%n
      associate (all => equations%list, from => equations%list%first(c), &
                 to => equations%list%first(c + 1) - 1)
        call add_equation(turned, equations%position(c), [all%node(c), all%master(from:to)], &
          [all%dof(c), all%master_dof(from:to)], all%weight(from:to))
      end associate
    end do
    equations%list = turned%list
    call move_alloc(turned%position, equations%position)
  end subroutine turn_equations

  !> The terms behind the first of an equation of the deck, along x, y, z.
  pure type(side_t) function side_of(equations, c, list, number) result(side)
    type(constraints_t), intent(in) :: equations
    integer, intent(in) :: c
    type(local_node_t), intent(in) :: list(:)
    integer, intent(in) :: number(:)
    integer :: k, i, at

    allocate (side%node(0), side%dof(0), side%weight(0))
    do k = equations%first(c), equations%first(c + 1) - 1
      associate (node => equations%master(k), dof => equations%master_dof(k), &
                 weight => equations%weight(k))
        at = number(node)
        if (at > 0) then
          if (list(at)%kind == in_place) at = 0
        end if
        if (at == 0) then
          call add_term(side, node, dof, weight)
          cycle
        end if
        do i = 1, 3
          if (abs(list(at)%axes(dof, i)) > 0.0_wp) call add_term(side, node, i, weight* &
            list(at)%axes(dof, i))
        end do
      end associate
    end do
  end function side_of

  !> One more term; what stands there already adds up.
  pure subroutine add_term(side, node, dof, weight)
    type(side_t), intent(inout) :: side
    integer, intent(in) :: node, dof
    real(wp), intent(in) :: weight !! [-]
    integer :: k

    do k = 1, side%n
      if (side%node(k) /= node .or. side%dof(k) /= dof) cycle
      side%weight(k) = side%weight(k) + weight
      return
    end do
    side%node = [side%node, node]
    side%dof = [side%dof, dof]
    side%weight = [side%weight, weight]
    side%n = side%n + 1
  end subroutine add_term

  !> Solve supports and equations along directions at a node for as many degrees of freedom of it.
  subroutine solve_node(reader, model, of, equations, list, number, turned)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(local_node_t), intent(in) :: of
    type(equation_list_t), intent(in) :: equations
    type(local_node_t), intent(in) :: list(:)
    integer, intent(in) :: number(:)
    type(equation_list_t), intent(inout) :: turned
    type(side_t) :: side(3), whole
    real(wp) :: left(3, 3)    !! of the node's degrees of freedom, a row for each direction said
    real(wp) :: right(3, 3)   !! of the right-hand sides [-]
    integer :: pivot(3), position, l, i, m, n
    logical :: ok

    left = 0.0_wp
    right = 0.0_wp
    n = 0
    position = of%position
    do l = 1, 3
      if (.not. (of%held(l) .or. of%equation(l) > 0)) cycle
      n = n + 1
      left(n, :) = of%axes(l, :)
      right(n, n) = 1.0_wp
      if (of%held(l)) then
        allocate (side(n)%node(0), side(n)%dof(0), side(n)%weight(0))
        call add_term(side(n), of%stand_in, l, 1.0_wp)
        cycle
      end if
      position = equations%position(of%equation(l))
      side(n) = side_of(equations%list, of%equation(l), list, number)
      ! Terms of the node itself stand on the left.
      do i = 1, side(n)%n
        if (side(n)%node(i) /= of%node) cycle
        left(n, side(n)%dof(i)) = left(n, side(n)%dof(i)) - side(n)%weight(i)
        side(n)%weight(i) = 0.0_wp
      end do
    end do
    call reduce_rows(n, left, right, pivot, ok)
    if (.not. ok) then
      call report(reader, position, 'supports and equations along local directions at node '// &
        to_text(model%mesh%node_id(of%node))//' are not independent')
      return
    end if
    do m = 1, n
      allocate (whole%node(0), whole%dof(0), whole%weight(0))
      do i = 1, 3
        if (all(pivot /= i) .and. abs(left(m, i)) > nothing) call add_term(whole, of%node, i, &
          -left(m, i))
      end do
      do l = 1, n
        if (abs(right(m, l)) <= nothing) cycle
        do i = 1, side(l)%n
          call add_term(whole, side(l)%node(i), side(l)%dof(i), right(m, l)*side(l)%weight(i))
        end do
      end do
      call add_equation(turned, position, [of%node, whole%node], [pivot(m), whole%dof], &
        whole%weight)
      deallocate (whole%node, whole%dof, whole%weight)
      whole%n = 0
    end do
  end subroutine solve_node

  !> Gauss-Jordan elimination of the first n rows of left x = right, each time by the largest pivot.
  pure subroutine reduce_rows(n, left, right, pivot, ok)
    integer, intent(in) :: n
    real(wp), intent(inout) :: left(3, 3), right(3, 3)
    integer, intent(out) :: pivot(3) !! column of each row's pivot, 1 out; 0 behind n
    logical, intent(out) :: ok       !! false: the rows are not independent
    integer :: place(2), m, i

    pivot = 0
    ok = .true.
    do m = 1, n
      place = maxloc(abs(left), mask=spread(pivot == 0, 2, 3) .and. &
        spread([(all(pivot /= i), i=1, 3)], 1, 3))
      associate (row => place(1), column => place(2))
        ok = abs(left(row, column)) > regular
        if (.not. ok) return
        right(row, :) = right(row, :)/left(row, column)
        left(row, :) = left(row, :)/left(row, column)
        do i = 1, n
          if (i == row) cycle
          right(i, :) = right(i, :) - left(i, column)*right(row, :)
          left(i, :) = left(i, :) - left(i, column)*left(row, :)
        end do
        pivot(row) = column
      end associate
    end do
  end subroutine reduce_rows

  !> Put what steps prescribe along local directions on axes, or on the nodes that stand in.
  pure subroutine turn_values(list, number, steps)
    type(local_node_t), intent(in) :: list(:)
    integer, intent(in) :: number(:)
    type(load_step_t), intent(inout) :: steps(:)
    integer :: step, k

    do step = 1, size(steps)
      do k = 1, size(steps(step)%boundary)
        call turn(steps(step)%boundary(k))
      end do
      do k = 1, size(steps(step)%forces)
        call turn(steps(step)%forces(k))
      end do
    end do

  contains

    pure subroutine turn(value)
      type(nodal_value_t), intent(inout) :: value

      if (number(value%node) == 0) return
      associate (of => list(number(value%node)))
        select case (of%kind)
        case (along_axes)
          value%value = value%value*sign(1.0_wp, of%axes(value%dof, of%dof(value%dof)))
          value%dof = of%dof(value%dof)
        case (aslant)
          value%node = of%stand_in
        case default
          continue ! in place
        end select
      end associate
    end subroutine turn

  end subroutine turn_values

  !> The directions of values that are not along x, y, z.
  pure subroutine list_axes(list, axes)
    type(local_node_t), intent(in) :: list(:)
    type(local_axes_t), allocatable, intent(out) :: axes(:)
    logical :: has_values(size(list))
    integer :: k, n

    has_values = list%kind == in_place .or. list%stand_in > 0
    if (.not. any(has_values)) return
    allocate (axes(count(has_values)))
    n = 0
    do k = 1, size(list)
      if (.not. has_values(k)) cycle
      n = n + 1
      axes(n)%node = list(k)%node
      axes(n)%stand_in = merge(list(k)%node, list(k)%stand_in, list(k)%kind == in_place)
      axes(n)%direction = list(k)%axes
    end do
  end subroutine list_axes

end module local_axes_mod
