!> A compliance that is known by its products alone, where W itself would be too large.
module compliance_map_mod
  use kinds_mod, only: wp
  implicit none
  private

  public :: compliance_map_t

  !> What reactions do to the gaps of the contact rows.
  type, abstract :: compliance_map_t
  contains
    procedure(press_rows), deferred :: press
  end type compliance_map_t

  abstract interface
    !> W V, several columns at once.
    subroutine press_rows(map, v, roughly, w_v)
      import :: compliance_map_t, wp
      implicit none
      class(compliance_map_t), intent(in) :: map
      real(wp), intent(in)  :: v(:, :)    !! (n,m) [force]
      logical,  intent(in)  :: roughly    !! some digits are enough: for directions, not residuals
      real(wp), intent(out) :: w_v(:, :)  !! (n,m) [length]
    end subroutine press_rows
  end interface

end module compliance_map_mod
