!> The certificate of an increment, from the scene, displacements and reactions: what it holds
!> against each other it computes itself. docs/theory.md section 6.
module certify_increment_mod
  use kinds_mod, only: wp
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use state_mod, only: state_t
  use increment_report_mod, only: certificate_t, contact_fields_t
  use increment_forces_mod, only: imposed_t, increment_forces_t
  use stress_forces_mod, only: find_stress_forces
  use warming_mod, only: warming_at
  use deformed_forces_mod, only: find_deformed_forces
  use pressed_surfaces_mod, only: press_deformed_surfaces
  use foundation_pressures_mod, only: add_foundation_pressures
  use spring_pulls_mod, only: add_spring_pulls
  use turning_weights_mod, only: add_turning_weights
  use obstacle_gaps_mod, only: face_obstacles, rounding_of_places
  use touching_points_mod, only: find_touching
  use inner_sides_mod, only: turn_inner_sides
  use allowed_overlaps_mod, only: add_allowed
  use facing_surfaces_mod, only: face_surfaces
  use turned_slips_mod, only: slips_of_turns
  use edge_middles_mod, only: find_edge_middles
  use rigid_patterns_mod, only: find_patterns, take_moments
  use turning_means_mod, only: find_means, spread_forces
  use pairs_of_step_mod, only: take_pairs, weigh_friction, face_nothing, find_closed
  use own_mass_mod, only: own_mass_t
  use own_inertia_mod, only: add_inertia
  use certificate_mod, only: certify
  implicit none
  private

  public :: certify_increment

contains

  !> Judge an increment.
  !>
  !> Internal forces, those of springs, foundations and pressures (at finite strain about the
  !> deformed places), and gaps, frames and slips before planes, spheres and cylinders, are computed
  !> anew, and so is the interference that is allowed; which pairs a *STEP has, and their friction
  !> coefficients, are as the deck's cards say; weights, normals and gaps before surfaces and facets
  !> are held against integrals. Taken as they are: other loads, laws of materials and springs,
  !> constant extra gaps, the sides of masters, overlaps that constraints keep, and slips before
  !> surfaces and facets whose weights are confirmed.
  pure function certify_increment(scene, points, tolerance, said, old, new, imposed, own) &
    result(certificate)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    real(wp), intent(in) :: tolerance           !! of contact [-]
    type(contact_fields_t), intent(in) :: said  !! of contact by what solved the increment
    type(state_t), intent(in) :: old, new       !! before and after it
    type(imposed_t), intent(in) :: imposed
    type(own_mass_t), intent(in), optional :: own !! of a dynamic *STEP
    type(certificate_t) :: certificate
    real(wp) :: wrong_motion
    type(contact_fields_t) :: contact
    type(contact_points_t) :: known
    type(increment_forces_t) :: forces
    integer :: folded_point, torn_point

    forces%imposed_t = imposed
    call find_stress_forces(scene%mesh, scene%materials, new%displacement, old%displacement, forces)
    if (scene%finite_strain) then
      call find_deformed_forces(scene%mesh, scene%materials, warming_at(scene, new%step, &
        new%position), new, forces)
      call press_deformed_surfaces(scene, new%displacement, forces%imposed_t)
      if (allocated(forces%following%gradient)) call add_turning_weights(scene, &
        forces%following%gradient, new%displacement, forces%external)
      forces%patterns = find_patterns(scene)
      call take_moments(forces%patterns, scene%mesh%coordinates + new%displacement, &
        forces%constraints)
      forces%means = find_means(scene, new%displacement)
      call spread_forces(forces%means, scene%mesh%coordinates, new%displacement, &
        forces%constraints)
    end if
    if (scene%mesh%springs%n > 0) forces%applied = forces%external
    call add_foundation_pressures(scene, new%displacement, forces)
    call add_spring_pulls(scene%mesh, new%displacement, forces)
    wrong_motion = 0.0_wp
    if (present(own)) call add_inertia(scene, own, old, new, forces, wrong_motion)
    call find_edge_middles(scene, points, said%weights, forces%middles)
    forces%rounding_of_gaps = rounding_of_places(scene, new%displacement)
    contact = said
    known = points
    call take_pairs(scene, new%step, known)
    if (allocated(points%constant_gap)) then
      call add_allowed(scene, new, contact, known)
      contact%gap = contact%gap + (known%extra_gap - points%extra_gap)
    end if
    call face_obstacles(scene, known, old, new, contact)
    call find_closed(scene, known, old, contact)
    call turn_inner_sides(scene, known, new%displacement, contact)
    call face_surfaces(scene, known, old, new, contact, folded_point, torn_point)
    call face_nothing(known, contact)
    if (present(own)) call let_arrive(forces%rounding_of_gaps, old, new, contact%gap)
    call weigh_friction(scene, old, new, contact, known)
    forces%touches = find_touching(scene, known, forces%middles, new, contact)
    certificate = certify(scene%mesh, known, contact, old, new, forces, &
      tolerance, slips_of_turns(scene, points, forces%middles, contact, old, new))
    certificate%strain = forces%of_elements%energy
    if (present(own)) then
      certificate%equilibrium = max(certificate%equilibrium, wrong_motion)
      certificate%certified = certificate%certified .and. wrong_motion <= 10.0_wp*tolerance
    end if
    certificate%folded_point = folded_point
    certificate%torn_point = torn_point
  end function certify_increment

  !> Points that have had no reaction, and have none, may be where a body in flight arrives: their
  !> gaps are known as well as its velocities, which carry the rounding of each increment before.
  pure subroutine let_arrive(rounding, old, new, gap)
    real(wp), intent(in) :: rounding     !! of a gap in an increment [length]
    type(state_t), intent(in) :: old, new
    real(wp), intent(inout) :: gap(:)    !! (n_points) [length]
    real(wp), parameter :: of_solution = 8.0_wp
    !! rounding of a solution over that of one place: 1.6 of 976 nodes in flight [-]
    integer :: i

    do i = 1, size(gap)
      if (any(abs(old%reaction(:, i)) > 0.0_wp) .or. any(abs(new%reaction(:, i)) > 0.0_wp)) cycle
      if (abs(gap(i)) <= of_solution*rounding*max(1, new%increments_done - 1)) gap(i) = 0.0_wp
    end do
  end subroutine let_arrive

end module certify_increment_mod
