!> What other gaps would change of the contact forces at the end of an increment: one solution of
!> its last contact problem, about the reactions that were found.
!>
!> The problem is linear about the end: frames, weights and the compliance stay, and what the bodies
!> did there is what gaps and reactions say. docs/theory.md section 10.
module other_gaps_mod
  use kinds_mod, only: wp
  use scene_mod, only: scene_t
  use controls_mod, only: contact_controls_t, solver_auto
  use increment_report_mod, only: contact_fields_t
  use problem_mod, only: contact_problem_t, contact_report_t, pack_rows, product_with_w
  use floating_mod, only: shift_of
  use floating_centre_mod, only: drift_t
  use condensed_contact_mod, only: condensed_contact_t, contact_group_t, count_rows
  use compliance_mod, only: is_map
  use formed_compliance_mod, only: form_compliance
  use step_solver_mod, only: step_solver_t
  use solve_reactions_mod, only: solve_for_least
  implicit none
  private

  public :: x_free_of, react_to_gaps, wide_open

  real(wp), parameter :: sharp_enough = 1.0e-5_wp
  !! residual: of what the gaps change one digit is asked for [-]
  integer, parameter :: most_sweeps = 500
  integer, parameter :: products_of_motion = 100 !! that a search for free motions takes, and more

contains

  !> The reactions that points would have, had they other gaps at the end of an increment.
  subroutine react_to_gaps(scene, solver, n_rows, contact, change, reaction, ok)
    type(scene_t), intent(in) :: scene
    type(step_solver_t), intent(in) :: solver !! with the last contact problem of the increment
    integer, intent(in) :: n_rows             !! that problem's, as the increment's report has them
    type(contact_fields_t), intent(in) :: contact !! at its end
    real(wp), intent(in) :: change(:)         !! (n_points) of the gaps [length]
    real(wp), intent(out) :: reaction(:, :)   !! (3,n_points) n, t1, t2 [force]
    logical, intent(out) :: ok
    !! false: these are not known, for nothing balances the loads then, contact is solved together
    !! with bodies that have no factor, or it has been condensed anew since
    type(contact_controls_t) :: controls
    real(wp) :: r(3, size(change))
    integer :: i, n

    reaction = contact%reaction
    ok = count_rows(solver%contact) == n_rows
    if (.not. ok) return
    controls = scene%contact
    controls%solver = solver_auto
    controls%tolerance = max(solver%choices%tolerance, sharp_enough)
    controls%max_sweeps = most_sweeps
    do i = 1, size(solver%contact%group)
      associate (group => solver%contact%group(i))
        if (.not. any(abs(change(group%active)) > 0.0_wp)) cycle
        ok = .not. allocated(group%body)
        if (.not. ok) return
        n = size(group%active)
        r(:, :n) = contact%reaction(:, group%active)
        if (takes_many_products(group)) then
          call react(formed(group), controls, contact, change(group%active), r(:, :n), ok)
        else
          call react(group, controls, contact, change(group%active), r(:, :n), ok)
        end if
        reaction(:, group%active) = r(:, :n)
      end associate
      if (.not. ok) return
    end do
  end subroutine react_to_gaps

  !> Whether a search for the free motions takes more products with W, of which each is a solution
  !> with the factor, than W has columns.
  pure logical function takes_many_products(group)
    type(contact_group_t), intent(in) :: group

    takes_many_products = is_map(group%problem%compliance) .and. group%problem%n_rows <= &
      products_of_motion*size(group%motion)
  end function takes_many_products

  !> The group with its W formed, if there is memory for it.
  type(contact_group_t) function formed(group)
    type(contact_group_t), intent(in) :: group
    type(contact_problem_t) :: dense
    logical :: ok

    formed = group
    call form_compliance(group%problem, dense, ok)
    if (ok) formed%problem = dense
  end function formed

  !> The same of one group.
  subroutine react(group, controls, contact, change, r, ok)
    type(contact_group_t), intent(in) :: group
    type(contact_controls_t), intent(in) :: controls
    type(contact_fields_t), intent(in) :: contact
    real(wp), intent(in) :: change(:)     !! (n_active) of the gaps [length]
    real(wp), intent(inout) :: r(:, :)    !! (3,n_active) n, t1, t2 [force]
    logical, intent(out) :: ok
    real(wp), dimension(3, size(change)) :: found
    real(wp), dimension(group%problem%n_rows) :: packed, x_free
    real(wp), allocatable :: gaps(:)
    type(contact_report_t) :: report
    type(drift_t) :: drift

    packed = pack_rows(group%problem, r)
    x_free = pinned_x_free(group, contact, change, packed)
    ! Free motions are counted from the end, where the reactions balance their loads.
    if (size(group%motion) > 0) then
      drift%load = -matmul(packed, group%floating%g)
      drift%rounding = epsilon(1.0_wp)*matmul(abs(packed), abs(group%floating%g))
      drift%a = spread(0.0_wp, 1, size(group%motion))
    end if
    found = r
    call solve_for_least(controls%tolerance, group, controls, x_free, drift, found, gaps, report)
    ok = report%converged()
    if (ok) r = found
  end subroutine react

  !> Gaps and slips without reactions, with the bodies pinned where they are.
  function pinned_x_free(group, contact, change, r) result(x_free)
    type(contact_group_t), intent(in) :: group
    type(contact_fields_t), intent(in) :: contact
    real(wp), intent(in) :: change(:)      !! (n_active) of the gaps [length]
    real(wp), intent(in) :: r(:)           !! (n_rows) [force]
    real(wp) :: x_free(size(r))            !! [length]
    real(wp) :: x(3, size(change))

    x(1, :) = contact%gap(group%active) + change
    x(2:, :) = contact%slip_increment(:, group%active)
    x_free = pack_rows(group%problem, x) - pinned_product(group, r)
  end function pinned_x_free

  !> Gaps and slips without the reactions that an increment has ended with, by the contact problem
  !> where it has.
  function x_free_of(condensed, contact) result(x_free)
    type(condensed_contact_t), intent(in) :: condensed
    type(contact_fields_t), intent(in) :: contact
    real(wp), allocatable :: x_free(:)     !! (n_rows) of all groups [length]
    integer :: i, k

    allocate (x_free(0))
    do i = 1, size(condensed%group)
      associate (group => condensed%group(i))
        x_free = [x_free, pinned_x_free(group, contact, [(0.0_wp, k=1, size(group%active))], &
          pack_rows(group%problem, contact%reaction(:, group%active)))]
      end associate
    end do
  end function x_free_of

  !> W r with the bodies pinned, of a problem whose W has them free, P W P + theta Q Q^T, and is
  !> soft along reactions that no body feels.
  function pinned_product(group, r) result(w_r)
    type(contact_group_t), intent(in) :: group
    real(wp), intent(in) :: r(:)   !! (n_rows) [force]
    real(wp) :: w_r(size(r))       !! [length]

    w_r = product_with_w(group%problem, r)
    if (size(group%null, 2) > 0) w_r = w_r - group%softness*matmul(group%null, matmul(r, &
      group%null))
    if (size(group%motion) == 0) return
    associate (floating => group%floating)
      if (floating%n_seen == 0) return
      w_r = w_r + matmul(floating%w_q, matmul(r, floating%q)) + matmul(floating%q, &
        shift_of(floating, r) - floating%theta*matmul(r, floating%q))
    end associate
  end function pinned_product

  !> A gap that no point closes: beside it all gaps, and what reactions do, are small.
  function wide_open(solver, contact) result(gap)
    type(step_solver_t), intent(in) :: solver
    type(contact_fields_t), intent(in) :: contact
    real(wp) :: gap !! [length]
    real(wp), parameter :: far = 100.0_wp
    integer :: i

    gap = 0.0_wp
    do i = 1, size(solver%contact%group)
      associate (group => solver%contact%group(i))
        if (size(group%active) == 0 .or. allocated(group%body)) cycle
        gap = max(gap, maxval(abs(contact%gap(group%active))), maxval(abs(product_with_w( &
          group%problem, pack_rows(group%problem, contact%reaction(:, group%active))))))
      end associate
    end do
    gap = far*gap
  end function wide_open

end module other_gaps_mod
