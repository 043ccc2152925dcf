!> What supports and constraints leave to the nodes in a *STEP.
module node_freedom_mod
  use kinds_mod, only: wp
  use constraints_mod, only: constraints_t, active_constraints, constraint_of
  implicit none
  private

  public :: node_freedom_t, freedom_of, can_move, can_move_along

  type :: node_freedom_t
    logical, allocatable :: can_move(:, :)   !! (3,n_nodes) as of `can_move`
    logical, allocatable :: is_bound(:)
    !! (n_nodes) a support or a constraint names it, or it belongs to both surfaces of a pair
    type(constraints_t) :: active            !! constraints, chains substituted
    integer, allocatable :: constraint(:, :) !! (3,n_nodes) of these, 0: none
    logical, allocatable :: is_tied(:, :)    !! (3,n_nodes) the constraint is that of a tie
    real(wp), allocatable :: normal(:, :)    !! (3,n_points) of the undeformed mesh [-]
  end type node_freedom_t

contains

  !> The freedom of all nodes.
  pure function freedom_of(body, ref_nodes, constraints, prescribed) result(freedom)
    integer, intent(in) :: body(:)                 !! (n_nodes) 0 where no element uses the node
    integer, intent(in) :: ref_nodes(:)            !! of obstacles
    type(constraints_t), intent(in) :: constraints !! of the scene
    logical, intent(in) :: prescribed(:, :)        !! (3,n_nodes)
    type(node_freedom_t) :: freedom
    integer, allocatable :: number(:, :) !! of the scene's constraints

    freedom%active = active_constraints(constraints, prescribed)
    freedom%can_move = can_move(body, ref_nodes, freedom%active, prescribed)
    freedom%is_bound = any(prescribed, dim=1)
    allocate (freedom%constraint(3, size(body)), source=constraint_of(freedom%active, size(body)))
    allocate (number(3, size(body)), source=constraint_of(constraints, size(body)))
    freedom%is_tied = freedom%constraint > 0 .and. number <= constraints%n - &
      constraints%n_equations
    associate (active => freedom%active)
      if (active%n == 0) return
      freedom%is_bound(active%node(:active%n)) = .true.
      freedom%is_bound(active%master(:active%first(active%n + 1) - 1)) = .true.
    end associate
  end function freedom_of

  !> The degrees of freedom that can move: of the bodies' nodes and of obstacles, where no support
  !> holds them, nor all that they depend on. Other nodes have none.
  pure function can_move(body, ref_nodes, active, prescribed)
    integer, intent(in) :: body(:)               !! (n_nodes)
    integer, intent(in) :: ref_nodes(:)
    type(constraints_t), intent(in) :: active    !! chains substituted
    logical, intent(in) :: prescribed(:, :)      !! (3,n_nodes)
    logical :: can_move(3, size(body))
    integer :: c, k

    can_move = spread(body > 0, 1, 3)
    can_move(:, ref_nodes) = .true.
    can_move = can_move .and. .not. prescribed
    do c = 1, active%n
      associate (moves => can_move(active%dof(c), active%node(c)))
        moves = any([(can_move(active%master_dof(k), active%master(k)), k=active%first(c), &
          active%first(c + 1) - 1)])
      end associate
    end do
  end function can_move

  !> Whether nodes can move along a direction each, of what supports and constraints leave: supports
  !> across slanting axes, and equations, hold combinations of x, y and z.
  pure function can_move_along(active, can_move, node, direction, least) result(moves)
    type(constraints_t), intent(in) :: active    !! chains substituted
    logical, intent(in) :: can_move(:, :)        !! (3,n_nodes) as of `can_move`
    integer, intent(in) :: node(:)               !! (n)
    real(wp), intent(in) :: direction(:, :)      !! (3,n) unit vectors [-]
    real(wp), intent(in) :: least                !! of a motion along it, of what moves by 1 [-]
    logical :: moves(size(node))
    integer :: number(3, size(can_move, 2)), i, a, k
    real(wp) :: along(3, size(can_move, 2))      !! for a motion by 1 of what depends on no other

    number = constraint_of(active, size(can_move, 2))
    along = 0.0_wp
    do i = 1, size(node)
      do a = 1, 3
        call add_terms(a, along)
      end do
      moves(i) = .false.
      do a = 1, 3
        associate (c => number(a, node(i)))
          if (c == 0) then
            moves(i) = moves(i) .or. abs(along(a, node(i))) > least
            along(a, node(i)) = 0.0_wp
            cycle
          end if
          do k = active%first(c), active%first(c + 1) - 1
            associate (term => along(active%master_dof(k), active%master(k)))
              moves(i) = moves(i) .or. abs(term) > least
              term = 0.0_wp
            end associate
          end do
        end associate
      end do
    end do

  contains

    !> What moves the node along axis `a`, for as much as that counts along the direction.
    pure subroutine add_terms(a, along)
      integer, intent(in) :: a
      real(wp), intent(inout) :: along(:, :)
      integer :: k

      associate (c => number(a, node(i)))
        if (c == 0) then
          if (can_move(a, node(i))) along(a, node(i)) = along(a, node(i)) + direction(a, i)
          return
        end if
        do k = active%first(c), active%first(c + 1) - 1
          if (.not. can_move(active%master_dof(k), active%master(k))) cycle
          associate (term => along(active%master_dof(k), active%master(k)))
            term = term + direction(a, i)*active%weight(k)
          end associate
        end do
      end associate
    end subroutine add_terms

  end function can_move_along

end module node_freedom_mod
