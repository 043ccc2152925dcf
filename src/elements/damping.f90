!> The forces by which materials damp motions: C v, C = sum of ALPHA M and BETA K of *DAMPING.
!>
!> The velocity at the end of an increment is that of the last two means, 3/2 x_1 - 1/2 x_0: nodes
!> without mass have one, too, the forces on a piece cancel, and no motion gains by them.
!> docs/theory.md, section 13.
module damping_mod
  use kinds_mod, only: wp
  use mesh_mod, only: mesh_t
  use scene_mod, only: material_t
  use congruent_forces_mod, only: add_element_forces
  use mass_matrix_mod, only: mass_t, times_mass
  implicit none
  private

  public :: damping_t, new_damping, damping_force, stiffened

  real(wp), parameter :: nothing = 1.0e-14_wp
  !! of the largest BETA, of materials without: modes of elements are no others in these [-]

  !> The damping of the bodies. Not allocated: there is none of the kind.
  type :: damping_t
    real(wp), allocatable :: rate(:)             !! (n_nodes) ALPHA of the piece [1/time]
    type(material_t), allocatable :: material(:) !! with BETA times their elasticity
    real(wp), allocatable :: beta(:)             !! (n_materials) [time]
  end type damping_t

contains

  !> The damping of the materials of a mesh, whose pieces have one ALPHA each.
  pure type(damping_t) function new_damping(mesh, materials) result(damping)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    real(wp) :: of_piece(0:mesh%n_pieces)
    integer :: e

    if (any(materials%mass_damping > 0.0_wp)) then
      of_piece = 0.0_wp
      do e = 1, mesh%n_elements
        associate (first => mesh%connectivity%node(mesh%connectivity%first(e)))
          of_piece(mesh%piece(first)) = materials(mesh%material(e))%mass_damping
        end associate
      end do
      damping%rate = of_piece(mesh%piece)
    end if
    if (any(materials%stiffness_damping > 0.0_wp)) then
      damping%beta = max(materials%stiffness_damping, &
        nothing*maxval(materials%stiffness_damping))
      damping%material = scaled(materials, damping%beta)
    end if
  end function new_damping

  !> Materials with other moduli.
  pure function scaled(materials, by) result(other)
    type(material_t), intent(in) :: materials(:)
    real(wp), intent(in) :: by(:)            !! (n_materials) [-]
    type(material_t) :: other(size(materials))
    integer :: i

    other = materials
    do i = 1, size(materials)
      associate (elastic => other(i)%law%elastic)
        elastic%lambda = by(i)*elastic%lambda
        elastic%shear = by(i)*elastic%shear
        elastic%c = by(i)*elastic%c
      end associate
    end do
  end function scaled

  !> Materials whose stiffness is K, and what BETA adds for displacements of which velocities are a
  !> multiple.
  pure function stiffened(damping, materials, factor) result(other)
    type(damping_t), intent(in) :: damping
    type(material_t), intent(in) :: materials(:)
    real(wp), intent(in) :: factor           !! velocity by displacement [1/time]
    type(material_t) :: other(size(materials))

    other = materials
    if (allocated(damping%beta)) other = scaled(materials, 1.0_wp + factor*damping%beta)
  end function stiffened

  !> C times velocities.
  pure function damping_force(damping, mesh, mass, v) result(f)
    type(damping_t), intent(in) :: damping
    type(mesh_t), intent(in) :: mesh
    type(mass_t), intent(in) :: mass
    real(wp), intent(in) :: v(:, :)   !! (3,n_nodes) [length/time]
    real(wp) :: f(3, size(v, 2))      !! [force]

    f = 0.0_wp
    if (allocated(damping%material)) call add_element_forces(mesh, damping%material, v, f)
    if (allocated(damping%rate)) f = f + spread(damping%rate, 1, 3)*times_mass(mass, v)
  end function damping_force

end module damping_mod
