!> Factorisation of a symmetric positive definite sparse matrix, with the Schur complement on its
!> last variables.
!>
!> With a Schur complement a solution goes in three parts: `condense` (right-hand side to the last
!> variables), the caller's dense solution there, `expand`. Where nothing acts on the others,
!> `extend` is the last part alone, at half the price.
!>
!> `analyse` looks at the pattern alone and foretells what the factorisation will need; `factorise`
!> of a matrix with that pattern then begins where it ended.
!>
!> The factor is in double or in single precision, of full rank or compressed, in memory or on the
!> disk, as `precision` says.
!> MUMPS gets the matrix with a diagonal near 1, D K D with powers of two in D, which round nothing:
!> it has absolute thresholds, and below pivots of about 1e-16 (double) its solutions are wrong
!> without a word. In single precision a right-hand side is scaled too, so that no force is out of
!> range; and the Schur variables never pass through single precision: what they get from the
!> caller's solution they keep to the last bit.
module sparse_factor_mod
  use kinds_mod, only: wp, sp, i8
  use errors_mod, only: error_t
  use controls_mod, only: precision_controls_t
  use assembly_mod, only: triplets_t, scales_of
  use double_factor_mod, only: double_factor_t => mumps_factor_t
  use single_factor_mod, only: single_factor_t => mumps_factor_t
  implicit none
  private

  public :: sparse_factor_t, analysis_t, analyse, factorise, is_analysed, analysed_order, &
    library_version, count_negative, solve_unsymmetric

  !> What the pattern of a matrix says of its factorisation, without a number of it.
  type :: analysis_t
    integer(i8) :: entries = 0     !! in the factor at full rank, the Schur complement left out
    integer(i8) :: bytes = 0       !! MUMPS's memory while it factorises, the matrix not counted
    real(wp) :: flops = 0.0_wp     !! of the elimination at full rank
    integer :: largest_front = 0   !! order of the largest dense matrix on the way
  end type analysis_t

  !> A factorised matrix. Its memory lives in MUMPS and is given back when the object goes.
  type :: sparse_factor_t
    type(precision_controls_t) :: precision !! of what is analysed and factorised next
    integer :: n = 0        !! equations
    integer :: n_schur = 0  !! of them, the last ones, in the Schur complement
    type(analysis_t) :: predicted   !! by the analysis
    integer(i8) :: entries = 0     !! in the factor; 0 before `factorise`
    integer(i8) :: solutions = 0   !! right-hand sides solved for, over all its matrices
    logical, private :: is_factorised = .false.
    real(wp), allocatable, private :: d(:) !! (n) D, near 1/sqrt(diagonal) [sqrt(length/force)]
    real(wp), allocatable, private :: size_b(:)
    !! (m) of the condensed right-hand sides, powers of two, where single [sqrt(force length)]
    type(double_factor_t), private :: double !! one of these two is used
    type(single_factor_t), private :: single
  contains
    procedure :: solve
    procedure :: condense
    procedure :: expand
    procedure :: extend
    final :: release
  end type sparse_factor_t

contains

  !> Analyse the pattern of `k`, whose values need not be there, for elimination in the given order.
  subroutine analyse(k, position, n_schur, factor, error)
    type(triplets_t), intent(in) :: k         !! one triangle; rows and columns
    integer, intent(in) :: position(:) !! (n) position of every equation, the Schur variables last
    integer, intent(in) :: n_schur            !! size of the Schur complement, may be 0
    type(sparse_factor_t), intent(inout) :: factor
    !! its precision is kept, what else it held is released
    type(error_t), allocatable, intent(out) :: error !! no memory

    call release(factor)
    factor%n = k%n
    factor%n_schur = n_schur
    if (n_schur == k%n) return ! nothing to eliminate
    associate (predicted => factor%predicted, precision => factor%precision)
      if (factor%precision%single_factor) then
        call factor%single%analyse(k, position, n_schur, precision, error)
        if (allocated(error)) return
        call factor%single%get_analysis(predicted%entries, predicted%bytes, predicted%flops, &
          predicted%largest_front)
      else
        call factor%double%analyse(k, position, n_schur, precision, error)
        if (allocated(error)) return
        call factor%double%get_analysis(predicted%entries, predicted%bytes, predicted%flops, &
          predicted%largest_front)
      end if
    end associate
  end subroutine analyse

  !> Whether `factor` is the analysis of the pattern of `k`, and no more.
  logical function is_analysed(factor, k, n_schur)
    type(sparse_factor_t), intent(in) :: factor
    type(triplets_t), intent(in) :: k
    integer, intent(in) :: n_schur

    is_analysed = .not. factor%is_factorised .and. factor%n == k%n .and. factor%n_schur == n_schur
    if (.not. is_analysed) return
    if (factor%precision%single_factor) then
      is_analysed = factor%single%has_pattern(k, factor%precision)
    else
      is_analysed = factor%double%has_pattern(k, factor%precision)
    end if
  end function is_analysed

  !> MUMPS's version, as in "5.5.1"; empty where it has nothing to do.
  function library_version(factor) result(version)
    type(sparse_factor_t), intent(in) :: factor
    character(:), allocatable :: version

    version = factor%double%version()
    if (version == '') version = factor%single%version()
  end function library_version

  !> The order of elimination that was analysed.
  pure function analysed_order(factor) result(position)
    type(sparse_factor_t), intent(in) :: factor !! an analysis
    integer, allocatable :: position(:)            !! (n) as of `analyse`

    if (factor%precision%single_factor) then
      position = factor%single%order()
    else
      position = factor%double%order()
    end if
  end function analysed_order

  !> Factorise `k` in the given order of elimination; `schur` gets the Schur complement on the last
  !> variables.
  subroutine factorise(k, position, n_schur, factor, schur, error)
    type(triplets_t), intent(in) :: k         !! one triangle
    integer, intent(in) :: position(:) !! (n) position of every equation, the Schur variables last
    integer, intent(in) :: n_schur            !! size of the Schur complement, may be 0
    type(sparse_factor_t), intent(inout) :: factor
    !! the analysis of this pattern, if there is one; its precision is kept, anything else released
    real(wp), allocatable, intent(out) :: schur(:, :)
    !! (n_schur,n_schur) both triangles, as accurate as the factor [force/length]
    type(error_t), allocatable, intent(out) :: error
    !! not positive definite (exit_not_solved), or no memory
    real(wp), allocatable :: a(:)
    real(sp), allocatable :: single_a(:), single_schur(:, :)
    logical :: goes_on !! where the analysis ended
    integer(i8) :: i

    goes_on = is_analysed(factor, k, n_schur)
    if (goes_on) goes_on = all(analysed_order(factor) == position)
    if (.not. goes_on) then
      call analyse(k, position, n_schur, factor, error)
      if (allocated(error)) return
    end if
    factor%is_factorised = .true.
    if (n_schur == k%n) then ! MUMPS takes no Schur complement of the whole matrix
      allocate (schur(n_schur, n_schur), source=0.0_wp)
      do i = 1, size(k%value, kind=i8)
        schur(k%row(i), k%column(i)) = k%value(i)
        schur(k%column(i), k%row(i)) = k%value(i)
      end do
      return
    end if
    factor%d = scales_of(k)
    if (factor%precision%single_factor) then
      single_a = real(factor%d(k%row)*k%value*factor%d(k%column), sp)
      allocate (single_schur(n_schur, n_schur))
      call factor%single%factorise(single_a, single_schur, error)
      if (allocated(error)) return
      deallocate (single_a)
      factor%entries = factor%single%entries()
      schur = real(single_schur, wp)
    else
      a = factor%d(k%row)*k%value*factor%d(k%column)
      allocate (schur(n_schur, n_schur))
      call factor%double%factorise(a, schur, error)
      if (allocated(error)) return
      factor%entries = factor%double%entries()
    end if
    do i = 1, n_schur
      schur(:, i) = schur(:, i)/(factor%d(k%n - n_schur + 1:)*factor%d(k%n - n_schur + i))
    end do
  end subroutine factorise

  !> How many eigenvalues of a symmetric matrix are negative, by the signs of its pivots.
  subroutine count_negative(k, position, n_negative, error)
    type(triplets_t), intent(in) :: k   !! one triangle, near 1 in size; entries add up
    integer, intent(in) :: position(:)  !! (n) of every equation in the order of elimination
    integer, intent(out) :: n_negative
    type(error_t), allocatable, intent(out) :: error !! singular, or no memory
    type(double_factor_t) :: factor
    real(wp), allocatable :: a(:), schur(:, :)

    n_negative = 0
    call factor%analyse(k, position, 0, precision_controls_t(), error, is_general=.true.)
    if (.not. allocated(error)) then
      a = k%value
      allocate (schur(0, 0))
      call factor%factorise(a, schur, error)
    end if
    if (.not. allocated(error)) n_negative = factor%negative_pivots()
    call factor%release()
  end subroutine count_negative

  !> Solution of A x = b for a matrix of which nothing is known but its entries.
  subroutine solve_unsymmetric(a, b, error)
    type(triplets_t), intent(in) :: a   !! all entries; those of one place add up
    real(wp), contiguous, target, intent(inout) :: b(:, :) !! (n,m) right-hand sides, solutions out
    type(error_t), allocatable, intent(out) :: error
    !! singular (exit_not_solved), or no memory
    type(double_factor_t) :: factor
    real(wp), allocatable :: values(:), schur(:, :)

    if (a%n == 0) return
    call factor%analyse(a, [integer ::], 0, precision_controls_t(), error, is_unsymmetric=.true.)
    if (.not. allocated(error)) then
      values = a%value
      allocate (schur(0, 0))
      call factor%factorise(values, schur, error)
    end if
    if (.not. allocated(error)) call factor%solve(b, error)
    call factor%release()
  end subroutine solve_unsymmetric

  !> Solution of K x = b for matrices without Schur complement, several right-hand sides at once.
  subroutine solve(factor, b, error)
    class(sparse_factor_t), intent(inout) :: factor
    real(wp), contiguous, target, intent(inout) :: b(:, :)
    !! (n,m) right-hand sides in, solutions out
    type(error_t), allocatable, intent(out) :: error
    real(sp), allocatable :: single_b(:, :)

    if (factor%n == 0 .or. size(b, 2) == 0) return
    factor%solutions = factor%solutions + size(b, 2)
    call scale_rows(factor%d, b)
    if (factor%precision%single_factor) then
      factor%size_b = column_sizes(b)
      single_b = to_single(b, factor%size_b)
      call factor%single%solve(single_b, error)
      b = to_double(single_b, factor%size_b)
    else
      call factor%double%solve(b, error)
    end if
    call scale_rows(factor%d, b)
  end subroutine solve

  !> First part of a solution: bring the right-hand sides to the Schur variables.
  !>
  !> Their interior part is kept inside until `expand`, which must be the next call.
  subroutine condense(factor, b, reduced, error)
    class(sparse_factor_t), intent(inout) :: factor
    real(wp), contiguous, target, intent(inout) :: b(:, :) !! (n,m) right-hand sides, overwritten
    real(wp), contiguous, target, intent(inout) :: reduced(:, :)
    !! (n_schur,m) out: condensed right-hand sides
    type(error_t), allocatable, intent(out) :: error
    real(sp), allocatable :: single_b(:, :), single_reduced(:, :)
    integer :: n

    if (size(b, 2) == 0) return
    n = factor%n - factor%n_schur
    if (n == 0) then
      reduced = b
      return
    end if
    if (factor%precision%single_factor) reduced = b(n + 1:, :)
    call scale_rows(factor%d, b)
    if (factor%precision%single_factor) then
      ! Of the Schur variables only what the interior adds passes through single precision.
      factor%size_b = column_sizes(b)
      b(n + 1:, :) = 0.0_wp
      single_b = to_single(b, factor%size_b)
      allocate (single_reduced(factor%n_schur, size(b, 2)))
      call factor%single%condense(single_b, single_reduced, error)
      if (allocated(error)) return
      b(n + 1:, :) = to_double(single_reduced, factor%size_b)
      call scale_rows(1.0_wp/factor%d(n + 1:), b(n + 1:, :))
      reduced = reduced + b(n + 1:, :)
    else
      call factor%double%condense(b, reduced, error)
      call scale_rows(1.0_wp/factor%d(n + 1:), reduced)
    end if
  end subroutine condense

  !> Last part of a solution: from the Schur variables to all.
  subroutine expand(factor, reduced, x, error)
    class(sparse_factor_t), intent(inout) :: factor
    real(wp), contiguous, target, intent(inout) :: reduced(:, :)
    !! (n_schur,m) solutions on the Schur variables
    real(wp), contiguous, target, intent(inout) :: x(:, :)       !! (n,m) out: solutions
    type(error_t), allocatable, intent(out) :: error
    real(sp), allocatable :: single_reduced(:, :), single_x(:, :)
    integer :: n

    if (size(x, 2) == 0) return
    factor%solutions = factor%solutions + size(x, 2)
    n = factor%n - factor%n_schur
    if (n == 0) then
      x = reduced
      return
    end if
    call scale_rows(1.0_wp/factor%d(n + 1:), reduced)
    if (factor%precision%single_factor) then
      single_reduced = to_single(reduced, factor%size_b)
      allocate (single_x(factor%n, size(x, 2)))
      call factor%single%expand(single_reduced, single_x, error)
      if (allocated(error)) return
      x = to_double(single_x, factor%size_b)
    else
      call factor%double%expand(reduced, x, error)
    end if
    call scale_rows(factor%d(n + 1:), reduced)
    call scale_rows(factor%d, x)
    if (factor%precision%single_factor) x(n + 1:, :) = reduced
  end subroutine expand

  !> Solutions on all variables from those on the Schur variables, where no right-hand side acts on
  !> the others. A column that is 0 costs what the others cost and counts as no solution.
  subroutine extend(factor, reduced, x, error)
    class(sparse_factor_t), intent(inout) :: factor
    real(wp), contiguous, target, intent(inout) :: reduced(:, :)
    !! (n_schur,m) solutions on the Schur variables
    real(wp), contiguous, target, intent(inout) :: x(:, :)       !! (n,m) out: solutions
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: at_schur(:, :)
    real(sp), allocatable :: single_x(:, :), single_at_schur(:, :)

    if (factor%n > factor%n_schur .and. size(x, 2) > 0) then
      at_schur = reduced
      if (factor%precision%single_factor) then
        call scale_rows(1.0_wp/factor%d(factor%n - factor%n_schur + 1:), at_schur)
        factor%size_b = column_sizes(at_schur)
        allocate (single_x(factor%n, size(x, 2)), single_at_schur(factor%n_schur, size(x, 2)))
        call factor%single%condense_nothing(single_x, single_at_schur, error)
      else
        call factor%double%condense_nothing(x, at_schur, error)
      end if
      if (allocated(error)) return
    end if
    call factor%expand(reduced, x, error)
    factor%solutions = factor%solutions - count(all(abs(reduced) <= 0.0_wp, dim=1))
  end subroutine extend

  !> Multiply each row by a factor of its own.
  pure subroutine scale_rows(factors, b)
    real(wp), intent(in) :: factors(:)   !! (n)
    real(wp), intent(inout) :: b(:, :)   !! (n,m)
    integer :: j

    do j = 1, size(b, 2)
      b(:, j) = factors*b(:, j)
    end do
  end subroutine scale_rows

  !> A power of two near the largest entry of each column; 1 where there is none but 0.
  pure function column_sizes(b) result(sizes)
    real(wp), intent(in) :: b(:, :)   !! (n,m)
    real(wp) :: sizes(size(b, 2))
    integer :: j

    do j = 1, size(b, 2)
      sizes(j) = maxval(abs(b(:, j)))
      if (sizes(j) > 0.0_wp) sizes(j) = scale(1.0_wp, exponent(sizes(j)))
      if (sizes(j) <= 0.0_wp) sizes(j) = 1.0_wp
    end do
  end function column_sizes

  !> Columns over their sizes, rounded.
  pure function to_single(b, sizes) result(single)
    real(wp), intent(in) :: b(:, :), sizes(:)  !! (n,m), (m)
    real(sp) :: single(size(b, 1), size(b, 2))
    integer :: j

    do j = 1, size(b, 2)
      single(:, j) = real(b(:, j)/sizes(j), sp)
    end do
  end function to_single

  !> Columns times their sizes.
  pure function to_double(single, sizes) result(b)
    real(sp), intent(in) :: single(:, :)   !! (n,m)
    real(wp), intent(in) :: sizes(:)       !! (m)
    real(wp) :: b(size(single, 1), size(single, 2))
    integer :: j

    do j = 1, size(single, 2)
      b(:, j) = real(single(:, j), wp)*sizes(j)
    end do
  end function to_double

  !> Give MUMPS's memory back.
  subroutine release(factor)
    type(sparse_factor_t), intent(inout) :: factor

    factor%is_factorised = .false.
    factor%entries = 0
    factor%predicted = analysis_t()
    call factor%double%release()
    call factor%single%release()
  end subroutine release

end module sparse_factor_mod
