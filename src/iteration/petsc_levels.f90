!> What is held, as the coarser levels of PETSc's multigrid see it.
!>
!> Their matrices are P^T A P of the one above. Where A changes by D they change by P^T D P, level
!> by level, and D has entries at the nodes that are held and beside them alone: what takes long
!> where the levels are made is soon done here. It is what they were made as that is changed each
!> time, so nothing depends on what was held before. Where springs join what K does not, the levels
!> have entries that they were not made with.
module petsc_levels_mod
  use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_funloc, c_int, c_loc, &
    c_null_ptr, c_ptr
  use kinds_mod, only: wp
  use errors_mod, only: error_t
  use sorting_mod, only: order_of
  use block_rows_mod, only: block_rows_t, find_block
  use held_rows_mod, only: held_rows_t
  use petsc_calls_mod, only: copy_values, different_pattern, final_assembly, ksp_get_operators, &
    ksp_set_operators, mat_assembly_begin, mat_assembly_end, mat_axpy, mat_copy, mat_create, &
    mat_create_distributed, mat_destroy, mat_duplicate, mat_ptap, mat_update, new_matrix, &
    no_values, pc_interpolation, pc_levels, pc_mg_residual, pc_mg_set_residual, pc_smoother, &
    petsc_default, petsc_find, petsc_reference, same_matrix, same_pattern, subset_pattern
  use petsc_session_mod, only: note
  use petsc_values_mod, only: layout_t, row_of
  implicit none
  private

  public :: levels_t, change_levels, forget_change, release_levels

  !> A rank's rows of a matrix that has few entries, as PETSc borrows or copies them.
  type :: few_entries_t
    integer(c_int), allocatable :: first(:), column(:) !! (3n+1) and columns, from 0
    real(wp), allocatable :: value(:)                  !! [force/length]
    integer, allocatable :: offset(:) !! of each block in its rows, in the order of `visit_changes`
  end type few_entries_t

  !> The levels, the coarsest first.
  type :: levels_t
    type(c_ptr), allocatable :: made(:)   !! their matrices as they were made
    type(c_ptr), allocatable :: wider(:)
    !! the same with zeros where changes have entries that these have not; null where there are none
    type(c_ptr), allocatable :: now(:)    !! as they are changed
    type(c_ptr), allocatable :: change(:) !! what they change by; one more, for the finest
    type(few_entries_t), pointer :: few => null() !! the entries of that
  end type levels_t

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
    type(c_ptr) :: solver, interpolation
    integer(c_int) :: n, level
    logical :: is_new

    call note(failure, pc_levels(inverse, n))
    if (allocated(failure)) return
    if (.not. allocated(levels%made)) call begin_levels(n, levels)
    is_new = .not. associated(levels%few)
    if (is_new) then
      allocate (levels%few)
      call list_changes(layout, rows, held, levels%few)
    end if
    call fill_changes(layout, rows, held, levels%few)
    call make_change(ranks, layout, is_new, levels%few, levels%change(n), failure)
    ! One level is the matrix itself; of more the finest is the smoother's.
    if (n == 1) levels%change(0) = levels%change(1)
    do level = max(0_c_int, n - 2_c_int), 0, -1
      if (n > 1) then
        call note(failure, pc_interpolation(inverse, level + 1, interpolation))
        if (allocated(failure)) return
        associate (of_finer => levels%change(merge(n, level + 1, level == n - 2)))
          call note(failure, mat_ptap(of_finer, interpolation, merge(new_matrix, same_matrix, &
            is_new), petsc_default, levels%change(level)))
        end associate
      end if
      call note(failure, pc_smoother(inverse, level, solver))
      if (allocated(failure)) return
      if (is_new) call begin_level(inverse, solver, level, held%springs%n > 0, levels, failure)
      if (allocated(failure)) return
      associate (made => levels%made(level), wider => levels%wider(level), now => levels%now(level))
        if (c_associated(wider)) then
          call note(failure, mat_copy(wider, now, same_pattern))
        else
          call note(failure, mat_copy(made, now, same_pattern))
        end if
        call note(failure, mat_axpy(now, 1.0_c_double, levels%change(level), subset_pattern))
        ! So that the smoother finds its bounds anew.
        call note(failure, ksp_set_operators(solver, now, now))
      end associate
    end do
    if (n == 1) levels%change(0) = c_null_ptr
  end subroutine change_levels

  !> A matrix of a level for what is changed from now on.
  subroutine begin_level(inverse, solver, level, is_joined, levels, failure)
    type(c_ptr), intent(in) :: inverse, solver
    integer(c_int), intent(in) :: level
    logical, intent(in) :: is_joined !! by springs
    type(levels_t), intent(inout) :: levels
    type(error_t), allocatable, intent(inout) :: failure
    type(c_ptr) :: same, zeros

    associate (made => levels%made(level), wider => levels%wider(level), now => levels%now(level))
      if (.not. c_associated(made)) then
        call note(failure, ksp_get_operators(solver, made, same))
        call note(failure, petsc_reference(made))
      end if
      if (is_joined) then
        call note(failure, mat_duplicate(levels%change(level), no_values, zeros))
        call note(failure, mat_duplicate(made, copy_values, wider))
        if (allocated(failure)) return
        call note(failure, mat_axpy(wider, 1.0_c_double, zeros, different_pattern))
        call note(failure, mat_destroy(zeros))
        call note(failure, mat_duplicate(wider, copy_values, now))
      else
        call note(failure, mat_duplicate(made, copy_values, now))
      end if
      if (allocated(failure)) return
      if (level > 0) call note(failure, pc_mg_set_residual(inverse, level, &
        c_funloc(pc_mg_residual), now))
    end associate
  end subroutine begin_level

  !> Nothing is known of n levels yet.
  subroutine begin_levels(n, levels)
    integer(c_int), intent(in) :: n
    type(levels_t), intent(inout) :: levels
    integer :: i

    allocate (levels%made(0:n), levels%wider(0:n), levels%now(0:n), levels%change(0:n))
    do i = 0, n
      levels%made(i) = c_null_ptr
      levels%wider(i) = c_null_ptr
      levels%now(i) = c_null_ptr
      levels%change(i) = c_null_ptr
    end do
  end subroutine begin_levels

  !> What the matrix changes by, in PETSc's hands.
  subroutine make_change(ranks, layout, is_new, few, change, failure)
    type(c_ptr), intent(in) :: ranks
    type(layout_t), intent(in) :: layout
    logical, intent(in) :: is_new !! else its values are others
    type(few_entries_t), target, intent(in) :: few
    type(c_ptr), intent(inout) :: change
    type(error_t), allocatable, intent(inout) :: failure
    integer(c_int) :: n_rows

    n_rows = 3*int(layout%n_own, c_int)
    if (is_new .and. layout%is_shared) then
      call note(failure, mat_create_distributed(ranks, n_rows, n_rows, petsc_find, petsc_find, &
        c_loc(few%first), c_loc(few%column), c_loc(few%value), change))
    else if (is_new) then
      call note(failure, mat_create(ranks, n_rows, n_rows, c_loc(few%first), c_loc(few%column), &
        c_loc(few%value), change))
    else if (layout%is_shared) then
      call note(failure, mat_update(change, c_loc(few%value)))
    else
      call note(failure, mat_assembly_begin(change, final_assembly))
      call note(failure, mat_assembly_end(change, final_assembly))
    end if
  end subroutine make_change

  !> The pattern of what may be other than it was: the rows of the nodes that may be held, and their
  !> columns.
  subroutine list_changes(layout, rows, held, few)
    type(layout_t), intent(in) :: layout
    type(block_rows_t), intent(in) :: rows
    type(held_rows_t), intent(in) :: held
    type(few_entries_t), intent(out) :: few
    integer, allocatable :: order(:), by_row(:), row(:), column(:), at(:), n_blocks(:)
    integer :: i, k, n, a

    call visit_changes(layout, rows, held, row, column)
    n = size(row)
    call order_of(column, order)
    call order_of(row(order), by_row)
    order = order(by_row)
    allocate (n_blocks(layout%n_own), source=0)
    allocate (few%first(3*layout%n_own + 1), few%column(9*n), few%value(9*n), few%offset(n))
    do k = 1, n
      n_blocks(row(order(k))) = n_blocks(row(order(k))) + 1
      few%offset(order(k)) = 3*(n_blocks(row(order(k))) - 1)
    end do
    few%first(1) = 0
    do i = 1, layout%n_own
      do a = 1, 3
        few%first(3*(i - 1) + a + 1) = few%first(3*(i - 1) + a) + 3*n_blocks(i)
      end do
    end do
    do k = 1, n
      do a = 3*row(k) - 2, 3*row(k)
        at = few%first(a) + few%offset(k) + [1, 2, 3]
        few%column(at) = 3*(column(k) - 1) + [0, 1, 2]
      end do
    end do
  end subroutine list_changes

  !> What is other than it was.
  subroutine fill_changes(layout, rows, held, few)
    type(layout_t), intent(in) :: layout
    type(block_rows_t), intent(in) :: rows
    type(held_rows_t), intent(in) :: held
    type(few_entries_t), intent(inout) :: few
    integer, allocatable :: row(:), column(:)
    real(wp), allocatable :: block(:, :, :)
    integer :: k, a, at

    call visit_changes(layout, rows, held, row, column, block)
    do k = 1, size(row)
      do a = 1, 3
        at = few%first(3*(row(k) - 1) + a) + few%offset(k)
        few%value(at + 1:at + 3) = block(a, :, k)
      end do
    end do
  end subroutine fill_changes

  !> The blocks of the rank's own rows that may be other than they were: always in one order.
  subroutine visit_changes(layout, rows, held, row, column, block)
    type(layout_t), intent(in) :: layout
    type(block_rows_t), intent(in) :: rows
    type(held_rows_t), intent(in) :: held
    integer, allocatable, intent(out) :: row(:)    !! (n_blocks) among the rank's own
    integer, allocatable, intent(out) :: column(:) !! of all rows
    real(wp), allocatable, intent(out), optional :: block(:, :, :) !! (3,3,n_blocks) the difference
    logical, allocatable :: is_held(:)
    integer :: i, k, n, m, pass

    allocate (is_held(size(rows%own, 3)), source=.false.)
    is_held(held%row) = .true.
    do pass = 1, 2
      n = 0
      do m = 1, size(held%row)
        i = held%row(m)
        do k = held%start(m), held%start(m + 1) - 1
          associate (other => held%other(k))
            if (i <= layout%n_own) call add(i, other, .false.)
            ! A row that is not held itself has no list of its own.
            if (other <= layout%n_own .and. .not. is_held(other)) call add(other, i, .true.)
          end associate
        end do
      end do
      if (pass == 1) allocate (row(n), column(n))
      if (pass == 1 .and. present(block)) allocate (block(3, 3, n))
    end do

  contains

    subroutine add(of_row, of_column, is_other)
      integer, intent(in) :: of_row, of_column
      logical, intent(in) :: is_other !! the transposed one of the list

      n = n + 1
      if (pass == 1) return
      row(n) = of_row
      column(n) = row_of(layout, of_column)
      if (.not. present(block)) return
      block(:, :, n) = now(i, held%other(k)) - held%block(:, :, k)
      if (is_other) block(:, :, n) = transpose(block(:, :, n))
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

  end subroutine visit_changes

  !> Other nodes may be held from now on.
  subroutine forget_change(levels)
    type(levels_t), intent(inout) :: levels

    if (.not. associated(levels%few)) return
    call destroy(levels%change)
    call destroy(levels%wider)
    call destroy(levels%now)
    deallocate (levels%few)
  end subroutine forget_change

  !> Give it all back.
  subroutine release_levels(levels)
    type(levels_t), intent(inout) :: levels

    if (.not. allocated(levels%made)) return
    call forget_change(levels)
    call destroy(levels%made)
    deallocate (levels%made, levels%wider, levels%now, levels%change)
  end subroutine release_levels

  subroutine destroy(matrices)
    type(c_ptr), intent(inout) :: matrices(:)
    integer(c_int) :: status
    integer :: i

    do i = 1, size(matrices)
      if (c_associated(matrices(i))) status = mat_destroy(matrices(i))
      matrices(i) = c_null_ptr
    end do
  end subroutine destroy

end module petsc_levels_mod
