!> What it would save to take a stiff body as a rigid obstacle (--as-rigid), and what it would
!> change: how much of the approach of two bodies is that of the stiff one. docs/plan.md.
module rigid_alternatives_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t
  use text_mod, only: to_text, percent
  use scene_mod, only: scene_t
  use choices_mod, only: choices_t
  use controls_mod, only: compliance_dense, allowed_error
  use surfaces_mod, only: surface_t
  use mesh_forces_mod, only: pressure_force, internal_force
  use step_loads_mod, only: prescribed_dofs
  use stiffness_inverse_mod, only: apply_inverse
  use linearisation_mod, only: linearisation_t, solver_work_t, begin_linearisation, &
    make_linearisation
  use sparse_factor_mod, only: sparse_factor_t
  use take_as_rigid_mod, only: take_as_rigid, why_not_rigid
  use plan_mod, only: plan_t, bound_about
  use make_plan_mod, only: make_plan
  use estimate_costs_mod, only: estimate_costs
  use plan_table_mod, only: add_line
  use amounts_mod, only: bytes_in_words, time_in_words
  implicit none
  private

  public :: describe_rigid_alternatives

  real(wp), parameter :: longest = 10.0_wp
  !! a plan takes no longer for this than it is to tell: one factorisation [s]

contains

  !> A line of the plan for each body that could be an obstacle.
  subroutine describe_rigid_alternatives(scene, path, choices, plan)
    type(scene_t), intent(in) :: scene
    character(*), intent(in) :: path   !! of the result file
    type(choices_t), intent(in) :: choices !! before the plan's own
    type(plan_t), intent(inout) :: plan
    type(scene_t) :: other
    type(plan_t) :: its_plan
    type(sparse_factor_t) :: factor
    type(error_t), allocatable :: error
    type(linearisation_t) :: body
    logical :: could_be(size(scene%element_sets))
    character(:), allocatable :: words
    integer :: set

    if (.not. any(scene%pairs%master == 0) .or. plan%start_seconds > longest) return
    could_be = [(is_body(scene, set), set=1, size(scene%element_sets))]
    if (.not. any(could_be)) return
    call linearise(scene, plan, prescribed_dofs(scene, 1), body, error)
    if (allocated(error)) return
    do set = 1, size(could_be)
      if (.not. could_be(set)) cycle
      call describe_share(scene, plan, body, set, words, error)
      if (allocated(error)) return
      if (words == '') cycle
      other = scene
      call take_as_rigid(other, scene%element_sets(set)%name, error)
      if (.not. allocated(error)) call make_plan(other, choices, its_plan, error)
      if (.not. allocated(error)) call estimate_costs(other, path, .false., its_plan, factor, error)
      if (allocated(error)) return
      call add_line(plan, 'rigid body', bound_about, words//'; '//time_in_words( &
        its_plan%seconds)//' of CPU time instead of '//time_in_words(plan%seconds)//', '// &
        bytes_in_words(its_plan%more_memory)//' of memory instead of '// &
        bytes_in_words(plan%more_memory)//' (--as-rigid '//scene%element_sets(set)%name//')')
    end do
  end subroutine describe_rigid_alternatives

  !> Whether a set is the first that has all elements of a body and no others, and could be rigid.
  logical function is_body(scene, set)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: set
    logical :: is_rigid(scene%mesh%n_elements)
    integer :: i

    is_rigid = .false.
    is_rigid(scene%element_sets(set)%members) = .true.
    is_body = why_not_rigid(scene, is_rigid) == ''
    if (.not. is_body) return
    is_body = body_of(scene, scene%element_sets(set)%members(1)) > 0
    do i = 1, scene%mesh%n_elements
      if (.not. is_body) return
      is_body = is_rigid(i) .eqv. body_of(scene, i) == body_of(scene, &
        scene%element_sets(set)%members(1))
    end do
    do i = 1, set - 1
      associate (before => scene%element_sets(i)%members)
        if (size(before) /= count(is_rigid)) cycle
        if (all(is_rigid(before))) is_body = .false.
      end associate
    end do
  end function is_body

  pure integer function body_of(scene, element)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: element

    body_of = scene%mesh%body(scene%mesh%connectivity%node(scene%mesh%connectivity%first(element)))
  end function body_of

  !> How much of the approach of two bodies a side of a pair takes, to first order: 1/(1 + 1/e),
  !>
  !>     e = f . K^-1 f/sum(r),
  !>
  !> r the forces that move the other side by 1 as a rigid punch does, without friction, where the
  !> surfaces lie opposite each other, and f the same forces on this side, each at the nearest node.
  !> Negative where supports do not hold both bodies in the first *STEP.
  subroutine find_share(scene, plan, body, pair, side, share, error)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    type(linearisation_t), intent(inout) :: body !! with the supports of the first *STEP
    integer, intent(in) :: pair, side            !! of two bodies; 1: slave, 2: master
    real(wp), intent(out) :: share               !! [-]
    type(error_t), allocatable, intent(out) :: error !! a singular matrix, no memory
    real(wp), allocatable :: u(:, :, :)
    real(wp) :: force(3, scene%mesh%n_nodes, 1), punch(scene%mesh%n_nodes)
    integer, allocatable :: of_other(:), of_this(:)
    integer :: surfaces(2), across, i, nearest

    share = -1.0_wp
    surfaces = [scene%pairs(pair)%surface, scene%pairs(pair)%master_surface]
    do i = 1, 2
      if (any(body%motions%body == scene%mesh%body(scene%surfaces(surfaces(i))%nodes(1)))) return
    end do
    associate (this => scene%surfaces(surfaces(side)), other => scene%surfaces(surfaces(3 - side)))
      across = facing_axis(scene, other)
      call nodes_opposite(scene, other, this, across, of_other)
      call nodes_opposite(scene, this, other, across, of_this)
    end associate
    of_other = pack(of_other, .not. body%prescribed(across, of_other))
    if (size(of_other) == 0 .or. size(of_this) == 0) return
    call press(scene, plan, body%prescribed, of_other, across, punch, error)
    if (allocated(error) .or. .not. abs(sum(punch)) > 0.0_wp) return
    force = 0.0_wp
    associate (x => scene%mesh%coordinates)
      do i = 1, size(of_other)
        nearest = of_this(minloc(sum((x(:, of_this) - spread(x(:, of_other(i)), 2, &
          size(of_this)))**2, dim=1), dim=1))
        force(across, nearest, 1) = force(across, nearest, 1) + punch(of_other(i))
      end do
    end associate
    call apply_inverse(body%inverse, force, u, error)
    if (allocated(error)) return
    associate (e => sum(force*u)/abs(sum(punch)))
      share = e/(1.0_wp + e)
    end associate
  end subroutine find_share

  !> The forces at some nodes that move them by 1 along an axis, and leave them free across it.
  subroutine press(scene, plan, prescribed, nodes, axis, force, error)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    logical, intent(in) :: prescribed(:, :) !! (3,n_nodes) by supports
    integer, intent(in) :: nodes(:), axis
    real(wp), intent(out) :: force(:)       !! (n_nodes) along the axis, 0 at other nodes
    type(error_t), allocatable, intent(out) :: error
    type(linearisation_t) :: body
    real(wp), allocatable :: u(:, :, :)
    real(wp), dimension(3, scene%mesh%n_nodes, 1) :: given, load

    call linearise(scene, plan, prescribed, body, error, nodes, axis)
    if (allocated(error)) return
    given = 0.0_wp
    given(axis, nodes, 1) = 1.0_wp
    call internal_force(scene%mesh, scene%materials, given(:, :, 1), load(:, :, 1))
    call apply_inverse(body%inverse, -load, u, error)
    if (allocated(error)) return
    call internal_force(scene%mesh, scene%materials, given(:, :, 1) + u(:, :, 1), load(:, :, 1))
    force = 0.0_wp
    force(nodes) = load(axis, nodes, 1)
  end subroutine press

  !> Factorise the stiffness, with the supports and some degrees of freedom more.
  subroutine linearise(scene, plan, prescribed, body, error, nodes, axis)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    logical, intent(in) :: prescribed(:, :) !! (3,n_nodes) by supports
    type(linearisation_t), intent(out) :: body
    type(error_t), allocatable, intent(out) :: error !! a singular matrix, no memory
    integer, intent(in), optional :: nodes(:), axis
    type(solver_work_t) :: work
    type(choices_t) :: exact

    exact%compliance = compliance_dense
    call begin_linearisation(body)
    body%prescribed = prescribed
    if (present(nodes)) body%prescribed(axis, nodes) = .true.
    call make_linearisation(scene, exact, plan%points, spread(spread(.false., 1, 3), 2, &
      scene%mesh%n_nodes), body, work, error)
  end subroutine linearise

  !> The axis that a surface is turned to most.
  integer function facing_axis(scene, surface)
    type(scene_t), intent(in) :: scene
    type(surface_t), intent(in) :: surface
    real(wp) :: force(3, scene%mesh%n_nodes)

    force = 0.0_wp
    call pressure_force(scene%mesh, surface, 1.0_wp, force)
    facing_axis = maxloc(abs(sum(force, dim=2)), dim=1)
  end function facing_axis

  !> The nodes of a surface that lie within the bounds of another one, but for an axis.
  pure subroutine nodes_opposite(scene, surface, other, axis, nodes)
    type(scene_t), intent(in) :: scene
    type(surface_t), intent(in) :: surface, other
    integer, intent(in) :: axis
    integer, allocatable, intent(out) :: nodes(:)
    real(wp), parameter :: rounding = 1.0e-9_wp !! of the size of both [-]
    real(wp) :: low(3), high(3)
    logical :: is_within(size(surface%nodes))
    integer :: k

    associate (x => scene%mesh%coordinates)
      low = minval(x(:, other%nodes), dim=2)
      high = maxval(x(:, other%nodes), dim=2)
      is_within = .true.
      do k = 1, 3
        if (k == axis) cycle
        associate (near => rounding*(high(k) - low(k)))
          is_within = is_within .and. x(k, surface%nodes) >= low(k) - near .and. &
            x(k, surface%nodes) <= high(k) + near
        end associate
      end do
    end associate
    nodes = pack(surface%nodes, is_within)
  end subroutine nodes_opposite

  !> How much stiffer a body is than what it touches, and what that makes of forces: of the pair
  !> where it makes the most. '' where that is not known, or too much.
  subroutine describe_share(scene, plan, body, set, words, error)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    type(linearisation_t), intent(inout) :: body !! with the supports of the first *STEP
    integer, intent(in) :: set
    character(:), allocatable, intent(out) :: words
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: share, largest
    integer :: k, side, of_set, at

    words = ''
    of_set = body_of(scene, scene%element_sets(set)%members(1))
    largest = 0.0_wp
    at = 0
    do k = 1, size(scene%pairs)
      if (scene%pairs(k)%master > 0) cycle
      associate (pair => scene%pairs(k))
        side = 0
        if (scene%mesh%body(scene%surfaces(pair%surface)%nodes(1)) == of_set) side = 1
        if (scene%mesh%body(scene%surfaces(pair%master_surface)%nodes(1)) == of_set) side = 2
      end associate
      if (side == 0) cycle
      call find_share(scene, plan, body, k, side, share, error)
      if (allocated(error) .or. .not. share > 0.0_wp) return
      if (share <= largest) cycle
      largest = share
      at = k
    end do
    if (at == 0 .or. largest > allowed_error(scene%accuracy%wanted)) return
    words = scene%element_sets(set)%name//' is '//to_text((1.0_wp - largest)/largest, 2)// &
      ' times as stiff as what it touches in '//scene%pairs(at)%name//': as an obstacle it '// &
      'would change contact forces by about '//percent(largest)
  end subroutine describe_share

end module rigid_alternatives_mod
