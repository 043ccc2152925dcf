!> Memory in huge pages, for large matrices that are read again and again.
!>
!> A processor keeps the addresses of some thousand pages at hand. A matrix beyond the caches, in
!> pages of 4 KB, has more of them, and looking one up takes as long as reading from it: products
!> with such a matrix are up to one and a half times faster from pages of 2 MB. Systems give these
!> to who asks (Linux: /sys/kernel/mm/transparent_hugepage/enabled, `madvise`). All memory in them
!> (GLIBC_TUNABLES=glibc.malloc.hugetlb=1) made runs slower: the system must first clear it, and
!> find it in one piece.
module huge_pages_mod
  use, intrinsic :: iso_c_binding, only: c_int, c_intptr_t, c_loc, c_ptr, c_size_t
  use kinds_mod, only: wp, sp
  use libc_mod, only: c_madvise
  implicit none
  private

  public :: prefer_huge_pages

  !> To be called behind ALLOCATE, before anything is written. A wish: where the system has no such
  !> pages, or the array is smaller than one, nothing changes.
  interface prefer_huge_pages
    module procedure prefer_for_double, prefer_for_single
  end interface prefer_huge_pages

  integer(c_int), parameter :: madv_hugepage = 14
  integer(c_intptr_t), parameter :: page = 4096_c_intptr_t, huge_page = 512*page

contains

  subroutine prefer_for_double(a)
    real(wp), contiguous, target, intent(in) :: a(:, :)

    if (size(a) == 0) return
    call advise(c_loc(a), size(a, kind=c_intptr_t)*storage_size(a, kind=c_intptr_t)/8)
  end subroutine prefer_for_double

  subroutine prefer_for_single(a)
    real(sp), contiguous, target, intent(in) :: a(:, :, :)

    if (size(a) == 0) return
    call advise(c_loc(a), size(a, kind=c_intptr_t)*storage_size(a, kind=c_intptr_t)/8)
  end subroutine prefer_for_single

  !> Advise on the whole pages within an array.
  subroutine advise(address, bytes)
    type(c_ptr), intent(in) :: address
    integer(c_intptr_t), intent(in) :: bytes
    integer(c_intptr_t) :: first, last
    integer(c_int) :: status

    if (bytes < huge_page) return
    first = transfer(address, first)
    last = (first + bytes)/page*page
    first = (first + page - 1)/page*page
    status = c_madvise(first, int(last - first, c_size_t), madv_hugepage)
    if (status /= 0) return ! it was a wish
  end subroutine advise

end module huge_pages_mod
