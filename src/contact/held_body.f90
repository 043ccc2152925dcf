!> The bodies and the rows of contact points, where both are solved together by iteration.
!>
!> Each point that has rows is a node of its own whose unknowns no other point shares. Before an
!> obstacle that cannot move C takes them into the frame, and C C^T = I. So it does before a body,
!> whose slave nodes' unknowns are their motion relative to it (relative_unknowns_mod). Pins of free
!> motions are unknowns too, the last. docs/theory.md (4.16), (4.20).
!>
!> The approximate inverse is that of displacements. What is held before an obstacle is projected
!> out of it; what is held before a body has springs there, about as stiff as the slave node, and is
!> projected out of the relative motion, (4.21).
module held_body_mod
  use kinds_mod, only: wp
  use springs_mod, only: add_spring, springs_t, trim_springs
  use contact_points_mod, only: contact_points_t, weights_t
  use dof_map_mod, only: equations_of
  use stiffness_inverse_mod, only: stiffness_inverse_t
  use linearisation_mod, only: linearisation_t
  use body_map_mod, only: body_map_t
  use sparse_rows_mod, only: rows_t
  use placement_mod, only: placement_t
  use relative_unknowns_mod, only: add_line, add_masters, give_diagonal, give_to_masters, &
    order_lines, relative_unknowns_t, take_from_masters, take_off_masters
  implicit none
  private

  public :: hold_body

  real(wp), parameter :: rounding = 1.0e-12_wp !! of C C^T [-]
  real(wp), parameter :: of_springs = 4.0_wp   !! beside half the diagonal of the slave node [-]

  type, extends(body_map_t) :: held_body_t
    type(stiffness_inverse_t), pointer, private :: inverse => null() !! of the linearisation
    integer,  allocatable, private :: node(:)        !! (n_points)
    integer,  allocatable, private :: equation(:, :)
    !! (3,n_points) unknown along x, y, z; 0 where there is none
    integer,  allocatable, private :: row(:, :)      !! (3,n_points) 0 where there is none
    real(wp), allocatable, private :: frame(:, :, :) !! (3,3,n_points) columns n, t1, t2
    type(relative_unknowns_t), private :: relative
    type(springs_t), private :: springs              !! between a slave node and its master each
    integer,  allocatable, private :: sprung(:)      !! (n_springs) point of each
    real(wp), allocatable, private :: stiffness(:)   !! (n_springs) of what is held [force/length]
    real(wp), allocatable, private :: left(:, :, :)
    !! (3,3,n_springs) projection on what is not held there, x, y, z [-]
  contains
    procedure :: n => count_unknowns
    procedure :: hold => hold_points
    procedure :: product => press
    procedure :: precondition
    procedure :: at_points
    procedure :: add_from_points
    procedure :: at_pins
    procedure :: add_at_pins
    procedure :: relate
    procedure :: unrelate
  end type held_body_t

  !> What a direction of a point moves with beside its node, as unknowns.
  type :: line_t
    integer :: n = 0
    integer,  allocatable :: unknown(:), node(:), dof(:) !! (n) and whose they are
    real(wp), allocatable :: weight(:)                   !! (n) [-]
  end type line_t

contains

  !> The body of a placement's rows; not allocated where these are of another kind. It holds as long
  !> as the inverse does.
  subroutine hold_body(body, points, transfer, placement, row, active, map)
    type(linearisation_t), intent(in) :: body !! by iteration
    type(contact_points_t), intent(in) :: points
    type(rows_t), intent(in) :: transfer
    type(placement_t), intent(in) :: placement
    integer, intent(in) :: row(:, :)        !! (3,n_points of the run)
    integer, intent(in) :: active(:)        !! (n_points) those that have rows, ascending
    class(body_map_t), allocatable, intent(out) :: map
    type(held_body_t), allocatable :: made
    type(line_t) :: lines(3)
    logical, allocatable :: is_taken(:)
    logical :: is_ordered
    integer :: i, a, b
    real(wp) :: product

    allocate (made)
    made%inverse => body%inverse
    made%node = points%node(active)
    made%row = row(:, active)
    made%frame = placement%frame(:, :, active)
    allocate (made%equation(3, size(active)), made%sprung(size(active)))
    allocate (made%stiffness(size(active)), source=0.0_wp)
    allocate (is_taken(made%n()), source=.false.)
    do i = 1, size(active)
      made%equation(:, i) = unknowns_at(body, made%node(i))
      do a = 1, 3
        associate (own => made%equation(a, i))
          lines(a) = line_of(body, transfer, placement%weights, active(i), a, own)
          if (any(lines(a)%unknown == own)) return
          if (own == 0) cycle
          if (is_taken(own)) return
          is_taken(own) = .true.
        end associate
      end do
      do a = 1, 3
        do b = 1, a
          if (min(made%row(a, i), made%row(b, i)) == 0) cycle
          product = sum(made%frame(:, a, i)*made%frame(:, b, i), mask=made%equation(:, i) > 0)
          if (abs(product - merge(1.0_wp, 0.0_wp, a == b)) > rounding) return
        end do
      end do
      if (sum(lines%n) > 0) call join_master(body, i, lines, made)
    end do
    call trim_springs(made%springs)
    made%sprung = made%sprung(:made%springs%n)
    made%stiffness = made%stiffness(:made%springs%n)
    call order_lines(made%relative, made%n(), is_ordered)
    if (.not. is_ordered) return
    allocate (made%left(3, 3, made%springs%n), source=0.0_wp)
    made%scale = body%inverse%iterative%diagonal
    if (size(body%inverse%map%body_first) > 2) then
      ! What is out of balance in a soft body is little beside the forces of a stiff one.
      call give_diagonal(made%relative, made%scale)
      made%scale = sqrt(maxval(made%scale)/made%scale)
    else
      made%scale = 1.0_wp
    end if
    call move_alloc(made, map)
  end subroutine hold_body

  !> The unknowns of a node along x, y, z, pins among them; 0 where there is none.
  pure function unknowns_at(body, node) result(unknowns)
    type(linearisation_t), intent(in) :: body
    integer, intent(in) :: node
    integer :: unknowns(3)
    integer :: k

    unknowns = equations_of(body%inverse%map, node)
    do k = 1, body%motions%n
      if (body%motions%node(k) == node) unknowns(body%motions%dof(k)) = body%inverse%map%n_free + k
    end do
  end function unknowns_at

  !> What direction `a` of a point moves with beside its own unknown. A node that is its own master
  !> is among it.
  pure type(line_t) function line_of(body, transfer, weights, point, a, own) result(line)
    type(linearisation_t), intent(in) :: body
    type(rows_t), intent(in) :: transfer
    type(weights_t), intent(in) :: weights
    integer, intent(in) :: point, a, own
    integer :: k, l, unknown, equations(3)

    associate (map => body%inverse%map, motions => body%motions, &
               first => transfer%first(3*(point - 1) + a), &
               last => transfer%first(3*(point - 1) + a + 1) - 1)
      allocate (line%unknown(0), line%node(0), line%dof(0), line%weight(0))
      do k = first, last
        unknown = map%n_free - map%n_interface + transfer%column(k)
        ! The first entry of a node that has an unknown there is its own.
        if (k == first .and. unknown == own) cycle
        equations = equations_of(map, map%node(unknown))
        call add(line, unknown, map%node(unknown), findloc(equations, unknown, dim=1), &
          -transfer%value(k))
      end do
      do k = weights%first(point), weights%first(point + 1) - 1
        do l = 1, motions%n
          if (motions%node(l) == weights%node(k) .and. motions%dof(l) == a) call &
            add(line, map%n_free + l, motions%node(l), a, weights%weight(k))
        end do
      end do
    end associate

  contains

    !> Constraints may name an unknown more than once.
    pure subroutine add(line, of_unknown, node, dof, weight)
      type(line_t), intent(inout) :: line
      integer, intent(in) :: of_unknown, node, dof
      real(wp), intent(in) :: weight
      integer :: m

      do m = 1, line%n
        if (line%unknown(m) /= of_unknown) cycle
        line%weight(m) = line%weight(m) + weight
        return
      end do
      line%n = line%n + 1
      line%unknown = [line%unknown, of_unknown]
      line%node = [line%node, node]
      line%dof = [line%dof, dof]
      line%weight = [line%weight, weight]
    end subroutine add

  end function line_of

  !> Make the unknowns of a point relative to its master, and put a spring between the two.
  subroutine join_master(body, i, lines, made)
    type(linearisation_t), intent(in) :: body
    integer, intent(in) :: i                !! of the points that have rows
    type(line_t), intent(in) :: lines(3)
    type(held_body_t), intent(inout) :: made
    integer, allocatable :: nodes(:)
    real(wp), allocatable :: shares(:, :, :)
    integer :: a, k, at, first_of_interface

    first_of_interface = body%inverse%map%n_free - body%inverse%map%n_interface
    allocate (nodes(1), source=made%node(i))
    allocate (shares(3, 3, 1 + sum(lines%n)), source=0.0_wp)
    made%sprung(made%springs%n + 1) = i
    associate (stiffness => made%stiffness(made%springs%n + 1))
      do a = 1, 3
        associate (own => made%equation(a, i), line => lines(a))
          if (own == 0) cycle
          call add_line(made%relative, own, line%unknown, line%weight)
          shares(a, a, 1) = 1.0_wp
          do k = 1, line%n
            do at = 1, size(nodes)
              if (nodes(at) == line%node(k)) exit
            end do
            if (at > size(nodes)) nodes = [nodes, line%node(k)]
            shares(a, line%dof(k), at) = -line%weight(k)
          end do
          if (own > body%inverse%map%n_free) then
            stiffness = max(stiffness, 1.0_wp/body%pin_flexibility(own - body%inverse%map%n_free))
          else
            stiffness = max(stiffness, 1.0_wp/body%flexibility(own - first_of_interface))
          end if
        end associate
      end do
    end associate
    call add_spring(made%springs, nodes, shares(:, :, :size(nodes)))
  end subroutine join_master

  pure integer function count_unknowns(map) result(n)
    class(held_body_t), intent(in) :: map

    n = map%inverse%iterative%n + map%inverse%iterative%n_pins
  end function count_unknowns

  subroutine hold_points(map, held, stiffer)
    class(held_body_t), intent(inout) :: map
    real(wp), intent(in) :: held(:, :, :), stiffer(:, :, :)
    real(wp), dimension(3, 3, size(held, 3)) :: held_xyz, stiffer_xyz
    real(wp) :: of_spring(3, 3, map%springs%n)
    logical :: is_sprung(size(held, 3))
    integer, allocatable :: others(:)
    integer :: i, a

    do i = 1, size(held, 3)
      associate (frame => map%frame(:, :, i))
        held_xyz(:, :, i) = matmul(frame, matmul(held(:, :, i), transpose(frame)))
        stiffer_xyz(:, :, i) = matmul(frame, matmul(stiffer(:, :, i), transpose(frame)))
      end associate
    end do
    is_sprung = .false.
    is_sprung(map%sprung) = .true.
    do i = 1, map%springs%n
      associate (point => map%sprung(i))
        of_spring(:, :, i) = stiffer_xyz(:, :, point) + of_springs*map%stiffness(i)* &
          held_xyz(:, :, point)
        map%left(:, :, i) = -held_xyz(:, :, point)
      end associate
      do a = 1, 3
        map%left(a, a, i) = 1.0_wp + map%left(a, a, i)
      end do
    end do
    others = pack([(i, i=1, size(held, 3))], .not. is_sprung)
    call map%inverse%iterative%hold(map%node(others), held_xyz(:, :, others), &
      stiffer_xyz(:, :, others), map%springs, of_spring)
  end subroutine hold_points

  !> T^T K T v.
  subroutine press(map, v, product)
    class(held_body_t), intent(in) :: map
    real(wp), intent(in) :: v(:)
    real(wp), intent(out) :: product(:)
    real(wp) :: u(size(v))

    u = v
    call add_masters(map%relative, u)
    call map%inverse%iterative%product(u, product)
    call give_to_masters(map%relative, product)
  end subroutine press

  !> P T^-1 M T^-T P v, docs/theory.md (4.21).
  subroutine precondition(map, v, product)
    class(held_body_t), intent(in) :: map
    real(wp), intent(in) :: v(:)
    real(wp), intent(out) :: product(:)
    real(wp) :: f(size(v))

    f = v
    call project(map, f)
    call take_from_masters(map%relative, f)
    call map%inverse%iterative%precondition(f, product)
    map%inverse%iterative%iterations = map%inverse%iterative%iterations + 1
    call take_off_masters(map%relative, product)
    call project(map, product)
  end subroutine precondition

  !> Take off what is held of relative motions.
  pure subroutine project(map, v)
    class(held_body_t), intent(in) :: map
    real(wp), intent(inout) :: v(:)
    real(wp) :: own(3)
    integer :: i, a

    do i = 1, map%springs%n
      associate (equation => map%equation(:, map%sprung(i)))
        own = 0.0_wp
        do a = 1, 3
          if (equation(a) > 0) own(a) = v(equation(a))
        end do
        own = matmul(map%left(:, :, i), own)
        do a = 1, 3
          if (equation(a) > 0) v(equation(a)) = own(a)
        end do
      end associate
    end do
  end subroutine project

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

  !> Displacements of the pins.
  pure function at_pins(map, v) result(a)
    class(held_body_t), intent(in) :: map
    real(wp), intent(in) :: v(:)
    real(wp), allocatable :: a(:)
    real(wp) :: u(size(v))

    u = v
    call add_masters(map%relative, u)
    a = u(map%inverse%iterative%n + 1:)
  end function at_pins

  !> Forces at the pins.
  pure subroutine add_at_pins(map, force, f)
    class(held_body_t), intent(in) :: map
    real(wp), intent(in) :: force(:)
    real(wp), intent(inout) :: f(:)
    real(wp) :: added(size(f))

    added = 0.0_wp
    added(map%inverse%iterative%n + 1:) = force
    call give_to_masters(map%relative, added)
    f = f + added
  end subroutine add_at_pins

  pure subroutine relate(map, v, f)
    class(held_body_t), intent(in) :: map
    real(wp), intent(inout) :: v(:), f(:)

    call take_off_masters(map%relative, v)
    call give_to_masters(map%relative, f)
  end subroutine relate

  pure subroutine unrelate(map, v, f)
    class(held_body_t), intent(in) :: map
    real(wp), intent(inout) :: v(:), f(:)

    call add_masters(map%relative, v)
    call take_from_masters(map%relative, f)
  end subroutine unrelate

end module held_body_mod
