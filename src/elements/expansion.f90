!> Thermal expansion: the strain by which a warmer element is free to grow, and the forces and
!> energy of the stress that would take it back. docs/theory.md section 8.
module expansion_mod
  use kinds_mod, only: wp, i8
  use elasticity_mod, only: thermal_stress_of
  use element_laws_mod, only: elasticity_at
  use cells_mod, only: has_middles, most_points
  use connectivity_mod, only: nodes_of_element, nodes_of_hexahedron
  use mesh_mod, only: mesh_t
  use scene_mod, only: scene_t, material_t
  use warming_mod, only: warms, warming_at
  use hexahedron8_mod, only: shape_gradients, volume
  use second_order_mod, only: second_order_t, second_order
  implicit none
  private

  public :: find_free_strain, free_strain, thermal_force, thermal_energy, expand_freely, &
    largest_thermal_forces

contains

  !> The free strains at a place in a step; 0 where nothing warms.
  pure subroutine find_free_strain(scene, step, position, free)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step
    integer(i8), intent(in) :: position  !! in parts of the deck's increments
    real(wp), intent(out) :: free(:)     !! (n_elements) [-]

    free = 0.0_wp
    if (warms(scene)) free = free_strain(scene%mesh, scene%materials, &
      warming_at(scene, step, position))
  end subroutine find_free_strain

  !> Of each element alpha dT, dT the mean over its nodes. docs/theory.md (8.34).
  pure function free_strain(mesh, materials, rise) result(free)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    real(wp), intent(in) :: rise(:)      !! (n_nodes) of the temperature
    real(wp) :: free(mesh%n_elements)    !! [-]
    integer :: e

    do e = 1, mesh%n_elements
      associate (nodes => nodes_of_element(mesh%connectivity, e))
        free(e) = materials(mesh%material(e))%expansion*sum(rise(nodes))/real(size(nodes), wp)
      end associate
    end do
  end function free_strain

  !> At finite strain: the place of an element that has expanded freely, where it has no stress, and
  !> its displacement from there. The forces, energy and tangent of F/(1 + free) in a volume that is
  !> (1 + free)^3 are those of this element. docs/theory.md (8.31).
  pure subroutine expand_freely(free, x, u)
    real(wp), intent(in) :: free         !! [-]
    real(wp), intent(inout) :: x(:, :)   !! (3,n) nodes [length]
    real(wp), intent(inout) :: u(:, :)   !! (3,n) displacements; the first node's stays [length]
    real(wp) :: way(3, size(x, 2))

    if (.not. abs(free) > 0.0_wp) return
    way = free*(x - spread(x(:, 1), 2, size(x, 2)))
    x = x + way
    u = u - way
  end subroutine expand_freely

  !> Add the nodal forces of free strains, int g_a dV times the stress that would take back each.
  !> They balance in every element.
  pure subroutine thermal_force(mesh, materials, free, f)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    real(wp), intent(in) :: free(:)     !! (n_elements) [-]
    real(wp), intent(inout) :: f(:, :)  !! (3,n_nodes) [force]
    integer :: e, a
    integer, allocatable :: nodes(:)
    real(wp), allocatable :: of_element(:, :)

    allocate (nodes(0), of_element(3, 0))
    do e = 1, mesh%n_elements
      if (.not. abs(free(e)) > 0.0_wp) cycle
      nodes = nodes_of_kernel(mesh, e)
      of_element = element_thermal_force(mesh, materials, e, free(e))
      do a = 1, size(nodes)
        f(:, nodes(a)) = f(:, nodes(a)) + of_element(:, a)
      end do
    end do
  end subroutine thermal_force

  !> The largest of these of an element at a node, of each body: what would hold an element in its
  !> shape. Forces of bodies that are free to expand are measured by them, having none else.
  pure function largest_thermal_forces(mesh, materials, free) result(largest)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    real(wp), intent(in) :: free(:)     !! (n_elements) [-]
    real(wp) :: largest(0:mesh%n_bodies) !! [force]
    integer :: e

    largest = 0.0_wp
    do e = 1, mesh%n_elements
      if (.not. abs(free(e)) > 0.0_wp) cycle
      associate (of_body => largest(mesh%body(mesh%connectivity%node(mesh%connectivity%first(e)))))
        of_body = max(of_body, maxval(norm2(element_thermal_force(mesh, materials, e, free(e)), &
          dim=1)))
      end associate
    end do
  end function largest_thermal_forces

  !> The nodes of an element as its forces are listed; some may be one.
  pure function nodes_of_kernel(mesh, e) result(nodes)
    type(mesh_t), intent(in) :: mesh
    integer, intent(in) :: e
    integer, allocatable :: nodes(:)

    if (has_middles(mesh%connectivity%cell(e))) then
      nodes = nodes_of_element(mesh%connectivity, e)
    else
      nodes = nodes_of_hexahedron(mesh%connectivity, e)
    end if
  end function nodes_of_kernel

  !> The nodal forces of the free strain of an element.
  pure function element_thermal_force(mesh, materials, e, free) result(f)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    integer, intent(in) :: e
    real(wp), intent(in) :: free        !! [-]
    real(wp), allocatable :: f(:, :)    !! (3,n) at nodes_of_kernel [force]
    type(second_order_t) :: element
    real(wp) :: gradient(3, 8, 8), weight(8), stress(3, 3, most_points)
    integer :: g

    associate (elastic => elasticity_at(mesh, materials, e))
      do g = 1, size(elastic)
        associate (six => thermal_stress_of(free, elastic(g)))
          stress(:, :, g) = reshape(six([1, 4, 6, 4, 2, 5, 6, 5, 3]), [3, 3])
        end associate
      end do
      if (size(elastic) == 1) stress = spread(stress(:, :, 1), 3, most_points)
    end associate
    if (has_middles(mesh%connectivity%cell(e))) then
      associate (nodes => nodes_of_element(mesh%connectivity, e))
        call second_order(mesh%connectivity%cell(e), mesh%coordinates(:, nodes), element)
        allocate (f(3, size(nodes)), source=0.0_wp)
        do g = 1, element%n_points
          f = f + matmul(stress(:, :, g), element%weight(g)*element%gradient(:, :size(nodes), g))
        end do
      end associate
      return
    end if
    allocate (f(3, 8), source=0.0_wp)
    call shape_gradients(mesh%coordinates(:, nodes_of_hexahedron(mesh%connectivity, e)), gradient, &
      weight)
    do g = 1, 8
      f = f + matmul(stress(:, :, g), weight(g)*gradient(:, :, g))
    end do
  end function element_thermal_force

  !> The energy of these stresses in elements that cannot expand, 1/2 int tr(stress) alpha dT dV.
  pure real(wp) function thermal_energy(mesh, materials, free) result(energy)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    real(wp), intent(in) :: free(:)      !! (n_elements) [-]
    integer :: e

    energy = 0.0_wp
    do e = 1, mesh%n_elements
      if (.not. abs(free(e)) > 0.0_wp) cycle
      ! However C is turned, I : C : I stays.
      associate (stress => thermal_stress_of(free(e), materials(mesh%material(e))%law%elastic))
        energy = energy + 0.5_wp*sum(stress(:3))*free(e)*element_volume(mesh, e)
      end associate
    end do
  end function thermal_energy

  !> The volume of an element.
  pure real(wp) function element_volume(mesh, e)
    type(mesh_t), intent(in) :: mesh
    integer, intent(in) :: e
    type(second_order_t) :: element

    if (has_middles(mesh%connectivity%cell(e))) then
      call second_order(mesh%connectivity%cell(e), mesh%coordinates(:, &
        nodes_of_element(mesh%connectivity, e)), element)
      element_volume = sum(element%weight(:element%n_points))
    else
      element_volume = volume(mesh%coordinates(:, nodes_of_hexahedron(mesh%connectivity, e)))
    end if
  end function element_volume

end module expansion_mod
