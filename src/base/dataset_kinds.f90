!> What the numbers of a dataset in a file are.
module dataset_kinds_mod
  implicit none
  private

  public :: of_real, of_integer, of_long, of_byte, of_unsigned_byte, bytes_of

  integer, parameter :: of_real = 1          !! float64
  integer, parameter :: of_integer = 2       !! int32
  integer, parameter :: of_long = 3          !! int64
  integer, parameter :: of_byte = 4          !! int8
  integer, parameter :: of_unsigned_byte = 5 !! uint8
  integer, parameter :: bytes_of(5) = [8, 4, 8, 1, 1]

end module dataset_kinds_mod
