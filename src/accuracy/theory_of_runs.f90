!> What small strain leaves out, as a source of error of a run whose accuracy is asked for: what of
!> the accuracy it may take, and where a run at finite strain is better known.
!>
!> docs/theory-error.md
module theory_of_runs_mod
  use kinds_mod, only: wp
  use convergence_mod, only: growth_of_cost
  implicit none
  private

  public :: run_theory_t, may_spoil, leaves_too_little, is_more_than_its_part, &
    is_known_at_finite_strain

  real(wp), parameter :: small = 0.1_wp
  !! part of an accuracy: a bound below it needs no estimate; mesh and load steps get no less [-]
  real(wp), parameter :: cost_of_finite_strain = 5.0_wp
  !! over that of small strain: 3.3 to 5.3 on the blocks of docs/theory-error.md [-]
  real(wp), parameter :: part_for_theory = 1.0_wp - cost_of_finite_strain**(-1.0_wp/growth_of_cost)
  !! of an accuracy, from which on a mesh for the rest takes longer than finite strain [-]

  !> What finite strain would change of a run, at the ends of its steps the largest.
  type :: run_theory_t
    real(wp) :: error = 0.0_wp
    !! of the resultants; huge: not known; 0 at finite strain [-]
    logical  :: is_estimate = .false.  !! by a shadow run, else a bound
    real(wp) :: of_law(2) = 0.0_wp
    !! estimates with the deck's law, and with another one where it leaves the law open; else 0 [-]
    real(wp) :: law = 0.0_wp           !! how far these two laws are apart [-]
  end type run_theory_t

contains

  !> Whether a bound is so large that an estimate is to take its place.
  pure logical function may_spoil(theory, wanted)
    type(run_theory_t), intent(in) :: theory
    real(wp), intent(in) :: wanted !! accuracy, > 0 [-]

    may_spoil = theory%error > small*wanted
  end function may_spoil

  !> Whether small strain leaves next to nothing of the accuracy for mesh and load steps.
  pure logical function leaves_too_little(theory, wanted)
    type(run_theory_t), intent(in) :: theory
    real(wp), intent(in) :: wanted !! > 0 [-]

    leaves_too_little = theory%error > (1.0_wp - small)*wanted
  end function leaves_too_little

  !> Whether small strain takes so much of the accuracy that finite strain takes less time.
  pure logical function is_more_than_its_part(theory, wanted)
    type(run_theory_t), intent(in) :: theory
    real(wp), intent(in) :: wanted !! > 0 [-]

    is_more_than_its_part = theory%error > part_for_theory*wanted
  end function is_more_than_its_part

  !> Whether a run at finite strain is better known: laws that the deck leaves open are apart by no
  !> more than is allowed, nor by more than small strain is off. Where a run by one of them is lost,
  !> the other alone says nothing; where both are, nothing is known of the law.
  pure logical function is_known_at_finite_strain(theory, allowed) result(is_known)
    type(run_theory_t), intent(in) :: theory
    real(wp), intent(in) :: allowed !! [-]

    is_known = theory%law <= min(allowed, theory%error)
    if (theory%of_law(2) > 0.0_wp) is_known = is_known .or. minval(theory%of_law) >= huge(1.0_wp)
  end function is_known_at_finite_strain

end module theory_of_runs_mod
