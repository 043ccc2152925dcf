!> Triangles from STL files, binary or text.
!>
!> A binary file has 80 bytes of any kind, the number of triangles, and 50 bytes a triangle: normal
!> and three corners in single precision, two bytes that say nothing. A file of that length is
!> binary; a text begins with `solid`. Normals are not read: they are those of the corners, which
!> stand anticlockwise from outside.
module stl_file_mod
  use checksum_mod, only: checksum_of
  use diagnostics_mod, only: quoted
  use facet_shape_mod, only: facet_is_flat
  use kinds_mod, only: i4, i8, sp, wp
  use numbers_mod, only: number_ok, read_real
  use resource_limits_mod, only: has_memory
  use text_mod, only: printable, to_text, upper
  use whole_file_mod, only: read_whole_file
  implicit none
  private

  public :: triangles_t, read_stl, triangles_of_stl

  integer, parameter :: header = 84         !! of a binary file [byte]
  integer, parameter :: of_triangle = 50    !! in a binary file [byte]
  integer, parameter :: max_length = 500000000 !! of a file [byte]
  integer, parameter :: max_triangles = 5000000

  type :: triangles_t
    real(wp), allocatable :: corner(:, :) !! (3,3*n) three after three [length]
    integer  :: n = 0
    integer  :: n_flat = 0                !! without area: left out
    integer(i8) :: checksum = 0           !! of the file
  end type triangles_t

contains

  !> The triangles of the file at `path`; `problem` is allocated when they cannot be had.
  subroutine read_stl(path, triangles, problem)
    character(*), intent(in) :: path
    type(triangles_t), intent(out) :: triangles
    character(:), allocatable, intent(out) :: problem
    character(:), allocatable :: raw

    call read_whole_file(path, max_length, raw, problem)
    if (allocated(problem)) return
    if (.not. has_memory(72_i8*(len(raw)/of_triangle))) then
      problem = 'there is no memory for it'
      return
    end if
    call triangles_of_stl(raw, triangles, problem)
  end subroutine read_stl

  !> The triangles of a file whose bytes are `raw`.
  subroutine triangles_of_stl(raw, triangles, problem)
    character(*), intent(in) :: raw
    type(triangles_t), intent(out) :: triangles
    character(:), allocatable, intent(out) :: problem
    integer(i8) :: n

    n = -1
    if (len(raw) >= header) n = count_of_binary(raw)
    if (n >= 0 .and. header + of_triangle*n == len(raw)) then
      call read_binary(raw, int(n), triangles, problem)
    else if (begins_with_solid(raw)) then
      call read_text(raw, triangles, problem)
    else if (len(raw) < header) then
      problem = 'this is no STL file: a text begins with "solid", and a binary file has at '// &
        'least '//to_text(header)//' bytes, not '//to_text(len(raw))
    else
      problem = 'this is no STL file, or a damaged one: a text begins with "solid", and a '// &
        'binary file of '//to_text(n)//' triangles, as its head says, has '// &
        to_text(header + of_triangle*n)//' bytes, not '//to_text(len(raw))
    end if
    if (allocated(problem)) return
    if (triangles%n == 0) then
      problem = 'there are no triangles in it'
      if (triangles%n_flat > 0) problem = 'none of its '//to_text(triangles%n_flat)// &
        ' triangles has an area'
      return
    end if
    triangles%checksum = checksum_of(raw)
  end subroutine triangles_of_stl

  !> The number of triangles in the head of a binary file, the least byte first.
  pure integer(i8) function count_of_binary(raw) result(n)
    character(*), intent(in) :: raw
    integer :: i

    n = 0
    do i = header, header - 3, -1
      n = 256*n + iachar(raw(i:i))
    end do
  end function count_of_binary

  pure logical function begins_with_solid(raw) result(begins)
    character(*), intent(in) :: raw
    integer :: first

    begins = .false.
    first = verify(raw(:min(len(raw), 200)), ' '//achar(9)//achar(10)//achar(13))
    if (first == 0 .or. first + 4 > len(raw)) return
    begins = upper(raw(first:first + 4)) == 'SOLID'
  end function begins_with_solid

  pure subroutine read_binary(raw, n, triangles, problem)
    character(*), intent(in) :: raw
    integer, intent(in) :: n
    type(triangles_t), intent(inout) :: triangles
    character(:), allocatable, intent(out) :: problem
    real(wp) :: corner(3, 3)
    integer :: i, j, k
    logical :: ok

    if (n > max_triangles) then
      problem = too_many()
      return
    end if
    allocate (triangles%corner(3, 3*n))
    do i = 1, n
      do k = 1, 3
        do j = 1, 3
          call read_single(raw, header + of_triangle*(i - 1) + 12*k + 4*(j - 1), corner(j, k), ok)
          if (ok) cycle
          problem = 'a coordinate of triangle '//to_text(i)//' is not finite'
          return
        end do
      end do
      call add_triangle(corner, triangles)
    end do
  end subroutine read_binary

  !> A number in single precision, the least byte first; `ok` is false where it is not finite.
  pure subroutine read_single(raw, before, value, ok)
    character(*), intent(in) :: raw
    integer, intent(in) :: before  !! bytes before it
    real(wp), intent(out) :: value
    logical, intent(out) :: ok
    integer(i8) :: bits
    integer :: i

    bits = 0
    do i = 4, 1, -1
      bits = 256*bits + iachar(raw(before + i:before + i))
    end do
    value = 0.0_wp
    ok = ibits(bits, 23, 8) < 255
    if (.not. ok) return
    if (bits >= 2_i8**31) bits = bits - 2_i8**32
    value = real(transfer(int(bits, i4), 1.0_sp), wp)
  end subroutine read_single

  !> facet normal x y z, outer loop, vertex x y z three times, endloop, endfacet; words and numbers
  !> between blanks and ends of lines. Behind solid and endsolid stands a name, up to the end of the
  !> line.
  subroutine read_text(raw, triangles, problem)
    character(*), intent(in) :: raw
    type(triangles_t), intent(inout) :: triangles
    character(:), allocatable, intent(out) :: problem
    character(*), parameter :: blanks = ' '//achar(9)
    character(*), parameter :: line_ends = achar(10)//achar(13)
    integer :: first, last, next, line, room, k
    real(wp) :: corner(3, 3), normal(3)
    logical :: ok, in_solid

    ! No triangle is shorter than this.
    room = min(max_triangles, len(raw)/60 + 1)
    allocate (triangles%corner(3, 3*room))
    next = 1
    line = 1
    in_solid = .false.
    do
      call next_word()
      if (last < first) exit
      select case (word())
      case ('SOLID', 'ENDSOLID')
        in_solid = word() == 'SOLID'
        k = scan(raw(next:), line_ends)
        if (k == 0) exit
        next = next + k - 1
      case ('FACET')
        if (triangles%n + triangles%n_flat >= room) then
          problem = too_many()
          return
        end if
        call expect('normal')
        if (ok) call expect_numbers(normal, .false.)
        if (ok) call expect('outer')
        if (ok) call expect('loop')
        do k = 1, 3
          if (ok) call expect('vertex')
          if (ok) call expect_numbers(corner(:, k), .true.)
        end do
        if (ok) call expect('endloop')
        if (ok) call expect('endfacet')
        if (.not. ok) return
        call add_triangle(corner, triangles)
      case default
        problem = 'line '//to_text(line)//': expected "facet" or "endsolid", found '//found()
        return
      end select
    end do
    if (in_solid .and. triangles%n == 0 .and. triangles%n_flat == 0) problem = &
      'there are no triangles in it'

  contains

    !> The next word is raw(first:last); none is left where last < first.
    subroutine next_word()
      do while (next <= len(raw))
        if (raw(next:next) == achar(10)) line = line + 1
        if (scan(raw(next:next), blanks//line_ends) == 0) exit
        next = next + 1
      end do
      first = next
      do while (next <= len(raw))
        if (scan(raw(next:next), blanks//line_ends) == 1) exit
        next = next + 1
      end do
      last = next - 1
    end subroutine next_word

    function word()
      character(:), allocatable :: word

      word = upper(raw(first:min(last, first + 20)))
    end function word

    function found() result(text)
      character(:), allocatable :: text

      text = 'the end of the file'
      if (last >= first) text = quoted(printable(raw(first:min(last, first + 39))))
    end function found

    subroutine expect(wanted)
      character(*), intent(in) :: wanted

      call next_word()
      ok = .false.
      if (last >= first) ok = word() == upper(wanted)
      if (.not. ok) problem = 'line '//to_text(line)//': expected "'//wanted//'", found '//found()
    end subroutine expect

    !> Three numbers; of normals, which are not used, anything is taken.
    subroutine expect_numbers(value, must_be_numbers)
      real(wp), intent(out) :: value(3)
      logical, intent(in) :: must_be_numbers
      integer :: i, status

      value = 0.0_wp
      do i = 1, 3
        call next_word()
        ok = last >= first
        if (ok .and. must_be_numbers) then
          call read_real(raw(first:last), value(i), status)
          ok = status == number_ok
        end if
        if (ok) cycle
        problem = 'line '//to_text(line)//': expected a finite number of at most 1e60, found '// &
          found()
        return
      end do
    end subroutine expect_numbers

  end subroutine read_text

  !> Take a triangle, unless it has no area.
  pure subroutine add_triangle(corner, triangles)
    real(wp), intent(in) :: corner(3, 3) !! columns [length]
    type(triangles_t), intent(inout) :: triangles
    integer :: n

    if (facet_is_flat(corner)) then
      triangles%n_flat = triangles%n_flat + 1
      return
    end if
    n = triangles%n
    triangles%corner(:, 3*n + 1:3*n + 3) = corner
    triangles%n = n + 1
  end subroutine add_triangle

  pure function too_many() result(problem)
    character(:), allocatable :: problem

    problem = 'it has more than '//to_text(max_triangles)//' triangles'
  end function too_many

end module stl_file_mod
