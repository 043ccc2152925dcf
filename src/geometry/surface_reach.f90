!> How far apart the faces of two surfaces are looked for, and whether they are turned towards each
!> other.
module surface_reach_mod
  use kinds_mod, only: wp
  use connectivity_mod, only: corners_in
  use face_overlap_mod, only: outward_normal
  implicit none
  private

  public :: reach_of_faces, reach_of_all, deep_in, largest_face, face_each_other, look_away, against
  public :: share_of_sight, straightness

  real(wp), parameter :: against = -0.2_wp !! cosine of normals that face each other, at most
  real(wp), parameter :: cos_30 = 0.866_wp, cos_45 = 0.707_wp !! [-]

contains

  !> Half the largest face: how far apart the faces of two surfaces at rest are looked for.
  pure real(wp) function reach_of_faces(slave, master, x) result(reach)
    integer, intent(in) :: slave(:, :), master(:, :) !! (4,n) the fourth is 0 in a triangle
    real(wp), intent(in) :: x(:, :)      !! (3,n_nodes) [length]

    reach = 0.5_wp*max(largest_face(slave, x), largest_face(master, x))
  end function reach_of_faces

  !> How deep places of a surface are looked for in another: across slanted faces what overlaps
  !> seems deeper than it is. Of surfaces that touch, what rounding makes.
  pure real(wp) function deep_in(depth, reach)
    real(wp), intent(in) :: depth    !! from the deck, and by motion [length]
    real(wp), intent(in) :: reach    !! before the slave [length]
    real(wp), parameter :: slant = 2.0_wp, rounding = 1.0e-6_wp !! [-]

    deep_in = slant*depth + rounding*reach
  end function deep_in

  !> How far apart the farthest places of two surfaces are, at most.
  pure real(wp) function reach_of_all(slave_nodes, master_nodes, x) result(reach)
    integer, intent(in) :: slave_nodes(:), master_nodes(:)
    real(wp), intent(in) :: x(:, :)      !! (3,n_nodes) [length]

    associate (s => x(:, slave_nodes), m => x(:, master_nodes))
      reach = norm2(max(maxval(s, 2), maxval(m, 2)) - min(minval(s, 2), minval(m, 2)))
    end associate
  end function reach_of_all

  !> The longest diagonal of the boxes of faces.
  pure real(wp) function largest_face(faces, x) result(length)
    integer, intent(in) :: faces(:, :)   !! (4,n_faces)
    real(wp), intent(in) :: x(:, :)      !! (3,n_nodes) [length]
    real(wp) :: low(3), high(3)
    integer :: f, k

    ! Of 10^5 facets, in each placement: sections by vector subscripts would be copied.
    length = 0.0_wp
    do f = 1, size(faces, 2)
      low = x(:, faces(1, f))
      high = low
      do k = 2, corners_in(faces(:, f))
        low = min(low, x(:, faces(k, f)))
        high = max(high, x(:, faces(k, f)))
      end do
      length = max(length, sum((high - low)**2))
    end do
    length = sqrt(length)
  end function largest_face

  !> How much of what two faces see of each other counts: all up to 45 degrees, from there on less,
  !> nothing where they begin to face each other. docs/theory.md (11.37).
  pure real(wp) function share_of_sight(cosine) result(share)
    real(wp), intent(in) :: cosine   !! of their normals [-]

    share = max(0.0_wp, min(1.0_wp, (against - cosine)/(cos_45 + against)))
  end function share_of_sight

  !> How much of that is turned straight towards the other: all up to 30 degrees, nothing at 45.
  !> What leans by more counts as it rises, below 0. docs/theory.md (11.35).
  pure real(wp) function straightness(cosine) result(part)
    real(wp), intent(in) :: cosine   !! of their normals, at most `against` [-]

    part = min(1.0_wp, (-cosine - cos_45)/(cos_30 - cos_45))
    if (part < 0.0_wp) part = 1.0_wp - max(1.0_wp, sqrt(max(0.0_wp, 1.0_wp - cosine**2))/(-cosine))
  end function straightness

  !> Whether any face of one surface is turned towards any of the other: if not they never touch.
  pure logical function face_each_other(slave, master, x) result(they_do)
    integer, intent(in) :: slave(:, :), master(:, :) !! (4,n) the fourth is 0 in a triangle
    real(wp), intent(in) :: x(:, :)      !! (3,n_nodes) [length]
    real(wp) :: normal(3, size(master, 2)), n(3)
    integer :: f, k

    do f = 1, size(master, 2)
      normal(:, f) = outward_normal(x(:, master(:corners_in(master(:, f)), f)))
    end do
    they_do = .true.
    do f = 1, size(slave, 2)
      n = outward_normal(x(:, slave(:corners_in(slave(:, f)), f)))
      do k = 1, size(master, 2)
        if (dot_product(n, normal(:, k)) <= against) return
      end do
    end do
    they_do = .false.
  end function face_each_other

  !> Whether no face of one surface has a part before one of the other that has a part before it:
  !> where all are turned away they never touch.
  pure logical function look_away(slave, master, x) result(they_do)
    integer, intent(in) :: slave(:, :), master(:, :) !! (4,n) the fourth is 0 in a triangle
    real(wp), intent(in) :: x(:, :)      !! (3,n_nodes) [length]
    real(wp) :: normal(3, size(master, 2)), n(3)
    real(wp), parameter :: rounding = 1.0e-9_wp !! of a face [-]
    integer :: f, k

    do f = 1, size(master, 2)
      normal(:, f) = outward_normal(x(:, master(:corners_in(master(:, f)), f)))
    end do
    they_do = .false.
    do f = 1, size(slave, 2)
      associate (of_slave => x(:, slave(:corners_in(slave(:, f)), f)))
        n = outward_normal(of_slave)
        do k = 1, size(master, 2)
          if (dot_product(n, normal(:, k)) > against) cycle
          associate (of_master => x(:, master(:corners_in(master(:, k)), k)))
            if (has_part_before(n, of_slave, of_master) .and. has_part_before(normal(:, k), &
              of_master, of_slave)) return
          end associate
        end do
      end associate
    end do
    they_do = .true.

  contains

    pure logical function has_part_before(normal, face, other) result(has)
      real(wp), intent(in) :: normal(3), face(:, :), other(:, :) !! of the face; corners [length]

      has = maxval(matmul(normal, other)) - minval(matmul(normal, face)) > &
        -rounding*norm2(face(:, 3) - face(:, 1))
    end function has_part_before

  end function look_away

end module surface_reach_mod
