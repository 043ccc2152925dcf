!> Pairs that press beyond the edge of their master: faces that it covers in part act at their
!> nodes. docs/theory.md section 11.
module leaning_pairs_mod
  use kinds_mod, only: wp
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t, master_nodes
  use increment_report_mod, only: contact_fields_t
  use local_frame_mod, only: local_frame
  implicit none
  private

  public :: leaning_t, find_leaning, presses

  !> A pair's pressure beyond the edge of its master.
  type :: leaning_t
    real(wp) :: beyond = 0.0_wp   !! its middle lies beyond all nodes of the master; 0: not [length]
    real(wp) :: arm(3) = 0.0_wp   !! from the edge to the middle, across the normal [length]
    real(wp) :: edge(3) = 0.0_wp  !! place of the master's edge that is nearest [length]
    real(wp) :: normal(3) = 0.0_wp   !! from master to slave, the mean over the pressure [-]
    real(wp) :: force(3) = 0.0_wp    !! on the slave, of the points that press [force]
    real(wp) :: pressing = 0.0_wp    !! sum of the normal reactions [force]
    logical  :: is_on_slave = .false. !! that place is among the slave's nodes, too
  end type leaning_t

  integer,  parameter :: n_ways = 72          !! directions that are looked in
  real(wp), parameter :: rounding = 1.0e-6_wp !! of a face [-]
  real(wp), parameter :: pi = acos(-1.0_wp)

contains

  !> Whether any point of a pair has a normal reaction.
  pure logical function presses(points, contact, pair)
    type(contact_points_t), intent(in) :: points
    type(contact_fields_t), intent(in) :: contact
    integer, intent(in) :: pair

    presses = any(contact%reaction(1, points%first(pair):points%first(pair + 1) - 1) > 0.0_wp)
  end function presses

  !> How far the middle of a pair's pressure lies beyond all nodes of the master's surface, across
  !> the mean normal; 0 where it does not, before obstacles, and with small sliding.
  !>
  !> No pressure that acts on the master can have its middle there. What faces stand apart or
  !> overlap between their nodes is left to them.
  pure subroutine find_leaning(scene, points, contact, u, pair, leaning)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(contact_fields_t), intent(in) :: contact !! at the end of an increment
    real(wp), intent(in) :: u(:, :)               !! (3,n_nodes) [length]
    integer, intent(in) :: pair
    type(leaning_t), intent(out) :: leaning
    real(wp) :: middle(3), normal(3), frame(3, 3), way(3), unused(3)
    real(wp) :: apart, rounding_of_face, past_slave
    integer :: i

    associate (of => scene%pairs(pair), first => points%first(pair), &
               last => points%first(pair + 1) - 1, pressing => leaning%pressing)
      if (of%master > 0 .or. of%small_sliding .or. .not. presses(points, contact, pair)) return
      middle = 0.0_wp
      normal = 0.0_wp
      apart = 0.0_wp
      do i = first, last
        associate (r => max(0.0_wp, contact%reaction(1, i)), node => points%node(i))
          if (.not. r > 0.0_wp) cycle
          middle = middle + r*(scene%mesh%coordinates(:, node) + u(:, node))
          normal = normal + r*contact%frame(:, 1, i)
          apart = apart + r*abs(contact%least_gap(i) - points%extra_gap(i))
          pressing = pressing + r
          leaning%force = leaning%force + matmul(contact%frame(:, :, i), contact%reaction(:, i))
        end associate
      end do
      middle = middle/pressing
      leaning%normal = normal/max(norm2(normal), tiny(1.0_wp))
      frame = local_frame(leaning%normal)
      rounding_of_face = rounding*sqrt(maxval(points%area(first:last)))
      call look_beyond(places_of(master_nodes(points, pair)), frame, middle, leaning%beyond, way)
      if (leaning%beyond <= apart/pressing + rounding_of_face) leaning%beyond = 0.0_wp
      leaning%arm = leaning%beyond*way
      leaning%edge = middle - leaning%arm
      call look_beyond(places_of(points%node(first:last)), frame, leaning%edge, past_slave, unused)
      leaning%is_on_slave = past_slave <= rounding_of_face
    end associate

  contains

    pure function places_of(nodes) result(x)
      integer, intent(in) :: nodes(:)
      real(wp) :: x(3, size(nodes)) !! [length]

      x = scene%mesh%coordinates(:, nodes) + u(:, nodes)
    end function places_of

  end subroutine find_leaning

  !> How far a place lies beyond all nodes of a surface, and in which direction; 0: among them.
  pure subroutine look_beyond(x, frame, place, beyond, way)
    real(wp), intent(in) :: x(:, :)     !! (3,n) of the nodes [length]
    real(wp), intent(in) :: frame(3, 3) !! the normal, two directions across it [-]
    real(wp), intent(in) :: place(3)    !! [length]
    real(wp), intent(out) :: beyond     !! [length]
    real(wp), intent(out) :: way(3)     !! unit vector across the normal [-]
    real(wp) :: along(3), further
    integer :: k

    beyond = 0.0_wp
    way = 0.0_wp
    do k = 1, n_ways
      along = cos(2.0_wp*pi*k/n_ways)*frame(:, 2) + sin(2.0_wp*pi*k/n_ways)*frame(:, 3)
      further = dot_product(along, place) - maxval(matmul(along, x))
      if (.not. further > beyond) cycle
      beyond = further
      way = along
    end do
  end subroutine look_beyond

end module leaning_pairs_mod
