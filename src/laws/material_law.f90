!> The law of a material: its elasticity at small strain, and its stress at finite strain.
!>
!> Another law is a file like st_venant_kirchhoff.f90 and a case in `new_law`. The rest of the
!> program knows no law by its name.
module material_law_mod
  use kinds_mod, only: wp
  use elasticity_mod, only: elasticity_t, elasticity_of
  use st_venant_kirchhoff_mod, only: st_venant_kirchhoff => first_piola
  implicit none
  private

  public :: law_t, new_law, finite_stress

  integer, parameter :: most_constants = 2 !! of any law

  !> A law with its constants.
  type :: law_t
    type(elasticity_t) :: elastic !! at small strain
    real(wp) :: constants(most_constants) = 0.0_wp !! of the stress at finite strain
    procedure(stress_of_gradient), pointer, nopass :: first_piola => null()
  end type law_t

  abstract interface
    !> P of H = du/dX, by a law's constants.
    pure function stress_of_gradient(h, constants) result(p)
      import :: wp
      implicit none
      real(wp), intent(in) :: h(3, 3)      !! [-]
      real(wp), intent(in) :: constants(:)
      real(wp) :: p(3, 3)                  !! [force/length^2]
    end function stress_of_gradient
  end interface

contains

  !> The law that a deck's card and numbers stand for: ELASTIC with E, nu.
  pure function new_law(word, numbers) result(law)
    character(*), intent(in) :: word
    real(wp), intent(in) :: numbers(:) !! as the deck has them
    type(law_t) :: law

    select case (word)
    case ('ELASTIC')
      law%elastic = elasticity_of(numbers(1), numbers(2))
      law%constants = [law%elastic%lambda, law%elastic%shear]
      law%first_piola => st_venant_kirchhoff
    end select
  end function new_law

  !> First Piola-Kirchhoff stress of a displacement gradient.
  pure function finite_stress(law, h) result(p)
    type(law_t), intent(in) :: law
    real(wp), intent(in) :: h(3, 3) !! du_i/dX_j [-]
    real(wp) :: p(3, 3)             !! [force/length^2]

    p = law%first_piola(h, law%constants)
  end function finite_stress

end module material_law_mod
