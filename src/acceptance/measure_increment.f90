!> What is looked for in an increment only at the end of a step and where fields are written: the
!> errors of the mesh and of small strain, the largest strain and rotation.
module measure_increment_mod
  use kinds_mod, only: wp
  use controls_mod, only: accuracy_of_resultants
  use scene_mod, only: scene_t, material_t
  use material_law_mod, only: law_t
  use bodies_mod, only: is_linear
  use contact_points_mod, only: contact_points_t, is_covered, is_in_middle
  use state_mod, only: state_t
  use increments_mod, only: increment_t, ends_step, asked_number
  use increment_report_mod, only: contact_fields_t, increment_report_t, status_open
  use step_fields_mod, only: fields_due, tensor_field_t
  use elasticity_mod, only: young_modulus
  use invariants_mod, only: von_mises
  use expansion_mod, only: find_free_strain
  use mesh_fields_mod, only: find_largest_deformation, fill_tensors_of
  use recovered_error_mod, only: estimate_mesh_error
  use step_solver_mod, only: step_solver_t
  use load_response_mod, only: sum_patterns
  use contact_work_mod, only: least_contact_work
  use theory_error_mod, only: estimate_theory_error
  use shadow_run_mod, only: laws_at_finite_strain, take_laws
  use unseen_contact_mod, only: share_of_supports
  implicit none
  private

  public :: is_mesh_told, estimate_mesh, measure_deformation, measure_stress, bound_theory

contains

  !> Whether the error of the mesh is told: at the end of a step, and where the deck wants it as a
  !> field.
  pure logical function is_mesh_told(scene, state) result(told)
    type(scene_t), intent(in) :: scene
    type(state_t), intent(in) :: state
    logical :: is_last

    is_last = ends_step(scene%steps, state)
    told = is_last .and. scene%accuracy%estimates
    if (scene%output%mesh_error) told = told .or. fields_due(scene%output%frequency, &
      asked_number(state%position), is_last)
  end function is_mesh_told

  !> The error of the mesh. Where an accuracy is asked of this mesh alone, with what recovery does
  !> not see of contact.
  subroutine estimate_mesh(scene, points, state, report)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(state_t), intent(in) :: state
    type(increment_report_t), intent(inout) :: report !! gets the error of the mesh
    real(wp) :: free(scene%mesh%n_elements)

    call find_free_strain(scene, state%step, state%position, free)
    call estimate_mesh_error(scene%mesh, scene%materials, state%displacement, free, &
      .not. is_linear(scene), report%mesh_error, report%errors%mesh)
    ! The energy is the same, whoever carries the force.
    if (scene%accuracy%wanted > 0.0_wp .and. scene%accuracy%keeps_mesh .and. scene%accuracy%of == &
      accuracy_of_resultants) report%errors%mesh = report%errors%mesh + share_of_supports(points, &
      report%contact, state%displacement)
    if (allocated(points%alpha) .and. report%energy%strain > 0.0_wp) report%errors%mesh = &
      report%errors%mesh + work_at_distance(points, report%contact)/(2.0_wp*report%energy%strain)
  end subroutine estimate_mesh

  !> The reactions of points in the middles of edges times the distance that their nodes are off
  !> what they press: no node is there. docs/theory.md section 9.
  pure real(wp) function work_at_distance(points, contact) result(work)
    type(contact_points_t), intent(in) :: points
    type(contact_fields_t), intent(in) :: contact
    integer :: i, k

    work = 0.0_wp
    do i = 1, points%n
      if (.not. is_in_middle(points, contact%weights, i)) cycle
      ! Ends that a master of faces does not cover have no gap.
      if (.not. all([(is_covered(points, contact%weights, points%end_point(k, i)), k=1, 2)])) cycle
      associate (alpha => points%alpha(i), gap => contact%gap)
        work = work + max(0.0_wp, contact%reaction(1, i))*max(0.0_wp, (1.0_wp - 2.0_wp*alpha)* &
          gap(i) + alpha*sum(gap(points%end_point(:, i))))
      end associate
    end do
  end function work_at_distance

  !> How far the increment leaves small strain: at the end of a step, and where fields are written.
  subroutine measure_deformation(scene, state, report)
    type(scene_t), intent(in) :: scene
    type(state_t), intent(in) :: state
    type(increment_report_t), intent(inout) :: report !! gets the largest strain and rotation
    logical :: is_last

    is_last = ends_step(scene%steps, state)
    if (.not. (is_last .or. fields_due(scene%output%frequency, asked_number(state%position), &
      is_last))) return
    call find_largest_deformation(scene%mesh, state%displacement, report%largest_strain, &
      report%largest_rotation)
  end subroutine measure_deformation

  !> The largest von Mises stress of an element of *ELASTIC, as a part of Young's modulus.
  subroutine measure_stress(scene, state, report)
    type(scene_t), intent(in) :: scene
    type(state_t), intent(in) :: state
    type(increment_report_t), intent(inout) :: report !! gets it
    type(tensor_field_t) :: strain, stress
    real(wp) :: mises(scene%mesh%n_elements)
    integer :: e

    allocate (stress%at_centroids(6, scene%mesh%n_elements))
    call fill_tensors_of(scene, state, strain, stress)
    mises = von_mises(stress%at_centroids)
    do e = 1, scene%mesh%n_elements
      associate (law => scene%materials(scene%mesh%material(e))%law)
        if (law%is_open) report%largest_stress = max(report%largest_stress, &
          mises(e)/young_modulus(law%elastic))
      end associate
    end do
  end subroutine measure_stress

  !> The bound of the error of small strain, by the worst of the laws that finite strain may have.
  subroutine bound_theory(scene, points, solver, increment, state, report, bound)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(in) :: solver !! with the contact problem of the increment
    type(increment_t), intent(in) :: increment
    type(state_t), intent(in) :: state
    type(increment_report_t), intent(in) :: report
    real(wp), intent(out) :: bound !! [-]
    logical, dimension(0:scene%mesh%n_bodies) :: is_pressed, is_held
    real(wp) :: free(scene%mesh%n_elements)
    real(wp), allocatable :: u_free(:, :), external(:, :)
    type(law_t), allocatable :: law(:, :)
    type(material_t), allocatable :: materials(:)
    real(wp) :: of_law
    integer :: i

    is_pressed = .false.
    do i = 1, points%n
      if (report%contact%status(i) == status_open) cycle
      is_pressed(scene%mesh%body(points%node(i))) = .true.
      associate (weights => report%contact%weights)
        is_pressed(scene%mesh%body(weights%node(weights%first(i):weights%first(i + 1) - 1))) = &
          .true.
      end associate
    end do
    call sum_patterns(scene, solver%response, increment%fraction, increment%step_time, u_free, &
      external)
    ! Pins take the loads of bodies that supports do not hold; without contact there are but loads.
    is_held = any(is_pressed(1:))
    associate (body => scene%mesh%body, motions => solver%body%motions)
      is_held(pack(motions%body, motions%body > 0)) = .false.
      if (allocated(motions%piece)) is_held(pack(body, motions%piece > 0)) = .false.
      u_free = merge(u_free, 0.0_wp, spread(is_held(body), 1, 3))
    end associate
    call find_free_strain(scene, state%step, state%position, free)
    law = laws_at_finite_strain(scene%materials)
    materials = scene%materials
    bound = 0.0_wp
    do i = 1, size(law, 2)
      call take_laws(law(:, i), materials)
      call estimate_theory_error(scene%mesh, materials, state%displacement, free, is_pressed(1:), &
        least_contact_work(solver%contact, report%x_free, report%contact), of_law, u_free)
      bound = max(bound, of_law)
    end do
  end subroutine bound_theory

end module measure_increment_mod
