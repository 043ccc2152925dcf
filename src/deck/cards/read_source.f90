!> Files to the one text of a deck: text check, line ends, includes.
!>
!>     *INCLUDE, INPUT=mesh.inp
!>
!> A relative path is looked for in the folder of the file that names it, then in the working
!> directory. In the text the line itself becomes a comment, followed by the lines of the file.
module read_source_mod
  use deck_source_mod, only: add_file_name, add_line, max_deck_length, reserve_text, source_t
  use diagnostics_mod, only: add_note, add_plain_mistake, any_mistakes, diagnostics_t, quoted, &
    wants_more
  use deck_table_mod, only: without_tabs
  use text_mod, only: string_t, to_text, upper
  use whole_file_mod, only: read_whole_file
  implicit none
  private

  public :: read_source, source_from_text, first_bad_byte

  integer, parameter :: max_depth = 16       !! files within files
  integer, parameter :: max_files = 1000     !! files put in, in all
  integer, parameter :: max_path = 4000      !! [byte]
  integer, parameter :: max_shown = 200      !! of a line, in a message [byte]
  character, parameter :: tab = achar(9), line_feed = achar(10), return = achar(13)
  character(*), parameter :: blanks = ' '//tab

contains

  !> Read the deck at `path`, with all that it includes.
  !>
  !> On any mistake (no such file, not text, a loop of includes) the source is incomplete, and the
  !> mistake is in `diagnostics`.
  subroutine read_source(path, source, diagnostics)
    character(*), intent(in) :: path
    type(source_t), intent(out) :: source
    type(diagnostics_t), intent(inout) :: diagnostics
    character(:), allocatable :: raw, problem
    type(string_t) :: chain(max_depth)

    call read_whole_file(path, max_deck_length, raw, problem)
    if (allocated(problem)) then
      call add_plain_mistake(diagnostics, path//': error: '//problem//deck_beside(path), 0)
      return
    end if
    chain(1)%text = path
    call add_text(raw, chain, 1, source, diagnostics)
    if (source%n_lines == 0 .and. .not. any_mistakes(diagnostics)) then
      call add_plain_mistake(diagnostics, path//': error: the deck has no lines', 0)
    end if
  end subroutine read_source

  !> Of a path that is no file, whether it is one with the ending of a deck, in words.
  function deck_beside(path) result(words)
    character(*), intent(in) :: path
    character(:), allocatable :: words
    character(*), parameter :: ending = '.inp'
    logical :: exists
    integer :: last

    words = ''
    inquire (file=path, exist=exists)
    if (exists .or. len_trim(path) == 0) return
    ! Shells complete a name up to the point.
    last = len(path)
    if (path(last:) == '.') last = last - 1
    inquire (file=path(:last)//ending, exist=exists)
    if (exists) words = '; did you mean '//quoted(path(:last)//ending)//'?'
  end function deck_beside

  !> Make a source of `text` as if it were the file `path`.
  subroutine source_from_text(text, path, source, diagnostics)
    character(*), intent(in) :: text
    character(*), intent(in) :: path
    type(source_t), intent(out) :: source
    type(diagnostics_t), intent(inout) :: diagnostics
    type(string_t) :: chain(max_depth)

    chain(1)%text = path
    call add_text(text, chain, 1, source, diagnostics)
  end subroutine source_from_text

  !> Add the lines of `raw`, the file chain(depth), to the source.
  recursive subroutine add_text(raw, chain, depth, source, diagnostics)
    character(*), intent(in) :: raw
    type(string_t), intent(inout) :: chain(:)  !! the files being read, each including the next
    integer, intent(in) :: depth
    type(source_t), intent(inout) :: source
    type(diagnostics_t), intent(inout) :: diagnostics
    integer :: first, last, next, number, file, bad, card_line
    character(:), allocatable :: reason, card, text
    logical :: ok

    card = ''
    call add_file_name(source, chain(depth)%text)
    file = source%n_files
    call first_bad_byte(raw, bad, reason)
    if (bad > 0) then
      call read_latin_1(raw, text, ok)
      if (ok) then
        call add_note(diagnostics, 'comments and headings of '//quoted(chain(depth)%text)// &
          ' are not UTF-8 text: read as Latin-1')
        source%n_files = source%n_files - 1
        call add_text(text, chain, depth, source, diagnostics)
        return
      end if
      call report_bad_byte(raw, bad, reason, chain(depth)%text, source%length, diagnostics)
      return
    end if
    if (len(raw) > max_deck_length - source%length) then
      call add_plain_mistake(diagnostics, chain(depth)%text// &
        ': error: with this file the deck is larger than '//to_text(max_deck_length/1000000)// &
        ' MB', source%length)
      return
    end if
    call reserve_text(source, len(raw) + 1)
    first = 1
    ! A byte order mark says nothing that the check above did not find out.
    if (len(raw) >= 3) then
      if (iachar(raw(1:1)) == 239 .and. iachar(raw(2:2)) == 187 .and. iachar(raw(3:3)) == 191) then
        first = 4
      end if
    end if
    number = 0
    lines: do while (first <= len(raw))
      call find_line_end(raw, first, last, next)
      number = number + 1
      if (is_include(raw(first:last))) then
        call add_line(source, '** '//raw(first:last), file, number)
        card = raw(first:last)
        card_line = number
        if (index(card, '=') == 0 .and. ends_with_comma(card) .and. next <= len(raw)) then
          ! The keyword line goes on in the next one.
          first = next
          call find_line_end(raw, first, last, next)
          number = number + 1
          call add_line(source, '** '//raw(first:last), file, number)
          card = card//' '//raw(first:last)
        end if
        call put_in(card, card_line)
        if (.not. wants_more(diagnostics)) return
      else
        call add_line(source, raw(first:last), file, number)
      end if
      first = next
    end do lines

  contains

    !> Read the file that `card` names and add its lines.
    recursive subroutine put_in(card, line)
      character(*), intent(in) :: card
      integer, intent(in) :: line  !! its number in the file
      character(:), allocatable :: path, inner, problem
      integer :: k
      logical :: exists

      call included_path(card, path, problem)
      if (allocated(problem)) then
        call report_include(card, line, problem)
        return
      end if
      if (path(1:1) /= '/') then
        associate (including => chain(depth)%text)
          inner = including(:index(including, '/', back=.true.))//path
        end associate
        inquire (file=inner, exist=exists)
        if (exists) path = inner
      end if
      do k = 1, depth
        if (chain(k)%text == path) problem = 'the file '//quoted(path)//' includes itself'
      end do
      if (.not. allocated(problem) .and. depth == max_depth) problem = &
        'files are included more than '//to_text(max_depth)//' deep'
      if (.not. allocated(problem) .and. source%n_files >= max_files) problem = &
        'more than '//to_text(max_files)//' files are included'
      if (.not. allocated(problem)) then
        call read_whole_file(path, max_deck_length, inner, problem)
        if (allocated(problem)) problem = 'cannot include '//quoted(path)//': '//problem// &
          deck_beside(path)
      end if
      if (allocated(problem)) then
        call report_include(card, line, problem)
        return
      end if
      chain(depth + 1)%text = path
      call add_text(inner, chain, depth + 1, source, diagnostics)
      ! So that readers of the deck in a result know what was written where.
      call add_line(source, '** end of '//path, file, line)
    end subroutine put_in

    !> Report a mistake of *INCLUDE, which the source holds as a comment only.
    subroutine report_include(card, line, problem)
      character(*), intent(in) :: card
      integer, intent(in) :: line
      character(*), intent(in) :: problem
      integer :: star

      star = verify(card, blanks)
      call add_plain_mistake(diagnostics, chain(depth)%text//':'//to_text(line)//':'// &
        to_text(star)//': error: '//problem//new_line('a')//'  '// &
        without_tabs(card(:min(len(card), max_shown)))//new_line('a')// &
        repeat(' ', min(star, max_shown) + 1)//'^', source%length)
    end subroutine report_include

  end subroutine add_text

  !> The last character of the line that begins at `first`, and where the next one begins.
  !>
  !> A line ends with LF, CR LF or CR, or with the text.
  pure subroutine find_line_end(raw, first, last, next)
    character(*), intent(in) :: raw
    integer, intent(in) :: first
    integer, intent(out) :: last  !! first - 1 for an empty line
    integer, intent(out) :: next

    last = first - 1
    do while (last < len(raw))
      if (raw(last + 1:last + 1) == line_feed .or. raw(last + 1:last + 1) == return) exit
      last = last + 1
    end do
    next = last + 1 + skip_line_end(raw, last)
  end subroutine find_line_end

  !> How many characters end the line whose last character is `last`: 0, 1 or 2.
  pure integer function skip_line_end(raw, last) result(n)
    character(*), intent(in) :: raw
    integer, intent(in) :: last

    n = 0
    if (last >= len(raw)) return
    n = 1
    if (last + 2 > len(raw)) return
    if (raw(last + 1:last + 1) == return .and. raw(last + 2:last + 2) == line_feed) n = 2
  end function skip_line_end

  !> Whether a line is the keyword *INCLUDE.
  pure logical function is_include(line) result(is)
    character(*), intent(in) :: line
    integer :: star, first

    is = .false.
    star = verify(line, blanks)
    if (star == 0) return
    if (line(star:star) /= '*') return
    first = star + verify(line(star + 1:), blanks)
    if (first == star .or. first + 6 > len(line)) return
    if (upper(line(first:first + 6)) /= 'INCLUDE') return
    is = .true.
    if (first + 7 <= len(line)) is = scan(line(first + 7:first + 7), blanks//',') == 1
  end function is_include

  pure logical function ends_with_comma(line) result(ends)
    character(*), intent(in) :: line
    integer :: last

    last = verify(line, blanks, back=.true.)
    ends = .false.
    if (last > 0) ends = line(last:last) == ','
  end function ends_with_comma

  !> The path in `*INCLUDE, INPUT=path`.
  pure subroutine included_path(card, path, problem)
    character(*), intent(in) :: card
    character(:), allocatable, intent(out) :: path
    character(:), allocatable, intent(out) :: problem !! allocated when there is no usable path
    character(:), allocatable :: option
    integer :: comma, equal, last

    comma = index(card, ',')
    equal = index(card, '=')
    path = ''
    if (comma > 0 .and. equal > comma) then
      ! As all options, of three letters or more.
      option = upper(trim(adjustl(without_tabs(card(comma + 1:equal - 1)))))
      if (len(option) > 2 .and. index('INPUT', option) == 1) then
        path = trim(adjustl(without_tabs(card(equal + 1:))))
        last = len(path)
        if (last > 1) then
          if (path(last:last) == ',') path = trim(path(:last - 1))
        end if
        last = len(path)
        if (last >= 2) then
          if (scan(path(1:1), '"''') == 1 .and. path(1:1) == path(last:last)) then
            path = path(2:last - 1)
          end if
        end if
      end if
    end if
    if (len(path) > 2) then
      if (path(:2) == './') path = path(3:)
    end if
    if (len(path) == 0) then
      problem = '*INCLUDE needs INPUT=path and nothing else'
    else if (len(path) > max_path) then
      problem = 'the path to include is longer than '//to_text(max_path)//' bytes'
    else if (scan(path, '<>') > 0) then
      problem = 'a path to include takes no parameters <...>'
    end if
  end subroutine included_path

  !> The first byte that does not belong in a text: a control character, or not UTF-8.
  pure subroutine first_bad_byte(raw, bad, reason)
    character(*), intent(in) :: raw
    integer, intent(out) :: bad                           !! its position; 0: all are well
    character(:), allocatable, intent(out) :: reason      !! allocated where bad > 0
    integer :: i, k, code, following, lowest, highest

    bad = 0
    i = 1
    do while (i <= len(raw))
      code = iachar(raw(i:i))
      i = i + 1
      if (code >= 32 .and. code < 127) cycle
      if (code == 9 .or. code == 10 .or. code == 13) cycle
      bad = i - 1
      if (code < 128) then
        reason = 'a control character (byte '//to_text(code)//') in what should be a text file'
        return
      end if
      ! The ranges of the Unicode Standard, table 3-7; 128 to 159 are control characters too.
      lowest = 128
      highest = 191
      select case (code)
      case (194)
        following = 1
        lowest = 160
      case (195:223)
        following = 1
      case (224)
        following = 2
        lowest = 160
      case (237)
        following = 2
        highest = 159
      case (225:236, 238:239)
        following = 2
      case (240)
        following = 3
        lowest = 144
      case (241:243)
        following = 3
      case (244)
        following = 3
        highest = 143
      case default
        following = 0
        lowest = 256
      end select
      if (lowest < 256 .and. i + following - 1 <= len(raw)) then
        do k = 1, following
          code = iachar(raw(i:i))
          if (code < lowest .or. code > highest) exit
          lowest = 128
          highest = 191
          i = i + 1
        end do
        if (k > following) then
          bad = 0
          cycle
        end if
      end if
      reason = 'the file is not UTF-8 text (byte '//to_text(iachar(raw(bad:bad)))//')'
      return
    end do
  end subroutine first_bad_byte

  !> A text whose comments and headings alone have bytes that are not UTF-8: these as characters of
  !> Latin-1, and the control characters among them as question marks.
  pure subroutine read_latin_1(raw, text, ok)
    character(*), intent(in) :: raw
    character(:), allocatable, intent(out) :: text
    logical, intent(out) :: ok !! false: other lines have such bytes, or the text has zeros
    character(:), allocatable :: reason
    integer :: first, last, next, bad, i, n, code
    logical :: in_heading, is_comment

    allocate (character(2*len(raw)) :: text)
    n = 0
    first = 1
    in_heading = .false.
    ok = .true.
    do while (first <= len(raw))
      call find_line_end(raw, first, last, next)
      is_comment = .false.
      associate (line => raw(first:last))
        i = verify(line, blanks)
        if (i > 0) then
          if (line(i:i) == '*') then
            is_comment = index(line(i:), '**') == 1
            if (.not. is_comment) in_heading = upper(line(i:min(i + 7, len(line)))) == '*HEADING'
          end if
        end if
        call first_bad_byte(line, bad, reason)
        ! A star behind such a byte was a keyword's, most likely.
        if (bad > 0) ok = (is_comment .or. (in_heading .and. index(line, '*') == 0)) .and. &
          iachar(line(max(bad, 1):max(bad, 1))) > 127
        if (.not. ok) return
        do i = 1, len(line)
          code = iachar(line(i:i))
          n = n + 1
          text(n:n) = line(i:i)
          if (bad == 0 .or. code < 128) cycle
          if (code < 160) text(n:n) = '?'
          if (code < 160) cycle
          text(n:n + 1) = achar(192 + code/64)//achar(128 + mod(code, 64))
          n = n + 1
        end do
      end associate
      text(n + 1:n + next - last - 1) = raw(last + 1:next - 1)
      n = n + next - last - 1
      first = next
    end do
    text = text(:n)
  end subroutine read_latin_1

  !> Say where in its file the bad byte is; the file's lines are not in the source.
  subroutine report_bad_byte(raw, bad, reason, path, position, diagnostics)
    character(*), intent(in) :: raw
    integer, intent(in) :: bad
    character(*), intent(in) :: reason
    character(*), intent(in) :: path
    integer, intent(in) :: position !! of the file in the deck
    type(diagnostics_t), intent(inout) :: diagnostics
    integer :: i, next, last, line, first

    line = 1
    first = 1
    do
      call find_line_end(raw, first, last, next)
      if (next > bad .or. next > len(raw)) exit
      line = line + 1
      first = next
    end do
    i = bad - first + 1
    call add_plain_mistake(diagnostics, path//':'//to_text(line)//':'//to_text(i)//': error: '// &
      reason, position)
  end subroutine report_bad_byte

end module read_source_mod
