!> Whether bodies that lean over the edge of their master tip over it: where neither supports, nor
!> other pairs, nor friction at the edge keep them. docs/theory.md section 11.
module tipping_bodies_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: cross
  use dense_mod, only: solve_least_squares
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t, master_nodes
  use friction_laws_mod, only: least_share
  use increment_report_mod, only: contact_fields_t
  use rigid_modes_mod, only: free_motions_t, motion_at, find_rotation, place_of
  use leaning_pairs_mod, only: leaning_t, presses
  implicit none
  private

  public :: may_tip

  real(wp), parameter :: rounding = 1.0e-6_wp !! of rotations, and of forces [-]

contains

  !> Whether the slave of a pair that leans over the edge of its master may tip over it.
  !>
  !> At the edge the pressure would balance the loads with another friction there, as large as the
  !> motions that supports leave ask for: within the cone it keeps the body, whose coefficient is
  !> the least where it depends on the pressure, for that is large at an edge.
  logical function may_tip(scene, points, contact, motions, pair, leaning)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(contact_fields_t), intent(in) :: contact
    type(free_motions_t), intent(in) :: motions
    integer, intent(in) :: pair
    type(leaning_t), intent(in) :: leaning
    real(wp) :: seen(3, motions%n)  !! how the two sides part at the edge [-]
    real(wp) :: moved(motions%n)    !! work of the pressure at its middle less that there [force]
    integer :: slave, master(1)

    slave = points%node(points%first(pair))
    master = minval(master_nodes(points, pair))
    seen = 0.0_wp
    moved = 0.0_wp
    may_tip = .false.
    call add_side(slave, 1.0_wp, may_tip)
    if (may_tip) may_tip = .not. is_pressed_elsewhere(scene%mesh%body(slave))
    if (.not. may_tip) return
    call add_side(master(1), -1.0_wp)
    may_tip = .not. is_kept_by_friction()

  contains

    !> Add what the motions do with the side of a node.
    subroutine add_side(node, sign, turns)
      integer, intent(in) :: node
      real(wp), intent(in) :: sign !! 1 of the slave, -1 of the master
      logical, intent(out), optional :: turns !! one turns it about the edge
      real(wp) :: turn(3), extent, lift
      integer :: j

      if (present(turns)) turns = .false.
      associate (mesh => scene%mesh)
        do j = 1, motions%n
          call find_rotation(motions, mesh, j, node, turn, extent)
          lift = dot_product(leaning%normal, cross(turn, leaning%arm))
          if (present(turns)) turns = turns .or. abs(lift)*extent > rounding*leaning%beyond
          moved(j) = moved(j) + sign*leaning%pressing*lift
          seen(:, j) = seen(:, j) + sign*(motion_at(motions, mesh, j, node) + cross(turn, &
            leaning%edge - place_of(motions, mesh, node)))
        end do
      end associate
    end subroutine add_side

    logical function is_kept_by_friction()
      real(wp) :: change(3), at_edge(3), normal !! [force]
      real(wp) :: mu

      is_kept_by_friction = .false.
      if (.not. leaning%is_on_slave) return
      change = solve_least_squares(transpose(seen), moved)
      if (any(abs(matmul(change, seen) - moved) > rounding*maxval(abs(moved)))) return
      at_edge = leaning%force + change
      normal = dot_product(at_edge, leaning%normal)
      mu = points%mu(points%first(pair))
      if (allocated(points%laws)) mu = mu*least_share(points%laws(pair))
      is_kept_by_friction = norm2(at_edge - normal*leaning%normal) <= mu*normal
    end function is_kept_by_friction

    pure logical function is_pressed_elsewhere(body)
      integer, intent(in) :: body
      integer :: other

      is_pressed_elsewhere = .false.
      do other = 1, size(scene%pairs)
        if (other == pair .or. .not. presses(points, contact, other)) cycle
        associate (first => points%first(other), masters => master_nodes(points, other))
          is_pressed_elsewhere = is_pressed_elsewhere .or. any(scene%mesh%body( &
            [points%node(first), masters]) == body)
        end associate
      end do
    end function is_pressed_elsewhere

  end function may_tip

end module tipping_bodies_mod
