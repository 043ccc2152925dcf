!> What the program calls of PETSC, by its C names. Each returns 0 where it worked.
module petsc_calls_mod
  use, intrinsic :: iso_c_binding, only: c_char, c_double, c_funptr, c_int, c_ptr
  implicit none
  private

  public :: petsc_initialize, petsc_initialized, petsc_push_error_handler, &
    petsc_return_error_handler, petsc_set_option, petsc_reference
  public :: vec_create, vec_create_ghosted, get_ranks, vec_destroy, vec_get_array, &
    vec_restore_array, vec_get_array_read, vec_restore_array_read, vec_ghost_begin, vec_ghost_end
  public :: scatter_create, scatter_begin, scatter_end, scatter_destroy
  public :: mat_create, mat_create_distributed, mat_update, mat_create_shell, &
    mat_shell_get_context, mat_destroy, mat_set_block_size, mat_set_option, mat_duplicate, &
    mat_copy, mat_axpy, mat_ptap, mat_assembly_begin, mat_assembly_end, &
    mat_set_near_null_space, null_space_create, null_space_destroy
  public :: pc_create, pc_destroy, pc_set_type, pc_set_operators, pc_set_prefix, &
    pc_set_from_options, pc_set_reuse, pc_set_up, pc_apply, pc_levels, pc_smoother, &
    pc_interpolation, pc_mg_set_residual, pc_mg_residual, pc_shell_set_context, &
    pc_shell_get_context, pc_shell_set_richardson
  public :: ksp_set_type, ksp_set_tolerances, ksp_set_operators, ksp_get_operators, ksp_get_pc
  public :: yes, no, copy_values, no_values, new_matrix, same_matrix, final_assembly, &
    different_pattern, subset_pattern, same_pattern, positive_definite, petsc_default, &
    petsc_find, insert_values, forwards, backwards

  integer(c_int), parameter :: no = 0, yes = 1        !! PetscBool
  integer(c_int), parameter :: no_values = 0          !! MAT_DO_NOT_COPY_VALUES: zeros
  integer(c_int), parameter :: copy_values = 1        !! MAT_COPY_VALUES
  integer(c_int), parameter :: new_matrix = 0         !! MAT_INITIAL_MATRIX
  integer(c_int), parameter :: same_matrix = 1        !! MAT_REUSE_MATRIX
  integer(c_int), parameter :: final_assembly = 0     !! MAT_FINAL_ASSEMBLY
  integer(c_int), parameter :: different_pattern = 0  !! DIFFERENT_NONZERO_PATTERN
  integer(c_int), parameter :: subset_pattern = 1     !! SUBSET_NONZERO_PATTERN
  integer(c_int), parameter :: same_pattern = 2       !! SAME_NONZERO_PATTERN
  integer(c_int), parameter :: positive_definite = 15 !! MAT_SPD
  integer(c_int), parameter :: petsc_find = -1        !! PETSC_DETERMINE
  integer(c_int), parameter :: insert_values = 1      !! INSERT_VALUES
  integer(c_int), parameter :: forwards = 0, backwards = 1 !! SCATTER_FORWARD, SCATTER_REVERSE
  real(c_double), parameter :: petsc_default = -2.0_c_double !! PETSC_DEFAULT

  interface
    function petsc_initialize(n, arguments, file, help) result(status) &
      bind(c, name='PetscInitialize')
      import :: c_int, c_ptr
      implicit none
      integer(c_int), intent(inout) :: n
      type(c_ptr), intent(in) :: arguments !! of a list of texts
      type(c_ptr), value :: file, help
      integer(c_int) :: status
    end function petsc_initialize

    function petsc_initialized(flag) result(status) bind(c, name='PetscInitialized')
      import :: c_int
      implicit none
      integer(c_int), intent(out) :: flag
      integer(c_int) :: status
    end function petsc_initialized

    function petsc_push_error_handler(handler, context) result(status) &
      bind(c, name='PetscPushErrorHandler')
      import :: c_int, c_funptr, c_ptr
      implicit none
      type(c_funptr), value :: handler
      type(c_ptr), value :: context
      integer(c_int) :: status
    end function petsc_push_error_handler

    !> An error handler that says nothing: called by PETSc alone.
    function petsc_return_error_handler(ranks, line, procedure_name, file, code, kind, &
      message, context) result(status) bind(c, name='PetscReturnErrorHandler')
      import :: c_char, c_int, c_ptr
      implicit none
      type(c_ptr), value :: ranks, context
      integer(c_int), value :: line, code, kind
      character(c_char), intent(in) :: procedure_name(*), file(*), message(*)
      integer(c_int) :: status
    end function petsc_return_error_handler

    !> One that holds an object more.
    function petsc_reference(object) result(status) bind(c, name='PetscObjectReference')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: object
      integer(c_int) :: status
    end function petsc_reference

    function petsc_set_option(options, name, value) result(status) &
      bind(c, name='PetscOptionsSetValue')
      import :: c_char, c_int, c_ptr
      implicit none
      type(c_ptr), value :: options !! null: the program's
      character(c_char), intent(in) :: name(*), value(*)
      integer(c_int) :: status
    end function petsc_set_option

    !> By the name of PETSc's Fortran, for it takes Fortran's handle of the ranks.
    subroutine pc_create(ranks, pc, status) bind(c, name='pccreate_')
      import :: c_int, c_ptr
      implicit none
      integer(c_int), intent(in) :: ranks
      type(c_ptr), intent(out) :: pc
      integer(c_int), intent(out) :: status
    end subroutine pc_create

    !> The handle of an object's ranks, as C has it.
    function get_ranks(object, ranks) result(status) bind(c, name='PetscObjectGetComm')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: object
      type(c_ptr), intent(out) :: ranks
      integer(c_int) :: status
    end function get_ranks

    !> A vector in memory of the caller's.
    function vec_create(ranks, block_size, n, array, vector) result(status) &
      bind(c, name='VecCreateSeqWithArray')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: ranks, array
      integer(c_int), value :: block_size, n
      type(c_ptr), intent(out) :: vector
      integer(c_int) :: status
    end function vec_create

    !> The same of several ranks, behind the rank's own blocks in memory those of others.
    function vec_create_ghosted(ranks, block_size, n, all_n, n_ghosts, ghosts, array, vector) &
      result(status) bind(c, name='VecCreateGhostBlockWithArray')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: ranks, array
      integer(c_int), value :: block_size, n, all_n, n_ghosts
      integer(c_int), intent(in) :: ghosts(*) !! block of each among those of all ranks, from 0
      type(c_ptr), intent(out) :: vector
      integer(c_int) :: status
    end function vec_create_ghosted

    function vec_ghost_begin(vector, mode, direction) result(status) &
      bind(c, name='VecGhostUpdateBegin')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: vector
      integer(c_int), value :: mode, direction
      integer(c_int) :: status
    end function vec_ghost_begin

    function vec_ghost_end(vector, mode, direction) result(status) &
      bind(c, name='VecGhostUpdateEnd')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: vector
      integer(c_int), value :: mode, direction
      integer(c_int) :: status
    end function vec_ghost_end

    !> From the ranks to a vector of the first one that has all numbers.
    function scatter_create(vector, scatter, whole) result(status) &
      bind(c, name='VecScatterCreateToZero')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: vector
      type(c_ptr), intent(out) :: scatter, whole
      integer(c_int) :: status
    end function scatter_create

    function scatter_begin(scatter, from, to, mode, direction) result(status) &
      bind(c, name='VecScatterBegin')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: scatter, from, to
      integer(c_int), value :: mode, direction
      integer(c_int) :: status
    end function scatter_begin

    function scatter_end(scatter, from, to, mode, direction) result(status) &
      bind(c, name='VecScatterEnd')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: scatter, from, to
      integer(c_int), value :: mode, direction
      integer(c_int) :: status
    end function scatter_end

    function scatter_destroy(scatter) result(status) bind(c, name='VecScatterDestroy')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), intent(inout) :: scatter
      integer(c_int) :: status
    end function scatter_destroy

    function vec_destroy(vector) result(status) bind(c, name='VecDestroy')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), intent(inout) :: vector
      integer(c_int) :: status
    end function vec_destroy

    function vec_get_array(vector, array) result(status) bind(c, name='VecGetArray')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: vector
      type(c_ptr), intent(out) :: array
      integer(c_int) :: status
    end function vec_get_array

    function vec_restore_array(vector, array) result(status) bind(c, name='VecRestoreArray')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: vector
      type(c_ptr), intent(inout) :: array
      integer(c_int) :: status
    end function vec_restore_array

    !> The numbers of a vector that are read alone.
    function vec_get_array_read(vector, array) result(status) bind(c, name='VecGetArrayRead')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: vector
      type(c_ptr), intent(out) :: array
      integer(c_int) :: status
    end function vec_get_array_read

    function vec_restore_array_read(vector, array) result(status) &
      bind(c, name='VecRestoreArrayRead')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: vector
      type(c_ptr), intent(inout) :: array
      integer(c_int) :: status
    end function vec_restore_array_read

    !> A matrix that the caller knows, for what he asks of it.
    function mat_create_shell(ranks, n_rows, n_columns, all_rows, all_columns, context, matrix) &
      result(status) bind(c, name='MatCreateShell')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: ranks, context
      integer(c_int), value :: n_rows, n_columns, all_rows, all_columns
      type(c_ptr), intent(out) :: matrix
      integer(c_int) :: status
    end function mat_create_shell

    function mat_shell_get_context(matrix, context) result(status) &
      bind(c, name='MatShellGetContext')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: matrix
      type(c_ptr), intent(out) :: context
      integer(c_int) :: status
    end function mat_shell_get_context

    !> A matrix by rows, in memory of the caller's; rows and columns are counted from 0.
    function mat_create(ranks, n_rows, n_columns, first, column, value, matrix) &
      result(status) bind(c, name='MatCreateSeqAIJWithArrays')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: ranks, first, column, value
      integer(c_int), value :: n_rows, n_columns
      type(c_ptr), intent(out) :: matrix
      integer(c_int) :: status
    end function mat_create

    !> The rows of a rank in a matrix of several; PETSc copies them.
    function mat_create_distributed(ranks, n_rows, n_columns, all_rows, all_columns, first, &
      column, value, matrix) result(status) bind(c, name='MatCreateMPIAIJWithArrays')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: ranks, first, column, value
      integer(c_int), value :: n_rows, n_columns, all_rows, all_columns
      type(c_ptr), intent(out) :: matrix
      integer(c_int) :: status
    end function mat_create_distributed

    function mat_destroy(matrix) result(status) bind(c, name='MatDestroy')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), intent(inout) :: matrix
      integer(c_int) :: status
    end function mat_destroy

    function mat_set_block_size(matrix, block_size) result(status) bind(c, name='MatSetBlockSize')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: matrix
      integer(c_int), value :: block_size
      integer(c_int) :: status
    end function mat_set_block_size

    function mat_set_option(matrix, option, flag) result(status) bind(c, name='MatSetOption')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: matrix
      integer(c_int), value :: option, flag
      integer(c_int) :: status
    end function mat_set_option

    function mat_duplicate(matrix, option, other) result(status) bind(c, name='MatDuplicate')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: matrix
      integer(c_int), value :: option
      type(c_ptr), intent(out) :: other
      integer(c_int) :: status
    end function mat_duplicate

    function mat_copy(from, to, pattern) result(status) bind(c, name='MatCopy')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: from, to
      integer(c_int), value :: pattern
      integer(c_int) :: status
    end function mat_copy

    !> y = y + a x.
    function mat_axpy(y, a, x, pattern) result(status) bind(c, name='MatAXPY')
      import :: c_double, c_int, c_ptr
      implicit none
      type(c_ptr), value :: y, x
      real(c_double), value :: a
      integer(c_int), value :: pattern !! of x beside that of y
      integer(c_int) :: status
    end function mat_axpy

    !> Other values in the rows of a rank.
    function mat_update(matrix, value) result(status) bind(c, name='MatUpdateMPIAIJWithArray')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: matrix, value
      integer(c_int) :: status
    end function mat_update

    function mat_assembly_begin(matrix, kind) result(status) bind(c, name='MatAssemblyBegin')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: matrix
      integer(c_int), value :: kind
      integer(c_int) :: status
    end function mat_assembly_begin

    function mat_assembly_end(matrix, kind) result(status) bind(c, name='MatAssemblyEnd')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: matrix
      integer(c_int), value :: kind
      integer(c_int) :: status
    end function mat_assembly_end

    !> P^T A P.
    function mat_ptap(a, p, reuse, fill, product) result(status) bind(c, name='MatPtAP')
      import :: c_double, c_int, c_ptr
      implicit none
      type(c_ptr), value :: a, p
      integer(c_int), value :: reuse
      real(c_double), value :: fill
      type(c_ptr), intent(inout) :: product
      integer(c_int) :: status
    end function mat_ptap

    function mat_set_near_null_space(matrix, space) result(status) &
      bind(c, name='MatSetNearNullSpace')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: matrix, space
      integer(c_int) :: status
    end function mat_set_near_null_space

    !> The rigid motions, orthonormal, of points.
    function null_space_create(positions, space) result(status) &
      bind(c, name='MatNullSpaceCreateRigidBody')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: positions !! vector of blocks x, y, z
      type(c_ptr), intent(out) :: space
      integer(c_int) :: status
    end function null_space_create

    function null_space_destroy(space) result(status) bind(c, name='MatNullSpaceDestroy')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), intent(inout) :: space
      integer(c_int) :: status
    end function null_space_destroy

    function pc_destroy(pc) result(status) bind(c, name='PCDestroy')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), intent(inout) :: pc
      integer(c_int) :: status
    end function pc_destroy

    function pc_set_type(pc, name) result(status) bind(c, name='PCSetType')
      import :: c_char, c_int, c_ptr
      implicit none
      type(c_ptr), value :: pc
      character(c_char), intent(in) :: name(*)
      integer(c_int) :: status
    end function pc_set_type

    function pc_set_operators(pc, matrix, other) result(status) bind(c, name='PCSetOperators')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: pc, matrix, other
      integer(c_int) :: status
    end function pc_set_operators

    function pc_set_prefix(pc, prefix) result(status) bind(c, name='PCSetOptionsPrefix')
      import :: c_char, c_int, c_ptr
      implicit none
      type(c_ptr), value :: pc
      character(c_char), intent(in) :: prefix(*)
      integer(c_int) :: status
    end function pc_set_prefix

    function pc_set_from_options(pc) result(status) bind(c, name='PCSetFromOptions')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: pc
      integer(c_int) :: status
    end function pc_set_from_options

    function pc_set_up(pc) result(status) bind(c, name='PCSetUp')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: pc
      integer(c_int) :: status
    end function pc_set_up

    !> Whether the preconditioner stays as it is when its matrix changes.
    function pc_set_reuse(pc, flag) result(status) bind(c, name='PCSetReusePreconditioner')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: pc
      integer(c_int), value :: flag
      integer(c_int) :: status
    end function pc_set_reuse

    function pc_apply(pc, x, y) result(status) bind(c, name='PCApply')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: pc, x, y
      integer(c_int) :: status
    end function pc_apply

    function pc_levels(pc, n) result(status) bind(c, name='PCMGGetLevels')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: pc
      integer(c_int), intent(out) :: n
      integer(c_int) :: status
    end function pc_levels

    !> What smooths on a level, 0 the coarsest.
    function pc_smoother(pc, level, ksp) result(status) bind(c, name='PCMGGetSmoother')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: pc
      integer(c_int), value :: level
      type(c_ptr), intent(out) :: ksp
      integer(c_int) :: status
    end function pc_smoother

    !> From the level before to one, 1 the first that has one before.
    function pc_interpolation(pc, level, matrix) result(status) &
      bind(c, name='PCMGGetInterpolation')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: pc
      integer(c_int), value :: level
      type(c_ptr), intent(out) :: matrix
      integer(c_int) :: status
    end function pc_interpolation

    function ksp_get_operators(ksp, matrix, other) result(status) bind(c, name='KSPGetOperators')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: ksp
      type(c_ptr), intent(out) :: matrix, other
      integer(c_int) :: status
    end function ksp_get_operators

    function ksp_set_type(ksp, name) result(status) bind(c, name='KSPSetType')
      import :: c_char, c_int, c_ptr
      implicit none
      type(c_ptr), value :: ksp
      character(c_char), intent(in) :: name(*)
      integer(c_int) :: status
    end function ksp_set_type

    function ksp_set_tolerances(ksp, relative, absolute, growth, iterations) result(status) &
      bind(c, name='KSPSetTolerances')
      import :: c_double, c_int, c_ptr
      implicit none
      type(c_ptr), value :: ksp
      real(c_double), value :: relative, absolute, growth
      integer(c_int), value :: iterations
      integer(c_int) :: status
    end function ksp_set_tolerances

    function ksp_set_operators(ksp, matrix, other) result(status) bind(c, name='KSPSetOperators')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: ksp, matrix, other
      integer(c_int) :: status
    end function ksp_set_operators

    !> b - A x by the level's matrix: called by PETSc alone.
    function pc_mg_residual(matrix, b, x, residual) result(status) &
      bind(c, name='PCMGResidualDefault')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: matrix, b, x, residual
      integer(c_int) :: status
    end function pc_mg_residual

    !> Who finds b - A x on a level, 0 the coarsest.
    function pc_mg_set_residual(pc, level, procedure_address, matrix) result(status) &
      bind(c, name='PCMGSetResidual')
      import :: c_funptr, c_int, c_ptr
      implicit none
      type(c_ptr), value :: pc, matrix
      integer(c_int), value :: level
      type(c_funptr), value :: procedure_address
      integer(c_int) :: status
    end function pc_mg_set_residual

    function pc_shell_set_context(pc, context) result(status) bind(c, name='PCShellSetContext')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: pc, context
      integer(c_int) :: status
    end function pc_shell_set_context

    function pc_shell_get_context(pc, context) result(status) bind(c, name='PCShellGetContext')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: pc
      type(c_ptr), intent(out) :: context
      integer(c_int) :: status
    end function pc_shell_get_context

    !> Who relaxes, from 0 or from where it is.
    function pc_shell_set_richardson(pc, procedure_address) result(status) &
      bind(c, name='PCShellSetApplyRichardson')
      import :: c_funptr, c_int, c_ptr
      implicit none
      type(c_ptr), value :: pc
      type(c_funptr), value :: procedure_address
      integer(c_int) :: status
    end function pc_shell_set_richardson

    function ksp_get_pc(ksp, pc) result(status) bind(c, name='KSPGetPC')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: ksp
      type(c_ptr), intent(out) :: pc
      integer(c_int) :: status
    end function ksp_get_pc
  end interface

end module petsc_calls_mod
