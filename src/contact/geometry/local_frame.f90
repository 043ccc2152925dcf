!> Local frames of the contact points, and what turns from one to another.
module local_frame_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: cross
  implicit none
  private

  public :: local_frame, transport_tangent, straight

  real(wp), parameter :: straight = 1.0e-12_wp !! a direction cosine below this is 0

contains

  !> The local frame of a normal: t1 is the global x axis projected on the tangent plane (the y axis
  !> where the normal is within 45 degrees of x), t2 = n x t1.
  !>
  !> On a body of revolution t1 is in the half plane of the axis, on a plate in its plane. Nothing
  !> slips around the axis, or across the plate: t2 is 0, and has no row.
  pure function local_frame(normal, around) result(frame)
    real(wp), intent(in) :: normal(3)  !! unit vector
    real(wp), intent(in), optional :: around(3)
    !! unit vector around the axis of a body of revolution, or across a plate; 0: it is neither
    real(wp) :: frame(3, 3)            !! columns n, t1, t2
    real(wp) :: axis(3), t1(3)

    if (present(around)) then
      if (any(abs(around) > 0.0_wp)) then
        t1 = cross(around, normal)
        frame(:, 1) = normal
        frame(:, 2) = t1/norm2(t1)
        frame(:, 3) = 0.0_wp
        return
      end if
    end if
    axis = [1.0_wp, 0.0_wp, 0.0_wp]
    if (2.0_wp*normal(1)**2 > 1.0_wp) axis = [0.0_wp, 1.0_wp, 0.0_wp]
    t1 = axis - dot_product(axis, normal)*normal
    t1 = t1/norm2(t1)
    frame(:, 1) = normal
    frame(:, 2) = t1
    frame(:, 3) = cross(normal, t1)
  end function local_frame

  !> A tangent vector carried from one tangent plane to another by the smallest rotation.
  pure function transport_tangent(v, from, to) result(carried)
    real(wp), intent(in) :: v(3)        !! tangential to the plane of `from`
    real(wp), intent(in) :: from(3)     !! unit normal
    real(wp), intent(in) :: to(3)       !! unit normal, not opposite
    real(wp) :: carried(3), cosine

    cosine = dot_product(from, to)
    carried = v
    if (cosine <= -1.0_wp) return
    carried = v - dot_product(v, to)/(1.0_wp + cosine)*(from + to)
  end function transport_tangent

end module local_frame_mod
