!> The rigid motions of a body, and which of them its supports leave free.
module rigid_modes_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t, raise, exit_machine
  use mesh_mod, only: mesh_t
  implicit none
  private

  public :: count_free_motions

  interface
    !> LAPACK: eigenvalues of a symmetric matrix.
    subroutine dsyev(jobz, uplo, n, a, lda, w, work, lwork, info)
      import :: wp
      implicit none
      character, intent(in) :: jobz, uplo
      integer, intent(in) :: n, lda, lwork
      real(wp), intent(inout) :: a(lda, *)
      real(wp), intent(out) :: w(*), work(*)
      integer, intent(out) :: info
    end subroutine dsyev
  end interface

contains

  !> How many of a body's six rigid motions its prescribed degrees of freedom leave free.
  !>
  !> The modes, taken about the body's centre and scaled by its size so that turning and shifting
  !> compare, restricted to the prescribed degrees of freedom: the rank of their 6x6 Gram matrix is
  !> what is held.
  subroutine count_free_motions(mesh, body, prescribed, n_free, error)
    type(mesh_t), intent(in) :: mesh
    integer, intent(in) :: body
    logical, intent(in) :: prescribed(:, :) !! (3,n_nodes)
    integer, intent(out) :: n_free          !! 0 (held) to 6
    type(error_t), allocatable, intent(out) :: error !! LAPACK failed
    ! of the largest eigenvalue: sines of 1e-5 count as held
    real(wp), parameter :: rank_tolerance = 1.0e-10_wp
    real(wp) :: gram(6, 6), eigenvalue(6), work(64), centre(3), extent, x(3), mode(6)
    integer :: node, i, info

    centre = 0.0_wp
    extent = 0.0_wp
    do i = 1, 3
      associate (c => mesh%coordinates(i, :))
        centre(i) = 0.5_wp*(minval(c, mask=mesh%body == body) + maxval(c, mask=mesh%body == body))
        extent = max(extent, maxval(c, mask=mesh%body == body) - minval(c, mask=mesh%body == body))
      end associate
    end do
    gram = 0.0_wp
    do node = 1, mesh%n_nodes
      if (mesh%body(node) /= body) cycle
      x = (mesh%coordinates(:, node) - centre)/extent
      do i = 1, 3
        if (.not. prescribed(i, node)) cycle
        mode = 0.0_wp
        mode(i) = 1.0_wp
        select case (i) ! displacement of a rotation about axis k: e_k x (x - centre)
        case (1)
          mode(5:6) = [x(3), -x(2)]
        case (2)
          mode(4) = -x(3)
          mode(6) = x(1)
        case default
          mode(4:5) = [x(2), -x(1)]
        end select
        gram = gram + spread(mode, 2, 6)*spread(mode, 1, 6)
      end do
    end do
    call dsyev('N', 'U', 6, gram, 6, eigenvalue, work, size(work), info)
    if (info /= 0) then
      call raise(error, exit_machine, 'LAPACK dsyev failed on the rigid motions of a body')
      return
    end if
    n_free = count(eigenvalue <= rank_tolerance*max(eigenvalue(6), tiny(1.0_wp)))
  end subroutine count_free_motions

end module rigid_modes_mod
