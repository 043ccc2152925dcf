!> The hierarchy of PETSc's algebraic multigrid (GAMG), with the rigid motions as near null space.
!> docs/theory.md (4.15).
module petsc_hierarchy_mod
  use, intrinsic :: iso_c_binding, only: c_associated, c_int, c_loc, c_null_char, c_null_ptr, c_ptr
  use kinds_mod, only: wp, i8
  use errors_mod, only: error_t
  use sorting_mod, only: count_below, sort_ascending
  use parallel_mod, only: sum_over_ranks
  use block_rows_mod, only: block_rows_t
  use petsc_calls_mod, only: mat_create, mat_create_distributed, mat_destroy, mat_set_block_size, &
    mat_set_near_null_space, mat_set_option, null_space_create, null_space_destroy, &
    pc_set_from_options, pc_set_operators, pc_set_prefix, pc_set_reuse, pc_set_type, pc_set_up, &
    petsc_find, petsc_set_option, positive_definite, yes
  use petsc_session_mod, only: note
  use petsc_smoother_mod, only: put_smoother, smoother_t
  use petsc_values_mod, only: layout_t, make_values, release_values, row_of, values_t
  implicit none
  private

  public :: hierarchy_t, make_hierarchy, release_hierarchy

  integer(c_int), parameter :: too_many = 84 !! PETSC_ERR_INT_OVERFLOW

  !> What belongs to the levels beside PETSc's preconditioner.
  type :: hierarchy_t
    type(c_ptr) :: by_rows = c_null_ptr !! the matrix as PETSc coarsens it
    integer(c_int), pointer :: first(:) => null(), column(:) => null()
    !! (3n+1) of the rank's own rows, and columns of all, both from 0; columns ascend, a node's
    !! three rows have the same
    real(wp), pointer :: value(:) => null() !! what PETSc borrows or copies [force/length]
    type(c_ptr) :: shell = c_null_ptr   !! what it asks for residuals on the finest level
  end type hierarchy_t

contains

  !> The hierarchy of K: all ranks must call it.
  subroutine make_hierarchy(ranks, layout, position, smoother, inverse, hierarchy, failure)
    type(c_ptr), intent(in) :: ranks
    type(layout_t), intent(in) :: layout
    real(wp), intent(in) :: position(:, :)     !! (3,n_own) [length]
    type(smoother_t), target, intent(in) :: smoother !! its rows are the matrix
    type(c_ptr), intent(inout) :: inverse      !! the preconditioner
    type(hierarchy_t), intent(inout) :: hierarchy
    type(error_t), allocatable, intent(inout) :: failure
    type(c_ptr) :: space
    integer(c_int) :: n_rows

    if (allocated(failure)) return
    n_rows = 3*int(layout%n_own, c_int)
    call list_entries(smoother%rows, layout, hierarchy, failure)
    if (allocated(failure)) return
    call copy_values(smoother%rows, layout, hierarchy)
    associate (by_rows => hierarchy%by_rows)
      if (layout%is_shared) then
        call note(failure, mat_create_distributed(ranks, n_rows, n_rows, petsc_find, petsc_find, &
          c_loc(hierarchy%first), c_loc(hierarchy%column), c_loc(hierarchy%value), by_rows))
      else
        call note(failure, mat_create(ranks, n_rows, n_rows, c_loc(hierarchy%first), &
          c_loc(hierarchy%column), c_loc(hierarchy%value), by_rows))
      end if
      if (allocated(failure)) return
      call note(failure, mat_set_block_size(by_rows, 3_c_int))
      call note(failure, mat_set_option(by_rows, positive_definite, yes))
      call find_motions(ranks, layout, position, space, failure)
      if (allocated(failure)) return
      call note(failure, mat_set_near_null_space(by_rows, space))
      call note(failure, null_space_destroy(space))
      call note(failure, pc_set_operators(inverse, by_rows, by_rows))
    end associate
    call note(failure, pc_set_prefix(inverse, 'bipot_'//c_null_char))
    call note(failure, pc_set_type(inverse, 'gamg'//c_null_char))
    ! One that is coarsened to a node or two leaves coarse motions undetermined.
    call set_option('bipot_pc_gamg_coarse_eq_limit', '500')
    ! On coarser levels motions may have no stiffness, where nodes have come together that are too
    ! few for them; Jacobi passes over these.
    call set_option('bipot_mg_levels_ksp_type', 'chebyshev')
    call set_option('bipot_mg_levels_pc_type', 'jacobi')
    call set_option('bipot_mg_levels_ksp_max_it', '3')
    ! What contact holds stiffens these levels: the largest eigenvalue of what they were made as is
    ! less than it is then, and a smoother that goes by it adds to the errors that it is to damp.
    call set_option('bipot_pc_gamg_use_sa_esteig', 'false')
    call set_option('bipot_mg_levels_ksp_chebyshev_esteig', '0,0.05,0,1.2')
    call set_option('bipot_mg_levels_esteig_ksp_max_it', '5')
    call note(failure, pc_set_from_options(inverse))
    call note(failure, pc_set_up(inverse))
    call note(failure, pc_set_reuse(inverse, yes))
    call put_smoother(ranks, inverse, smoother, hierarchy%shell, failure)
    if (allocated(failure) .or. .not. c_associated(hierarchy%shell)) return
    ! What was coarsened once is not needed again.
    call note(failure, pc_set_operators(inverse, hierarchy%shell, hierarchy%shell))
    call release_entries(hierarchy)

  contains

    subroutine set_option(name, value)
      character(*), intent(in) :: name, value

      call note(failure, petsc_set_option(c_null_ptr, '-'//name//c_null_char, trim(value)// &
        c_null_char))
    end subroutine set_option

  end subroutine make_hierarchy

  !> The pattern of the rank's own rows by entries, both triangles.
  subroutine list_entries(rows, layout, hierarchy, failure)
    type(block_rows_t), intent(in) :: rows
    type(layout_t), intent(in) :: layout
    type(hierarchy_t), intent(inout) :: hierarchy
    type(error_t), allocatable, intent(inout) :: failure !! more entries than PETSc can count
    integer, allocatable :: start(:), next(:), column(:)
    integer :: i, k, a, j
    integer(i8) :: n

    allocate (start(layout%n_own + 1), source=1)
    do i = 1, size(rows%own, 3)
      do k = rows%first(i), rows%first(i + 1) - 1
        if (i <= layout%n_own) start(i + 1) = start(i + 1) + 1
        start(rows%column(k) + 1) = start(rows%column(k) + 1) + 1
      end do
    end do
    start(1) = 1
    do i = 1, layout%n_own
      start(i + 1) = start(i) + start(i + 1)
    end do
    next = start
    allocate (column(start(layout%n_own + 1) - 1))
    do i = 1, size(rows%own, 3)
      if (i <= layout%n_own) call add(i, i)
      do k = rows%first(i), rows%first(i + 1) - 1
        if (i <= layout%n_own) call add(i, rows%column(k))
        call add(rows%column(k), i)
      end do
    end do
    n = 9*size(column, kind=i8)
    if (n > huge(1_c_int)) then
      call note(failure, too_many)
      return
    end if
    allocate (hierarchy%first(3*layout%n_own + 1), hierarchy%column(n), hierarchy%value(n))
    n = 0
    do i = 1, layout%n_own
      associate (of_row => column(start(i):start(i + 1) - 1))
        call sort_ascending(of_row)
        do a = 1, 3
          hierarchy%first(3*(i - 1) + a) = int(n, c_int)
          do j = 1, size(of_row)
            hierarchy%column(n + 1:n + 3) = 3*(of_row(j) - 1) + [0, 1, 2]
            n = n + 3
          end do
        end do
      end associate
    end do
    hierarchy%first(3*layout%n_own + 1) = int(n, c_int)

  contains

    subroutine add(i, j)
      integer, intent(in) :: i, j

      column(next(i)) = row_of(layout, j)
      next(i) = next(i) + 1
    end subroutine add

  end subroutine list_entries

  !> The blocks by entries, both triangles.
  subroutine copy_values(rows, layout, hierarchy)
    type(block_rows_t), intent(in) :: rows
    type(layout_t), intent(in) :: layout
    type(hierarchy_t), intent(inout) :: hierarchy
    integer :: i, k

    do i = 1, size(rows%own, 3)
      if (i <= layout%n_own) call put(i, i, rows%own(:, :, i))
      do k = rows%first(i), rows%first(i + 1) - 1
        if (i <= layout%n_own) call put(i, rows%column(k), rows%block(:, :, k))
        call put(rows%column(k), i, transpose(rows%block(:, :, k)))
      end do
    end do

  contains

    subroutine put(i, j, block)
      integer, intent(in) :: i, j
      real(wp), intent(in) :: block(3, 3)
      integer :: a, in_row

      ! Before the first column of the block, from 0, in the node's first row.
      associate (columns => hierarchy%column(hierarchy%first(3*i - 2) + 1:hierarchy%first(3*i - 1)))
        in_row = count_below(3*(row_of(layout, j) - 1), columns)
      end associate
      do a = 1, 3
        associate (at => hierarchy%first(3*(i - 1) + a) + in_row)
          hierarchy%value(at + 1:at + 3) = block(a, :)
        end associate
      end do
    end subroutine put

  end subroutine copy_values

  !> Give back what belongs to the levels, behind PETSc's preconditioner.
  subroutine release_hierarchy(hierarchy)
    type(hierarchy_t), intent(inout) :: hierarchy
    integer(c_int) :: status

    call release_entries(hierarchy)
    if (c_associated(hierarchy%shell)) status = mat_destroy(hierarchy%shell)
  end subroutine release_hierarchy

  !> Give back the matrix by its entries.
  subroutine release_entries(hierarchy)
    type(hierarchy_t), intent(inout) :: hierarchy
    integer(c_int) :: status

    if (c_associated(hierarchy%by_rows)) status = mat_destroy(hierarchy%by_rows)
    if (associated(hierarchy%first)) deallocate (hierarchy%first, hierarchy%column, hierarchy%value)
  end subroutine release_entries

  !> The rigid motions of all bodies together, as PETSc makes them of positions about their mean.
  subroutine find_motions(ranks, layout, position, space, failure)
    type(c_ptr), intent(in) :: ranks
    type(layout_t), intent(in) :: layout
    real(wp), intent(in) :: position(:, :)     !! (3,n_own) [length]
    type(c_ptr), intent(out) :: space
    type(error_t), allocatable, intent(inout) :: failure
    type(values_t) :: about
    real(wp) :: centre(3)

    centre = sum(position, dim=2)
    call sum_over_ranks(centre)
    centre = centre/max(1, layout%n_rows)
    call make_values(ranks, layout, about, failure)
    if (allocated(failure)) return
    about%at(:, :layout%n_own) = position - spread(centre, 2, layout%n_own)
    call note(failure, null_space_create(about%vector, space))
    call release_values(about)
  end subroutine find_motions

end module petsc_hierarchy_mod
