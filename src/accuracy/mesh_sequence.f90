!> The runs by which an accuracy is reached, or time and memory are used well: on meshes that get
!> finer, and on the coarsest of them with increments that get smaller.
!>
!> docs/theory.md section 10.
module mesh_sequence_mod
  use kinds_mod, only: wp
  use number_list_mod, only: number_list_t, archive
  use mesh_size_mod, only: mesh_size_t, blocks_t, is_same_size, relative_size
  use controls_mod, only: subjects
  use scene_mod, only: scene_t
  use step_contact_mod, only: most_friction
  use kinks_mod, only: most_events
  use increments_mod, only: count_increments
  use measured_quantities_mod, only: quantity_t, list_quantities, error_scales
  use theory_of_runs_mod, only: run_theory_t, leaves_too_little
  implicit none
  private

  public :: mesh_sequence_t, mesh_run_t, planned_t, family_t, start_sequence, add_run, has_bound, &
    carry_sequence, mesh_runs, change, distance, family_of, step_runs, runs_on_mesh, &
    runs_up_to, fewest_divisions, sizes_of, values_in
  public :: theory_beside, theory_counts, theory_tried, theory_spoils
  public :: is_counted, theory_of_last, is_spoiled_by_theory, set_theory_aside

  ! What the error of small strain is to the accuracy.
  integer, parameter :: theory_beside = 0 !! no part of it: NLGEOM, or NLGEOM=NO
  integer, parameter :: theory_counts = 1 !! a part; finite strain may take its place
  integer, parameter :: theory_tried = 2  !! a part; finite strain was tried and not solved
  integer, parameter :: theory_spoils = 3
  !! more than there is: runs go on for the small-strain solution, whose accuracy it then is

  !> A run of the sequence.
  type :: mesh_run_t
    type(mesh_size_t) :: mesh_size = mesh_size_t()
    integer  :: divisions = 1         !! of the deck's increments
    integer  :: n_elements = 0
    real(wp) :: equations = 0.0_wp
    real(wp) :: memory = 0.0_wp       !! as planned [bytes]
    real(wp) :: seconds = 0.0_wp      !! of the processor [s]
    real(wp) :: load_steps = 0.0_wp   !! error by load steps as the run estimates it, the worst [-]
    real(wp) :: others = 0.0_wp       !! contact and arithmetic, the worst [-]
    real(wp) :: recovery = 0.0_wp     !! error by the mesh, by recovery of stresses, the worst [-]
    real(wp), allocatable :: values(:, :) !! (n_components,n_increments) of the deck's increments
    real(wp) :: planned = 0.0_wp      !! its seconds, as planned; 0: not known [s]
    real(wp), allocatable :: balls(:, :)  !! (4,n) where contact acted, as of zone_t
    real(wp) :: near = 1.0_wp             !! the part of the elements that are there [-]
    logical :: is_kept = .true.           !! its result is in the file
    type(run_theory_t) :: theory = run_theory_t() !! what small strain leaves out
    integer  :: in_double = 0             !! 1: a factor in single precision did not hold it
    real(wp) :: geometry(3) = 0.0_wp
    !! the largest errors by faces that are entered between nodes, by edges within faces, and by
    !! facets; huge where one is not known [-]
    real(wp) :: alone = -1.0_wp
    !! error of the mesh as the run says by itself, with what supports may carry in the place of
    !! contact;
    !! negative: not known [-]
    integer  :: inferred_from = 0
    !! divisions of the run on its mesh from which it is inferred; 0: it was made
  end type mesh_run_t

  !> Runs that differ in the size of all elements alone.
  type :: family_t
    integer :: cuts = 0      !! of elements at contact, beside all others
    integer :: divisions = 1 !! of the deck's increments
  end type family_t

  !> What a plan says that a run takes.
  type :: planned_t
    type(mesh_size_t) :: mesh_size
    real(wp) :: start = 0.0_wp      !! of the processor, however many increments there are [s]
    real(wp) :: increments = 0.0_wp !! of the processor, for the deck's increments undivided [s]
    real(wp) :: planning = 0.0_wp   !! what the plan itself took, deck and mesh included [s]
    real(wp) :: memory = 0.0_wp     !! beside what the process has [bytes]
  end type planned_t

  !> All runs so far, and what they are compared by.
  type :: mesh_sequence_t
    type(quantity_t), allocatable :: list(:)
    type(mesh_run_t), allocatable :: runs(:) !! as they were made; the last one is the result
    type(blocks_t) :: blocks        !! of the deck
    type(mesh_size_t) :: first      !! the coarsest mesh
    type(mesh_size_t) :: trial      !! the coarsest that says anything of increments
    logical  :: recovers = .false.  !! recovery of stresses is about what the accuracy is of
    logical  :: remembers = .false.
    !! there is friction, or inertia: what comes out depends on increments
    logical  :: is_in_time = .false. !! a *STEP is dynamic
    logical  :: divides = .false.
    !! runs with divided increments say what load steps make
    logical  :: keeps_steps = .false. !! the result has the deck's increments: a *STEP is DIRECT
    integer  :: n_increments = 0    !! of the deck
    integer  :: n_stretches = 0     !! of these, and of what kinks of amplitudes make of them
    logical  :: extrapolates = .false. !! the accuracy is one of extrapolated values
    real(wp) :: asked = 0.0_wp      !! accuracy; 0: as accurate as time and memory allow [-]
    real(wp) :: wanted = 0.0_wp     !! what the theory leaves of it for all else [-]
    integer  :: theory = theory_beside
    logical  :: follows_theory = .false. !! runs from here on estimate its error
    real(wp) :: time = 0.0_wp       !! of the processor that all runs may take; 0: any [s]
    real(wp) :: memory = 0.0_wp     !! that a run may take at its peak; 0: what there is [bytes]
    type(planned_t), allocatable :: plans(:) !! a mesh each: of the runs, and of meshes left out
    real(wp) :: earlier = 0.0_wp    !! time of the processor of sessions that this one continues [s]
    real(wp) :: spent = 0.0_wp      !! up to the end of the last run, theirs included [s]
    real(wp) :: room = 0.0_wp       !! memory that the last run might have taken [bytes]
    logical  :: writes = .true.     !! the run under way is written to the file
    real(wp) :: repeated = 0.0_wp
    !! time of the processor of a run that was not kept, and is made again [s]
  end type mesh_sequence_t

contains

  !> A sequence without runs.
  subroutine start_sequence(scene, sequence)
    type(scene_t), intent(in) :: scene !! of the deck as written
    type(mesh_sequence_t), intent(out) :: sequence
    integer :: step

    call list_quantities(scene, sequence%list)
    allocate (sequence%runs(0))
    allocate (sequence%plans(0))
    sequence%is_in_time = any(scene%steps%is_dynamic)
    ! Recovery knows strains at ends of steps, not means in time.
    sequence%recovers = subjects(scene%accuracy%of)%is_recovered .and. .not. sequence%is_in_time
    sequence%n_increments = count_increments(scene%steps)
    sequence%n_stretches = sequence%n_increments
    do step = 1, size(scene%steps)
      sequence%n_stretches = sequence%n_stretches + most_events(scene%amplitudes, scene%steps, &
        step, .false.)
    end do
    sequence%extrapolates = scene%accuracy%extrapolates
    sequence%asked = scene%accuracy%wanted
    sequence%wanted = sequence%asked
    if (scene%accuracy%chooses_theory) sequence%theory = theory_counts
    sequence%follows_theory = scene%accuracy%follows_theory
    sequence%time = scene%accuracy%time
    sequence%memory = scene%accuracy%memory
    sequence%keeps_steps = any(scene%steps%direct)
    ! Within bounds a run says by itself what increments make that are kept.
    sequence%remembers = any(most_friction(scene) > 0.0_wp) .or. sequence%is_in_time
    sequence%divides = sequence%remembers .and. .not. (sequence%keeps_steps .and. &
      has_bound(sequence))
  end subroutine start_sequence

  !> Whether time or memory of the runs have a bound beside the machine's.
  pure logical function has_bound(sequence)
    type(mesh_sequence_t), intent(in) :: sequence

    has_bound = sequence%time > 0.0_wp .or. sequence%memory > 0.0_wp
  end function has_bound

  subroutine add_run(sequence, run)
    type(mesh_sequence_t), intent(inout) :: sequence
    type(mesh_run_t), intent(in) :: run

    sequence%runs = [sequence%runs, run]
    call leave_to_others(sequence)
  end subroutine add_run

  !> What the error of the theory leaves of the accuracy for all else, where it leaves anything.
  pure subroutine leave_to_others(sequence)
    type(mesh_sequence_t), intent(inout) :: sequence
    type(run_theory_t) :: theory

    if (.not. is_counted(sequence)) return
    sequence%wanted = sequence%asked
    theory = theory_of_last(sequence)
    if (.not. leaves_too_little(theory, sequence%asked)) sequence%wanted = sequence%asked - &
      theory%error
  end subroutine leave_to_others

  !> Whether the error of the theory is a part of an accuracy.
  pure logical function is_counted(sequence)
    type(mesh_sequence_t), intent(in) :: sequence

    is_counted = sequence%asked > 0.0_wp .and. any(sequence%theory == [theory_counts, &
      theory_tried])
  end function is_counted

  !> What small strain leaves out of the last run. Where no shadow run could go beside it, as with
  !> bodies that are solved for by iteration, runs on coarser meshes say it, if two of them do: it
  !> changes little with the mesh.
  pure type(run_theory_t) function theory_of_last(sequence) result(theory)
    type(mesh_sequence_t), intent(in) :: sequence !! with a run at least
    integer, allocatable :: followed(:)
    integer :: i, n

    theory = sequence%runs(size(sequence%runs))%theory
    if (theory%is_estimate .or. theory%error >= huge(1.0_wp)) return
    followed = pack([(i, i=1, size(sequence%runs))], sequence%runs%theory%is_estimate)
    n = size(followed)
    if (n < 2) return
    associate (one => sequence%runs(followed(n - 1))%theory, other => &
      sequence%runs(followed(n))%theory)
      if (max(one%error, other%error) >= theory%error) return
      theory = other
      if (one%error > other%error) theory = one
    end associate
  end function theory_of_last

  !> Whether the error of the theory leaves nothing of the accuracy.
  pure logical function is_spoiled_by_theory(sequence) result(is_spoiled)
    type(mesh_sequence_t), intent(in) :: sequence

    is_spoiled = sequence%theory == theory_spoils
    if (is_counted(sequence) .and. size(sequence%runs) > 0) is_spoiled = &
      leaves_too_little(theory_of_last(sequence), sequence%asked)
  end function is_spoiled_by_theory

  !> Go on for the small-strain solution: no mesh makes up for its theory.
  subroutine set_theory_aside(sequence)
    type(mesh_sequence_t), intent(inout) :: sequence

    sequence%theory = theory_spoils
    sequence%wanted = sequence%asked
  end subroutine set_theory_aside

  !> The family of a run.
  pure type(family_t) function family_of(run)
    type(mesh_run_t), intent(in) :: run

    family_of = family_t(run%mesh_size%zone%times, run%divisions)
  end function family_of

  !> The runs of a family, a mesh each, the coarsest first.
  pure function mesh_runs(sequence, family) result(runs)
    type(mesh_sequence_t), intent(in) :: sequence
    type(family_t), intent(in) :: family
    integer, allocatable :: runs(:)
    integer :: i

    runs = pack([(i, i=1, size(sequence%runs))], sequence%runs%divisions == family%divisions .and. &
      sequence%runs%mesh_size%zone%times == family%cuts)
  end function mesh_runs

  !> The runs with so many cuts at contact, as they were made.
  pure function runs_with_cuts(sequence, cuts) result(runs)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: cuts
    integer, allocatable :: runs(:)
    integer :: i

    runs = pack([(i, i=1, size(sequence%runs))], sequence%runs%mesh_size%zone%times == cuts)
  end function runs_with_cuts

  !> The fewest divisions of the deck's increments that a run with so many cuts has.
  pure integer function fewest_divisions(sequence, cuts) result(fewest)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: cuts

    fewest = minval(sequence%runs(runs_with_cuts(sequence, cuts))%divisions)
  end function fewest_divisions

  !> The runs on the coarsest mesh with so many cuts at contact, of those that say anything of
  !> increments, the fewest divisions first.
  pure function step_runs(sequence, cuts) result(runs)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: cuts
    integer, allocatable :: runs(:)

    runs = runs_with_cuts(sequence, cuts)
    if (cuts == 0) runs = runs_up_to(sequence, runs, relative_size(sequence%trial))
    if (size(runs) > 0) runs = runs_on_mesh(sequence, runs(1))
  end function step_runs

  !> Those of some runs whose elements are of a size or smaller.
  pure function runs_up_to(sequence, runs, h) result(finer)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: runs(:)
    real(wp), intent(in) :: h !! [-]
    integer, allocatable :: finer(:)
    real(wp), parameter :: rounding = 1.0e-9_wp

    finer = pack(runs, sizes_of(sequence, runs) <= (1.0_wp + rounding)*h)
  end function runs_up_to

  !> The runs on the mesh of one of them, with as many cuts, the fewest divisions first.
  pure function runs_on_mesh(sequence, run) result(runs)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: run
    integer, allocatable :: runs(:)
    integer :: i

    associate (all => sequence%runs)
      runs = runs_with_cuts(sequence, all(run)%mesh_size%zone%times)
      runs = pack(runs, [(is_same_size(all(runs(i))%mesh_size, all(run)%mesh_size), &
        i=1, size(runs))])
    end associate
    runs = by_divisions(sequence, runs)
  end function runs_on_mesh

  !> The sizes of the elements of runs.
  pure function sizes_of(sequence, runs) result(h)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: runs(:)
    real(wp) :: h(size(runs))
    integer :: i

    h = [(relative_size(sequence%runs(runs(i))%mesh_size), i=1, size(runs))]
  end function sizes_of

  !> A quantity's values in a run.
  pure function values_in(sequence, run, k) result(values)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: run, k
    real(wp) :: values(sequence%list(k)%n, sequence%n_increments)

    associate (a => sequence%list(k)%first)
      values = sequence%runs(run)%values(a:a + sequence%list(k)%n - 1, :)
    end associate
  end function values_in

  !> Runs in the order of their divisions.
  pure function by_divisions(sequence, runs) result(sorted)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: runs(:)
    integer :: sorted(size(runs))
    integer :: i

    associate (divisions => sequence%runs(runs)%divisions)
      do i = 1, size(runs)
        sorted(1 + count(divisions < divisions(i)) + count(divisions(:i - 1) == divisions(i))) = &
          runs(i)
      end do
    end associate
  end function by_divisions

  !> The largest difference of a quantity in two runs, over the increments, as a part of its scale.
  pure real(wp) function change(sequence, k, scale, one, other)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: k         !! the quantity
    real(wp), intent(in) :: scale
    integer, intent(in) :: one, other !! runs
    integer :: j

    change = 0.0_wp
    if (.not. sequence%list(k)%is_compared) return
    associate (a => sequence%list(k)%first, b => sequence%list(k)%first + sequence%list(k)%n - 1)
      do j = 1, sequence%n_increments
        change = max(change, norm2(sequence%runs(one)%values(a:b, j) - &
          sequence%runs(other)%values(a:b, j)))
      end do
    end associate
    if (scale > 0.0_wp) change = change/scale
  end function change

  !> How far two runs are apart at most, in parts of the scales.
  pure real(wp) function distance(sequence, one, other)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: one, other
    real(wp) :: scales(size(sequence%list))
    integer :: k

    scales = error_scales(sequence%list, sequence%runs(other)%values)
    distance = maxval([(change(sequence, k, scales(k), one, other), k=1, size(scales)), 0.0_wp])
  end function distance

  !> Put the runs into the list, or take them out.
  subroutine carry_sequence(list, sequence)
    type(number_list_t), intent(inout) :: list
    type(mesh_sequence_t), intent(inout) :: sequence
    type(mesh_run_t) :: run
    integer :: n, i, k

    n = size(sequence%runs)
    call archive(list, n)
    call archive(list, sequence%theory)
    call carry_flag(sequence%follows_theory)
    call carry_size(sequence%first)
    call carry_size(sequence%trial)
    call archive(list, sequence%spent)
    call archive(list, sequence%room)
    do i = 1, n
      run = mesh_run_t()
      if (i <= size(sequence%runs)) run = sequence%runs(i)
      call carry_size(run%mesh_size)
      call archive(list, run%divisions)
      call archive(list, run%n_elements)
      call archive(list, run%equations)
      call archive(list, run%memory)
      call archive(list, run%seconds)
      call archive(list, run%load_steps)
      call archive(list, run%others)
      call archive(list, run%recovery)
      call archive(list, run%values)
      call archive(list, run%planned)
      call archive(list, run%balls)
      call archive(list, run%near)
      call archive(list, run%theory%error)
      call carry_flag(run%theory%is_estimate)
      call archive(list, run%theory%of_law(1))
      call archive(list, run%theory%of_law(2))
      call archive(list, run%theory%law)
      call archive(list, run%in_double)
      do k = 1, size(run%geometry)
        call archive(list, run%geometry(k))
      end do
      call archive(list, run%alone)
      if (i > size(sequence%runs)) call add_run(sequence, run)
    end do

  contains

    subroutine carry_flag(flag)
      logical, intent(inout) :: flag
      integer :: number

      number = merge(1, 0, flag)
      call archive(list, number)
      flag = number == 1
    end subroutine carry_flag

    subroutine carry_size(mesh_size)
      type(mesh_size_t), intent(inout) :: mesh_size

      call archive(list, mesh_size%blocks(1))
      call archive(list, mesh_size%blocks(2))
      call archive(list, mesh_size%parts)
      call archive(list, mesh_size%across)
      call archive(list, mesh_size%zone%times)
      call archive(list, mesh_size%zone%balls)
    end subroutine carry_size

  end subroutine carry_sequence

end module mesh_sequence_mod
