!> The laws of materials by their names.
!>
!> Another law is a file like mooney_rivlin.f90 and a case in `new_law`. The rest of the program
!> knows no law by its name.
module new_law_mod
  use kinds_mod, only: wp
  use elasticity_mod, only: elasticity_t, elasticity_of, bulk_modulus, turned
  use material_law_mod, only: law_t
  use st_venant_kirchhoff_mod, only: stress_of_svk => first_piola, energy_of_svk => energy, &
    tangent_of_svk => tangent, usual_from_svk => usual_from, usual_to_svk => usual_to, &
    beyond_svk => beyond_usual
  use anisotropic_svk_mod, only: stress_of_anisotropic => first_piola, &
    energy_of_anisotropic => energy, tangent_of_anisotropic => tangent, constants_of
  use mooney_rivlin_mod, only: stress_of_mooney => first_piola, energy_of_mooney => energy, &
    tangent_of_mooney => tangent, elastic_mooney => elastic_part
  use yeoh_mod, only: stress_of_yeoh => first_piola, energy_of_yeoh => energy, &
    tangent_of_yeoh => tangent
  use ogden_mod, only: stress_of_ogden => first_piola, energy_of_ogden => energy, &
    tangent_of_ogden => tangent, elastic_ogden => elastic_part, last_of_ogden => last
  use blatz_ko_mod, only: stress_of_blatz_ko => first_piola, energy_of_blatz_ko => energy, &
    tangent_of_blatz_ko => tangent, elastic_blatz_ko => elastic_part
  implicit none
  private

  public :: new_law, other_law, anisotropic_law, turned_law

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
      law%constants(last_of_ogden) = numbers(size(numbers))
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

  !> The law of an elasticity that is not isotropic.
  pure type(law_t) function anisotropic_law(elastic) result(law)
    type(elasticity_t), intent(in) :: elastic

    law%elastic = elastic
    law%constants = constants_of(elastic)
    law%first_piola => stress_of_anisotropic
    law%energy => energy_of_anisotropic
    law%tangent => tangent_of_anisotropic
    law%usual_from = usual_from_svk
    law%usual_to = usual_to_svk
    law%beyond_usual = beyond_svk
  end function anisotropic_law

  !> A law whose axes are turned.
  pure type(law_t) function turned_law(law, axes)
    type(law_t), intent(in) :: law      !! along the axes
    real(wp), intent(in) :: axes(3, 3)  !! columns: the law's axes along x, y, z [-]

    turned_law = law
    if (.not. law%elastic%is_isotropic) turned_law = anisotropic_law(turned(law%elastic, axes))
  end function turned_law

end module new_law_mod
