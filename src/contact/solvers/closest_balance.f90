!> How close contact can come to balancing the loads on free motions, whatever moves.
!>
!> Reactions within Coulomb's cones K give the motions all forces Q^T r of a convex cone. The one
!> closest to the loads leaves e = Q^T r + q, with
!>
!>     e . q = |e|^2   and   r' . Q e >= 0   for all r' in K,
!>
!> so that no reactions balance the loads where e is not 0: work along e would be positive. That
!> holds for every path, so that neither friction nor gaps need to be solved for to know it.
!> docs/theory.md section 9.
module closest_balance_mod
  use kinds_mod, only: wp
  use dense_mod, only: solve_least_squares
  use problem_mod, only: contact_problem_t
  implicit none
  private

  public :: find_closest_balance, most_wedged

  real(wp), parameter :: most_wedged = 1.0e4_wp !! of the loads: reactions to believe [-]

contains

  !> What the closest reactions leave over, and whether none balance the loads.
  !>
  !> The cone is that of finitely many of its rays, of which the one is added along which e does the
  !> most negative work, until there is none, or its work is too little for reactions of any size to
  !> matter (Wolfe's method of the nearest point, with Lawson and Hanson's for the shares).
  subroutine find_closest_balance(problem, q, load, e, is_proven)
    type(contact_problem_t), intent(in) :: problem !! its rows and coefficients of friction
    real(wp), intent(in) :: q(:, :)     !! (n_rows,n) what the motions do at the rows [-]
    real(wp), intent(in) :: load(:)     !! (n) work of the loads on a unit of each [force]
    real(wp), intent(out) :: e(:)       !! (n) what is left out of balance [force]
    logical, intent(out) :: is_proven   !! false: reactions may balance them
    real(wp), parameter :: nothing = 1.0e-13_wp !! left of the loads [-]
    real(wp) :: ray(size(load), size(load) + 1) !! of unit length
    real(wp) :: share(size(load) + 1)   !! of each [force]
    real(wp) :: work, left
    integer :: i, n_rays

    is_proven = .false.
    e = load
    n_rays = 0
    do i = 1, 50 + 10*size(load)
      left = norm2(e)
      if (left <= nothing*norm2(load) .or. n_rays > size(load)) return
      call find_ray(problem, q, e, ray(:, n_rays + 1), work)
      is_proven = left**2 > max(0.0_wp, -work)*most_wedged*norm2(load)
      if (is_proven .or. work >= 0.0_wp) return
      n_rays = n_rays + 1
      share(n_rays) = 0.0_wp
      call share_out(load, ray, share, n_rays)
      e = load + matmul(ray(:, :n_rays), share(:n_rays))
      if (norm2(e) >= left) return ! rounding is all that is left
    end do
  end subroutine find_closest_balance

  !> The force on the motions, of length 1, of the reaction in a cone along which e does the least
  !> work, and that work of a reaction whose normal part is 1.
  pure subroutine find_ray(problem, q, e, ray, least)
    type(contact_problem_t), intent(in) :: problem
    real(wp), intent(in) :: q(:, :), e(:)
    real(wp), intent(out) :: ray(:)  !! (n) [-]
    real(wp), intent(out) :: least   !! negative: there is one [force]
    real(wp) :: along(size(q, 1)), tangential(2), r(3)
    integer :: i, a

    along = matmul(q, e)
    ray = 0.0_wp
    least = 0.0_wp
    do i = 1, problem%n_points
      associate (row => problem%row(:, i))
        tangential = 0.0_wp
        where (row(2:) > 0) tangential = along(max(1, row(2:)))
        r = [1.0_wp, -problem%mu(i)*tangential/max(norm2(tangential), tiny(1.0_wp))]
        ! What stays closed pulls as well, without friction.
        if (problem%stays(i) .and. 2.0_wp*along(row(1)) > problem%mu(i)*norm2(tangential)) r = &
          [-1.0_wp, 0.0_wp, 0.0_wp]
        associate (work => r(1)*along(row(1)) + dot_product(r(2:), tangential))
          if (work >= least) cycle
          least = work
        end associate
        ray = 0.0_wp
        do a = 1, 3
          if (row(a) > 0) ray = ray + r(a)*q(row(a), :)
        end do
      end associate
    end do
    if (norm2(ray) > 0.0_wp) ray = ray/norm2(ray)
  end subroutine find_ray

  !> The shares, none of them negative, with which the rays come closest to the loads. Rays without
  !> a share leave.
  subroutine share_out(load, ray, share, n)
    real(wp), intent(in) :: load(:)
    real(wp), intent(inout) :: ray(:, :) !! (m,:) the first n are the rays
    real(wp), intent(inout) :: share(:)  !! (:) a start, of the last 0, in; likewise [force]
    integer, intent(inout) :: n
    real(wp) :: wanted(n), step
    logical :: stays(n)
    integer :: i, n_before

    n_before = n
    do i = 1, n_before
      wanted(:n) = solve_least_squares(ray(:, :n), -load)
      if (all(wanted(:n) > 0.0_wp)) exit
      ! As far as the first share that vanishes.
      step = minval(share(:n)/max(share(:n) - wanted(:n), tiny(1.0_wp)), mask=wanted(:n) <= 0.0_wp)
      stays(:n) = wanted(:n) > 0.0_wp .or. share(:n)*(1.0_wp - step) + step*wanted(:n) > 0.0_wp
      share(:n) = share(:n) + step*(wanted(:n) - share(:n))
      stays(minloc(share(:n), dim=1, mask=wanted(:n) <= 0.0_wp)) = .false.
      call keep(stays(:n))
    end do
    share(:n) = wanted(:n)

  contains

    subroutine keep(stays)
      logical, intent(in) :: stays(:)
      integer :: j, kept

      kept = 0
      do j = 1, size(stays)
        if (.not. stays(j)) cycle
        kept = kept + 1
        ray(:, kept) = ray(:, j)
        share(kept) = share(j)
      end do
      n = kept
    end subroutine keep

  end subroutine share_out

end module closest_balance_mod
