!> The command line.
!>
!>     bipot DECK [options]
!>     bipot PROBLEM.hdf5 [options]
!>
!> `known` lists the options, and `help_text` says what they do. Those of *CONTACT SOLVER, which
!> contact problems have too, are in solver_options.f90.
module command_line_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t, raise, exit_wrong_input
  use text_mod, only: as_list, nearest_word, string_t, to_text, upper
  use controls_mod, only: contact_controls_t, solver_global_newton, solver_sweeps
  use cards_mod, only: reading_t
  use diagnostics_mod, only: guess, quoted
  use memory_sizes_mod, only: take_size
  use numbers_mod, only: number_ok, read_integer, take_positive
  use solver_options_mod, only: set_solver_option, solver_options
  implicit none
  private

  public :: options_t, as_asked, read_command_line, check_kind, refuse_option, help_text, &
    command_text, resume_command

  !> An element is 262,144 then; once more, two million.
  integer, parameter :: max_refinement = 6
  real(wp), parameter :: most_time = 1.0e9_wp !! some thirty years [s]
  integer, parameter :: n_solver_options = 7 !! the first of the list, which problems have, too

  !> An option that is not one of *CONTACT SOLVER.
  type :: option_t
    character(14) :: name
    logical :: has_value = .false. !! in the next word
    logical :: of_decks = .false.  !! contact problems do not have it
  end type option_t

  type(option_t), parameter :: known(*) = [ &
    option_t('--help'), option_t('-h'), &
    option_t('--version'), &
    option_t('--cards'), &
    option_t('--quiet'), option_t('-q'), &
    option_t('--verbose'), option_t('-v'), &
    option_t('--output', has_value=.true.), option_t('-o', has_value=.true.), &
    option_t('--overwrite'), &
    option_t('--plan', of_decks=.true.), &
    option_t('--check', of_decks=.true.), &
    option_t('--flat', of_decks=.true.), &
    option_t('--force', of_decks=.true.), &
    option_t('--continue', of_decks=.true.), &
    option_t('--set', has_value=.true., of_decks=.true.), &
    option_t('--export-fclib', has_value=.true., of_decks=.true.), &
    option_t('--accuracy', has_value=.true., of_decks=.true.), &
    option_t('--extrapolated', of_decks=.true.), &
    option_t('--time', has_value=.true., of_decks=.true.), &
    option_t('--memory', has_value=.true., of_decks=.true.), &
    option_t('--refine', has_value=.true., of_decks=.true.), &
    option_t('--theory', of_decks=.true.), &
    option_t('--nlgeom', has_value=.true., of_decks=.true.), &
    option_t('--as-rigid', has_value=.true., of_decks=.true.), &
    option_t('--symmetry', of_decks=.true.), &
    option_t('--until-steady', of_decks=.true.), &
    option_t('--elastic', of_decks=.true.), &
    option_t('--static-steps', of_decks=.true.)]
  !> By themselves: gfortran 12 compares no texts that are components.
  character(*), parameter :: option_names(*) = known%name

  !> What the user asked for.
  type :: options_t
    character(:), allocatable :: deck            !! path of the deck or problem
    character(:), allocatable :: output          !! -o; empty: NAME.vtkhdf in the working directory
    type(string_t), allocatable :: overrides(:)  !! --set
    character(:), allocatable :: exported        !! --export-fclib: increments, empty for none
    type(contact_controls_t) :: controls         !! of an FCLIB problem; a deck has its own
    character(:), allocatable :: solver_option   !! one that set them, empty for none
    character(:), allocatable :: sweeps_option   !! one that only sweeps know, empty for none
    character(:), allocatable :: deck_option     !! the last of decks alone, empty for none
    real(wp) :: accuracy = 0.0_wp                !! --accuracy; 0: the deck's [-]
    logical :: extrapolated = .false.            !! --extrapolated: it is that of limits
    real(wp) :: time = 0.0_wp                    !! --time: of the processor; 0: any [s]
    real(wp) :: memory = 0.0_wp                  !! --memory: at the peak; 0: what there is [bytes]
    integer :: refine = -1
    !! --refine: how often elements are cut into eight; negative: not given
    logical :: theory = .false.                  !! --theory: its error is estimated
    character(4) :: nlgeom = ''
    !! --nlgeom, upper case: NO, YES or AUTO in place of the deck's NLGEOM
    character(4) :: chosen = ''                  !! YES: AUTO has come to finite strain
    type(string_t), allocatable :: rigid(:)      !! --as-rigid: element sets
    logical :: elastic = .false.                 !! --elastic: *PLASTIC is compared alone
    logical :: static_steps = .false.            !! --static-steps: without those behind them
    logical :: symmetry = .false.                !! --symmetry: half of a mirrored scene is run
    logical :: until_steady = .false.
    !! --until-steady: ends where a load cycle has settled, and nothing else follows
    logical :: plan = .false.
    logical :: check = .false.                   !! --check: tell the deck's mistakes, and stop
    logical :: flat = .false.                    !! print the deck without parameters and blocks
    logical :: force = .false.                   !! run what does not fit the machine
    logical :: overwrite = .false.
    logical :: continues = .false.               !! --continue: goes on with a stopped run
    logical :: quiet = .false.
    logical :: verbose = .false.
    logical :: help = .false.
    logical :: version = .false.
    logical :: cards = .false.    !! print the table of the deck
  end type options_t

contains

  !> Read the arguments of the program.
  subroutine read_command_line(options, error)
    type(options_t), intent(out) :: options
    type(error_t), allocatable, intent(out) :: error
    !! an unknown option, a missing value, no deck or two
    character(:), allocatable :: word, value
    integer :: i

    options%deck = ''
    options%output = ''
    options%exported = ''
    options%solver_option = ''
    options%sweeps_option = ''
    options%deck_option = ''
    allocate (options%overrides(0), options%rigid(0))
    i = 0
    do while (i < command_argument_count())
      i = i + 1
      word = argument(i)
      value = ''
      if (takes_value(word)) call take_value(word, i, value, error)
      if (allocated(error)) return
      if (is_solver_option(word)) then
        call take_solver_option(word, value, options, error)
      else
        call take_option(word, value, options, error)
      end if
      if (allocated(error)) return
    end do
    call check_together(options, error)
  end subroutine read_command_line

  !> Take one option, or the deck.
  subroutine take_option(word, value, options, error)
    character(*), intent(in) :: word
    character(*), intent(in) :: value !! the next word, where the option has a value
    type(options_t), intent(inout) :: options
    type(error_t), allocatable, intent(out) :: error
    character(:), allocatable :: wanted

    if (any(option_names == word .and. known%of_decks)) options%deck_option = word
    select case (word)
    case ('--help', '-h')
      options%help = .true.
    case ('--version')
      options%version = .true.
    case ('--cards')
      options%cards = .true.
    case ('--plan')
      options%plan = .true.
    case ('--check')
      options%check = .true.
    case ('--flat')
      options%flat = .true.
    case ('--force')
      options%force = .true.
    case ('--overwrite')
      options%overwrite = .true.
    case ('--continue')
      options%continues = .true.
    case ('--quiet', '-q')
      options%quiet = .true.
    case ('--verbose', '-v')
      options%verbose = .true.
    case ('-o', '--output')
      options%output = value
    case ('--set')
      call take_override(value, options, error)
    case ('--export-fclib')
      options%exported = value
    case ('--accuracy')
      call take_positive(value, 1.0_wp, options%accuracy, wanted)
    case ('--extrapolated')
      options%extrapolated = .true.
    case ('--time')
      call take_positive(value, most_time, options%time, wanted)
      if (allocated(wanted)) wanted = wanted//', in seconds of CPU time'
    case ('--memory')
      call take_size(value, options%memory, wanted)
    case ('--refine')
      call take_refinement(value, options%refine, wanted)
    case ('--theory')
      options%theory = .true.
    case ('--as-rigid')
      call add_names(value, options%rigid)
    case ('--symmetry')
      options%symmetry = .true.
    case ('--until-steady')
      options%until_steady = .true.
    case ('--elastic')
      options%elastic = .true.
    case ('--static-steps')
      options%static_steps = .true.
    case ('--nlgeom')
      options%nlgeom = upper(value)
      if (all(upper(value) /= ['NO  ', 'YES ', 'AUTO'])) wanted = 'no, yes or auto'
    case default
      call take_deck(word, options, error)
    end select
    if (allocated(wanted)) call refuse_value(word, wanted, value, error)
  end subroutine take_option

  !> Refuse options that do not go together. What only sweeps know means sweeps.
  subroutine check_together(options, error)
    type(options_t), intent(inout) :: options
    type(error_t), allocatable, intent(out) :: error

    if (options%continues .and. options%overwrite) then
      call refuse_option('--continue and --overwrite exclude each other', error)
    else if (options%quiet .and. options%verbose) then
      call refuse_option('--quiet and --verbose exclude each other', error)
    else if (count([options%plan, options%check, options%flat]) > 1) then
      call refuse_option('--plan, --check and --flat exclude each other', error)
    else if (options%flat .and. options%refine >= 0) then
      call refuse_option('--flat prints the deck, which has no more elements with --refine', error)
    else if (options%sweeps_option /= '' .and. options%controls%solver == solver_global_newton) then
      call refuse_option(options%sweeps_option//' applies to sweeps, not to --solver '// &
        'global-newton', error)
    else if (options%deck == '' .and. .not. (options%help .or. &
      options%version .or. options%cards)) then
      call refuse_option('no deck given (see bipot --help)', error)
    end if
    if (options%sweeps_option /= '') options%controls%solver = solver_sweeps
  end subroutine check_together

  !> How a deck is to be read.
  pure type(reading_t) function as_asked(options, nlgeom) result(reading)
    type(options_t), intent(in) :: options
    character(4), intent(in) :: nlgeom !! --nlgeom, or what has been chosen

    reading = reading_t(nlgeom=nlgeom, elastic=options%elastic, static_steps=options%static_steps)
  end function as_asked

  !> Refuse options that belong to a deck beside a problem, and the reverse.
  subroutine check_kind(options, is_problem, error)
    type(options_t), intent(in) :: options
    logical, intent(in) :: is_problem !! an FCLIB problem, not a deck
    type(error_t), allocatable, intent(out) :: error

    if (is_problem .and. options%deck_option /= '') then
      call refuse_option(options%deck_option//" applies to decks, and '"//options%deck// &
        "' is a contact problem", error)
    else if (.not. is_problem .and. options%solver_option /= '') then
      call refuse_option(options%solver_option//' applies to contact problems (PROBLEM.hdf5); '// &
        'in a deck use *CONTACT SOLVER', error)
    end if
  end subroutine check_kind

  !> Whether a word is an option of *CONTACT SOLVER that problems have, too: --max-sweeps.
  pure logical function is_solver_option(word)
    character(*), intent(in) :: word

    is_solver_option = any(as_option(solver_options(:n_solver_options)) == word)
  end function is_solver_option

  !> An option of *CONTACT SOLVER as the command line writes it.
  elemental function as_option(name) result(option)
    character(*), intent(in) :: name
    character(len(name) + 2) :: option
    integer :: i

    option = '--'//name
    do i = 3, len_trim(option)
      if (option(i:i) == ' ') option(i:i) = '-'
      if (option(i:i) >= 'A' .and. option(i:i) <= 'Z') option(i:i) = achar(iachar(option(i:i)) + 32)
    end do
  end function as_option

  !> Take the value of such an option.
  subroutine take_solver_option(option, value, options, error)
    character(*), intent(in) :: option, value
    type(options_t), intent(inout) :: options
    type(error_t), allocatable, intent(out) :: error !! no such value
    character(:), allocatable :: wanted
    type(string_t), allocatable :: words(:)
    integer :: i
    logical :: of_sweeps

    options%solver_option = option
    of_sweeps = .false.
    do i = 1, n_solver_options
      if (as_option(solver_options(i)) /= option) cycle
      call set_solver_option(trim(solver_options(i)), value, options%controls, of_sweeps, wanted, &
        words)
      if (allocated(wanted)) call refuse_value(option, wanted, value, error, guess(upper(value), &
        words))
    end do
    if (of_sweeps) options%sweeps_option = option
  end subroutine take_solver_option

  !> Refuse what the command line asks for.
  subroutine refuse_option(message, error)
    character(*), intent(in) :: message
    type(error_t), allocatable, intent(out) :: error

    call raise(error, exit_wrong_input, 'bipot: error: '//message)
  end subroutine refuse_option

  !> Refuse the value of an option.
  subroutine refuse_value(option, wanted, value, error, hint)
    character(*), intent(in) :: option
    character(*), intent(in) :: wanted !! "a number above 0"
    character(*), intent(in) :: value
    type(error_t), allocatable, intent(out) :: error
    character(*), intent(in), optional :: hint
    character(:), allocatable :: ending

    ending = ''
    if (present(hint)) ending = hint
    if (ending /= '') ending = '; '//ending
    call refuse_option(option//' must be '//wanted//', not '//quoted(value)//ending, error)
  end subroutine refuse_value

  subroutine take_value(option, i, value, error)
    character(*), intent(in) :: option
    integer, intent(inout) :: i
    character(:), allocatable, intent(out) :: value
    type(error_t), allocatable, intent(out) :: error

    value = ''
    i = i + 1
    if (i <= command_argument_count()) value = argument(i)
    if (value == '') call refuse_option(option//' needs a value', error)
  end subroutine take_value

  !> The number behind --refine.
  subroutine take_refinement(value, times, wanted)
    character(*), intent(in) :: value
    integer, intent(inout) :: times
    character(:), allocatable, intent(out) :: wanted !! allocated where it is no such number
    integer :: number, status

    call read_integer(value, number, status)
    if (status == number_ok .and. number >= 0 .and. number <= max_refinement) then
      times = number
    else
      wanted = 'a whole number from 0 to '//to_text(max_refinement)
    end if
  end subroutine take_refinement

  !> Add names between commas to a list, in upper case.
  subroutine add_names(names, list)
    character(*), intent(in) :: names
    type(string_t), allocatable, intent(inout) :: list(:)
    type(string_t) :: name
    integer :: first, last

    first = 1
    do while (first <= len(names))
      last = first + index(names(first:)//',', ',') - 2
      name%text = upper(trim(adjustl(names(first:last))))
      list = [list, name]
      first = last + 2
    end do
  end subroutine add_names

  subroutine take_override(text, options, error)
    character(*), intent(in) :: text !! name=value
    type(options_t), intent(inout) :: options
    type(error_t), allocatable, intent(out) :: error
    type(string_t) :: override

    override%text = text
    if (index(text, '=') < 2) then
      call refuse_option("--set needs name=value, found '"//text//"'", error)
      return
    end if
    options%overrides = [options%overrides, override]
  end subroutine take_override

  subroutine take_deck(word, options, error)
    character(*), intent(in) :: word
    type(options_t), intent(inout) :: options
    type(error_t), allocatable, intent(out) :: error
    character(:), allocatable :: meant

    if (word(:min(1, len(word))) == '-') then
      meant = meant_option(word, as_list([character(14) :: pack(option_names, option_names(:)(2:2) &
        == '-'), as_option(solver_options(:n_solver_options))]))
      call refuse_option("unknown option '"//word//"'"//meant, error)
    else if (options%deck /= '') then
      call refuse_option("one deck per run, found '"//options%deck//"' and '"//word//"'", error)
    else
      options%deck = word
    end if
  end subroutine take_deck

  !> Which of the options that there are may have been meant.
  pure function meant_option(word, known) result(meant)
    character(*), intent(in) :: word
    type(string_t), intent(in) :: known(:)
    character(:), allocatable :: meant
    integer :: nearest

    nearest = nearest_word(word, known)
    meant = ' (bipot --help lists them)'
    if (nearest > 0) meant = ", did you mean '"//known(nearest)%text//"'?"
  end function meant_option

  function argument(i) result(word)
    integer, intent(in) :: i
    character(:), allocatable :: word
    integer :: length

    call get_command_argument(i, length=length)
    allocate (character(length) :: word)
    call get_command_argument(i, word)
  end function argument

  !> The command as it was given, quoted for the shell.
  function command_text() result(text)
    character(:), allocatable :: text
    integer :: i

    text = quoted_for_shell(argument(0))
    do i = 1, command_argument_count()
      text = text//' '//quoted_for_shell(argument(i))
    end do
  end function command_text

  !> The command that goes on with this run, quoted for the shell: --overwrite would not let it.
  function resume_command() result(text)
    character(:), allocatable :: text, word
    integer :: i
    logical :: is_value

    text = quoted_for_shell(argument(0))
    is_value = .false.
    do i = 1, command_argument_count()
      word = argument(i)
      if (is_value .or. (word /= '--overwrite' .and. word /= '--continue')) then
        text = text//' '//quoted_for_shell(word)
      end if
      is_value = .not. is_value .and. takes_value(word)
    end do
    text = text//' --continue'
  end function resume_command

  pure logical function takes_value(option)
    character(*), intent(in) :: option

    takes_value = is_solver_option(option) .or. any(option_names == option .and. known%has_value)
  end function takes_value

  !> A word as a POSIX shell must be given it: bare where every letter stands for itself, else
  !> between single quotes.
  pure function quoted_for_shell(word) result(quoted)
    character(*), intent(in) :: word
    character(:), allocatable :: quoted
    character(*), parameter :: plain = 'abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ'// &
      '0123456789_-+=./:,@%'
    integer :: i

    quoted = word
    if (len(word) > 0 .and. verify(word, plain) == 0) return
    quoted = "'"
    do i = 1, len(word)
      if (word(i:i) == "'") then
        quoted = quoted//"'\''"
      else
        quoted = quoted//word(i:i)
      end if
    end do
    quoted = quoted//"'"
  end function quoted_for_shell

  !> What --help prints.
  function help_text() result(text)
    character(:), allocatable :: text
    integer, parameter :: width = 89
    character(width), parameter :: lines(*) = [character(width) :: &
      'bipot: contact with Coulomb friction of elastic solids, every increment certified', &
      '', &
      'usage: bipot DECK [options]', &
      '       bipot PROBLEM.hdf5 [options]   a contact problem in FCLIB''s format', &
      '', &
      '  -o, --output FILE   result file (default: NAME.vtkhdf in the working directory);', &
      '                      .vtkhdf is added to a name without an ending', &
      '  --set name=value    change the value of a parameter of the deck; may be repeated', &
      '  -q, --quiet         print warnings, notes on steps and the closing line only', &
      '  -v, --verbose       print the whole plan, solvers and residuals, CPU time of each phase', &
      '  --plan              check the deck, print what a run would do and cost, and stop', &
      '  --check             check the deck only, one error a line, for editors;', &
      '                      of a folder: which decks are accepted, or why not', &
      '  --flat              print the deck without includes, parameters and blocks, for other', &
      '                      programs, and stop', &
      '', &
      'mesh and accuracy:', &
      '  --accuracy X        allowed error of the contact forces, 0.01 for 1 %: the program', &
      '                      chooses mesh and increments, and says if X is not reached', &
      '  --extrapolated      ask for the accuracy of values extrapolated from all runs', &
      '  --time S            CPU time of all runs together, in seconds: the program chooses', &
      '                      the most accurate mesh and increments within it', &
      '  --memory SIZE       memory of each run, as 4GB or 500MB; likewise', &
      '  --refine K          divide each element into eight, K times (0 to 6); sets, surfaces', &
      '                      and loads follow; --accuracy, --time and --memory keep this mesh', &
      '  --theory            estimate the error of small strain by a run at finite strain', &
      '                      beside the linear one, instead of a bound on it', &
      '  --nlgeom W          no: small strain; yes: finite strain, in place of the deck''s', &
      '                      NLGEOM; auto: small strain if that is enough for 1 %, or for the', &
      '                      accuracy that is asked for, else finite strain; auto is also what', &
      '                      an accuracy implies if the deck does not say NLGEOM', &
      '  --as-rigid SET      the body of this element set is a rigid obstacle of its faces;', &
      '                      --plan estimates what that saves and what it changes', &
      '  --elastic           run a deck with *PLASTIC as elastic, and say how much of each body', &
      '                      is above its first yield stress', &
      '  --static-steps      run the static steps before the first step of another kind', &
      '  --symmetry          run half of a scene that is its own mirror image across x, y or z,', &
      '                      or a quarter; --plan says whether it is; the result is of that part', &
      '', &
      'runs:', &
      '  --until-steady      stop when a load cycle has settled, if the deck only repeats it', &
      '                      from there on', &
      '  --continue          resume the run that left an unfinished result', &
      '  --overwrite         replace a result file that is unfinished, or of another deck or', &
      '                      other parameters', &
      '  --force             run what does not fit in memory or on the disk', &
      '  --export-fclib LIST write the contact problems of these increments, as 1,15,30-32', &
      '                      or all, to NAME-<increment>.fclib.hdf5', &
      '', &
      '  -h, --help          print this', &
      '  --cards             print the keywords of a deck and their options as JSON', &
      '  --version           print the version; with --verbose the kernels of OpenBLAS, too', &
      '', &
      'for a contact problem (in a deck: *CONTACT SOLVER):', &
      '  --solver auto|sweeps|global-newton   --formulation bipotential|pseudopotential', &
      '  --local uzawa|newton|newton6|exact   --rho X   --relaxation X', &
      '  --tolerance X   --max-sweeps N   -o FILE (default: PROBLEM.solution.hdf5)', &
      '', &
      'exit status:', &
      '    0  every increment certified', &
      '    1  error in the command line or the deck: nothing was computed', &
      '    2  an increment did not converge or is not certified, or the accuracy is not reached', &
      '    3  the machine failed: memory, disk, a library', &
      '  130  stopped by SIGINT (Ctrl-C); 143: by SIGTERM (kill)', &
      '', &
      'docs/deck.md, docs/results.md and docs/fclib.md describe the files.']
    integer :: i

    text = trim(lines(1))
    do i = 2, size(lines)
      text = text//new_line('a')//trim(lines(i))
    end do
  end function help_text

end module command_line_mod
