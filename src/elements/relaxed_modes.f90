!> The amplitudes of C3D8I's modes at finite strain, as a function of the displacements of the
!> nodes: those for which the modes' forces vanish. docs/theory.md (8.15), (8.24).
module relaxed_modes_mod
  use kinds_mod, only: wp
  use elasticity_mod, only: constrained_modulus
  use material_law_mod, only: law_t, finite_stress
  use small_matrix_mod, only: inverse_of_3 => inverse, solve_small
  use strain_measures_mod, only: deformation_of, growth_of
  use hexahedron8_mod, only: centre_gradient
  use mesh_mod, only: kind_c3d8i
  use finite_strain_mod, only: finite_element_t, finite_element, is_inverted, gradients_of_law, &
    forces_on_modes
  use element_tangent_mod, only: mode_stiffness
  implicit none
  private

  public :: relax_modes, find_modes

  integer, parameter :: most = 60          !! evaluations of the stresses
  real(wp), parameter :: slow = 0.1_wp     !! of the forces are left by a step: another matrix
  real(wp), parameter :: shortest = 1.0e-3_wp !! part of a step
  real(wp), parameter :: good_enough = 1.0e-9_wp
  !! of the forces of the strains, where rounding lets no step gain [-]

contains

  !> Newton's method with an inverse that is kept while it serves.
  !>
  !> From amplitudes in equilibrium and their inverse the first step is that by which the linearised
  !> element follows its nodes, so that it stays on the branch of its solutions that it is on. A
  !> step that gains nothing, or after which det F <= 0 somewhere, is halved, once the inverse is
  !> that of its beginning.
  pure subroutine relax_modes(element, law, modes, inverse, is_found, n_evaluations)
    type(finite_element_t), intent(in) :: element !! C3D8I
    type(law_t), intent(in) :: law
    real(wp), intent(inout) :: modes(3, 3)        !! start in, amplitudes out [length]
    real(wp), intent(inout) :: inverse(9, 9)      !! of the modes' stiffness there [length/force]
    logical, intent(out) :: is_found
    !! det F > 0 with these amplitudes, and without any, and their forces vanish
    integer, intent(out), optional :: n_evaluations !! of the stresses
    real(wp) :: force(3, 3), there(3, 3), step(3, 3), scale, left, part
    logical :: is_fresh, is_possible
    integer :: i

    if (present(n_evaluations)) n_evaluations = 1
    is_found = .not. is_inverted(element)
    if (.not. is_found) return
    call evaluate(element, modes, law, force, is_possible)
    if (.not. is_possible) then
      modes = 0.0_wp
      inverse = inverse_at(element, modes, law)
      call evaluate(element, modes, law, force, is_possible)
    end if
    scale = scale_of(element, law)
    left = maxval(abs(force))
    is_fresh = .false.
    part = 1.0_wp
    do i = 1, most
      if (left <= 8.0_wp*epsilon(1.0_wp)*scale) return
      if (present(n_evaluations)) n_evaluations = i + 1
      step = reshape(matmul(inverse, reshape(force, [9])), [3, 3])
      call evaluate(element, modes - part*step, law, there, is_possible)
      is_possible = is_possible .and. maxval(abs(there)) < 0.9_wp*left
      if (is_possible) then
        modes = modes - part*step
        force = there
        is_fresh = maxval(abs(force)) > slow*left
        left = maxval(abs(force))
        part = 1.0_wp
        if (is_fresh) inverse = inverse_at(element, modes, law)
      else if (.not. is_fresh) then
        is_fresh = .true.
        inverse = inverse_at(element, modes, law)
      else
        if (left <= good_enough*scale) return
        part = 0.5_wp*part
        if (part < shortest) exit
      end if
    end do
    is_found = left <= good_enough*scale
  end subroutine relax_modes

  !> The forces on the modes, where det F > 0 at the Gauss points.
  pure subroutine evaluate(element, modes, law, force, is_possible)
    type(finite_element_t), intent(in) :: element
    real(wp), intent(in) :: modes(3, 3)   !! [length]
    type(law_t), intent(in) :: law
    real(wp), intent(out) :: force(3, 3)  !! 0 elsewhere [force]
    logical, intent(out) :: is_possible
    real(wp) :: h(3, 3, 8), stress(3, 3, 8)
    integer :: g

    force = 0.0_wp
    h = gradients_of_law(element, modes)
    do g = 1, 8
      is_possible = growth_of(h(:, :, g)) > -1.0_wp
      if (.not. is_possible) return
      stress(:, :, g) = finite_stress(law, h(:, :, g))
    end do
    force = forces_on_modes(element, stress)
  end subroutine evaluate

  !> The amplitudes from nothing: of the solutions that an element may have, the one that it comes
  !> to as it is stretched from its undeformed shape, without its turn.
  pure subroutine find_modes(x, u, law, modes, inverse, is_found)
    real(wp), intent(in) :: x(3, 8), u(3, 8)      !! nodes and their displacements [length]
    type(law_t), intent(in) :: law
    real(wp), intent(out) :: modes(3, 3)          !! [length]
    real(wp), intent(out) :: inverse(9, 9)        !! as of relax_modes [length/force]
    logical, intent(out) :: is_found              !! as of relax_modes
    real(wp), parameter :: first = 0.25_wp, least = 1.0_wp/32.0_wp !! parts of the way
    integer, parameter :: few = 12                !! evaluations: the branch was not left
    type(finite_element_t) :: element
    real(wp) :: stretched(3, 8), next_modes(3, 3), next_inverse(9, 9), way, part
    integer :: n

    stretched = without_turn(x, u)
    call finite_element(kind_c3d8i, x, 0.0_wp*u, element)
    modes = 0.0_wp
    inverse = inverse_at(element, modes, law)
    way = 0.0_wp
    part = first
    do while (way < 1.0_wp .and. part >= least)
      call finite_element(kind_c3d8i, x, min(1.0_wp, way + part)*stretched, element)
      next_modes = modes
      next_inverse = inverse
      call relax_modes(element, law, next_modes, next_inverse, is_found, n)
      if (.not. is_found .or. (n > few .and. part > 2.0_wp*least)) then
        part = 0.5_wp*part
        cycle
      end if
      modes = next_modes
      inverse = next_inverse
      way = way + part
    end do
    call finite_element(kind_c3d8i, x, u, element)
    is_found = way >= 1.0_wp
    if (is_found) call relax_modes(element, law, modes, inverse, is_found)
  end subroutine find_modes

  !> Displacements without the turn of the element's centre, and without its way: with F_0 = R U,
  !> those of R^T (x + u).
  pure function without_turn(x, u) result(stretched)
    real(wp), intent(in) :: x(3, 8), u(3, 8) !! [length]
    real(wp) :: stretched(3, 8)              !! [length]
    integer, parameter :: enough = 20
    real(wp) :: r(3, 3)
    integer :: i

    ! Newton's iteration for the polar decomposition.
    r = deformation_of(centre_gradient(x, u))
    do i = 1, enough
      r = 0.5_wp*(r + transpose(inverse_of_3(r)))
    end do
    stretched = matmul(transpose(r), x + u - spread(x(:, 1) + u(:, 1), 2, 8)) - &
      (x - spread(x(:, 1), 2, 8))
  end function without_turn

  !> What the modes' forces are sums of: the stress of the strains on their gradients.
  pure real(wp) function scale_of(element, law) result(scale)
    type(finite_element_t), intent(in) :: element
    type(law_t), intent(in) :: law
    integer :: g

    scale = 0.0_wp
    do g = 1, 8
      scale = scale + element%weight(g)*maxval(abs(element%mode(:, :, g)))* &
        maxval(abs(element%h(:, :, g)))
    end do
    scale = constrained_modulus(law%elastic)*scale
  end function scale_of

  !> The inverse of the modes' stiffness; 0 where that has none.
  pure function inverse_at(element, modes, law) result(inverse)
    type(finite_element_t), intent(in) :: element
    real(wp), intent(in) :: modes(3, 3) !! [length]
    type(law_t), intent(in) :: law
    real(wp) :: inverse(9, 9)           !! [length/force]
    real(wp) :: k(9, 9), one(9)
    logical :: is_regular
    integer :: i

    k = mode_stiffness(element, modes, law)
    is_regular = .true.
    do i = 1, 9
      one = 0.0_wp
      one(i) = 1.0_wp
      if (is_regular) call solve_small(k, one, inverse(:, i), is_regular)
    end do
    if (.not. is_regular) inverse = 0.0_wp
  end function inverse_at

end module relaxed_modes_mod
