!> Strong ellipticity of a law: whether its acoustic tensor is positive definite in all directions.
!>
!>     Q_ik(n) = A_ijkl n_j n_l,      A = dP/dF
!>
!> Where it is not, a deformation may break up into bands as thin as the elements are, and no mesh
!> is fine enough. docs/theory.md (8.19), (8.20).
module ellipticity_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: largest_eigenvalue
  use strain_measures_mod, only: green_strain
  use material_law_mod, only: law_t, finite_tangent
  implicit none
  private

  public :: principal_stretches, is_elliptic, elliptic_reach

  integer, parameter :: most_splits = 8
  !! of triangles of directions: the least determinant is then known to 1e-5 of the largest
  real(wp), parameter :: rounding = 64.0_wp*epsilon(1.0_wp) !! of a determinant [-]

contains

  !> The principal stretches of F = I + H, the largest first.
  pure function principal_stretches(h) result(stretch)
    real(wp), intent(in) :: h(3, 3) !! du_i/dX_j, det F > 0 [-]
    real(wp) :: stretch(3)          !! [-]
    real(wp) :: e(3, 3)

    e = green_strain(h)
    stretch(1) = largest_eigenvalue(e)
    stretch(3) = -largest_eigenvalue(-e)
    stretch(2) = e(1, 1) + e(2, 2) + e(3, 3) - stretch(1) - stretch(3)
    stretch = sqrt(max(0.0_wp, 1.0_wp + 2.0_wp*stretch))
  end function principal_stretches

  !> Whether an isotropic law is strongly elliptic at principal stretches.
  !>
  !> In their axes Q has the diagonal d_i = sum_j A_ijij x_j, x_j = n_j^2, and off it m_ij n_i n_j,
  !> m_ij = A_iijj + A_ijji: its determinant is a cubic form in x. Q is positive definite
  !> everywhere if it is so along an axis, and the form positive on the triangle x >= 0, sum x = 1.
  pure logical function is_elliptic(law, stretch)
    type(law_t), intent(in) :: law
    real(wp), intent(in) :: stretch(3) !! > 0 [-]
    real(wp) :: h(3, 3), a(3, 3, 3, 3), at_axes(6, 3), m(3)
    integer :: i, j

    h = 0.0_wp
    do i = 1, 3
      h(i, i) = stretch(i) - 1.0_wp
    end do
    a = finite_tangent(law, h)
    a = a/maxval(abs(a))
    at_axes = 0.0_wp
    do j = 1, 3
      at_axes(j, j) = 1.0_wp
      do i = 1, 3
        at_axes(3 + i, j) = a(i, j, i, j)
      end do
    end do
    m = [a(2, 2, 3, 3) + a(2, 3, 3, 2), a(1, 1, 3, 3) + a(1, 3, 3, 1), a(1, 1, 2, 2) + &
      a(1, 2, 2, 1)]
    is_elliptic = all(at_axes(4:, 1) > 0.0_wp)
    if (is_elliptic) is_elliptic = is_positive(m, at_axes, most_splits)
  end function is_elliptic

  !> Whether the determinant is positive on a triangle of directions.
  !>
  !> It is between the least and the largest of its Bezier coefficients. Where they leave that open,
  !> four triangles of half the size are asked.
  pure recursive logical function is_positive(m, x, splits) result(positive)
    real(wp), intent(in) :: m(3)     !! as of `determinant_between` [-]
    real(wp), intent(in) :: x(6, 3)  !! likewise, at the corners of the triangle
    integer, intent(in) :: splits    !! that are left
    real(wp) :: coefficient(10), middle(6, 3)
    integer :: i, j

    do i = 1, 3
      j = mod(i, 3) + 1
      coefficient(i) = determinant_between(m, x(:, i), x(:, i), x(:, i))
      coefficient(3 + i) = determinant_between(m, x(:, i), x(:, i), x(:, j))
      coefficient(6 + i) = determinant_between(m, x(:, i), x(:, j), x(:, j))
    end do
    coefficient(10) = determinant_between(m, x(:, 1), x(:, 2), x(:, 3))
    positive = minval(coefficient) > -rounding
    if (positive .or. splits == 0 .or. minval(coefficient(:3)) <= -rounding) return
    do i = 1, 3
      middle(:, i) = 0.5_wp*(x(:, i) + x(:, mod(i, 3) + 1))
    end do
    positive = is_positive(m, middle, splits - 1)
    do i = 1, 3
      j = mod(i + 1, 3) + 1 ! the corner before this one
      if (positive) positive = is_positive(m, reshape([x(:, i), middle(:, i), middle(:, j)], &
        [6, 3]), splits - 1)
    end do
  end function is_positive

  !> The polar form of det Q: linear in each of three directions, of three equal ones det Q itself.
  !> det Q is a sum of products of three linear forms: the diagonal of Q, and the coordinates.
  pure real(wp) function determinant_between(m, x, y, z) result(value)
    real(wp), intent(in) :: m(3)  !! of Q off the diagonal: m(i) is that without axis i [-]
    real(wp), intent(in), dimension(6) :: x, y, z
    !! squares of the components of a direction, then the diagonal of Q [-]

    value = (permanent(4, 5, 6) + 2.0_wp*m(1)*m(2)*m(3)*permanent(1, 2, 3) - &
      m(1)**2*permanent(4, 2, 3) - m(2)**2*permanent(5, 3, 1) - m(3)**2*permanent(6, 1, 2))/6.0_wp

  contains

    !> The sum of the products of a determinant, all with the same sign.
    pure real(wp) function permanent(i, j, k)
      integer, intent(in) :: i, j, k !! linear forms

      permanent = x(i)*(y(j)*z(k) + y(k)*z(j)) + x(j)*(y(i)*z(k) + y(k)*z(i)) + &
        x(k)*(y(i)*z(j) + y(j)*z(i))
    end function permanent

  end function determinant_between

  !> How far stretches may be from 1 for a law to be strongly elliptic beyond doubt: nine tenths of
  !> the t up to which it is so at all stretches of 1 - t, 1 - t/2, 1, 1 + t/2 and 1 + t.
  pure real(wp) function elliptic_reach(law) result(reach)
    type(law_t), intent(in) :: law
    integer, parameter :: most = 63
    real(wp), parameter :: step = 0.015_wp
    integer :: n

    ! One after the other: a law may lose its ellipticity and get it back.
    n = 0
    do while (n < most)
      if (.not. is_elliptic_within((n + 1)*step)) exit
      n = n + 1
    end do
    reach = 0.9_wp*n*step

  contains

    pure logical function is_elliptic_within(t)
      real(wp), intent(in) :: t
      integer :: i, j, k

      is_elliptic_within = .true.
      do i = -2, 2
        do j = -2, i
          do k = -2, j
            if (is_elliptic_within) is_elliptic_within = is_elliptic(law, &
              1.0_wp + 0.5_wp*t*real([i, j, k], wp))
          end do
        end do
      end do
    end function is_elliptic_within

  end function elliptic_reach

end module ellipticity_mod
