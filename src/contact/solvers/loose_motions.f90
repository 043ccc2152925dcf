!> Free motions of bodies that no held point resists, in a Newton step on displacements and
!> reactions together.
!>
!> They have springs in the step, so that it is finite: as soft as it takes to bring the next point
!> to its obstacle, where the forces move one there. Where a load drives a motion w along which
!> every point leaves its obstacle at least as steeply as its friction cone is wide,
!>
!>     load . w > 0,      (G w)_n >= mu |(G w)_t|      at every point,
!>
!> no reactions balance it: their work on w is not negative. docs/theory.md (4.18).
module loose_motions_mod
  use kinds_mod, only: wp
  use dense_mod, only: symmetric_eigenvectors
  use problem_mod, only: contact_problem_t, unpack_rows
  use newton_iterate_mod, only: iterate_t
  use held_points_mod, only: held_points_t
  implicit none
  private

  public :: loose_motions_t, find_loose, spring_forces

  real(wp), parameter :: unresisted = 1.0e-10_wp !! of the best resisted motion [-]
  real(wp), parameter :: rounding = 1.0e-12_wp   !! of forces that cancel [-]
  real(wp), parameter :: hundredfold = 100.0_wp  !! so much is a load [-]
  real(wp), parameter :: most_change = 10.0_wp   !! of the springs from step to step [-]

  type :: loose_motions_t
    integer :: n = 0
    real(wp), allocatable :: motion(:, :) !! (m,n) orthonormal combinations of the free ones [-]
    real(wp) :: spring = 0.0_wp           !! [force/length]
    real(wp), allocatable :: driven(:)    !! (m) what the forces do along them [force]
    real(wp), allocatable :: unbalanced(:)
    !! (m) the same where no reactions can balance the load there; else 0 [force]
  end type loose_motions_t

contains

  !> The loose motions of a step.
  subroutine find_loose(problem, held, motions, by_load, scale, at, loose)
    type(contact_problem_t), intent(in) :: problem
    type(held_points_t), intent(in) :: held
    real(wp), intent(in) :: motions(:, :)  !! (n_rows,m) what they do at the rows [-]
    real(wp), intent(in) :: by_load(:)     !! (m) what forces beside reactions do there [force]
    real(wp), intent(in) :: scale          !! of the forces [force]
    type(iterate_t), intent(in) :: at
    type(loose_motions_t), intent(inout) :: loose !! of the step before, if any
    type(loose_motions_t) :: before
    real(wp) :: resistance(size(motions, 2), size(motions, 2)), of_each(size(motions, 2))
    real(wp) :: driven(size(motions, 2)), of_point(3, size(motions, 2)), block(3, 3)
    real(wp) :: way, change, least
    real(wp), dimension(3, problem%n_points) :: rate, x
    integer :: i, a, m
    real(wp) :: back
    logical :: ok, is_pressed(problem%n_points)

    m = size(motions, 2)
    before = loose
    loose%n = 0
    loose%unbalanced = [(0.0_wp, i=1, m)]
    loose%driven = loose%unbalanced
    if (m == 0) return
    resistance = 0.0_wp
    do i = 1, problem%n_points
      of_point = 0.0_wp
      do a = 1, 3
        if (problem%row(a, i) > 0) of_point(a, :) = motions(problem%row(a, i), :)
      end do
      block = held%along(:, :, i) + held%across(:, :, i)/problem%rho_global(2, i)
      resistance = resistance + matmul(transpose(of_point), matmul(block, of_point))
    end do
    resistance = 0.5_wp*(resistance + transpose(resistance))
    call symmetric_eigenvectors(resistance, of_each, ok)
    ! Eigenvalues ascend.
    if (ok) loose%n = count(of_each <= unresisted*maxval(of_each))
    loose%motion = resistance(:, :loose%n)
    if (loose%n == 0) return
    loose%spring = maxval(problem%rho_global(1, :))
    driven = by_load + matmul(at%r, motions)
    if (norm2(driven) <= rounding*max(scale, norm2(at%r))) return
    driven = matmul(loose%motion, matmul(driven, loose%motion))
    loose%driven = driven
    rate = unpack_rows(problem, matmul(motions, driven))
    x = unpack_rows(problem, at%x)
    least = rounding*norm2(driven)
    if (any(rate(1, :) < -least)) then
      way = minval(x(1, :)/(-rate(1, :)), mask=rate(1, :) < -least)
      if (way*loose%spring > 1.0_wp) loose%spring = 1.0_wp/way
    else if (all(rate(1, :) >= problem%mu*norm2(rate(2:, :), dim=1) - least)) then
      if (dot_product(driven, by_load) > hundredfold*least*scale) loose%unbalanced = driven
    end if
    ! Friction that drives them back does so until the slips are gone.
    is_pressed = held%along(1, 1, :) > 0.0_wp .and. problem%mu > 0.0_wp
    back = -sum(sum(rate(2:, :)*x(2:, :), dim=1), mask=is_pressed)
    if (back > 0.0_wp) then
      loose%spring = sum(sum(rate(2:, :)**2, dim=1), mask=is_pressed)/back
      return
    end if
    if (before%n /= loose%n) return
    if (.not. norm2(before%driven) > 0.0_wp) return
    ! The same again: as they have resisted, by the secant, or a longer way.
    change = 1.0_wp - dot_product(driven, before%driven)/dot_product(before%driven, before%driven)
    loose%spring = before%spring*min(most_change, max(1.0_wp/most_change, change))
  end subroutine find_loose

  !> What the springs do against a step, s N N^T a.
  pure function spring_forces(loose, a) result(forces)
    type(loose_motions_t), intent(in) :: loose
    real(wp), intent(in) :: a(:)      !! (m) displacement of the pins [length]
    real(wp) :: forces(size(a))       !! [force]

    forces = 0.0_wp
    if (loose%n > 0) forces = loose%spring*matmul(loose%motion, matmul(a, loose%motion))
  end function spring_forces

end module loose_motions_mod
