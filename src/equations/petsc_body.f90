!> Solutions for the bodies by PETSc: its algebraic multigrid (GAMG) with the rigid motions as near
!> null space is the approximate inverse.
!>
!> PETSc sees three unknowns at every node that has any; one that is prescribed, or depends on
!> others, has its diagonal alone. With directions held the matrix is P K P and what is held has a
!> diagonal of its own; the rows of the nodes that may be held are kept apart, so that products with
!> K itself are still to be had, and K can be put back. docs/theory.md (4.15).
!> Where bodies move freely each pin has a spring in the matrix, which products with K leave out,
!> and the coarser levels are made anew for what is held: nothing else may hold the bodies.
module petsc_body_mod
  use, intrinsic :: iso_c_binding, only: c_associated, c_int, c_loc, c_null_ptr, c_ptr
  use kinds_mod, only: wp, i8
  use errors_mod, only: error_t
  use block_rows_mod, only: block_rows_t, find_block, near_rows, put_block, &
    take_part, times_rows
  use held_rows_mod, only: held_rows_t, begin_product, end_product, hold_rows, keep_rows, &
    project_rows
  use assembly_mod, only: triplets_t
  use dof_map_mod, only: equations_of
  use iterative_body_mod, only: iterative_body_t, numbering_t
  use petsc_calls_mod, only: pc_apply, pc_destroy, vec_create, vec_destroy, vec_get_array, &
    vec_restore_array
  use petsc_session_mod, only: begin_petsc, note
  use petsc_smoother_mod, only: smoother_t
  use petsc_hierarchy_mod, only: hierarchy_t, make_hierarchy, release_hierarchy, &
    renew_hierarchy
  implicit none
  private

  public :: petsc_body_t, make_petsc_body

  integer, parameter :: near_layers = 3 !! of nodes around those that may be held

  !> The matrix, what is changed in it where directions are held, and PETSc's levels.
  type, extends(iterative_body_t) :: petsc_body_t
    private
    integer, allocatable :: place(:)   !! (n+n_pins) of each unknown, among three a node
    real(wp), allocatable :: spring(:) !! (n_pins) in the matrix, at each pin [force/length]
    integer, allocatable :: number(:)  !! (n_nodes) of each node among those with unknowns, or 0
    real(wp), allocatable :: position(:, :) !! (3,nodes with unknowns) [length]
    type(smoother_t), pointer :: smoother => null()
    !! its rows are the matrix, those of the nodes with unknowns [force/length]
    real(wp), pointer :: x(:, :) => null(), y(:, :) => null()
    !! (3,nodes with unknowns) what PETSc's vectors hold
    type(held_rows_t) :: held               !! the nodes that may be held
    real(wp), allocatable :: seen(:, :, :)  !! (3,3,m) what of these the coarser levels see
    type(c_ptr) :: ranks = c_null_ptr, inverse = c_null_ptr, &
      vector_x = c_null_ptr, vector_y = c_null_ptr
    type(hierarchy_t) :: hierarchy
  contains
    procedure :: hold => hold_at_nodes
    procedure :: product => product_with_k
    procedure :: precondition => apply_inverse
    final :: release
  end type petsc_body_t

contains

  !> A body of its stiffness.
  subroutine make_petsc_body(k, numbering, coordinates, start, neighbours, body, error)
    type(triplets_t), intent(in) :: k             !! with its values, not distributed
    type(numbering_t), intent(in) :: numbering
    real(wp), intent(in) :: coordinates(:, :)     !! (3,n_nodes) [length]
    integer, intent(in) :: start(:), neighbours(:) !! of the nodes, as of coupled_nodes
    class(iterative_body_t), allocatable, intent(out) :: body
    type(error_t), allocatable, intent(out) :: error !! PETSc failed
    type(petsc_body_t), allocatable :: made
    integer, allocatable :: of_k(:) !! place of each row of k
    integer :: n, i

    allocate (made)
    call begin_petsc(made%inverse, made%ranks, made%failure)
    made%n = numbering%map%n_free
    made%n_pins = size(numbering%pin_node)
    call number_unknowns(made, numbering, size(coordinates, 2), of_k)
    made%position = coordinates(:, pack([(i, i=1, size(made%number))], made%number > 0))
    n = size(made%position, 2)
    allocate (made%x(3, n), made%y(3, n), source=0.0_wp)
    allocate (made%smoother)
    allocate (made%smoother%near(0), made%smoother%left(3, n), made%spring(made%n_pins))
    associate (rows => made%smoother%rows)
      call list_blocks(made%number, start, neighbours, rows)
      call fill(rows, k, of_k)
      call complete_diagonal(made, rows)
      call keep_rows(rows, made%held, [integer ::])
      allocate (made%seen(3, 3, 0))
      call note(made%failure, vec_create(made%ranks, 3_c_int, int(3*n, c_int), c_loc(made%x), &
        made%vector_x))
      call note(made%failure, vec_create(made%ranks, 3_c_int, int(3*n, c_int), c_loc(made%y), &
        made%vector_y))
    end associate
    call make_hierarchy(made%ranks, made%vector_x, made%position, made%n_pins > 0, &
      made%smoother, made%inverse, made%hierarchy, made%failure)
    if (allocated(made%failure)) error = made%failure
    call move_alloc(made, body)
  end subroutine make_petsc_body

  !> Three places for every node that has an unknown.
  subroutine number_unknowns(body, numbering, n_nodes, of_k)
    class(petsc_body_t), intent(inout) :: body
    type(numbering_t), intent(in) :: numbering
    integer, intent(in) :: n_nodes
    integer, allocatable, intent(out) :: of_k(:) !! place of each row of the stiffness
    integer :: node, a, i, n, equations(3)

    allocate (body%number(n_nodes), source=0)
    allocate (body%place(body%n + body%n_pins), of_k(numbering%whole%n_free))
    n = 0
    do node = 1, n_nodes
      equations = equations_of(numbering%whole, node)
      if (all(equations == 0)) cycle
      n = n + 1
      body%number(node) = n
      do a = 1, 3
        if (equations(a) > 0) of_k(equations(a)) = 3*(n - 1) + a
      end do
      equations = equations_of(numbering%map, node)
      do a = 1, 3
        if (equations(a) > 0) body%place(equations(a)) = 3*(n - 1) + a
      end do
    end do
    do i = 1, body%n_pins
      body%place(body%n + i) = 3*(body%number(numbering%pin_node(i)) - 1) + numbering%pin_dof(i)
    end do
  end subroutine number_unknowns

  !> The pattern: a block for every neighbour before a node that has unknowns.
  subroutine list_blocks(number, start, neighbours, rows)
    integer, intent(in) :: number(:)               !! (n_nodes) of each row, or 0
    integer, intent(in) :: start(:), neighbours(:) !! of the nodes, as of coupled_nodes
    type(block_rows_t), intent(inout) :: rows
    integer :: node, row, n
    integer, allocatable :: others(:)

    allocate (rows%first(count(number > 0) + 1))
    n = 0
    do node = 1, size(number)
      if (number(node) == 0) cycle
      n = n + size(before(node))
    end do
    allocate (rows%column(n))
    n = 0
    row = 0
    do node = 1, size(number)
      if (number(node) == 0) cycle
      row = row + 1
      rows%first(row) = n + 1
      others = before(node)
      rows%column(n + 1:n + size(others)) = others
      n = n + size(others)
    end do
    rows%first(row + 1) = n + 1
    allocate (rows%block(3, 3, n), rows%own(3, 3, row), rows%inverse(3, 3, row), source=0.0_wp)

  contains

    function before(node) result(others)
      integer, intent(in) :: node
      integer, allocatable :: others(:)

      others = number(neighbours(start(node):start(node + 1) - 1))
      others = pack(others, others > 0 .and. others < number(node))
    end function before

  end subroutine list_blocks

  !> The entries of K.
  subroutine fill(rows, k, place)
    type(block_rows_t), intent(inout) :: rows
    type(triplets_t), intent(in) :: k !! of one triangle
    integer, intent(in) :: place(:)   !! of each row of k
    integer(i8) :: e
    integer :: row, column, i, j

    do e = 1, size(k%value, kind=i8)
      row = (max(place(k%row(e)), place(k%column(e))) + 2)/3
      column = (min(place(k%row(e)), place(k%column(e))) + 2)/3
      i = modulo(max(place(k%row(e)), place(k%column(e))) - 1, 3) + 1
      j = modulo(min(place(k%row(e)), place(k%column(e))) - 1, 3) + 1
      if (row == column) then
        rows%own(i, j, row) = k%value(e)
        rows%own(j, i, row) = k%value(e)
      else
        rows%block(i, j, find_block(rows, row, column)) = k%value(e)
      end if
    end do
  end subroutine fill

  !> A diagonal for what is no unknown, a spring at every pin.
  subroutine complete_diagonal(body, rows)
    class(petsc_body_t), intent(inout) :: body
    type(block_rows_t), intent(inout) :: rows
    logical, allocatable :: is_unknown(:, :)
    real(wp) :: block(3, 3), mean
    integer :: i, j, a

    allocate (is_unknown(3, size(body%position, 2)), source=.false.)
    do i = 1, size(body%place)
      is_unknown(modulo(body%place(i) - 1, 3) + 1, (body%place(i) + 2)/3) = .true.
    end do
    do i = 1, size(is_unknown, 2)
      block = rows%own(:, :, i)
      mean = 0.0_wp
      do a = 1, 3
        if (is_unknown(a, i)) mean = mean + block(a, a)/count(is_unknown(:, i))
      end do
      do a = 1, 3
        if (.not. is_unknown(a, i)) block(a, a) = mean
      end do
      do j = 1, body%n_pins
        if ((body%place(body%n + j) + 2)/3 /= i) cycle
        a = modulo(body%place(body%n + j) - 1, 3) + 1
        body%spring(j) = block(a, a)
        block(a, a) = 2.0_wp*block(a, a)
      end do
      call put_block(rows, i, i, block)
    end do
  end subroutine complete_diagonal

  !> P K P, with a diagonal along what is held, in the place of K.
  subroutine hold_at_nodes(body, node, held, stiffer)
    class(petsc_body_t), intent(inout) :: body
    integer, intent(in) :: node(:)
    real(wp), intent(in) :: held(:, :, :), stiffer(:, :, :)
    real(wp), parameter :: few = 0.05_wp  ! nodes, of those that may be held: not worth new levels
    real(wp), parameter :: much = 0.5_wp  ! of what is held at a node: it is another
    logical :: is_new

    if (allocated(body%failure) .or. max(size(node), size(body%held%row)) == 0) return
    associate (rows => body%smoother%rows)
      is_new = size(node) /= size(body%held%row)
      if (.not. is_new) is_new = any(body%number(node) /= body%held%row)
      if (is_new) then
        call keep_rows(rows, body%held, body%number(node))
        body%smoother%near = near_rows(rows, body%held%row, near_layers)
        body%smoother%around = near_rows(rows, body%smoother%near, 1)
      end if
      call hold_rows(rows, body%held, held, stiffer)
      body%smoother%part = take_part(rows, body%smoother%near)
    end associate
    if (body%n_pins == 0) return
    associate (left => body%held%left)
      if (.not. is_new .and. size(body%seen, 3) == size(left, 3)) then
        if (count(maxval(maxval(abs(left - body%seen), dim=1), dim=1) > much) <= &
          few*size(left, 3)) return
      end if
      call renew_hierarchy(body%smoother%rows, body%inverse, body%hierarchy, body%failure)
      body%seen = left
    end associate
  end subroutine hold_at_nodes

  !> K x, by the matrix where nothing is held, and by the rows that are kept.
  subroutine product_with_k(body, x, y)
    class(petsc_body_t), intent(inout) :: body
    real(wp), intent(in) :: x(:)
    real(wp), intent(out) :: y(:)
    real(wp) :: along(3, size(body%held%row))

    y = 0.0_wp
    if (allocated(body%failure)) return
    call to_rows(body%place, x, body%x)
    call begin_product(body%held, body%x, along)
    call times_rows(body%smoother%rows, body%x, body%y)
    call end_product(body%held, body%x, along, body%y)
    call from_rows(body%place, body%y, y)
    y(body%n + 1:) = y(body%n + 1:) - body%spring*x(body%n + 1:)
  end subroutine product_with_k

  !> P M P x, M one cycle of multigrid.
  subroutine apply_inverse(body, x, y)
    class(petsc_body_t), intent(inout) :: body
    real(wp), intent(in) :: x(:)
    real(wp), intent(out) :: y(:)

    y = 0.0_wp
    if (allocated(body%failure)) return
    call to_rows(body%place, x, body%x)
    call project_rows(body%held, body%x)
    call touch(body)
    call note(body%failure, pc_apply(body%inverse, body%vector_x, body%vector_y))
    call project_rows(body%held, body%y)
    call from_rows(body%place, body%y, y)
  end subroutine apply_inverse

  !> Unknowns at their places, 0 elsewhere.
  pure subroutine to_rows(place, unknowns, rows)
    integer, intent(in) :: place(:)
    real(wp), intent(in) :: unknowns(:)
    real(wp), contiguous, intent(out) :: rows(:, :) !! (3,n)
    integer :: i

    rows = 0.0_wp
    do i = 1, size(place)
      rows(modulo(place(i) - 1, 3) + 1, (place(i) + 2)/3) = unknowns(i)
    end do
  end subroutine to_rows

  !> The unknowns from their places.
  pure subroutine from_rows(place, rows, unknowns)
    integer, intent(in) :: place(:)
    real(wp), contiguous, intent(in) :: rows(:, :) !! (3,n)
    real(wp), intent(out) :: unknowns(:)
    integer :: i

    do i = 1, size(place)
      unknowns(i) = rows(modulo(place(i) - 1, 3) + 1, (place(i) + 2)/3)
    end do
  end subroutine from_rows

  !> Tell PETSc that the numbers of x are others now.
  subroutine touch(body)
    class(petsc_body_t), intent(inout) :: body
    type(c_ptr) :: array

    call note(body%failure, vec_get_array(body%vector_x, array))
    call note(body%failure, vec_restore_array(body%vector_x, array))
  end subroutine touch

  !> Give PETSc's memory back, then what it was lent.
  subroutine release(body)
    type(petsc_body_t), intent(inout) :: body
    integer(c_int) :: status

    if (c_associated(body%inverse)) status = pc_destroy(body%inverse)
    call release_hierarchy(body%hierarchy)
    if (c_associated(body%vector_x)) status = vec_destroy(body%vector_x)
    if (c_associated(body%vector_y)) status = vec_destroy(body%vector_y)
    if (associated(body%x)) deallocate (body%x, body%y)
    if (associated(body%smoother)) deallocate (body%smoother)
  end subroutine release

end module petsc_body_mod
