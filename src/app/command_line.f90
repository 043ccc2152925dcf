!> The command line.
!>
!>     bipot DECK [-o FILE] [--set name=value ...] [--plan] [--overwrite] [--quiet]
!>     bipot --help | --version
module command_line_mod
  use errors_mod, only: error_t, raise, exit_wrong_input
  use text_mod, only: string_t, nearest_word
  implicit none
  private

  public :: options_t, read_command_line, help_text, command_text

  !> What the user asked for.
  type :: options_t
    character(:), allocatable :: deck            !! path of the deck
    character(:), allocatable :: output          !! -o; empty: NAME.vtkhdf in the working directory
    type(string_t), allocatable :: overrides(:)  !! --set
    logical :: plan = .false.
    logical :: overwrite = .false.
    logical :: quiet = .false.
    logical :: help = .false.
    logical :: version = .false.
  end type options_t

contains

  !> Read the arguments of the program.
  subroutine read_command_line(options, error)
    type(options_t), intent(out) :: options
    type(error_t), allocatable, intent(out) :: error !! an unknown option, a missing value, no deck
                                                     !! or two
    character(:), allocatable :: word
    integer :: i

    options%deck = ''
    options%output = ''
    allocate (options%overrides(0))
    i = 0
    do while (i < command_argument_count())
      i = i + 1
      word = argument(i)
      select case (word)
      case ('--help', '-h')
        options%help = .true.
      case ('--version')
        options%version = .true.
      case ('--plan')
        options%plan = .true.
      case ('--overwrite')
        options%overwrite = .true.
      case ('--quiet', '-q')
        options%quiet = .true.
      case ('-o', '--output')
        call take_value(word, i, options%output, error)
      case ('--set')
        call take_override(i, options, error)
      case default
        call take_deck(word, options, error)
      end select
      if (allocated(error)) return
    end do
    if (options%deck == '' .and. .not. (options%help .or. options%version)) call raise(error, &
      exit_wrong_input, &
      'bipot: error: no deck given (bipot --help tells what there is)')
  end subroutine read_command_line

  subroutine take_value(option, i, value, error)
    character(*), intent(in) :: option
    integer, intent(inout) :: i
    character(:), allocatable, intent(out) :: value
    type(error_t), allocatable, intent(out) :: error

    value = ''
    i = i + 1
    if (i <= command_argument_count()) value = argument(i)
    if (value == '') call raise(error, exit_wrong_input, 'bipot: error: '//option//' needs a value')
  end subroutine take_value

  subroutine take_override(i, options, error)
    integer, intent(inout) :: i
    type(options_t), intent(inout) :: options
    type(error_t), allocatable, intent(out) :: error
    type(string_t) :: override

    call take_value('--set', i, override%text, error)
    if (allocated(error)) return
    if (index(override%text, '=') < 2) then
      call raise(error, exit_wrong_input, "bipot: error: --set needs name=value, found '"// &
        override%text//"'")
      return
    end if
    options%overrides = [options%overrides, override]
  end subroutine take_override

  subroutine take_deck(word, options, error)
    character(*), intent(in) :: word
    type(options_t), intent(inout) :: options
    type(error_t), allocatable, intent(out) :: error
    type(string_t) :: known(7)
    integer :: nearest

    if (word(:min(1, len(word))) == '-') then
      known = [string_t('--help'), string_t('--version'), string_t('--plan'), &
        string_t('--overwrite'), &
               string_t('--quiet'), string_t('--output'), string_t('--set')]
      nearest = nearest_word(word, known)
      if (nearest > 0) then
        call raise(error, exit_wrong_input, "bipot: error: unknown option '"//word// &
          "', did you mean '"// &
          known(nearest)%text//"'?")
      else
        call raise(error, exit_wrong_input, "bipot: error: unknown option '"//word// &
          "' (bipot --help lists them)")
      end if
    else if (options%deck /= '') then
      call raise(error, exit_wrong_input, "bipot: error: one deck a run, found '"//options%deck// &
        "' and '"//word//"'")
    else
      options%deck = word
    end if
  end subroutine take_deck

  function argument(i) result(word)
    integer, intent(in) :: i
    character(:), allocatable :: word
    integer :: length

    call get_command_argument(i, length=length)
    allocate (character(length) :: word)
    call get_command_argument(i, word)
  end function argument

  !> The command as it was given.
  function command_text() result(text)
    character(:), allocatable :: text
    integer :: i

    text = argument(0)
    do i = 1, command_argument_count()
      text = text//' '//argument(i)
    end do
  end function command_text

  !> What --help prints.
  function help_text() result(text)
    character(:), allocatable :: text
    character(*), parameter :: nl = new_line('a')

    text = 'bipot: contact with friction of three-dimensional bodies, every step certified'//nl// &
      nl// &
      'usage: bipot DECK [options]'//nl//nl// &
      '  -o, --output FILE   result file (default: NAME.vtkhdf in the working directory)'//nl// &
      '  --set name=value    give a parameter of the deck another value; may be repeated'//nl// &
      '  --plan              check the deck, print what a run would do, and stop'//nl// &
      '  --overwrite         replace a result file that is unfinished or of another deck'//nl// &
      '  -q, --quiet         print only the closing sentence'//nl// &
      '  -h, --help          print this'//nl// &
      '  --version           print the version'//nl//nl// &
      'exit status: 0 every step certified; 1 wrong command line or deck; 2 a step did not converge or certify;'//nl// &
      '3 the machine failed (memory, disk, a library). docs/deck.md and docs/results.md describe deck and result.'
  end function help_text

end module command_line_mod
