!> Steps between what a slave face sees of several faces, and the concave edges of a master, for the
!> certificate. No mean over either says anything, whichever faces the increment took for one side
!> of the master. docs/theory.md section 6.
module seen_borders_mod
  use kinds_mod, only: wp
  use veils_mod, only: triangle_t
  implicit none
  private

  public :: view_t, have_common, sees_step, is_concave

  !> What is seen of a piece of the master in the plane of a piece of the slave face.
  type :: view_t
    type(triangle_t), allocatable :: seen(:)
    real(wp) :: height(3) = 0.0_wp !! above the plane at its origin, and its slopes [length, -]
    real(wp) :: normal(3) = 0.0_wp !! outward, of the master's piece [-]
  end type view_t

contains

  !> Whether one face ends above another that looks the same way, beside it as the slave sees them:
  !> by more than curved faces of unlike meshes do. Asked of what no faces between both connect.
  pure logical function sees_step(one, other, extent)
    type(view_t), intent(in) :: one, other
    real(wp), intent(in) :: extent            !! of the slave face [length]
    ! Wider strips between both are bare, as points with less are not compared; higher steps are no
    ! matter of meshes, as chords of 4 degrees of an arc are 0.01 off it; cosine of normals.
    real(wp), parameter :: beside = 0.05_wp, flush = 0.01_wp, alike = 0.5_wp !! [-]

    sees_step = dot_product(one%normal, other%normal) > alike
    if (sees_step) sees_step = max(highest(one, other, beside*extent), highest(other, one, &
      beside*extent)) > flush*extent
  end function sees_step

  !> Whether faces have a corner of both.
  pure logical function have_common(one, other)
    integer, intent(in) :: one(4), other(4) !! these corners, 0 behind them
    integer :: k

    have_common = any([(one(k) > 0 .and. any(other == one(k)), k=1, 4)])
  end function have_common

  !> How far apart two faces are at most, at corners of what is seen of one that are near to what is
  !> seen of the other; below 0 where none is.
  pure real(wp) function highest(one, other, near)
    type(view_t), intent(in) :: one, other
    real(wp), intent(in) :: near              !! [length]
    real(wp) :: place(2), found(2), distance
    integer :: i, k, j

    highest = -1.0_wp
    do i = 1, size(one%seen)
      do k = 1, 3
        distance = near
        place = 0.0_wp
        associate (p => one%seen(i)%x(:, k))
          do j = 1, size(other%seen)
            found = nearest_in(p, other%seen(j))
            if (.not. norm2(found - p) < distance) cycle
            distance = norm2(found - p)
            place = found
          end do
          if (distance < near) highest = max(highest, abs(one%height(1) - other%height(1) + &
            dot_product(one%height(2:), p) - dot_product(other%height(2:), place)))
        end associate
      end do
    end do
  end function highest

  !> The place of a triangle that is nearest.
  pure function nearest_in(p, triangle) result(place)
    real(wp), intent(in) :: p(2)              !! [length]
    type(triangle_t), intent(in) :: triangle
    real(wp) :: place(2)                      !! [length]
    real(wp) :: aside(3), on_edge(2, 3)
    integer :: k

    do k = 1, 3
      associate (along => triangle%x(:, 1 + mod(k, 3)) - triangle%x(:, k), &
                 arm => p - triangle%x(:, k))
        aside(k) = along(1)*arm(2) - along(2)*arm(1)
        on_edge(:, k) = triangle%x(:, k) + along*max(0.0_wp, min(1.0_wp, dot_product(arm, along)/ &
          max(sum(along**2), tiny(1.0_wp))))
      end associate
    end do
    place = p
    if (minval(aside) >= 0.0_wp .or. maxval(aside) <= 0.0_wp) return
    place = on_edge(:, minloc(norm2(on_edge - spread(p, 2, 3), dim=1), dim=1))
  end function nearest_in

  !> Whether two faces meet along an edge of one and are turned towards each other by more than 30
  !> degrees.
  pure logical function is_concave(one, other, n, m)
    real(wp), intent(in) :: one(:, :), other(:, :) !! (3,3) or (3,4) corners [length]
    real(wp), intent(in) :: n(3), m(3)             !! their outward normals [-]
    real(wp), parameter :: cos_30 = 0.866_wp

    is_concave = dot_product(n, m) < cos_30
    if (is_concave) is_concave = stands_on(one, n, other, m) .or. stands_on(other, m, one, n)
  end function is_concave

  !> Whether an edge of a wall is on a floor before which the wall lies. If it is at an edge of the
  !> floor this must lie before the wall, too.
  pure logical function stands_on(floor, n, wall, m)
    real(wp), intent(in) :: floor(:, :), wall(:, :) !! as of is_concave [length]
    real(wp), intent(in) :: n(3), m(3)              !! the same [-]
    real(wp), parameter :: folded = 1.0e-3_wp
    !! sine of an angle: the two sides of a sheet; 370 random decks end alike with 1e-4 to 1e-2 [-]
    real(wp), parameter :: off = 1.0e-4_wp
    !! of an edge: what a deck's digits make; 370 random decks end alike with 1e-5 to 1e-3 [-]
    real(wp) :: arm(3), within
    integer :: k

    arm = sum(wall, 2)/size(wall, 2) - sum(floor, 2)/size(floor, 2)
    stands_on = .false.
    if (.not. dot_product(n, arm) > folded*norm2(arm)) return
    do k = 1, size(wall, 2)
      associate (first => wall(:, k), last => wall(:, 1 + mod(k, size(wall, 2))))
        within = min(depth_in(floor, n, 0.5_wp*(first + last)), depth_in(floor, n, 0.4_wp*first + &
          0.6_wp*last))
      end associate
      if (within < -off) cycle
      stands_on = stands_on .or. within > off .or. -dot_product(m, arm) > folded*norm2(arm)
    end do
  end function stands_on

  !> How far inside its edges a place is on a face, beside the shortest of these; far outside where
  !> it is not on it.
  pure real(wp) function depth_in(face, n, place) result(depth)
    real(wp), intent(in) :: face(:, :), n(3)    !! as of is_concave [length], [-]
    real(wp), intent(in) :: place(3)            !! [length]
    real(wp) :: along(3), shortest, warp, middle(3)
    integer :: i

    middle = sum(face, 2)/size(face, 2)
    warp = maxval(abs(matmul(n, face - spread(middle, 2, size(face, 2)))))
    shortest = huge(shortest)
    depth = huge(depth)
    do i = 1, size(face, 2)
      along = face(:, 1 + mod(i, size(face, 2))) - face(:, i)
      shortest = min(shortest, norm2(along))
      associate (arm => place - face(:, i))
        depth = min(depth, dot_product([n(2)*along(3) - n(3)*along(2), n(3)*along(1) - n(1)* &
          along(3), n(1)*along(2) - n(2)*along(1)], arm)/max(norm2(along), tiny(1.0_wp)))
      end associate
    end do
    depth = depth/max(shortest, tiny(1.0_wp))
    if (abs(dot_product(n, place - middle)) > warp + 1.0e-4_wp*shortest) depth = -1.0_wp
  end function depth_in

end module seen_borders_mod
