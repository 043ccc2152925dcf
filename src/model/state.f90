!> The state of the scene after an increment: everything a step changes, nothing that follows from
!> it.
module state_mod
  use kinds_mod, only: wp, i8
  use number_list_mod, only: number_list_t, archive
  implicit none
  private

  public :: state_t, modes_t, initial_state, keep_tangent, archive_state, most_numbers, &
    bytes_to_continue, largest_slip

  !> Incompatible modes (C3D8I) at finite strain, a function of the displacement: where they were
  !> last found, from where those of another displacement take one or two steps. Not allocated:
  !> not found yet, or there are none.
  type :: modes_t
    real(wp), allocatable :: amplitude(:, :, :) !! (3, 3, n_elements) component, mode [length]
    real(wp), allocatable :: inverse(:, :, :)
    !! (9, 9, n_elements) of the modes' stiffness, somewhere near; 0: none [length/force]
  end type modes_t

  !> All zero at the start of the run. `advance` reads an old state and writes a new one.
  type :: state_t
    integer  :: increments_done = 0 !! in the run
    integer  :: step = 0       !! ordinal of the last increment's *STEP
    integer  :: increment = 0  !! and its number within the step
    integer(i8) :: position = 0
    !! its end within the step, in parts of the deck's increments (increments_mod)
    real(wp) :: time = 0.0_wp  !! total, in the deck's unit
    logical  :: ends_run = .false.
    !! though its *STEP goes on: a load cycle has settled. Not kept for continuing
    real(wp), allocatable :: displacement(:, :)   !! (3, n_nodes) [length]
    type(modes_t) :: modes                        !! of this displacement
    real(wp), allocatable :: rotation(:, :)
    !! (3, n_obstacles) rotation vectors about their reference nodes [rad]
    real(wp), allocatable :: reaction(:, :) !! (3, n_points) on the slave body, x, y, z [force]
    logical,  allocatable :: alone(:)
    !! (n_points) in the middle of an edge whose ends have no part in the point, as of weights_t;
    !! not allocated: none but those that supports hold, or no increment is done
    logical,  allocatable :: closed(:)
    !! (n_points) of pairs without separation: they stay closed from here on; not allocated: there
    !! are no such pairs, or no increment is done
    real(wp), allocatable :: trend(:, :)
    !! (3, n_points) how reactions went in the last increment, for a whole *STEP [force]
    real(wp), allocatable :: displacement_trend(:, :)
    !! (3, n_nodes) the same of the displacement, where points are placed anew and at finite strain;
    !! where bodies are solved for by iteration of what contact adds to it [length]
    integer  :: tangent_of = 0
    !! at finite strain: the increments that were done where the tangent of the factor is taken
    integer  :: first_forces = 0
    !! evaluations of internal forces in the first increment with that factor; 0: none yet
    real(wp), allocatable :: tangent_at(:, :)
    !! (3, n_nodes) the displacement there; not allocated: none [length]
    real(wp) :: tangent_projection = 0.0_wp !! of the tangent there, as of tangent_t [-]
    real(wp) :: tangent_dt = 0.0_wp
    !! in a dynamic *STEP the length of the increments that it was taken for; 0: it is to be [time]
    integer  :: tangent_step = 0         !! its *STEP and position, for the temperatures there
    integer(i8) :: tangent_position = 0
    real(wp), allocatable :: slip(:, :)
    !! (2, n_points) sum of the slip increments along t1, t2 [length]
    real(wp), allocatable :: external_force(:, :)
    !! (3, n_nodes) loads; with the supports kept for the next step's work [force]
    real(wp), allocatable :: support_force(:, :)
    !! (3, n_nodes) of the supports on the body, 0 where none is [force]
    ! In a dynamic *STEP; not allocated: bodies are at rest.
    real(wp), allocatable :: velocity(:, :)       !! (3, n_nodes) [length/time]
    real(wp), allocatable :: momentum(:, :)
    !! (3, n_nodes) of them, by the mass of the certificate; may be left out [mass length/time]
    real(wp), allocatable :: acceleration(:, :)   !! (3, n_nodes) 0 without mass [length/time^2]
    real(wp), allocatable :: unopposed(:, :)
    !! (3, n_nodes) internal forces less loads, contact and supports: what inertia answers [force]
    real(wp), allocatable :: mean_velocity(:, :) !! (3, n_nodes) in the increment [length/time]
    real(wp), allocatable :: damping_force(:, :) !! (3, n_nodes) of materials that damp [force]
    real(wp) :: most_inertia = 0.0_wp  !! largest nodal force of inertia in the *STEP [force]
    real(wp) :: most_force = 0.0_wp    !! of loads, strains and supports, likewise [force]
    real(wp) :: kinetic_energy = 0.0_wp           !! [energy]
    real(wp) :: contact_work = 0.0_wp
    !! cumulative, of normal forces along gaps that change: 0 in nature [energy]
    real(wp) :: begun_energy = 0.0_wp             !! kinetic, that the run began with [energy]
    real(wp) :: least_gain = 0.0_wp
    !! of the energy that contact and scheme have given, the least so far [energy]
    real(wp), allocatable :: by_body(:, :) !! (6, n_bodies) as of own_inertia [energy]
    real(wp), allocatable :: twist(:, :)
    !! (3, n_pieces) angular momentum that no torque explains [mass length^2/time]
    real(wp) :: largest_energy = 0.0_wp !! that has been there, or was turned over [energy]
    real(wp) :: external_work = 0.0_wp            !! cumulative [energy]
    real(wp) :: dissipation = 0.0_wp              !! cumulative, by friction [energy]
    real(wp) :: damped = 0.0_wp                   !! cumulative, by materials [energy]
    real(wp) :: strain_energy = 0.0_wp            !! [energy]
  end type state_t

contains

  !> The undeformed, unloaded state.
  pure type(state_t) function initial_state(n_nodes, n_points, n_obstacles) result(state)
    integer, intent(in) :: n_nodes, n_points, n_obstacles

    allocate (state%displacement(3, n_nodes), state%rotation(3, n_obstacles), source=0.0_wp)
    allocate (state%external_force(3, n_nodes), state%support_force(3, n_nodes), source=0.0_wp)
    allocate (state%reaction(3, n_points), state%trend(3, n_points), state%slip(2, n_points), &
      source=0.0_wp)
  end function initial_state

  !> The tangent where a state is will serve from here on.
  pure subroutine keep_tangent(state)
    type(state_t), intent(inout) :: state

    associate (is_new => state%tangent_of /= state%increments_done)
      if (is_new .and. state%step /= state%tangent_step) state%tangent_projection = 0.0_wp
    end associate
    state%tangent_of = state%increments_done
    state%tangent_at = state%displacement
    state%tangent_dt = 0.0_wp
    state%tangent_step = state%step
    state%tangent_position = state%position
    state%first_forces = 0
  end subroutine keep_tangent

  !> Put the state into the list, or take it out: every component, a line each.
  subroutine archive_state(list, state)
    type(number_list_t), intent(inout) :: list
    type(state_t), intent(inout) :: state

    call archive(list, state%increments_done)
    call archive(list, state%step)
    call archive(list, state%increment)
    call archive(list, state%position)
    call archive(list, state%time)
    call archive(list, state%displacement)
    call archive_blocks(list, state%modes%amplitude, 3)
    call archive_blocks(list, state%modes%inverse, 9)
    call archive(list, state%rotation)
    call archive(list, state%reaction)
    call archive_flags(list, state%alone)
    call archive_flags(list, state%closed)
    call archive(list, state%trend)
    call archive(list, state%displacement_trend)
    call archive(list, state%tangent_of)
    call archive(list, state%first_forces)
    call archive(list, state%tangent_at)
    call archive(list, state%tangent_projection)
    call archive(list, state%tangent_dt)
    call archive(list, state%tangent_step)
    call archive(list, state%tangent_position)
    call archive(list, state%slip)
    call archive(list, state%external_force)
    call archive(list, state%support_force)
    call archive(list, state%velocity)
    call archive(list, state%acceleration)
    call archive(list, state%unopposed)
    call archive(list, state%mean_velocity)
    call archive(list, state%damping_force)
    call archive(list, state%damped)
    call archive(list, state%most_inertia)
    call archive(list, state%most_force)
    call archive(list, state%kinetic_energy)
    call archive(list, state%contact_work)
    call archive(list, state%begun_energy)
    call archive(list, state%by_body)
    call archive(list, state%twist)
    call archive(list, state%least_gain)
    call archive(list, state%largest_energy)
    call archive(list, state%external_work)
    call archive(list, state%dissipation)
    call archive(list, state%strain_energy)
  end subroutine archive_state

  !> The same of square blocks, not allocated where there are none.
  subroutine archive_blocks(list, blocks, n)
    type(number_list_t), intent(inout) :: list
    real(wp), allocatable, intent(inout) :: blocks(:, :, :) !! (n, n, n_elements)
    integer, intent(in) :: n
    real(wp), allocatable :: columns(:, :)

    if (allocated(blocks)) columns = reshape(blocks, [n*n, size(blocks, 3)])
    call archive(list, columns)
    if (allocated(columns)) blocks = reshape(columns, [n, n, size(columns, 2)])
  end subroutine archive_blocks

  !> The same of flags, not allocated where there are none.
  subroutine archive_flags(list, flags)
    type(number_list_t), intent(inout) :: list
    logical, allocatable, intent(inout) :: flags(:) !! (n)
    real(wp), allocatable :: columns(:, :)

    if (allocated(flags)) columns = reshape(merge(1.0_wp, 0.0_wp, flags), [1, size(flags)])
    call archive(list, columns)
    if (allocated(columns)) flags = columns(1, :) > 0.0_wp
  end subroutine archive_flags

  !> How many numbers of nodes, points and elements with modes at finite strain a state puts into
  !> the list at most.
  pure integer(i8) function most_numbers(n_nodes, n_points, n_modes, moves)
    integer, intent(in) :: n_nodes, n_points, n_modes
    logical, intent(in) :: moves !! a *STEP is dynamic

    most_numbers = 15_i8*n_nodes + 12_i8*n_points + 90_i8*n_modes
    if (moves) most_numbers = most_numbers + 15_i8*n_nodes
  end function most_numbers

  !> What it takes to go on from an increment: its state, that in coarser increments, prescribed
  !> displacements and which nodes were touched [bytes].
  pure integer(i8) function bytes_to_continue(n_nodes, n_points, n_modes, moves)
    integer, intent(in) :: n_nodes, n_points, n_modes
    logical, intent(in) :: moves !! as of most_numbers

    bytes_to_continue = 8*(2*most_numbers(n_nodes, n_points, n_modes, moves) + 4_i8*n_nodes)
  end function bytes_to_continue

  !> The longest of the summed slips of some points.
  pure real(wp) function largest_slip(state, first, last) result(largest)
    type(state_t), intent(in) :: state
    integer, intent(in) :: first, last !! points: a pair's

    largest = 0.0_wp
    if (last >= first) largest = maxval(norm2(state%slip(:, first:last), dim=1))
  end function largest_slip

end module state_mod
