!> What the loads of a *STEP do to the bodies without contact: its patterns, and the displacement
!> that each of them causes. An increment's loads and displacement are sums of these.
module load_response_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t, raise, exit_not_solved
  use text_mod, only: to_text
  use system_mod, only: wall_seconds
  use controls_mod, only: is_exact, precision_in_words
  use scene_mod, only: scene_t
  use grip_motion_mod, only: move_grips
  use increments_mod, only: increment_t
  use mesh_forces_mod, only: internal_force, force_rounding
  use bodies_mod, only: is_linear, find_tangent_force
  use mass_matrix_mod, only: times_mass
  use damping_mod, only: damping_force
  use increment_forces_mod, only: imposed_t
  use following_loads_mod, only: let_loads_follow
  use constraints_mod, only: give_to_masters
  use dof_map_mod, only: is_unknown
  use stiffness_inverse_mod, only: stiffness_inverse_t, apply_inverse
  use step_loads_mod, only: step_loads_t, pattern_factors, pattern_rates, following_at
  use linearisation_mod, only: linearisation_t, solver_work_t, lap
  implicit none
  private

  public :: load_response_t, respond_to_loads, sum_patterns, prescribed_displacement, &
    prescribed_rate, impose_loads

  real(wp), parameter :: tolerable = 1.0e-6_wp
  !! out of balance in a response, of the largest load: Newton-Raphson takes out what that leaves
  integer,  parameter :: max_refinements = 30   !! of a response to loads

  !> Made once for a *STEP.
  type :: load_response_t
    type(step_loads_t) :: loads
    real(wp), allocatable :: displacement(:, :, :)
    !! (3,n_nodes,n_patterns) under each pattern [length]
  end type load_response_t

contains

  !> The displacements that the load patterns cause without contact.
  subroutine respond_to_loads(scene, tolerance, body, response, work, error)
    type(scene_t), intent(in) :: scene
    real(wp), intent(in) :: tolerance                !! of contact [-]
    type(linearisation_t), intent(inout) :: body !! solutions with its factor
    type(load_response_t), intent(inout) :: response !! its loads in, displacements out
    type(solver_work_t), intent(inout) :: work
    type(error_t), allocatable, intent(out) :: error
    !! MUMPS failed; the factor is too far from the stiffness
    real(wp), allocatable :: load(:, :, :)
    real(wp) :: clock
    integer :: g

    clock = wall_seconds()
    associate (loads => response%loads)
      allocate (load, mold=loads%force)
      ! Prescribed displacements act through the forces they cause in an otherwise undeformed body,
      ! or by the tangent that the factor is of.
      call find_tangent_force(scene, loads%displacement, load, body%tangent)
      load = loads%force - load
      if (allocated(body%inertia)) then
        do g = 1, size(load, 3)
          load(:, :, g) = load(:, :, g) - body%inertia%factor*times_mass(body%inertia%mass, &
            loads%displacement(:, :, g)) - damping_force(body%inertia%damping, scene%mesh, &
            body%inertia%mass, body%inertia%slope*loads%displacement(:, :, g))
        end do
      end if
      call apply_inverse(body%inverse, load, response%displacement, error)
      if (allocated(error)) return
      ! At finite strain they are what iterations begin with, which refine them.
      if (is_linear(scene) .and. .not. is_exact(body%inverse%factor%precision)) call refine( &
        scene, tolerance, load, body%of_elements, body%inverse, response%displacement, error)
      if (allocated(error)) return
      response%displacement = response%displacement + loads%displacement
    end associate
    call lap(clock, work%loads)
  end subroutine respond_to_loads

  !> Correct the responses with what is left out of balance, by internal forces in double precision,
  !> until that is rounding.
  subroutine refine(scene, tolerance, load, of_elements, inverse, response, error)
    type(scene_t), intent(in) :: scene
    real(wp), intent(in) :: tolerance                !! of contact [-]
    real(wp), intent(in) :: load(:, :, :)            !! (3,n_nodes,n_patterns) [force]
    real(wp), intent(in) :: of_elements(:)           !! (n_elements) as of linearisation_t
    type(stiffness_inverse_t), intent(inout) :: inverse
    real(wp), intent(inout) :: response(:, :, :)     !! (3,n_nodes,n_patterns) [length]
    type(error_t), allocatable, intent(out) :: error
    !! MUMPS failed; nothing is gained any more before rounding is reached
    real(wp), allocatable :: residual(:, :, :), correction(:, :, :)
    real(wp) :: left, last, largest, enough
    integer :: i, g

    allocate (residual, source=load)
    last = huge(last)
    ! What acts on nodes that depend on others acts on these.
    do g = 1, size(load, 3)
      call give_to_masters(inverse%map%constraints, residual(:, :, g))
    end do
    largest = maxval(abs(residual), mask=spread(is_unknown(inverse%map), 3, size(load, 3)))
    enough = 0.0_wp
    ! What Newton-Raphson would let pass.
    if (scene%accuracy%wanted > 0.0_wp) enough = 0.1_wp*tolerance*largest
    refinements: do i = 1, max_refinements
      left = 0.0_wp
      do g = 1, size(load, 3)
        call internal_force(scene%mesh, scene%materials, response(:, :, g), residual(:, :, g))
        residual(:, :, g) = load(:, :, g) - residual(:, :, g)
        call give_to_masters(inverse%map%constraints, residual(:, :, g))
        residual(:, :, g) = merge(residual(:, :, g), 0.0_wp, is_unknown(inverse%map))
        left = max(left, maxval(maxval(abs(residual(:, :, g)), dim=1) - force_rounding(scene%mesh, &
          of_elements, response(:, :, g))))
      end do
      if (left <= enough) return
      if (left > 0.5_wp*last) exit refinements
      last = left
      call apply_inverse(inverse, residual, correction, error)
      if (allocated(error)) return
      response = response + correction
    end do refinements
    ! Newton-Raphson takes care of a little, and the certificate judges.
    if (left <= tolerable*largest) return
    call raise(error, exit_not_solved, 'the factor of the stiffness is too far from it ('// &
      precision_in_words(inverse%factor%precision)//'): responses to loads stay out of '// &
      'balance by '//to_text(left/largest, 2)//' of the largest load, refined '//to_text(i)// &
      ' times; full rank and FACTOR=DOUBLE of *PRECISION hold more')
  end subroutine refine

  !> Displacement without contact, and loads, at a fraction of the *STEP.
  subroutine sum_patterns(scene, response, fraction, step_time, u_free, external, summed)
    type(scene_t), intent(in) :: scene
    type(load_response_t), intent(in) :: response
    real(wp), intent(in) :: fraction, step_time             !! as of increment_t [-], [time]
    real(wp), allocatable, intent(out) :: u_free(:, :)   !! (3,n_nodes) [length]
    real(wp), allocatable, intent(out) :: external(:, :) !! (3,n_nodes) [force]
    real(wp), allocatable, intent(out), optional :: summed(:, :)
    !! (3,n_nodes) the magnitudes that external sums up, of parts that may cancel [force]
    real(wp) :: factor(response%loads%n_patterns)

    factor = pattern_factors(scene, response%loads, fraction, step_time)
    u_free = weighted_sum(factor, response%displacement)
    external = weighted_sum(factor, response%loads%force)
    if (present(summed)) summed = weighted_sum(abs(factor), abs(response%loads%force))
  end subroutine sum_patterns

  !> One pattern after the other.
  pure function weighted_sum(factor, pattern) result(total)
    real(wp), intent(in) :: factor(:)        !! (n) [-]
    real(wp), intent(in) :: pattern(:, :, :)
    real(wp) :: total(size(pattern, 1), size(pattern, 2))
    integer :: g

    total = 0.0_wp
    do g = 1, size(factor)
      total = total + factor(g)*pattern(:, :, g)
    end do
  end function weighted_sum

  !> Where loads follow bodies: the loads at a fraction of the *STEP, of bodies that are displaced.
  pure subroutine impose_loads(scene, loads, fraction, step_time, u, imposed)
    type(scene_t), intent(in) :: scene
    type(step_loads_t), intent(in) :: loads
    real(wp), intent(in) :: fraction, step_time  !! as of increment_t [-], [time]
    real(wp), intent(in) :: u(:, :)              !! (3,n_nodes) [length]
    type(imposed_t), intent(inout) :: imposed    !! gets its loads, unless all are dead

    if (.not. allocated(loads%dead_force)) return
    imposed%dead_load = weighted_sum(pattern_factors(scene, loads, fraction, step_time), &
      loads%dead_force)
    imposed%following = following_at(scene, loads, fraction, step_time)
    call let_loads_follow(scene, u, imposed)
  end subroutine impose_loads

  !> What the supports prescribe at the end of an increment, from the loads alone: the certificate
  !> holds displacements against it, so nothing of it comes from a solution.
  pure function prescribed_displacement(scene, loads, increment) result(u)
    type(scene_t), intent(in) :: scene
    type(step_loads_t), intent(in) :: loads
    type(increment_t), intent(in) :: increment
    real(wp) :: u(3, scene%mesh%n_nodes)  !! 0 where nothing is prescribed [length]

    u = weighted_sum(pattern_factors(scene, loads, increment%fraction, increment%step_time), &
      loads%displacement)
    call move_grips(scene, u)
  end function prescribed_displacement

  !> A derivative of that over time, of the pieces of amplitudes that another time is in.
  pure function prescribed_rate(scene, loads, order, period, step_time, inside) result(rate)
    type(scene_t), intent(in) :: scene
    type(step_loads_t), intent(in) :: loads
    integer, intent(in) :: order              !! 1 or 2
    real(wp), intent(in) :: period            !! of the *STEP [time]
    real(wp), intent(in) :: step_time, inside !! from the start of the *STEP; the other time
    real(wp) :: rate(3, scene%mesh%n_nodes)   !! [length/time] or [length/time^2]

    rate = weighted_sum(pattern_rates(scene, loads, order, period, step_time, inside), &
      loads%displacement)
  end function prescribed_rate

end module load_response_mod
