!> What a run of a sequence is foreseen to take, from the plans that were made and from how the runs
!> so far compare with theirs.
module foreseen_costs_mod
  use kinds_mod, only: wp
  use mesh_size_mod, only: mesh_size_t, relative_size, is_same_size
  use mesh_sequence_mod, only: mesh_sequence_t, planned_t
  implicit none
  private

  public :: fits, seconds_to_run, memory_to_run, memory_when_finer, note_plan

  real(wp), parameter :: least = 1.0e-9_wp !! in place of a cost of 0 in quotients [s or bytes]

  !> How a cost grows as elements get smaller: but for a part that is fixed, as a power of their
  !> number along an edge; while it is small as another, until the arithmetic of the factor, or
  !> memory beyond the caches, prevails.
  type :: growth_t
    real(wp) :: fixed, small !! [s] or [bytes]
    real(wp) :: power(2)     !! while it is small, and from there on [-]
  end type growth_t

  ! Of elements that are cut along all three axes; in a slice along two.
  type(growth_t), parameter :: of_start = growth_t(0.01_wp, 0.3_wp, [3.5_wp, 4.8_wp])
  type(growth_t), parameter :: of_increments = growth_t(0.0_wp, 0.3_wp, [2.8_wp, 4.2_wp])
  type(growth_t), parameter :: of_planning = growth_t(0.01_wp, 0.3_wp, [3.3_wp, 3.3_wp])
  type(growth_t), parameter :: of_memory = growth_t(47.0e6_wp, 20.0e6_wp, [2.5_wp, 4.0_wp])

  ! How far a run may be from its plan and yet say how far the next one will be [-].
  real(wp), parameter :: least_ratio = 0.4_wp, largest_ratio = 50.0_wp
  real(wp), parameter :: least_of_short = 1.0_wp, largest_of_short = 5.0_wp
  real(wp), parameter :: short = 0.5_wp
  !! seconds up to which plans go by fixed rates: that such a run was faster is the machine's, whose
  !! rates longer plans measure; of what it was slower by a part is what every run takes [s]
  real(wp), parameter :: growth_of_ratio = 0.2_wp
  !! with the time: what a short run has in caches a long one has not [-]
  real(wp), parameter :: longest_overhead = 0.05_wp !! of a run beside its plan [s]
  real(wp), parameter :: of_file = 0.05_wp          !! the same, of one whose result is kept [s]
  real(wp), parameter :: many = 2.0_wp              !! times that, and a run is long

contains

  !> Keep what the plan of a run says, in place of an earlier one of the same mesh.
  subroutine note_plan(sequence, planned)
    type(mesh_sequence_t), intent(inout) :: sequence
    type(planned_t), intent(in) :: planned
    integer :: i

    do i = 1, size(sequence%plans)
      if (is_same_size(sequence%plans(i)%mesh_size, planned%mesh_size)) then
        sequence%plans(i) = planned
        return
      end if
    end do
    sequence%plans = [sequence%plans, planned]
  end subroutine note_plan

  !> Whether a run is foreseen to be within the bounds.
  pure logical function fits(sequence, mesh_size, divisions, room, part, is_planned)
    type(mesh_sequence_t), intent(in) :: sequence !! with a plan at least
    type(mesh_size_t), intent(in) :: mesh_size
    integer, intent(in) :: divisions
    real(wp), intent(in) :: room !! memory that it may take beside what the process has [bytes]
    real(wp), intent(in) :: part !! of the time that is left, that it may take [-]
    logical, intent(in), optional :: is_planned !! the time for its plan is spent

    fits = memory_to_run(sequence, relative_size(mesh_size)) <= room
    if (fits .and. sequence%time > 0.0_wp) fits = seconds_to_run(sequence, &
      relative_size(mesh_size), divisions, &
      is_planned) <= part*(sequence%time - sequence%spent)
  end function fits

  !> Processor time of a run: as planned, times what the last run took of its own plan.
  pure real(wp) function seconds_to_run(sequence, h, divisions, is_planned) result(seconds)
    type(mesh_sequence_t), intent(in) :: sequence !! with a plan at least
    real(wp), intent(in) :: h         !! size of the elements [-]
    integer, intent(in) :: divisions
    logical, intent(in), optional :: is_planned !! the time for its plan is spent
    real(wp) :: ratio, before

    call compare_with_plan(sequence, ratio, before)
    seconds = ratio*(planned_at(sequence, sequence%plans%start, of_start, h) + &
      divisions*planned_at(sequence, sequence%plans%increments, of_increments, h))
    if (before > 0.0_wp) seconds = seconds*max(1.0_wp, seconds/before)**growth_of_ratio
    if (size(sequence%runs) > 0) then
      if (.not. sequence%runs(size(sequence%runs))%is_kept) seconds = seconds + of_file
    end if
    if (present(is_planned)) then
      if (is_planned) return
    end if
    seconds = seconds + planned_at(sequence, sequence%plans%planning, of_planning, h)
  end function seconds_to_run

  !> What runs take over what their plans say, by the last one that was not continued.
  pure subroutine compare_with_plan(sequence, ratio, seconds)
    type(mesh_sequence_t), intent(in) :: sequence
    real(wp), intent(out) :: ratio
    real(wp), intent(out) :: seconds !! of that run; 0: there is none [s]
    real(wp) :: overhead
    integer :: i

    ratio = 1.0_wp
    seconds = 0.0_wp
    do i = size(sequence%runs), 1, -1
      associate (run => sequence%runs(i), first => sequence%runs(1))
        if (run%planned <= 0.0_wp .or. first%planned <= 0.0_wp) cycle
        ! Of a short run a good part is what every run takes and plans leave out; of the next one it
        ! is none.
        overhead = max(0.0_wp, min(first%seconds - first%planned, longest_overhead))
        if (run%seconds > many*overhead) overhead = 0.0_wp
        ratio = (run%seconds - overhead)/run%planned
        ratio = max(merge(least_of_short, least_ratio, run%planned < short), min(ratio, &
          merge(largest_of_short, largest_ratio, run%seconds < short)))
        seconds = run%seconds
        return
      end associate
    end do
  end subroutine compare_with_plan

  !> Memory of a run beside what the process has.
  pure real(wp) function memory_to_run(sequence, h) result(memory)
    type(mesh_sequence_t), intent(in) :: sequence !! with a plan at least
    real(wp), intent(in) :: h !! size of the elements [-]

    memory = planned_at(sequence, sequence%plans%memory, of_memory, h)
  end function memory_to_run

  !> Memory of a run with elements so many times smaller than those of another one.
  pure real(wp) function memory_when_finer(sequence, memory, times) result(finer)
    type(mesh_sequence_t), intent(in) :: sequence
    real(wp), intent(in) :: memory !! of that run [bytes]
    real(wp), intent(in) :: times

    finer = cost_when_finer(sequence, memory, of_memory, times)
  end function memory_when_finer

  !> A cost at a size of elements: between the plans of a coarser and a finer mesh along a power of
  !> the size; else from the nearest, with the growth that is given.
  pure real(wp) function planned_at(sequence, costs, growth, h) result(cost)
    type(mesh_sequence_t), intent(in) :: sequence
    real(wp), intent(in) :: costs(:) !! of its plans
    type(growth_t), intent(in) :: growth
    real(wp), intent(in) :: h        !! size of the elements [-]
    real(wp) :: at
    integer :: coarser, finer, i

    coarser = 0
    finer = 0
    do i = 1, size(costs)
      at = relative_size(sequence%plans(i)%mesh_size)
      if (is_same(at, h)) then
        cost = costs(i)
        return
      end if
      if (at > h) then
        if (coarser == 0) coarser = i
        if (at < size_of(coarser)) coarser = i
      else
        if (finer == 0) finer = i
        if (at > size_of(finer)) finer = i
      end if
    end do
    if (coarser > 0 .and. finer > 0) then
      associate (a => max(costs(coarser), least), b => max(costs(finer), least))
        cost = a*(b/a)**(log(size_of(coarser)/h)/log(size_of(coarser)/size_of(finer)))
      end associate
    else
      i = max(coarser, finer)
      cost = cost_when_finer(sequence, costs(i), growth, size_of(i)/h)
    end if

  contains

    pure real(wp) function size_of(k)
      integer, intent(in) :: k

      size_of = relative_size(sequence%plans(k)%mesh_size)
    end function size_of

  end function planned_at

  !> A cost with elements so many times smaller.
  pure real(wp) function cost_when_finer(sequence, cost, growth, times) result(finer)
    type(mesh_sequence_t), intent(in) :: sequence
    real(wp), intent(in) :: cost
    type(growth_t), intent(in) :: growth
    real(wp), intent(in) :: times
    real(wp), parameter :: least_part = 0.1_wp
    real(wp) :: along, while_small !! times, along an edge of three; 1 and more

    along = times**(merge(2.0_wp, 3.0_wp, sequence%first%across > 0)/3.0_wp)
    associate (grows => max(cost - growth%fixed, least_part*cost))
      while_small = 1.0_wp
      if (grows < growth%small) while_small = min(max(1.0_wp, along), &
        (growth%small/max(grows, least))**(1.0_wp/growth%power(1)))
      finer = cost - grows + grows*while_small**growth%power(1)*(along/while_small)** &
        growth%power(2)
    end associate
  end function cost_when_finer

  !> Whether two sizes of elements are one.
  pure logical function is_same(a, b)
    real(wp), intent(in) :: a, b
    real(wp), parameter :: rounding = 1.0e-9_wp

    is_same = abs(a - b) <= rounding*a
  end function is_same

end module foreseen_costs_mod
