!> GMRES for a square linear system given by its products with vectors.
module gmres_mod
  use kinds_mod, only: wp
  implicit none
  private

  public :: linear_map_t, solve_by_gmres

  !> A square matrix known by what it does to a vector.
  type, abstract :: linear_map_t
  contains
    procedure(apply_map), deferred :: apply
  end type linear_map_t

  abstract interface
    subroutine apply_map(map, v, product)
      import :: linear_map_t, wp
      implicit none
      class(linear_map_t), intent(in) :: map
      real(wp), intent(in)  :: v(:)       !! (n)
      real(wp), intent(out) :: product(:) !! (n)
    end subroutine apply_map
  end interface

contains

  !> Solve A x = b from x = 0, without restart, until |b - A x| <= tolerance |b|.
  !>
  !> Arnoldi by modified Gram-Schmidt, the small least-squares problem by Givens rotations. A
  !> singular matrix ends at the best x of the Krylov space built so far.
  subroutine solve_by_gmres(map, b, tolerance, max_products, x, products, reached)
    class(linear_map_t), intent(in) :: map
    real(wp), intent(in)  :: b(:)         !! (n)
    real(wp), intent(in)  :: tolerance    !! of the residual, relative to b [-]
    integer,  intent(in)  :: max_products !! largest Krylov space
    real(wp), intent(out) :: x(:)         !! (n)
    integer,  intent(out) :: products     !! products with A
    logical,  intent(out) :: reached      !! the tolerance
    real(wp), allocatable :: v(:, :), h(:, :)
    real(wp) :: cosine(max_products), sine(max_products), g(max_products + 1), w(size(b)), size_b
    integer :: i, j, k

    x = 0.0_wp
    products = 0
    size_b = norm2(b)
    reached = size_b <= 0.0_wp
    if (reached) return
    allocate (v(size(b), max_products + 1), h(max_products + 1, max_products))
    v(:, 1) = b/size_b
    g = 0.0_wp
    g(1) = size_b
    k = 0
    arnoldi: do j = 1, max_products
      call map%apply(v(:, j), w)
      products = products + 1
      do i = 1, j
        h(i, j) = dot_product(v(:, i), w)
        w = w - h(i, j)*v(:, i)
      end do
      h(j + 1, j) = norm2(w)
      do i = 1, j - 1
        call rotate(cosine(i), sine(i), h(i, j), h(i + 1, j))
      end do
      call make_rotation(h(j, j), h(j + 1, j), cosine(j), sine(j))
      if (abs(h(j, j)*cosine(j) + h(j + 1, j)*sine(j)) <= epsilon(1.0_wp)*norm2(h(:j, &
        j))) exit arnoldi
      if (h(j + 1, j) > 0.0_wp) v(:, j + 1) = w/h(j + 1, j)
      call rotate(cosine(j), sine(j), h(j, j), h(j + 1, j))
      call rotate(cosine(j), sine(j), g(j), g(j + 1))
      k = j
      reached = abs(g(j + 1)) <= tolerance*size_b
      if (reached) exit arnoldi
    end do arnoldi
    do i = k, 1, -1
      g(i) = (g(i) - dot_product(h(i, i + 1:k), g(i + 1:k)))/h(i, i)
    end do
    x = matmul(v(:, :k), g(:k))
  end subroutine solve_by_gmres

  pure subroutine make_rotation(a, b, cosine, sine)
    real(wp), intent(in)  :: a, b
    real(wp), intent(out) :: cosine, sine
    real(wp) :: length

    length = norm2([a, b])
    cosine = 1.0_wp
    sine = 0.0_wp
    if (length <= 0.0_wp) return
    cosine = a/length
    sine = b/length
  end subroutine make_rotation

  pure subroutine rotate(cosine, sine, a, b)
    real(wp), intent(in) :: cosine, sine
    real(wp), intent(inout) :: a, b
    real(wp) :: old

    old = a
    a = cosine*old + sine*b
    b = -sine*old + cosine*b
  end subroutine rotate

end module gmres_mod
