!> The plan of a run, from its scene alone.
module make_plan_mod
  use kinds_mod, only: wp
  use text_mod, only: string_t, to_text
  use errors_mod, only: error_t
  use scene_mod, only: scene_t
  use controls_mod, only: contact_controls_t, solver_auto, solver_global_newton, &
                          formulation_bipotential, local_uzawa, local_newton, local_newton6, &
                          stop_at_change
  use increments_mod, only: count_increments
  use plan_mod, only: plan_t
  use candidate_points_mod, only: find_points
  use dof_map_mod, only: dof_map_t, make_dof_map
  use rigid_modes_mod, only: free_motions_t, find_free_motions, hold_pins
  use motion_words_mod, only: body_in_words, motions_together
  use operators_mod, only: ref_nodes
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
    plan%n_increments = count_increments(scene%steps)
    prescribed = prescribed_dofs(scene, 1)
    call find_free_motions(scene%mesh, prescribed, ref_nodes(scene%obstacles), plan%points%node, &
      motions, error)
    if (allocated(error)) return
    map = make_dof_map(scene%mesh%body, hold_pins(motions, prescribed), plan%points%node)
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
