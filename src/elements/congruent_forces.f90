!> Internal forces of elements, many congruent ones at once.
!>
!> What an element's stresses do is linear in its displacements: of elements that are met often the
!> forces of unit displacements are found once, from stresses, and applied to many of them together.
!> These displacements are trilinear: 1, xi, eta, zeta and their products. Without the first, and
!> with the factors of the others from what displacements change by along the edges, bodies that
!> have moved far as a whole lose no digits, nor do long thin elements that turn.
module congruent_forces_mod
  use kinds_mod, only: wp
  use cells_mod, only: has_middles
  use connectivity_mod, only: nodes_of_element, nodes_of_hexahedron
  use mesh_mod, only: mesh_t, deck_rounding
  use scene_mod, only: material_t
  use element_laws_mod, only: elasticity_at, varies
  use elasticity_mod, only: elasticity_t
  use hexahedron8_mod, only: along_edges, xi_node, eta_node, zeta_node
  use elements_mod, only: nodal_force
  use second_order_mod, only: force_of_second_order => nodal_force
  implicit none
  private

  public :: add_element_forces

  integer,  parameter :: n_remembered = 64        !! shapes: a row of a graded block has no more
  integer,  parameter :: often = 32               !! elements of a shape from which on it pays
  integer,  parameter :: together = 32            !! elements
  integer,  parameter :: n_factors = 21           !! of the seven trilinear displacements
  real(wp), parameter :: negligible = 1.0e-13_wp  !! of an element, in its shape [-]

  !> A shape, kind and material of elements.
  type :: shape_t
    integer :: kind = 0, material = 0
    type(elasticity_t) :: elastic(1)              !! of the material [force/length^2]
    integer :: n_met = 0                          !! elements so far
    integer :: n_waiting = 0                      !! of them, for their forces
    real(wp) :: corners(3, 8) = 0.0_wp            !! less the first [length]
    real(wp) :: force(24, n_factors) = 0.0_wp     !! of unit displacements [force/length]
    integer :: nodes(8, together) = 0             !! of those that wait
    real(wp) :: u(n_factors, together) = 0.0_wp   !! the factors of their displacements [length]
  end type shape_t

contains

  !> Add int B^T sigma of every element.
  pure subroutine add_element_forces(mesh, materials, u, f)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    real(wp), intent(in) :: u(:, :)      !! (3,n_nodes) displacement [length]
    real(wp), intent(inout) :: f(:, :)   !! (3,n_nodes) [force]
    type(shape_t), allocatable :: shapes(:)
    real(wp) :: x(3, 8), force(3, 8), rounding
    integer :: e, i, n, next, nodes(8)

    allocate (shapes(n_remembered))
    rounding = 4.0_wp*deck_rounding(mesh%coordinates, mesh%origin)
    n = 0
    next = 1
    do e = 1, mesh%n_elements
      if (has_middles(mesh%connectivity%cell(e))) then
        associate (all_nodes => nodes_of_element(mesh%connectivity, e))
          f(:, all_nodes) = f(:, all_nodes) + force_of_second_order(mesh%connectivity%cell(e), &
            mesh%coordinates(:, all_nodes), u(:, all_nodes), &
            elasticity_at(mesh, materials, e))
        end associate
        cycle
      end if
      nodes = nodes_of_hexahedron(mesh%connectivity, e)
      x = mesh%coordinates(:, nodes)
      if (varies(mesh, materials(mesh%material(e)))) then
        force = nodal_force(mesh%element_kind(e), x, u(:, nodes), elasticity_at(mesh, materials, e))
        call add_at_nodes(nodes, force, f)
        cycle
      end if
      i = place_of(shapes(:n), mesh%element_kind(e), mesh%material(e), x, rounding)
      if (i == 0) then
        i = next
        next = mod(i, n_remembered) + 1
        n = max(n, i)
        call finish(shapes(i), f)
        shapes(i)%kind = mesh%element_kind(e)
        shapes(i)%material = mesh%material(e)
        shapes(i)%elastic = elasticity_at(mesh, materials, e)
        shapes(i)%n_met = 0
        shapes(i)%corners = x - spread(x(:, 1), 2, 8)
      end if
      associate (shape => shapes(i))
        shape%n_met = shape%n_met + 1
        if (shape%n_met < often) then
          force = nodal_force(shape%kind, x, u(:, nodes), shape%elastic)
          call add_at_nodes(nodes, force, f)
          cycle
        end if
        if (shape%n_met == often) call find_forces(x, shape)
        shape%n_waiting = shape%n_waiting + 1
        shape%nodes(:, shape%n_waiting) = nodes
        shape%u(:, shape%n_waiting) = factors_of(u(:, nodes))
        if (shape%n_waiting == together) call finish(shape, f)
      end associate
    end do
    do i = 1, n
      call finish(shapes(i), f)
    end do
  end subroutine add_element_forces

  !> Which of the shapes an element has, as far as the rounding of coordinates tells; 0: none.
  pure integer function place_of(shapes, kind, material, x, rounding)
    type(shape_t), intent(in) :: shapes(:)
    integer, intent(in) :: kind, material
    real(wp), intent(in) :: x(3, 8)    !! [length]
    real(wp), intent(in) :: rounding   !! of the largest coordinate of the mesh [length]
    real(wp) :: corners(3, 8), allowed
    integer :: i

    corners = x - spread(x(:, 1), 2, 8)
    ! Elements near the origin carry the rounding of edges far away; not so much that it is felt.
    allowed = max(4.0_wp*epsilon(1.0_wp)*maxval(abs(x)), &
      min(rounding, negligible*maxval(abs(corners))))
    place_of = 0
    do i = 1, size(shapes)
      if (abs(shapes(i)%corners(1, 7) - corners(1, 7)) > allowed) cycle
      if (shapes(i)%kind /= kind .or. shapes(i)%material /= material) cycle
      if (any(abs(shapes(i)%corners - corners) > allowed)) cycle
      place_of = i
      return
    end do
  end function place_of

  !> Forces of the trilinear displacements, from the stresses that these cause.
  pure subroutine find_forces(x, shape)
    real(wp), intent(in) :: x(3, 8)        !! [length]
    type(shape_t), intent(inout) :: shape  !! gets its forces
    real(wp) :: unit(3, 8), trilinear(8, n_factors/3)
    integer :: k, i

    trilinear(:, 1) = xi_node
    trilinear(:, 2) = eta_node
    trilinear(:, 3) = zeta_node
    trilinear(:, 4) = xi_node*eta_node
    trilinear(:, 5) = eta_node*zeta_node
    trilinear(:, 6) = xi_node*zeta_node
    trilinear(:, 7) = xi_node*eta_node*zeta_node
    do k = 1, n_factors/3
      do i = 1, 3
        unit = 0.0_wp
        unit(i, :) = trilinear(:, k)
        shape%force(:, 3*k - 3 + i) = reshape(nodal_force(shape%kind, x, unit, &
          shape%elastic), [24])
      end do
    end do
  end subroutine find_forces

  !> The factors of xi, eta, zeta, xi eta, eta zeta, xi zeta, xi eta zeta in the displacements of a
  !> element, in this order.
  pure function factors_of(u) result(factors)
    real(wp), intent(in) :: u(3, 8)           !! [length]
    real(wp) :: factors(n_factors)            !! [length]
    real(wp) :: along(3, 4, 3)

    along = along_edges(u)
    associate (xi => along(:, :, 1), eta => along(:, :, 2), zeta => along(:, :, 3))
      factors(1:3) = (xi(:, 1) + xi(:, 2)) + (xi(:, 3) + xi(:, 4))
      factors(4:6) = (eta(:, 1) + eta(:, 2)) + (eta(:, 3) + eta(:, 4))
      factors(7:9) = (zeta(:, 1) + zeta(:, 2)) + (zeta(:, 3) + zeta(:, 4))
      factors(10:12) = (xi(:, 2) - xi(:, 1)) + (xi(:, 4) - xi(:, 3))
      factors(13:15) = (eta(:, 3) - eta(:, 1)) + (eta(:, 4) - eta(:, 2))
      factors(16:18) = (xi(:, 3) - xi(:, 1)) + (xi(:, 4) - xi(:, 2))
      factors(19:21) = (xi(:, 4) - xi(:, 3)) - (xi(:, 2) - xi(:, 1))
    end associate
    factors = 0.125_wp*factors
  end function factors_of

  !> Add the forces of the elements that wait.
  pure subroutine finish(shape, f)
    type(shape_t), intent(inout) :: shape
    real(wp), intent(inout) :: f(:, :)   !! (3,n_nodes) [force]
    real(wp) :: force(24, together)
    integer :: k

    if (shape%n_waiting == 0) return
    force(:, :shape%n_waiting) = matmul(shape%force, shape%u(:, :shape%n_waiting))
    do k = 1, shape%n_waiting
      associate (nodes => shape%nodes(:, k))
        call add_at_nodes(nodes, reshape(force(:, k), [3, 8]), f)
      end associate
    end do
    shape%n_waiting = 0
  end subroutine finish

  !> Add forces to those of the nodes, some of which may be one.
  pure subroutine add_at_nodes(nodes, force, f)
    integer, intent(in) :: nodes(8)
    real(wp), intent(in) :: force(3, 8) !! [force]
    real(wp), intent(inout) :: f(:, :)  !! (3,n_nodes) [force]
    integer :: a

    do a = 1, 8
      f(:, nodes(a)) = f(:, nodes(a)) + force(:, a)
    end do
  end subroutine add_at_nodes

end module congruent_forces_mod
