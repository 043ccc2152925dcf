!> A deck and what the command line says beside it, as a scene that may be planned and run.
module prepare_scene_mod
  use kinds_mod, only: wp, i8
  use errors_mod, only: error_t
  use text_mod, only: string_t, to_text
  use parallel_mod, only: n_ranks
  use cell_cuts_mod, only: can_be_cut
  use cells_mod, only: cells
  use fresh_file_mod, only: beginning_of
  use controls_mod, only: accuracy_of_energy, chooses_mesh, is_bounded, &
    subjects
  use loads_mod, only: start_of_step
  use kinks_mod, only: find_kinks, followed_amplitudes
  use scene_mod, only: scene_t
  use finite_strain_limits_mod, only: beyond_finite_strain
  use dynamic_limits_mod, only: beyond_dynamics
  use shadow_run_mod, only: has_no_shadow
  use take_as_rigid_mod, only: take_as_rigid
  use mirror_scene_mod, only: part_in_words, take_half
  use choices_mod, only: choices_t
  use read_deck_mod, only: read_deck
  use meet_accuracy_mod, only: set_contact_tolerance
  use output_names_mod, only: keep_inputs, output_name
  use result_file_mod, only: sidecars_of
  use command_line_mod, only: as_asked, options_t, refuse_option
  implicit none
  private

  public :: prepare_scene, result_path

  real(wp), parameter :: told_at_best = 0.01_wp !! error of a run that time or memory bounds [-]

contains

  !> Read the deck on the mesh that is chosen, and take the options.
  subroutine prepare_scene(options, scene, choices, error, follows_theory)
    type(options_t), intent(in) :: options
    type(scene_t), intent(out) :: scene
    type(choices_t), intent(inout) :: choices !! mesh and divisions in; gets what the deck says
    type(error_t), allocatable, intent(out) :: error
    !! mistakes of the deck; options that do not fit it; the result would replace the deck
    logical, intent(in), optional :: follows_theory !! the run estimates the error of its theory

    call read_deck(options%deck, options%overrides, scene, error, in_lines=options%check, &
      mesh_size=choices%mesh_size, reading=as_asked(options, merge(options%chosen, &
      options%nlgeom, options%chosen /= '')))
    if (allocated(error) .or. options%check) return
    ! Such a run tries out what the deck's increments are worth, whether or not the result keeps
    ! them.
    if (choices%divisions > 1) scene%steps%direct = scene%steps%direct .and. &
      scene%steps%is_dynamic
    if (.not. options%plan) call keep_deck(options, scene, error)
    if (allocated(error)) return
    if (present(follows_theory)) scene%accuracy%follows_theory = &
      scene%accuracy%follows_theory .or. follows_theory
    call take_options(options, scene, error)
    choices%tolerance = scene%contact%tolerance
    choices%compliance = scene%contact%compliance
    choices%precision = scene%precision
    call set_contact_tolerance(scene, choices%divisions, choices%tolerance)
  end subroutine prepare_scene

  !> The accuracy of the command line wins over the deck's; what changes the result is kept with
  !> the deck's parameters.
  subroutine take_options(options, scene, error)
    type(options_t), intent(in) :: options
    type(scene_t), intent(inout) :: scene
    type(error_t), allocatable, intent(out) :: error
    !! an accuracy is wanted or to be as good as time and memory allow, and the deck leaves out the
    !! estimates that it takes; or strains are finite
    character(:), allocatable :: beyond

    if (options%accuracy > 0.0_wp) scene%accuracy%wanted = options%accuracy
    if (options%extrapolated) scene%accuracy%extrapolates = .true.
    scene%stops_when_steady = options%until_steady
    scene%accuracy%time = options%time
    scene%accuracy%memory = options%memory
    if (scene%finite_strain) then
      ! What the deck itself asks for was refused where it was read.
      beyond = beyond_finite_strain(scene)
      if (beyond /= '') call refuse_option('NLGEOM does not cover '//beyond// &
        '; --nlgeom no runs the deck by small strain', error)
      if (allocated(error)) return
    end if
    ! Without contact there are no resultants to compare.
    if (is_bounded(scene%accuracy) .and. scene%accuracy%wanted <= 0.0_wp .and. &
      size(scene%pairs) == 0) scene%accuracy%of = accuracy_of_energy
    call take_mesh()
    if (.not. allocated(error)) call check_inertia()
    if (.not. allocated(error)) call take_rigid()
    if (.not. allocated(error)) call take_symmetry()
    if (allocated(error)) return
    call check_mesh_choice()
    if (allocated(error)) return
    if (scene%accuracy%wanted > 0.0_wp .or. is_bounded(scene%accuracy)) then
      ! Runs that go across the same turns are alike for that.
      scene%steps%ends_at_all_kinks = .true.
      call check_paths(scene, error)
      if (allocated(error)) return
    end if
    if (options%theory) call keep('--theory')
    associate (accuracy => scene%accuracy)
      accuracy%chooses_theory = accuracy%chooses_theory .or. (accuracy%wanted > 0.0_wp .and. &
        .not. (scene%finite_strain .or. accuracy%keeps_small_strain .or. &
        any(scene%steps%is_dynamic)))
      ! Coarse meshes say whether it takes an estimate where there are several.
      accuracy%follows_theory = accuracy%follows_theory .or. options%theory .or. &
        (accuracy%chooses_theory .and. .not. chooses_mesh(accuracy))
    end associate
    call check_shadow()
    if (options%elastic) call keep('--elastic')
    if (options%static_steps) call keep('--static-steps')
    if (options%nlgeom == 'NO') call keep('--nlgeom no')
    if (options%nlgeom == 'YES') call keep('--nlgeom yes')
    if (options%nlgeom == 'AUTO') call keep('--nlgeom auto')
    if (options%accuracy > 0.0_wp) call keep('--accuracy '//to_text(options%accuracy))
    if (options%extrapolated) call keep('--extrapolated')
    if (options%time > 0.0_wp) call keep('--time '//to_text(options%time))
    if (options%memory > 0.0_wp) call keep('--memory '//to_text(1.0e-6_wp*options%memory)//'MB')

  contains

    !> --refine, and whether --extrapolated has several meshes.
    subroutine take_mesh()
      associate (accuracy => scene%accuracy)
        if (options%refine > 0 .or. (options%refine == 0 .and. (accuracy%wanted > 0.0_wp .or. &
          is_bounded(accuracy)))) then
          call keep('--refine '//to_text(options%refine))
          accuracy%keeps_mesh = .true.
          if (accuracy%wanted > 0.0_wp .and. .not. subjects(accuracy%of)%is_recovered) call &
            refuse_option('--refine keeps the mesh, and on one mesh only the errors of '// &
            'RESULTANTS and ENERGY are estimated', error)
          if (allocated(error)) return
        end if
        if (accuracy%extrapolates .and. accuracy%keeps_mesh) then
          call refuse_option('--refine keeps the mesh, and values are extrapolated from several', &
            error)
        else if (options%extrapolated .and. .not. chooses_mesh(accuracy)) then
          call refuse_option('--extrapolated says which values an accuracy is of, and none is '// &
            'asked for: --accuracy X', error)
        end if
      end associate
    end subroutine take_mesh

    !> Refuse what dynamic steps do not cover. What the deck itself asks for was refused where it
    !> was read.
    subroutine check_inertia()
      beyond = beyond_dynamics(scene)
      if (beyond == '' .and. any(scene%steps%is_dynamic)) then
        if (options%symmetry) beyond = '--symmetry'
        if (size(options%rigid) > 0) beyond = '--as-rigid'
        if (n_ranks() > 1) beyond = 'several ranks'
      end if
      if (beyond /= '') call refuse_option('*DYNAMIC does not cover '//beyond, error)
    end subroutine check_inertia

    !> Refuse what an accuracy that chooses the mesh does not cover, and estimates that the deck
    !> leaves out.
    subroutine check_mesh_choice()
      character(:), allocatable :: option

      option = ''
      if (chooses_mesh(scene%accuracy)) then
        if (options%until_steady) then
          call refuse_option('--until-steady takes a mesh that is kept (--refine 0; *ACCURACY, '// &
            'MESH=KEEP): runs on several meshes are compared increment by increment', error)
          return
        end if
        associate (cell => scene%mesh%connectivity%cell)
          if (.not. all(can_be_cut(cell))) then
            call refuse_option('an accuracy chooses the mesh, and a '//trim(cells(cell(findloc( &
              can_be_cut(cell), .false., dim=1)))%name)//' cannot be refined: keep it by '// &
              '*ACCURACY, MESH=KEEP or --refine 0', error)
            return
          end if
        end associate
        if (options%memory > 0.0_wp) option = '--memory'
        if (options%time > 0.0_wp) option = '--time'
      end if
      ! Bounds of a run on a mesh that is kept take no estimates.
      if (options%accuracy > 0.0_wp) option = '--accuracy'
      if (.not. scene%accuracy%estimates .and. option /= '') call refuse_option(option// &
        ' takes the estimates that the deck leaves out by *ACCURACY, ESTIMATE=NO', error)
    end subroutine check_mesh_choice

    !> Make obstacles of bodies, one after the other.
    subroutine take_rigid()
      character(:), allocatable :: names
      integer :: i

      names = ''
      do i = 1, size(options%rigid)
        call take_as_rigid(scene, options%rigid(i)%text, error)
        if (allocated(error)) return
        if (i > 1) names = names//','
        names = names//options%rigid(i)%text
      end do
      if (names /= '') call keep('--as-rigid '//names)
    end subroutine take_rigid

    !> Keep one side of each plane of symmetry.
    subroutine take_symmetry()
      character(:), allocatable :: planes
      type(string_t) :: note

      if (.not. options%symmetry) return
      call take_half(scene, planes)
      if (planes == '') then
        call refuse_option('--symmetry: mesh, supports, loads, pairs and obstacles are not '// &
          'their own mirror image across x, y or z, to rounding, with a plane that cuts no '// &
          'element', error)
        return
      end if
      note%text = '--symmetry: '//part_in_words(planes)//' of the scene is run and written, '// &
        'before '//planes//': forces and energies are those of this part'
      scene%notes = [scene%notes, note]
      if (scene%finite_strain) then
        note%text = '--symmetry with NLGEOM: buckling that is not symmetric about '//planes// &
          ' is not seen'
        scene%notes = [scene%notes, note]
      end if
      call keep('--symmetry')
    end subroutine take_symmetry

    !> Bound the error of the theory where no run at finite strain can go beside the linear one.
    subroutine check_shadow()
      character(:), allocatable :: why
      type(string_t) :: note

      if (.not. scene%accuracy%follows_theory .or. scene%finite_strain) return
      why = has_no_shadow(scene)
      if (why == '') return
      scene%accuracy%follows_theory = .false.
      note%text = 'the error of small strain is bounded, not estimated: NLGEOM does not '// &
        'cover '//why
      scene%notes = [scene%notes, note]
    end subroutine check_shadow

    subroutine keep(option)
      character(*), intent(in) :: option

      if (scene%overrides /= '') scene%overrides = scene%overrides//new_line('a')
      scene%overrides = scene%overrides//option
    end subroutine keep

  end subroutine take_options

  !> Refuse amplitudes that turn too often for increments to end wherever they do: no runs tell
  !> what that makes.
  subroutine check_paths(scene, error)
    type(scene_t), intent(in) :: scene
    type(error_t), allocatable, intent(out) :: error
    integer(i8), allocatable :: kinks(:)
    logical :: is_followed(size(scene%amplitudes))
    real(wp) :: missed, wanted
    integer :: step, k

    wanted = scene%accuracy%wanted
    if (wanted <= 0.0_wp) wanted = told_at_best
    do step = 1, size(scene%steps)
      is_followed = followed_amplitudes(scene%amplitudes, scene%steps, step)
      do k = 1, size(is_followed)
        if (.not. is_followed(k)) cycle
        call find_kinks(scene%amplitudes(k:k), scene%steps(step), kinks, start_of_step( &
          scene%steps, step), missed)
        if (missed <= wanted) cycle
        call refuse_option('step '//to_text(step)//': amplitude '''//scene%amplitudes(k)%name// &
          ''' turns more often than increments can end, which is 4096 times in one of the '// &
          'deck: no accuracy can be reached for certain; give the step smaller increments', error)
        return
      end do
    end do
  end subroutine check_paths

  !> Where the result goes.
  function result_path(options, scene) result(path)
    type(options_t), intent(in) :: options
    type(scene_t), intent(in) :: scene
    character(:), allocatable :: path

    path = output_name(options%output, scene%name//'.vtkhdf', '.vtkhdf')
  end function result_path

  !> Refuse to write a result, its beginning or its sidecars in the place of the deck.
  subroutine keep_deck(options, scene, error)
    type(options_t), intent(in) :: options
    type(scene_t), intent(in) :: scene
    type(error_t), allocatable, intent(out) :: error
    type(string_t) :: outputs(2)
    type(string_t), allocatable :: sidecars(:) ! by a name, for gfortran does not free a result

    outputs(1)%text = result_path(options, scene)
    outputs(2)%text = beginning_of(outputs(1)%text)
    sidecars = sidecars_of(outputs(1)%text)
    call keep_inputs(scene%files, [outputs, sidecars], error)
  end subroutine keep_deck

end module prepare_scene_mod
