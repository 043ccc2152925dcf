!> The law of a material: its elasticity at small strain, and its stress at finite strain.
!>
!> Another law is a file like neo_hooke.f90 and a case in `new_law`. The rest of the program knows
!> no law by its name.
module material_law_mod
  use kinds_mod, only: wp
  use elasticity_mod, only: elasticity_t, elasticity_of
  use st_venant_kirchhoff_mod, only: stress_of_svk => first_piola, energy_of_svk => energy, &
    tangent_of_svk => tangent
  use neo_hooke_mod, only: stress_of_neo_hooke => first_piola, energy_of_neo_hooke => energy, &
    tangent_of_neo_hooke => tangent, elastic_neo_hooke => elastic_part
  implicit none
  private

  public :: law_t, new_law, finite_stress, finite_energy, finite_tangent

  integer, parameter :: most_constants = 2 !! of any law

  !> A law with its constants.
  type :: law_t
    type(elasticity_t) :: elastic !! at small strain
    real(wp) :: constants(most_constants) = 0.0_wp !! of the stress at finite strain
    procedure(stress_of_gradient), pointer, nopass :: first_piola => null()
    procedure(energy_of_gradient), pointer, nopass :: energy => null()
    procedure(tangent_of_gradient), pointer, nopass :: tangent => null()
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

    !> Strain energy of H = du/dX in a volume that was 1.
    pure function energy_of_gradient(h, constants) result(w)
      import :: wp
      implicit none
      real(wp), intent(in) :: h(3, 3)      !! [-]
      real(wp), intent(in) :: constants(:)
      real(wp) :: w                        !! [energy/length^3]
    end function energy_of_gradient

    !> What P changes by as F does.
    pure function tangent_of_gradient(h, constants) result(a)
      import :: wp
      implicit none
      real(wp), intent(in) :: h(3, 3)      !! [-]
      real(wp), intent(in) :: constants(:)
      real(wp) :: a(3, 3, 3, 3)            !! dP_ij/dF_kl: (i,j,k,l) [force/length^2]
    end function tangent_of_gradient
  end interface

contains

  !> The law that a deck's card and numbers stand for: ELASTIC with E, nu; NEO HOOKE with C10, D1.
  pure function new_law(word, numbers) result(law)
    character(*), intent(in) :: word
    real(wp), intent(in) :: numbers(:) !! as the deck has them
    type(law_t) :: law

    select case (word)
    case ('ELASTIC')
      law%elastic = elasticity_of(numbers(1), numbers(2))
      law%constants = [law%elastic%lambda, law%elastic%shear]
      law%first_piola => stress_of_svk
      law%energy => energy_of_svk
      law%tangent => tangent_of_svk
    case ('NEO HOOKE')
      law%elastic = elastic_neo_hooke(numbers)
      law%constants = numbers
      law%first_piola => stress_of_neo_hooke
      law%energy => energy_of_neo_hooke
      law%tangent => tangent_of_neo_hooke
    case default
      law = law_t()
    end select
  end function new_law

  !> First Piola-Kirchhoff stress of a displacement gradient, det(I + H) > 0.
  pure function finite_stress(law, h) result(p)
    type(law_t), intent(in) :: law
    real(wp), intent(in) :: h(3, 3) !! du_i/dX_j [-]
    real(wp) :: p(3, 3)             !! [force/length^2]

    p = law%first_piola(h, law%constants)
  end function finite_stress

  !> Strain energy of a displacement gradient in a volume that was 1.
  pure real(wp) function finite_energy(law, h) result(w)
    type(law_t), intent(in) :: law
    real(wp), intent(in) :: h(3, 3) !! du_i/dX_j [-]

    w = law%energy(h, law%constants)
  end function finite_energy

  !> dP_ij/dF_kl of a displacement gradient, det(I + H) > 0.
  pure function finite_tangent(law, h) result(a)
    type(law_t), intent(in) :: law
    real(wp), intent(in) :: h(3, 3) !! du_i/dX_j [-]
    real(wp) :: a(3, 3, 3, 3)       !! (i,j,k,l) [force/length^2]

    a = law%tangent(h, law%constants)
  end function finite_tangent

end module material_law_mod
