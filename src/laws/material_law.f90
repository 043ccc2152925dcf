!> The law of a material: its elasticity at small strain, and its stress at finite strain.
!>
!> No law is known here by its name: those are in new_law.f90, which what only asks a law for its
!> stress does not see.
module material_law_mod
  use kinds_mod, only: wp
  use elasticity_mod, only: elasticity_t
  implicit none
  private

  public :: law_t, most_constants, finite_stress, finite_energy, finite_tangent

  integer, parameter :: most_constants = 21 !! of any law
  integer, parameter :: longest_words = 160

  !> A law with its constants.
  type :: law_t
    type(elasticity_t) :: elastic = elasticity_t() !! at small strain
    real(wp) :: constants(most_constants) = 0.0_wp !! of the stress at finite strain
    real(wp) :: usual_from = 0.0_wp, usual_to = huge(1.0_wp)
    !! principal stretches beyond which a run says the following [-]
    character(longest_words) :: beyond_usual = '' !! in words
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
