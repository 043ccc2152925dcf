!> Contact forces that are many times what drives them, and what they balance: a wedge between two
!> walls, surfaces that press on each other all round.
!>
!> Such forces are right, and the certificate does not refuse them; but they follow from the small
!> part of their normals along the load, so that any error of a normal is multiplied in them.
!> docs/theory.md section 6.
module opposed_reactions_mod
  use kinds_mod, only: wp
  use constraints_mod, only: constraints_t
  use mesh_mod, only: mesh_t
  use contact_points_mod, only: contact_points_t
  use state_mod, only: state_t
  use increment_report_mod, only: contact_fields_t
  implicit none
  private

  public :: opposed_t, find_opposed_reactions

  real(wp), parameter :: many = 10.0_wp
  !! times the forces that drive a group of bodies: more is large. The most of the decks in input/
  !! is 1.2, of a press fit under a load 6.7; on a wedge a degree of slope then changes a third [-]

  !> A pair whose forces are large.
  type :: opposed_t
    integer  :: pair = 0
    real(wp) :: pressed = 0.0_wp   !! sum of the magnitudes of its forces [force]
    real(wp) :: resultant = 0.0_wp !! magnitude of their sum [force]
    real(wp) :: driven_by = 0.0_wp !! sum of the magnitudes of the forces that drive it [force]
    integer  :: other = 0 !! the pair that takes most of the resultant on a body they share, 0: none
  end type opposed_t

contains

  !> The pairs whose forces are many times those that drive them.
  !>
  !> Loads drive, and supports that move. Supports at rest take what they have to, as contact does.
  !> Bodies, reference nodes and what constraints join are one group where they press on each other;
  !> where nothing drives a group, its forces are those of overlaps, or of earlier loads.
  pure subroutine find_opposed_reactions(mesh, points, contact, state, constraints, opposed)
    type(mesh_t), intent(in) :: mesh
    type(contact_points_t), intent(in) :: points
    type(contact_fields_t), intent(in) :: contact
    type(state_t), intent(in) :: state             !! at the end of the increment
    type(constraints_t), intent(in) :: constraints
    type(opposed_t), allocatable, intent(out) :: opposed(:)
    integer  :: unit(mesh%n_nodes)                 !! body, or number of a node without one
    integer  :: group(mesh%n_bodies + mesh%n_nodes)
    real(wp) :: drive(mesh%n_bodies + mesh%n_nodes) !! of each group [force]
    integer  :: node, pair, i

    do node = 1, mesh%n_nodes
      unit(node) = mesh%body(node)
      if (unit(node) == 0) unit(node) = mesh%n_bodies + node
    end do
    call find_groups(points, contact, constraints, unit, group)
    drive = 0.0_wp
    do node = 1, mesh%n_nodes
      ! Only supports have forces, and move as prescribed.
      associate (of_group => drive(group(unit(node))))
        of_group = of_group + norm2(state%external_force(:, node)) + norm2(merge( &
          state%support_force(:, node), 0.0_wp, abs(state%displacement(:, node)) > 0.0_wp))
      end associate
    end do
    allocate (opposed(0))
    do pair = 1, size(points%first) - 1
      associate (first => points%first(pair), last => points%first(pair + 1) - 1)
        if (last < first) cycle
        associate (of_group => drive(group(unit(points%node(first)))), &
          pressed => sum([(norm2(state%reaction(:, i)), i=first, last)]))
          if (.not. (of_group > 0.0_wp .and. pressed > many*of_group)) cycle
          opposed = [opposed, opposed_t(pair, pressed, norm2(sum(state%reaction(:, first:last), &
            dim=2)), of_group, opposite(points, contact, state, unit, pair))]
        end associate
      end associate
    end do
  end subroutine find_opposed_reactions

  !> What presses on each other, or is joined, by the least number of its units.
  pure subroutine find_groups(points, contact, constraints, unit, group)
    type(contact_points_t), intent(in) :: points
    type(contact_fields_t), intent(in) :: contact
    type(constraints_t), intent(in) :: constraints
    integer, intent(in) :: unit(:)    !! (n_nodes)
    integer, intent(out) :: group(:)  !! (n_units)
    integer :: i, k

    group = [(i, i=1, size(group))]
    do i = 1, points%n
      if (.not. any(abs(contact%reaction(:, i)) > 0.0_wp)) cycle
      do k = contact%weights%first(i), contact%weights%first(i + 1) - 1
        call join(group, unit(points%node(i)), unit(contact%weights%node(k)))
      end do
    end do
    do i = 1, constraints%n
      do k = constraints%first(i), constraints%first(i + 1) - 1
        call join(group, unit(constraints%node(i)), unit(constraints%master(k)))
      end do
    end do
  end subroutine find_groups

  !> Make two units' groups one, under the lesser number.
  pure subroutine join(group, one, other)
    integer, intent(inout) :: group(:) !! (n_units)
    integer, intent(in) :: one, other
    integer :: least, most

    if (group(one) == group(other)) return
    least = min(group(one), group(other))
    most = max(group(one), group(other))
    where (group == most) group = least
  end subroutine join

  !> The pair that takes most of the resultant of another on one of its two sides, and at least
  !> half of it; 0 where there is none.
  pure integer function opposite(points, contact, state, unit, pair)
    type(contact_points_t), intent(in) :: points
    type(contact_fields_t), intent(in) :: contact
    type(state_t), intent(in) :: state
    integer, intent(in) :: unit(:)   !! (n_nodes)
    integer, intent(in) :: pair
    real(wp) :: own(3), taken, most
    integer :: sides(2), other, i

    opposite = 0
    sides = sides_of(pair)
    own = resultant_on(sides(1), pair)
    most = 0.5_wp*norm2(own)
    do other = 1, size(points%first) - 1
      if (other == pair) cycle
      do i = 1, 2
        if (sides(i) == 0) cycle
        own = resultant_on(sides(i), pair)
        if (.not. norm2(own) > 0.0_wp) cycle
        taken = -dot_product(own, resultant_on(sides(i), other))/norm2(own)
        if (taken <= most) cycle
        most = taken
        opposite = other
      end do
    end do

  contains

    !> The units of a pair's slave and of its master, 0 of an obstacle that has no node.
    pure function sides_of(pair) result(sides)
      integer, intent(in) :: pair
      integer :: sides(2), i

      associate (first => points%first(pair), weights => contact%weights)
        sides = 0
        if (points%first(pair + 1) == first) return
        sides(1) = unit(points%node(first))
        do i = first, points%first(pair + 1) - 1
          if (weights%first(i + 1) > weights%first(i)) sides(2) = unit(weights%node( &
            weights%first(i)))
        end do
      end associate
    end function sides_of

    !> What a pair does to a unit [force].
    pure function resultant_on(side, pair) result(force)
      integer, intent(in) :: side, pair
      real(wp) :: force(3), of_pair(3)
      integer :: both(2)

      both = sides_of(pair)
      of_pair = sum(state%reaction(:, points%first(pair):points%first(pair + 1) - 1), dim=2)
      force = 0.0_wp
      if (both(1) == side) force = force + of_pair
      if (both(2) == side) force = force - of_pair
    end function resultant_on

  end function opposite

end module opposed_reactions_mod
