!> What each kind of obstacle is like: distance and normal, how near it may come, what of it is flat
!> or round. Nothing else branches on kinds.
!>
!> A kind that is not known here has gaps that are no numbers, and `check_shapes` refuses it. Of
!> facets a point alone has no gap: they are placed as surfaces are (facet_mortar_mod).
module obstacle_shapes_mod
  use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan
  use kinds_mod, only: wp
  use errors_mod, only: error_t, raise, exit_machine
  use text_mod, only: to_text
  use connectivity_mod, only: corners_in
  use rotations_mod, only: rotation_matrix
  use small_matrix_mod, only: cross, perpendicular_to
  use obstacles_mod, only: obstacle_t, obstacle_plane, obstacle_sphere, obstacle_cylinder, &
    obstacle_facets
  use scene_mod, only: contact_pair_t, scene_t
  implicit none
  private

  public :: known_kinds, check_shapes, shift_of, turned, locate_point, &
    follow_point, rounding_at_rest, bend_of_gap, &
    least_gap, is_flat, &
    is_meshed, has_meshed_master, is_before_faces, has_fixed_normals, has_round_master, &
    has_flat_facets, &
    turns_in_place, normal_along, enters_faces, get_core, extent_of, holds_turned_away, &
    how_to_turn_round, shape_code, shape_codes, is_same_along

  integer, parameter :: known_kinds(4) = [obstacle_plane, obstacle_sphere, obstacle_cylinder, &
    obstacle_facets]
  character(*), parameter :: shape_codes = '1: plane, 2: sphere, 3: cylinder, 4: facets'

contains

  !> The kind of an obstacle as result files have it, by its place in `known_kinds`: `shape_codes`.
  pure integer function shape_code(obstacle)
    type(obstacle_t), intent(in) :: obstacle

    shape_code = findloc(known_kinds, obstacle%kind, dim=1)
  end function shape_code

  !> Refuse obstacles of which nothing is known here.
  pure subroutine check_shapes(obstacles, error)
    type(obstacle_t), intent(in) :: obstacles(:)
    type(error_t), allocatable, intent(out) :: error
    integer :: i

    do i = 1, size(obstacles)
      if (any(known_kinds == obstacles(i)%kind)) cycle
      call raise(error, exit_machine, 'bipot: error: obstacle '//obstacles(i)%name// &
        ' is of kind '//to_text(obstacles(i)%kind)//', which has no shape')
      return
    end do
  end subroutine check_shapes

  !> How far an obstacle has moved: with its reference node.
  pure function shift_of(obstacle, u) result(shift)
    type(obstacle_t), intent(in) :: obstacle
    real(wp), intent(in) :: u(:, :)    !! (3,n_nodes) [length]
    real(wp) :: shift(3)               !! [length]

    shift = 0.0_wp
    if (obstacle%ref_node > 0) shift = u(:, obstacle%ref_node)
  end function shift_of

  !> The obstacle as it stands when it has turned about its reference node.
  pure type(obstacle_t) function turned(obstacle, rotation, pivot)
    type(obstacle_t), intent(in) :: obstacle !! as the deck places it
    real(wp), intent(in) :: rotation(3)      !! rotation vector [rad]
    real(wp), intent(in) :: pivot(3)         !! the reference node, undeformed [length]
    real(wp) :: r(3, 3)
    integer :: i

    turned = obstacle
    if (.not. any(abs(rotation) > 0.0_wp)) return
    r = rotation_matrix(rotation)
    turned%point = pivot + matmul(r, obstacle%point - pivot)
    turned%normal = matmul(r, obstacle%normal)
    if (is_meshed(obstacle)) then
      do i = 1, size(obstacle%corner, 2)
        turned%corner(:, i) = pivot + matmul(r, obstacle%corner(:, i) - pivot)
      end do
    end if
    ! A sphere has none.
    if (norm2(turned%normal) > 0.0_wp) turned%normal = turned%normal/norm2(turned%normal)
  end function turned

  !> Distance of a point in space from the obstacle, and the normal at the closest point of it.
  !>
  !> At the centre of a sphere, or on the axis of a cylinder, every normal is as good as any other.
  pure subroutine locate_point(obstacle, shift, x, gap, normal)
    type(obstacle_t), intent(in) :: obstacle
    real(wp), intent(in)  :: shift(3)  !! how far the obstacle has moved [length]
    real(wp), intent(in)  :: x(3)      !! the point [length]
    real(wp), intent(out) :: gap       !! signed distance, negative inside the obstacle [length]
    real(wp), intent(out) :: normal(3) !! unit vector from the obstacle to the body [-]
    real(wp) :: arm(3), distance

    arm = x - obstacle%point - shift
    select case (obstacle%kind)
    case (obstacle_plane)
      gap = dot_product(obstacle%normal, arm)
      normal = obstacle%normal
      return
    case (obstacle_sphere)
      continue
    case (obstacle_cylinder)
      arm = arm - dot_product(arm, obstacle%normal)*obstacle%normal
    case default
      gap = ieee_value(gap, ieee_quiet_nan)
      normal = gap
      return
    end select
    distance = norm2(arm)
    if (distance > 0.0_wp) then
      normal = arm/distance
    else
      normal = perpendicular_to(obstacle%normal)
    end if
    gap = distance - obstacle%radius
    if (.not. obstacle%inner) return
    gap = -gap
    normal = -normal
  end subroutine locate_point

  !> The same of a point that has moved: its gap at rest, none where that is rounding, and what it
  !> has changed by, which keeps the digits of small displacements. docs/theory.md (12.4).
  !>
  !> The change is the relative displacement along the mean of the normals then and now, each with
  !> its distance from centre or axis: (b - a).(b + a)/(|b| + |a|) of the arms a and b. Where there
  !> is neither, it is the difference of the gaps.
  pure subroutine follow_point(obstacle, shift, x, u, rounding, gap, normal)
    type(obstacle_t), intent(in) :: obstacle
    real(wp), intent(in)  :: shift(3)  !! how far the obstacle has moved [length]
    real(wp), intent(in)  :: x(3)      !! the point at rest [length]
    real(wp), intent(in)  :: u(3)      !! how far it has moved [length]
    real(wp), intent(in)  :: rounding  !! of gaps at rest [length]
    real(wp), intent(out) :: gap       !! as of locate_point [length]
    real(wp), intent(out) :: normal(3) !! there [-]
    real(wp), parameter :: stays(3) = 0.0_wp
    real(wp) :: at_rest, before(3), arms(2)

    call locate_point(obstacle, stays, x, at_rest, before)
    call locate_point(obstacle, shift, x + u, gap, normal)
    select case (obstacle%kind)
    case (obstacle_plane)
      arms = 1.0_wp
    case (obstacle_sphere, obstacle_cylinder)
      arms = max(0.0_wp, obstacle%radius + merge(-1.0_wp, 1.0_wp, obstacle%inner)*[at_rest, gap])
    case default
      arms = 0.0_wp
    end select
    if (.not. sum(arms) > 0.0_wp) return
    if (abs(at_rest) <= rounding) at_rest = 0.0_wp
    gap = at_rest + dot_product(u - shift, (arms(1)*before + arms(2)*normal)/sum(arms))
  end subroutine follow_point

  !> Distances that are none in the undeformed mesh: places are rounded. docs/theory.md (12.4).
  pure real(wp) function rounding_at_rest(scene) result(rounding)
    type(scene_t), intent(in) :: scene
    integer :: i

    rounding = maxval(abs(scene%mesh%coordinates))
    do i = 1, size(scene%obstacles)
      rounding = max(rounding, extent_of(scene%obstacles(i)))
    end do
    rounding = 16.0_wp*epsilon(1.0_wp)*rounding
  end function rounding_at_rest

  !> The second derivative of the gap by the place of the point, (I - n n^T - a a^T)/distance from
  !> centre or axis (a, of a cylinder alone), negative inside; 0 before what is flat.
  pure function bend_of_gap(obstacle, shift, x) result(bend)
    type(obstacle_t), intent(in) :: obstacle
    real(wp), intent(in) :: shift(3), x(3) !! as of locate_point [length]
    real(wp) :: bend(3, 3)                 !! [1/length]
    real(wp) :: arm(3), distance, normal(3), gap
    integer :: i

    bend = 0.0_wp
    if (all(obstacle%kind /= [obstacle_sphere, obstacle_cylinder])) return
    arm = x - obstacle%point - shift
    do i = 1, 3
      bend(i, i) = 1.0_wp
    end do
    if (obstacle%kind == obstacle_cylinder) then
      arm = arm - dot_product(arm, obstacle%normal)*obstacle%normal
      bend = bend - spread(obstacle%normal, 2, 3)*spread(obstacle%normal, 1, 3)
    end if
    call locate_point(obstacle, shift, x, gap, normal)
    bend = bend - spread(normal, 2, 3)*spread(normal, 1, 3)
    distance = norm2(arm)
    bend = bend/max(distance, tiny(1.0_wp)**0.25_wp)
    if (obstacle%inner) bend = -bend
  end function bend_of_gap

  !> Whether a face lies inside an obstacle at rest, and is turned away from its surface: its body
  !> is on the wrong side. (One that only overlaps has its faces turned towards the obstacle.)
  pure logical function holds_turned_away(obstacle, corner, normal) result(holds)
    type(obstacle_t), intent(in) :: obstacle
    real(wp), intent(in) :: corner(:, :) !! (3,3) or (3,4) of the face [length]
    real(wp), intent(in) :: normal(3)    !! unit vector out of its body [-]
    real(wp), parameter :: at_rest(3) = 0.0_wp
    real(wp), parameter :: away = 0.2_wp        !! cosine of normals that do not face each other
    real(wp), parameter :: rounding = 1.0e-6_wp !! of the face: a gap that is none [-]
    real(wp) :: gap, along(3)
    integer :: i

    call locate_point(obstacle, at_rest, sum(corner, 2)/real(size(corner, 2), wp), gap, along)
    holds = dot_product(along, normal) > away
    do i = 1, size(corner, 2)
      if (.not. holds) return
      call locate_point(obstacle, at_rest, corner(:, i), gap, along)
      holds = gap <= rounding*norm2(corner(:, 3) - corner(:, 1))
    end do
  end function holds_turned_away

  !> How a deck puts the body on the other side of an obstacle; empty where it cannot.
  pure function how_to_turn_round(obstacle) result(words)
    type(obstacle_t), intent(in) :: obstacle
    character(:), allocatable :: words

    select case (obstacle%kind)
    case (obstacle_plane)
      words = 'the normal of a PLANE points to the side where the body is: '// &
        to_text(0.0_wp - obstacle%normal(1))//', '//to_text(0.0_wp - obstacle%normal(2))//', '// &
        to_text(0.0_wp - obstacle%normal(3))//' would'
    case (obstacle_sphere, obstacle_cylinder)
      words = 'a body that lies inside a SPHERE or a CYLINDER needs INNER'
      if (obstacle%inner) words = 'INNER is for a body that lies inside; this one lies around'
    case default
      words = ''
    end select
  end function how_to_turn_round

  !> A lower bound of the gap while the obstacle moves within a box; exact for planes and spheres.
  pure function least_gap(obstacle, box, x) result(gap)
    type(obstacle_t), intent(in) :: obstacle
    real(wp), intent(in) :: box(3, 2) !! corners of the box of displacements [length]
    real(wp), intent(in) :: x(3)      !! a point at rest [length]
    real(wp) :: gap                   !! [length]
    real(wp) :: normal(3), arm(3), half(3)

    select case (obstacle%kind)
    case (obstacle_plane)
      call locate_point(obstacle, [0.0_wp, 0.0_wp, 0.0_wp], x, gap, normal)
      gap = gap - sum(max(normal*box(:, 1), normal*box(:, 2)))
    case (obstacle_sphere)
      arm = x - obstacle%point
      if (obstacle%inner) then
        gap = obstacle%radius - norm2(max(abs(arm - box(:, 1)), abs(arm - box(:, 2))))
      else
        gap = norm2(arm - max(box(:, 1), min(box(:, 2), arm))) - obstacle%radius
      end if
    case default
      ! A gap is a distance, and changes by no more than the obstacle moves, whatever its kind.
      half = 0.5_wp*(box(:, 2) - box(:, 1))
      call locate_point(obstacle, box(:, 1) + half, x, gap, normal)
      gap = gap - norm2(half)
    end select
  end function least_gap

  !> Whether the normal is the same everywhere.
  pure logical function is_flat(obstacle)
    type(obstacle_t), intent(in) :: obstacle

    is_flat = obstacle%kind == obstacle_plane
  end function is_flat

  !> Whether it consists of facets, before which points are placed as before a surface of a body.
  pure logical function is_meshed(obstacle)
    type(obstacle_t), intent(in) :: obstacle

    is_meshed = obstacle%kind == obstacle_facets
  end function is_meshed

  !> Whether the master of a pair is an obstacle of facets.
  pure logical function has_meshed_master(scene, pair)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: pair

    has_meshed_master = .false.
    associate (master => scene%pairs(pair)%master)
      if (master > 0) has_meshed_master = is_meshed(scene%obstacles(master))
    end associate
  end function has_meshed_master

  !> Whether the master of a pair consists of faces: a surface of a body, or facets of an obstacle.
  pure logical function is_before_faces(pair, obstacles)
    type(contact_pair_t), intent(in) :: pair
    type(obstacle_t), intent(in) :: obstacles(:)

    is_before_faces = pair%master == 0
    if (pair%master > 0) is_before_faces = is_meshed(obstacles(pair%master))
  end function is_before_faces

  !> Whether normals and weights of a pair are those of the undeformed mesh wherever its points go
  !> and however its obstacle turns.
  pure logical function has_fixed_normals(scene, pair)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: pair

    associate (of => scene%pairs(pair))
      has_fixed_normals = of%small_sliding
      if (of%master > 0) has_fixed_normals = is_flat(scene%obstacles(of%master)) .and. &
        .not. scene%obstacles(of%master)%turns
    end associate
  end function has_fixed_normals

  !> Whether the master of a pair are facets that lie in one plane and do not turn.
  pure logical function has_flat_facets(scene, pair)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: pair

    has_flat_facets = has_meshed_master(scene, pair)
    if (.not. has_flat_facets) return
    associate (obstacle => scene%obstacles(scene%pairs(pair)%master))
      has_flat_facets = .not. obstacle%turns
      if (has_flat_facets) has_flat_facets = lie_in_plane(obstacle%corner, obstacle%facet)
    end associate
  end function has_flat_facets

  !> Whether facets lie in one plane, to the rounding of their corners, and face the same way.
  pure logical function lie_in_plane(corner, facet)
    real(wp), intent(in) :: corner(:, :) !! (3,n_corners) [length]
    integer, intent(in) :: facet(:, :)   !! (4,n_facets) the fourth is 0 in a triangle
    real(wp), parameter :: rounding = 16.0_wp*epsilon(1.0_wp), same_way = 0.5_wp !! [-]
    real(wp) :: area(3, size(facet, 2)), normal(3)
    integer :: f

    do f = 1, size(facet, 2)
      associate (last => corners_in(facet(:, f)))
        area(:, f) = cross(corner(:, facet(3, f)) - corner(:, facet(1, f)), &
          corner(:, facet(last, f)) - corner(:, facet(2, f)))
        if (last == 3) area(:, f) = cross(corner(:, facet(2, f)) - corner(:, facet(1, f)), &
          corner(:, facet(3, f)) - corner(:, facet(1, f)))
      end associate
    end do
    normal = sum(area, 2)
    lie_in_plane = norm2(normal) > 0.0_wp
    if (.not. lie_in_plane) return
    normal = normal/norm2(normal)
    lie_in_plane = all(matmul(normal, area) > same_way*norm2(area, 1)) .and. &
      all(abs(matmul(normal, corner - spread(corner(:, 1), 2, size(corner, 2)))) <= rounding* &
      maxval(abs(corner)))
  end function lie_in_plane

  !> Whether the master of a pair is an obstacle that may enter slave faces between their nodes.
  pure logical function has_round_master(scene, pair)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: pair

    associate (of => scene%pairs(pair))
      has_round_master = .false.
      if (of%master > 0) has_round_master = enters_faces(scene%obstacles(of%master))
    end associate
  end function has_round_master

  !> Whether its surface stays where it is while it turns about an axis through a point.
  pure logical function turns_in_place(obstacle, pivot, axis)
    type(obstacle_t), intent(in) :: obstacle
    real(wp), intent(in) :: pivot(3)  !! [length]
    real(wp), intent(in) :: axis(3)   !! unit vector, 0 where axes change [-]
    real(wp), parameter :: rounding = 1.0e-12_wp
    real(wp) :: arm(3)
    logical :: along

    arm = obstacle%point - pivot
    along = abs(dot_product(obstacle%normal, axis)) > 1.0_wp - rounding
    select case (obstacle%kind)
    case (obstacle_plane)
      turns_in_place = along
    case (obstacle_sphere)
      turns_in_place = norm2(arm) <= rounding*obstacle%radius
    case (obstacle_cylinder)
      arm = arm - dot_product(arm, obstacle%normal)*obstacle%normal
      turns_in_place = along .and. norm2(arm) <= rounding*obstacle%radius
    case default
      turns_in_place = .false.
    end select
  end function turns_in_place

  !> The axes along which the normal may have a part.
  pure function normal_along(obstacle, straight) result(along)
    type(obstacle_t), intent(in) :: obstacle
    real(wp), intent(in) :: straight   !! a direction cosine up to this is 0 [-]
    logical :: along(3)

    along = .true.
    if (is_flat(obstacle) .and. .not. obstacle%turns) along = abs(obstacle%normal) > straight
  end function normal_along

  !> Whether it may be in a slave face and at none of its nodes.
  !>
  !> Only what is round and touched from outside may: where all nodes of a face are before a plane
  !> or in a hollow, all of the face is.
  pure logical function enters_faces(obstacle)
    type(obstacle_t), intent(in) :: obstacle

    select case (obstacle%kind)
    case (obstacle_sphere, obstacle_cylinder)
      enters_faces = .not. obstacle%inner
    case default
      enters_faces = .false.
    end select
  end function enters_faces

  !> The core of an obstacle that enters faces: its surface is at `radius` from a point, or from a
  !> line.
  pure subroutine get_core(obstacle, point, axis, radius)
    type(obstacle_t), intent(in) :: obstacle
    real(wp), intent(out) :: point(3)  !! of the core [length]
    real(wp), intent(out) :: axis(3)   !! unit vector along the line, 0 where it is a point [-]
    real(wp), intent(out) :: radius    !! [length]

    point = obstacle%point
    radius = obstacle%radius
    axis = 0.0_wp
    if (obstacle%kind == obstacle_cylinder) axis = obstacle%normal
  end subroutine get_core

  !> The largest coordinate by which places on it are rounded.
  pure real(wp) function extent_of(obstacle) result(extent)
    type(obstacle_t), intent(in) :: obstacle

    extent = maxval(abs(obstacle%point)) + obstacle%radius
    if (is_meshed(obstacle)) extent = maxval(abs(obstacle%corner))
  end function extent_of

  !> Whether an obstacle is the same all along an axis.
  elemental logical function is_same_along(obstacle, axis)
    type(obstacle_t), intent(in) :: obstacle
    integer, intent(in) :: axis
    logical :: has(3)

    has = abs(obstacle%normal) > 0.0_wp
    select case (obstacle%kind)
    case (obstacle_plane)
      is_same_along = .not. has(axis)
    case (obstacle_cylinder)
      is_same_along = has(axis) .and. count(has) == 1
    case default
      is_same_along = .false.
    end select
  end function is_same_along

end module obstacle_shapes_mod
