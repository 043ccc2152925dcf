!> What lessens the largest part of a run's error, and what it would take.
module name_knob_mod
  use kinds_mod, only: wp
  use text_mod, only: percent, string_t
  use system_mod, only: cpu_seconds
  use cells_mod, only: tetrahedron_4
  use mesh_mod, only: solids
  use mesh_draft_mod, only: names_of_planes
  use scene_mod, only: scene_t
  use warming_mod, only: warms
  use amounts_mod, only: time_in_words
  use linearisation_mod, only: sum_of
  use bending_stiffness_mod, only: parasitic_share
  use tally_mod, only: tally_t
  use checkpoint_mod, only: progress_t, not_known
  use console_mod, only: console_t, print_lines
  implicit none
  private

  public :: name_knob, geometry_in_words

  real(wp), parameter :: worth_naming = 0.01_wp
  !! of the force: constants of materials and friction are hardly known better [-]

contains

  !> One line, unless quiet: the part of the error that is largest, and what lessens it, with the
  !> time that it takes. docs/errors.md.
  subroutine name_knob(scene, progress, console)
    type(scene_t), intent(in) :: scene
    type(progress_t), intent(in) :: progress !! at the end of the run
    type(console_t), intent(in) :: console
    character(:), allocatable :: words
    real(wp) :: geometry(3), largest

    geometry = min(1.0_wp, progress%geometry)
    if (any(progress%geometry >= not_known)) geometry = 0.0_wp
    associate (steps => progress%tally%load_steps, mesh => progress%tally%mesh)
      largest = max(steps, mesh, sum(geometry))
      if (largest < worth_naming) return
      ! Of no force nothing is a part.
      if (size(scene%pairs) > 0 .and. .not. any(abs(progress%state%reaction) > 0.0_wp)) return
      ! Of small strain another note says what lessens it.
      if (progress%tally%follows_theory > 0 .and. progress%tally%theory > largest) return
      if (mesh >= largest) then
        words = 'the mesh''s ('//percent(mesh)//'): '//finer_meshes(scene, progress, mesh)
      else if (steps >= largest) then
        words = 'the load steps'' ('//percent(steps)//'): increments half as long take about '// &
          seconds_of(scene, progress%tally, 1.0_wp, 2)
      else
        words = 'that of geometry: '//geometry_in_words(geometry, 0.5_wp*maxval(geometry))
      end if
    end associate
    call print_lines(console, [string_t('the largest known part of the error is '//words)], &
      'note: ')
  end subroutine name_knob

  !> What faces that are entered between their nodes, edges within faces, and facets make of the
  !> error, where it is above a bound, and what lessens each; else ''.
  function geometry_in_words(geometry, least) result(words)
    real(wp), intent(in) :: geometry(3) !! of these, at most 1 [-]
    real(wp), intent(in) :: least       !! that is named [-]
    character(:), allocatable :: words

    words = ''
    if (geometry(2) > least) words = '; edges of a body inside faces of the other make '// &
      percent(geometry(2))//': align the mesh, so that edges of elements lie along them'
    if (geometry(1) > least) words = words//'; faces that are entered between their nodes make '// &
      percent(geometry(1))//': smaller elements at contact, or meshes that match, lessen it'
    if (geometry(3) > least) words = words//'; flat faces that stand for arcs make '// &
      percent(geometry(3))//': more faces along the arcs, or elements of second order, lessen '// &
      'it; ADJUST=0 of *CONTACT PAIR closes gaps that the bodies do not have'
    words = words(min(len(words), 2) + 1:)
  end function geometry_in_words

  !> Another type of element where it is known to do better, and smaller elements.
  function finer_meshes(scene, progress, error) result(words)
    type(scene_t), intent(in) :: scene
    type(progress_t), intent(in) :: progress
    real(wp), intent(in) :: error !! by the mesh [-]
    character(:), allocatable :: words, worse, better
    real(wp), parameter :: much = 0.1_wp !! of the strain energy, and so of the stiffness [-]
    real(wp) :: share

    words = '--refine 1 takes about '//seconds_of(scene, progress%tally, 2.0_wp, 1)
    associate (cell => scene%mesh%connectivity%cell, plane => scene%mesh%plane)
      if (2*count(cell == tetrahedron_4) > size(cell)) then
        words = 'C3D10 in place of C3D4 on the same elements takes no longer than --refine 1; '// &
          words
        return
      end if
      if (scene%finite_strain .or. warms(scene)) return
      ! Worth naming where it changes the best part of what is wrong, or much.
      share = parasitic_share(scene%mesh, scene%materials, progress%state%displacement)
      if (share <= min(0.5_wp*error, much)) return
      worse = 'C3D8'
      better = 'C3D8I'
      if (plane /= solids) then
        worse = names_of_planes(plane)//'4'
        better = names_of_planes(plane)//'4I'
      end if
      words = worse//' bends too stiffly ('//percent(share)//' of its strain energy): '//better// &
        ' takes about '//seconds_of(scene, progress%tally, 1.0_wp, 1)//'; '//words
    end associate
  end function finer_meshes

  !> What the run took, with elements so many times smaller and so many times as many increments:
  !> operations of the factor grow with its equations to the power 5/3 (3/2 in a plane), all else
  !> with them.
  function seconds_of(scene, tally, finer, divisions) result(words)
    type(scene_t), intent(in) :: scene
    type(tally_t), intent(in) :: tally
    real(wp), intent(in) :: finer
    integer, intent(in) :: divisions
    character(:), allocatable :: words
    real(wp), parameter :: start = 0.03_wp !! of the program, whatever it runs [s]
    real(wp) :: spent, factor, rest
    integer :: axes

    ! Of sessions that this one continues only the clock is known.
    spent = tally%earlier_time + cpu_seconds()
    axes = merge(3, 2, scene%mesh%plane == solids)
    associate (work => sum_of(tally%work, tally%on_tangents))
      factor = min(work%factorise, spent)
    end associate
    rest = max(0.0_wp, spent - factor - start)
    words = time_in_words(start + factor*finer**(2*axes - 1) + rest*divisions*finer**axes)// &
      ' of CPU time'
  end function seconds_of

end module name_knob_mod
