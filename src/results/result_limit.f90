!> Room for an increment more under a limit on files (ulimit -f).
module result_limit_mod
  use kinds_mod, only: wp, i8
  use errors_mod, only: error_t, raise, exit_machine
  use text_mod, only: to_text
  use resource_limits_mod, only: file_limit, no_limit
  use scene_mod, only: scene_t, elements_with_modes
  use state_mod, only: bytes_to_continue
  use plan_mod, only: plan_t
  use output_field_mod, only: field_t, block_bytes, at_start
  use pair_fields_mod, only: list_pair_fields
  use view_fields_mod, only: list_view_fields
  use gauss_fields_mod, only: list_gauss_fields
  use reference_fields_mod, only: list_reference_fields
  use spring_fields_mod, only: list_spring_fields
  use print_fields_mod, only: list_print_fields
  implicit none
  private

  public :: check_limit

  integer(i8), parameter :: empty_file = 2000000_i8 !! bytes before the first increment, about

contains

  !> Refuse to begin an increment that may not fit under a limit on files (ulimit -f).
  !>
  !> Where a write fails there HDF5 goes on to write where the file would have ended, and nobody
  !> could open it any more; on a full disk it ends there all the same, with a hole.
  subroutine check_limit(path, scene, plan, error)
    character(*), intent(in) :: path !! of the file, which need not be there yet
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    type(error_t), allocatable, intent(out) :: error !! it may not fit
    integer(i8), parameter :: megabyte = 1000000_i8
    integer(i8) :: limit, written, needed

    limit = file_limit()
    if (limit == no_limit) return
    inquire (file=path, size=written)
    needed = max(written, empty_file) + most_of_increment(scene, plan)
    if (needed <= limit) return
    call raise(error, exit_machine, "cannot write '"//path// &
      "': the limit on files (ulimit -f) is "// &
      to_text(real(limit, wp)/megabyte, 3)//' MB, and with an increment more it may take '// &
      to_text(real(needed, wp)/megabyte, 3)//' MB')
  end subroutine check_limit

  !> What an increment and its state take in the file, nothing squeezed [bytes].
  integer(i8) function most_of_increment(scene, plan) result(bytes)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    integer(i8), parameter :: tables = 1000000_i8 !! a chunk of 4 KB of every history, and so on
    type(field_t), allocatable :: fields(:)
    integer :: i

    call list_view_fields(scene, plan%points%n > 0, fields)
    bytes = tables + bytes_to_continue(scene%mesh%n_nodes, plan%points%n, &
      elements_with_modes(scene), any(scene%steps%is_dynamic)) + growing_bytes(fields)
    call list_gauss_fields(scene, fields)
    bytes = bytes + growing_bytes(fields)
    call list_reference_fields(scene, fields)
    bytes = bytes + growing_bytes(fields)
    call list_spring_fields(scene, fields)
    bytes = bytes + growing_bytes(fields)
    if (allocated(scene%output%prints)) then
      do i = 1, size(scene%output%prints)
        call list_print_fields(scene, i, fields)
        bytes = bytes + growing_bytes(fields)
      end do
    end if
    if (plan%points%n == 0) return
    do i = 1, size(scene%pairs)
      call list_pair_fields(scene, i, plan%points%first(i + 1) - plan%points%first(i), fields)
      bytes = bytes + growing_bytes(fields)
    end do
  end function most_of_increment

  !> What an increment adds to these fields at most [bytes].
  pure integer(i8) function growing_bytes(fields)
    type(field_t), intent(in) :: fields(:)
    integer :: i

    growing_bytes = 0
    do i = 1, size(fields)
      if (fields(i)%written /= at_start) growing_bytes = growing_bytes + &
        int(block_bytes(fields(i)), i8)
    end do
  end function growing_bytes

end module result_limit_mod
