!> The bodies as a contact problem sees them that is solved together with their displacements: what
!> stands in the place of a compliance where every product with that would be a solution.
!>
!> The rows of the points are orthonormal: C C^T = I, with C from unknowns to rows. Unknowns are
!> displacements, or motions relative to others: `relate` says how, u = T v.
module body_map_mod
  use kinds_mod, only: wp
  implicit none
  private

  public :: body_map_t

  type, abstract :: body_map_t
    real(wp), allocatable :: scale(:) !! (n) of forces [-]
  contains
    procedure(count_unknowns), deferred :: n
    procedure(hold_points), deferred :: hold
    procedure(multiply), deferred :: product
    procedure(multiply), deferred :: precondition
    procedure(take_rows), deferred :: at_points
    procedure(add_rows), deferred :: add_from_points
    procedure(take_pins), deferred :: at_pins
    procedure(add_pins), deferred :: add_at_pins
    procedure(change_unknowns), deferred :: relate
    procedure(change_unknowns), deferred :: unrelate
  end type body_map_t

  abstract interface
    !> Unknowns of the bodies.
    pure integer function count_unknowns(map)
      import :: body_map_t
      implicit none
      class(body_map_t), intent(in) :: map
    end function count_unknowns

    !> Hold directions of the points, and no others, for `precondition`.
    subroutine hold_points(map, held, stiffer)
      import :: body_map_t, wp
      implicit none
      class(body_map_t), intent(inout) :: map
      real(wp), intent(in) :: held(:, :, :)    !! (3,3,n_points) projection on what is held [-]
      real(wp), intent(in) :: stiffer(:, :, :) !! (3,3,n_points) across it [force/length]
    end subroutine hold_points

    !> K v, or about the inverse of what K is where nothing moves along what is held.
    subroutine multiply(map, v, product)
      import :: body_map_t, wp
      implicit none
      class(body_map_t), intent(in) :: map
      real(wp), intent(in) :: v(:)        !! (n)
      real(wp), intent(out) :: product(:) !! (n)
    end subroutine multiply

    !> C v.
    subroutine take_rows(map, v, rows)
      import :: body_map_t, wp
      implicit none
      class(body_map_t), intent(in) :: map
      real(wp), intent(in) :: v(:)         !! (n)
      real(wp), intent(out) :: rows(:, :)  !! (3,n_points) n, t1, t2; 0 where there is no row
    end subroutine take_rows

    !> v + C^T rows.
    subroutine add_rows(map, rows, v)
      import :: body_map_t, wp
      implicit none
      class(body_map_t), intent(in) :: map
      real(wp), intent(in) :: rows(:, :)   !! (3,n_points); what has no row is left out
      real(wp), intent(inout) :: v(:)      !! (n)
    end subroutine add_rows

    !> What the pins of free motions move by.
    pure function take_pins(map, v) result(a)
      import :: body_map_t, wp
      implicit none
      class(body_map_t), intent(in) :: map
      real(wp), intent(in) :: v(:)         !! (n)
      real(wp), allocatable :: a(:)        !! (n_pins) [length]
    end function take_pins

    !> Add forces at the pins.
    pure subroutine add_pins(map, force, f)
      import :: body_map_t, wp
      implicit none
      class(body_map_t), intent(in) :: map
      real(wp), intent(in) :: force(:)     !! (n_pins) [force]
      real(wp), intent(inout) :: f(:)      !! (n) of the unknowns [force]
    end subroutine add_pins

    !> `relate`: from displacements and forces of the bodies to those of the unknowns, T^-1 and T^T;
    !> `unrelate`: back.
    pure subroutine change_unknowns(map, v, f)
      import :: body_map_t, wp
      implicit none
      class(body_map_t), intent(in) :: map
      real(wp), intent(inout) :: v(:)      !! (n) [length]
      real(wp), intent(inout) :: f(:)      !! (n) [force]
    end subroutine change_unknowns
  end interface

end module body_map_mod
