!> Friction that depends on the pressure: no more than a stress (TAUMAX), or a coefficient that a
!> table gives over the pressure; and on the rate of slip. docs/theory.md (3.12), (3.14).
module friction_laws_mod
  use kinds_mod, only: wp
  implicit none
  private

  public :: friction_law_t, is_constant, needs_area, falls_with_rate, of_area, bound_friction, &
    largest_friction, share_of_friction, share_at_rate, least_share, are_same_laws

  !> The largest friction of a point is its largest coefficient mu times `bound_friction`:
  !> |r_t| <= mu min(share(r_n) r_n, most). Of a pair in pressures, of a point in forces: these
  !> times its area. By default friction is mu r_n.
  type :: friction_law_t
    real(wp) :: most = huge(1.0_wp)
    !! of friction, over mu; huge: no limit [force/length^2], [force]
    real(wp), allocatable :: pressure(:)
    !! (n) ascending, not negative; not allocated: the coefficient is mu [force/length^2], [force]
    real(wp), allocatable :: share(:)    !! (n) of mu at these pressures [-]
    real(wp) :: kinetic = 1.0_wp         !! share of mu that fast slip has [-]
    real(wp) :: decay = 0.0_wp           !! to it, over the rate of slip; 0: none [time/length]
  end type friction_law_t

contains

  !> Whether the coefficient is the same at all pressures and rates.
  pure elemental logical function is_constant(law)
    type(friction_law_t), intent(in) :: law

    is_constant = .not. (needs_area(law) .or. falls_with_rate(law))
  end function is_constant

  !> Whether it depends on the pressure, so on the area of a point.
  pure elemental logical function needs_area(law)
    type(friction_law_t), intent(in) :: law

    needs_area = law%most < huge(1.0_wp) .or. allocated(law%pressure)
  end function needs_area

  !> Whether it depends on the rate of slip.
  pure elemental logical function falls_with_rate(law)
    type(friction_law_t), intent(in) :: law

    falls_with_rate = law%decay > 0.0_wp .and. law%kinetic < 1.0_wp
  end function falls_with_rate

  !> The share of the coefficient that a rate of slip has. docs/theory.md (3.14).
  pure real(wp) function share_at_rate(law, rate) result(share)
    type(friction_law_t), intent(in) :: law
    real(wp), intent(in) :: rate !! [length/time]

    share = law%kinetic + (1.0_wp - law%kinetic)*exp(-law%decay*rate)
  end function share_at_rate

  !> The share of the coefficient that there is at all pressures and rates: none where friction is
  !> no more than a stress.
  pure elemental real(wp) function least_share(law) result(share)
    type(friction_law_t), intent(in) :: law

    share = 0.0_wp
    if (law%most < huge(1.0_wp)) return
    share = 1.0_wp
    if (falls_with_rate(law)) share = law%kinetic
    if (allocated(law%share)) share = share*minval(law%share)
  end function least_share

  !> The law of a point by that of its pair.
  pure type(friction_law_t) function of_area(law, area) result(of_point)
    type(friction_law_t), intent(in) :: law
    real(wp), intent(in) :: area !! of the point [length^2]
    real(wp) :: largest          !! that times the area is a number

    of_point = law
    largest = huge(1.0_wp)/max(1.0_wp, area)
    if (law%most < huge(1.0_wp)) of_point%most = area*min(largest, law%most)
    if (allocated(law%pressure)) of_point%pressure = area*min(largest, law%pressure)
  end function of_area

  !> The largest friction over mu at a normal reaction, and its slope.
  pure subroutine bound_friction(law, r_n, bound, slope)
    type(friction_law_t), intent(in) :: law  !! of a point
    real(wp), intent(in)  :: r_n             !! normal reaction [force]
    real(wp), intent(out) :: bound           !! 0 where nothing presses [force]
    real(wp), intent(out) :: slope           !! of the bound over the normal reaction [-]
    real(wp) :: share, change

    call read_table(law, r_n, share, change)
    bound = share*max(0.0_wp, r_n)
    slope = share + change*max(0.0_wp, r_n)
    if (bound <= law%most) return
    bound = law%most
    slope = 0.0_wp
  end subroutine bound_friction

  !> The largest friction of a point at a normal reaction, and its slope. docs/theory.md (3.12).
  pure subroutine largest_friction(mu, laws, i, r_n, radius, slope)
    real(wp), intent(in) :: mu                              !! its largest coefficient [-]
    type(friction_law_t), allocatable, intent(in) :: laws(:)
    !! (n_points) not allocated: coefficients are the same at all pressures
    integer, intent(in) :: i                                !! the point
    real(wp), intent(in)  :: r_n                            !! [force]
    real(wp), intent(out) :: radius, slope                  !! [force], [-]

    radius = mu*max(0.0_wp, r_n)
    slope = mu
    if (.not. allocated(laws)) return
    call bound_friction(laws(i), r_n, radius, slope)
    radius = mu*radius
    slope = mu*slope
  end subroutine largest_friction

  !> The coefficient that belongs to a normal reaction, over mu, and what it changes by: with it the
  !> largest friction is a cone's.
  pure subroutine share_of_friction(law, r_n, share, change)
    type(friction_law_t), intent(in) :: law  !! of a point
    real(wp), intent(in)  :: r_n             !! normal reaction [force]
    real(wp), intent(out) :: share           !! [-]
    real(wp), intent(out) :: change          !! [1/force]

    call read_table(law, r_n, share, change)
    if (share*max(0.0_wp, r_n) <= law%most) return
    share = law%most/r_n
    change = -share/r_n
  end subroutine share_of_friction

  !> The table's share at a normal reaction, and its slope: straight between two rows, constant
  !> before the first and behind the last.
  pure subroutine read_table(law, r_n, share, change)
    type(friction_law_t), intent(in) :: law
    real(wp), intent(in)  :: r_n
    real(wp), intent(out) :: share, change
    integer :: i, n

    change = 0.0_wp
    share = 1.0_wp
    if (.not. allocated(law%pressure)) return
    n = size(law%pressure)
    i = count(law%pressure <= r_n)
    share = law%share(max(1, i))
    if (i < 1 .or. i == n) return
    change = (law%share(i + 1) - share)/(law%pressure(i + 1) - law%pressure(i))
    share = share + change*(r_n - law%pressure(i))
  end subroutine read_table

  !> Whether two laws say the same.
  pure elemental logical function are_same_laws(a, b) result(same)
    type(friction_law_t), intent(in) :: a, b

    same = .not. (abs(a%most - b%most) > 0.0_wp .or. abs(a%kinetic - b%kinetic) > 0.0_wp .or. &
      abs(a%decay - b%decay) > 0.0_wp) .and. (allocated(a%pressure) .eqv. allocated(b%pressure))
    if (.not. same .or. .not. allocated(a%pressure)) return
    same = size(a%pressure) == size(b%pressure)
    if (same) same = .not. any(abs(a%pressure - b%pressure) > 0.0_wp .or. abs(a%share - b%share) > &
      0.0_wp)
  end function are_same_laws

end module friction_laws_mod
