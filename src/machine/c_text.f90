!> Texts that libraries written in C hand over.
module c_text_mod
  use, intrinsic :: iso_c_binding, only: c_char, c_f_pointer, c_ptr
  use libc_mod, only: c_strlen
  implicit none
  private

  public :: text_at

contains

  !> The text at an address, up to its null character.
  function text_at(address) result(text)
    type(c_ptr), intent(in) :: address !! not null
    character(:), allocatable :: text
    character(c_char), pointer :: letters(:)
    integer :: i

    call c_f_pointer(address, letters, [c_strlen(address)])
    allocate (character(size(letters)) :: text)
    do i = 1, len(text)
      text(i:i) = letters(i)
    end do
  end function text_at

end module c_text_mod
