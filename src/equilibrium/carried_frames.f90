!> Frames of points through an increment: those of its beginning, turned as the normals turn.
module carried_frames_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: cross
  use mesh_mod, only: mesh_t
  use sectors_mod, only: no_slip_along
  use contact_points_mod, only: contact_points_t, is_before_faces
  use local_frame_mod, only: local_frame, transport_tangent
  implicit none
  private

  public :: carried_frame, turn_of_tangents, slips_around, outer

contains

  !> The frame of a point whose normal has turned, from that where the increment began: by the
  !> smallest rotation, so that what is kept in it does not jump. On a body of revolution or a plate
  !> there is but one.
  pure function carried_frame(began, normal, around) result(frame)
    real(wp), intent(in) :: began(3, 3), normal(3), around(3) !! the last as of local_frame
    real(wp) :: frame(3, 3)
    integer :: a

    if (any(abs(around) > 0.0_wp) .or. is_far(began, normal)) then
      frame = local_frame(normal, around)
      return
    end if
    frame(:, 1) = normal
    do a = 2, 3
      frame(:, a) = transport_tangent(began(:, a), began(:, 1), normal)
    end do
  end function carried_frame

  !> Whether a normal has turned so far that the smallest rotation says little.
  pure logical function is_far(began, normal)
    real(wp), intent(in) :: began(3, 3), normal(3)

    is_far = dot_product(began(:, 1), normal) < -0.9_wp
  end function is_far

  !> What tangents of `carried_frame` change by as the normal turns.
  pure function turn_of_tangents(began, normal, around) result(by)
    real(wp), intent(in) :: began(3, 3), normal(3), around(3) !! as of carried_frame
    real(wp) :: by(3, 3, 2)
    real(wp) :: along, cosine
    integer :: a, i

    by = 0.0_wp
    if (any(abs(around) > 0.0_wp)) then
      do i = 1, 3
        by(:, i, 1) = cross(around, real(merge([1, 1, 1], [0, 0, 0], [1, 2, 3] == i), wp))
      end do
      return
    end if
    if (is_far(began, normal)) return
    cosine = 1.0_wp + dot_product(began(:, 1), normal)
    do a = 1, 2
      associate (t => began(:, a + 1), from => began(:, 1))
        along = dot_product(t, normal)/cosine
        by(:, :, a) = -outer(from + normal, (t - along*from)/cosine)
        do i = 1, 3
          by(i, i, a) = by(i, i, a) - along
        end do
      end associate
    end do
  end function turn_of_tangents

  !> Around what nothing slips at a point, as of local_frame.
  pure function slips_around(mesh, points, i) result(around)
    type(mesh_t), intent(in) :: mesh
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: i
    real(wp) :: around(3)

    around = no_slip_along(mesh, points%node(i), is_before_faces(points, i))
  end function slips_around

  !> The product of a column and a row.
  pure function outer(one, other) result(product)
    real(wp), intent(in) :: one(:), other(:)
    real(wp) :: product(size(one), size(other))

    product = spread(one, 2, size(other))*spread(other, 1, size(one))
  end function outer

end module carried_frames_mod
