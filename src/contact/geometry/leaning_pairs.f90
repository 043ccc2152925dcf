!> Pairs that press beyond the edge of their master: faces that it covers in part act at their
!> nodes. docs/theory.md section 11.
module leaning_pairs_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: cross
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t, master_nodes
  use increment_report_mod, only: contact_fields_t
  use local_frame_mod, only: local_frame
  implicit none
  private

  public :: find_leaning, presses

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
  pure subroutine find_leaning(scene, points, contact, u, pair, beyond, axis)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(contact_fields_t), intent(in) :: contact !! at the end of an increment
    real(wp), intent(in) :: u(:, :)               !! (3,n_nodes) [length]
    integer, intent(in) :: pair
    real(wp), intent(out) :: beyond               !! [length]
    real(wp), intent(out) :: axis(3)              !! along the edge [-]
    real(wp), allocatable :: x(:, :)              !! (3,n) of the master [length]
    integer, allocatable :: nodes(:)
    real(wp) :: middle(3), normal(3), frame(3, 3), way(3)
    real(wp) :: force, apart, size_of_face, further
    integer :: i, k

    beyond = 0.0_wp
    axis = 0.0_wp
    associate (of => scene%pairs(pair), first => points%first(pair), &
               last => points%first(pair + 1) - 1)
      if (of%master > 0 .or. of%small_sliding .or. .not. presses(points, contact, pair)) return
      middle = 0.0_wp
      normal = 0.0_wp
      force = 0.0_wp
      apart = 0.0_wp
      do i = first, last
        associate (r => max(0.0_wp, contact%reaction(1, i)), node => points%node(i))
          if (.not. r > 0.0_wp) cycle
          middle = middle + r*(scene%mesh%coordinates(:, node) + u(:, node))
          normal = normal + r*contact%frame(:, 1, i)
          apart = apart + r*abs(contact%least_gap(i) - points%extra_gap(i))
          force = force + r
        end associate
      end do
      size_of_face = sqrt(maxval(points%area(first:last)))
    end associate
    middle = middle/force
    normal = normal/max(norm2(normal), tiny(1.0_wp))
    frame = local_frame(normal)
    nodes = master_nodes(points, pair)
    allocate (x(3, size(nodes)))
    x = scene%mesh%coordinates(:, nodes) + u(:, nodes)
    do k = 1, n_ways
      way = cos(2.0_wp*pi*k/n_ways)*frame(:, 2) + sin(2.0_wp*pi*k/n_ways)*frame(:, 3)
      further = dot_product(way, middle) - maxval(matmul(way, x))
      if (.not. further > beyond) cycle
      beyond = further
      axis = cross(normal, way)
    end do
    if (beyond <= apart/force + rounding*size_of_face) beyond = 0.0_wp
  end subroutine find_leaning

end module leaning_pairs_mod
