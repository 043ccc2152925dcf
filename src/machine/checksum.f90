!> Checksums of bytes: zlib's CRC-32, the one of gzip, PNG and Ethernet.
module checksum_mod
  use, intrinsic :: iso_c_binding, only: c_char, c_loc, c_long, c_ptr, c_size_t
  use kinds_mod, only: i8
  implicit none
  private

  public :: checksum_of, extended

  !> A checksum, extended by what follows: `extended(checksum, value)`.
  interface extended
    module procedure extended_by_bytes, extended_by_text, extended_by_numbers
  end interface extended

  interface
    !> The CRC of what `crc` is of, followed by `length` bytes.
    function zlib_crc32(crc, bytes, length) result(longer) bind(c, name='crc32_z')
      import :: c_long, c_ptr, c_size_t
      implicit none
      integer(c_long), value :: crc
      type(c_ptr), value :: bytes
      integer(c_size_t), value :: length
      integer(c_long) :: longer
    end function zlib_crc32
  end interface

contains

  !> The checksum of a text, 0 to 2**32 - 1; that of nothing is 0.
  integer(i8) function checksum_of(text) result(checksum)
    character(*), intent(in) :: text

    checksum = extended(0_i8, text)
  end function checksum_of

  integer(i8) function extended_by_bytes(checksum, address, length) result(longer)
    integer(i8), intent(in) :: checksum
    type(c_ptr), intent(in) :: address
    integer(i8), intent(in) :: length !! [bytes]

    longer = checksum
    ! Of no bytes at all zlib would begin anew.
    if (length > 0) longer = int(zlib_crc32(int(checksum, c_long), address, &
      int(length, c_size_t)), i8)
  end function extended_by_bytes

  integer(i8) function extended_by_text(checksum, text) result(longer)
    integer(i8), intent(in) :: checksum
    character(*), intent(in) :: text
    character(c_char), target :: bytes(len(text))

    bytes = transfer(text, bytes, len(text))
    longer = extended_by_bytes(checksum, c_loc(bytes), len(text, i8))
  end function extended_by_text

  integer(i8) function extended_by_numbers(checksum, numbers) result(longer)
    integer(i8), intent(in) :: checksum
    integer(i8), intent(in), target, contiguous :: numbers(:)

    longer = extended_by_bytes(checksum, c_loc(numbers), 8*size(numbers, kind=i8))
  end function extended_by_numbers

end module checksum_mod
