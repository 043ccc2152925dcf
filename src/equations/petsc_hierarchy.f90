!> The hierarchy of PETSc's algebraic multigrid (GAMG), with the rigid motions as near null space.
!> docs/theory.md (4.15).
module petsc_hierarchy_mod
  use, intrinsic :: iso_c_binding, only: c_f_pointer, c_int, c_null_char, c_null_ptr, c_ptr
  use kinds_mod, only: wp
  use errors_mod, only: error_t
  use petsc_calls_mod, only: ksp_get_pc, ksp_set_type, mat_set_near_null_space, no, &
    null_space_create, null_space_destroy, pc_levels, pc_set_from_options, pc_set_operators, &
    pc_set_prefix, pc_set_reuse, pc_set_type, pc_set_up, pc_smoother, petsc_set_option, &
    vec_destroy, vec_duplicate, vec_get_array, vec_restore_array, yes
  use petsc_session_mod, only: note
  implicit none
  private

  public :: make_hierarchy, renew_hierarchy

  integer, parameter :: n_rigid = 6

contains

  !> The hierarchy of K.
  subroutine make_hierarchy(ranks, matrix, vector, position, renews, inverse, failure)
    type(c_ptr), intent(in) :: ranks, matrix
    type(c_ptr), intent(in) :: vector          !! one of the matrix's rows
    real(wp), intent(in) :: position(:, :)     !! (3,nodes) [length]
    logical, intent(in) :: renews              !! its coarser levels, with the matrix
    type(c_ptr), intent(inout) :: inverse      !! the preconditioner
    type(error_t), allocatable, intent(inout) :: failure
    type(c_ptr) :: motions(n_rigid), space
    integer :: i

    if (allocated(failure)) return
    call make_motions(vector, position, motions, failure)
    call note(failure, null_space_create(ranks, no, int(n_rigid, c_int), motions, space))
    if (allocated(failure)) return
    call note(failure, mat_set_near_null_space(matrix, space))
    call note(failure, null_space_destroy(space))
    do i = 1, n_rigid
      call note(failure, vec_destroy(motions(i)))
    end do
    call note(failure, pc_set_operators(inverse, matrix, matrix))
    call note(failure, pc_set_prefix(inverse, 'bipot_'//c_null_char))
    call note(failure, pc_set_type(inverse, 'gamg'//c_null_char))
    ! One that is coarsened to a node or two leaves coarse motions undetermined.
    call set_option('bipot_pc_gamg_coarse_eq_limit', '500')
    call set_option('bipot_mg_levels_ksp_type', 'chebyshev')
    call set_option('bipot_mg_levels_pc_type', 'jacobi')
    call set_option('bipot_pc_gamg_reuse_interpolation', merge('true ', 'false', renews))
    call note(failure, pc_set_from_options(inverse))
    call note(failure, pc_set_up(inverse))
    call note(failure, pc_set_reuse(inverse, yes))
    call smooth_by_rows()

  contains

    !> On the finest level Gauss-Seidel, forwards and backwards: half as many iterations as by
    !> Jacobi. On coarser ones motions may have no stiffness, where nodes have come together that
    !> are too few for them; Jacobi passes over these.
    subroutine smooth_by_rows()
      type(c_ptr) :: smoother, of_smoother
      integer(c_int) :: n

      call note(failure, pc_levels(inverse, n))
      if (allocated(failure)) return
      if (n < 2) return
      call note(failure, pc_smoother(inverse, n - 1, smoother))
      if (allocated(failure)) return
      call note(failure, ksp_set_type(smoother, 'richardson'//c_null_char))
      call note(failure, ksp_get_pc(smoother, of_smoother))
      call note(failure, pc_set_type(of_smoother, 'sor'//c_null_char))
    end subroutine smooth_by_rows

    subroutine set_option(name, value)
      character(*), intent(in) :: name, value

      call note(failure, petsc_set_option(c_null_ptr, '-'//name//c_null_char, trim(value)// &
        c_null_char))
    end subroutine set_option

  end subroutine make_hierarchy

  !> The coarser levels of what the matrix is now, by the interpolation that is there.
  subroutine renew_hierarchy(matrix, inverse, failure)
    type(c_ptr), intent(in) :: matrix
    type(c_ptr), intent(in) :: inverse         !! the preconditioner
    type(error_t), allocatable, intent(inout) :: failure

    if (allocated(failure)) return
    call note(failure, pc_set_reuse(inverse, no))
    call note(failure, pc_set_operators(inverse, matrix, matrix))
    call note(failure, pc_set_up(inverse))
    call note(failure, pc_set_reuse(inverse, yes))
  end subroutine renew_hierarchy

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
