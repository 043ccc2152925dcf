!> What files that the program writes are called, and what they must not take the place of.
module output_names_mod
  use errors_mod, only: error_t, raise, exit_wrong_input
  use text_mod, only: string_t, upper
  implicit none
  private

  public :: output_name, keep_inputs

contains

  !> The path that -o means: a name without an ending gets one, unless something has that name
  !> already: a folder or a device, which is refused later, or an older result.
  !>
  !> An ending is a point and what follows it, beginning with a letter: `run.h5` has one, `mu0.3`
  !> and `../run` have none.
  function output_name(given, usual, ending) result(path)
    character(*), intent(in) :: given  !! as the user wrote it; empty: not at all
    character(*), intent(in) :: usual  !! name in the working directory, with its ending
    character(*), intent(in) :: ending !! as '.vtkhdf'
    character(:), allocatable :: path
    integer :: slash, point
    logical :: is_there, is_folder

    path = usual
    if (given == '') return
    path = given
    inquire (file=path, exist=is_there)
    inquire (file=path//'/.', exist=is_folder)
    slash = index(path, '/', back=.true.)
    if (is_there .or. is_folder .or. slash == len(path)) return
    point = index(path, '.', back=.true.)
    if (point > slash + 1 .and. point < len(path)) then
      if (verify(upper(path(point + 1:point + 1)), 'ABCDEFGHIJKLMNOPQRSTUVWXYZ') == 0) return
    end if
    path = path//ending
  end function output_name

  !> Refuse to write where a file stands that is read, under whatever name, be it a link.
  subroutine keep_inputs(inputs, outputs, error)
    type(string_t), intent(in) :: inputs(:)  !! paths of files that are there
    type(string_t), intent(in) :: outputs(:) !! paths of files that may be there
    type(error_t), allocatable, intent(out) :: error
    integer :: unit, status, i, k
    logical :: is_input

    do i = 1, size(inputs)
      ! The run-time library knows a file that it has open by its device and number.
      open (newunit=unit, file=inputs(i)%text, status='old', action='read', iostat=status)
      if (status /= 0) cycle
      do k = 1, size(outputs)
        inquire (file=outputs(k)%text, opened=is_input)
        if (.not. is_input .or. allocated(error)) cycle
        call raise(error, exit_wrong_input, "bipot: error: '"//outputs(k)%text// &
          "' would be written, and is '"//inputs(i)%text//"', which is read")
      end do
      close (unit)
      if (allocated(error)) return
    end do
  end subroutine keep_inputs

end module output_names_mod
