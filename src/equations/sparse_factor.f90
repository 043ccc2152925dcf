!> Factorisation of a symmetric positive definite sparse matrix, with the Schur complement on its
!> last variables.
!>
!> The only file that sees MUMPS (sequential library). With a Schur complement a solution goes in
!> three parts: `condense` (right-hand side to the last variables), the caller's dense solution
!> there, `expand`.
!>
!> `analyse` looks at the pattern alone and foretells what the factorisation will need; `factorise`
!> of a matrix with that pattern then begins where it ended.
!>
!> MUMPS gets the matrix with a diagonal near 1, D K D with powers of two in D, which round nothing:
!> it has absolute thresholds, and below pivots of about 1e-16 its solutions are wrong without a
!> word.
module sparse_factor_mod
  use kinds_mod, only: wp, i8
  use errors_mod, only: error_t, raise, exit_not_solved, exit_machine
  use text_mod, only: to_text
  use assembly_mod, only: triplets_t
  implicit none
  private

  public :: sparse_factor_t, analysis_t, analyse, factorise

  include 'dmumps_struc.h'

  interface
    subroutine dmumps(id)
      import :: dmumps_struc
      implicit none
      type(dmumps_struc), intent(inout) :: id
    end subroutine dmumps
  end interface

  ! MUMPS's JOB and the parts of ICNTL used here, by the names of its manual.
  integer, parameter :: job_init = -1, job_end = -2, job_analyse = 1, job_factorise = 2, &
    job_solve = 3
  integer, parameter :: spd = 1
  integer, parameter :: icntl_error_stream = 1, icntl_warning_stream = 2, icntl_info_stream = 3, &
                        icntl_print_level = 4, icntl_ordering = 7, &
                        icntl_workspace_percent = 14, icntl_schur = 19, icntl_rhs_block = 27, &
                        icntl_reduced = 26
  integer, parameter :: ordering_given = 1, schur_full_by_columns = 3
  integer, parameter :: reduced_condense = 1, reduced_expand = 2
  integer, parameter :: most_workspace_percent = 800

  !> What the pattern of a matrix says of its factorisation, without a number of it.
  type :: analysis_t
    integer(i8) :: entries = 0     !! in the factor, the Schur complement left out
    integer(i8) :: bytes = 0       !! MUMPS's memory while it factorises, the matrix not counted
    real(wp) :: flops = 0.0_wp     !! of the elimination
    integer :: largest_front = 0   !! order of the largest dense matrix on the way
  end type analysis_t

  !> A factorised matrix. Its memory lives in MUMPS and is given back when the object goes.
  type :: sparse_factor_t
    integer :: n = 0        !! equations
    integer :: n_schur = 0  !! of them, the last ones, in the Schur complement
    type(analysis_t) :: foretold   !! by the analysis
    integer(i8) :: entries = 0     !! in the factor; 0 before `factorise`
    integer(i8) :: solutions = 0   !! right-hand sides solved for, over all its matrices
    logical, private :: is_factorised = .false.
    real(wp), allocatable, private :: d(:) !! (n) D, near 1/sqrt(diagonal) [sqrt(length/force)]
    type(dmumps_struc), pointer, private :: id => null()
  contains
    procedure :: solve
    procedure :: condense
    procedure :: expand
    final :: release
  end type sparse_factor_t

contains

  !> Analyse the pattern of `k`, whose values need not be there, for elimination in the given order.
  subroutine analyse(k, place, n_schur, factor, error)
    type(triplets_t), intent(in) :: k         !! one triangle; rows and columns
    integer, intent(in) :: place(:) !! (n) place of every equation, the Schur variables last
    integer, intent(in) :: n_schur            !! size of the Schur complement, may be 0
    type(sparse_factor_t), intent(inout) :: factor !! what it held before is released
    type(error_t), allocatable, intent(out) :: error !! no memory
    ! Static storage begins as zeros: MUMPS looks at parts of its structure before it sets them.
    type(dmumps_struc), save :: blank
    integer :: i

    call release(factor)
    factor%n = k%n
    factor%n_schur = n_schur
    if (n_schur == k%n) return ! nothing to eliminate
    allocate (factor%id, source=blank)
    associate (id => factor%id)
      id%comm = 0 ! any number will do in the sequential library
      id%par = 1
      id%sym = spd
      id%job = job_init
      call dmumps(id)
      id%icntl([icntl_error_stream, icntl_warning_stream, icntl_info_stream, icntl_print_level]) = 0
      id%icntl(icntl_ordering) = ordering_given
      id%n = k%n
      id%nnz = size(k%row, kind=i8)
      allocate (id%irn(id%nnz), id%jcn(id%nnz), id%perm_in(k%n))
      id%irn = k%row
      id%jcn = k%column
      id%perm_in = place
      if (n_schur > 0) then
        id%icntl(icntl_schur) = schur_full_by_columns
        id%size_schur = n_schur
        id%nprow = 1
        id%npcol = 1
        id%mblock = 100
        id%nblock = 100
        allocate (id%listvar_schur(n_schur))
        id%listvar_schur = [(k%n - n_schur + i, i=1, n_schur)]
      end if
      id%job = job_analyse
      call dmumps(id)
      if (id%infog(1) < 0) then
        call explain(id, 'ordering', error)
        return
      end if
      factor%foretold%entries = in_units(id%infog(20))
      factor%foretold%bytes = 1000000_i8*id%infog(16)
      factor%foretold%flops = id%rinfog(1)
      factor%foretold%largest_front = id%infog(5)
    end associate
  end subroutine analyse

  !> A count of MUMPS: negative where it is in millions.
  pure function in_units(count) result(number)
    integer, intent(in) :: count
    integer(i8) :: number

    number = int(count, i8)
    if (count < 0) number = -1000000_i8*count
  end function in_units

  !> Whether `factor` is the analysis of the pattern of `k` in this order, and no more.
  pure function is_analysed(factor, k, place, n_schur)
    type(sparse_factor_t), intent(in) :: factor
    type(triplets_t), intent(in) :: k
    integer, intent(in) :: place(:), n_schur
    logical :: is_analysed

    is_analysed = associated(factor%id) .and. .not. factor%is_factorised .and. &
      factor%n == k%n .and. factor%n_schur == n_schur
    if (is_analysed) is_analysed = factor%id%nnz == size(k%row, kind=i8)
    if (is_analysed) is_analysed = all(factor%id%irn == k%row) .and. &
      all(factor%id%jcn == k%column) .and. all(factor%id%perm_in == place)
  end function is_analysed

  !> Factorise `k` in the given order of elimination; `schur` gets the Schur complement on the last
  !> variables.
  subroutine factorise(k, place, n_schur, factor, schur, error)
    type(triplets_t), intent(in) :: k         !! one triangle
    integer, intent(in) :: place(:) !! (n) place of every equation, the Schur variables last
    integer, intent(in) :: n_schur            !! size of the Schur complement, may be 0
    type(sparse_factor_t), intent(inout) :: factor
    !! the analysis of this pattern, if there is one; anything else it held is released
    real(wp), allocatable, target, intent(out) :: schur(:, :)
    !! (n_schur,n_schur) both triangles [force/length]
    type(error_t), allocatable, intent(out) :: error
    !! not positive definite (exit_not_solved), or no memory
    integer :: i

    allocate (schur(n_schur, n_schur))
    if (.not. is_analysed(factor, k, place, n_schur)) then
      call analyse(k, place, n_schur, factor, error)
      if (allocated(error)) return
    end if
    factor%is_factorised = .true.
    if (n_schur == k%n) then ! MUMPS takes no Schur complement of the whole matrix
      schur = 0.0_wp
      do i = 1, size(k%value)
        schur(k%row(i), k%column(i)) = k%value(i)
        schur(k%column(i), k%row(i)) = k%value(i)
      end do
      return
    end if
    associate (id => factor%id)
      allocate (id%a(id%nnz))
      factor%d = scales_of(k)
      id%a = factor%d(k%row)*k%value*factor%d(k%column)
      if (n_schur > 0) then
        id%schur_lld = n_schur
        id%schur(1:size(schur, kind=i8)) => schur
      end if
      call run_factorisation(id, error)
      if (allocated(error)) return
      factor%entries = in_units(id%infog(20))
      nullify (id%schur)
      do i = 1, n_schur
        schur(:, i) = schur(:, i)/(factor%d(k%n - n_schur + 1:)*factor%d(k%n - n_schur + i))
      end do
      deallocate (id%irn, id%jcn, id%a)
      nullify (id%irn, id%jcn, id%a)
    end associate
  end subroutine factorise

  !> Powers of two near 1/sqrt(diagonal).
  pure function scales_of(k) result(d)
    type(triplets_t), intent(in) :: k
    real(wp) :: d(k%n)
    real(wp) :: diagonal(k%n)
    integer :: i

    diagonal = 0.0_wp
    do i = 1, size(k%value)
      if (k%row(i) == k%column(i)) diagonal(k%row(i)) = diagonal(k%row(i)) + k%value(i)
    end do
    d = 1.0_wp
    where (diagonal > 0.0_wp) d = scale(1.0_wp, -exponent(diagonal)/2)
  end function scales_of

  !> Numerical factorisation; when MUMPS asks for more workspace it gets it.
  subroutine run_factorisation(id, error)
    type(dmumps_struc), intent(inout) :: id
    type(error_t), allocatable, intent(out) :: error
    integer, parameter :: more_workspace(5) = [-8, -9, -14, -15, -19]

    do
      id%job = job_factorise
      call dmumps(id)
      if (id%infog(1) >= 0) exit
      if (all(more_workspace /= id%infog(1)) .or. &
        id%icntl(icntl_workspace_percent) >= most_workspace_percent) then
        call explain(id, 'factorisation', error)
        return
      end if
      id%icntl(icntl_workspace_percent) = 2*max(20, id%icntl(icntl_workspace_percent))
    end do
    ! With SYM = 1 MUMPS factorises an indefinite matrix without an error; it only counts the wrong
    ! pivots.
    if (id%infog(12) > 0) call raise(error, exit_not_solved, &
      'the stiffness matrix is not positive definite ('//to_text(id%infog(12))// &
      ' negative pivots): '// &
      'a body is not held, or the material is at the limit of what double precision holds')
  end subroutine run_factorisation

  !> Solution of K x = b for matrices without Schur complement, several right-hand sides at once.
  subroutine solve(factor, b, error)
    class(sparse_factor_t), intent(inout) :: factor
    real(wp), contiguous, target, intent(inout) :: b(:, :)
    !! (n,m) right-hand sides in, solutions out
    type(error_t), allocatable, intent(out) :: error

    if (factor%n == 0 .or. size(b, 2) == 0) return
    factor%solutions = factor%solutions + size(b, 2)
    call scale_rows(factor%d, b)
    call give_right_hand_sides(factor, b)
    call run_solution(factor, error)
    call scale_rows(factor%d, b)
  end subroutine solve

  !> First part of a solution: bring the right-hand sides to the Schur variables.
  !>
  !> Their interior part is kept inside until `expand`, which must be the next call.
  subroutine condense(factor, b, reduced, error)
    class(sparse_factor_t), intent(inout) :: factor
    real(wp), contiguous, target, intent(inout) :: b(:, :)       !! (n,m) right-hand sides
    real(wp), contiguous, target, intent(inout) :: reduced(:, :)
    !! (n_schur,m) out: condensed right-hand sides
    type(error_t), allocatable, intent(out) :: error

    if (size(b, 2) == 0) return
    if (factor%n_schur == factor%n) then
      reduced = b
      return
    end if
    call scale_rows(factor%d, b)
    call run_part(factor, reduced_condense, b, reduced, error)
    call scale_rows(1.0_wp/factor%d(factor%n - factor%n_schur + 1:), reduced)
  end subroutine condense

  !> Last part of a solution: from the Schur variables to all.
  subroutine expand(factor, reduced, x, error)
    class(sparse_factor_t), intent(inout) :: factor
    real(wp), contiguous, target, intent(inout) :: reduced(:, :)
    !! (n_schur,m) solutions on the Schur variables
    real(wp), contiguous, target, intent(inout) :: x(:, :)       !! (n,m) out: solutions
    type(error_t), allocatable, intent(out) :: error

    if (size(x, 2) == 0) return
    factor%solutions = factor%solutions + size(x, 2)
    if (factor%n_schur == factor%n) then
      x = reduced
      return
    end if
    associate (d => factor%d(factor%n - factor%n_schur + 1:))
      call scale_rows(1.0_wp/d, reduced)
      call run_part(factor, reduced_expand, x, reduced, error)
      call scale_rows(d, reduced)
    end associate
    call scale_rows(factor%d, x)
  end subroutine expand

  !> Multiply each row by a factor of its own.
  pure subroutine scale_rows(factors, b)
    real(wp), intent(in) :: factors(:)   !! (n)
    real(wp), intent(inout) :: b(:, :)   !! (n,m)
    integer :: j

    do j = 1, size(b, 2)
      b(:, j) = factors*b(:, j)
    end do
  end subroutine scale_rows

  !> One of the two parts of a solution by way of the Schur variables.
  subroutine run_part(factor, part, b, reduced, error)
    class(sparse_factor_t), intent(inout) :: factor
    integer, intent(in) :: part !! reduced_condense or reduced_expand
    real(wp), contiguous, target, intent(inout) :: b(:, :)       !! (n,m)
    real(wp), contiguous, target, intent(inout) :: reduced(:, :) !! (n_schur,m)
    type(error_t), allocatable, intent(out) :: error

    call give_right_hand_sides(factor, b)
    factor%id%redrhs(1:size(reduced)) => reduced
    factor%id%lredrhs = factor%n_schur
    factor%id%icntl(icntl_reduced) = part
    call run_solution(factor, error)
    factor%id%icntl(icntl_reduced) = 0
  end subroutine run_part

  subroutine give_right_hand_sides(factor, b)
    class(sparse_factor_t), intent(inout) :: factor
    real(wp), contiguous, target, intent(inout) :: b(:, :)

    ! MUMPS sees matrices as vectors: the same storage under one index, no copy.
    factor%id%rhs(1:size(b)) => b
    factor%id%nrhs = size(b, 2)
    factor%id%lrhs = factor%n
    factor%id%icntl(icntl_rhs_block) = -max(1, min(size(b, 2), 64))
  end subroutine give_right_hand_sides

  subroutine run_solution(factor, error)
    class(sparse_factor_t), intent(inout) :: factor
    type(error_t), allocatable, intent(out) :: error

    factor%id%job = job_solve
    call dmumps(factor%id)
    if (factor%id%infog(1) < 0) call explain(factor%id, 'solution', error)
    nullify (factor%id%rhs, factor%id%redrhs)
  end subroutine run_solution

  !> MUMPS's INFOG(1:2) in words.
  subroutine explain(id, phase, error)
    type(dmumps_struc), intent(in) :: id
    character(*), intent(in) :: phase
    type(error_t), allocatable, intent(out) :: error

    select case (id%infog(1))
    case (-10)
      call raise(error, exit_not_solved, 'the stiffness matrix is singular: a body is not held')
    case (-5, -7, -8, -9, -13, -14, -15, -19, -20, -22)
      call raise(error, exit_machine, 'not enough memory for the '//phase//' of '//to_text(id%n)// &
        ' equations (MUMPS '//to_text(id%infog(1))//', '//to_text(id%infog(2))//')')
    case default
      call raise(error, exit_machine, 'MUMPS failed in the '//phase//' of '//to_text(id%n)// &
        ' equations (INFOG(1:2) = '//to_text(id%infog(1))//', '//to_text(id%infog(2))//')')
    end select
  end subroutine explain

  !> Give MUMPS's memory back.
  subroutine release(factor)
    type(sparse_factor_t), intent(inout) :: factor

    factor%is_factorised = .false.
    factor%entries = 0
    factor%foretold = analysis_t()
    if (.not. associated(factor%id)) return
    if (associated(factor%id%irn)) deallocate (factor%id%irn, factor%id%jcn)
    if (associated(factor%id%a)) deallocate (factor%id%a)
    nullify (factor%id%irn, factor%id%jcn, factor%id%a, factor%id%schur)
    if (associated(factor%id%perm_in)) deallocate (factor%id%perm_in)
    nullify (factor%id%perm_in)
    if (associated(factor%id%listvar_schur)) deallocate (factor%id%listvar_schur)
    nullify (factor%id%listvar_schur)
    factor%id%job = job_end
    call dmumps(factor%id)
    deallocate (factor%id)
  end subroutine release

end module sparse_factor_mod
