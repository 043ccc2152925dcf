!> The plan of a run, from its scene alone.
module make_plan_mod
  use kinds_mod, only: wp
  use text_mod, only: string_t, to_text
  use errors_mod, only: error_t
  use obstacles_mod, only: locate_point, ref_nodes
  use scene_mod, only: scene_t
  use controls_mod, only: contact_controls_t, solver_auto, solver_global_newton, &
                          formulation_bipotential, local_uzawa, local_newton, local_newton6, &
                          stop_at_change
  use contact_points_mod, only: contact_points_t
  use increments_mod, only: count_increments
  use plan_mod, only: plan_t
  use mesh_forces_mod, only: nodal_areas
  use dof_map_mod, only: dof_map_t, make_dof_map
  use rigid_modes_mod, only: free_motions_t, find_free_motions, hold_pins
  use motion_words_mod, only: body_in_words, motions_together
  use contact_interface_mod, only: find_reach, interface_dofs
  use step_loads_mod, only: prescribed_dofs
  implicit none
  private

  public :: make_plan

contains

  !> Decide what the run consists of.
  subroutine make_plan(scene, plan, error)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(out) :: plan
    type(error_t), allocatable, intent(out) :: error !! LAPACK failed
    logical, allocatable :: prescribed(:, :), before(:, :), of_bodies(:, :)
    type(dof_map_t) :: map
    type(free_motions_t) :: motions
    integer :: step

    call find_points(scene, plan%points)
    call find_reach(scene, plan%points, error)
    if (allocated(error)) return
    plan%n_increments = count_increments(scene%steps)
    prescribed = prescribed_dofs(scene, 1)
    call find_free_motions(scene%mesh, prescribed, ref_nodes(scene%obstacles), plan%points%node, &
      motions, error)
    if (allocated(error)) return
    map = make_dof_map(scene%mesh%body, hold_pins(motions, prescribed), &
      interface_dofs(scene, plan%points))
    of_bodies = spread(scene%mesh%body > 0, 1, 3)
    plan%n_equations = map%n_free
    plan%n_interface = map%n_interface
    plan%n_factorisations = 1
    do step = 2, size(scene%steps)
      call move_alloc(prescribed, before)
      prescribed = prescribed_dofs(scene, step)
      if (any((prescribed .neqv. before) .and. of_bodies)) then
        plan%n_factorisations = plan%n_factorisations + 1
      end if
    end do
    call describe(scene, motions, plan)
  end subroutine make_plan

  !> Every node of every slave surface is a candidate, once for every obstacle.
  subroutine find_points(scene, points)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(out) :: points
    real(wp), allocatable :: area(:)
    logical, allocatable :: taken(:, :)
    integer :: pair, i, k

    allocate (points%first(size(scene%pairs) + 1), area(scene%mesh%n_nodes))
    allocate (taken(scene%mesh%n_nodes, size(scene%obstacles)), source=.false.)
    allocate (points%pair(0), points%node(0), points%ref_node(0), points%mu(0), points%area(0))
    points%first(1) = 1
    do pair = 1, size(scene%pairs)
      associate (surface => scene%surfaces(scene%pairs(pair)%surface), &
                 obstacle => scene%pairs(pair)%obstacle)
        call nodal_areas(scene%mesh, surface, area)
        do i = 1, size(surface%nodes)
          if (taken(surface%nodes(i), obstacle)) cycle
          taken(surface%nodes(i), obstacle) = .true.
          points%node = [points%node, surface%nodes(i)]
        end do
        k = size(points%node) - points%first(pair) + 1
        points%area = [points%area, area(points%node(points%first(pair):))]
        points%pair = [points%pair, spread(pair, 1, k)]
        points%ref_node = [points%ref_node, spread(scene%obstacles(obstacle)%ref_node, 1, k)]
        points%mu = [points%mu, spread(scene%pairs(pair)%mu, 1, k)]
        points%first(pair + 1) = size(points%node) + 1
      end associate
    end do
    points%n = size(points%node)
    call find_extra_gaps(scene, points)
  end subroutine find_points

  !> *CONTACT GAP: what each point is further away than the mesh says.
  subroutine find_extra_gaps(scene, points)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(inout) :: points
    logical :: named(scene%mesh%n_nodes)
    real(wp) :: x(3), normal(3), gap
    integer :: k, i

    allocate (points%extra_gap(points%n), source=0.0_wp)
    do k = 1, size(scene%gaps)
      associate (card => scene%gaps(k))
        named = .false.
        named(card%nodes) = .true.
        do i = 1, points%n
          if (.not. named(points%node(i))) cycle
          if (.not. card%parabola) then
            points%extra_gap(i) = points%extra_gap(i) + card%value
            cycle
          end if
          x = scene%mesh%coordinates(:, points%node(i))
          call locate_point(scene%obstacles(scene%pairs(points%pair(i))%obstacle), &
            [0.0_wp, 0.0_wp, 0.0_wp], x, gap, normal)
          x = x - card%centre
          x = x - dot_product(x, normal)*normal
          points%extra_gap(i) = points%extra_gap(i) + sum(x**2)/(2.0_wp*card%radius)
        end do
      end associate
    end do
  end subroutine find_extra_gaps

  !> The table that is printed and stored.
  subroutine describe(scene, motions, plan)
    type(scene_t), intent(in) :: scene
    type(free_motions_t), intent(in) :: motions !! that the supports of the first step leave
    type(plan_t), intent(inout) :: plan
    integer :: i

    allocate (plan%lines(0))
    call add('mesh', to_text(scene%mesh%n_nodes)//' nodes, '//to_text(scene%mesh%n_elements)// &
      ' bricks, '// &
             to_text(scene%mesh%n_bodies)//' '//plural('body', 'bodies', scene%mesh%n_bodies))
    call add_motions()
    call add('equations', to_text(plan%n_equations)//', of them '//to_text(plan%n_interface)// &
      ' on contact nodes')
    do i = 1, size(scene%pairs)
      associate (pair => scene%pairs(i))
        call add('contact', pair%name//': '//to_text(plan%points%first(i + 1) - &
          plan%points%first(i))// &
                 ' points, '//friction_in_words(pair%mu))
      end associate
    end do
    call add('factorisations', to_text(plan%n_factorisations)//merge(' for the whole run', &
      '                  ', &
                                                                     plan%n_factorisations == 1))
    call add('increments', to_text(plan%n_increments)//' in '//to_text(size(scene%steps))//' '// &
             plural('step', 'steps', size(scene%steps)))
    if (plan%points%n > 0) call add('contact solver', solver_in_words(scene%contact))

  contains

    !> What supports leave to contact, a line a body or obstacle under force.
    subroutine add_motions()
      integer :: j, n

      j = 1
      do while (j <= motions%n)
        n = motions_together(motions, j)
        call add('free motions', to_text(n)//' of '//body_in_words(scene%mesh, motions, j)// &
          ', left to contact')
        j = j + n
      end do
    end subroutine add_motions

    subroutine add(name, value)
      character(*), intent(in) :: name, value
      character(16) :: column
      type(string_t) :: line

      column = name
      line%text = column//trim(value)
      plan%lines = [plan%lines, line]
    end subroutine add

  end subroutine describe

  pure function plural(one, many, n) result(word)
    character(*), intent(in) :: one, many
    integer, intent(in) :: n
    character(:), allocatable :: word

    word = many
    if (n == 1) word = one
  end function plural

  pure function friction_in_words(mu) result(words)
    real(wp), intent(in) :: mu
    character(:), allocatable :: words

    words = 'frictionless, 1 row each'
    if (mu > 0.0_wp) words = 'mu = '//to_text(mu)//', at most 3 rows each'
  end function friction_in_words

  pure function solver_in_words(controls) result(words)
    type(contact_controls_t), intent(in) :: controls
    character(:), allocatable :: words

    select case (controls%solver)
    case (solver_auto)
      words = 'automatic: global Newton, else accelerated sweeps; '
    case (solver_global_newton)
      words = 'global Newton, '
    case default
      words = sweeps_in_words(controls)
    end select
    words = words//'tolerance '//to_text(controls%tolerance)
    if (controls%stop_rule == stop_at_change) words = words//' on the change of a sweep'
    if (controls%solver /= solver_global_newton) words = words//', at most '// &
      to_text(controls%max_sweeps)//' sweeps'
  end function solver_in_words

  pure function sweeps_in_words(controls) result(words)
    type(contact_controls_t), intent(in) :: controls
    character(:), allocatable :: words

    words = 'sweeps, pseudo-potential, local '
    if (controls%formulation == formulation_bipotential) words = 'sweeps, bi-potential, local '
    select case (controls%local)
    case (local_uzawa)
      words = words//'Uzawa'
    case (local_newton)
      words = words//'Newton (3x3)'
    case (local_newton6)
      words = words//'Newton (6x6)'
    case default
      words = words//'exact'
    end select
    words = words//', rho '//to_text(controls%rho)//', relaxation '// &
      to_text(controls%relaxation)//', '
  end function sweeps_in_words

end module make_plan_mod
