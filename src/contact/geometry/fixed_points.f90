!> Contact points of two surfaces whose sides cannot move apart: there is no reaction to find.
!>
!> What counts is the node and the place of the master that lies opposite, by the shape functions of
!> the master's face: the weights of the mortar are means that reach nodes beside. Stiffness and the
!> inclination of normals do not count. docs/theory.md section 11.
module fixed_points_mod
  use kinds_mod, only: wp
  use growing_lists_mod, only: enlarge
  use node_freedom_mod, only: node_freedom_t
  use local_frame_mod, only: straight
  use mortar_rows_mod, only: opposite_t
  implicit none
  private

  public :: find_fixed, are_held

  real(wp), parameter :: nearly_all = 0.95_wp
  !! of what lies opposite must be held [-]

  !> A motion as a sum over degrees of freedom that depend on nothing.
  type :: motion_t
    integer :: n = 0
    integer,  allocatable :: node(:), dof(:) !! (n) there may be more room
    real(wp), allocatable :: factor(:)       !! (n) [-]
  end type motion_t

contains

  !> Along which axes the two sides of a point cannot move apart, and whether they cannot along the
  !> normal.
  pure subroutine find_fixed(freedom, node, opposite, normal, still, is_fixed)
    type(node_freedom_t), intent(in) :: freedom
    integer, intent(in) :: node                !! of the slave
    type(opposite_t), intent(in) :: opposite   !! of the master
    real(wp), intent(in) :: normal(3)          !! unit vector
    logical, intent(out) :: still(3), is_fixed
    real(wp) :: axis(3)
    integer :: a

    still = .false.
    is_fixed = .false.
    if (opposite%n == 0 .or. .not. freedom%is_bound(node)) return
    do a = 1, 3
      axis = 0.0_wp
      axis(a) = 1.0_wp
      still(a) = opposite_is_held(axis) .or. are_joined(freedom, node, opposite, a)
    end do
    is_fixed = all(still .or. abs(normal) <= straight)
    if (.not. is_fixed) is_fixed = opposite_is_held(normal) .or. are_one(freedom, node, opposite, &
      normal, straight)

  contains

    pure logical function opposite_is_held(direction)
      real(wp), intent(in) :: direction(3)

      opposite_is_held = are_held(freedom, node, opposite%node(:opposite%n), &
        opposite%weight(:opposite%n), direction)
    end function opposite_is_held

  end subroutine find_fixed

  !> Whether supports and constraints hold a node and nearly all that weighs for its master along a
  !> direction.
  pure logical function are_held(freedom, node, masters, weight, direction)
    type(node_freedom_t), intent(in) :: freedom
    integer, intent(in) :: node, masters(:)
    real(wp), intent(in) :: weight(:)    !! of the masters [-]
    real(wp), intent(in) :: direction(3)
    real(wp) :: held
    integer :: k

    are_held = is_held(freedom, node, direction)
    if (.not. are_held) return
    held = 0.0_wp
    do k = 1, size(masters)
      if (is_held(freedom, masters(k), direction)) held = held + abs(weight(k))
    end do
    are_held = held >= nearly_all*sum(abs(weight))
  end function are_held

  !> Whether a node cannot move along a direction.
  pure logical function is_held(freedom, node, direction)
    type(node_freedom_t), intent(in) :: freedom
    integer, intent(in) :: node
    real(wp), intent(in) :: direction(3)
    type(motion_t) :: motion

    call add_motion(freedom, node, direction, 1.0_wp, motion)
    is_held = size_of(motion) <= straight
  end function is_held

  !> Whether constraints let both sides move along an axis together alone. A tie does so wherever it
  !> hangs the node on the nodes opposite, or these on it: between meshes that do not match its
  !> weights are other means than those of contact.
  pure logical function are_joined(freedom, node, opposite, axis)
    type(node_freedom_t), intent(in) :: freedom
    integer, intent(in) :: node
    type(opposite_t), intent(in) :: opposite
    integer, intent(in) :: axis
    real(wp) :: direction(3), tied
    integer :: k

    direction = 0.0_wp
    direction(axis) = 1.0_wp
    are_joined = are_one(freedom, node, opposite, direction, 1.0_wp - nearly_all)
    if (are_joined) return
    tied = 0.0_wp
    do k = 1, opposite%n
      if (are_tied(freedom, node, opposite%node(k), axis)) tied = tied + opposite%weight(k)
    end do
    are_joined = tied >= nearly_all
  end function are_joined

  !> Whether what constraints leave of the relative motion is no more than rounding, or `allowed`.
  pure logical function are_one(freedom, node, opposite, direction, allowed)
    type(node_freedom_t), intent(in) :: freedom
    integer, intent(in) :: node
    type(opposite_t), intent(in) :: opposite
    real(wp), intent(in) :: direction(3)
    real(wp), intent(in) :: allowed !! of the motion of one side [-]
    type(motion_t) :: motion
    integer :: k

    call add_motion(freedom, node, direction, 1.0_wp, motion)
    do k = 1, opposite%n
      call add_motion(freedom, opposite%node(k), direction, -opposite%weight(k), motion)
    end do
    are_one = size_of(motion) <= allowed
  end function are_one

  !> Whether a tie hangs one of two nodes on the other, or both on a third.
  pure logical function are_tied(freedom, node, other, axis)
    type(node_freedom_t), intent(in) :: freedom
    integer, intent(in) :: node, other, axis

    associate (one_tied => freedom%is_tied(axis, node), both => freedom%is_tied(axis, [node, &
               other]))
      are_tied = .false.
      if (one_tied) are_tied = any(masters_of(node) == other)
      if (both(2) .and. .not. are_tied) are_tied = any(masters_of(other) == node)
      if (all(both) .and. .not. are_tied) are_tied = have_common(masters_of(node), &
        masters_of(other))
    end associate

  contains

    pure function masters_of(of) result(masters)
      integer, intent(in) :: of
      integer, allocatable :: masters(:)

      associate (c => freedom%constraint(axis, of), active => freedom%active)
        masters = active%master(active%first(c):active%first(c + 1) - 1)
      end associate
    end function masters_of

    pure logical function have_common(one, two)
      integer, intent(in) :: one(:), two(:)
      integer :: i

      have_common = any([(any(one(i) == two), i=1, size(one))])
    end function have_common

  end function are_tied

  !> Add the motion of a node along a direction, constraints substituted.
  pure subroutine add_motion(freedom, node, direction, factor, motion)
    type(node_freedom_t), intent(in) :: freedom
    integer, intent(in) :: node
    real(wp), intent(in) :: direction(3), factor
    type(motion_t), intent(inout) :: motion
    integer :: a, k

    do a = 1, 3
      if (abs(direction(a)) <= straight) cycle
      associate (c => freedom%constraint(a, node), active => freedom%active)
        if (c == 0) then
          call add(motion, node, a, direction(a)*factor)
          cycle
        end if
        do k = active%first(c), active%first(c + 1) - 1
          call add(motion, active%master(k), active%master_dof(k), direction(a)*factor* &
            active%weight(k))
        end do
      end associate
    end do

  contains

    pure subroutine add(motion, at, dof, amount)
      type(motion_t), intent(inout) :: motion
      integer, intent(in) :: at, dof
      real(wp), intent(in) :: amount
      integer :: i, n

      if (.not. freedom%can_move(dof, at)) return
      n = motion%n
      do i = 1, n
        if (motion%node(i) /= at .or. motion%dof(i) /= dof) cycle
        motion%factor(i) = motion%factor(i) + amount
        return
      end do
      if (.not. allocated(motion%node)) then
        allocate (motion%node(16), motion%dof(16), motion%factor(16))
      else if (n == size(motion%node)) then
        call enlarge(motion%node, n, 2*n)
        call enlarge(motion%dof, n, 2*n)
        call enlarge(motion%factor, n, 2*n)
      end if
      motion%n = n + 1
      motion%node(n + 1) = at
      motion%dof(n + 1) = dof
      motion%factor(n + 1) = amount
    end subroutine add

  end subroutine add_motion

  pure real(wp) function size_of(motion)
    type(motion_t), intent(in) :: motion

    size_of = 0.0_wp
    if (motion%n > 0) size_of = sum(abs(motion%factor(:motion%n)))
  end function size_of

end module fixed_points_mod
