!> The deck as one text: the lines of its file and of the files it includes, in reading order.
!>
!> A place in the deck is one integer, the position of a character in that text (0: no place);
!> file, line and column are found from it when a mistake is printed.
module deck_source_mod
  use sorting_mod, only: count_below
  use text_mod, only: string_t
  implicit none
  private

  public :: source_t, place_t, add_line, add_file_name, reserve_text, line_at, place_of
  public :: max_deck_length, line_feed

  !> Longest deck, includes put in: positions are default integers. [byte]
  integer, parameter :: max_deck_length = 2000000000
  character, parameter :: line_feed = achar(10)

  !> All lines of a deck, each followed by a line feed.
  type :: source_t
    character(:), allocatable :: text   !! the lines; filled up to `length`
    integer :: length = 0
    integer, allocatable :: first(:)    !! (n_lines+1) position of the first character of each line
    integer, allocatable :: number(:)   !! (n_lines) number of the line in its own file
    integer, allocatable :: file(:)     !! (n_lines) index into `files`
    integer :: n_lines = 0
    type(string_t), allocatable :: files(:) !! paths as the user wrote them
    integer :: n_files = 0
  end type source_t

  !> A place in a deck, for people.
  type :: place_t
    character(:), allocatable :: file
    integer :: line = 0    !! number of the line in its file
    integer :: column = 0  !! characters (not bytes) from the beginning of the line, from 1
  end type place_t

contains

  !> Make room for `more` further characters of text.
  subroutine reserve_text(source, more)
    type(source_t), intent(inout) :: source
    integer, intent(in) :: more !! >= 0; length + more must not pass max_deck_length + 1000
    character(:), allocatable :: larger
    integer :: wanted, have

    if (.not. allocated(source%text)) allocate (character(0) :: source%text)
    have = len(source%text)
    wanted = source%length + more
    if (wanted <= have) return
    if (have < max_deck_length/2) wanted = max(wanted, 2*have)
    allocate (character(wanted) :: larger)
    larger(:source%length) = source%text(:source%length)
    call move_alloc(larger, source%text)
  end subroutine reserve_text

  !> Add one line, given without its line feed.
  subroutine add_line(source, line, file, number)
    type(source_t), intent(inout) :: source
    character(*), intent(in) :: line
    integer, intent(in) :: file    !! index into the source's files
    integer, intent(in) :: number  !! number of the line in that file
    integer :: n

    call reserve_text(source, len(line) + 1)
    n = source%n_lines + 1
    if (.not. allocated(source%first)) then
      allocate (source%first(1024), source%number(1024), source%file(1024))
      source%first(1) = 1
    end if
    if (n + 1 > size(source%first)) then
      source%first = [source%first, source%first]
      source%number = [source%number, source%number]
      source%file = [source%file, source%file]
    end if
    source%text(source%length + 1:source%length + len(line)) = line
    source%length = source%length + len(line) + 1
    source%text(source%length:source%length) = line_feed
    source%first(n + 1) = source%length + 1
    source%number(n) = number
    source%file(n) = file
    source%n_lines = n
  end subroutine add_line

  !> Register the path of a file whose lines follow; its index is `source%n_files`.
  subroutine add_file_name(source, path)
    type(source_t), intent(inout) :: source
    character(*), intent(in) :: path
    type(string_t), allocatable :: larger(:)
    integer :: i

    allocate (larger(source%n_files + 1))
    do i = 1, source%n_files
      larger(i)%text = source%files(i)%text
    end do
    larger(source%n_files + 1)%text = path
    call move_alloc(larger, source%files)
    source%n_files = source%n_files + 1
  end subroutine add_file_name

  !> The line (index into the source's lines) that holds `position`.
  pure integer function line_at(source, position) result(line)
    type(source_t), intent(in) :: source
    integer, intent(in) :: position !! 1 .. source%length

    line = count_below(position + 1, source%first(:source%n_lines))
  end function line_at

  !> File, line and column of `position`.
  pure type(place_t) function place_of(source, position) result(place)
    type(source_t), intent(in) :: source
    integer, intent(in) :: position !! 1 .. source%length
    integer :: line, i

    line = line_at(source, position)
    place%file = source%files(source%file(line))%text
    place%line = source%number(line)
    place%column = 0
    do i = source%first(line), position
      ! The second and later bytes of a UTF-8 character are 10xxxxxx.
      if (iand(iachar(source%text(i:i)), 192) /= 128) place%column = place%column + 1
    end do
  end function place_of

end module deck_source_mod
