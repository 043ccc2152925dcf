!> Dense linear algebra by LAPACK: inverse, solution, least squares, eigenvectors, singular values,
!> bases of ranges and null spaces.
module dense_mod
  use kinds_mod, only: wp
  use blas_mod, only: dgemm, dsymv, dtrsm
  implicit none
  private

  public :: begin_blas, invert_spd, mirror_lower, times_symmetric, times_transposed, solve_dense, &
    factorise_general, solve_factorised, &
    solve_least_squares, invert_general, symmetric_eigenvectors, singular_values, null_space, &
    range_basis, norm_1

  integer, parameter :: tile = 64              !! columns at once
  real(wp), parameter :: singular = 1.0e-14_wp !! reciprocal condition taken for 0 [-]

  interface
    !> LAPACK: Cholesky factor of a symmetric positive definite matrix.
    subroutine dpotrf(uplo, n, a, lda, info)
      import :: wp
      implicit none
      character, intent(in) :: uplo
      integer, intent(in) :: n, lda
      real(wp), intent(inout) :: a(lda, *)
      integer, intent(out) :: info
    end subroutine dpotrf

    !> LAPACK: inverse from the Cholesky factor.
    subroutine dpotri(uplo, n, a, lda, info)
      import :: wp
      implicit none
      character, intent(in) :: uplo
      integer, intent(in) :: n, lda
      real(wp), intent(inout) :: a(lda, *)
      integer, intent(out) :: info
    end subroutine dpotri

    !> LAPACK: LU factors of a general matrix.
    subroutine dgetrf(m, n, a, lda, ipiv, info)
      import :: wp
      implicit none
      integer, intent(in) :: m, n, lda
      real(wp), intent(inout) :: a(lda, *)
      integer, intent(out) :: ipiv(*), info
    end subroutine dgetrf

    !> LAPACK: reciprocal of the condition number, from the factors.
    subroutine dgecon(norm, n, a, lda, anorm, rcond, work, iwork, info)
      import :: wp
      implicit none
      character, intent(in) :: norm
      integer, intent(in) :: n, lda
      real(wp), intent(in) :: a(lda, *), anorm
      real(wp), intent(out) :: rcond, work(*)
      integer, intent(out) :: iwork(*), info
    end subroutine dgecon

    !> LAPACK: solution from the factors.
    subroutine dgetrs(trans, n, nrhs, a, lda, ipiv, b, ldb, info)
      import :: wp
      implicit none
      character, intent(in) :: trans
      integer, intent(in) :: n, nrhs, lda, ldb, ipiv(*)
      real(wp), intent(in) :: a(lda, *)
      real(wp), intent(inout) :: b(ldb, *)
      integer, intent(out) :: info
    end subroutine dgetrs

    !> LAPACK: solution of least norm by a complete orthogonal factorisation.
    subroutine dgelsy(m, n, nrhs, a, lda, b, ldb, jpvt, rcond, rank, work, lwork, info)
      import :: wp
      implicit none
      integer, intent(in) :: m, n, nrhs, lda, ldb, lwork
      real(wp), intent(inout) :: a(lda, *), b(ldb, *)
      integer, intent(inout) :: jpvt(*)
      real(wp), intent(in) :: rcond
      integer, intent(out) :: rank, info
      real(wp), intent(out) :: work(*)
    end subroutine dgelsy

    !> LAPACK: inverse from the LU factors.
    subroutine dgetri(n, a, lda, ipiv, work, lwork, info)
      import :: wp
      implicit none
      integer, intent(in) :: n, lda, ipiv(*), lwork
      real(wp), intent(inout) :: a(lda, *)
      real(wp), intent(out) :: work(*)
      integer, intent(out) :: info
    end subroutine dgetri

    !> LAPACK: eigenvalues and eigenvectors of a symmetric matrix.
    pure subroutine dsyev(jobz, uplo, n, a, lda, w, work, lwork, info)
      import :: wp
      implicit none
      character, intent(in) :: jobz, uplo
      integer, intent(in) :: n, lda, lwork
      real(wp), intent(inout) :: a(lda, *)
      real(wp), intent(out) :: w(*), work(*)
      integer, intent(out) :: info
    end subroutine dsyev

    !> LAPACK: QR factors.
    subroutine dgeqrf(m, n, a, lda, tau, work, lwork, info)
      import :: wp
      implicit none
      integer, intent(in) :: m, n, lda, lwork
      real(wp), intent(inout) :: a(lda, *)
      real(wp), intent(out) :: tau(*), work(*)
      integer, intent(out) :: info
    end subroutine dgeqrf

    !> LAPACK: QR factors, each column the longest that is left.
    subroutine dgeqp3(m, n, a, lda, jpvt, tau, work, lwork, info)
      import :: wp
      implicit none
      integer, intent(in) :: m, n, lda, lwork
      real(wp), intent(inout) :: a(lda, *)
      integer, intent(inout) :: jpvt(*)
      real(wp), intent(out) :: tau(*), work(*)
      integer, intent(out) :: info
    end subroutine dgeqp3

    !> LAPACK: products with Q, from the QR factors.
    subroutine dormqr(side, trans, m, n, k, a, lda, tau, c, ldc, work, lwork, info)
      import :: wp
      implicit none
      character, intent(in) :: side, trans
      integer, intent(in) :: m, n, k, lda, ldc, lwork
      real(wp), intent(in) :: a(lda, *), tau(*)
      real(wp), intent(inout) :: c(ldc, *)
      real(wp), intent(out) :: work(*)
      integer, intent(out) :: info
    end subroutine dormqr

    !> LAPACK: inverse of a triangle.
    subroutine dtrtri(uplo, diag, n, a, lda, info)
      import :: wp
      implicit none
      character, intent(in) :: uplo, diag
      integer, intent(in) :: n, lda
      real(wp), intent(inout) :: a(lda, *)
      integer, intent(out) :: info
    end subroutine dtrtri

    !> LAPACK: the columns of Q, from the QR factors.
    subroutine dorgqr(m, n, k, a, lda, tau, work, lwork, info)
      import :: wp
      implicit none
      integer, intent(in) :: m, n, k, lda, lwork
      real(wp), intent(inout) :: a(lda, *)
      real(wp), intent(in) :: tau(*)
      real(wp), intent(out) :: work(*)
      integer, intent(out) :: info
    end subroutine dorgqr

    !> LAPACK: singular value decomposition.
    subroutine dgesdd(jobz, m, n, a, lda, s, u, ldu, vt, ldvt, work, lwork, iwork, info)
      import :: wp
      implicit none
      character, intent(in) :: jobz
      integer, intent(in) :: m, n, lda, ldu, ldvt, lwork
      real(wp), intent(inout) :: a(lda, *)
      real(wp), intent(out) :: s(*), u(ldu, *), vt(ldvt, *), work(*)
      integer, intent(out) :: iwork(*), info
    end subroutine dgesdd
  end interface

  interface solve_dense
    module procedure solve_dense_columns, solve_dense_column
  end interface solve_dense

  interface solve_least_squares
    module procedure least_squares_columns, least_squares_column
  end interface solve_least_squares

contains

  !> Have the linear algebra library take its memory. It does so when it is first used, and waits
  !> for ever for what it does not get; so that is while there is some (check_blas_room).
  subroutine begin_blas()
    real(wp) :: x(1)

    x = times_symmetric(reshape([1.0_wp], [1, 1]), [1.0_wp])
  end subroutine begin_blas

  !> Replace a matrix by its inverse, both triangles; only the lower one is read.
  subroutine invert_spd(a, positive_definite)
    real(wp), intent(inout) :: a(:, :)        !! (n,n); destroyed where not positive definite
    logical, intent(out) :: positive_definite !! to working precision
    integer :: n, info

    n = size(a, 1)
    info = 0
    if (n > 0) call dpotrf('L', n, a, n, info)
    if (info == 0 .and. n > 0) call dpotri('L', n, a, n, info)
    positive_definite = info == 0
    if (positive_definite) call mirror_lower(a)
  end subroutine invert_spd

  !> Copy the lower triangle to the upper one.
  pure subroutine mirror_lower(a)
    real(wp), intent(inout) :: a(:, :) !! (n,n)
    integer :: i, j, first

    ! Tile by tile: a whole row at once would touch a page of memory an entry.
    do first = 1, size(a, 1), tile
      do j = 1, size(a, 1)
        do i = first, min(first + tile - 1, j - 1)
          a(i, j) = a(j, i)
        end do
      end do
    end do
  end subroutine mirror_lower

  !> A x for a symmetric A, of which only the lower triangle is read.
  function times_symmetric(a, x) result(y)
    real(wp), contiguous, intent(in) :: a(:, :) !! (n,n)
    real(wp), contiguous, intent(in) :: x(:)    !! (n)
    real(wp) :: y(size(x))

    y = 0.0_wp
    if (size(x) > 0) call dsymv('L', size(x), 1.0_wp, a, size(x), x, 1, 0.0_wp, y, 1)
  end function times_symmetric

  !> A^T B. Only those rows are read that some columns of A have: of bodies that touch a few others
  !> they are few.
  subroutine times_transposed(m, n, k, a, b, product)
    integer, intent(in) :: m, n, k            !! rows, columns of A, columns of B
    real(wp), intent(in) :: a(m, n), b(m, k)
    real(wp), intent(inout) :: product(n, k)  !! out
    integer :: j, columns, first, last

    do j = 1, n, tile
      columns = min(tile, n - j + 1)
      do first = 1, m
        if (any(abs(a(first, j:j + columns - 1)) > 0.0_wp)) exit
      end do
      do last = m, first + 1, -1
        if (any(abs(a(last, j:j + columns - 1)) > 0.0_wp)) exit
      end do
      first = min(first, last)
      call dgemm('T', 'N', columns, k, last - first + 1, 1.0_wp, a(first, j), m, b(first, 1), m, &
        0.0_wp, product(j, 1), n)
    end do
  end subroutine times_transposed

  !> Solve J X = B; where J is singular to working precision, the columns of least norm.
  subroutine solve_dense_columns(j, b)
    real(wp), intent(inout) :: j(:, :) !! (n,n), destroyed
    real(wp), intent(inout) :: b(:, :) !! (n,k) right-hand sides in, solutions out
    real(wp) :: copy(size(j, 1), size(j, 1))
    real(wp), allocatable :: work(:)
    integer, allocatable :: pivot(:)
    integer :: n, k, info, rank
    logical :: regular

    n = size(j, 1)
    k = size(b, 2)
    if (n == 0 .or. k == 0) return
    copy = j
    call factorise_general(j, pivot, regular)
    if (regular) then
      call dgetrs('N', n, k, j, n, pivot, b, n, info)
      return
    end if
    allocate (work(64*(n + max(n, k) + 1)))
    pivot = 0
    call dgelsy(n, n, k, copy, n, b, n, pivot, singular, rank, work, size(work), info)
  end subroutine solve_dense_columns

  !> LU factors of a matrix, for `solve_factorised`.
  subroutine factorise_general(a, pivot, regular)
    real(wp), intent(inout) :: a(:, :)        !! (n,n) the factors out
    integer, allocatable, intent(out) :: pivot(:)
    logical, intent(out) :: regular           !! to working precision
    real(wp), allocatable :: work(:)
    integer, allocatable :: integers(:)
    real(wp) :: size_a, rcond
    integer :: n, info

    n = size(a, 1)
    allocate (pivot(n))
    regular = n == 0
    if (regular) return
    size_a = norm_1(a)
    call dgetrf(n, n, a, n, pivot, info)
    if (info /= 0) return
    allocate (work(4*n), integers(n))
    call dgecon('1', n, a, n, size_a, rcond, work, integers, info)
    regular = rcond > singular
  end subroutine factorise_general

  !> Solution by these factors.
  subroutine solve_factorised(a, pivot, b)
    real(wp), contiguous, intent(in) :: a(:, :) !! (n,n) factors
    integer, contiguous, intent(in) :: pivot(:) !! (n)
    real(wp), intent(inout) :: b(:)             !! (n) right-hand side in, solution out
    integer :: n, info

    n = size(b)
    if (n > 0) call dgetrs('N', n, 1, a, n, pivot, b, n, info)
  end subroutine solve_factorised

  !> The same for one column.
  subroutine solve_dense_column(j, b)
    real(wp), intent(inout) :: j(:, :) !! (n,n), destroyed
    real(wp), intent(inout) :: b(:)    !! (n) right-hand side in, solution out
    real(wp) :: columns(size(b), 1)

    columns(:, 1) = b
    call solve_dense_columns(j, columns)
    b = columns(:, 1)
  end subroutine solve_dense_column

  !> The x of least norm among those for which |A x - b| is least, for each column of b.
  function least_squares_columns(a, b) result(x)
    real(wp), intent(in) :: a(:, :) !! (m,n)
    real(wp), intent(in) :: b(:, :) !! (m,k)
    real(wp) :: x(size(a, 2), size(b, 2))
    real(wp), parameter :: dependent = 1.0e-10_wp ! columns closer than this count as one
    real(wp) :: copy(size(a, 1), size(a, 2)), rhs(max(size(b, 1), size(a, 2)), size(b, 2))
    real(wp) :: work(65*(size(a, 2) + max(size(b, 1), size(b, 2)) + 1))
    integer :: pivot(size(a, 2)), rank, info

    copy = a
    rhs(:size(b, 1), :) = b
    pivot = 0
    call dgelsy(size(a, 1), size(a, 2), size(b, 2), copy, size(a, 1), rhs, size(rhs, 1), pivot, &
      dependent, &
      rank, work, size(work), info)
    x = rhs(:size(a, 2), :)
  end function least_squares_columns

  !> The same for one column.
  function least_squares_column(a, b) result(x)
    real(wp), intent(in) :: a(:, :) !! (m,n)
    real(wp), intent(in) :: b(:)    !! (m)
    real(wp) :: x(size(a, 2))
    real(wp) :: columns(size(a, 2), 1)

    columns = least_squares_columns(a, reshape(b, [size(b), 1]))
    x = columns(:, 1)
  end function least_squares_column

  !> Replace a square matrix by its inverse.
  subroutine invert_general(a, regular)
    real(wp), intent(inout) :: a(:, :) !! (n,n); destroyed where singular
    logical, intent(out) :: regular
    real(wp) :: work(64*size(a, 1))
    integer :: pivot(size(a, 1)), n, info

    n = size(a, 1)
    call dgetrf(n, n, a, n, pivot, info)
    if (info == 0) call dgetri(n, a, n, pivot, work, size(work), info)
    regular = info == 0
  end subroutine invert_general

  !> Eigenvalues, ascending, and eigenvectors of a symmetric matrix.
  pure subroutine symmetric_eigenvectors(a, eigenvalue, ok)
    real(wp), intent(inout) :: a(:, :)      !! (n,n) matrix in, eigenvectors (columns) out
    real(wp), intent(out) :: eigenvalue(:)  !! (n)
    logical, intent(out) :: ok              !! false: LAPACK did not converge
    real(wp) :: work(64*size(a, 1))
    integer :: info

    call dsyev('V', 'U', size(a, 1), a, size(a, 1), eigenvalue, work, size(work), info)
    ok = info == 0
  end subroutine symmetric_eigenvectors

  !> Singular values, descending, with the right singular vectors: A = U diag(s) V^T.
  subroutine singular_values(a, s, v, ok, u)
    real(wp), intent(in) :: a(:, :)   !! (m,n)
    real(wp), intent(out) :: s(:)     !! (n) those beyond m are 0
    real(wp), intent(out) :: v(:, :)  !! (n,n) columns, a basis of the whole space
    logical, intent(out) :: ok        !! false: LAPACK did not converge
    real(wp), intent(out), optional :: u(:, :)
    !! (max(m,n),n) columns: A = U S V^T, rows beyond m of zeros
    real(wp) :: copy(max(size(a, 1), size(a, 2)), size(a, 2)), none(1, 1)
    real(wp) :: vt(size(a, 2), size(a, 2))
    real(wp), allocatable :: work(:)
    integer :: iwork(8*size(a, 2)), m, n, info

    m = size(a, 1)
    n = size(a, 2)
    s = 0.0_wp
    ok = .true.
    if (n == 0) return
    ! Rows of zeros stand for those that are missing.
    copy = 0.0_wp
    copy(:m, :) = a
    m = size(copy, 1)
    allocate (work(3*n + max(m, 5*n*n + 4*n)))
    call dgesdd('O', m, n, copy, m, s, none, 1, vt, n, work, size(work), iwork, info)
    ok = info == 0
    v = transpose(vt)
    if (present(u)) u = copy
  end subroutine singular_values

  !> Orthonormal columns that A takes to 0; none where LAPACK does not converge.
  function null_space(a, threshold) result(basis)
    real(wp), intent(in) :: a(:, :)          !! (m,n)
    real(wp), intent(in) :: threshold        !! of the largest singular value: taken for 0 [-]
    real(wp), allocatable :: basis(:, :)      !! (n,k)
    real(wp) :: s(size(a, 2)), v(size(a, 2), size(a, 2))
    integer :: n, k
    logical :: ok

    n = size(a, 2)
    if (are_independent(a)) then
      allocate (basis(n, 0))
      return
    end if
    call null_space_by_rank(a, threshold, basis, ok)
    if (ok) return
    k = 0
    call singular_values(a, s, v, ok)
    if (ok .and. n > 0) k = count(s <= threshold*s(1))
    basis = v(:, n - k + 1:)
  end function null_space

  !> The same from A^T P = Q R with the longest columns first, at a tenth of the cost, where that
  !> leaves no doubt: the first r rows of R are independent by more than the threshold, and the
  !> others, R_2, are rounding. |r_11| <= s_1 <= |R|_F, s_r >= 1/|R_1^-1|_F, s_r+1 <= |R_2|_F.
  subroutine null_space_by_rank(a, threshold, basis, is_certain)
    real(wp), intent(in) :: a(:, :)          !! (m,n)
    real(wp), intent(in) :: threshold        !! of the largest singular value [-]
    real(wp), allocatable, intent(out) :: basis(:, :) !! (n,n-r) where that is certain
    logical, intent(out) :: is_certain
    integer, parameter :: block = 32         !! columns at once
    real(wp) :: factor(size(a, 2), size(a, 1)), r(size(a, 2), size(a, 1)), tau(size(a, 1))
    real(wp) :: work(block*(size(a, 1) + size(a, 2) + 1)), rounding
    real(wp), allocatable :: inverse(:, :)
    integer :: pivot(size(a, 1)), m, n, rank, i, info

    m = size(a, 1)
    n = size(a, 2)
    is_certain = .false.
    if (m == 0 .or. n == 0) return
    factor = transpose(a)
    pivot = 0
    call dgeqp3(n, m, factor, n, pivot, tau, work, size(work), info)
    if (info /= 0) return
    r = 0.0_wp
    do i = 1, m
      r(:min(i, n), i) = factor(:min(i, n), i)
    end do
    rounding = 10.0_wp*(m + n)*epsilon(1.0_wp)*abs(r(1, 1))
    rank = count(abs([(r(i, i), i=1, min(m, n))]) > rounding)
    if (rank == 0) return
    ! What is no number proves nothing.
    if (.not. norm2(r(rank + 1:, :)) <= min(rounding, threshold*abs(r(1, 1)))) return
    inverse = r(:rank, :rank)
    call dtrtri('U', 'N', rank, inverse, rank, info)
    if (info /= 0) return
    if (.not. threshold*norm2(inverse)*norm2(r) < 1.0_wp) return
    allocate (basis(n, n - rank), source=0.0_wp)
    do i = 1, n - rank
      basis(rank + i, i) = 1.0_wp
    end do
    call dormqr('L', 'N', n, n - rank, rank, factor, n, tau, basis, n, work, size(work), info)
    is_certain = info == 0
  end subroutine null_space_by_rank

  !> Orthonormal columns Q = A B that span what those of A span; none where LAPACK does not
  !> converge.
  subroutine range_basis(a, threshold, q, b)
    real(wp), intent(in) :: a(:, :)          !! (m,n)
    real(wp), intent(in) :: threshold        !! of the largest singular value: taken for 0 [-]
    real(wp), allocatable, intent(out) :: q(:, :) !! (m,k)
    real(wp), allocatable, intent(out) :: b(:, :) !! (n,k)
    real(wp) :: s(size(a, 2)), v(size(a, 2), size(a, 2)), work(64*size(a, 2))
    integer :: m, n, k, i, info
    logical :: ok

    m = size(a, 1)
    n = size(a, 2)
    if (are_independent(a)) then
      allocate (q, source=a)
      allocate (b(n, n), source=0.0_wp)
      do i = 1, n
        b(i, i) = 1.0_wp
      end do
      call dgeqrf(m, n, q, m, s, work, size(work), info)
      call dtrsm('L', 'U', 'N', 'N', n, n, 1.0_wp, q, m, b, n)
      call dorgqr(m, n, n, q, m, s, work, size(work), info)
      return
    end if
    k = 0
    call singular_values(a, s, v, ok)
    if (ok .and. n > 0) k = count(s > threshold*s(1))
    allocate (q(m, k), b(n, k))
    do i = 1, k
      b(:, i) = v(:, i)/s(i)
    end do
    if (k > 0) call dgemm('N', 'N', m, k, n, 1.0_wp, a, m, b, n, 0.0_wp, q, m)
  end subroutine range_basis

  !> Whether the columns of A are independent beyond doubt: A^T A has no eigenvalue that rounding
  !> could have made of 0. Cheaper than singular values by an order, and false says nothing.
  logical function are_independent(a)
    real(wp), intent(in) :: a(:, :)          !! (m,n)
    real(wp) :: gram(size(a, 2), size(a, 2)), trace, rounding
    integer :: m, n, i, info

    m = size(a, 1)
    n = size(a, 2)
    are_independent = .false.
    if (n == 0 .or. n > m) return
    call times_transposed(m, n, n, a, a, gram)
    trace = sum([(gram(i, i), i=1, n)])
    rounding = 10.0_wp*(m + n)*epsilon(1.0_wp)*trace
    do i = 1, n
      gram(i, i) = gram(i, i) - rounding
    end do
    call dpotrf('L', n, gram, n, info)
    are_independent = info == 0 .and. trace > 0.0_wp
  end function are_independent

  !> The largest sum of a column; 0 of an empty matrix.
  pure real(wp) function norm_1(a)
    real(wp), intent(in) :: a(:, :)
    integer :: j

    norm_1 = 0.0_wp
    do j = 1, size(a, 2)
      norm_1 = max(norm_1, sum(abs(a(:, j))))
    end do
  end function norm_1

end module dense_mod
