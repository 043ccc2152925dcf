!> How far points slide past the sides of a sector (*CYCLIC SYMMETRY MODEL), beyond which they meet
!> nothing: in the whole body the next sector is there.
module sector_slips_mod
  use contact_points_mod, only: contact_points_t
  use kinds_mod, only: wp
  use scene_mod, only: scene_t
  use small_matrix_mod, only: cross
  implicit none
  private

  public :: past_side_t, find_past_sides

  real(wp), parameter :: pi = acos(-1.0_wp)

  !> The point that is the furthest past a side of its master.
  type :: past_side_t
    integer :: point = 0        !! 0: none is
    real(wp) :: share = 0.0_wp  !! of the sector's angle [-]
  end type past_side_t

  !> Nodes of both sides, and the turn from one to the other.
  type :: sides_t
    integer, allocatable :: node(:, :)        !! (2,n) on the side at 0, on that at the angle
    real(wp) :: axes(3, 3) = 0.0_wp           !! rows: across the axis, the third along it [-]
    real(wp) :: centre(3) = 0.0_wp            !! on the axis [length]
    real(wp) :: angle = 0.0_wp                !! of the sector, above 0 [rad]
  end type sides_t

contains

  !> The furthest point of slaves before bodies that follow them, none where a deck has no sector.
  pure type(past_side_t) function find_past_sides(scene, points, displacement) result(past)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    real(wp), intent(in) :: displacement(:, :) !! (3,n_nodes) [length]
    type(sides_t) :: sides
    real(wp) :: way, at_rest(3, scene%mesh%n_nodes)
    logical :: is_master(scene%mesh%n_nodes)
    integer :: pair, i

    sides = find_sides_of_sector(scene)
    if (size(sides%node, 2) == 0) return
    at_rest = 0.0_wp
    do pair = 1, size(scene%pairs)
      if (scene%pairs(pair)%master_surface == 0 .or. scene%pairs(pair)%small_sliding) cycle
      is_master = .false.
      is_master(scene%surfaces(scene%pairs(pair)%master_surface)%nodes) = .true.
      if (.not. (any(is_master(sides%node(1, :))) .and. any(is_master(sides%node(2, :))))) cycle
      do i = points%first(pair), points%first(pair + 1) - 1
        way = beyond(points%node(i), displacement) - max(0.0_wp, beyond(points%node(i), at_rest))
        if (way <= past%share*sides%angle) cycle
        past%share = way/sides%angle
        past%point = i
      end do
    end do

  contains

    !> How far a node is beyond the side that is nearest to it, of the master, as an angle [rad].
    pure real(wp) function beyond(node, u)
      integer, intent(in) :: node
      real(wp), intent(in) :: u(:, :) !! (3,n_nodes) [length]
      real(wp) :: here(3), there(3), nearest, distance, turn
      integer :: side, k

      here = place(node, u)
      beyond = 0.0_wp
      do side = 1, 2
        nearest = huge(1.0_wp)
        turn = 0.0_wp
        do k = 1, size(sides%node, 2)
          if (.not. is_master(sides%node(side, k))) cycle
          there = place(sides%node(side, k), u)
          distance = hypot(here(1) - there(1), here(3) - there(3))
          if (distance >= nearest) cycle
          nearest = distance
          turn = modulo(here(2) - there(2) + pi, 2.0_wp*pi) - pi
        end do
        if (side == 1) turn = -turn
        if (abs(turn) < 0.5_wp*sides%angle) beyond = max(beyond, turn)
      end do
    end function beyond

    !> Distance from the axis, angle, place along it.
    pure function place(node, u) result(x)
      integer, intent(in) :: node
      real(wp), intent(in) :: u(:, :)
      real(wp) :: x(3)

      x = matmul(sides%axes, scene%mesh%coordinates(:, node) + u(:, node) - sides%centre)
      x = [hypot(x(1), x(2)), atan2(x(2), x(1)), x(3)]
    end function place

  end function find_past_sides

  !> The sides of a sector, by its equations: those of a node, all of whose masters are one other
  !> node, turned about an axis. Of several models the first.
  pure type(sides_t) function find_sides_of_sector(scene) result(sides)
    type(scene_t), intent(in) :: scene
    real(wp), parameter :: rounding = 1.0e-9_wp !! of a rotation [-]
    real(wp) :: turn(3, 3), first_turn(3, 3), axis(3), middle(3), way(3), cosine
    integer :: c, k, partner
    logical :: is_one

    allocate (sides%node(2, 0))
    first_turn = 0.0_wp
    associate (all => scene%constraints)
      do c = 1, all%n - 2
        if (all%dof(c) /= 1 .or. any(all%node(c + 1:c + 2) /= all%node(c))) cycle
        if (any(all%dof(c + 1:c + 2) /= [2, 3]) .or. all%first(c + 1) == all%first(c)) cycle
        partner = all%master(all%first(c))
        turn = 0.0_wp
        is_one = all%master(all%first(c)) /= all%node(c)
        do k = all%first(c), all%first(c + 3) - 1
          is_one = is_one .and. all%master(k) == partner
          turn(all%dof(c + count(k >= all%first(c + 1:c + 2))), all%master_dof(k)) = all%weight(k)
        end do
        if (.not. is_one) cycle
        cosine = 0.5_wp*(turn(1, 1) + turn(2, 2) + turn(3, 3) - 1.0_wp)
        if (.not. is_rotation(turn) .or. cosine > 1.0_wp - rounding) cycle
        if (size(sides%node, 2) == 0) then
          first_turn = turn
          axis = axis_of(turn, cosine)
          way = scene%mesh%coordinates(:, all%node(c)) - scene%mesh%coordinates(:, partner)
          way = way - dot_product(way, axis)*axis
          if (.not. norm2(way) > 0.0_wp) cycle
          sides%angle = acos(max(-1.0_wp, cosine))
          middle = 0.5_wp*(scene%mesh%coordinates(:, all%node(c)) + scene%mesh%coordinates(:, &
            partner))
          sides%centre = middle + cross(axis, way)/(2.0_wp*tan(0.5_wp*sides%angle))
          sides%axes(3, :) = axis
          sides%axes(1, :) = way/norm2(way)
          sides%axes(2, :) = cross(axis, sides%axes(1, :))
        end if
        if (maxval(abs(turn - first_turn)) > rounding) cycle
        sides%node = reshape([sides%node, partner, all%node(c)], [2, size(sides%node, 2) + 1])
      end do
    end associate

  contains

    pure logical function is_rotation(q)
      real(wp), intent(in) :: q(3, 3)

      is_rotation = norm2(cross(q(:, 1), q(:, 2)) - q(:, 3)) <= rounding .and. abs(norm2(q(:, 1)) &
        - 1.0_wp) <= rounding .and. abs(dot_product(q(:, 1), q(:, 2))) <= rounding .and. &
        abs(norm2(q(:, 2)) - 1.0_wp) <= rounding
    end function is_rotation

    !> The axis about which a rotation turns, by an angle from 0 to half a turn.
    pure function axis_of(q, cosine) result(axis)
      real(wp), intent(in) :: q(3, 3), cosine
      real(wp) :: axis(3), square(3, 3)
      integer :: i

      axis = [q(3, 2) - q(2, 3), q(1, 3) - q(3, 1), q(2, 1) - q(1, 2)]
      if (norm2(axis) <= 1.0e-6_wp) then ! half a turn: 2 a a^T - 1
        square = q
        do i = 1, 3
          square(i, i) = square(i, i) - cosine
        end do
        axis = square(:, maxloc(sum(square**2, dim=1), dim=1))
      end if
      axis = axis/norm2(axis)
    end function axis_of

  end function find_sides_of_sector

end module sector_slips_mod
