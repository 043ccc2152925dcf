!> The compliance of contact rows where every product with it is a solution with the factor:
!>
!>     W v = R^T B K^-1 B^T R v,      docs/theory.md (4.13)
!>
!> Only rows go in and come out; of the displacement between nothing is kept.
module solutions_map_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t
  use stiffness_inverse_mod, only: stiffness_inverse_t, solve_equations
  use compliance_map_mod, only: compliance_map_t
  use sparse_rows_mod, only: rows_t
  implicit none
  private

  public :: solutions_map_t, map_of_rows

  type, extends(compliance_map_t) :: solutions_map_t
    type(stiffness_inverse_t), pointer, private :: inverse => null() !! of the linearisation
    type(rows_t), private :: transfer
    integer,  allocatable, private :: row(:, :)      !! (3,n_points) 0 where there is none
    real(wp), allocatable, private :: frame(:, :, :) !! (3,3,n_points) columns n, t1, t2
  contains
    procedure :: press => press_by_solutions
  end type solutions_map_t

contains

  !> The map of a placement's rows. It holds as long as the inverse does.
  subroutine map_of_rows(inverse, transfer, frame, row, map)
    type(stiffness_inverse_t), pointer, intent(in) :: inverse !! nothing condensed
    type(rows_t), intent(in) :: transfer
    real(wp), intent(in) :: frame(:, :, :)  !! (3,3,n_points)
    integer, intent(in) :: row(:, :)        !! (3,n_points)
    class(compliance_map_t), allocatable, intent(out) :: map
    type(solutions_map_t), allocatable :: of_rows

    allocate (of_rows)
    of_rows%inverse => inverse
    of_rows%transfer = transfer
    of_rows%frame = frame
    of_rows%row = row
    call move_alloc(of_rows, map)
  end subroutine map_of_rows

  !> A solution that fails is 0, and what made it fail is kept by the inverse.
  subroutine press_by_solutions(map, v, roughly, w_v)
    class(solutions_map_t), intent(in) :: map
    real(wp), intent(in)  :: v(:, :)    !! (n,m) [force]
    logical,  intent(in)  :: roughly    !! an inexact factor is not refined
    real(wp), intent(out) :: w_v(:, :)  !! (n,m) [length]
    type(error_t), allocatable :: error
    real(wp), allocatable :: b(:, :)
    real(wp) :: along(3)
    integer :: i, j, a, k, n_interior

    w_v = 0.0_wp
    associate (inverse => map%inverse, transfer => map%transfer)
      if (allocated(inverse%failure)) return
      n_interior = inverse%map%n_free - inverse%map%n_interface
      allocate (b(inverse%map%n_free, size(v, 2)), source=0.0_wp)
      do j = 1, size(v, 2)
        do i = 1, size(map%row, 2)
          if (map%row(1, i) == 0) cycle
          along = 0.0_wp
          do a = 1, 3
            if (map%row(a, i) > 0) along = along + map%frame(:, a, i)*v(map%row(a, i), j)
          end do
          do a = 1, 3
            do k = transfer%first(3*(i - 1) + a), transfer%first(3*(i - 1) + a + 1) - 1
              associate (b_k => b(n_interior + transfer%column(k), j))
                b_k = b_k + transfer%value(k)*along(a)
              end associate
            end do
          end do
        end do
      end do
      call solve_equations(inverse, b, roughly, error)
      if (allocated(error)) then
        call move_alloc(error, inverse%failure)
        return
      end if
      do j = 1, size(v, 2)
        do i = 1, size(map%row, 2)
          if (map%row(1, i) == 0) cycle
          along = 0.0_wp
          do a = 1, 3
            do k = transfer%first(3*(i - 1) + a), transfer%first(3*(i - 1) + a + 1) - 1
              along(a) = along(a) + transfer%value(k)*b(n_interior + transfer%column(k), j)
            end do
          end do
          do a = 1, 3
            if (map%row(a, i) > 0) w_v(map%row(a, i), j) = dot_product(map%frame(:, a, i), along)
          end do
        end do
      end do
    end associate
  end subroutine press_by_solutions

end module solutions_map_mod
