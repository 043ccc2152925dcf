!> What smooths on the finest level of PETSc's multigrid: Gauss-Seidel by the blocks of nodes,
!> forwards before the coarser levels and backwards behind them. docs/theory.md (4.15).
!>
!> PETSc's own takes its matrix from memory five times a cycle, this one twice one half of it.
module petsc_smoother_mod
  use, intrinsic :: iso_c_binding, only: c_double, c_f_pointer, c_funloc, c_int, c_loc, &
    c_null_char, c_ptr
  use kinds_mod, only: wp
  use errors_mod, only: error_t
  use block_rows_mod, only: block_rows_t, relax_backwards, relax_forwards, take_off_from
  use petsc_calls_mod, only: ksp_get_pc, ksp_set_operators, ksp_set_tolerances, ksp_set_type, &
    mat_create_shell, mat_shell_get_context, no, pc_levels, pc_mg_set_residual, pc_set_type, &
    pc_shell_get_context, pc_shell_set_context, pc_shell_set_richardson, pc_smoother, &
    petsc_default, petsc_find, vec_get_array, vec_get_array_read, vec_restore_array, &
    vec_restore_array_read
  use petsc_session_mod, only: note
  use petsc_values_mod, only: fetch_ghosts, values_t
  implicit none
  private

  public :: smoother_t, put_smoother

  !> A matrix to relax with: a rank's own rows, then ghosts with what joins them to these.
  type :: smoother_t
    type(block_rows_t) :: rows
    type(values_t) :: x               !! for unknowns of other ranks
    real(wp), allocatable :: left(:, :) !! (3,n_own) what the sweep from 0 leaves
  end type smoother_t

contains

  !> Let it smooth on the finest of the levels.
  subroutine put_smoother(ranks, inverse, smoother, shell, failure)
    type(c_ptr), intent(in) :: ranks
    type(c_ptr), intent(in) :: inverse           !! multigrid, set up
    type(smoother_t), target, intent(in) :: smoother
    type(c_ptr), intent(inout) :: shell
    !! what PETSc asks for residuals; not made where there is one level
    type(error_t), allocatable, intent(inout) :: failure
    type(c_ptr) :: solver, conditioner
    integer(c_int) :: n, n_rows

    call note(failure, pc_levels(inverse, n))
    if (allocated(failure)) return
    if (n < 2) return
    n_rows = 3*size(smoother%left, 2, kind=c_int)
    call note(failure, mat_create_shell(ranks, n_rows, n_rows, petsc_find, petsc_find, &
      c_loc(smoother), shell))
    call note(failure, pc_smoother(inverse, n - 1, solver))
    if (allocated(failure)) return
    call note(failure, ksp_set_type(solver, 'richardson'//c_null_char))
    call note(failure, ksp_set_tolerances(solver, petsc_default, petsc_default, petsc_default, &
      1_c_int))
    call note(failure, ksp_set_operators(solver, shell, shell))
    call note(failure, ksp_get_pc(solver, conditioner))
    if (allocated(failure)) return
    call note(failure, pc_set_type(conditioner, 'shell'//c_null_char))
    call note(failure, pc_shell_set_context(conditioner, c_loc(smoother)))
    call note(failure, pc_shell_set_richardson(conditioner, c_funloc(relax)))
    call note(failure, pc_mg_set_residual(inverse, n - 1, c_funloc(find_residual), shell))
  end subroutine put_smoother

  !> PETSc's PCShellSetApplyRichardson: before the coarser levels from 0, and behind them.
  ! allow(too-many-arguments)
  function relax(conditioner, of_b, of_x, work, relative, absolute, growth, most, from_zero, n, &
    reason) result(status) bind(c)
    type(c_ptr), value :: conditioner, of_b, of_x, work
    real(c_double), value :: relative, absolute, growth
    integer(c_int), value :: most, from_zero
    integer(c_int), intent(out) :: n, reason
    integer(c_int) :: status
    integer(c_int), parameter :: as_many_as_asked = 4 ! PCRICHARDSON_CONVERGED_ITS
    type(smoother_t), pointer :: smoother
    real(wp), pointer :: b(:, :), x(:, :)
    type(c_ptr) :: context, array_b, array_x
    type(error_t), allocatable :: failure

    n = most
    reason = as_many_as_asked
    status = pc_shell_get_context(conditioner, context)
    call c_f_pointer(context, smoother)
    status = max(status, vec_get_array_read(of_b, array_b), vec_get_array(of_x, array_x))
    if (status /= 0) return
    call c_f_pointer(array_b, b, [3, size(smoother%left, 2)])
    call c_f_pointer(array_x, x, [3, size(smoother%left, 2)])
    if (from_zero == no) then
      call relax_behind(smoother, b, x, failure)
    else
      call relax_from_zero(smoother, b, x, failure)
    end if
    if (allocated(failure)) status = 1
    status = max(status, vec_restore_array_read(of_b, array_b), vec_restore_array(of_x, array_x))
  end function relax

  !> The sweep before the coarser levels, each rank's among its own rows; what it leaves is that of
  !> all.
  subroutine relax_from_zero(smoother, b, x, failure)
    type(smoother_t), intent(inout) :: smoother
    real(wp), contiguous, intent(in) :: b(:, :)  !! (3,n_own)
    real(wp), contiguous, intent(out) :: x(:, :) !! (3,n_own)
    type(error_t), allocatable, intent(inout) :: failure

    call relax_forwards(smoother%rows, b, x, smoother%left)
    call take_off_ghosts(smoother, x, smoother%left, failure)
  end subroutine relax_from_zero

  !> The sweep behind the coarser levels, each rank's among its own rows.
  subroutine relax_behind(smoother, b, x, failure)
    type(smoother_t), intent(inout) :: smoother
    real(wp), contiguous, intent(in) :: b(:, :)    !! (3,n_own)
    real(wp), contiguous, intent(inout) :: x(:, :) !! (3,n_own)
    type(error_t), allocatable, intent(inout) :: failure

    if (.not. smoother%x%has_ghosts) then
      call relax_backwards(smoother%rows, b, x)
      return
    end if
    smoother%left = b
    call take_off_ghosts(smoother, x, smoother%left, failure)
    call relax_backwards(smoother%rows, smoother%left, x)
  end subroutine relax_behind

  !> Take off what the unknowns of other ranks do.
  subroutine take_off_ghosts(smoother, x, left, failure)
    type(smoother_t), intent(in) :: smoother
    real(wp), contiguous, intent(in) :: x(:, :)       !! (3,n_own)
    real(wp), contiguous, intent(inout) :: left(:, :) !! (3,n_own)
    type(error_t), allocatable, intent(inout) :: failure

    if (.not. smoother%x%has_ghosts) return
    smoother%x%at(:, :size(x, 2)) = x
    call fetch_ghosts(smoother%x, failure)
    call take_off_from(smoother%rows, size(x, 2) + 1, smoother%x%at, left)
  end subroutine take_off_ghosts

  !> PETSc's PCMGSetResidual: b - A x, asked for behind the sweep from 0 alone.
  integer(c_int) function find_residual(shell, of_b, of_x, of_residual) result(status) bind(c)
    type(c_ptr), value :: shell, of_b, of_x, of_residual
    type(smoother_t), pointer :: smoother
    real(wp), pointer :: residual(:, :)
    type(c_ptr) :: context, array

    status = mat_shell_get_context(shell, context)
    call c_f_pointer(context, smoother)
    status = max(status, vec_get_array(of_residual, array))
    if (status /= 0) return
    call c_f_pointer(array, residual, [3, size(smoother%left, 2)])
    residual = smoother%left
    status = vec_restore_array(of_residual, array)
  end function find_residual

end module petsc_smoother_mod
