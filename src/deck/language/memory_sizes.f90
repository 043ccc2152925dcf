!> Sizes of memory as the command line writes them: 4GB, 500MB, 1.5GiB.
module memory_sizes_mod
  use kinds_mod, only: wp
  use numbers_mod, only: number_ok, read_real
  use text_mod, only: upper
  implicit none
  private

  public :: take_size

  character(*), parameter :: units(9) = [character(3) :: 'B', 'KB', 'MB', 'GB', 'TB', 'KIB', &
    'MIB', 'GIB', 'TIB']
  real(wp), parameter :: bytes_of(9) = [1.0_wp, 1.0e3_wp, 1.0e6_wp, 1.0e9_wp, 1.0e12_wp, &
    1024.0_wp, 1024.0_wp**2, 1024.0_wp**3, 1024.0_wp**4]
  real(wp), parameter :: least = 1.0e6_wp, most = 1.0e15_wp !! that mean anything [bytes]

contains

  !> Take a size with its unit, capital or not, a blank between them or none.
  pure subroutine take_size(text, bytes, wanted)
    character(*), intent(in) :: text
    real(wp), intent(inout) :: bytes !! unchanged where there is no such size
    character(:), allocatable, intent(out) :: wanted
    !! allocated where there is none: what there should be, in words
    character(:), allocatable :: unit
    real(wp) :: number
    integer :: status, first, found

    wanted = 'a size with its unit from 1MB to 1000TB, as 4GB, 500MB or 1.5GiB'
    first = scan(text, '0123456789.', back=.true.) + 1
    if (first < 2) return
    unit = upper(trim(adjustl(text(first:))))
    if (unit == '') return
    found = findloc(units == unit, .true., dim=1)
    if (found == 0) return
    call read_real(text(:first - 1), number, status)
    if (status /= number_ok .or. .not. number > 0.0_wp) return
    if (number*bytes_of(found) < least .or. number*bytes_of(found) > most) return
    bytes = number*bytes_of(found)
    deallocate (wanted)
  end subroutine take_size

end module memory_sizes_mod
