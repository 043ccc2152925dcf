!> Going on with a run that was stopped or killed: what is kept for it after every increment, and
!> how it is taken up again.
!>
!> A continued run makes its solver as the first session did, step by step from the last one that
!> factorised, so that every number comes out the same to the last bit.
module checkpoint_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t, raise, exit_wrong_input
  use text_mod, only: to_text
  use system_mod, only: cpu_seconds
  use number_list_mod, only: number_list_t, list_of, numbers_in, is_used_up, archive
  use scene_mod, only: scene_t
  use own_sides_mod, only: list_own_sides, take_own_sides
  use plan_mod, only: plan_t
  use state_mod, only: state_t, initial_state, archive_state
  use contact_interface_mod, only: reach_everything
  use make_plan_mod, only: revise_plan
  use look_ahead_mod, only: ahead_t, carry_ahead
  use load_step_error_mod, only: coarse_run_t, start_coarse
  use shadow_run_mod, only: shadow_run_t, count_shadows
  use choose_increment_mod, only: increment_size_t, carry_size
  use load_cycles_mod, only: load_cycles_t
  use settled_cycles_mod, only: followed_cycle_t, carry_cycle
  use mesh_sequence_mod, only: mesh_sequence_t, carry_sequence
  use result_file_mod, only: result_file_t, count_increment, keep_state
  use tally_mod, only: tally_t, carry_tally
  implicit none
  private

  public :: progress_t, not_known, start_run, start_shadows, restore_checkpoint, &
    save_checkpoint, how_to_continue

  real(wp), parameter :: not_known = huge(1.0_wp) !! worst error

  !> Where a run stands between two increments.
  type :: progress_t
    type(state_t) :: state
    type(increment_size_t) :: size      !! of increments that may be cut
    real(wp) :: tolerance = 0.0_wp      !! of contact, as the accuracy wants it [-]
    type(tally_t) :: tally              !! what the run adds up to so far
    type(ahead_t) :: ahead              !! increments whose contact is solved
    type(coarse_run_t) :: coarse        !! the run in coarser increments, for the estimate of errors
    type(shadow_run_t), allocatable :: shadows(:)
    !! runs at finite strain beside this one, for the error of the theory
    type(load_cycles_t) :: cycles       !! of loads that the *STEP `entered` is part of, or has
    type(followed_cycle_t) :: cycle     !! the last of them
    type(state_t) :: followed           !! small strain in their increments
    integer :: entered = 0              !! *STEP that the solver is made for; 0: none yet
    integer :: widened_in = 0
    !! *STEP in which the whole of the slave surfaces became candidates; 0: not
    integer :: in_double = 0
    !! 1: a single factor, chosen to save time, did not hold the scene
    real(wp) :: geometry(3) = 0.0_wp
    !! the largest errors by faces that are entered between nodes, by edges within faces, and by
    !! facets; `not_known` where one is not [-]
    real(wp) :: alone = -1.0_wp
    !! error of the mesh as it says by itself, with what supports may carry in the place of contact;
    !! negative: not known [-]
    integer :: touched_in = 0
    !! the last *STEP of which it was told that contact begins inside an increment; 0: none
    integer :: too_long_in = 0
    !! the last dynamic *STEP of which it was told that increments are too long; 0: none
    type(mesh_sequence_t), allocatable :: sequence
    !! runs before this one, where an accuracy chooses the mesh
    real(wp), allocatable :: values(:, :)
    !! (n_components,n_increments) what that accuracy is of, of the deck's increments so far
    real(wp), allocatable :: latest(:, :)
    !! (n_components,1) the same at the end of the last increment, where increments add to a mean
    real(wp), allocatable :: touched(:, :) !! (1,n_nodes) as of mark_touched, likewise
    real(wp), allocatable :: seen(:, :)
    !! (1,n_obstacles) 1 where nodes have touched it since it got into the faces that it is in
    real(wp), allocatable :: own_sides(:, :) !! (1,n) as of list_own_sides
    real(wp) :: worst_errors(3) = 0.0_wp
    !! of the run, as estimated in it: by load steps, by contact and arithmetic, by the mesh [-]
    real(wp), allocatable :: begun(:, :)
    !! (3,n_nodes) prescribed displacements at the beginning of the *STEP, 0 elsewhere [length]
  end type progress_t

contains

  !> The beginning of a run.
  subroutine start_run(scene, plan, progress)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    type(progress_t), intent(out) :: progress
    integer :: i

    progress%state = initial_state(scene%mesh%n_nodes, plan%points%n, &
      size(scene%obstacles))
    if (allocated(scene%first_velocity)) progress%state%velocity = scene%first_velocity
    call start_coarse(progress%state, progress%coarse)
    i = count_shadows(scene)
    ! Their iterations take a factor.
    if (plan%choices%precision%iterative) i = 0
    call start_shadows(scene, plan%points%n, i, progress)
    progress%tolerance = plan%choices%tolerance
    allocate (progress%seen(1, size(scene%obstacles)), source=0.0_wp)
    allocate (progress%own_sides, source=list_own_sides(plan%points))
  end subroutine start_run

  !> Shadow runs, where the run begins.
  subroutine start_shadows(scene, n_points, n, progress)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: n_points
    integer, intent(in) :: n !! how many
    type(progress_t), intent(inout) :: progress
    integer :: i

    progress%followed = initial_state(scene%mesh%n_nodes, n_points, size(scene%obstacles))
    if (allocated(progress%shadows)) deallocate (progress%shadows)
    allocate (progress%shadows(n))
    do i = 1, n
      progress%shadows(i)%state = progress%followed
    end do
  end subroutine start_shadows

  !> Go on from what a result file kept.
  subroutine restore_checkpoint(numbers, scene, plan, file, progress, error)
    real(wp), intent(in) :: numbers(:)           !! as reopen_result found them
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(inout) :: plan          !! revised where it had been
    type(result_file_t), intent(inout) :: file
    type(progress_t), intent(inout) :: progress  !! the beginning of the run
    type(error_t), allocatable, intent(out) :: error !! the numbers do not fit the scene
    type(number_list_t) :: list
    real(wp) :: read_time

    read_time = progress%tally%read_time
    list = list_of(numbers)
    call carry_progress(list, progress)
    if (allocated(progress%sequence)) progress%sequence%earlier = progress%sequence%spent
    progress%tally%earlier_time = progress%tally%total_time
    progress%tally%read_time = progress%tally%read_time + read_time
    if (.not. is_used_up(list)) then
      call raise(error, exit_wrong_input, "the state in '"//file%path// &
        "' is not one of this run: "// &
        'it cannot be continued')
      return
    end if
    file%n_outputs = progress%tally%outputs
    progress%entered = 0 ! by this session
    call take_own_sides(progress%own_sides, plan%points)
    if (progress%in_double > 0) call revise_plan(scene, plan, error)
    if (allocated(error) .or. progress%widened_in == 0) return
    call reach_everything(scene, plan%points)
    call revise_plan(scene, plan, error)
  end subroutine restore_checkpoint

  !> Count the increment that was appended to the file, and keep there where the run stands.
  subroutine save_checkpoint(progress, file, error)
    type(progress_t), intent(inout) :: progress
    type(result_file_t), intent(inout) :: file
    type(error_t), allocatable, intent(out) :: error
    type(number_list_t) :: list

    if (allocated(progress%sequence)) progress%sequence%spent = progress%sequence%earlier + &
      cpu_seconds()
    if (.not. file%is_kept) return
    call carry_progress(list, progress)
    if (progress%state%increments_done == 0) then
      call keep_state(file, numbers_in(list), error)
    else
      call count_increment(file, numbers_in(list), error)
    end if
  end subroutine save_checkpoint

  !> All that a continued run must know.
  subroutine carry_progress(list, progress)
    type(number_list_t), intent(inout) :: list
    type(progress_t), intent(inout) :: progress
    integer :: i, n

    call archive_state(list, progress%state)
    call archive_state(list, progress%coarse%state)
    call archive(list, progress%coarse%n_behind)
    call archive(list, progress%coarse%energy%strain)
    call archive(list, progress%coarse%energy%balance)
    call archive(list, progress%coarse%most_strained)
    n = size(progress%shadows)
    call archive(list, n)
    if (n > size(progress%shadows)) then
      ! They began in the first *STEP.
      deallocate (progress%shadows)
      allocate (progress%shadows(n))
      do i = 1, n
        progress%shadows(i)%state = progress%followed
      end do
    end if
    if (n > 0) call archive_state(list, progress%followed)
    do i = 1, size(progress%shadows)
      call archive_state(list, progress%shadows(i)%state)
      call archive(list, progress%shadows(i)%lost_in)
    end do
    call carry_size(list, progress%size)
    call carry_ahead(list, progress%ahead)
    call carry_cycle(list, progress%cycle)
    call archive(list, progress%tolerance)
    call archive(list, progress%widened_in)
    call archive(list, progress%in_double)
    call archive(list, progress%touched_in)
    call archive(list, progress%too_long_in)
    do i = 1, size(progress%geometry)
      call archive(list, progress%geometry(i))
    end do
    call archive(list, progress%alone)
    call archive(list, progress%begun)
    call archive(list, progress%seen)
    call archive(list, progress%own_sides)
    call carry_tally(list, progress%tally)
    if (.not. allocated(progress%sequence)) return
    call carry_sequence(list, progress%sequence)
    call archive(list, progress%values)
    call archive(list, progress%latest)
    call archive(list, progress%touched)
    do i = 1, size(progress%worst_errors)
      call archive(list, progress%worst_errors(i))
    end do
  end subroutine carry_progress

  !> What a stopped run has left, and the command that goes on with it.
  function how_to_continue(path, has_some, n_done, n_increments, command) result(words)
    character(*), intent(in) :: path    !! of the result file
    logical, intent(in) :: has_some !! increments in it
    integer, intent(in) :: n_done, n_increments !! of the deck, of which others may be parts
    character(*), intent(in) :: command !! that goes on
    character(:), allocatable :: words

    if (.not. has_some) then
      words = 'no increment was finished, so nothing is kept'
      return
    end if
    words = to_text(n_done)//' of '//to_text(n_increments)//' increments are in '//path// &
      '; to go on:'//new_line('a')//'  '//command
  end function how_to_continue

end module checkpoint_mod
