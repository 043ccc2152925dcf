!> What small strain leaves out, as a source of error of a run whose accuracy is asked for: what of
!> the accuracy it may take, and where a run at finite strain is better known.
!>
!> docs/theory-error.md
module theory_of_runs_mod
  use kinds_mod, only: wp
  implicit none
  private

  public :: run_theory_t, may_spoil, leaves_too_little, is_more_than_its_part, &
    is_known_at_finite_strain

  real(wp), parameter :: part_that_spoils = 0.1_wp
  !! of the accuracy: a bound below it needs no estimate [-]
  real(wp), parameter :: part_for_theory = 1.0_wp/3.0_wp
  !! of the accuracy, from which on finite strain takes less time than a mesh for the rest: elements
  !! 1.5 times smaller take 7 times as long, and finite strain 3 to 5 (docs/theory-error.md) [-]
  real(wp), parameter :: most_for_theory = 0.9_wp
  !! of the accuracy: mesh and load steps do not get below a tenth of it [-]

  !> What finite strain would change of a run, at the ends of its steps the largest.
  type :: run_theory_t
    real(wp) :: error = 0.0_wp
    !! of the resultants; huge: more than linear theory can say; 0 at finite strain [-]
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

    may_spoil = theory%error > part_that_spoils*wanted
  end function may_spoil

  !> Whether small strain leaves next to nothing of the accuracy for mesh and load steps.
  pure logical function leaves_too_little(theory, wanted)
    type(run_theory_t), intent(in) :: theory
    real(wp), intent(in) :: wanted !! > 0 [-]

    leaves_too_little = theory%error > most_for_theory*wanted
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
