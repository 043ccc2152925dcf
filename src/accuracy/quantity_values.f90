!> The values of the quantities of an accuracy at the end of an increment.
module quantity_values_mod
  use kinds_mod, only: wp
  use controls_mod, only: accuracy_of_pressure, accuracy_of_displacement, accuracy_of_mises, &
    accuracy_of_slip, accuracy_of_reaction, accuracy_of_contact_force
  use cells_mod, only: cells
  use connectivity_mod, only: connectivity_t, nodes_of_element
  use mesh_mod, only: mesh_t
  use scene_mod, only: scene_t, turn_local
  use grip_motion_mod, only: held_by_references
  use contact_points_mod, only: contact_points_t, law_at
  use friction_laws_mod, only: bound_friction
  use state_mod, only: state_t, largest_slip
  use contact_at_nodes_mod, only: add_contact_forces, add_contact_pressures
  use increment_report_mod, only: increment_report_t, contact_fields_t, force_sums, &
    largest_pressure
  use step_fields_mod, only: tensor_field_t
  use mesh_fields_mod, only: fill_tensors_of
  use invariants_mod, only: von_mises
  use measured_quantities_mod, only: quantity_t
  implicit none
  private

  public :: measure_quantities, add_in_time

contains

  !> Add an increment of a dynamic *STEP to the means in time of its quantities, by the trapezoid;
  !> of shares the largest counts. After impacts runs differ in phase, and in means they do not.
  pure subroutine add_in_time(list, share, before, now, mean)
    type(quantity_t), intent(in) :: list(:)
    real(wp), intent(in) :: share                !! of the *STEP's period [-]
    real(wp), intent(in) :: before(:), now(:)    !! (n_components) where it begins, and ends
    real(wp), intent(inout) :: mean(:)           !! (n_components)
    integer :: k

    do k = 1, size(list)
      associate (a => list(k)%first, b => list(k)%first + list(k)%n - 1)
        if (list(k)%is_share) then
          mean(a:b) = max(mean(a:b), now(a:b))
        else
          mean(a:b) = mean(a:b) + 0.5_wp*share*(before(a:b) + now(a:b))
        end if
      end associate
    end do
  end subroutine add_in_time

  !> The values of quantities at the end of an increment.
  subroutine measure_quantities(scene, points, list, state, report, values)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(quantity_t), intent(in) :: list(:)
    type(state_t), intent(in) :: state
    type(increment_report_t), intent(in) :: report
    real(wp), intent(out) :: values(:) !! of all components
    real(wp) :: sums(3, 2)
    integer :: k

    values = 0.0_wp
    do k = 1, size(list)
      associate (name => list(k)%name, pair => list(k)%pair)
        if (name(index(name, '/', back=.true.) + 1:) == 'used_gap') values(list(k)%first) = &
          used_gap(points, state, report%contact, pair)
      end associate
    end do
    if (allocated(scene%accuracy%set)) then
      call measure_set(scene, points, state, report, sum(list%n, mask=list%is_compared .and. &
        list%pair == 0), values)
      return
    end if
    do k = 1, size(list)
      associate (quantity => list(k), a => list(k)%first)
        select case (quantity%name(index(quantity%name, '/', back=.true.) + 1:))
        case ('pressing_force')
          values(a) = sum(report%contact%reaction(1, points%first(quantity%pair): &
            points%first(quantity%pair + 1) - 1))
        case ('normal_force')
          sums = force_sums(report%contact, points%first(quantity%pair), &
            points%first(quantity%pair + 1) - 1)
          values(a:a + 2) = sums(:, 1)
        case ('friction_force')
          sums = force_sums(report%contact, points%first(quantity%pair), &
            points%first(quantity%pair + 1) - 1)
          values(a:a + 2) = sums(:, 2)
        case ('largest_pressure')
          values(a) = largest_pressure(report%contact, points%first(quantity%pair), &
            points%first(quantity%pair + 1) - 1)
        case ('pressure_beside')
          values(a) = pressure_beside(scene%mesh, points, report%contact, quantity%pair)
        case ('largest_slip')
          values(a) = largest_slip(state, points%first(quantity%pair), &
            points%first(quantity%pair + 1) - 1)
        case ('used_friction')
          values(a) = used_friction(scene, points, state, report%contact, quantity%pair)
        case ('strain')
          values(a) = report%energy%strain
        case ('largest_displacement')
          values(a) = largest_displacement(scene%mesh, state)
        case ('largest_von_mises')
          call find_mises(values(a), values(quantity%beside))
        case default ! found with the largest
        end select
      end associate
    end do

  contains

    !> The largest mean stress of an element, and the least of its neighbours of the same material.
    subroutine find_mises(largest, beside)
      real(wp), intent(out) :: largest, beside
      type(tensor_field_t) :: strain, stress
      real(wp) :: mises(scene%mesh%n_elements)
      integer :: at, e

      allocate (stress%at_centroids(6, scene%mesh%n_elements))
      call fill_tensors_of(scene, state, strain, stress)
      mises = von_mises(stress%at_centroids)
      at = maxloc(mises, dim=1)
      largest = mises(at)
      beside = largest
      associate (nodes => scene%mesh%connectivity, material => scene%mesh%material)
        do e = 1, scene%mesh%n_elements
          if (material(e) /= material(at)) cycle
          if (share_a_face(nodes, e, at)) beside = min(beside, mises(e))
        end do
      end associate
    end subroutine find_mises

    !> Whether all corners of a face of an element are those of another one.
    pure logical function share_a_face(connectivity, e, other) result(they_do)
      type(connectivity_t), intent(in) :: connectivity
      integer, intent(in) :: e, other
      integer :: face, k, n

      they_do = e /= other
      if (.not. they_do) return
      associate (nodes => nodes_of_element(connectivity, e), &
                 others => nodes_of_element(connectivity, other), &
                 cell => cells(connectivity%cell(e)))
        do face = 1, cell%n_faces
          n = cell%n_face_corners(face)
          if (all([(any(others == nodes(cell%face(k, face))), k=1, n)])) return
        end do
      end associate
      they_do = .false.
    end function share_a_face

  end subroutine measure_quantities

  !> The largest displacement of a node that has elements.
  pure real(wp) function largest_displacement(mesh, state)
    type(mesh_t), intent(in) :: mesh
    type(state_t), intent(in) :: state

    largest_displacement = maxval(norm2(state%displacement(:, mesh%element_nodes), dim=1))
  end function largest_displacement

  !> The largest part of its largest friction that a point of a pair has: 1 where one slips. Points
  !> that carry next to nothing are left out: their friction is rounding.
  pure real(wp) function used_friction(scene, points, state, contact, pair) result(used)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(state_t), intent(in) :: state
    type(contact_fields_t), intent(in) :: contact
    integer, intent(in) :: pair
    real(wp), parameter :: least_slip = 1.0e-4_wp
    !! of the largest displacement: less is what a contact tolerance leaves
    real(wp), parameter :: most_used = 0.999_wp !! where none slips: a scale is 1/1000 at least
    real(wp), parameter :: least_normal = 1.0e-3_wp
    !! of the largest reaction: of what carries less the residual decides whether it slips
    real(wp) :: normal, bound, slope
    integer :: i

    used = 0.0_wp
    associate (first => points%first(pair), last => points%first(pair + 1) - 1)
      if (largest_slip(state, first, last) > least_slip*largest_displacement(scene%mesh, &
        state)) then
        used = 1.0_wp
        return
      end if
      normal = maxval(contact%reaction(1, first:last))
      if (.not. normal > 0.0_wp) return
      do i = first, last
        associate (r => contact%reaction(:, i))
          if (r(1) < least_normal*normal) cycle
          call bound_friction(law_at(points, i, contact%covered_area(i)), r(1), bound, slope)
          bound = points%mu(i)*bound
          if (bound > 0.0_wp) used = max(used, min(most_used, norm2(r(2:3))/bound))
        end associate
      end do
    end associate
  end function used_friction

  !> How close a pair is to contact: u/(u + least gap), u the longest displacement of its nodes; 1
  !> where a point presses. Where none does, points that are closed cannot press.
  pure real(wp) function used_gap(points, state, contact, pair) result(used)
    type(contact_points_t), intent(in) :: points
    type(state_t), intent(in) :: state
    type(contact_fields_t), intent(in) :: contact
    integer, intent(in) :: pair
    real(wp) :: moved, gap
    integer :: i

    used = 1.0_wp
    associate (first => points%first(pair), last => points%first(pair + 1) - 1)
      if (any(contact%reaction(1, first:last) > 0.0_wp)) return
      moved = 0.0_wp
      gap = huge(1.0_wp)
      do i = first, last
        associate (masters => contact%weights%node(contact%weights%first(i): &
          contact%weights%first(i + 1) - 1))
          moved = maxval([moved, norm2(state%displacement(:, points%node(i))), &
            norm2(state%displacement(:, masters), dim=1)])
        end associate
        if (contact%gap(i) > 0.0_wp) gap = min(gap, contact%gap(i))
      end do
      used = moved/(moved + gap)
    end associate
  end function used_gap

  !> The least pressure at the other ends of the edges of elements from where a pair's is largest.
  pure real(wp) function pressure_beside(mesh, points, contact, pair) result(beside)
    type(mesh_t), intent(in) :: mesh
    type(contact_points_t), intent(in) :: points
    type(contact_fields_t), intent(in) :: contact
    integer, intent(in) :: pair
    real(wp) :: pressure(mesh%n_nodes) !! negative where the pair has no point
    integer :: i, e, k, at

    pressure = -1.0_wp
    do i = points%first(pair), points%first(pair + 1) - 1
      associate (at_node => pressure(points%node(i)))
        at_node = max(at_node, largest_pressure(contact, i, i))
      end associate
    end do
    at = maxloc(pressure, dim=1)
    beside = max(0.0_wp, pressure(at))
    do e = 1, mesh%n_elements
      associate (cell => cells(mesh%connectivity%cell(e)), &
                 nodes => nodes_of_element(mesh%connectivity, e))
        if (all(nodes /= at)) cycle
        do k = 1, cell%n_edges
          if (all(nodes(cell%edge(:, k)) /= at)) cycle
          associate (near => minval(pressure(nodes(cell%edge(:, k)))))
            if (near >= 0.0_wp) beside = min(beside, near)
          end associate
        end do
      end associate
    end do
  end function pressure_beside

  !> The values of a set, and the largest of all nodes.
  subroutine measure_set(scene, points, state, report, n, values)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(state_t), intent(in) :: state
    type(increment_report_t), intent(in) :: report
    integer, intent(in) :: n !! how many are compared; behind them is what they are measured by
    real(wp), intent(out) :: values(:) !! node after node
    real(wp), allocatable :: vectors(:, :)

    associate (mine => values(:n), largest => values(n + 1), nodes => scene%accuracy%nodes)
      select case (scene%accuracy%of)
      case (accuracy_of_displacement)
        vectors = state%displacement
        call turn_local(scene, state%displacement, .true., vectors)
        mine = reshape(in_direction(vectors(:, nodes)), shape(mine))
        largest = maxval(norm2(vectors, dim=1))
      case (accuracy_of_reaction, accuracy_of_contact_force)
        if (scene%accuracy%of == accuracy_of_reaction) then
          vectors = held_by_references(scene, state%displacement, state%support_force)
          call turn_local(scene, state%support_force, .false., vectors)
        else
          vectors = 0.0_wp*state%displacement
          call add_contact_forces(scene, points, state, report%contact, vectors)
        end if
        mine = reshape(in_direction(spread(sum(vectors(:, nodes), 2), 2, 1)), shape(mine))
        largest = sum(norm2(vectors(:, nodes), dim=1))
      case default
        vectors = numbers_at_nodes(scene, points, state, report, .true.)
        mine = vectors(1, nodes)
        if (scene%accuracy%of == accuracy_of_pressure) vectors = numbers_at_nodes(scene, points, &
          state, report, .false.)
        largest = maxval(vectors)
        if (scene%accuracy%of == accuracy_of_slip) values(n + 2) = largest_displacement( &
          scene%mesh, state)
      end select
    end associate

  contains

    !> The components of vectors that the accuracy is of.
    pure function in_direction(vectors) result(components)
      real(wp), intent(in) :: vectors(:, :) !! (3,n)
      real(wp), allocatable :: components(:, :)

      components = vectors
      associate (d => scene%accuracy%direction)
        if (d > 0) components = vectors(d:d, :)
      end associate
    end function in_direction

  end subroutine measure_set

  !> At each node the von Mises stress, the sum of its contact points' pressures, or their longest
  !> slip.
  function numbers_at_nodes(scene, points, state, report, all_points) result(values)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(state_t), intent(in) :: state
    type(increment_report_t), intent(in) :: report
    logical, intent(in) :: all_points !! as of `add_contact_pressures`
    real(wp), allocatable :: values(:, :) !! (1,n_nodes)
    type(tensor_field_t) :: strain, stress
    integer :: i

    allocate (values(1, scene%mesh%n_nodes), source=0.0_wp)
    if (scene%accuracy%of == accuracy_of_mises) then
      allocate (stress%at_nodes(6, scene%mesh%n_nodes))
      call fill_tensors_of(scene, state, strain, stress)
      values(1, :) = von_mises(stress%at_nodes)
      return
    end if
    if (scene%accuracy%of == accuracy_of_pressure) then
      call add_contact_pressures(points, report%contact, values(1, :), all_points)
      return
    end if
    do i = 1, points%n
      associate (node => points%node(i))
        values(1, node) = max(values(1, node), norm2(state%slip(:, i)))
      end associate
    end do
  end function numbers_at_nodes

end module quantity_values_mod
