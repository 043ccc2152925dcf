!> Values at the rows of a rank's nodes in PETSc's hands, and behind them those at the rows of other
!> ranks that its own reach (ghosts).
module petsc_values_mod
  use, intrinsic :: iso_c_binding, only: c_associated, c_f_pointer, c_int, c_loc, c_null_ptr, c_ptr
  use kinds_mod, only: wp
  use errors_mod, only: error_t
  use petsc_calls_mod, only: backwards, forwards, insert_values, petsc_find, scatter_begin, &
    scatter_create, scatter_destroy, scatter_end, vec_create, vec_create_ghosted, vec_destroy, &
    vec_get_array, vec_ghost_begin, vec_ghost_end, vec_restore_array
  use petsc_session_mod, only: note
  implicit none
  private

  public :: layout_t, values_t, make_values, fetch_ghosts, touch, release_values, row_of
  public :: whole_t, make_whole, spread_whole, collect_whole, release_whole

  !> Which rank has which rows.
  type :: layout_t
    logical :: is_shared = .false.      !! by several ranks
    integer :: n_rows = 0               !! of all ranks, three unknowns each
    integer :: before = 0               !! of those of the ranks before this one
    integer :: n_own = 0                !! of this one
    integer, allocatable :: ghost(:)    !! row of each ghost
  end type layout_t

  !> One vector.
  type :: values_t
    real(wp), pointer :: at(:, :) => null() !! (3,n_own+n_ghosts)
    type(c_ptr) :: vector = c_null_ptr      !! of the rank's own
    logical :: has_ghosts = .false.         !! on some rank
  end type values_t

  !> All numbers of such vectors on the host.
  type :: whole_t
    type(c_ptr) :: vector = c_null_ptr, scatter = c_null_ptr
  end type whole_t

contains

  !> Which of all rows one here is.
  pure integer function row_of(layout, i)
    type(layout_t), intent(in) :: layout
    integer, intent(in) :: i !! among the rank's own, or its ghosts behind them

    if (i <= layout%n_own) then
      row_of = layout%before + i
    else
      row_of = layout%ghost(i - layout%n_own)
    end if
  end function row_of

  !> A vector of zeros.
  subroutine make_values(ranks, layout, values, failure)
    type(c_ptr), intent(in) :: ranks
    type(layout_t), intent(in) :: layout
    type(values_t), intent(inout) :: values
    type(error_t), allocatable, intent(inout) :: failure
    integer(c_int) :: n

    n = 3*int(layout%n_own, c_int)
    allocate (values%at(3, layout%n_own + size(layout%ghost)), source=0.0_wp)
    values%has_ghosts = layout%is_shared
    if (layout%is_shared) then
      call note(failure, vec_create_ghosted(ranks, 3_c_int, n, petsc_find, size(layout%ghost, &
        kind=c_int), int(layout%ghost - 1, c_int), c_loc(values%at), values%vector))
    else
      call note(failure, vec_create(ranks, 3_c_int, n, c_loc(values%at), values%vector))
    end if
  end subroutine make_values

  !> The ghosts as the ranks have them whose own they are: all ranks must call it.
  subroutine fetch_ghosts(values, failure)
    type(values_t), intent(in) :: values
    type(error_t), allocatable, intent(inout) :: failure

    if (.not. values%has_ghosts) return
    call note(failure, vec_ghost_begin(values%vector, insert_values, forwards))
    call note(failure, vec_ghost_end(values%vector, insert_values, forwards))
  end subroutine fetch_ghosts

  !> Tell PETSc that the numbers are others now.
  subroutine touch(values, failure)
    type(values_t), intent(in) :: values
    type(error_t), allocatable, intent(inout) :: failure
    type(c_ptr) :: array

    call note(failure, vec_get_array(values%vector, array))
    call note(failure, vec_restore_array(values%vector, array))
  end subroutine touch

  !> Give a vector back.
  subroutine release_values(values)
    type(values_t), intent(inout) :: values
    integer(c_int) :: status

    if (c_associated(values%vector)) status = vec_destroy(values%vector)
    if (associated(values%at)) deallocate (values%at)
  end subroutine release_values

  !> A way between the ranks and the host.
  subroutine make_whole(values, whole, failure)
    type(values_t), intent(in) :: values !! such as they will be
    type(whole_t), intent(inout) :: whole
    type(error_t), allocatable, intent(inout) :: failure

    call note(failure, scatter_create(values%vector, whole%scatter, whole%vector))
  end subroutine make_whole

  !> From the host to the ranks; the host gives all rows.
  subroutine spread_whole(whole, values, failure, rows)
    type(whole_t), intent(in) :: whole
    type(values_t), intent(in) :: values
    type(error_t), allocatable, intent(inout) :: failure
    real(wp), contiguous, intent(in), optional :: rows(:, :) !! (3,n_rows) on the host
    real(wp), pointer :: all_rows(:, :)
    type(c_ptr) :: array

    if (present(rows)) then
      call note(failure, vec_get_array(whole%vector, array))
      if (allocated(failure)) return
      call c_f_pointer(array, all_rows, shape(rows))
      all_rows = rows
      call note(failure, vec_restore_array(whole%vector, array))
    end if
    call note(failure, scatter_begin(whole%scatter, whole%vector, values%vector, insert_values, &
      backwards))
    call note(failure, scatter_end(whole%scatter, whole%vector, values%vector, insert_values, &
      backwards))
  end subroutine spread_whole

  !> From the ranks to the host, which gets all rows.
  subroutine collect_whole(whole, values, failure, rows)
    type(whole_t), intent(in) :: whole
    type(values_t), intent(in) :: values
    type(error_t), allocatable, intent(inout) :: failure
    real(wp), contiguous, intent(out), optional :: rows(:, :) !! (3,n_rows) on the host
    real(wp), pointer :: all_rows(:, :)
    type(c_ptr) :: array

    call touch(values, failure)
    call note(failure, scatter_begin(whole%scatter, values%vector, whole%vector, insert_values, &
      forwards))
    call note(failure, scatter_end(whole%scatter, values%vector, whole%vector, insert_values, &
      forwards))
    if (.not. present(rows)) return
    call note(failure, vec_get_array(whole%vector, array))
    if (allocated(failure)) return
    call c_f_pointer(array, all_rows, shape(rows))
    rows = all_rows
    call note(failure, vec_restore_array(whole%vector, array))
  end subroutine collect_whole

  !> Give the way back.
  subroutine release_whole(whole)
    type(whole_t), intent(inout) :: whole
    integer(c_int) :: status

    if (c_associated(whole%scatter)) status = scatter_destroy(whole%scatter)
    if (c_associated(whole%vector)) status = vec_destroy(whole%vector)
  end subroutine release_whole

end module petsc_values_mod
