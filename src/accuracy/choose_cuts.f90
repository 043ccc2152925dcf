!> How often the bricks at contact are to be cut ahead of all others: tried on a coarse mesh, where
!> a run is cheap, and judged by one whose bricks are all of half the size.
!>
!> What one cut there misses of this is the part of the mesh that is far from contact; what another
!> cut changes is the part at contact. All bricks then get smaller together, those at contact so
!> many cuts ahead: the errors of such runs fall with the size of all bricks as they do without
!> cuts, and are estimated likewise.
!>
!> docs/theory.md section 10.
module choose_cuts_mod
  use kinds_mod, only: wp
  use mesh_size_mod, only: relative_size
  use measured_quantities_mod, only: error_scales
  use mesh_sequence_mod, only: mesh_sequence_t, family_t, mesh_runs, change
  implicit none
  private

  public :: choose_cuts

  integer, parameter :: most_cuts = 4
  real(wp), parameter :: most_near = 0.3_wp
  !! of the bricks at contact: where there are more, cutting all of them costs little more [-]
  real(wp), parameter :: about_half = 0.55_wp !! of a size [-]
  real(wp), parameter :: enough = 0.5_wp
  !! of what bricks of half the size change, that those far from contact may have a part in [-]
  real(wp), parameter :: little = 0.25_wp !! of the accuracy [-]

contains

  !> The cuts that pay, as far as runs have shown; or a run that shows more.
  pure subroutine choose_cuts(sequence, divisions, cuts, next, base)
    type(mesh_sequence_t), intent(in) :: sequence !! three meshes without cuts at least
    integer, intent(in) :: divisions              !! of the deck's increments, of the runs
    integer, intent(out) :: cuts                  !! 0: none
    integer, intent(out) :: next                  !! cuts to be tried; 0: none
    integer, intent(out) :: base                  !! on the mesh of this run
    real(wp) :: far, at_contact
    integer :: half, before, now

    cuts = 0
    next = 0
    call find_base(sequence, divisions, base, half)
    if (base == 0) return
    before = base
    far = 0.0_wp
    do
      ! A run with one cut more costs no more than the largest so far.
      associate (run => sequence%runs(before), most => 2.0_wp*maxval(sequence%runs%equations))
        if (run%equations*(1.0_wp + 7.0_wp*run%near) > most) return
      end associate
      now = run_on_base(cuts + 1)
      if (now == 0) then
        next = cuts + 1
        return
      end if
      at_contact = distance(before, now)
      if (cuts == 0) then
        far = distance(now, half)
        if (far > enough*distance(base, half)) return
      end if
      cuts = cuts + 1
      if (at_contact <= max(far, little*sequence%wanted) .or. cuts == most_cuts) return
      before = now
    end do

  contains

    !> The run on the base with so many cuts; 0: there is none.
    pure integer function run_on_base(n)
      integer, intent(in) :: n
      integer, allocatable :: runs(:)

      runs = mesh_runs(sequence, family_t(n, divisions))
      run_on_base = 0
      if (size(runs) == 0) return
      if (relative_size(sequence%runs(runs(1))%mesh_size) >= relative_size(sequence%runs( &
        base)%mesh_size)) run_on_base = runs(1)
    end function run_on_base

    !> How far two runs are apart at most, in parts of the scales.
    pure real(wp) function distance(one, other)
      integer, intent(in) :: one, other
      real(wp) :: scales(size(sequence%list))
      integer :: k

      scales = error_scales(sequence%list, sequence%runs(other)%values)
      distance = maxval([(change(sequence, k, scales(k), one, other), k=1, size(scales)), 0.0_wp])
    end function distance

  end subroutine choose_cuts

  !> The coarsest mesh on which contact is in few places, of those with a run whose bricks are half
  !> as large.
  pure subroutine find_base(sequence, divisions, base, half)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: divisions
    integer, intent(out) :: base !! its run; 0: there is none
    integer, intent(out) :: half !! the run with smaller bricks
    integer, allocatable :: runs(:)
    integer :: i, k

    base = 0
    half = 0
    runs = mesh_runs(sequence, family_t(0, divisions))
    do i = 1, size(runs)
      associate (run => sequence%runs(runs(i)))
        if (run%near > most_near .or. .not. run%near > 0.0_wp) cycle
        do k = i + 1, size(runs)
          if (relative_size(sequence%runs(runs(k))%mesh_size) > about_half* &
            relative_size(run%mesh_size)) cycle
          base = runs(i)
          half = runs(k)
          return
        end do
      end associate
    end do
  end subroutine find_base

end module choose_cuts_mod
