!> The runs of a sequence whose elements at contact were cut on one mesh, again and again.
!>
!> docs/theory.md section 10.
module cut_runs_mod
  use kinds_mod, only: wp
  use mesh_size_mod, only: relative_size
  use mesh_sequence_mod, only: mesh_sequence_t, family_t, mesh_runs, distance, &
    fewest_divisions
  implicit none
  private

  public :: find_base, waits_for_half, run_on_base, runs_on_base, cuts_for_trials, &
    is_in_few_places, is_all_but_cut

  real(wp), parameter :: most_near = 1.0_wp/3.0_wp
  !! of the elements at contact: where there are more, cutting all of them costs little more [-]
  real(wp), parameter :: about_half = 0.55_wp !! of a size: but for whole numbers of elements [-]
  real(wp), parameter :: alike = 0.5_wp       !! of the accuracy, that two runs are apart [-]

contains

  !> The coarsest mesh on which contact is in few places, of those with a run whose elements are
  !> half as large.
  pure subroutine find_base(sequence, divisions, base, half)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: divisions !! of the deck's increments, of the runs
    integer, intent(out) :: base     !! its run; 0: there is none
    integer, intent(out) :: half     !! the run with smaller elements
    integer, allocatable :: runs(:)
    integer :: i, k

    base = 0
    half = 0
    runs = mesh_runs(sequence, family_t(0, divisions))
    do i = 1, size(runs)
      associate (run => sequence%runs(runs(i)))
        if (.not. is_in_few_places(run%near)) cycle
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

  !> The coarsest mesh on which contact is in few places, where no run has elements that are half as
  !> large; 0: one has, or contact is in few places on none.
  pure integer function waits_for_half(sequence, divisions) result(base)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: divisions
    integer, allocatable :: runs(:)
    integer :: half, i

    call find_base(sequence, divisions, base, half)
    if (base > 0) then
      base = 0
      return
    end if
    runs = mesh_runs(sequence, family_t(0, divisions))
    do i = 1, size(runs)
      base = runs(i)
      if (is_in_few_places(sequence%runs(base)%near)) return
    end do
    base = 0
  end function waits_for_half

  !> Whether a cut of the elements at contact takes much less than one of all.
  pure logical function is_in_few_places(near)
    real(wp), intent(in) :: near !! the part of the elements that are there [-]

    is_in_few_places = near > 0.0_wp .and. near <= most_near
  end function is_in_few_places

  !> The run on the base with so many cuts; 0: there is none.
  pure integer function run_on_base(sequence, divisions, base, cuts)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: divisions, base, cuts
    integer, allocatable :: runs(:)

    run_on_base = base
    if (cuts == 0) return
    runs = mesh_runs(sequence, family_t(cuts, divisions))
    run_on_base = 0
    if (size(runs) == 0) return
    if (relative_size(sequence%runs(runs(1))%mesh_size) >= relative_size(sequence%runs( &
      base)%mesh_size)) run_on_base = runs(1)
  end function run_on_base

  !> The runs on the base with 0, 1, 2, ... cuts, as far as there are, and no more than so many.
  pure function runs_on_base(sequence, divisions, base, most) result(runs)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: divisions, base
    integer, intent(in) :: most !! cuts
    integer, allocatable :: runs(:)
    integer :: cuts, run

    runs = [base]
    do cuts = 1, most
      run = run_on_base(sequence, divisions, base, cuts)
      if (run == 0) return
      runs = [runs, run]
    end do
  end function runs_on_base

  !> With how many cuts increments are tried out for runs with more: as few as give the same, all
  !> but.
  pure integer function cuts_for_trials(sequence, cuts) result(fewer)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: cuts
    integer, allocatable :: runs(:)
    integer :: base, half, divisions, i

    fewer = cuts
    if (cuts < 2) return
    divisions = fewest_divisions(sequence, cuts)
    call find_base(sequence, divisions, base, half)
    if (base == 0) return
    runs = runs_on_base(sequence, divisions, base, cuts)
    if (size(runs) <= cuts) return
    do i = cuts - 1, 1, -1
      if (distance(sequence, runs(i + 1), runs(cuts + 1)) > alike*sequence%wanted) return
      fewer = i
    end do
  end function cuts_for_trials

  !> Whether one more cut is foreseen to change as little as runs may differ that increments are
  !> tried out with: half of what the cut before it changed.
  pure logical function is_all_but_cut(sequence, family, base)
    type(mesh_sequence_t), intent(in) :: sequence
    type(family_t), intent(in) :: family !! with that cut
    integer, intent(in) :: base
    integer, allocatable :: runs(:)
    real(wp), parameter :: of_the_last = 0.5_wp !! what the next cut changes, of first order

    is_all_but_cut = .false.
    if (family%cuts < 3) return
    runs = runs_on_base(sequence, family%divisions, base, family%cuts - 1)
    if (size(runs) < family%cuts) return
    is_all_but_cut = of_the_last*distance(sequence, runs(size(runs) - 1), runs(size(runs))) <= &
      alike*sequence%wanted
  end function is_all_but_cut

end module cut_runs_mod
