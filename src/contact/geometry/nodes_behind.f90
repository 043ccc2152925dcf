!> Nodes of slave bodies that are in no slave surface and get behind an obstacle: nothing keeps them
!> out. docs/theory.md section 9.
module nodes_behind_mod
  use kinds_mod, only: wp
  use obstacles_mod, only: obstacle_t
  use obstacle_shapes_mod, only: shift_of, turned, locate_point, has_meshed_master
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t, is_pair_removed
  use state_mod, only: state_t
  implicit none
  private

  public :: node_behind_t, find_node_behind

  type :: node_behind_t
    integer :: node = 0            !! 0: there is none
    integer :: pair = 0            !! whose slave surface does without it
    real(wp) :: depth = 0.0_wp     !! negative before it [length]
  end type node_behind_t

contains

  !> The node that is deepest in an obstacle, of those of slave bodies that were before it in the
  !> mesh and are in no slave surface of it; or the nearest, where those before it count that have
  !> come nearer than a part of their distance in the mesh.
  !>
  !> Beside a *CONTACT GAP the mesh does not say where bodies end.
  pure type(node_behind_t) function find_node_behind(scene, points, state, allowed, &
    near) result(deepest)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(state_t), intent(in) :: state
    real(wp), intent(in) :: allowed    !! depth that is none [length]
    real(wp), intent(in), optional :: near !! that part; not present: none count [-]
    type(obstacle_t) :: obstacle
    logical :: is_slave(scene%mesh%n_nodes), of_slave(0:scene%mesh%n_pieces)
    real(wp), parameter :: at_rest(3) = 0.0_wp
    real(wp) :: gap, first_gap, normal(3)
    integer :: pair, other, node

    do pair = 1, size(scene%pairs)
      associate (master => scene%pairs(pair)%master, u => state%displacement, &
                 slave => scene%surfaces(scene%pairs(pair)%surface)%nodes)
        if (master == 0 .or. has_meshed_master(scene, pair)) cycle
        if (scene%obstacles(master)%is_of_gap .or. is_pair_removed(points, pair)) cycle
        if (any(abs(points%extra_gap(points%first(pair):points%first(pair + 1) - 1)) > 0.0_wp)) then
          cycle
        end if
        of_slave = .false.
        of_slave(scene%mesh%piece(slave)) = .true.
        is_slave = .false.
        do other = 1, size(scene%pairs)
          if (scene%pairs(other)%master == master) then
            is_slave(scene%surfaces(scene%pairs(other)%surface)%nodes) = .true.
          end if
        end do
        obstacle = scene%obstacles(master)
        if (obstacle%turns) obstacle = turned(scene%obstacles(master), state%rotation(:, master), &
          scene%mesh%coordinates(:, obstacle%ref_node))
        do node = 1, scene%mesh%n_nodes
          if (is_slave(node) .or. scene%mesh%piece(node) == 0) cycle
          if (.not. of_slave(scene%mesh%piece(node))) cycle
          associate (x => scene%mesh%coordinates(:, node))
            call locate_point(obstacle, shift_of(obstacle, u), x + u(:, node), gap, normal)
            if (deepest%node > 0 .and. -gap <= deepest%depth + allowed) cycle
            if (-gap <= allowed .and. .not. present(near)) cycle
            call locate_point(scene%obstacles(master), at_rest, x, first_gap, normal)
            if (present(near)) then
              if (gap >= near*first_gap) cycle
            end if
            if (first_gap >= -allowed) deepest = node_behind_t(node, pair, -gap)
          end associate
        end do
      end associate
    end do
  end function find_node_behind

end module nodes_behind_mod
