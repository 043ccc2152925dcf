!> NLGEOM=AUTO: a run at small strain with shadow runs beside it, and where these say that small
!> strain is not enough, the run again at finite strain in its place.
!>
!> The result at small strain is set aside meanwhile, under its name with `.linear` behind it: where
!> the run at finite strain is refused or not solved it comes back.
module choose_theory_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t, raise, exit_not_solved, exit_wrong_input
  use text_mod, only: string_t, percent
  use fresh_file_mod, only: delete_file, move_file
  use scene_mod, only: scene_t
  use choices_mod, only: choices_t
  use command_line_mod, only: options_t
  use console_mod, only: console_t, say, print_warning
  use tally_mod, only: tally_t
  use result_file_mod, only: sidecars_of
  use result_claims_mod, only: is_of_finite_strain, is_result_of
  use output_names_mod, only: keep_inputs
  use prepare_scene_mod, only: prepare_scene, result_path
  use run_mesh_mod, only: run_mesh
  implicit none
  private

  public :: choose_theory

  real(wp), parameter :: usual = 0.01_wp
  !! what the theory may change where no accuracy is asked for [-]

contains

  !> Run the scene by small strain, and where that is not enough by finite strain.
  subroutine choose_theory(options, scene, choices, console, error)
    type(options_t), intent(in) :: options
    type(scene_t), intent(in) :: scene  !! at small strain
    type(choices_t), intent(in) :: choices
    type(console_t), intent(inout) :: console
    type(error_t), allocatable, intent(out) :: error
    !! as of run_mesh; an accuracy is asked for that neither theory reaches
    type(tally_t) :: tally
    character(:), allocatable :: path, kept
    real(wp) :: allowed
    logical :: goes_on

    path = result_path(options, scene)
    kept = ''
    allowed = usual
    if (scene%accuracy%wanted > 0.0_wp) allowed = scene%accuracy%wanted
    goes_on = .false.
    if (options%continues) then
      if (is_there(path)) goes_on = is_of_finite_strain(path)
      if (.not. is_there(path)) goes_on = is_there(set_aside(path))
    end if
    if (.not. options%plan) call keep_others(options, scene, path, goes_on, error)
    if (allocated(error)) return
    if (.not. goes_on) then
      call run_mesh(options, scene, choices, console, error, tally=tally)
      if (options%plan .or. (allocated(error) .and. tally%missed == 0)) return
      if (.not. tally%theory > allowed) return
      kept = why_kept(tally, allowed)
      if (kept == '') then
        if (allocated(error)) deallocate (error)
        call say('NLGEOM=AUTO: small strain '//trim(merge('is off by          ', &
          'may be off by up to', scene%accuracy%follows_theory))//' '//or_more(tally%theory)// &
          ', and '//percent(allowed)//' is allowed: the run begins again at finite strain')
        call move_result(path, set_aside(path), error)
        if (allocated(error)) return
      end if
    end if
    if (goes_on .or. kept == '') call run_finite(options, path, console, kept, error)
    if (kept == '') return
    call print_warning(console, 'NLGEOM=AUTO keeps small strain: '//kept)
    if (scene%accuracy%wanted > 0.0_wp .and. .not. allocated(error)) call raise(error, &
      exit_not_solved, 'accuracy '//percent(allowed)//' is not reached by small strain; the '// &
      'result is otherwise complete')
  end subroutine choose_theory

  !> The run at finite strain, in the place of the other result.
  subroutine run_finite(options, path, console, kept, error)
    type(options_t), intent(in) :: options
    character(*), intent(in) :: path
    type(console_t), intent(inout) :: console
    character(:), allocatable, intent(out) :: kept !! why the other result is back; '': it is not
    type(error_t), allocatable, intent(out) :: error !! stopped, or the machine failed
    type(options_t) :: finite_options
    type(scene_t) :: scene
    type(choices_t) :: choices
    type(tally_t) :: tally

    kept = ''
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
    kept = 'it is off by more than linear theory can say, and at finite strain '//error%message
    deallocate (error)
    if (.not. is_there(set_aside(path))) return
    call delete_result(path)
    call move_result(set_aside(path), path, error)
  end subroutine run_finite

  !> Why finite strain would be no better known, in words; '' where it would be.
  function why_kept(tally, allowed) result(why)
    type(tally_t), intent(in) :: tally
    real(wp), intent(in) :: allowed
    character(:), allocatable :: why

    why = ''
    if (tally%of_law(2) <= 0.0_wp .or. .not. tally%law > allowed) return
    ! Runs that are both lost say nothing of the law.
    if (.not. minval(tally%of_law) < huge(1.0_wp)) return
    why = 'which law holds at finite strain decides more than '//percent(allowed)//', and '// &
      '*ELASTIC does not say which: small strain is off by '//or_more(tally%of_law(1))//' with '// &
      'St Venant and Kirchhoff''s, by '//or_more(tally%of_law(2))//' with neo-Hooke''s. '// &
      '*HYPERELASTIC, NEO HOOKE or *ELASTIC, LAW=SVK says it'
  end function why_kept

  pure function or_more(error) result(words)
    real(wp), intent(in) :: error !! [-]
    character(:), allocatable :: words

    words = 'more than it can say'
    if (error < huge(1.0_wp)) words = percent(error)
  end function or_more

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
