!> Newton's method on reactions and motions together.
!>
!>     Z(r, x) = 0,   x = W r + x_start + Q c,      e = Q^T r + q = 0
!>
!> with Z of global Newton, c the centre of the proximal problem. The centres of the proximal
!> iteration solve the contact problem at each of them, and their balance has folds where a point
!> changes between open, stick and slide. Here both change at once, and neither has to be solved on
!> the way:
!>
!>     J dr + dZ/dx Q dc = -Z,      Q^T dr = -e
!>
!> docs/theory.md section 9.
module joint_newton_mod
  use kinds_mod, only: wp
  use dense_mod, only: solve_dense, solve_least_squares
  use problem_mod, only: contact_problem_t, pack_rows, unpack_rows
  use newton_iterate_mod, only: residual_at
  use newton_correction_mod, only: linearise
  implicit none
  private

  public :: solve_jointly

  integer,  parameter :: max_iterations = 40
  integer,  parameter :: max_on_line = 16  !! trials along a step
  integer,  parameter :: largest_ranked = 150
  !! rows up to which columns that are nearly dependent are left out: four times the operations
  real(wp), parameter :: closely = 1.0e-13_wp !! of the reactions: no more is to be gained [-]

contains

  !> Steps from the given reactions and centre; out are those that leave least of Z and e.
  !>
  !> Nothing is promised: the caller judges what comes out.
  subroutine solve_jointly(problem, q, load, x_start, r, centre, left)
    type(contact_problem_t), intent(in) :: problem
    real(wp), intent(in) :: q(:, :)         !! (n_rows,m) orthonormal motions at the rows [-]
    real(wp), intent(in) :: load(:)         !! (m) of the loads along them [force]
    real(wp), intent(in) :: x_start(:)      !! (n_rows) gaps and slips at centre 0 [length]
    real(wp), intent(inout) :: r(:, :)      !! (3,n_points) [force]
    real(wp), intent(inout) :: centre(:)    !! (m) [length]
    real(wp), intent(out) :: left
    !! of Z and e, beside the reactions; huge where it is as much or more [-]
    real(wp), dimension(problem%n_rows) :: now, z, dr, best
    real(wp), dimension(size(centre)) :: c, dc, best_centre
    real(wp), allocatable :: matrix(:, :), by_r(:, :), by_q(:, :)
    real(wp), dimension(problem%n_rows + size(centre)) :: rhs, norm, step
    real(wp) :: merit, least, best_fraction
    integer :: i, k, n, m

    n = problem%n_rows
    m = size(centre)
    allocate (matrix(n + m, n + m), by_r(n, n), by_q(n, m))

    now = pack_rows(problem, r)
    c = centre
    least = huge(least)
    left = least
    newton: do i = 1, max_iterations
      call linearise(problem, x_start + matmul(q, c), unpack_rows(problem, now), q, z, by_r, by_q)
      merit = size_of(z, matmul(now, q) + load)
      if (.not. merit < least) exit newton
      least = merit
      ! The projections, on their cones.
      best = now - z
      best_centre = c
      if (merit <= closely*norm2(best)) exit newton
      matrix(:n, :n) = by_r
      matrix(:n, n + 1:) = by_q
      matrix(n + 1:, :n) = transpose(q)
      matrix(n + 1:, n + 1:) = 0.0_wp
      rhs = -[z, matmul(now, q) + load]
      norm = norm2(matrix, dim=1)
      where (norm <= 0.0_wp) norm = 1.0_wp
      do k = 1, n + m
        matrix(:, k) = matrix(:, k)/norm(k)
      end do
      if (n <= largest_ranked) then
        step = solve_least_squares(matrix, rhs)/norm
      else
        call solve_dense(matrix, rhs)
        step = rhs/norm
      end if
      dr = step(:n)
      dc = step(n + 1:)
      call search_line(best_fraction)
      now = now + best_fraction*dr
      c = c + best_fraction*dc
    end do newton
    if (least >= huge(least)) return
    left = huge(left)
    if (least <= 0.0_wp) left = 0.0_wp
    if (least > 0.0_wp .and. least < norm2(best)) left = least/norm2(best)
    r = unpack_rows(problem, best)
    centre = best_centre

  contains

    !> Half the step until less is left; twice it for as long as less is left: where the law bends
    !> sharply plain steps creep.
    subroutine search_line(best_fraction)
      real(wp), intent(out) :: best_fraction !! of the step; 1 where none leaves less
      real(wp) :: fraction, tried

      best_fraction = 1.0_wp
      fraction = 1.0_wp
      line: do k = 1, max_on_line
        tried = size_of(residual_at(problem, x_start + matmul(q, c + fraction*dc), &
          unpack_rows(problem, now + fraction*dr)), matmul(now + fraction*dr, q) + load)
        if (tried < merit) then
          merit = tried
          best_fraction = fraction
          if (fraction < 1.0_wp) exit line
          fraction = 2.0_wp*fraction
        else if (best_fraction > 1.0_wp .or. merit < least) then
          exit line
        else
          fraction = 0.5_wp*fraction
        end if
      end do line
    end subroutine search_line

  end subroutine solve_jointly

  !> The size of all that is not fulfilled.
  pure real(wp) function size_of(z, e)
    real(wp), intent(in) :: z(:), e(:) !! [force]

    size_of = hypot(norm2(z), norm2(e))
  end function size_of

end module joint_newton_mod
