!> The decks of a folder: which are accepted, and for what the others are refused.
module check_folder_mod
  use errors_mod, only: error_t
  use text_mod, only: string_t, to_text
  use folders_mod, only: list_files
  use scene_mod, only: scene_t
  use read_deck_mod, only: read_deck
  use command_line_mod, only: as_asked, options_t, refuse_option
  use console_mod, only: say
  implicit none
  private

  public :: check_folder

  character(*), parameter :: without_step = 'the deck has no *STEP'

contains

  !> Check all decks of a folder and of those within it, and print a line for each. Files without a
  !> *STEP are parts that decks include.
  subroutine check_folder(options, error)
    type(options_t), intent(in) :: options !! its deck is the path of the folder
    type(error_t), allocatable, intent(out) :: error !! there is no deck, or one is refused
    type(string_t), allocatable :: files(:)
    type(scene_t) :: scene
    type(error_t), allocatable :: refused
    integer :: i, n_accepted, n_refused

    call list_files(without_slash(options%deck), '.inp', files)
    n_accepted = 0
    n_refused = 0
    do i = 1, size(files)
      call read_deck(files(i)%text, options%overrides, scene, refused, in_lines=.true., &
        reading=as_asked(options, options%nlgeom))
      if (.not. allocated(refused)) then
        n_accepted = n_accepted + 1
        call say('accepted  '//files(i)%text)
      else if (index(refused%message, without_step) > 0) then
        call say('no deck   '//files(i)%text//': it has no *STEP')
      else
        n_refused = n_refused + 1
        call say('refused   '//reason(refused%message, files(i)%text))
      end if
    end do
    call say(to_text(n_accepted)//' of '//to_text(n_accepted + n_refused)//' decks accepted')
    if (n_accepted + n_refused == 0) then
      call refuse_option('no deck (.inp) in '//options%deck, error)
    else if (n_refused > 0) then
      call refuse_option(to_text(n_refused)//' of '//to_text(n_accepted + n_refused)// &
        ' decks are refused', error)
    end if
  end subroutine check_folder

  !> The first error of a deck, with its file, and how many there are more.
  pure function reason(message, deck) result(words)
    character(*), intent(in) :: message !! an error a line
    character(*), intent(in) :: deck    !! path
    character(:), allocatable :: words
    integer :: last, i, n

    last = index(message//new_line('a'), new_line('a')) - 1
    words = message(:last)
    if (index(words, deck//':') /= 1) words = deck//': '//words
    n = count([(message(i:i) == new_line('a'), i=1, len(message))])
    if (n > 0) words = words//' (and '//to_text(n)//' more)'
  end function reason

  pure function without_slash(path) result(plain)
    character(*), intent(in) :: path
    character(:), allocatable :: plain

    plain = path
    do while (len(plain) > 1 .and. plain(len(plain):) == '/')
      plain = plain(:len(plain) - 1)
    end do
  end function without_slash

end module check_folder_mod
