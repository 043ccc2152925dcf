!> Solutions for the bodies by PETSc, on all ranks: the host asks, and every rank has its rows
!> (petsc_part.f90).
!>
!> Unknowns are the host's. It deals them out for every product and every approximate inverse, and
!> collects what comes of it.
!> Where bodies move freely each pin has a spring in the matrix, which products with K leave out.
module petsc_body_mod
  use kinds_mod, only: wp, i8
  use errors_mod, only: error_t
  use parallel_mod, only: announce, n_ranks, receive_integers, receive_reals, send_integers, &
    send_reals, task_iterative, task_length
  use springs_mod, only: are_same, some_springs, springs_t
  use assembly_mod, only: diagonal_of
  use dof_map_mod, only: equations_of, to_nodes, unknowns_of
  use iterative_body_mod, only: iterative_body_t, numbering_t
  use node_parts_mod, only: node_part_t
  use petsc_part_mod, only: apply_part, hold_nodes, keep_nodes, make_part, multiply_part, &
    petsc_part_t, release_part
  use petsc_values_mod, only: collect_whole, make_whole, release_whole, spread_whole, whole_t
  implicit none
  private

  public :: petsc_body_t, petsc_share_t, make_petsc_body, participate

  ! What the ranks are to do, in the second number of a task.
  integer(i8), parameter :: to_make = 1, to_hold = 2, to_multiply = 3, to_apply = 4, to_release = 5

  !> What every rank has.
  type :: petsc_share_t
    private
    type(petsc_part_t) :: part
    type(whole_t) :: whole !! between the ranks and the host, where there are several
  end type petsc_share_t

  !> What the host has.
  type, extends(iterative_body_t) :: petsc_body_t
    private
    type(petsc_share_t) :: share
    integer, allocatable :: place(:)   !! (n+n_pins) of each unknown, among three a row
    integer, allocatable :: row(:)     !! (n_nodes) of each node, 0 without unknowns
    real(wp), allocatable :: spring(:) !! (n_pins) in the matrix, at each pin [force/length]
    integer, allocatable :: held(:)    !! (m) rows of the nodes that may be held
    type(springs_t) :: springs         !! between rows
    real(wp), allocatable :: rows(:, :) !! (3,n_rows) of all ranks, where there are several
  contains
    procedure :: hold => hold_at_nodes
    procedure :: product => product_with_k
    procedure :: precondition => apply_inverse
    final :: release
  end type petsc_body_t

contains

  ! ------------------------------------------------------------------ host

  !> A body of its stiffness.
  subroutine make_petsc_body(summed, row, numbering, body, error)
    type(node_part_t), intent(in) :: summed !! the host's; the other ranks have theirs
    integer, intent(in) :: row(:)          !! (n_nodes) of each node, 0 without unknowns
    type(numbering_t), intent(in) :: numbering
    class(iterative_body_t), allocatable, intent(out) :: body
    type(error_t), allocatable, intent(out) :: error !! PETSc failed
    type(petsc_body_t), allocatable :: made
    integer, allocatable :: pin_row(:), facing(:)
    real(wp) :: diagonal(summed%k%n), of_nodes(3, size(row))
    integer :: i, equations(3), rank

    allocate (made)
    made%n = numbering%map%n_free
    made%n_pins = size(numbering%pin_node)
    made%row = row
    pin_row = row(numbering%pin_node)
    call place_unknowns(made, numbering, pin_row)
    diagonal = diagonal_of(summed%k)
    allocate (made%spring(made%n_pins))
    do i = 1, made%n_pins
      equations = equations_of(numbering%whole, numbering%pin_node(i))
      made%spring(i) = diagonal(equations(numbering%pin_dof(i)))
    end do
    call to_nodes(numbering%whole, diagonal, of_nodes)
    made%diagonal = [unknowns_of(numbering%map, of_nodes), made%spring]
    facing = pack(row(numbering%facing), row(numbering%facing) > 0)
    call announce(task_iterative, to_make, int(made%n_pins, i8))
    do rank = 1, n_ranks() - 1
      call send_integers(made%n_pins, pin_row, rank)
      call send_integers(made%n_pins, numbering%pin_dof, rank)
      call send_integers(1, [size(facing)], rank)
      call send_integers(size(facing), facing, rank)
    end do
    call make_share(summed, pin_row, numbering%pin_dof, facing, made%share)
    allocate (made%held(0))
    if (n_ranks() > 1) allocate (made%rows(3, summed%n_rows))
    call take_failure(made)
    if (allocated(made%failure)) error = made%failure
    call move_alloc(made, body)
  end subroutine make_petsc_body

  !> Where each unknown is.
  subroutine place_unknowns(body, numbering, pin_row)
    class(petsc_body_t), intent(inout) :: body
    type(numbering_t), intent(in) :: numbering
    integer, intent(in) :: pin_row(:)
    integer :: node, a, i, equations(3)

    allocate (body%place(body%n + body%n_pins))
    do node = 1, size(body%row)
      equations = equations_of(numbering%map, node)
      do a = 1, 3
        if (equations(a) > 0) body%place(equations(a)) = 3*(body%row(node) - 1) + a
      end do
    end do
    do i = 1, body%n_pins
      body%place(body%n + i) = 3*(pin_row(i) - 1) + numbering%pin_dof(i)
    end do
  end subroutine place_unknowns

  !> P (K + what springs do) P, with a diagonal along what is held, in the place of K.
  subroutine hold_at_nodes(body, node, held, stiffer, springs, of_spring)
    class(petsc_body_t), intent(inout) :: body
    integer, intent(in) :: node(:)
    real(wp), intent(in) :: held(:, :, :), stiffer(:, :, :)
    type(springs_t), intent(in) :: springs
    real(wp), intent(in) :: of_spring(:, :, :)
    type(springs_t) :: of_rows
    logical :: is_new
    integer :: rank

    if (allocated(body%failure) .or. max(size(node), size(body%held), springs%n, &
      body%springs%n) == 0) return
    if (springs%n > 0) of_rows = some_springs(springs, body%row(springs%at))
    is_new = size(node) /= size(body%held) .or. .not. are_same(of_rows, body%springs)
    if (.not. is_new) is_new = any(body%row(node) /= body%held)
    body%held = body%row(node)
    body%springs = of_rows
    call announce(task_iterative, to_hold, size(node, kind=i8))
    do rank = 1, n_ranks() - 1
      call send_integers(2, [merge(1, 0, is_new), springs%n], rank)
      call send_integers(size(node), body%held, rank)
      call send_reals(size(held), held, rank)
      call send_reals(size(stiffer), stiffer, rank)
      if (is_new) call send_springs(of_rows, rank)
      call send_reals(size(of_spring), of_spring, rank)
    end do
    if (is_new) call keep_nodes(body%share%part, body%held, of_rows)
    call hold_nodes(body%share%part, body%held, held, stiffer, of_spring)
    call take_failure(body)
  end subroutine hold_at_nodes

  !> Springs between rows, to another rank.
  subroutine send_springs(springs, rank)
    type(springs_t), intent(in) :: springs
    integer, intent(in) :: rank

    if (springs%n == 0) return
    call send_integers(springs%n + 1, springs%first, rank)
    call send_integers(size(springs%at), springs%at, rank)
    call send_reals(size(springs%share), springs%share, rank)
  end subroutine send_springs

  !> K x.
  subroutine product_with_k(body, x, y)
    class(petsc_body_t), intent(inout) :: body
    real(wp), intent(in) :: x(:)
    real(wp), intent(out) :: y(:)

    call ask(body, to_multiply, x, y)
    y(body%n + 1:) = y(body%n + 1:) - body%spring*x(body%n + 1:)
  end subroutine product_with_k

  !> P M P x, M one cycle of multigrid.
  subroutine apply_inverse(body, x, y)
    class(petsc_body_t), intent(inout) :: body
    real(wp), intent(in) :: x(:)
    real(wp), intent(out) :: y(:)

    call ask(body, to_apply, x, y)
  end subroutine apply_inverse

  !> What all ranks do with the unknowns.
  subroutine ask(body, what, x, y)
    class(petsc_body_t), intent(inout) :: body
    integer(i8), intent(in) :: what
    real(wp), intent(in) :: x(:)
    real(wp), intent(out) :: y(:)

    y = 0.0_wp
    if (allocated(body%failure)) return
    associate (share => body%share)
      if (allocated(body%rows)) then
        call announce(task_iterative, what)
        call to_rows(body%place, x, size(body%rows, 2), body%rows)
        call spread_whole(share%whole, share%part%x, share%part%failure, body%rows)
        call work(what, share%part)
        call collect_whole(share%whole, share%part%y, share%part%failure, body%rows)
        call from_rows(body%place, size(body%rows, 2), body%rows, y)
      else
        call to_rows(body%place, x, size(share%part%x%at, 2), share%part%x%at)
        call work(what, share%part)
        call from_rows(body%place, size(share%part%y%at, 2), share%part%y%at, y)
      end if
    end associate
    call take_failure(body)
  end subroutine ask

  subroutine take_failure(body)
    class(petsc_body_t), intent(inout) :: body

    if (allocated(body%share%part%failure)) body%failure = body%share%part%failure
  end subroutine take_failure

  !> Unknowns at their places, 0 elsewhere.
  pure subroutine to_rows(place, unknowns, n_rows, rows)
    integer, intent(in) :: place(:)
    real(wp), intent(in) :: unknowns(:)
    integer, intent(in) :: n_rows
    real(wp), intent(out) :: rows(3*n_rows) !! three a row
    integer :: i

    rows = 0.0_wp
    do i = 1, size(place)
      rows(place(i)) = unknowns(i)
    end do
  end subroutine to_rows

  !> The unknowns from their places.
  pure subroutine from_rows(place, n_rows, rows, unknowns)
    integer, intent(in) :: place(:)
    integer, intent(in) :: n_rows
    real(wp), intent(in) :: rows(3*n_rows) !! three a row
    real(wp), intent(out) :: unknowns(:)
    integer :: i

    do i = 1, size(place)
      unknowns(i) = rows(place(i))
    end do
  end subroutine from_rows

  !> Give PETSc's memory back on all ranks.
  subroutine release(body)
    type(petsc_body_t), intent(inout) :: body

    call announce(task_iterative, to_release)
    call release_share(body%share)
  end subroutine release

  ! ------------------------------------------------------------------ other ranks

  !> Do what the host asks for.
  subroutine participate(task, summed, mine, error)
    integer(i8), intent(in) :: task(task_length)
    type(node_part_t), intent(inout) :: summed    !! as it was summed; gone once it is used
    type(petsc_share_t), intent(inout) :: mine
    type(error_t), allocatable, intent(out) :: error !! PETSc failed
    integer, allocatable :: row(:), dof(:), facing(:)
    real(wp), allocatable :: held(:, :, :), stiffer(:, :, :), of_spring(:, :, :)
    type(node_part_t) :: nothing
    type(springs_t) :: springs
    integer :: n, n_facing(1), is_new(2) !! the second number is of springs

    n = int(task(3))
    select case (task(2))
    case (to_make)
      allocate (row(n), dof(n))
      call receive_integers(n, row)
      call receive_integers(n, dof)
      call receive_integers(1, n_facing)
      allocate (facing(n_facing(1)))
      call receive_integers(n_facing(1), facing)
      call make_share(summed, row, dof, facing, mine)
      summed = nothing
    case (to_hold)
      allocate (row(n), held(3, 3, n), stiffer(3, 3, n))
      call receive_integers(2, is_new)
      call receive_integers(n, row)
      call receive_reals(size(held), held)
      call receive_reals(size(stiffer), stiffer)
      if (is_new(1) > 0) then
        call receive_springs(is_new(2), springs)
        call keep_nodes(mine%part, row, springs)
      end if
      allocate (of_spring(3, 3, is_new(2)))
      call receive_reals(size(of_spring), of_spring)
      call hold_nodes(mine%part, row, held, stiffer, of_spring)
    case (to_multiply, to_apply)
      call spread_whole(mine%whole, mine%part%x, mine%part%failure)
      call work(task(2), mine%part)
      call collect_whole(mine%whole, mine%part%y, mine%part%failure)
    case default ! to_release
      call release_share(mine)
    end select
    if (allocated(mine%part%failure)) error = mine%part%failure
  end subroutine participate

  !> Springs between rows, from the host.
  subroutine receive_springs(n, springs)
    integer, intent(in) :: n
    type(springs_t), intent(out) :: springs

    springs%n = n
    if (n == 0) return
    allocate (springs%first(n + 1))
    call receive_integers(n + 1, springs%first)
    allocate (springs%at(springs%first(n + 1) - 1))
    call receive_integers(size(springs%at), springs%at)
    allocate (springs%share(3, 3, size(springs%at)))
    call receive_reals(size(springs%share), springs%share)
  end subroutine receive_springs

  ! ------------------------------------------------------------------ all ranks

  subroutine make_share(summed, pin_row, pin_dof, facing, made)
    type(node_part_t), intent(in) :: summed
    integer, intent(in) :: pin_row(:), pin_dof(:) !! (n_pins) of all rows, and x, y or z
    integer, intent(in) :: facing(:)              !! of all rows, those that springs may join
    type(petsc_share_t), intent(inout) :: made

    call make_part(summed, pin_row, pin_dof, facing, made%part)
    if (summed%k%is_distributed .and. .not. allocated(made%part%failure)) call make_whole( &
      made%part%x, made%whole, made%part%failure)
  end subroutine make_share

  subroutine work(what, part)
    integer(i8), intent(in) :: what !! to_multiply or to_apply
    type(petsc_part_t), intent(inout) :: part

    if (what == to_multiply) then
      call multiply_part(part)
    else
      call apply_part(part)
    end if
  end subroutine work

  subroutine release_share(share)
    type(petsc_share_t), intent(inout) :: share
    type(petsc_share_t) :: new

    call release_whole(share%whole)
    call release_part(share%part)
    share = new
  end subroutine release_share

end module petsc_body_mod
