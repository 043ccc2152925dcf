!> Sums over the whole mesh: internal forces, pressures, weight, surface areas.
module mesh_forces_mod
  use kinds_mod, only: wp
  use cells_mod, only: face_nodes, most_nodes, has_middles
  use connectivity_mod, only: all_nodes_of_face, nodes_of_element, nodes_of_hexahedron
  use mesh_mod, only: mesh_t
  use surfaces_mod, only: surface_t
  use scene_mod, only: material_t
  use elasticity_mod, only: constrained_modulus
  use hexahedron8_mod, only: stiffness_length
  use node_products_mod, only: cell_functions_t, find_node_products
  use congruent_forces_mod, only: add_element_forces
  use spring_forces_mod, only: add_spring_forces, add_spring_rounding
  use faces_mod, only: face_area_vectors, face_node_areas
  use second_order_mod, only: stiffness_length_of_second_order => stiffness_length
  implicit none
  private

  public :: internal_force, stiffness_of_elements, force_rounding, pressure_force, gravity_force, &
    add_nodal_areas

contains

  !> f_int = int B^T sigma, summed over the elements, and the forces of the springs.
  pure subroutine internal_force(mesh, materials, u, f)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    real(wp), intent(in)  :: u(:, :)  !! (3,n_nodes) displacement [length]
    real(wp), intent(out) :: f(:, :)  !! (3,n_nodes) [force]

    f = 0.0_wp
    call add_element_forces(mesh, materials, u, f)
    call add_spring_forces(mesh, u, .false., f)
  end subroutine internal_force

  !> The rounding that the internal force of each node carries: what the last bits of the
  !> displacements make of forces, docs/theory.md (6.2).
  !>
  !> A body moved far as a whole has internal forces of this size and no others.
  pure function force_rounding(mesh, stiffness, u) result(rounding)
    type(mesh_t), intent(in) :: mesh
    real(wp), intent(in) :: stiffness(:)   !! (n_elements) as of `stiffness_of_elements`
    real(wp), intent(in) :: u(:, :)        !! (3,n_nodes) displacement [length]
    real(wp) :: rounding(mesh%n_nodes)     !! [force]
    real(wp), parameter :: operations = 32.0_wp ! rounded ones that add up in a nodal force
    integer :: e

    rounding = 0.0_wp
    do e = 1, mesh%n_elements
      associate (nodes => nodes_of_element(mesh%connectivity, e)) ! each once
        rounding(nodes) = rounding(nodes) + operations*epsilon(1.0_wp)*stiffness(e)* &
          maxval(abs(u(:, nodes)))
      end associate
    end do
    call add_spring_rounding(mesh, u, operations, rounding)
  end function force_rounding

  !> The part of each element in the stiffness of its nodes, (lambda + 2 G) int |g_a|^2 dV.
  pure function stiffness_of_elements(mesh, materials) result(stiffness)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    real(wp) :: stiffness(mesh%n_elements) !! [force/length]
    integer :: e

    do e = 1, mesh%n_elements
      stiffness(e) = element_stiffness(mesh, materials, e)
    end do
  end function stiffness_of_elements

  pure real(wp) function element_stiffness(mesh, materials, e)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    integer, intent(in) :: e

    if (has_middles(mesh%connectivity%cell(e))) then
      associate (nodes => nodes_of_element(mesh%connectivity, e), &
                 elastic => materials(mesh%material(e))%law%elastic)
        element_stiffness = constrained_modulus(elastic)*stiffness_length_of_second_order( &
          mesh%connectivity%cell(e), mesh%coordinates(:, nodes))
      end associate
      return
    end if
    element_stiffness = constrained_modulus(materials(mesh%material(e))%law%elastic)* &
      stiffness_length(mesh%coordinates(:, nodes_of_hexahedron(mesh%connectivity, e)))
  end function element_stiffness

  !> Add the nodal forces of a pressure (positive into the body) on a surface of faces, where a
  !> displacement has taken it.
  pure subroutine pressure_force(mesh, surface, pressure, f, u)
    type(mesh_t), intent(in) :: mesh
    type(surface_t), intent(in) :: surface
    real(wp), intent(in) :: pressure       !! [force/length^2]
    real(wp), intent(inout) :: f(:, :)     !! (3,n_nodes) [force]
    real(wp), intent(in), optional :: u(:, :) !! (3,n_nodes) 0 where left out [length]
    real(wp) :: x(3, face_nodes)
    integer :: i, n, nodes(face_nodes)

    do i = 1, size(surface%faces, 2)
      nodes = all_nodes_of_face(mesh%connectivity, surface%faces(1, i), surface%faces(2, i))
      n = count(nodes > 0)
      associate (of_face => nodes(:n))
        x(:, :n) = mesh%coordinates(:, of_face)
        if (present(u)) x(:, :n) = x(:, :n) + u(:, of_face)
        f(:, of_face) = f(:, of_face) - pressure*face_area_vectors(x(:, :n))
      end associate
    end do
  end subroutine pressure_force

  !> Add the nodal forces of the weight of some elements, int N_a density (acceleration +
  !> gradient sum_b N_b x_b) dV.
  pure subroutine gravity_force(mesh, density, elements, acceleration, gradient, x, f, is_radial)
    type(mesh_t), intent(in) :: mesh
    real(wp), intent(in) :: density(:)       !! (n_materials) [mass/length^3]
    integer,  intent(in) :: elements(:)      !! element numbers
    real(wp), intent(in) :: acceleration(3)  !! [length/time^2]
    real(wp), intent(in) :: gradient(3, 3)   !! [1/time^2]
    real(wp), intent(in) :: x(:, :)
    !! (3,n_nodes) places of the nodes, or how far they have moved [length]
    real(wp), intent(inout) :: f(:, :)       !! (3,n_nodes) [force]
    logical, intent(in), optional :: is_radial
    !! the first component of the acceleration is away from the y axis, at each node
    type(cell_functions_t) :: functions
    real(wp) :: products(most_nodes, most_nodes), weight(3), along(3)
    integer :: i, a, n
    logical :: turns

    turns = .false.
    if (present(is_radial)) turns = is_radial
    do i = 1, size(elements)
      associate (e => elements(i), nodes => nodes_of_element(mesh%connectivity, elements(i)))
        n = size(nodes)
        call find_node_products(mesh%connectivity%cell(e), mesh%coordinates(:, nodes), functions, &
          products(:n, :n))
        do a = 1, n
          along = acceleration
          if (turns) along = turned(acceleration, mesh%coordinates(:, &
            nodes(a)) + mesh%origin)
          weight = along*sum(products(:n, a)) + matmul(gradient, matmul(x(:, nodes), &
            products(:n, a)))
          f(:, nodes(a)) = f(:, nodes(a)) + density(mesh%material(e))*weight
        end do
      end associate
    end do

  contains

    !> A vector of the plane of x and y about the y axis.
    pure function turned(vector, place)
      real(wp), intent(in) :: vector(3), place(3)
      real(wp) :: turned(3), radius

      turned = vector
      radius = norm2(place([1, 3]))
      if (radius > 0.0_wp) turned([1, 3]) = vector(1)*place([1, 3])/radius
    end function turned

  end subroutine gravity_force

  !> Add to each node its part of the faces of a surface; nodes that none of them has keep theirs.
  !> Of faces with mid-side nodes the parts of corners are 0 or negative.
  pure subroutine add_nodal_areas(mesh, surface, area)
    type(mesh_t), intent(in) :: mesh
    type(surface_t), intent(in) :: surface
    real(wp), intent(inout) :: area(:)     !! (n_nodes) [length^2]
    integer :: i, nodes(face_nodes)

    do i = 1, size(surface%faces, 2)
      nodes = all_nodes_of_face(mesh%connectivity, surface%faces(1, i), surface%faces(2, i))
      associate (of_face => nodes(:count(nodes > 0)))
        area(of_face) = area(of_face) + face_node_areas(mesh%coordinates(:, of_face))
      end associate
    end do
  end subroutine add_nodal_areas

end module mesh_forces_mod
