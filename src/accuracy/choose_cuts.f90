!> How often the elements at contact are to be cut ahead of all others: tried on a coarse mesh,
!> where a run is cheap, and judged by one whose elements are all of half the size.
!>
!> What one cut there misses of this is the part of the mesh that is far from contact; what another
!> cut changes is the part at contact. Where that is little, the runs on this mesh say how wrong the
!> last one is. If it is not enough, all elements get smaller together, those at contact so many
!> cuts ahead: the errors of such runs fall with the size of all elements as they do without cuts,
!> and are estimated likewise.
!>
!> docs/theory.md section 10.
module choose_cuts_mod
  use kinds_mod, only: wp
  use measured_quantities_mod, only: error_scales
  use convergence_mod, only: convergence_t
  use mesh_sequence_mod, only: mesh_sequence_t, distance
  use cut_runs_mod, only: find_base, run_on_base, is_in_few_places
  use sequence_error_mod, only: estimate_cuts
  implicit none
  private

  public :: choose_cuts

  integer, parameter :: most_cuts = 6
  real(wp), parameter :: enough = 0.5_wp
  !! of what elements of half the size change, that those far from contact may have a part in: then
  !! those at contact make the most of it, (10.14) [-]
  real(wp), parameter :: little = 0.25_wp
  !! of the accuracy, that a cut changes: of the first order all cuts after it make as much [-]
  real(wp), parameter :: for_near = 0.5_wp  !! of the accuracy, for the elements at contact [-]

contains

  !> The cuts that pay, as far as runs have shown; or a run that shows more.
  pure subroutine choose_cuts(sequence, divisions, cuts, next, base)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: divisions !! of the deck's increments, of the runs
    integer, intent(out) :: cuts     !! 0: none
    integer, intent(out) :: next     !! cuts to be tried; 0: none
    integer, intent(out) :: base     !! on the mesh of this run
    real(wp) :: far, at_contact
    integer :: half, before, now

    cuts = 0
    next = 0
    call find_base(sequence, divisions, base, half)
    if (base == 0) return
    before = base
    far = 0.0_wp
    do
      if (.not. is_in_few_places(sequence%runs(before)%near)) return
      now = run_on_base(sequence, divisions, base, cuts + 1)
      if (now == 0) then
        next = cuts + 1
        return
      end if
      at_contact = distance(sequence, before, now)
      if (cuts == 0) then
        far = distance(sequence, now, half)
        if (far > enough*distance(sequence, base, half)) return
      end if
      cuts = cuts + 1
      if (cuts == most_cuts) return
      if (cuts == 1) then
        if (at_contact <= max(far, little*sequence%wanted)) return
      else
        if (is_resolved(now)) return
      end if
      before = now
    end do

  contains

    !> Whether the elements at contact leave little error, or less than all others.
    pure logical function is_resolved(run)
      integer, intent(in) :: run
      type(convergence_t), allocatable :: near(:)
      real(wp), allocatable :: of_far(:)
      integer, allocatable :: n_rising(:)

      call estimate_cuts(sequence, run, error_scales(sequence%list, sequence%runs(run)%values), &
        near, of_far, n_rising)
      is_resolved = maxval(near%error) <= max(maxval(of_far), for_near*sequence%wanted)
    end function is_resolved

  end subroutine choose_cuts

end module choose_cuts_mod
