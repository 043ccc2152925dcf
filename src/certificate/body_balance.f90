!> The balance of whole bodies and of obstacles, of the forces that act on them from outside: loads,
!> supports and contact. docs/theory.md (6.3).
module body_balance_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: cross
  use mesh_mod, only: mesh_t
  use error_measures_mod, only: excusable, ratio, rounded
  implicit none
  private

  public :: acting_t, worst_balance

  real(wp), parameter :: most_at_node = 8.0_wp
  !! elements of a regular mesh, whose forces may all be as large as the largest of one [-]

  !> What acts on the nodes from outside, (3,n_nodes) each [force].
  type :: acting_t
    real(wp), allocatable :: load(:, :), contact(:, :), support(:, :)
    real(wp), allocatable :: dead(:, :) !! of the loads what follows no body; not allocated: all
  end type acting_t

  !> What acts on a body along one of its rigid motions, or on an obstacle along one of its
  !> translations.
  type :: along_motion_t
    real(wp) :: total = 0.0_wp      !! of all forces [force]
    real(wp) :: weight = 0.0_wp     !! of their magnitudes along the motion [force]
    real(wp) :: magnitude = 0.0_wp  !! of their magnitudes, wherever they point [force]
    real(wp) :: dead = 0.0_wp       !! of the magnitudes of dead loads along the motion [force]
    real(wp) :: dead_magnitude = 0.0_wp !! and wherever they point [force]
    real(wp) :: rounding = 0.0_wp   !! that support forces carry along the motion [force]
    real(wp) :: arm = 0.0_wp        !! the farthest that a unit of the motion moves a node [-]
  end type along_motion_t

contains

  !> The worst balance of a whole body along its rigid motions, or of an obstacle along the
  !> translations that no support holds: loads, supports and contact alone. docs/theory.md (6.3).
  pure real(wp) function worst_balance(mesh, acting, prescribed, rounding, f) result(worst)
    type(mesh_t), intent(in) :: mesh
    type(acting_t), intent(in) :: acting
    logical, intent(in) :: prescribed(:, :)              !! (3,n_nodes) held by supports
    real(wp), intent(in) :: rounding(:)                  !! (n_nodes) of internal forces [force]
    real(wp), intent(in) :: f(0:)                        !! (0:n_bodies) of each body [force]
    type(along_motion_t) :: along(6, mesh%n_bodies), of_obstacle
    real(wp), dimension(3, mesh%n_bodies) :: low, high
    real(wp) :: motion(3, 6)
    integer :: node, body, i

    low = huge(1.0_wp)
    high = -huge(1.0_wp)
    do node = 1, mesh%n_nodes
      body = mesh%body(node)
      if (body == 0) cycle
      low(:, body) = min(low(:, body), mesh%coordinates(:, node))
      high(:, body) = max(high(:, body), mesh%coordinates(:, node))
    end do
    worst = 0.0_wp
    do node = 1, mesh%n_nodes
      body = mesh%body(node)
      if (body == 0) then
        motion = motions_of(spread(0.0_wp, 1, 3))
        do i = 1, 3
          if (prescribed(i, node)) cycle
          of_obstacle = along_motion_t()
          call add_node(node, motion(:, i), huge(1.0_wp), of_obstacle)
          worst = max(worst, out_of_balance(of_obstacle, f(0)))
        end do
      else
        motion = motions_of(mesh%coordinates(:, node) - 0.5_wp*(low(:, body) + high(:, body)))
        do i = 1, 6
          call add_node(node, motion(:, i), most_at_node*f(body), along(i, body))
        end do
      end if
    end do
    do body = 1, mesh%n_bodies
      do i = 1, 6
        worst = max(worst, out_of_balance(along(i, body), f(body)))
      end do
    end do

  contains

    !> Add the forces on a node to what acts along a motion.
    !>
    !> Reactions and supports that press against each other at a node, however hard, leave no more
    !> for the body than its elements can carry there: more is no measure.
    pure subroutine add_node(node, motion, most, along)
      integer, intent(in) :: node
      real(wp), intent(in) :: motion(3) !! of the node
      real(wp), intent(in) :: most      !! that counts of contact and of supports [force]
      type(along_motion_t), intent(inout) :: along
      real(wp) :: arm, dead(3)

      arm = norm2(motion)
      dead = acting%load(:, node)
      if (allocated(acting%dead)) dead = acting%dead(:, node)
      associate (load => acting%load(:, node), contact => acting%contact(:, node), &
                 held_by => acting%support(:, node))
        along%total = along%total + dot_product(load + contact + held_by, motion)
        along%weight = along%weight + abs(dot_product(load, motion)) + min(most*arm, &
          abs(dot_product(contact, motion))) + min(most*arm, abs(dot_product(held_by, motion)))
        along%magnitude = along%magnitude + (norm2(load) + norm2(contact) + norm2(held_by))*arm
        along%dead = along%dead + abs(dot_product(dead, motion))
        along%dead_magnitude = along%dead_magnitude + norm2(dead)*arm
      end associate
      along%rounding = along%rounding + rounding(node)*sum(abs(motion), mask=prescribed(:, node))
      along%arm = max(along%arm, arm)
    end subroutine add_node

  end function worst_balance

  !> What the translations along x, y, z and the rotations about them do to a point, a column each.
  pure function motions_of(arm) result(motion)
    real(wp), intent(in) :: arm(3)  !! of the point, from the centre of its body [length]
    real(wp) :: motion(3, 6)        !! [-], [length]
    integer :: i

    motion = 0.0_wp
    do i = 1, 3
      motion(i, i) = 1.0_wp
      motion(:, 3 + i) = cross(motion(:, i), arm)
    end do
  end function motions_of

  !> What is left of the forces along a motion, less what rounding excuses, beside their magnitudes.
  !>
  !> Support forces along the motion excuse what they carry. Where the loads have a part of their
  !> own along it, more than their rounding, that must be balanced by itself: the rounding of forces
  !> that act in other directions excuses at most a thousandth of it. Where they have none, what is
  !> left may also be small beside F. Pressures that follow faces have none: they are as exact as
  !> slopes of faces are, and these as forces balance.
  pure real(wp) function out_of_balance(along, f) result(left)
    type(along_motion_t), intent(in) :: along
    real(wp), intent(in) :: f  !! [force]
    real(wp) :: excuse, weight

    excuse = rounded*along%magnitude
    weight = along%weight
    if (along%dead > rounded*along%dead_magnitude) then
      excuse = min(excuse, excusable*along%dead)
    else
      weight = max(weight, f*along%arm)
    end if
    left = ratio(abs(along%total) - excuse - along%rounding, weight)
  end function out_of_balance

end module body_balance_mod
