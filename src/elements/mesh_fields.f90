!> Stress and strain over the mesh: means of the elements, at their Gauss points, at the nodes; the
!> largest strain and rotation.
module mesh_fields_mod
  use kinds_mod, only: wp
  use cells_mod, only: cells, has_middles
  use connectivity_mod, only: nodes_of_element, nodes_of_hexahedron
  use mesh_mod, only: mesh_t
  use scene_mod, only: scene_t, material_t
  use state_mod, only: state_t
  use step_fields_mod, only: tensor_field_t
  use small_matrix_mod, only: largest_eigenvalue
  use elasticity_mod, only: stress_of
  use element_laws_mod, only: elasticity_at
  use hexahedron8_mod, only: volume_mean, extrapolate_to_nodes, centre_gradient
  use elements_mod, only: gauss_strain
  use finite_forces_mod, only: finite_tensors, undeformed_tensors
  use expansion_mod, only: find_free_strain
  use second_order_mod, only: second_order_t, second_order, strain_of, nodal_values => &
    extrapolate_to_nodes
  implicit none
  private

  public :: fill_tensors_of, fill_undeformed_tensors, fill_tensor_fields, find_largest_deformation

contains

  !> Fill those parts of the two fields of a state that are allocated, thermal expansion included.
  subroutine fill_tensors_of(scene, state, strain, stress)
    type(scene_t), intent(in) :: scene
    type(state_t), intent(in) :: state
    type(tensor_field_t), intent(inout) :: strain  !! [-]
    type(tensor_field_t), intent(inout) :: stress  !! [force/length^2]
    real(wp) :: free(scene%mesh%n_elements) !! [-]

    call find_free_strain(scene, state%step, state%position, free)
    call fill_tensor_fields(scene%mesh, scene%materials, state%displacement, strain, stress, &
      free, scene%finite_strain)
  end subroutine fill_tensors_of

  !> The same of Green's strain and the second Piola-Kirchhoff stress, at finite strain.
  subroutine fill_undeformed_tensors(scene, state, strain, stress)
    type(scene_t), intent(in) :: scene
    type(state_t), intent(in) :: state
    type(tensor_field_t), intent(inout) :: strain  !! [-]
    type(tensor_field_t), intent(inout) :: stress  !! [force/length^2]
    real(wp) :: free(scene%mesh%n_elements)

    call find_free_strain(scene, state%step, state%position, free)
    call fill_tensor_fields(scene%mesh, scene%materials, state%displacement, strain, stress, &
      free, .true., is_undeformed=.true.)
  end subroutine fill_undeformed_tensors

  !> Fill those parts of the two fields that are allocated.
  !>
  !> A node's value is the plain average over all elements at the node, whatever their material, of
  !> what each extrapolates; 0 where no element uses the node.
  !> At finite strain these are the logarithmic strain and Cauchy's stress, or those that refer to
  !> the undeformed body.
  subroutine fill_tensor_fields(mesh, materials, u, strain, stress, free, is_finite, is_undeformed)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    real(wp), intent(in) :: u(:, :)                !! (3,n_nodes) displacement [length]
    type(tensor_field_t), intent(inout) :: strain  !! [-]
    type(tensor_field_t), intent(inout) :: stress  !! [force/length^2]
    real(wp), intent(in) :: free(:)                !! (n_elements) as of find_free_strain [-]
    logical, intent(in) :: is_finite               !! strain
    logical, intent(in), optional :: is_undeformed !! Green's strain, second Piola-Kirchhoff stress
    real(wp) :: x(3, 8), values(6, 8), stresses(6, 8)
    integer :: e, nodes(8), place
    logical :: takes_undeformed

    takes_undeformed = .false.
    if (present(is_undeformed)) takes_undeformed = is_undeformed
    if (allocated(strain%at_nodes)) strain%at_nodes = 0.0_wp
    if (allocated(stress%at_nodes)) stress%at_nodes = 0.0_wp
    place = 0
    do e = 1, mesh%n_elements
      if (has_middles(mesh%connectivity%cell(e))) then
        call store_second_order(e, place)
        place = place + cells(mesh%connectivity%cell(e))%n_points
        cycle
      end if
      nodes = nodes_of_hexahedron(mesh%connectivity, e)
      x = mesh%coordinates(:, nodes)
      associate (elastic => elasticity_at(mesh, materials, e))
        if (takes_undeformed) then
          call undeformed_tensors(mesh, materials, free(e), u, e, values, stresses)
        else if (is_finite) then
          call finite_tensors(mesh, materials, free(e), u, e, values, stresses)
        else
          values = gauss_strain(mesh%element_kind(e), x, u(:, nodes), elastic)
          stresses = stress_of(values, elastic, free(e))
        end if
      end associate
      call store_element(e, nodes, place, x, values, strain)
      call store_element(e, nodes, place, x, stresses, stress)
      place = place + size(values, 2)
    end do
    if (allocated(strain%at_nodes)) call divide_by_elements(mesh, strain%at_nodes)
    if (allocated(stress%at_nodes)) call divide_by_elements(mesh, stress%at_nodes)

  contains

    subroutine store_second_order(e, place)
      integer, intent(in) :: e, place !! the element, and the points of those before it
      type(second_order_t) :: element
      real(wp), allocatable :: strains(:, :), stresses(:, :)

      associate (its => nodes_of_element(mesh%connectivity, e), &
                 elastic => elasticity_at(mesh, materials, e))
        call second_order(mesh%connectivity%cell(e), mesh%coordinates(:, its), element)
        allocate (strains(6, element%n_points), stresses(6, element%n_points))
        if (takes_undeformed) then
          call undeformed_tensors(mesh, materials, free(e), u, e, strains, stresses)
        else if (is_finite) then
          call finite_tensors(mesh, materials, free(e), u, e, strains, stresses)
        else
          strains = strain_of(element, u(:, its))
          stresses = stress_of(strains, elastic, free(e))
        end if
      end associate
      call store_points(mesh, element, e, place, strains, strain)
      call store_points(mesh, element, e, place, stresses, stress)
    end subroutine store_second_order

  end subroutine fill_tensor_fields

  !> Put the values at the points of an element of second order where they belong.
  pure subroutine store_points(mesh, element, e, place, values, field)
    type(mesh_t), intent(in) :: mesh
    type(second_order_t), intent(in) :: element
    integer, intent(in) :: e, place      !! the element, and the points of those before it
    real(wp), intent(in) :: values(:, :) !! (6,n_points)
    type(tensor_field_t), intent(inout) :: field

    associate (weight => element%weight(:element%n_points))
      if (allocated(field%at_centroids)) field%at_centroids(:, e) = matmul(values, weight)/ &
        sum(weight)
    end associate
    if (allocated(field%at_gauss_points)) field%at_gauss_points(:, place + 1: &
      place + size(values, 2)) = values
    if (allocated(field%at_nodes)) then
      associate (nodes => nodes_of_element(mesh%connectivity, e))
        field%at_nodes(:, nodes) = field%at_nodes(:, nodes) + nodal_values(element%cell, values)
      end associate
    end if
  end subroutine store_points

  !> The largest principal strain, by its size, and the largest rotation at the centres of the
  !> elements. Linear theory takes both for small beside 1. docs/theory.md (8.11).
  pure subroutine find_largest_deformation(mesh, u, strain, rotation)
    type(mesh_t), intent(in) :: mesh
    real(wp), intent(in) :: u(:, :)    !! (3,n_nodes) displacement [length]
    real(wp), intent(out) :: strain    !! [-]
    real(wp), intent(out) :: rotation  !! |curl u|/2 [rad]
    real(wp) :: h(3, 3), e(3, 3), curl(3)
    integer :: i, nodes(8)

    strain = 0.0_wp
    rotation = 0.0_wp
    do i = 1, mesh%n_elements
      nodes = nodes_of_hexahedron(mesh%connectivity, i)
      h = centre_gradient(mesh%coordinates(:, nodes), u(:, nodes))
      curl = [h(3, 2) - h(2, 3), h(1, 3) - h(3, 1), h(2, 1) - h(1, 2)]
      rotation = max(rotation, 0.5_wp*norm2(curl))
      e = 0.5_wp*(h + transpose(h))
      ! No eigenvalue is larger than the norm: few elements need theirs.
      if (norm2(e) > strain) strain = max(strain, largest_eigenvalue(e), largest_eigenvalue(-e))
    end do
  end subroutine find_largest_deformation

  !> Put an element's values where they belong; at the nodes they are summed.
  pure subroutine store_element(e, nodes, place, x, values, field)
    integer,  intent(in) :: e, nodes(8)          !! the element and its nodes
    integer,  intent(in) :: place                !! Gauss points of the elements before it
    real(wp), intent(in) :: x(3, 8)              !! coordinates of these [length]
    real(wp), intent(in) :: values(6, 8)         !! at the Gauss points
    type(tensor_field_t), intent(inout) :: field
    real(wp) :: at_corners(6, 8)
    integer :: a

    if (allocated(field%at_centroids)) field%at_centroids(:, e) = volume_mean(x, values)
    if (allocated(field%at_gauss_points)) field%at_gauss_points(:, place + 1:place + &
      size(values, 2)) = values
    if (allocated(field%at_nodes)) then
      at_corners = extrapolate_to_nodes(values)
      do a = 1, size(nodes)
        field%at_nodes(:, nodes(a)) = field%at_nodes(:, nodes(a)) + at_corners(:, a)
      end do
    end if
  end subroutine store_element

  !> Turn sums over the elements at each node into averages.
  pure subroutine divide_by_elements(mesh, values)
    type(mesh_t), intent(in) :: mesh
    real(wp), intent(inout) :: values(:, :) !! (6,n_nodes)
    integer :: elements(mesh%n_nodes), e, a, node

    elements = 0
    do e = 1, mesh%n_elements
      if (has_middles(mesh%connectivity%cell(e))) then
        associate (nodes => nodes_of_element(mesh%connectivity, e))
          elements(nodes) = elements(nodes) + 1
        end associate
        cycle
      end if
      associate (nodes => nodes_of_hexahedron(mesh%connectivity, e))
        do a = 1, size(nodes)
          elements(nodes(a)) = elements(nodes(a)) + 1
        end do
      end associate
    end do
    do node = 1, mesh%n_nodes
      if (elements(node) > 0) values(:, node) = values(:, node)/elements(node)
    end do
  end subroutine divide_by_elements

end module mesh_fields_mod
