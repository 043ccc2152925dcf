!> NLGEOM=AUTO, and accuracies of decks that do not say NLGEOM: a run at small strain with shadow
!> runs beside it, and where these say that small strain is not enough, the run again at finite
!> strain in its place.
!>
!> On a mesh that is kept the result at small strain is set aside meanwhile, under its name with
!> `.linear` behind it: where the run at finite strain is refused or not solved it comes back.
module choose_theory_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t, raise, exit_not_solved, exit_wrong_input, exit_machine
  use text_mod, only: string_t, percent
  use fresh_file_mod, only: delete_file, move_file
  use controls_mod, only: allowed_error
  use scene_mod, only: scene_t
  use choices_mod, only: choices_t
  use command_line_mod, only: options_t
  use console_mod, only: console_t, say, print_warning
  use tally_mod, only: tally_t, theory_of
  use theory_of_runs_mod, only: run_theory_t, is_known_at_finite_strain
  use result_file_mod, only: sidecars_of
  use result_claims_mod, only: theory_in_file, is_result_of
  use output_names_mod, only: keep_inputs
  use prepare_scene_mod, only: prepare_scene, result_path
  use run_mesh_mod, only: run_mesh
  use judge_theory_mod, only: why_kept, off_in_words
  use reach_accuracy_mod, only: reach_accuracy, search_t
  implicit none
  private

  public :: choose_theory, choose_theory_and_mesh

contains

  !> Run the scene by small strain, and where that is not enough by finite strain: on the deck's
  !> mesh.
  subroutine choose_theory(options, scene, choices, console, error)
    type(options_t), intent(in) :: options
    type(scene_t), intent(in) :: scene  !! at small strain
    type(choices_t), intent(in) :: choices
    type(console_t), intent(inout) :: console
    type(error_t), allocatable, intent(out) :: error
    !! as of run_mesh; an accuracy is asked for that neither theory reaches
    type(tally_t) :: tally
    type(run_theory_t) :: theory !! what small strain leaves out
    character(:), allocatable :: path, tried
    real(wp) :: allowed
    logical :: goes_on, is_lost

    path = result_path(options, scene)
    allowed = allowed_error(scene%accuracy%wanted)
    goes_on = .false.
    if (options%continues) then
      if (is_there(path)) goes_on = theory_in_file(path) == 'finite strain'
      if (.not. is_there(path)) goes_on = is_there(set_aside(path))
    end if
    if (.not. options%plan) call keep_others(options, scene, path, goes_on, error)
    if (allocated(error)) return
    ! Of a run that goes on at finite strain this is all that is known.
    theory = run_theory_t(huge(1.0_wp), .true.)
    tried = ''
    if (.not. goes_on) then
      call run_mesh(options, scene, choices, console, error, tally=tally)
      if (options%plan .or. (allocated(error) .and. tally%missed == 0)) return
      theory = theory_of(tally)
      is_lost = theory%error > allowed
      ! The sum of all sources counts where an accuracy is asked for.
      if (scene%accuracy%wanted > 0.0_wp .and. .not. allocated(error)) is_lost = &
        tally%with_theory > allowed
      if (.not. is_lost) return
    end if
    if (goes_on .or. is_known_at_finite_strain(theory, allowed)) then
      if (allocated(error)) deallocate (error)
      if (.not. goes_on) then
        call say_change(scene, theory)
        call move_result(path, set_aside(path), error)
        if (allocated(error)) return
      end if
      call run_finite(options, path, console, tried, error)
      if (tried == '') return
    end if
    call print_warning(console, 'the run keeps small strain: '//why_kept(theory, allowed, tried))
    if (scene%accuracy%wanted > 0.0_wp .and. .not. allocated(error)) call raise(error, &
      exit_not_solved, 'accuracy '//percent(allowed)//' is not reached by small strain; '// &
      'the result is otherwise complete')
  end subroutine choose_theory

  !> The same on the meshes that an accuracy, or time and memory, take. Where finite strain is
  !> refused or not solved, those at small strain are begun anew: they keep no result meanwhile.
  subroutine choose_theory_and_mesh(options, scene, console, error)
    type(options_t), intent(in) :: options
    type(scene_t), intent(in) :: scene !! of the deck as written, at small strain
    type(console_t), intent(in) :: console
    type(error_t), allocatable, intent(out) :: error !! as of reach_accuracy
    type(options_t) :: of_runs
    type(scene_t) :: finite
    type(choices_t) :: choices
    type(search_t) :: search, at_finite_strain
    character(:), allocatable :: path, tried
    logical :: goes_on

    path = result_path(options, scene)
    goes_on = .false.
    if (options%continues) then
      if (is_there(path)) goes_on = theory_in_file(path) == 'finite strain'
    end if
    of_runs = options
    if (.not. goes_on) then
      call reach_accuracy(of_runs, scene, console, '', search, error)
      if (allocated(error) .or. .not. search%leaves_small_strain) return
      call say_change(scene, search%theory)
      of_runs%continues = .false.
      of_runs%overwrite = .true. ! what stands there is a run of ours
    end if
    of_runs%chosen = 'YES'
    call prepare_scene(of_runs, finite, choices, error)
    if (.not. allocated(error)) then
      call reach_accuracy(of_runs, finite, console, '', at_finite_strain, error)
      if (at_finite_strain%is_complete .or. .not. allocated(error)) return
      if (all(error%exit_status /= [exit_not_solved, exit_machine])) return
    end if
    of_runs%chosen = ''
    of_runs%continues = .false.
    of_runs%overwrite = .true.
    tried = error%message
    deallocate (error)
    call print_warning(console, 'the runs go back to small strain: at finite strain '//tried)
    call reach_accuracy(of_runs, scene, console, tried, search, error)
  end subroutine choose_theory_and_mesh

  !> Say that finite strain takes the place of small strain.
  subroutine say_change(scene, theory)
    type(scene_t), intent(in) :: scene
    type(run_theory_t), intent(in) :: theory

    call say('small strain '//off_in_words(theory)//', and '//percent(allowed_error( &
      scene%accuracy%wanted))//' is allowed'//trim(merge(' for all errors', repeat(' ', 15), &
      scene%accuracy%wanted > 0.0_wp))//': the run begins again at finite strain')
  end subroutine say_change

  !> The run at finite strain, in the place of the other result.
  subroutine run_finite(options, path, console, tried, error)
    type(options_t), intent(in) :: options
    character(*), intent(in) :: path
    type(console_t), intent(inout) :: console
    character(:), allocatable, intent(out) :: tried !! why the other result is back; '': it is not
    type(error_t), allocatable, intent(out) :: error !! stopped, or the machine failed
    type(options_t) :: finite_options
    type(scene_t) :: scene
    type(choices_t) :: choices
    type(tally_t) :: tally

    tried = ''
    finite_options = options
    finite_options%chosen = 'YES'
    choices%mesh_size%parts = 2**max(0, options%refine)
    call prepare_scene(finite_options, scene, choices, error)
    if (.not. allocated(error)) then
      call run_mesh(finite_options, scene, choices, console, error, tally=tally)
      if (.not. allocated(error) .or. tally%missed > 0) then
        call delete_result(set_aside(path))
        return
      end if
      if (error%exit_status /= exit_not_solved) return
    end if
    tried = error%message
    deallocate (error)
    if (.not. is_there(set_aside(path))) return
    call delete_result(path)
    call move_result(set_aside(path), path, error)
  end subroutine run_finite

  !> Refuse to run where what stands at the place of the result that is set aside is not ours: it
  !> would be replaced, and deleted in the end.
  subroutine keep_others(options, scene, path, goes_on, error)
    type(options_t), intent(in) :: options
    type(scene_t), intent(in) :: scene   !! at small strain
    character(*), intent(in) :: path     !! of the result
    logical, intent(in) :: goes_on       !! the run at finite strain had begun
    type(error_t), allocatable, intent(out) :: error
    type(string_t), allocatable :: files(:)
    logical :: is_ours
    integer :: i

    files = beside(set_aside(path))
    call keep_inputs(scene%files, files, error)
    if (allocated(error) .or. options%overwrite) return
    is_ours = goes_on
    if (is_ours) is_ours = is_there(set_aside(path))
    if (is_ours) is_ours = is_result_of(set_aside(path), scene)
    if (is_ours) return
    do i = size(files), 1, -1
      if (.not. is_there(files(i)%text)) cycle
      call raise(error, exit_wrong_input, "'"//files(i)%text//"' is there, and NLGEOM=AUTO "// &
        'needs the name: move it, or write another file by -o FILE (--overwrite replaces it)')
      return
    end do
  end subroutine keep_others

  pure function set_aside(path) result(aside)
    character(*), intent(in) :: path
    character(:), allocatable :: aside

    aside = path//'.linear'
  end function set_aside

  logical function is_there(path)
    character(*), intent(in) :: path

    inquire (file=path, exist=is_there)
  end function is_there

  !> Move a result and what stands beside it. Sidecars keep their names but for an ending.
  subroutine move_result(from, to, error)
    character(*), intent(in) :: from, to
    type(error_t), allocatable, intent(out) :: error !! the folder does not let it
    type(string_t), allocatable :: here(:), there(:)
    integer :: i

    here = beside(from)
    there = beside(to)
    do i = 1, size(here)
      if (is_there(here(i)%text)) call move_file(here(i)%text, there(i)%text, error)
      if (allocated(error)) return
    end do
  end subroutine move_result

  subroutine delete_result(path)
    character(*), intent(in) :: path
    type(string_t), allocatable :: files(:)
    integer :: i

    files = beside(path)
    do i = 1, size(files)
      call delete_file(files(i)%text)
    end do
  end subroutine delete_result

  !> Sidecars first, the result last: where it is, all of it is.
  function beside(path) result(files)
    character(*), intent(in) :: path !! of a result, or where it is set aside
    type(string_t), allocatable :: files(:)
    character(:), allocatable :: ending
    integer :: i, n

    n = len(path)
    ending = ''
    if (n > 7) then
      if (path(n - 6:) == '.linear') ending = '.linear'
    end if
    files = sidecars_of(path(:n - len(ending)))
    do i = 1, size(files)
      files(i)%text = files(i)%text//ending
    end do
    files = [files, string_t(path)]
  end function beside

end module choose_theory_mod
