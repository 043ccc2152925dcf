!> What is held, as the coarser levels of PETSc's multigrid see it.
!>
!> Their matrices are P^T A P of the one above. Where A changes by D they change by P^T D P, level by
!> level, and D has entries at the nodes that are held and beside them alone: what takes long where
!> the levels are made is soon done here. It is what they were made as that is changed each time, so
!> nothing depends on what was held before.
module petsc_levels_mod
  use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_int, c_loc, c_null_ptr, c_ptr
  use kinds_mod, only: wp
  use errors_mod, only: error_t
  use sorting_mod, only: order_of
  use block_rows_mod, only: block_rows_t, find_block
  use held_rows_mod, only: held_rows_t
  use petsc_calls_mod, only: copy_values, ksp_get_operators, mat_axpy, mat_copy, mat_create, &
    mat_create_distributed, mat_destroy, mat_duplicate, mat_ptap, new_matrix, pc_interpolation, &
    pc_levels, pc_smoother, petsc_default, petsc_find, same_pattern, subset_pattern
  use petsc_session_mod, only: note
  use petsc_values_mod, only: layout_t, row_of
  implicit none
  private

  public :: levels_t, change_levels, release_levels

  !> The matrices of the levels as they were made, the coarsest first.
  type :: levels_t
    type(c_ptr), allocatable :: made(:)
  end type levels_t

  !> A rank's rows of a matrix that has few entries, as PETSc takes them.
  type :: few_entries_t
    integer(c_int), allocatable :: first(:), column(:) !! (3n+1) and columns, from 0
    real(wp), allocatable :: value(:)                  !! [force/length]
  end type few_entries_t

contains

  !> The levels of what the matrix is now: all ranks must call it.
  subroutine change_levels(ranks, layout, rows, held, inverse, levels, failure)
    type(c_ptr), intent(in) :: ranks
    type(layout_t), intent(in) :: layout
    type(block_rows_t), intent(in) :: rows  !! the matrix
    type(held_rows_t), intent(in) :: held   !! what it was where the levels were made
    type(c_ptr), intent(in) :: inverse      !! PETSc's preconditioner
    type(levels_t), intent(inout) :: levels
    type(error_t), allocatable, intent(inout) :: failure
    type(few_entries_t), target :: few
    type(c_ptr) :: change, coarser, solver, matrix, same, interpolation
    integer(c_int) :: n, level, n_rows

    if (allocated(failure)) return
    call list_changes(layout, rows, held, few)
    n_rows = 3*int(layout%n_own, c_int)
    if (layout%is_shared) then
      call note(failure, mat_create_distributed(ranks, n_rows, n_rows, petsc_find, petsc_find, &
        c_loc(few%first), c_loc(few%column), c_loc(few%value), change))
    else
      call note(failure, mat_create(ranks, n_rows, n_rows, c_loc(few%first), c_loc(few%column), &
        c_loc(few%value), change))
    end if
    call note(failure, pc_levels(inverse, n))
    if (allocated(failure)) return
    if (.not. allocated(levels%made)) then
      allocate (levels%made(0:n - 1))
      do level = 0, n - 1_c_int
        levels%made(level) = c_null_ptr
      end do
    end if
    ! One level is the matrix itself; of more the finest is the smoother's.
    do level = max(0_c_int, n - 2_c_int), 0, -1
      if (n > 1) then
        call note(failure, pc_interpolation(inverse, level + 1, interpolation))
        if (allocated(failure)) return
        call note(failure, mat_ptap(change, interpolation, new_matrix, petsc_default, coarser))
        call note(failure, mat_destroy(change))
        if (allocated(failure)) return
        change = coarser
      end if
      call note(failure, pc_smoother(inverse, level, solver))
      if (allocated(failure)) return
      call note(failure, ksp_get_operators(solver, matrix, same))
      if (allocated(failure)) return
      if (.not. c_associated(levels%made(level))) call note(failure, mat_duplicate(matrix, &
        copy_values, levels%made(level)))
      if (allocated(failure)) return
      call note(failure, mat_copy(levels%made(level), matrix, same_pattern))
      call note(failure, mat_axpy(matrix, 1.0_c_double, change, subset_pattern))
    end do
    call note(failure, mat_destroy(change))
  end subroutine change_levels

  !> What is other than it was: the rows of what is held, and their columns.
  subroutine list_changes(layout, rows, held, few)
    type(layout_t), intent(in) :: layout
    type(block_rows_t), intent(in) :: rows
    type(held_rows_t), intent(in) :: held
    type(few_entries_t), intent(out) :: few
    logical, allocatable :: is_held(:)
    integer, allocatable :: row(:), column(:), order(:), n_before(:)
    real(wp), allocatable :: block(:, :, :)
    integer :: i, k, n, m, pass, a, at, of_row

    allocate (is_held(size(rows%own, 3)), source=.false.)
    is_held(held%row) = .true.
    do pass = 1, 2
      n = 0
      do m = 1, size(held%row)
        i = held%row(m)
        do k = held%start(m), held%start(m + 1) - 1
          associate (other => held%other(k))
            if (i <= layout%n_own) call add(i, other, now(i, other) - held%block(:, :, k))
            ! A row that is not held itself has no list of its own.
            if (other <= layout%n_own .and. .not. is_held(other)) call add(other, i, &
              transpose(now(i, other) - held%block(:, :, k)))
          end associate
        end do
      end do
      if (pass == 1) allocate (row(n), column(n), block(3, 3, n))
    end do
    ! By rows, in these by columns.
    call order_of(column, order)
    block
      integer, allocatable :: by_row(:)

      call order_of(row(order), by_row)
      order = order(by_row)
    end block
    allocate (n_before(layout%n_own + 1), source=0)
    do k = 1, n
      n_before(row(k) + 1) = n_before(row(k) + 1) + 1
    end do
    do i = 1, layout%n_own
      n_before(i + 1) = n_before(i) + n_before(i + 1)
    end do
    allocate (few%first(3*layout%n_own + 1), few%column(9*n), few%value(9*n))
    few%first = 9*n
    do i = 1, layout%n_own
      of_row = 3*(n_before(i + 1) - n_before(i))
      do a = 1, 3
        few%first(3*(i - 1) + a) = 9*n_before(i) + (a - 1)*of_row
        do k = n_before(i) + 1, n_before(i + 1)
          at = few%first(3*(i - 1) + a) + 3*(k - n_before(i) - 1)
          few%column(at + 1:at + 3) = 3*(column(order(k)) - 1) + [0, 1, 2]
          few%value(at + 1:at + 3) = block(a, :, order(k))
        end do
      end do
    end do

  contains

    subroutine add(i, j, change)
      integer, intent(in) :: i, j
      real(wp), intent(in) :: change(3, 3)

      n = n + 1
      if (pass == 1) return
      row(n) = i
      column(n) = row_of(layout, j)
      block(:, :, n) = change
    end subroutine add

    pure function now(i, j)
      integer, intent(in) :: i, j
      real(wp) :: now(3, 3)

      if (i == j) then
        now = rows%own(:, :, i)
      else if (j < i) then
        now = rows%block(:, :, find_block(rows, i, j))
      else
        now = transpose(rows%block(:, :, find_block(rows, j, i)))
      end if
    end function now

  end subroutine list_changes

  !> Give the levels as they were made back.
  subroutine release_levels(levels)
    type(levels_t), intent(inout) :: levels
    integer(c_int) :: status
    integer :: i

    if (.not. allocated(levels%made)) return
    do i = lbound(levels%made, 1), ubound(levels%made, 1)
      if (c_associated(levels%made(i))) status = mat_destroy(levels%made(i))
    end do
    deallocate (levels%made)
  end subroutine release_levels

end module petsc_levels_mod
