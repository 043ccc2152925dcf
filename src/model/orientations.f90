!> The axes of a material that is not isotropic, as *ORIENTATION gives them.
module orientations_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: cross
  implicit none
  private

  public :: orientation_t, no_orientation, rectangular, cylindrical, has_directions, directions_at

  integer, parameter :: no_orientation = 0 !! x, y, z
  integer, parameter :: rectangular = 1    !! a on axis 1, b in the plane of axes 1 and 2
  integer, parameter :: cylindrical = 2    !! a and b on the axis; radial, tangential, axial

  !> As the deck has it.
  type :: orientation_t
    integer :: kind = no_orientation
    real(wp) :: a(3) = 0.0_wp, b(3) = 0.0_wp, origin(3) = 0.0_wp !! of the deck [length]
    integer :: turned_about = 3     !! this axis of its own, afterwards
    real(wp) :: angle = 0.0_wp      !! [rad]
  end type orientation_t

  real(wp), parameter :: apart = 1.0e-8_wp !! sine of the least angle between two directions [-]

contains

  !> Whether the points give directions.
  pure logical function has_directions(orientation) result(ok)
    type(orientation_t), intent(in) :: orientation

    associate (a => orientation%a, b => orientation%b, origin => orientation%origin)
      select case (orientation%kind)
      case (rectangular)
        ok = norm2(cross(a - origin, b - origin)) > apart*norm2(a - origin)*norm2(b - origin)
      case (cylindrical)
        ok = norm2(b - a) > epsilon(1.0_wp)*max(norm2(a), norm2(b))
      case default
        ok = .true.
      end select
    end associate
  end function has_directions

  !> The axes at a place, columns. On the axis of a cylinder no direction is radial: 0.
  pure function directions_at(orientation, place) result(axes)
    type(orientation_t), intent(in) :: orientation !! that has directions
    real(wp), intent(in) :: place(3)               !! in the deck [length]
    real(wp) :: axes(3, 3)                         !! [-]
    real(wp) :: from_axis(3), first(3)
    integer :: i, j

    axes = reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [3, 3])
    associate (a => orientation%a, b => orientation%b, origin => orientation%origin)
      select case (orientation%kind)
      case (rectangular)
        axes(:, 1) = (a - origin)/norm2(a - origin)
        axes(:, 3) = cross(a - origin, b - origin)
        axes(:, 3) = axes(:, 3)/norm2(axes(:, 3))
      case (cylindrical)
        axes(:, 3) = (b - a)/norm2(b - a)
        from_axis = place - a
        first = from_axis - dot_product(from_axis, axes(:, 3))*axes(:, 3)
        if (norm2(first) <= apart*norm2(b - a)) then
          axes = 0.0_wp
          return
        end if
        axes(:, 1) = first/norm2(first)
      case default
        continue
      end select
    end associate
    axes(:, 2) = cross(axes(:, 3), axes(:, 1))
    if (.not. abs(orientation%angle) > 0.0_wp) return
    i = 1 + mod(orientation%turned_about, 3)
    j = 1 + mod(i, 3)
    first = axes(:, i)
    axes(:, i) = cos(orientation%angle)*first + sin(orientation%angle)*axes(:, j)
    axes(:, j) = cos(orientation%angle)*axes(:, j) - sin(orientation%angle)*first
  end function directions_at

end module orientations_mod
