!> The bodies and the rows of contact points, where both are solved together by iteration.
!>
!> Each point that has rows is a node of its own whose unknowns no other point shares, before an
!> obstacle that cannot move: C takes them into the frame, and C C^T = I. Pins of free motions are
!> unknowns too, the last. docs/theory.md (4.16).
module held_body_mod
  use kinds_mod, only: wp
  use contact_points_mod, only: contact_points_t
  use stiffness_inverse_mod, only: stiffness_inverse_t
  use rigid_modes_mod, only: free_motions_t
  use body_map_mod, only: body_map_t
  use transfer_mod, only: transfer_t
  implicit none
  private

  public :: hold_body

  real(wp), parameter :: rounding = 1.0e-12_wp !! of C C^T [-]

  type, extends(body_map_t) :: held_body_t
    type(stiffness_inverse_t), pointer, private :: inverse => null() !! of the body solver
    integer,  allocatable, private :: node(:)        !! (n_points)
    integer,  allocatable, private :: equation(:, :)
    !! (3,n_points) unknown along x, y, z; 0 where there is none
    integer,  allocatable, private :: row(:, :)      !! (3,n_points) 0 where there is none
    real(wp), allocatable, private :: frame(:, :, :) !! (3,3,n_points) columns n, t1, t2
  contains
    procedure :: n => count_unknowns
    procedure :: hold => hold_points
    procedure :: product => press
    procedure :: precondition
    procedure :: at_points
    procedure :: add_from_points
  end type held_body_t

contains

  !> The body of a placement's rows; not allocated where these are of another kind. It holds as long
  !> as the inverse does.
  subroutine hold_body(inverse, motions, points, transfer, frame, row, active, map)
    type(stiffness_inverse_t), pointer, intent(in) :: inverse !! by iteration
    type(free_motions_t), intent(in) :: motions               !! of bodies
    type(contact_points_t), intent(in) :: points
    type(transfer_t), intent(in) :: transfer
    real(wp), intent(in) :: frame(:, :, :)  !! (3,3,n_points of the run)
    integer, intent(in) :: row(:, :)        !! (3,n_points of the run)
    integer, intent(in) :: active(:)        !! (n_points) those that have rows, ascending
    class(body_map_t), allocatable, intent(out) :: map
    type(held_body_t), allocatable :: body
    logical :: is_taken(inverse%map%n_free)
    integer :: i, a, b, k
    real(wp) :: product

    allocate (body)
    body%inverse => inverse
    body%node = points%node(active)
    body%row = row(:, active)
    body%frame = frame(:, :, active)
    allocate (body%equation(3, size(active)), source=0)
    is_taken = .false.
    do i = 1, size(active)
      do a = 1, 3
        associate (first => transfer%first(3*(active(i) - 1) + a), &
                   last => transfer%first(3*(active(i) - 1) + a + 1) - 1)
          do k = 1, motions%n
            if (motions%node(k) == body%node(i) .and. motions%dof(k) == a) body%equation(a, i) = &
              inverse%map%n_free + k
          end do
          if (last < first) cycle
          k = inverse%map%n_free - inverse%map%n_interface + transfer%equation(first)
          if (last > first .or. inverse%map%node(k) /= body%node(i) .or. is_taken(k)) return
          is_taken(k) = .true.
          body%equation(a, i) = k
        end associate
      end do
      do a = 1, 3
        do b = 1, a
          if (min(body%row(a, i), body%row(b, i)) == 0) cycle
          product = sum(body%frame(:, a, i)*body%frame(:, b, i), mask=body%equation(:, i) > 0)
          if (abs(product - merge(1.0_wp, 0.0_wp, a == b)) > rounding) return
        end do
      end do
    end do
    call move_alloc(body, map)
  end subroutine hold_body

  pure integer function count_unknowns(map) result(n)
    class(held_body_t), intent(in) :: map

    n = map%inverse%iterative%n + map%inverse%iterative%n_pins
  end function count_unknowns

  subroutine hold_points(map, held, stiffer)
    class(held_body_t), intent(in) :: map
    real(wp), intent(in) :: held(:, :, :), stiffer(:, :, :)
    real(wp), dimension(3, 3, size(held, 3)) :: held_xyz, stiffer_xyz
    integer :: i

    do i = 1, size(held, 3)
      associate (frame => map%frame(:, :, i))
        held_xyz(:, :, i) = matmul(frame, matmul(held(:, :, i), transpose(frame)))
        stiffer_xyz(:, :, i) = matmul(frame, matmul(stiffer(:, :, i), transpose(frame)))
      end associate
    end do
    call map%inverse%iterative%hold(map%node, held_xyz, stiffer_xyz)
  end subroutine hold_points

  subroutine press(map, v, product)
    class(held_body_t), intent(in) :: map
    real(wp), intent(in) :: v(:)
    real(wp), intent(out) :: product(:)

    call map%inverse%iterative%product(v, product)
  end subroutine press

  subroutine precondition(map, v, product)
    class(held_body_t), intent(in) :: map
    real(wp), intent(in) :: v(:)
    real(wp), intent(out) :: product(:)

    call map%inverse%iterative%precondition(v, product)
    map%inverse%iterative%iterations = map%inverse%iterative%iterations + 1
  end subroutine precondition

  subroutine at_points(map, v, rows)
    class(held_body_t), intent(in) :: map
    real(wp), intent(in) :: v(:)
    real(wp), intent(out) :: rows(:, :)
    real(wp) :: own(3)
    integer :: i, a

    do i = 1, size(rows, 2)
      own = 0.0_wp
      do a = 1, 3
        if (map%equation(a, i) > 0) own(a) = v(map%equation(a, i))
      end do
      rows(:, i) = merge(matmul(own, map%frame(:, :, i)), 0.0_wp, map%row(:, i) > 0)
    end do
  end subroutine at_points

  subroutine add_from_points(map, rows, v)
    class(held_body_t), intent(in) :: map
    real(wp), intent(in) :: rows(:, :)
    real(wp), intent(inout) :: v(:)
    real(wp) :: own(3)
    integer :: i, a

    do i = 1, size(rows, 2)
      own = matmul(map%frame(:, :, i), merge(rows(:, i), 0.0_wp, map%row(:, i) > 0))
      do a = 1, 3
        if (map%equation(a, i) > 0) v(map%equation(a, i)) = v(map%equation(a, i)) + own(a)
      end do
    end do
  end subroutine add_from_points

end module held_body_mod
