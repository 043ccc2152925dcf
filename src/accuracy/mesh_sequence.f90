!> The runs by which an accuracy is reached: on meshes that get finer, and on the coarsest of them
!> with increments that get smaller. What they say of the error of the last one, and which comes
!> next.
!>
!> docs/theory.md section 10.
module mesh_sequence_mod
  use kinds_mod, only: wp
  use number_list_mod, only: number_list_t, archive
  use mesh_size_mod, only: mesh_size_t, blocks_t, relative_size
  use controls_mod, only: accuracy_of_energy
  use scene_mod, only: scene_t
  use increments_mod, only: count_increments
  use measured_quantities_mod, only: quantity_t, list_quantities, error_scales
  use convergence_mod, only: convergence_t, observe_convergence, assume_first_order, &
    size_for_error
  implicit none
  private

  public :: mesh_sequence_t, mesh_run_t, sequence_error_t, choice_t, start_sequence, add_run, &
    estimate_sequence, choose_run, skip_mesh, carry_sequence, mesh_runs, extrapolated
  public :: to_run, is_reached, steps_too_coarse, not_convergent, beyond_machine

  ! What comes next.
  integer, parameter :: to_run = 1
  integer, parameter :: is_reached = 2
  integer, parameter :: steps_too_coarse = 3 !! load steps make too much, however small
  integer, parameter :: not_convergent = 4   !! finer meshes change it as much as before, or more
  integer, parameter :: beyond_machine = 5   !! the mesh that it takes does not fit

  real(wp), parameter :: part_for_steps = 0.3_wp !! of the accuracy, that load steps may use up
  real(wp), parameter :: aimed_at = 0.8_wp !! of what is left for the mesh
  integer, parameter :: most_divisions = 64
  integer, parameter :: fewest_bricks = 4 !! along the longest edge of a block, to begin with
  real(wp), parameter :: least_step = 1.25_wp, largest_step = 2.0_wp !! from size to size
  integer, parameter :: most_parts = 64
  real(wp), parameter :: rounding = 1.0e-9_wp
  real(wp), parameter :: small = 0.02_wp !! of the machine's memory [-]
  real(wp), parameter :: hoped_order = 1.0_wp
  !! of finer meshes: on coarse ones the order is often less than what it becomes

  !> A run of the sequence.
  type :: mesh_run_t
    type(mesh_size_t) :: mesh_size
    integer  :: divisions = 1         !! of the deck's increments
    integer  :: n_bricks = 0
    real(wp) :: equations = 0.0_wp
    real(wp) :: memory = 0.0_wp       !! as planned [bytes]
    real(wp) :: seconds = 0.0_wp      !! of the processor [s]
    real(wp) :: load_steps = 0.0_wp   !! error by load steps as the run estimates it, the worst [-]
    real(wp) :: others = 0.0_wp       !! contact and arithmetic, the worst [-]
    real(wp) :: recovery = 0.0_wp     !! error by the mesh, by recovery of stresses, the worst [-]
    real(wp), allocatable :: values(:, :) !! (n_components,n_increments) of the deck's increments
  end type mesh_run_t

  !> All runs so far, and what they are compared by.
  type :: mesh_sequence_t
    type(quantity_t), allocatable :: list(:)
    type(mesh_run_t), allocatable :: runs(:) !! as they were made; the last one is the result
    type(blocks_t) :: blocks        !! of the deck
    type(mesh_size_t) :: first      !! the coarsest mesh
    logical  :: recovers = .false.  !! recovery of stresses is about what the accuracy is of
    logical  :: divides = .false.   !! increments may be cut, and what comes out depends on it
    integer  :: n_increments = 0    !! of the deck
    real(wp) :: wanted = 0.0_wp     !! accuracy [-]
  end type mesh_sequence_t

  !> What is known of the last run's error.
  type :: sequence_error_t
    real(wp) :: mesh = -1.0_wp       !! of the worst quantity; negative: not known [-]
    real(wp) :: load_steps = -1.0_wp !! likewise [-]
    real(wp) :: others = 0.0_wp      !! contact and arithmetic [-]
    integer  :: worst = 0            !! the quantity whose error by the mesh is the largest
    type(convergence_t), allocatable :: of_mesh(:) !! (n_quantities), error relative to its scale
  end type sequence_error_t

  !> What to do next.
  type :: choice_t
    integer :: outcome = to_run
    type(mesh_size_t) :: mesh_size
    integer :: divisions = 1
    logical :: may_be_last = .false. !! it is expected to reach the accuracy
    real(wp) :: finer = 1.0_wp
    !! beyond the machine: how many times smaller the bricks of the last run would have to be [-]
    real(wp) :: memory = 0.0_wp      !! and what that would take [bytes]
  end type choice_t

contains

  !> A sequence without runs.
  subroutine start_sequence(scene, sequence)
    type(scene_t), intent(in) :: scene !! of the deck as written
    type(mesh_sequence_t), intent(out) :: sequence

    call list_quantities(scene, sequence%list)
    allocate (sequence%runs(0))
    sequence%blocks = scene%blocks
    sequence%recovers = scene%accuracy%of <= accuracy_of_energy
    sequence%divides = any(scene%pairs%mu > 0.0_wp) .and. .not. all(scene%steps%direct)
    sequence%n_increments = count_increments(scene%steps)
    sequence%wanted = scene%accuracy%wanted
    sequence%first = coarsest(scene%blocks)
  end subroutine start_sequence

  !> The mesh to begin with.
  pure type(mesh_size_t) function coarsest(blocks)
    type(blocks_t), intent(in) :: blocks

    if (blocks%common == 0) return
    coarsest%blocks = [1, blocks%common]
    do while (coarsest%blocks(1)*blocks%longest < fewest_bricks*blocks%common)
      coarsest%blocks(1) = coarsest%blocks(1) + 1
    end do
  end function coarsest

  !> A finer mesh, of bricks about so many times smaller.
  pure type(mesh_size_t) function finer(sequence, mesh_size, times)
    type(mesh_sequence_t), intent(in) :: sequence
    type(mesh_size_t), intent(in) :: mesh_size
    real(wp), intent(in) :: times

    finer = mesh_size
    if (sequence%blocks%common == 0) then
      finer%parts = more(mesh_size%parts)
      return
    end if
    finer%blocks(1) = more(mesh_size%blocks(1))
    ! Even numbers stay even: a node in the middle stays there.
    if (mod(mesh_size%blocks(1), 2) == 0) finer%blocks(1) = finer%blocks(1) + &
      mod(finer%blocks(1), 2)

  contains

    pure integer function more(n)
      integer, intent(in) :: n

      more = ceiling(max(least_step, min(times, largest_step))*real(n, wp) - rounding)
    end function more

  end function finer

  !> Begin with a finer mesh than the one that was not solved.
  subroutine skip_mesh(sequence)
    type(mesh_sequence_t), intent(inout) :: sequence

    sequence%first = finer(sequence, sequence%first, least_step)
  end subroutine skip_mesh

  subroutine add_run(sequence, run)
    type(mesh_sequence_t), intent(inout) :: sequence
    type(mesh_run_t), intent(in) :: run

    sequence%runs = [sequence%runs, run]
  end subroutine add_run

  !> The runs with the increments of the last one, a mesh each.
  pure function mesh_runs(sequence) result(runs)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, allocatable :: runs(:)
    integer :: i

    runs = pack([(i, i=1, size(sequence%runs))], sequence%runs%divisions == &
      sequence%runs(size(sequence%runs))%divisions)
  end function mesh_runs

  !> The runs on the first mesh.
  pure function step_runs(sequence) result(runs)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, allocatable :: runs(:)
    integer :: i

    associate (sizes => sequence%runs%mesh_size)
      runs = pack([(i, i=1, size(sequence%runs))], [(relative_size(sizes(i)) >= &
        relative_size(sizes(1)), i=1, size(sequence%runs))])
    end associate
  end function step_runs

  !> The largest difference of a quantity in two runs, over the increments, as a part of its scale.
  pure real(wp) function change(sequence, k, scale, one, other)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: k         !! the quantity
    real(wp), intent(in) :: scale
    integer, intent(in) :: one, other !! runs
    integer :: j

    change = 0.0_wp
    associate (a => sequence%list(k)%first, b => sequence%list(k)%first + sequence%list(k)%n - 1)
      do j = 1, sequence%n_increments
        change = max(change, norm2(sequence%runs(one)%values(a:b, j) - &
          sequence%runs(other)%values(a:b, j)))
      end do
    end associate
    if (scale > 0.0_wp) change = change/scale
  end function change

  !> What the runs say of the error of the last one.
  subroutine estimate_sequence(sequence, errors)
    type(mesh_sequence_t), intent(in) :: sequence !! with a run at least
    type(sequence_error_t), intent(out) :: errors
    real(wp) :: scales(size(sequence%list))
    integer, allocatable :: runs(:)
    integer :: k, n

    associate (last => sequence%runs(size(sequence%runs)))
      errors%others = last%others
      scales = error_scales(sequence%list, last%values)
      errors%load_steps = last%load_steps
      if (sequence%divides) errors%load_steps = error_by_steps(sequence, last%divisions)
    end associate
    runs = mesh_runs(sequence)
    n = size(runs)
    if (n < 2 .or. (n == 2 .and. .not. sequence%recovers)) return
    allocate (errors%of_mesh(size(sequence%list)))
    do k = 1, size(sequence%list)
      if (n == 2) then
        errors%of_mesh(k) = assume_first_order(sizes_of(runs), change(sequence, k, scales(k), &
          runs(1), runs(2)))
        cycle
      end if
      errors%of_mesh(k) = observe_convergence(sizes_of(runs(n - 2:)), &
        [change(sequence, k, scales(k), runs(n - 2), runs(n - 1)), &
         change(sequence, k, scales(k), runs(n - 1), runs(n))])
    end do
    errors%mesh = 0.0_wp
    if (size(sequence%list) == 0) return
    errors%worst = maxloc(errors%of_mesh%error, dim=1)
    errors%mesh = errors%of_mesh(errors%worst)%error
    ! Two meshes may be alike by accident: another witness must say so.
    if (n == 2) errors%mesh = max(errors%mesh, sequence%runs(runs(n))%recovery)

  contains

    pure function sizes_of(runs) result(h)
      integer, intent(in) :: runs(:)
      real(wp) :: h(size(runs))
      integer :: i

      h = [(relative_size(sequence%runs(runs(i))%mesh_size), i=1, size(runs))]
    end function sizes_of

  end subroutine estimate_sequence

  !> The error that load steps make with so many divisions of the deck's increments, as the runs on
  !> the first mesh say; negative where they do not.
  function error_by_steps(sequence, divisions) result(error)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: divisions
    real(wp) :: error
    type(convergence_t) :: observed
    real(wp), allocatable :: scales(:)
    integer, allocatable :: runs(:)
    real(wp) :: h(3), of_quantity
    integer :: k, n, mine

    error = -1.0_wp
    runs = step_runs(sequence)
    n = size(runs)
    if (n < 3) return
    mine = findloc(sequence%runs(runs)%divisions, divisions, dim=1)
    if (mine == 0) return
    scales = error_scales(sequence%list, sequence%runs(runs(n))%values)
    h = 1.0_wp/real(sequence%runs(runs(n - 2:))%divisions, wp)
    error = 0.0_wp
    do k = 1, size(sequence%list)
      observed = observe_convergence(h, &
        [change(sequence, k, scales(k), runs(n - 2), runs(n - 1)), &
         change(sequence, k, scales(k), runs(n - 1), runs(n))])
      of_quantity = observed%error
      if (mine < n) of_quantity = of_quantity + change(sequence, k, scales(k), runs(mine), runs(n))
      error = max(error, of_quantity)
    end do
  end function error_by_steps

  !> The next run, or why there is none.
  subroutine choose_run(sequence, memory_left, errors, choice)
    type(mesh_sequence_t), intent(in) :: sequence
    real(wp), intent(in) :: memory_left !! on this machine, before a run [bytes]
    type(sequence_error_t), intent(out) :: errors
    type(choice_t), intent(out) :: choice
    integer, allocatable :: meshes(:)

    choice%mesh_size = sequence%first
    if (size(sequence%runs) == 0) return
    if (sequence%divides) then
      call choose_divisions(sequence, choice)
      if (choice%outcome /= to_run .or. choice%divisions > maxval(sequence%runs%divisions)) return
    end if
    call estimate_sequence(sequence, errors)
    meshes = pack(sequence%runs%n_bricks, sequence%runs%divisions == choice%divisions)
    associate (last => sequence%runs(size(sequence%runs)))
      ! Steps were tried beyond what it takes: the first mesh's run with these is there.
      if (size(meshes) == 1 .or. last%divisions /= choice%divisions) then
        choice%mesh_size = finer(sequence, sequence%first, 1.5_wp)
      else
        call choose_mesh(sequence, memory_left, errors, choice)
      end if
    end associate
    if (choice%mesh_size%parts > most_parts) choice%outcome = beyond_machine
  end subroutine choose_run

  !> How the deck's increments are to be divided: tried on the first mesh with three sizes and more.
  subroutine choose_divisions(sequence, choice)
    type(mesh_sequence_t), intent(in) :: sequence
    type(choice_t), intent(inout) :: choice
    integer :: most, divisions

    associate (allowed => part_for_steps*sequence%wanted)
      most = maxval(sequence%runs%divisions)
      if (most >= 4) then
        divisions = 1
        do while (divisions <= most)
          if (error_by_steps(sequence, divisions) <= allowed) then
            choice%divisions = divisions
            return
          end if
          divisions = 2*divisions
        end do
      end if
      choice%divisions = 2*most
      if (choice%divisions > most_divisions) choice%outcome = steps_too_coarse
    end associate
  end subroutine choose_divisions

  !> After three meshes and more: enough, or as fine as it takes.
  subroutine choose_mesh(sequence, memory_left, errors, choice)
    type(mesh_sequence_t), intent(in) :: sequence
    real(wp), intent(in) :: memory_left
    type(sequence_error_t), intent(in) :: errors
    type(choice_t), intent(inout) :: choice
    real(wp) :: left, needed
    integer :: n

    n = size(mesh_runs(sequence))
    associate (last => sequence%runs(size(sequence%runs)))
      left = sequence%wanted - max(0.0_wp, errors%load_steps) - errors%others
      if (errors%mesh >= 0.0_wp .and. errors%mesh <= left) then
        choice%outcome = is_reached
        return
      end if
      if (left <= 0.1_wp*sequence%wanted) then
        choice%outcome = steps_too_coarse
        return
      end if
      if (n < 3) then
        choice%mesh_size = finer(sequence, last%mesh_size, least_step)
        choice%may_be_last = .true.
        return
      end if
      if (.not. errors%of_mesh(errors%worst)%converges) then
        ! What it takes is not known: a finer mesh may tell.
        choice%mesh_size = finer(sequence, last%mesh_size, 1.5_wp)
        if (n > 4) choice%outcome = not_convergent
        return
      end if
      needed = 1.0_wp/size_for_error(1.0_wp, errors%mesh, aimed_at*left, &
        max(hoped_order, errors%of_mesh(errors%worst)%order))
      choice%mesh_size = finer(sequence, last%mesh_size, needed)
      choice%may_be_last = needed <= largest_step
      ! The factor of bricks s times smaller takes s^4 of the memory. What is small yet is no
      ! measure of that, and another mesh is cheap.
      choice%finer = needed
      choice%memory = last%memory*needed**4
      if (choice%memory > 2.0_wp*memory_left .and. last%memory > small*memory_left) &
        choice%outcome = beyond_machine
    end associate
  end subroutine choose_mesh

  !> The values of a quantity's component, extrapolated to bricks without size.
  pure function extrapolated(sequence, errors, k) result(values)
    type(mesh_sequence_t), intent(in) :: sequence
    type(sequence_error_t), intent(in) :: errors
    integer, intent(in) :: k !! the quantity
    real(wp), allocatable :: values(:, :) !! (n,n_increments)
    integer, allocatable :: runs(:)

    associate (a => sequence%list(k)%first, b => sequence%list(k)%first + sequence%list(k)%n - 1)
      values = sequence%runs(size(sequence%runs))%values(a:b, :)
      if (.not. allocated(errors%of_mesh)) return
      runs = mesh_runs(sequence)
      values = values + errors%of_mesh(k)%weight*(values - &
        sequence%runs(runs(size(runs) - 1))%values(a:b, :))
    end associate
  end function extrapolated

  !> Put the runs into the list, or take them out.
  subroutine carry_sequence(list, sequence)
    type(number_list_t), intent(inout) :: list
    type(mesh_sequence_t), intent(inout) :: sequence
    type(mesh_run_t) :: run
    integer :: n, i

    n = size(sequence%runs)
    call archive(list, n)
    call carry_size(sequence%first)
    do i = 1, n
      if (i <= size(sequence%runs)) run = sequence%runs(i)
      call carry_size(run%mesh_size)
      call archive(list, run%divisions)
      call archive(list, run%n_bricks)
      call archive(list, run%equations)
      call archive(list, run%memory)
      call archive(list, run%seconds)
      call archive(list, run%load_steps)
      call archive(list, run%others)
      call archive(list, run%recovery)
      call archive(list, run%values)
      if (i > size(sequence%runs)) call add_run(sequence, run)
    end do

  contains

    subroutine carry_size(mesh_size)
      type(mesh_size_t), intent(inout) :: mesh_size

      call archive(list, mesh_size%blocks(1))
      call archive(list, mesh_size%blocks(2))
      call archive(list, mesh_size%parts)
    end subroutine carry_size

  end subroutine carry_sequence

end module mesh_sequence_mod
