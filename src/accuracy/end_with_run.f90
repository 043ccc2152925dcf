!> Which runs of a sequence are written, and the one that it ends with, whose result is in the file.
module end_with_run_mod
  use kinds_mod, only: wp
  use mesh_sequence_mod, only: mesh_sequence_t, family_of, has_bound, mesh_runs
  use sequence_error_mod, only: sequence_error_t, estimate_sequence, total_error
  use next_run_mod, only: choice_t, beyond_machine, steps_too_coarse, facets_too_coarse
  implicit none
  private

  public :: is_to_be_written, end_with_run

  real(wp), parameter :: brief = 0.3_wp !! of a run that is not written [s]
  real(wp), parameter :: part_to_repeat = 0.05_wp
  !! of the time that is left: what such a run takes at most, for it may have to be made again
  real(wp), parameter :: about_as_good = 1.2_wp
  !! times the error of another run: the last one is as good then [-]

contains

  !> Whether the result of the next run is written while it is made. A short one that only leads to
  !> others is not: a file takes longer than it does.
  pure logical function is_to_be_written(sequence, choice, seconds) result(is_so)
    type(mesh_sequence_t), intent(in) :: sequence
    type(choice_t), intent(in) :: choice !! of that run
    real(wp), intent(in) :: seconds      !! that its plan says [s]

    is_so = choice%may_be_last .or. seconds > brief
    ! A plan may say too little: one that took longer is not often followed by a shorter one.
    if (size(sequence%runs) > 0) is_so = is_so .or. sequence%runs(size( &
      sequence%runs))%seconds > brief
    if (sequence%time > 0.0_wp) is_so = is_so .or. seconds > part_to_repeat*(sequence%time - &
      sequence%spent)
  end function is_to_be_written

  !> Make the run again that a sequence ends with, where it is not the one whose result is in the
  !> file: it was not to be the last, or others were tried out after it.
  subroutine end_with_run(sequence, choice)
    type(mesh_sequence_t), intent(inout) :: sequence
    type(choice_t), intent(inout) :: choice !! an end; gets that run where there is one to make
    integer :: k, i, n

    n = size(sequence%runs)
    k = choice%of_run
    ! Within bounds there is no run beside those that lead to the last; of what does not converge no
    ! error is known.
    if (any(choice%outcome == [beyond_machine, steps_too_coarse, facets_too_coarse]) .and. .not. &
      has_bound(sequence)) k = best_run(sequence)
    if (k == 0) then
      k = n
      if (sequence%keeps_steps) k = findloc(sequence%runs%divisions, minval( &
        sequence%runs%divisions), dim=1, back=.true.)
    end if
    if (k == n .and. sequence%runs(k)%is_kept) return
    choice = choice_t(mesh_size=sequence%runs(k)%mesh_size, &
      divisions=sequence%runs(k)%divisions, may_be_last=.true., is_replaced=.true.)
    sequence%repeated = sequence%runs(k)%seconds
    sequence%runs = sequence%runs(pack([(i, i=1, n)], [(i /= k, i=1, n)]))
  end subroutine end_with_run

  !> The run with the least error that is known, of those on the last meshes with as many divisions
  !> and cuts; the last of all if that is about as good. 0: no error is known.
  integer function best_run(sequence) result(best)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, allocatable :: runs(:)
    real(wp) :: error, least
    integer :: i

    best = 0
    least = huge(1.0_wp)
    do i = size(sequence%runs), 1, -1
      associate (run => sequence%runs(i))
        if (sequence%keeps_steps .and. run%divisions > minval(sequence%runs%divisions)) cycle
        runs = mesh_runs(sequence, family_of(run))
      end associate
      if (runs(size(runs)) /= i) cycle
      error = error_of(i)
      if (error < 0.0_wp) cycle
      if (best > 0 .and. error >= least) cycle
      best = i
      least = error
      if (i == size(sequence%runs)) least = error/about_as_good
    end do

  contains

    !> What is known of a run's error; negative where that by the mesh or by load steps is not.
    real(wp) function error_of(k) result(error)
      integer, intent(in) :: k
      type(sequence_error_t) :: errors

      call estimate_sequence(sequence, errors, family_of(sequence%runs(k)))
      error = total_error(errors)
      if (sequence%divides .and. errors%load_steps < 0.0_wp) error = -1.0_wp
    end function error_of

  end function best_run

end module end_with_run_mod
