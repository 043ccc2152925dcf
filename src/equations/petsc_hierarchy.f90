!> The hierarchy of PETSc's algebraic multigrid (GAMG), with the rigid motions as near null space.
!> docs/theory.md (4.15).
module petsc_hierarchy_mod
  use, intrinsic :: iso_c_binding, only: c_associated, c_f_pointer, c_int, c_loc, &
    c_null_char, c_null_ptr, c_ptr
  use kinds_mod, only: wp, i8
  use errors_mod, only: error_t
  use block_rows_mod, only: block_rows_t
  use petsc_calls_mod, only: final_assembly, mat_assembly_begin, mat_assembly_end, mat_create, &
    mat_destroy, mat_set_block_size, mat_set_near_null_space, mat_set_option, no, &
    null_space_create, null_space_destroy, pc_set_from_options, pc_set_operators, pc_set_prefix, &
    pc_set_reuse, pc_set_type, pc_set_up, petsc_set_option, positive_definite, vec_destroy, &
    vec_duplicate, vec_get_array, vec_restore_array, yes
  use petsc_session_mod, only: note
  use petsc_smoother_mod, only: put_smoother, smoother_t
  implicit none
  private

  public :: hierarchy_t, make_hierarchy, renew_hierarchy, release_hierarchy

  integer, parameter :: n_rigid = 6

  !> What belongs to the levels beside PETSc's preconditioner.
  type :: hierarchy_t
    type(c_ptr) :: by_rows = c_null_ptr !! the matrix as PETSc coarsens it
    integer(c_int), pointer :: first(:) => null(), column(:) => null()
    !! (3n+1) and columns, both from 0; columns ascend, a node's three rows have the same
    real(wp), pointer :: value(:) => null() !! what it lends from here [force/length]
    type(c_ptr) :: shell = c_null_ptr   !! what it asks for residuals on the finest level
  end type hierarchy_t

contains

  !> The hierarchy of K.
  subroutine make_hierarchy(ranks, vector, position, renews, smoother, inverse, hierarchy, failure)
    type(c_ptr), intent(in) :: ranks
    type(c_ptr), intent(in) :: vector          !! one of the matrix's rows
    real(wp), intent(in) :: position(:, :)     !! (3,n) [length]
    logical, intent(in) :: renews              !! its coarser levels, with the matrix
    type(smoother_t), target, intent(in) :: smoother !! its rows are the matrix
    type(c_ptr), intent(inout) :: inverse      !! the preconditioner
    type(hierarchy_t), intent(inout) :: hierarchy
    type(error_t), allocatable, intent(inout) :: failure
    type(c_ptr) :: motions(n_rigid), space
    integer(c_int) :: n_rows
    integer :: i

    if (allocated(failure)) return
    n_rows = 3*size(position, 2, kind=c_int)
    call list_entries(smoother%rows, hierarchy)
    call copy_values(smoother%rows, hierarchy%first, hierarchy%value)
    associate (by_rows => hierarchy%by_rows)
      call note(failure, mat_create(ranks, n_rows, n_rows, c_loc(hierarchy%first), &
        c_loc(hierarchy%column), c_loc(hierarchy%value), by_rows))
      if (allocated(failure)) return
      call note(failure, mat_set_block_size(by_rows, 3_c_int))
      call note(failure, mat_set_option(by_rows, positive_definite, yes))
      call make_motions(vector, position, motions, failure)
      call note(failure, null_space_create(ranks, no, int(n_rigid, c_int), motions, space))
      if (allocated(failure)) return
      call note(failure, mat_set_near_null_space(by_rows, space))
      call note(failure, null_space_destroy(space))
      do i = 1, n_rigid
        call note(failure, vec_destroy(motions(i)))
      end do
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
    call set_option('bipot_mg_levels_ksp_max_it', '1')
    call set_option('bipot_pc_gamg_reuse_interpolation', merge('true ', 'false', renews))
    call note(failure, pc_set_from_options(inverse))
    call note(failure, pc_set_up(inverse))
    call note(failure, pc_set_reuse(inverse, yes))
    call put_smoother(ranks, renews, inverse, smoother, hierarchy%shell, failure)
    if (renews .or. allocated(failure)) return
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

  !> The coarser levels of what the matrix is now, by the interpolation that is there.
  subroutine renew_hierarchy(rows, inverse, hierarchy, failure)
    type(block_rows_t), intent(in) :: rows
    type(c_ptr), intent(in) :: inverse         !! the preconditioner
    type(hierarchy_t), intent(inout) :: hierarchy
    type(error_t), allocatable, intent(inout) :: failure

    if (allocated(failure)) return
    call copy_values(rows, hierarchy%first, hierarchy%value)
    call note(failure, mat_assembly_begin(hierarchy%by_rows, final_assembly))
    call note(failure, mat_assembly_end(hierarchy%by_rows, final_assembly))
    call note(failure, pc_set_reuse(inverse, no))
    call note(failure, pc_set_operators(inverse, hierarchy%by_rows, hierarchy%by_rows))
    call note(failure, pc_set_up(inverse))
    call note(failure, pc_set_reuse(inverse, yes))
  end subroutine renew_hierarchy

  !> The pattern by entries, both triangles.
  subroutine list_entries(rows, hierarchy)
    type(block_rows_t), intent(in) :: rows
    type(hierarchy_t), intent(inout) :: hierarchy
    integer, allocatable :: n_blocks(:)
    integer :: i, j, k, a
    integer(i8) :: n

    n = 9*(2*size(rows%column, kind=i8) + size(rows%own, 3))
    allocate (hierarchy%first(3*size(rows%first) - 2), hierarchy%column(n), hierarchy%value(n))
    n_blocks = rows%first(2:) - rows%first(:size(rows%first) - 1) + 1
    do k = 1, size(rows%column)
      n_blocks(rows%column(k)) = n_blocks(rows%column(k)) + 1
    end do
    n = 0
    do i = 1, size(n_blocks)
      do a = 1, 3
        hierarchy%first(3*(i - 1) + a) = int(n, c_int)
        n = n + 3*n_blocks(i)
      end do
    end do
    hierarchy%first(size(hierarchy%first)) = int(n, c_int)
    ! Rows come in their order, so those below find the columns before them listed.
    n_blocks = 0
    do i = 1, size(n_blocks)
      do k = rows%first(i), rows%first(i + 1) - 1
        j = rows%column(k)
        call add(i, j)
        call add(j, i)
      end do
      call add(i, i)
    end do

  contains

    subroutine add(i, j)
      integer, intent(in) :: i, j
      integer :: of_row
      integer(i8) :: at

      do of_row = 3*i - 2, 3*i
        at = hierarchy%first(of_row) + 3*n_blocks(i)
        hierarchy%column(at + 1:at + 3) = 3*(j - 1) + [0, 1, 2]
      end do
      n_blocks(i) = n_blocks(i) + 1
    end subroutine add

  end subroutine list_entries

  !> The blocks by entries, both triangles.
  subroutine copy_values(rows, first, value)
    type(block_rows_t), intent(in) :: rows
    integer(c_int), intent(in) :: first(:)
    real(wp), intent(inout) :: value(:)
    integer, allocatable :: n_blocks(:)
    integer :: i, j, k

    allocate (n_blocks(size(rows%own, 3)), source=0)
    do i = 1, size(n_blocks)
      do k = rows%first(i), rows%first(i + 1) - 1
        j = rows%column(k)
        call add(i, rows%block(:, :, k))
        call add(j, transpose(rows%block(:, :, k)))
      end do
      call add(i, rows%own(:, :, i))
    end do

  contains

    subroutine add(i, block)
      integer, intent(in) :: i
      real(wp), intent(in) :: block(3, 3)
      integer :: a
      integer(i8) :: at

      do a = 1, 3
        at = first(3*(i - 1) + a) + 3*n_blocks(i)
        value(at + 1:at + 3) = block(a, :)
      end do
      n_blocks(i) = n_blocks(i) + 1
    end subroutine add

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

  !> The rigid motions of all bodies together, orthonormal.
  subroutine make_motions(vector, position, motions, failure)
    type(c_ptr), intent(in) :: vector          !! to be like
    real(wp), intent(in) :: position(:, :)     !! (3,nodes) [length]
    type(c_ptr), intent(out) :: motions(n_rigid) !! PETSc's vectors
    type(error_t), allocatable, intent(inout) :: failure
    real(wp), allocatable :: motion(:, :, :)
    real(wp), pointer :: values(:)
    type(c_ptr) :: array
    real(wp) :: centre(3), x(3)
    integer :: n, i, j

    n = size(position, 2)
    allocate (motion(3, n, n_rigid), source=0.0_wp)
    centre = sum(position, dim=2)/max(1, n)
    do i = 1, n
      x = position(:, i) - centre
      do j = 1, 3
        motion(j, i, j) = 1.0_wp
      end do
      motion(:, i, 4) = [0.0_wp, -x(3), x(2)]
      motion(:, i, 5) = [x(3), 0.0_wp, -x(1)]
      motion(:, i, 6) = [-x(2), x(1), 0.0_wp]
    end do
    do j = 1, n_rigid
      do i = 1, j - 1
        motion(:, :, j) = motion(:, :, j) - sum(motion(:, :, i)*motion(:, :, j))*motion(:, :, i)
      end do
      if (norm2(motion(:, :, j)) > 0.0_wp) motion(:, :, j) = motion(:, :, j)/norm2(motion(:, :, j))
      call note(failure, vec_duplicate(vector, motions(j)))
      if (allocated(failure)) return
      call note(failure, vec_get_array(motions(j), array))
      call c_f_pointer(array, values, [3*n])
      values = reshape(motion(:, :, j), [3*n])
      call note(failure, vec_restore_array(motions(j), array))
    end do
  end subroutine make_motions

end module petsc_hierarchy_mod
