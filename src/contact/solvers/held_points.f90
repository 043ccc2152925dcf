!> What contact holds of the points in a Newton step on displacements and reactions together, and
!> what the reactions of the others follow. docs/theory.md (4.17).
module held_points_mod
  use kinds_mod, only: wp
  use friction_laws_mod, only: largest_friction
  use problem_mod, only: contact_problem_t, pack_rows, unpack_rows
  use newton_iterate_mod, only: iterate_t
  implicit none
  private

  public :: held_points_t, expect, expect_sticking, find_held

  real(wp), parameter :: slides = 1.0e-6_wp     !! that far from the cone at most, beside mu r_n [-]
  real(wp), parameter :: expected_across = 0.9_wp !! the same as next, of a slip not known yet [-]
  real(wp), parameter :: most_across = 0.999_wp
  !! of what holds across a slip; beyond it is held there [-]

  !> What the system of a Newton step is made of, a point at a time.
  type :: held_points_t
    real(wp), allocatable :: along(:, :, :)   !! (3,3,n_points) projection on what is held [-]
    real(wp), allocatable :: across(:, :, :)  !! (3,3,n_points) stiffness across a slip
    real(wp), allocatable :: follows(:, :)    !! (3,n_points) of a tangential reaction, the normal
    real(wp), allocatable :: own(:, :)        !! (3,n_points) and what it is without [force]
  end type held_points_t

contains

  !> Take for held what the reactions to start from say, whatever the gaps there: displacements are
  !> not those of these reactions yet. Residuals become those of what is so to come.
  subroutine expect(problem, at)
    type(contact_problem_t), intent(in) :: problem
    type(iterate_t), intent(inout) :: at
    real(wp), dimension(3, problem%n_points) :: r, x, z
    real(wp) :: p(3, 3), t(2), radius, slope
    integer :: i, a

    r = unpack_rows(problem, at%r)
    x = unpack_rows(problem, at%x)
    z = 0.0_wp
    do i = 1, problem%n_points
      call largest_friction(problem%mu(i), problem%law, i, r(1, i), radius, slope)
      associate (rho => problem%rho_global([1, 2, 2], i))
        p = 0.0_wp
        if (r(1, i) > 0.0_wp .or. problem%stays(i)) then
          p(1, 1) = 1.0_wp
          if (norm2(r(2:, i)) < (1.0_wp - slides)*radius) then
            p(2, 2) = 1.0_wp
            p(3, 3) = 1.0_wp
            z(:, i) = rho*x(:, i)
          else if (radius > 0.0_wp) then
            t = r(2:, i)/norm2(r(2:, i))
            p(2:, 1) = slope*t
            do a = 1, 2
              p(2:, 1 + a) = -expected_across*t(a)*t
              p(1 + a, 1 + a) = p(1 + a, 1 + a) + expected_across
            end do
            z(1, i) = rho(1)*x(1, i)
            z(2:, i) = p(2:, 1)*z(1, i) + matmul(p(2:, 2:), rho(2:)*x(2:, i)) - (radius*t - &
              r(2:, i)) + matmul(p(2:, 2:), radius*t - r(2:, i))
          else
            z(1, i) = rho(1)*x(1, i)
          end if
        end if
        at%dz_dr(:, :, i) = -p
        do a = 1, 3
          at%dz_dr(a, a, i) = at%dz_dr(a, a, i) + 1.0_wp
        end do
      end associate
    end do
    at%z = pack_rows(problem, z)
  end subroutine expect

  !> Take all points that press for sticking.
  subroutine expect_sticking(problem, at)
    type(contact_problem_t), intent(in) :: problem
    type(iterate_t), intent(inout) :: at
    real(wp), dimension(3, problem%n_points) :: x, z
    integer :: i

    x = unpack_rows(problem, at%x)
    z = unpack_rows(problem, at%z)
    do i = 1, problem%n_points
      if (.not. (problem%mu(i) > 0.0_wp .and. at%dz_dr(1, 1, i) < 1.0_wp)) cycle
      z(:, i) = problem%rho_global([1, 2, 2], i)*x(:, i)
      at%dz_dr(:, :, i) = 0.0_wp
    end do
    at%z = pack_rows(problem, z)
  end subroutine expect_sticking

  !> What is held, and what the others do, by the derivatives of the projections.
  subroutine find_held(problem, at, held)
    type(contact_problem_t), intent(in) :: problem
    type(iterate_t), intent(in) :: at
    type(held_points_t), intent(inout) :: held
    real(wp), dimension(3, problem%n_points) :: z
    real(wp) :: p(3, 3), t(2, 2), e(2, 2), hold_n, largest
    integer :: i, a

    z = unpack_rows(problem, at%z)
    if (.not. allocated(held%along)) then
      allocate (held%along(3, 3, problem%n_points), held%across(3, 3, problem%n_points))
      allocate (held%follows(3, problem%n_points), held%own(3, problem%n_points))
    end if
    held%along = 0.0_wp
    held%across = 0.0_wp
    held%follows = 0.0_wp
    held%own = -z
    do i = 1, problem%n_points
      p = -at%dz_dr(:, :, i)
      do a = 1, 3
        p(a, a) = p(a, a) + 1.0_wp
      end do
      hold_n = merge(1.0_wp, 0.0_wp, p(1, 1) > 0.0_wp)
      held%along(1, 1, i) = hold_n
      t = p(2:, 2:)
      do a = 1, 2
        if (problem%row(1 + a, i) == 0) then
          t(a, :) = 0.0_wp
          t(:, a) = 0.0_wp
        end if
      end do
      largest = t(1, 1) + t(2, 2)
      if (largest > 1.0_wp .or. (is_held(t(1, 1), problem%row(2, i)) .and. is_held(t(2, 2), &
        problem%row(3, i)) .and. largest > 0.0_wp)) then
        ! It sticks.
        do a = 2, 3
          if (problem%row(a, i) > 0) held%along(a, a, i) = 1.0_wp
        end do
        cycle
      end if
      if (largest > most_across) then
        held%along(2:, 2:, i) = t/largest
        t = 0.0_wp
      end if
      e = inverse_of(reshape([1.0_wp - t(1, 1), -t(2, 1), -t(1, 2), 1.0_wp - t(2, 2)], [2, 2]))
      held%across(2:, 2:, i) = problem%rho_global(2, i)*matmul(e, t)
      held%follows(2:, i) = matmul(e, p(2:, 1))
      held%own(2:, i) = matmul(e, p(2:, 1)*z(1, i) - z(2:, i))
    end do

  contains

    pure logical function is_held(t_aa, row)
      real(wp), intent(in) :: t_aa
      integer, intent(in) :: row

      is_held = row == 0 .or. t_aa >= 1.0_wp
    end function is_held

    pure function inverse_of(m) result(inverse)
      real(wp), intent(in) :: m(2, 2)
      real(wp) :: inverse(2, 2)

      inverse = reshape([m(2, 2), -m(2, 1), -m(1, 2), m(1, 1)], [2, 2])/ &
        (m(1, 1)*m(2, 2) - m(1, 2)*m(2, 1))
    end function inverse_of

  end subroutine find_held

end module held_points_mod
