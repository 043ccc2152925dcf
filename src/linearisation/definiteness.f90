!> Whether a symmetric matrix is positive definite, by a few solutions with the factor of another
!> one nearby.
module definiteness_mod
  use kinds_mod, only: wp, i8
  use errors_mod, only: error_t
  use dof_map_mod, only: dof_map_t, equations_of, unknowns_of
  use assembly_mod, only: triplets_t, scales_of
  use stiffness_inverse_mod, only: stiffness_inverse_t, apply_inverse
  implicit none
  private

  public :: is_surely_positive

  integer, parameter :: most_iterations = 30 !! a factor takes about as long
  real(wp), parameter :: unlikely = 1.0e-8_wp
  !! part of a vector at random that an unknown, times the root of their number, falls below by
  !! chance: about the chance of it [-]

contains

  !> Whether a tangent K is positive definite beyond doubt; false where a few iterations leave it
  !> open.
  !>
  !> They are conjugate gradients for K x = b, with the inverse at hand as approximate inverse M.
  !> The residual is a polynomial of K M in b: 1 at 0, its roots positive as long as every p.Kp is.
  !> On a motion v with K v = l M^-1 v, l <= 0, it is at least 1. So the residual keeps what such a
  !> motion has of b, which is at random, and falls below that only where there is none.
  !> docs/theory.md (8.29)
  logical function is_surely_positive(k, map, n_nodes, inverse) result(is_sure)
    type(triplets_t), intent(in) :: k                   !! one triangle; entries add up
    type(dof_map_t), intent(in) :: map                  !! of its unknowns
    integer, intent(in) :: n_nodes
    type(stiffness_inverse_t), intent(inout) :: inverse !! of the same unknowns, no others
    real(wp), dimension(k%n) :: r, z, p, q
    real(wp) :: rho, last, first, curvature
    integer :: i
    logical :: ok

    is_sure = k%n == 0
    if (is_sure) return
    r = at_random(k%n)/scales_of(k)
    call solve(r, z, ok)
    if (.not. ok) return
    p = z
    rho = dot_product(r, z)
    first = rho
    do i = 1, most_iterations
      q = product_with(k, p)
      curvature = dot_product(p, q)
      if (.not. curvature > 0.0_wp) return
      r = r - rho/curvature*q
      call solve(r, z, ok)
      if (.not. ok) return
      last = rho
      rho = dot_product(r, z)
      is_sure = abs(rho) <= unlikely**2/real(k%n, wp)*first
      if (is_sure .or. .not. rho > 0.0_wp) return
      p = z + rho/last*p
    end do

  contains

    subroutine solve(r, z, ok)
      real(wp), intent(in) :: r(:)
      real(wp), intent(out) :: z(:)
      logical, intent(out) :: ok
      type(error_t), allocatable :: error
      real(wp), allocatable :: force(:, :, :), moved(:, :, :)
      integer :: i, a, equations(3)

      allocate (force(3, n_nodes, 1), source=0.0_wp)
      do i = 1, n_nodes
        equations = equations_of(map, i)
        do a = 1, 3
          if (equations(a) > 0) force(a, i, 1) = r(equations(a))
        end do
      end do
      call apply_inverse(inverse, force, moved, error)
      ok = .not. allocated(error)
      if (ok) z = unknowns_of(map, moved(:, :, 1))
    end subroutine solve

  end function is_surely_positive

  !> K p.
  pure function product_with(k, p) result(q)
    type(triplets_t), intent(in) :: k
    real(wp), intent(in) :: p(:)
    real(wp) :: q(size(p))
    integer :: e

    q = 0.0_wp
    do e = 1, size(k%value)
      associate (i => k%row(e), j => k%column(e))
        q(i) = q(i) + k%value(e)*p(j)
        if (i /= j) q(j) = q(j) + k%value(e)*p(i)
      end associate
    end do
  end function product_with

  !> Numbers between -1 and 1 without a pattern, the same in every run: Park and Miller's.
  pure function at_random(n) result(numbers)
    integer, intent(in) :: n
    real(wp) :: numbers(n)
    integer(i8), parameter :: factor = 48271_i8, modulus = 2147483647_i8
    integer(i8) :: seed
    integer :: i

    seed = 1_i8
    do i = 1, n
      seed = modulo(factor*seed, modulus)
      numbers(i) = 2.0_wp*real(seed, wp)/real(modulus, wp) - 1.0_wp
    end do
  end function at_random

end module definiteness_mod
