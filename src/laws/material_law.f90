!> The law of a material: its elasticity at small strain, and its stress at finite strain.
!>
!> Another law is a file like mooney_rivlin.f90 and a case in `new_law`. The rest of the program
!> knows no law by its name.
module material_law_mod
  use kinds_mod, only: wp
  use elasticity_mod, only: elasticity_t, elasticity_of, bulk_modulus
  use st_venant_kirchhoff_mod, only: stress_of_svk => first_piola, energy_of_svk => energy, &
    tangent_of_svk => tangent, usual_from_svk => usual_from, usual_to_svk => usual_to, &
    beyond_svk => beyond_usual
  use mooney_rivlin_mod, only: stress_of_mooney => first_piola, energy_of_mooney => energy, &
    tangent_of_mooney => tangent, elastic_mooney => elastic_part
  use yeoh_mod, only: stress_of_yeoh => first_piola, energy_of_yeoh => energy, &
    tangent_of_yeoh => tangent
  use ogden_mod, only: stress_of_ogden => first_piola, energy_of_ogden => energy, &
    tangent_of_ogden => tangent, elastic_ogden => elastic_part
  use blatz_ko_mod, only: stress_of_blatz_ko => first_piola, energy_of_blatz_ko => energy, &
    tangent_of_blatz_ko => tangent, elastic_blatz_ko => elastic_part
  implicit none
  private

  public :: law_t, new_law, other_law, finite_stress, finite_energy, finite_tangent

  integer, parameter :: most_constants = 7 !! of any law

  !> A law with its constants.
  type :: law_t
    type(elasticity_t) :: elastic !! at small strain
    real(wp) :: constants(most_constants) = 0.0_wp !! of the stress at finite strain
    real(wp) :: usual_from = 0.0_wp, usual_to = huge(1.0_wp)
    !! principal stretches beyond which a run says the following [-]
    character(len(beyond_svk)) :: beyond_usual = '' !! in words
    logical :: is_open = .false. !! its card names no law of finite strain
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

  !> The law that a deck's card and numbers stand for: ELASTIC with E, nu; NEO HOOKE with C10, D1;
  !> MOONEY-RIVLIN with C10, C01, D1; YEOH with C10, C20, C30, D1; OGDEN with mu_p and alpha_p in
  !> turn, D1; BLATZ-KO with mu.
  pure type(law_t) function new_law(word, numbers) result(law)
    character(*), intent(in) :: word
    real(wp), intent(in) :: numbers(:) !! as the deck has them

    select case (word)
    case ('ELASTIC')
      law%elastic = elasticity_of(numbers(1), numbers(2))
      law%constants(:2) = [law%elastic%lambda, law%elastic%shear]
      law%first_piola => stress_of_svk
      law%energy => energy_of_svk
      law%tangent => tangent_of_svk
      law%is_open = .true.
      law%usual_from = usual_from_svk
      law%usual_to = usual_to_svk
      law%beyond_usual = beyond_svk
    case ('NEO HOOKE', 'MOONEY-RIVLIN')
      law%constants([1, 3]) = numbers([1, size(numbers)])
      if (size(numbers) == 3) law%constants(2) = numbers(2)
      law%elastic = elastic_mooney(law%constants)
      law%first_piola => stress_of_mooney
      law%energy => energy_of_mooney
      law%tangent => tangent_of_mooney
    case ('YEOH')
      law%elastic = elastic_mooney([numbers(1), 0.0_wp, numbers(4)])
      law%constants(:4) = numbers
      law%first_piola => stress_of_yeoh
      law%energy => energy_of_yeoh
      law%tangent => tangent_of_yeoh
    case ('OGDEN')
      law%constants(:size(numbers) - 1) = numbers(:size(numbers) - 1)
      law%constants(most_constants) = numbers(size(numbers))
      law%elastic = elastic_ogden(law%constants)
      law%first_piola => stress_of_ogden
      law%energy => energy_of_ogden
      law%tangent => tangent_of_ogden
    case ('BLATZ-KO')
      law%elastic = elastic_blatz_ko(numbers)
      law%constants(:1) = numbers
      law%first_piola => stress_of_blatz_ko
      law%energy => energy_of_blatz_ko
      law%tangent => tangent_of_blatz_ko
    case default
      law = law_t()
    end select
  end function new_law

  !> Neo-Hooke's law with the constants that a law has at small strain.
  pure type(law_t) function other_law(law)
    type(law_t), intent(in) :: law

    associate (elastic => law%elastic)
      other_law = new_law('NEO HOOKE', [0.5_wp*elastic%shear, 2.0_wp/bulk_modulus(elastic)])
    end associate
  end function other_law

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
