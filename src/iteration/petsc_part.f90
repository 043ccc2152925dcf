!> A rank's rows of the stiffness: products with it, and PETSc's algebraic multigrid (GAMG) with the
!> rigid motions as near null space as its approximate inverse.
!>
!> PETSc sees three unknowns at every node that has any; one that is prescribed, or depends on
!> others, has its diagonal alone. With directions held the matrix is P K P and what is held has a
!> diagonal of its own; the rows of the nodes that may be held are kept apart, so that products with
!> K itself are still to be had, and K can be put back. docs/theory.md (4.15).
!> Where bodies move freely each pin has a spring in the matrix.
!>
!> Behind its own rows a rank has ghosts: rows of others that its own reach, with what joins them to
!> these and an identity on the diagonal; where springs may join nodes of its own, all nodes that
!> they may join are among them. Every procedure is for all ranks to call together.
module petsc_part_mod
  use, intrinsic :: iso_c_binding, only: c_associated, c_int, c_null_ptr, c_ptr
  use kinds_mod, only: wp, i8
  use errors_mod, only: error_t
  use springs_mod, only: some_springs, springs_t
  use block_rows_mod, only: block_rows_t, find_block, put_block, stiffen_border, times_rows
  use held_rows_mod, only: held_rows_t, begin_product, end_product, hold_rows, keep_rows, &
    project_rows
  use node_parts_mod, only: node_part_t
  use petsc_calls_mod, only: pc_apply, pc_destroy
  use petsc_session_mod, only: begin_petsc, note
  use petsc_values_mod, only: fetch_ghosts, layout_t, make_values, release_values, touch, values_t
  use petsc_smoother_mod, only: smoother_t
  use petsc_hierarchy_mod, only: hierarchy_t, make_hierarchy, release_hierarchy
  use petsc_levels_mod, only: change_levels, forget_change, levels_t, release_levels
  implicit none
  private

  public :: petsc_part_t, make_part, keep_nodes, hold_nodes, multiply_part, apply_part, release_part

  !> The matrix, what is changed in it where directions are held, and PETSc's levels.
  type :: petsc_part_t
    type(layout_t) :: layout
    type(values_t) :: x, y          !! what comes in, what goes out
    integer, allocatable :: here(:) !! (n_rows) where each of all rows is among the part's, or 0
    type(smoother_t), pointer :: smoother => null()
    !! its rows are the matrix [force/length]
    type(held_rows_t) :: held       !! the nodes that may be held
    type(c_ptr) :: ranks = c_null_ptr, inverse = c_null_ptr
    type(hierarchy_t) :: hierarchy
    type(levels_t) :: levels
    type(error_t), allocatable :: failure !! of PETSc; it holds for good
  end type petsc_part_t

contains

  !> The rows of the elements that a rank has summed.
  subroutine make_part(summed, pin_row, pin_dof, facing, part)
    type(node_part_t), intent(in) :: summed
    integer, intent(in) :: pin_row(:), pin_dof(:) !! (n_pins) of all rows, and x, y or z
    integer, intent(in) :: facing(:)              !! of all rows, those that springs may join
    type(petsc_part_t), intent(inout) :: part     !! new
    integer, allocatable :: node_of(:), number(:)
    type(springs_t) :: none

    call begin_petsc(part%inverse, part%ranks, part%failure)
    call place_nodes(summed, facing, part, node_of, number)
    call make_values(part%ranks, part%layout, part%x, part%failure)
    call make_values(part%ranks, part%layout, part%y, part%failure)
    allocate (part%smoother)
    call make_values(part%ranks, part%layout, part%smoother%x, part%failure)
    allocate (part%smoother%left(3, part%layout%n_own))
    associate (rows => part%smoother%rows)
      call list_blocks(summed, node_of, number, part%layout, rows)
      call fill(summed, number, part%layout%n_own, rows)
      call complete_diagonal(summed%equation(:, node_of), part, pin_row, pin_dof, rows)
      call keep_rows(rows, part%held, [integer ::], none, part%layout%n_own)
    end associate
    call make_hierarchy(part%ranks, part%layout, summed%coordinates(:, node_of(: &
      part%layout%n_own)), part%smoother, part%inverse, part%hierarchy, part%failure)
  end subroutine make_part

  !> Own rows, then ghosts of the summed, each in the order of the mesh, then other ghosts.
  subroutine place_nodes(summed, facing, part, node_of, number)
    type(node_part_t), intent(in) :: summed
    integer, intent(in) :: facing(:)
    type(petsc_part_t), intent(inout) :: part
    integer, allocatable, intent(out) :: node_of(:) !! node of the summed of each row here
    integer, allocatable, intent(out) :: number(:)  !! row here of each node, or 0
    logical, allocatable :: is_own(:), is_ghost(:)
    integer, allocatable :: others(:)
    integer :: i, k

    allocate (is_own(size(summed%row)), is_ghost(size(summed%row)))
    is_own = summed%row > summed%before .and. summed%row <= summed%before + summed%n_own
    is_ghost = .false.
    do i = 1, size(is_own)
      if (.not. is_own(i)) cycle
      do k = summed%start(i), summed%start(i + 1) - 1
        is_ghost(summed%neighbours(k)) = .true.
      end do
    end do
    is_ghost = is_ghost .and. .not. is_own .and. summed%row > 0
    node_of = [pack([(i, i=1, size(is_own))], is_own), pack([(i, i=1, size(is_own))], is_ghost)]
    allocate (number(size(is_own)), source=0)
    number(node_of) = [(i, i=1, size(node_of))]
    associate (layout => part%layout)
      layout%is_shared = summed%k%is_distributed
      layout%n_rows = summed%n_rows
      layout%before = summed%before
      layout%n_own = summed%n_own
      layout%ghost = summed%row(node_of(layout%n_own + 1:))
      allocate (part%here(summed%n_rows), source=0)
      part%here(summed%row(node_of)) = [(i, i=1, size(node_of))]
      allocate (others(0))
      if (any(facing > layout%before .and. facing <= layout%before + layout%n_own)) others = &
        pack(facing, part%here(facing) == 0)
      layout%ghost = [layout%ghost, others]
      part%here(others) = [(size(node_of) + i, i=1, size(others))]
    end associate
  end subroutine place_nodes

  !> The pattern: of each own row a block for every own neighbour before it, of each ghost one for
  !> every own neighbour.
  subroutine list_blocks(summed, node_of, number, layout, rows)
    type(node_part_t), intent(in) :: summed
    integer, intent(in) :: node_of(:), number(:)
    type(layout_t), intent(in) :: layout
    type(block_rows_t), intent(inout) :: rows
    integer :: row, n, pass
    integer, allocatable :: others(:)

    allocate (rows%first(layout%n_own + size(layout%ghost) + 1))
    do pass = 1, 2
      n = 0
      do row = 1, size(node_of)
        rows%first(row) = n + 1
        associate (node => node_of(row))
          others = number(summed%neighbours(summed%start(node):summed%start(node + 1) - 1))
        end associate
        others = pack(others, others > 0 .and. others < row .and. others <= layout%n_own)
        if (pass == 2) rows%column(n + 1:n + size(others)) = others
        n = n + size(others)
      end do
      rows%first(size(node_of) + 1:) = n + 1
      if (pass == 1) allocate (rows%column(n))
    end do
    n = size(rows%first) - 1
    allocate (rows%block(3, 3, size(rows%column)), rows%own(3, 3, n), rows%inverse(3, 3, n), &
      source=0.0_wp)
    allocate (rows%added(3, n), source=0.0_wp)
  end subroutine list_blocks

  !> The entries of K.
  subroutine fill(summed, number, n_own, rows)
    type(node_part_t), intent(in) :: summed
    integer, intent(in) :: number(:)
    integer, intent(in) :: n_own
    type(block_rows_t), intent(inout) :: rows
    integer :: place(summed%k%n) !! of each equation here, three a row
    integer(i8) :: e
    integer :: row, column, i, j, node, a

    place = 0
    do node = 1, size(number)
      if (number(node) == 0) cycle
      do a = 1, 3
        associate (equation => summed%equation(a, node))
          if (equation > 0) place(equation) = 3*(number(node) - 1) + a
        end associate
      end do
    end do
    associate (k => summed%k)
      do e = 1, size(k%value, kind=i8)
        i = max(place(k%row(e)), place(k%column(e)))
        j = min(place(k%row(e)), place(k%column(e)))
        row = (i + 2)/3
        column = (j + 2)/3
        if (column == 0 .or. column > n_own) cycle
        i = modulo(i - 1, 3) + 1
        j = modulo(j - 1, 3) + 1
        if (row == column) then
          rows%own(i, j, row) = k%value(e)
          rows%own(j, i, row) = k%value(e)
        else
          rows%block(i, j, find_block(rows, row, column)) = k%value(e)
        end if
      end do
    end associate
  end subroutine fill

  !> A diagonal for what is no unknown and for ghosts, a spring at every pin.
  subroutine complete_diagonal(equation, part, pin_row, pin_dof, rows)
    integer, intent(in) :: equation(:, :) !! (3,n) of the rows here, as far as they are summed
    type(petsc_part_t), intent(in) :: part
    integer, intent(in) :: pin_row(:), pin_dof(:)
    type(block_rows_t), intent(inout) :: rows
    real(wp) :: block(3, 3), mean
    integer :: i, j, a

    do i = 1, part%layout%n_own
      block = rows%own(:, :, i)
      mean = 0.0_wp
      do a = 1, 3
        if (equation(a, i) > 0) mean = mean + block(a, a)/count(equation(:, i) > 0)
      end do
      do a = 1, 3
        if (equation(a, i) == 0) block(a, a) = mean
      end do
      do j = 1, size(pin_row)
        if (part%here(pin_row(j)) == i) block(pin_dof(j), pin_dof(j)) = 2.0_wp*block(pin_dof(j), &
          pin_dof(j))
      end do
      call put_block(rows, i, i, block)
    end do
    do i = part%layout%n_own + 1, size(rows%own, 3)
      call put_block(rows, i, i, reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, &
        0.0_wp, 0.0_wp, 1.0_wp], [3, 3]))
    end do
    call stiffen_border(rows, part%layout%n_own + 1)
  end subroutine complete_diagonal

  !> The nodes that may be held, and those that springs join, from now on.
  subroutine keep_nodes(part, row, springs)
    type(petsc_part_t), intent(inout) :: part
    integer, intent(in) :: row(:)          !! of all rows, distinct
    type(springs_t), intent(in) :: springs !! between all rows
    type(springs_t) :: here_springs

    if (springs%n > 0) here_springs = some_springs(springs, part%here(springs%at))
    associate (here => part%here(row))
      call keep_rows(part%smoother%rows, part%held, pack(here, here > 0), here_springs, &
        part%layout%n_own)
    end associate
    call forget_change(part%levels)
  end subroutine keep_nodes

  !> P (K + what springs do) P, with a diagonal along what is held, in the place of K.
  subroutine hold_nodes(part, row, along, stiffer, of_spring)
    type(petsc_part_t), intent(inout) :: part
    integer, intent(in) :: row(:)            !! as `keep_nodes` got them
    real(wp), intent(in) :: along(:, :, :)   !! (3,3,m) projection on what is held [-]
    real(wp), intent(in) :: stiffer(:, :, :) !! (3,3,m) added on the diagonal [force/length]
    real(wp), intent(in) :: of_spring(:, :, :) !! (3,3,n_springs) stiffness [force/length]
    integer, allocatable :: listed(:)
    integer :: i

    listed = pack([(i, i=1, size(row))], part%here(row) > 0)
    call hold_rows(part%smoother%rows, part%held, along(:, :, listed), stiffer(:, :, listed), &
      of_spring)
    call stiffen_border(part%smoother%rows, part%layout%n_own + 1)
    call change_levels(part%ranks, part%layout, part%smoother%rows, part%held, part%inverse, &
      part%levels, part%failure)
  end subroutine hold_nodes

  !> y = K x, by the matrix where nothing is held, and by the rows that are kept.
  subroutine multiply_part(part)
    type(petsc_part_t), intent(inout) :: part
    real(wp) :: along(3, size(part%held%row))

    call fetch_ghosts(part%x, part%failure)
    call begin_product(part%held, part%x%at, along)
    call times_rows(part%smoother%rows, part%x%at, part%y%at)
    call end_product(part%held, part%x%at, along, part%y%at)
  end subroutine multiply_part

  !> y = P M P x, M one cycle of multigrid.
  subroutine apply_part(part)
    type(petsc_part_t), intent(inout) :: part

    call project_rows(part%held, part%x%at)
    call touch(part%x, part%failure)
    if (.not. allocated(part%failure)) call note(part%failure, pc_apply(part%inverse, &
      part%x%vector, part%y%vector))
    call project_rows(part%held, part%y%at)
  end subroutine apply_part

  !> Give PETSc's memory back, then what it was lent.
  subroutine release_part(part)
    type(petsc_part_t), intent(inout) :: part
    integer(c_int) :: status

    if (c_associated(part%inverse)) status = pc_destroy(part%inverse)
    call release_levels(part%levels)
    call release_hierarchy(part%hierarchy)
    call release_values(part%x)
    call release_values(part%y)
    if (.not. associated(part%smoother)) return
    call release_values(part%smoother%x)
    deallocate (part%smoother)
  end subroutine release_part

end module petsc_part_mod
