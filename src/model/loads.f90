!> What the deck prescribes over its steps: displacements, forces, pressures, amplitudes.
module loads_mod
  use kinds_mod, only: wp
  implicit none
  private

  public :: amplitude_t, nodal_value_t, pressure_t, gravity_t, load_step_t, amplitude_value

  !> A table of values over a step's own time, linear between its points, constant outside.
  type :: amplitude_t
    character(:), allocatable :: name
    real(wp), allocatable :: time(:)   !! ascending
    real(wp), allocatable :: value(:)
  end type amplitude_t

  !> A displacement or a force of one degree of freedom.
  type :: nodal_value_t
    integer  :: node = 0            !! node number
    integer  :: dof = 0             !! 1, 2, 3
    real(wp) :: value = 0.0_wp      !! at the end of the step, or times the amplitude
    integer  :: amplitude = 0 !! index into the scene's amplitudes; 0: ramp from the last value
  end type nodal_value_t

  !> A pressure on a surface of faces, positive into the body.
  type :: pressure_t
    integer  :: surface = 0         !! index into the scene's surfaces
    real(wp) :: value = 0.0_wp      !! [force/length^2]
    integer  :: amplitude = 0       !! as above
  end type pressure_t

  !> The weight of some elements: density times acceleration a unit of volume.
  type :: gravity_t
    integer  :: region = 0               !! index into the scene's regions
    real(wp) :: acceleration(3) = 0.0_wp !! [length/time^2]
    integer  :: amplitude = 0            !! as above
  end type gravity_t

  !> One *STEP: its increments, and what it changes. What it does not name stays as it was.
  type :: load_step_t
    real(wp) :: period = 1.0_wp
    real(wp) :: increment = 1.0_wp
    integer  :: n_increments = 1
    logical  :: direct = .false.                !! keep the increments as they are
    logical  :: replace_boundary = .false.      !! OP=NEW: earlier ones end here, rotations too
    logical  :: replace_forces = .false.
    logical  :: replace_pressures = .false.
    logical  :: replace_element_loads = .false. !! OP=NEW of *DLOAD
    type(nodal_value_t), allocatable :: boundary(:)  !! of one node and dof the last counts
    type(nodal_value_t), allocatable :: rotations(:)
    !! of reference nodes: dof 1, 2, 3 are the components of a rotation vector [rad]
    type(nodal_value_t), allocatable :: forces(:)    !! of one node and dof they add up
    type(pressure_t),    allocatable :: pressures(:) !! *DSLOAD; of one surface they add up
    type(pressure_t),    allocatable :: face_pressures(:) !! *DLOAD P1..P6; they add up as well
    type(gravity_t),     allocatable :: gravity(:)   !! *DLOAD GRAV; of one region they add up
  end type load_step_t

contains

  !> The value of `amplitude` at `time` (of the step).
  pure function amplitude_value(amplitude, time) result(value)
    type(amplitude_t), intent(in) :: amplitude
    real(wp), intent(in) :: time
    real(wp) :: value, fraction
    integer :: n, i

    n = size(amplitude%time)
    if (time <= amplitude%time(1)) then
      value = amplitude%value(1)
      return
    end if
    value = amplitude%value(n)
    do i = 2, n
      if (time >= amplitude%time(i)) cycle
      fraction = (time - amplitude%time(i - 1))/(amplitude%time(i) - amplitude%time(i - 1))
      value = (1.0_wp - fraction)*amplitude%value(i - 1) + fraction*amplitude%value(i)
      return
    end do
  end function amplitude_value

end module loads_mod
