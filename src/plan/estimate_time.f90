!> How long a run will take on this machine.
!>
!> The rates of the machine are measured with matrices of the sizes of the run; what is left in
!> constants is the work of every phase.
module estimate_time_mod
  use kinds_mod, only: wp, i8
  use system_mod, only: cpu_seconds
  use machine_speed_mod, only: machine_speed_t, measure_speed
  use cells_mod, only: hexahedron_nodes
  use connectivity_mod, only: nodes_of_hexahedron
  use scene_mod, only: scene_t
  use element_laws_mod, only: elasticity_at
  use elements_mod, only: stiffness, nodal_force
  use bodies_mod, only: find_internal_force
  use state_mod, only: modes_t
  use count_sizes_mod, only: sizes_t, iterations_of_increment, &
    solutions_of_increment, products_of_increment, newton_of_increment, solutions, &
    solutions_of_product
  use estimate_file_mod, only: file_size_t
  implicit none
  private

  public :: seconds_t, seconds_of_run, seconds_at_fixed_rates, total_seconds

  ! Passes over the factor, in memory, while it is made: fronts are cleared, assembled, eliminated
  ! panel by panel, and copied.
  real(wp), parameter :: passes_to_factorise = 50.0_wp
  real(wp), parameter :: cached = 24.0e6_wp       !! that caches may hold [bytes]
  real(wp), parameter :: passes_to_solve = 2.5_wp !! forward, backward, and the vectors
  real(wp), parameter :: passes_ahead = 0.45_wp   !! backward alone, many columns at once
  ! Of a factor that is written and read: from the disk, and where the system keeps it in memory
  ! that nobody needs [bytes/s].
  real(wp), parameter :: disk_rate = 0.5e9_wp, kept_rate = 2.0e9_wp

  ! Seconds on a machine that makes an element's internal force in 1e-6 s [s].
  real(wp), parameter :: reference_hexahedron = 1.0e-6_wp
  real(wp), parameter :: stiffness_of_element = 30.0_wp !! in internal forces of one
  real(wp), parameter :: brief = 0.5_wp               !! runs that need no measurements [s]
  real(wp), parameter :: start_of_run = 0.01_wp      !! opening the file, loading code
  real(wp), parameter :: start_of_increment = 0.25e-3_wp
  real(wp), parameter :: write_of_increment = 0.4e-3_wp !! some 50 small datasets, a flush
  real(wp), parameter :: layout_of_pair = 5.0e-3_wp  !! its datasets and tables
  real(wp), parameter :: start_of_equilibrium = 5.0e-3_wp
  !! an iteration of free bodies at finite strain, however small: MUMPS analyses and factorises anew
  real(wp), parameter :: entry_of_twins = 30.0e-9_wp
  !! of W where nodes have many rows: it is formed, pages are cleared for it, and it is copied
  real(wp), parameter :: squeeze_rate = 60.0e6_wp    !! of numbers that vary [bytes/s]
  real(wp), parameter :: squeeze_zeros = 400.0e6_wp  !! of zeros [bytes/s]
  real(wp), parameter :: keep_rate = 1.0e9_wp        !! of numbers that are not squeezed [bytes/s]
  real(wp), parameter :: probes = 90.0_wp !! of what is near the points, where W is not formed
  real(wp), parameter :: passes_of_probe = 0.5_wp !! over the factor of the interior, many at once
  real(wp), parameter :: visit_of_sweep = 0.5_wp     !! of a point, in internal forces of an element

  ! Where bodies are solved for by iteration: iterations of an increment and of the response to a
  ! load, the estimate of its error included; an equation's share of the hierarchy, and of an
  ! iteration [s].
  real(wp), parameter :: iterations_with_friction = 45.0_wp, iterations_without = 15.0_wp
  real(wp), parameter :: iterations_of_load = 60.0_wp
  real(wp), parameter :: free_bodies = 2.0_wp !! times as long each, where contact alone holds
  real(wp), parameter :: equation_set_up = 2.5e-5_wp, equation_iterated = 0.35e-6_wp

  ! Of an increment before faces that move, its estimate of the error included.
  real(wp), parameter :: placements = 14.0_wp    !! of the points, and of W those of rows:
  real(wp), parameter :: rebuilds = 6.5_wp
  real(wp), parameter :: place_of_point = 25.0_wp !! in internal forces of an element
  real(wp), parameter :: place_of_middles = 100.0_wp !! the same where faces are of second order
  real(wp), parameter :: entry_of_rows = 0.02_wp  !! of W, the same

  ! Increments of a shadow run in a *STEP, and iterations of one (docs/theory-error.md).
  real(wp), parameter :: shadows_of_step = 2.0_wp, iterations_of_shadow = 3.0_wp
  real(wp), parameter :: force_of_finite = 2.0_wp !! in internal forces of an element

  !> Seconds of the phases of a run.
  type :: seconds_t
    real(wp) :: prepare = 0.0_wp, factorise = 0.0_wp, condense = 0.0_wp, contact = 0.0_wp, &
      recover = 0.0_wp, write = 0.0_wp
    real(wp) :: shadow = 0.0_wp !! of it, runs at finite strain beside this one, or what they would
  end type seconds_t

contains

  !> Seconds from now to the end, by phase.
  type(seconds_t) function seconds_of_run(scene, sizes, file) result(seconds)
    type(scene_t), intent(in) :: scene
    type(sizes_t), intent(in) :: sizes
    type(file_size_t), intent(in) :: file
    type(machine_speed_t) :: speed
    real(wp) :: stiffness_time, force_time

    ! What is soon done is not worth measurements.
    speed = reference_speed()
    call sum_up(reference_hexahedron, stiffness_of_element*reference_hexahedron, &
      sizes%element_work*reference_hexahedron)
    if (total_seconds(seconds) < brief) return
    if (.not. sizes%by_iteration) call measure_speed(nint(sizes%front), nint(sizes%rows), &
      int(sizes%word*sizes%factor, i8), speed)
    call time_element(scene, stiffness_time, force_time)
    call sum_up(force_time, stiffness_time, time_of_forces(scene))

  contains

    !> All phases, elements and bodies taking so long.
    subroutine sum_up(force_time, stiffness_time, body_time)
      real(wp), intent(in) :: force_time, stiffness_time, body_time !! [s]
      real(wp) :: plain, scratch_time

      plain = force_time/reference_hexahedron
      scratch_time = sizes%scratch/merge(kept_rate, disk_rate, sizes%keeps_scratch)
      seconds = seconds_t()
      ! The first order is the plan's, which is spent already.
      seconds%prepare = start_of_run*plain + (sizes%factorisations - 1.0_wp)*sizes%ordering + &
        sizes%factorisations*(sizes%element_work*1.5_wp*stiffness_time + body_time)
      call time_solver(sizes, speed, force_time, scratch_time, seconds)
      seconds%contact = seconds%contact + sizes%increments*newton_of_increment(sizes)/speed%flops
      if (sizes%has_twins .and. sizes%is_dense) seconds%condense = seconds%condense + plain* &
        entry_of_twins*sizes%rows**2
      seconds%recover = seconds%recover + sizes%increments*(start_of_increment*plain + &
        2.0_wp*solutions_of_increment(sizes)*body_time + seconds_to_follow(sizes, force_time))
      if (sizes%is_finite .and. sizes%motions > 0.0_wp) seconds%recover = seconds%recover + plain* &
        start_of_equilibrium*sizes%increments*solutions_of_increment(sizes)
      seconds%shadow = seconds_of_shadows(sizes, speed, force_time, stiffness_time)
      if (sizes%shadows > 0.0_wp) seconds%recover = seconds%recover + seconds%shadow
      seconds%write = plain*(sizes%pairs*layout_of_pair + sizes%increments*write_of_increment + &
        file%varying/squeeze_rate + file%zeros/squeeze_zeros + file%dense/keep_rate)
    end subroutine sum_up

  end function seconds_of_run

  !> Seconds of runs at finite strain beside this one, were there any.
  pure real(wp) function seconds_of_shadows(sizes, speed, force_time, stiffness_time) &
    result(seconds)
    type(sizes_t), intent(in) :: sizes
    type(machine_speed_t), intent(in) :: speed
    real(wp), intent(in) :: force_time     !! internal force of an element [s]
    real(wp), intent(in) :: stiffness_time !! its stiffness [s]
    real(wp) :: iteration

    iteration = sizes%element_work*force_of_finite*force_time + passes_to_solve*sizes%word* &
      sizes%factor/speed%bytes + products_of_increment(sizes)*sizes%rows**2/speed%entries
    seconds = sizes%steps*(sizes%laws*shadows_of_step*iterations_of_shadow*iteration + &
      sizes%flops/speed%flops + sizes%element_work*stiffness_time)
  end function seconds_of_shadows

  !> Seconds of an increment to place points before faces that move, and to bring W there.
  pure real(wp) function seconds_to_follow(sizes, force_time) result(seconds)
    type(sizes_t), intent(in) :: sizes
    real(wp), intent(in) :: force_time !! internal force of an element [s]

    seconds = 0.0_wp
    if (.not. sizes%follows_faces) return
    seconds = force_time*placements*sizes%points*merge(place_of_middles, place_of_point, &
      sizes%has_middles)
    if (sizes%is_dense) seconds = seconds + force_time*rebuilds*entry_of_rows*sizes%rows**2
  end function seconds_to_follow

  !> The phases of the factor and of contact, on a machine of given rates.
  pure subroutine time_solver(sizes, speed, force_time, scratch_time, seconds)
    type(sizes_t), intent(in) :: sizes
    type(machine_speed_t), intent(in) :: speed
    real(wp), intent(in) :: force_time   !! internal force of an element [s]
    real(wp), intent(in) :: scratch_time !! to read a factor on the disk once [s]
    type(seconds_t), intent(inout) :: seconds !! gets factorise, condense, contact, recover
    real(wp) :: product, passes, n_recovered

    if (sizes%by_iteration) then
      call time_iterations(sizes, seconds)
      return
    end if
    ! Numbers of half the size are worked on twice as fast.
    seconds%factorise = sizes%factorisations*sizes%word/8.0_wp*(sizes%flops/speed%flops + &
      passes_to_factorise*8.0_wp*sizes%factor/speed%bytes) + scratch_time
    seconds%condense = sizes%factorisations*(sizes%cubes/speed%flops + &
      40.0_wp*sizes%squares/speed%bytes)
    product = sizes%rows**2/speed%entries
    ! A triangle beyond the caches comes from memory every time.
    if (4.0_wp*sizes%rows**2 > cached) product = max(product, 4.0_wp*sizes%rows**2/speed%bytes)
    product = product + 400.0_wp*sizes%rows/speed%bytes
    if (sizes%by_sweeps) product = 8.0_wp*sizes%rows**2/speed%bytes + &
      sizes%points*visit_of_sweep*force_time
    n_recovered = solutions(sizes)
    if (.not. sizes%is_dense) then
      ! The factor of the interior is about as large as that of the whole.
      seconds%condense = seconds%factorise + sizes%factorisations*probes*passes_of_probe* &
        sizes%word*sizes%factor/speed%bytes
      product = solutions_of_product(sizes)*passes_to_solve*sizes%word*sizes%factor/speed%bytes
      n_recovered = n_recovered - sizes%increments*products_of_increment(sizes)* &
        solutions_of_product(sizes)
    end if
    seconds%contact = sizes%increments*products_of_increment(sizes)*product
    passes = passes_to_solve
    if (sizes%columns > 1.0_wp) passes = passes_ahead
    seconds%recover = n_recovered*(passes*sizes%word*sizes%factor + &
      merge(8.0_wp*sizes%squares, 0.0_wp, sizes%is_dense))/speed%bytes + &
      2.0_wp*solutions(sizes)*scratch_time
  end subroutine time_solver

  !> The same phases where bodies are solved for by iteration, at fixed rates.
  pure subroutine time_iterations(sizes, seconds)
    type(sizes_t), intent(in) :: sizes
    type(seconds_t), intent(inout) :: seconds !! gets factorise, contact, recover
    real(wp) :: iterations

    iterations = iterations_with_friction
    if (.not. sizes%has_friction) iterations = iterations_without
    if (sizes%rows <= 0.0_wp) iterations = 0.0_wp
    seconds%factorise = sizes%factorisations*sizes%equations*equation_set_up
    if (sizes%motions > 0.0_wp) iterations = free_bodies*iterations
    seconds%contact = sizes%increments*iterations*sizes%equations*equation_iterated
    seconds%recover = 2.0_wp*sizes%steps*iterations_of_load*sizes%equations*equation_iterated
  end subroutine time_iterations

  !> What the factor, contact and internal forces take on a machine of fixed rates: whether W is
  !> formed, and in what arithmetic, follows from the deck alone, or no run would compute the same
  !> twice.
  pure real(wp) function seconds_at_fixed_rates(sizes) result(total)
    type(sizes_t), intent(in) :: sizes
    type(machine_speed_t) :: reference
    type(seconds_t) :: seconds
    real(wp), parameter :: passes_to_place = 24.0_wp !! bytes an entry of W that moves

    reference = reference_speed()
    call time_solver(sizes, reference, reference_hexahedron, sizes%scratch/disk_rate, seconds)
    total = seconds%factorise + seconds%condense + seconds%contact + seconds%recover + &
      2.0_wp*sizes%increments*solutions_of_increment(sizes)*sizes%element_work* &
      reference_hexahedron
    if (sizes%is_dense .and. sizes%is_curved) total = total + sizes%increments* &
      iterations_of_increment(sizes)*passes_to_place*sizes%rows**2/reference%bytes
  end function seconds_at_fixed_rates

  !> Fixed rates of one thread, about those of a processor of today.
  pure type(machine_speed_t) function reference_speed() result(speed)

    speed%flops = 5.0e10_wp
    speed%bytes = 1.0e10_wp
    speed%entries = 2.5e9_wp
  end function reference_speed

  !> How long an element of the scene takes: its stiffness, and its internal force.
  subroutine time_element(scene, stiffness_time, force_time)
    type(scene_t), intent(in) :: scene
    real(wp), intent(out) :: stiffness_time, force_time !! [s]
    integer, parameter :: least = 100, most = 1000000 !! times, where a clock is coarse
    real(wp), parameter :: long_enough = 0.003_wp
    real(wp) :: start, spent, k(3*hexahedron_nodes, 3*hexahedron_nodes)
    real(wp), dimension(3, hexahedron_nodes) :: x, u, f
    integer :: n

    stiffness_time = 0.0_wp
    force_time = 0.0_wp
    if (scene%mesh%n_elements == 0) return
    associate (mesh => scene%mesh, elastic => elasticity_at(scene%mesh, scene%materials, 1))
      x = mesh%coordinates(:, nodes_of_hexahedron(mesh%connectivity, 1))
      u = 0.0_wp
      start = cpu_seconds()
      do n = 1, most
        k = stiffness(mesh%element_kind(1), x, elastic)
        u(1, 1) = u(1, 1) + sign(1.0e-6_wp, k(1, 1))
        spent = cpu_seconds() - start
        if (n >= least .and. spent > long_enough) exit
      end do
      stiffness_time = spent/min(n, most)
      start = cpu_seconds()
      do n = 1, most
        f = nodal_force(mesh%element_kind(1), x, u, elastic)
        u(1, 1) = u(1, 1) + sign(1.0e-6_wp, f(1, 1))
        spent = cpu_seconds() - start
        if (n >= least .and. spent > long_enough) exit
      end do
      force_time = spent/min(n, most)
    end associate
  end subroutine time_element

  !> How long the internal forces of all elements take, at small strain many congruent ones at once;
  !> where that is soon, the better of two times.
  function time_of_forces(scene) result(seconds)
    type(scene_t), intent(in) :: scene
    real(wp) :: seconds !! [s]
    real(wp), parameter :: long_enough = 0.01_wp
    real(wp), allocatable :: u(:, :), f(:, :), free(:)
    type(modes_t) :: modes
    real(wp) :: start
    integer :: i, inverted

    seconds = huge(1.0_wp)
    allocate (f(3, scene%mesh%n_nodes))
    ! Nothing overflows.
    allocate (u(3, scene%mesh%n_nodes), free(scene%mesh%n_elements), source=0.0_wp)
    do i = 1, 2
      start = cpu_seconds()
      call find_internal_force(scene, free, u, modes, f, inverted)
      seconds = min(seconds, cpu_seconds() - start)
      if (seconds > long_enough) exit
    end do
  end function time_of_forces

  !> Of all phases.
  pure real(wp) function total_seconds(seconds) result(total)
    type(seconds_t), intent(in) :: seconds

    total = seconds%prepare + seconds%factorise + seconds%condense + seconds%contact + &
      seconds%recover + seconds%write
  end function total_seconds

end module estimate_time_mod
