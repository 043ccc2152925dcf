!> The compliance of the interface: what its nodes move under unit forces on them, the body
!> condensed.
module compliance_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t, raise, exit_not_solved
  use dof_map_mod, only: dof_map_t
  use contact_points_mod, only: contact_points_t
  implicit none
  private

  public :: invert_schur, rows_of_points, compliance_of_rows, interface_force

  interface
    !> LAPACK: Cholesky factor of a symmetric positive definite matrix.
    subroutine dpotrf(uplo, n, a, lda, info)
      import :: wp
      character, intent(in) :: uplo
      integer, intent(in) :: n, lda
      real(wp), intent(inout) :: a(lda, *)
      integer, intent(out) :: info
    end subroutine dpotrf

    !> LAPACK: inverse from the Cholesky factor.
    subroutine dpotri(uplo, n, a, lda, info)
      import :: wp
      character, intent(in) :: uplo
      integer, intent(in) :: n, lda
      real(wp), intent(inout) :: a(lda, *)
      integer, intent(out) :: info
    end subroutine dpotri
  end interface

contains

  !> Replace the Schur complement by its inverse, both triangles.
  subroutine invert_schur(s, error)
    real(wp), intent(inout) :: s(:, :) !! (n,n) stiffness in [force/length], compliance out
                                       !! [length/force]
    type(error_t), allocatable, intent(out) :: error !! not positive definite
    integer :: n, info, i, j, first
    integer, parameter :: tile = 64

    n = size(s, 1)
    if (n == 0) return
    call dpotrf('L', n, s, n, info)
    if (info == 0) call dpotri('L', n, s, n, info)
    if (info /= 0) then
      call raise(error, exit_not_solved, &
        'the stiffness condensed to the contact nodes is not positive definite: '// &
        'a body is not held, or the material is at the limit of what double precision holds')
      return
    end if
    ! Tile by tile: a whole row at once would touch a page of memory an entry.
    do first = 1, n, tile
      do j = 1, n
        do i = first, min(first + tile - 1, j - 1)
          s(i, j) = s(j, i)
        end do
      end do
    end do
  end subroutine invert_schur

  !> Number the rows of every point: a row wherever the point can move along its frame and the law
  !> has a reaction.
  !>
  !> A direction that is prescribed has no compliance and no row; without friction there are no
  !> tangential rows; a point whose normal is prescribed has none at all (docs/theory.md section 2).
  pure subroutine rows_of_points(map, points, frame, row)
    type(dof_map_t), intent(in) :: map
    type(contact_points_t), intent(in) :: points
    real(wp), intent(in) :: frame(:, :, :)        !! (3,3,n_points) columns n, t1, t2
    integer, intent(out) :: row(:, :)             !! (3,n_points) 0 where there is none
    real(wp), parameter :: straight = 1.0e-12_wp  ! a direction cosine below this is 0
    integer :: i, a, n
    logical :: free(3)

    row = 0
    n = 0
    do i = 1, points%n
      free = map%equation(:, points%node(i)) > 0
      do a = 1, 3
        if (a > 1 .and. (row(1, i) == 0 .or. points%mu(i) <= 0.0_wp)) exit
        if (.not. any(free .and. abs(frame(:, a, i)) > straight)) cycle
        n = n + 1
        row(a, i) = n
      end do
    end do
  end subroutine rows_of_points

  !> W = B C B^T, B the rows of the points over the interface.
  subroutine compliance_of_rows(map, points, frame, row, c, w)
    type(dof_map_t), intent(in) :: map
    type(contact_points_t), intent(in) :: points
    real(wp), intent(in) :: frame(:, :, :)  !! (3,3,n_points) columns n, t1, t2
    integer, intent(in)  :: row(:, :)       !! (3,n_points)
    real(wp), intent(in) :: c(:, :)         !! (n_interface,n_interface) compliance of the interface
                                            !! [length/force]
    real(wp), allocatable, intent(out) :: w(:, :) !! (n_rows,n_rows) [length/force]
    real(wp) :: h_j(3, 3), block(3, 3)
    integer :: i, j, a, b, eq_i(3), eq_j(3), offset

    offset = map%n_free - map%n_interface
    allocate (w(count(row > 0), count(row > 0)))
    do j = 1, points%n
      eq_j = map%equation(:, points%node(j)) - offset
      h_j = frame(:, :, j)
      do i = 1, points%n
        eq_i = map%equation(:, points%node(i)) - offset
        block = 0.0_wp
        do b = 1, 3
          do a = 1, 3
            if (eq_i(a) > 0 .and. eq_j(b) > 0) block(a, b) = c(eq_i(a), eq_j(b))
          end do
        end do
        block = matmul(transpose(frame(:, :, i)), matmul(block, h_j))
        do b = 1, 3
          do a = 1, 3
            if (row(a, i) > 0 .and. row(b, j) > 0) w(row(a, i), row(b, j)) = block(a, b)
          end do
        end do
      end do
    end do
  end subroutine compliance_of_rows

  !> B^T r on the interface's equations, from reactions in x, y, z.
  pure function interface_force(map, points, reaction) result(f)
    type(dof_map_t), intent(in) :: map
    type(contact_points_t), intent(in) :: points
    real(wp), intent(in) :: reaction(:, :) !! (3,n_points) x, y, z [force]
    real(wp) :: f(map%n_interface)         !! [force]
    integer :: i, a, equation

    f = 0.0_wp
    do i = 1, points%n
      do a = 1, 3
        equation = map%equation(a, points%node(i)) - (map%n_free - map%n_interface)
        if (equation > 0) f(equation) = f(equation) + reaction(a, i)
      end do
    end do
  end function interface_force

end module compliance_mod
