!> The place at which contact between surfaces, or before curved obstacles, is linearised, from
!> iteration to iteration of an increment.
!>
!> A placement at u_j leads to a displacement u; u_j -> u is a map whose fixed point is the
!> solution. It is nearly linear, and between surfaces contracts slowly where everything slides:
!> Anderson's acceleration. Before curved obstacles the plain map mostly converges in a few
!> iterations, and is accelerated otherwise. docs/theory.md sections 9 and 11.
module follow_bodies_mod
  use kinds_mod, only: wp
  use mesh_mod, only: mesh_t
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use bodies_mod, only: is_linear
  use anderson_mod, only: anderson_t, new_anderson, accelerate, forget
  implicit none
  private

  public :: follow_t, begin_following, has_moved, next_place, farthest_point, largest_deformation

  integer, parameter :: depth = 6    !! displacements that acceleration keeps
  integer, parameter :: patience = 8 !! plain iterations before curved obstacles: mostly enough

  type :: follow_t
    integer, allocatable :: node(:) !! of the pairs of surfaces that are placed anew, each once
    logical :: with_bodies = .false.
    !! internal forces are not linear: displacements are accelerated, and points follow them
    integer, allocatable :: slow(:)
    !! without such pairs: nodes of points before curved obstacles, accelerated after `patience`
    real(wp) :: allowed = huge(1.0_wp) !! the most that they may still move, of their way [-]
    real(wp) :: before = huge(1.0_wp)  !! how far they had still moved an iteration ago [-]
    type(anderson_t) :: memory
  end type follow_t

contains

  !> Choose the nodes whose places may be accelerated.
  pure type(follow_t) function begin_following(scene, points, tolerance) result(follow)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    real(wp), intent(in) :: tolerance !! that the placement is to meet [-]
    logical :: is_on(scene%mesh%n_nodes)
    integer :: pair, i

    follow%with_bodies = .not. is_linear(scene)
    is_on = .false.
    do pair = 1, size(scene%pairs)
      associate (of => scene%pairs(pair))
        if (of%master > 0 .or. of%small_sliding) cycle
        if (.not. any(points%in_reach(points%first(pair):points%first(pair + 1) - 1))) cycle
        is_on(scene%surfaces(of%surface)%nodes) = .true.
        is_on(scene%surfaces(of%master_surface)%nodes) = .true.
      end associate
    end do
    allocate (follow%node(count(is_on)))
    follow%node(:) = pack([(i, i=1, size(is_on))], is_on)
    if (size(follow%node) == 0) then
      follow%slow = pack(points%node, points%is_curved .and. points%in_reach)
      return
    end if
    allocate (follow%slow(0))
    follow%allowed = 100.0_wp*tolerance
  end function begin_following

  !> How far the nodes are from where they were placed, beside how far they went or the largest
  !> deformation of a body; less than the rounding of coordinates is 0. docs/theory.md (11.8).
  !>
  !> Errors of reactions are relative to the forces, not to what an increment changes: they move
  !> nodes by a part of the deformation.
  pure real(wp) function has_moved(mesh, follow, old, placed_at, u) result(moved)
    type(mesh_t), intent(in) :: mesh
    type(follow_t), intent(in) :: follow
    real(wp), intent(in) :: old(:, :)        !! (3,n_nodes) when the increment began [length]
    real(wp), intent(in) :: placed_at(:, :)  !! (3,n_nodes) [length]
    real(wp), intent(in) :: u(:, :)          !! (3,n_nodes) that the placement led to [length]
    real(wp) :: way

    moved = 0.0_wp
    if (size(follow%node) == 0) return
    moved = maxval(abs(u(:, follow%node) - placed_at(:, follow%node))) - 16.0_wp*epsilon(1.0_wp)* &
      maxval(abs(mesh%coordinates) + abs(u))
    moved = max(0.0_wp, moved)
    way = max(maxval(abs(u - old)), largest_deformation(mesh, u), 1.0e-9_wp*maxval(abs(u)))
    if (way > 0.0_wp) moved = moved/way
  end function has_moved

  !> The largest difference of displacements in a body, along an axis.
  pure real(wp) function largest_deformation(mesh, u) result(largest)
    type(mesh_t), intent(in) :: mesh
    real(wp), intent(in) :: u(:, :) !! (3,n_nodes) [length]
    real(wp) :: low(3, mesh%n_bodies), high(3, mesh%n_bodies) !! [length]
    integer :: node

    low = huge(1.0_wp)
    high = -huge(1.0_wp)
    do node = 1, mesh%n_nodes
      if (mesh%body(node) == 0) cycle
      associate (l => low(:, mesh%body(node)), h => high(:, mesh%body(node)))
        l = min(l, u(:, node))
        h = max(h, u(:, node))
      end associate
    end do
    largest = maxval(max(0.0_wp, high - low))
  end function largest_deformation

  !> Where to place the points next: at the displacement. Acceleration changes that of the nodes of
  !> surfaces, and after `patience` iterations of those before curved obstacles.
  subroutine next_place(follow, iteration, moved, u, placed_at)
    type(follow_t), intent(inout) :: follow
    integer, intent(in) :: iteration           !! that has led to u
    real(wp), intent(in) :: moved              !! of `has_moved` [-]
    real(wp), intent(in) :: u(:, :)            !! (3,n_nodes) that the last place led to [length]
    real(wp), intent(inout) :: placed_at(:, :) !! (3,n_nodes) the last place; the next [length]
    integer, allocatable :: node(:)
    real(wp), allocatable :: next(:)

    node = follow%node
    if (size(node) == 0 .and. iteration > patience) node = follow%slow
    if (size(node) == 0 .or. follow%with_bodies) then
      placed_at = u
      return
    end if
    if (.not. allocated(follow%memory%image)) follow%memory = new_anderson(3*size(node), depth)
    if (0.5_wp*moved > follow%before) call forget(follow%memory)
    follow%before = moved
    allocate (next(3*size(node)))
    call accelerate(follow%memory, reshape(placed_at(:, node), shape(next)), &
      reshape(u(:, node), shape(next)), next)
    placed_at = u
    placed_at(:, node) = reshape(next, [3, size(node)])
  end subroutine next_place

  !> The point whose node is farthest from where it was placed; 0: none.
  pure integer function farthest_point(points, follow, placed_at, u) result(point)
    type(contact_points_t), intent(in) :: points
    type(follow_t), intent(in) :: follow
    real(wp), intent(in) :: placed_at(:, :), u(:, :) !! (3,n_nodes) [length]

    point = 0
    if (size(follow%node) == 0) return
    associate (way => norm2(u(:, points%node) - placed_at(:, points%node), dim=1))
      point = maxloc(way, dim=1, mask=points%on_surface)
    end associate
  end function farthest_point

end module follow_bodies_mod
