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
  use, intrinsic :: iso_c_binding, only: c_int, c_loc, c_null_ptr, c_ptr, c_associated
  use kinds_mod, only: wp, i8
  use errors_mod, only: error_t
  use assembly_mod, only: triplets_t
  use dof_map_mod, only: equations_of
  use iterative_body_mod, only: iterative_body_t, numbering_t
  use petsc_calls_mod, only: final_assembly, mat_assembly_begin, mat_assembly_end, mat_create, &
    mat_destroy, mat_mult, mat_set_block_size, mat_set_option, pc_apply, pc_destroy, &
    positive_definite, vec_create, vec_destroy, vec_get_array, vec_restore_array, yes
  use petsc_session_mod, only: begin_petsc, note
  use petsc_hierarchy_mod, only: make_hierarchy, renew_hierarchy
  implicit none
  private

  public :: petsc_body_t, make_petsc_body

  !> A matrix in PETSc, and the blocks that are changed in it where directions are held.
  type, extends(iterative_body_t) :: petsc_body_t
    private
    integer, allocatable :: place(:)   !! (n+n_pins) of each unknown, among three a node
    real(wp), allocatable :: spring(:) !! (n_pins) in the matrix, at each pin [force/length]
    integer, allocatable :: number(:)  !! (n_nodes) of each node among those with unknowns, or 0
    integer(c_int), pointer :: first(:) => null(), column(:) => null()
    !! (n_rows+1) and columns, both from 0; columns ascend, a node's three rows have the same
    real(wp), pointer :: value(:) => null()            !! [force/length]
    real(wp), pointer :: x(:) => null(), y(:) => null() !! (n_rows) what PETSc multiplies, and gets
    real(wp), allocatable :: position(:, :) !! (3,nodes with unknowns) [length]
    logical, allocatable :: is_unknown(:)   !! (n_rows)
    type(c_ptr) :: ranks = c_null_ptr, matrix = c_null_ptr, inverse = c_null_ptr, &
      vector_x = c_null_ptr, vector_y = c_null_ptr
    ! Of the nodes that may be held:
    integer, allocatable :: node(:)         !! (m) among those with unknowns
    integer, allocatable :: start(:)        !! (m+1) where the blocks of each begin
    integer, allocatable :: other(:)        !! node of each block
    real(wp), allocatable :: block(:, :, :) !! (3,3,n_blocks) of K [force/length]
    real(wp), allocatable :: left(:, :, :)  !! (3,3,m) P
    real(wp), allocatable :: seen(:, :, :)  !! (3,3,m) of these what the coarser levels see
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
    integer(c_int) :: n_rows
    integer, allocatable :: of_k(:) !! place of each row of k
    integer :: node, a, i, equations(3)

    allocate (made)
    call begin_petsc(made%inverse, made%ranks, made%failure)
    made%n = numbering%map%n_free
    made%n_pins = size(numbering%pin_node)
    allocate (made%number(size(coordinates, 2)), source=0)
    allocate (made%place(made%n + made%n_pins), made%spring(made%n_pins))
    allocate (of_k(numbering%whole%n_free))
    n_rows = 0
    do node = 1, size(coordinates, 2)
      equations = equations_of(numbering%whole, node)
      if (all(equations == 0)) cycle
      made%number(node) = n_rows/3 + 1
      do a = 1, 3
        if (equations(a) > 0) of_k(equations(a)) = n_rows + a
      end do
      equations = equations_of(numbering%map, node)
      do a = 1, 3
        if (equations(a) > 0) made%place(equations(a)) = n_rows + a
      end do
      n_rows = n_rows + 3
    end do
    do i = 1, made%n_pins
      made%place(made%n + i) = 3*(made%number(numbering%pin_node(i)) - 1) + numbering%pin_dof(i)
    end do
    made%position = coordinates(:, pack([(node, node=1, size(made%number))], made%number > 0))
    allocate (made%is_unknown(n_rows), source=.false.)
    made%is_unknown(made%place) = .true.
    allocate (made%x(n_rows), made%y(n_rows), source=0.0_wp)
    call list_blocks(made, start, neighbours)
    call fill(made, k, of_k)
    do i = 1, made%n_pins
      associate (pin => made%place(made%n + i))
        made%spring(i) = made%value(entry_of(made, pin, pin))
        made%value(entry_of(made, pin, pin)) = 2.0_wp*made%spring(i)
      end associate
    end do
    allocate (made%node(0), made%start(1), made%other(0), source=1)
    allocate (made%block(3, 3, 0), made%left(3, 3, 0), made%seen(3, 3, 0))
    call note(made%failure, vec_create(made%ranks, 3_c_int, n_rows, c_loc(made%x), made%vector_x))
    call note(made%failure, vec_create(made%ranks, 3_c_int, n_rows, c_loc(made%y), made%vector_y))
    call note(made%failure, mat_create(made%ranks, n_rows, n_rows, c_loc(made%first), &
      c_loc(made%column), c_loc(made%value), made%matrix))
    if (.not. allocated(made%failure)) then
      call note(made%failure, mat_set_block_size(made%matrix, 3_c_int))
      call note(made%failure, mat_set_option(made%matrix, positive_definite, yes))
    end if
    call make_hierarchy(made%ranks, made%matrix, made%vector_x, made%position, made%n_pins > 0, &
      made%inverse, made%failure)
    if (allocated(made%failure)) error = made%failure
    call move_alloc(made, body)
  end subroutine make_petsc_body

  !> The pattern: three rows for every node, three columns for every neighbour.
  subroutine list_blocks(body, start, neighbours)
    class(petsc_body_t), intent(inout) :: body
    integer, intent(in) :: start(:), neighbours(:) !! of the nodes, as of coupled_nodes
    integer :: node, a, k, row
    integer(i8) :: n
    integer, allocatable :: others(:)

    allocate (body%first(size(body%x) + 1))
    n = 0
    do node = 1, size(body%number)
      if (body%number(node) == 0) cycle
      n = n + 9*count(body%number(neighbours(start(node):start(node + 1) - 1)) > 0)
    end do
    allocate (body%column(n), body%value(n))
    body%value = 0.0_wp
    n = 0
    row = 0
    do node = 1, size(body%number)
      if (body%number(node) == 0) cycle
      others = body%number(neighbours(start(node):start(node + 1) - 1))
      others = pack(others, others > 0)
      do a = 1, 3
        row = row + 1
        body%first(row) = int(n, c_int)
        do k = 1, size(others)
          body%column(n + 1:n + 3) = 3*(others(k) - 1) + [0, 1, 2]
          n = n + 3
        end do
      end do
    end do
    body%first(row + 1) = int(n, c_int)
  end subroutine list_blocks

  !> The entries of K, both triangles, and a diagonal for what is no unknown.
  subroutine fill(body, k, place)
    class(petsc_body_t), intent(inout) :: body
    type(triplets_t), intent(in) :: k
    integer, intent(in) :: place(:) !! of each row of k
    integer(i8) :: e
    integer :: row, node, a
    real(wp) :: diagonal(3), mean

    do e = 1, size(k%value, kind=i8)
      associate (i => place(k%row(e)), j => place(k%column(e)))
        body%value(entry_of(body, i, j)) = k%value(e)
        body%value(entry_of(body, j, i)) = k%value(e)
      end associate
    end do
    do node = 1, size(body%position, 2)
      associate (known => body%is_unknown(3*node - 2:3*node))
        diagonal = 0.0_wp
        do a = 1, 3
          if (known(a)) diagonal(a) = body%value(entry_of(body, 3*(node - 1) + a, &
            3*(node - 1) + a))
        end do
        mean = sum(diagonal)/count(known)
        do a = 1, 3
          row = 3*(node - 1) + a
          if (.not. known(a)) body%value(entry_of(body, row, row)) = mean
        end do
      end associate
    end do
  end subroutine fill

  !> Where an entry stands that is in the pattern.
  pure integer(i8) function entry_of(body, row, column) result(middle)
    class(petsc_body_t), intent(in) :: body
    integer, intent(in) :: row, column !! from 1
    integer(i8) :: low, high

    low = body%first(row) + 1_i8
    high = body%first(row + 1)
    do
      middle = (low + high)/2
      if (body%column(middle) == column - 1) return
      if (body%column(middle) < column - 1) then
        low = middle + 1
      else
        high = middle - 1
      end if
    end do
  end function entry_of

  !> P K P, with a diagonal along what is held, in the place of K.
  subroutine hold_at_nodes(body, node, held, stiffer)
    class(petsc_body_t), intent(inout) :: body
    integer, intent(in) :: node(:)
    real(wp), intent(in) :: held(:, :, :), stiffer(:, :, :)
    integer, allocatable :: member(:) !! of the nodes that may be held, 0 elsewhere
    real(wp), parameter :: few = 0.05_wp  ! nodes, of those that may be held: not worth new levels
    real(wp), parameter :: much = 0.5_wp  ! of what is held at a node: it is another
    real(wp) :: block(3, 3), own(3, 3)
    integer :: i, k, a
    logical :: is_new

    if (allocated(body%failure) .or. max(size(node), size(body%node)) == 0) return
    is_new = size(node) /= size(body%node)
    if (.not. is_new) is_new = any(body%number(node) /= body%node)
    if (is_new) call keep_blocks(body, body%number(node))
    allocate (member(size(body%position, 2)), source=0)
    member(body%node) = [(i, i=1, size(body%node))]
    body%left = -held
    do a = 1, 3
      body%left(a, a, :) = 1.0_wp + body%left(a, a, :)
    end do
    do i = 1, size(body%node)
      do k = body%start(i), body%start(i + 1) - 1
        associate (other => body%other(k))
          block = matmul(body%left(:, :, i), body%block(:, :, k))
          if (member(other) > 0) block = matmul(block, body%left(:, :, member(other)))
          if (other == body%node(i)) then
            own = 0.0_wp
            do a = 1, 3
              own(a, a) = body%block(a, a, k)
            end do
            block = block + matmul(held(:, :, i), matmul(own, held(:, :, i))) + stiffer(:, :, i)
          end if
          call put_block(body, body%node(i), other, block)
          call put_block(body, other, body%node(i), transpose(block))
        end associate
      end do
    end do
    call note(body%failure, mat_assembly_begin(body%matrix, final_assembly))
    call note(body%failure, mat_assembly_end(body%matrix, final_assembly))
    if (body%n_pins == 0) return
    if (.not. is_new .and. size(body%seen, 3) == size(body%left, 3)) then
      if (count(maxval(maxval(abs(body%left - body%seen), dim=1), dim=1) > much) <= &
        few*size(body%left, 3)) return
    end if
    call renew_hierarchy(body%matrix, body%inverse, body%failure)
    body%seen = body%left
  end subroutine hold_at_nodes

  !> Put K back, and keep the blocks of these nodes.
  subroutine keep_blocks(body, node)
    class(petsc_body_t), intent(inout) :: body
    integer, intent(in) :: node(:) !! among those with unknowns
    integer :: i, k, n, a

    do i = 1, size(body%node)
      do k = body%start(i), body%start(i + 1) - 1
        call put_block(body, body%node(i), body%other(k), body%block(:, :, k))
        call put_block(body, body%other(k), body%node(i), transpose(body%block(:, :, k)))
      end do
    end do
    n = 0
    do i = 1, size(node)
      n = n + (body%first(3*node(i)) - body%first(3*node(i) - 1))/3
    end do
    body%node = node
    deallocate (body%start, body%other, body%block, body%left)
    allocate (body%start(size(node) + 1), body%other(n), body%block(3, 3, n))
    allocate (body%left(3, 3, size(node)))
    n = 0
    do i = 1, size(node)
      body%start(i) = n + 1
      do k = 1, (body%first(3*node(i)) - body%first(3*node(i) - 1))/3
        n = n + 1
        body%other(n) = body%column(body%first(3*node(i)) + 3*k)/3 + 1
        do a = 1, 3
          associate (last => body%first(3*(node(i) - 1) + a) + 3*k)
            body%block(a, :, n) = body%value(last - 2:last)
          end associate
        end do
      end do
    end do
    body%start(size(node) + 1) = n + 1
  end subroutine keep_blocks

  !> The block of two nodes in the matrix.
  subroutine put_block(body, row, column, block)
    class(petsc_body_t), intent(inout) :: body
    integer, intent(in) :: row, column !! nodes among those with unknowns
    real(wp), intent(in) :: block(3, 3)
    integer(i8) :: entry
    integer :: a

    do a = 1, 3
      entry = entry_of(body, 3*(row - 1) + a, 3*column - 2)
      body%value(entry:entry + 2) = block(a, :)
    end do
  end subroutine put_block

  !> K x, by the matrix where nothing is held, and by the rows that are kept.
  subroutine product_with_k(body, x, y)
    class(petsc_body_t), intent(inout) :: body
    real(wp), intent(in) :: x(:)
    real(wp), intent(out) :: y(:)
    real(wp) :: across(3, size(body%node)), along(3, size(body%node)), sums(3)
    integer :: i, k

    y = 0.0_wp
    if (allocated(body%failure)) return
    body%x = 0.0_wp
    body%x(body%place) = x
    do i = 1, size(body%node)
      associate (own => body%x(3*body%node(i) - 2:3*body%node(i)))
        across(:, i) = matmul(body%left(:, :, i), own)
        along(:, i) = own - across(:, i)
        own = across(:, i)
      end associate
    end do
    call touch(body)
    call note(body%failure, mat_mult(body%matrix, body%vector_x, body%vector_y))
    do i = 1, size(body%node)
      sums = 0.0_wp
      do k = body%start(i), body%start(i + 1) - 1
        sums = sums + matmul(body%block(:, :, k), body%x(3*body%other(k) - 2:3*body%other(k)))
      end do
      body%y(3*body%node(i) - 2:3*body%node(i)) = sums
    end do
    do i = 1, size(body%node)
      do k = body%start(i), body%start(i + 1) - 1
        associate (of_other => body%y(3*body%other(k) - 2:3*body%other(k)))
          of_other = of_other + matmul(along(:, i), body%block(:, :, k))
        end associate
      end do
    end do
    y = body%y(body%place)
    y(body%n + 1:) = y(body%n + 1:) - body%spring*x(body%n + 1:)
  end subroutine product_with_k

  !> P M P x, M one cycle of multigrid.
  subroutine apply_inverse(body, x, y)
    class(petsc_body_t), intent(inout) :: body
    real(wp), intent(in) :: x(:)
    real(wp), intent(out) :: y(:)

    y = 0.0_wp
    if (allocated(body%failure)) return
    body%x = 0.0_wp
    body%x(body%place) = x
    call project(body%x)
    call touch(body)
    call note(body%failure, pc_apply(body%inverse, body%vector_x, body%vector_y))
    call project(body%y)
    y = body%y(body%place)

  contains

    subroutine project(v)
      real(wp), intent(inout) :: v(:)
      integer :: i

      do i = 1, size(body%node)
        associate (own => v(3*body%node(i) - 2:3*body%node(i)))
          own = matmul(body%left(:, :, i), own)
        end associate
      end do
    end subroutine project

  end subroutine apply_inverse

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
    if (c_associated(body%matrix)) status = mat_destroy(body%matrix)
    if (c_associated(body%vector_x)) status = vec_destroy(body%vector_x)
    if (c_associated(body%vector_y)) status = vec_destroy(body%vector_y)
    if (associated(body%first)) deallocate (body%first)
    if (associated(body%column)) deallocate (body%column)
    if (associated(body%value)) deallocate (body%value)
    if (associated(body%x)) deallocate (body%x, body%y)
  end subroutine release

end module petsc_body_mod
