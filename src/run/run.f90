!> A run of a deck, from the command line to its end.
module run_mod
  use errors_mod, only: error_t, raise, exit_machine, exit_wrong_input
  use text_mod, only: string_t
  use standard_streams_mod, only: standard_output, write_most
  use folders_mod, only: is_folder
  use mesh_size_mod, only: mesh_size_t
  use choices_mod, only: choices_t
  use controls_mod, only: chooses_mesh
  use scene_mod, only: scene_t
  use read_deck_mod, only: read_deck
  use check_folder_mod, only: check_folder
  use command_line_mod, only: as_asked, options_t
  use console_mod, only: console_t, open_console, say, print_lines
  use prepare_scene_mod, only: prepare_scene
  use run_mesh_mod, only: run_mesh
  use choose_theory_mod, only: choose_theory, choose_theory_and_mesh
  use reach_accuracy_mod, only: reach_accuracy, search_t
  use version_mod, only: version
  implicit none
  private

  public :: run_deck

contains

  !> Read the deck, plan, and unless only the plan is wanted, run: on the mesh that is given, or on
  !> those that it takes to reach an accuracy or to use the time and memory that are allowed.
  subroutine run_deck(options, error)
    type(options_t), intent(in) :: options
    type(error_t), allocatable, intent(out) :: error
    !! wrong deck, nothing solved, the accuracy not reached, or the machine failed
    type(scene_t) :: scene
    type(choices_t) :: choices
    type(search_t) :: search
    type(console_t) :: console
    character(:), allocatable :: title

    if (is_folder(options%deck)) then
      if (options%check) then
        call check_folder(options, error)
      else
        call raise(error, exit_wrong_input, "bipot: error: '"//options%deck//"' is a folder; "// &
          'name a deck (--check prints which decks of a folder are accepted)')
      end if
      return
    end if
    if (options%flat) then
      call print_flat(options, error)
      return
    end if
    console = open_console(options%quiet, options%verbose)
    choices%mesh_size = mesh_size_t(parts=2**max(0, options%refine))
    call prepare_scene(options, scene, choices, error)
    if (allocated(error) .or. options%check) return
    title = scene%title
    if (len(title) == 0) title = options%deck
    if (.not. console%quiet) call say('bipot '//version//': '//title)
    call print_lines(console, scene%notes, 'note: ')
    if (chooses_mesh(scene%accuracy) .and. scene%accuracy%chooses_theory) then
      call choose_theory_and_mesh(options, scene, console, error)
    else if (chooses_mesh(scene%accuracy)) then
      call reach_accuracy(options, scene, console, '', search, error)
    else if (scene%accuracy%chooses_theory) then
      call choose_theory(options, scene, choices, console, error)
    else
      call run_mesh(options, scene, choices, console, error)
    end if
  end subroutine run_deck

  !> Print the deck without includes, parameters and blocks.
  subroutine print_flat(options, error)
    type(options_t), intent(in) :: options
    type(error_t), allocatable, intent(out) :: error
    type(scene_t) :: scene
    type(string_t) :: flat
    integer :: written

    call read_deck(options%deck, options%overrides, scene, error, flat=flat, &
      reading=as_asked(options, options%nlgeom))
    if (allocated(error)) return
    call write_most(standard_output, flat%text, written)
    if (written < len(flat%text)) call raise(error, exit_machine, &
      'bipot: error: standard output did not take all of the deck; is the disk full?')
  end subroutine print_flat

end module run_mod
