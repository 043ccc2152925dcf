!> The internal forces of the certificate in elements with mid-side nodes, from their stresses.
!>
!> As in stress_forces, with b_j the cofactors of the Jacobian (columns a_j = dx/dxi_j,
!> j = a_1 . b_1), du/dx = sum over j of (du/dxi_j) b_j^T / j, and a node's force is the sum over
!> the points of weight sigma b_j dN_a/dxi_j. Places and displacements are counted from the middle
!> of the element's corners. At finite strain a_j and b_j are those of the deformed element, and the
!> stress is Kirchhoff's over the undeformed volume, (8.26). docs/theory.md, sections 6 and 8.
module second_order_forces_mod
  use kinds_mod, only: wp
  use cells_mod, only: cells
  use cell_shapes_mod, only: shape_functions, shape_gradients_at
  use connectivity_mod, only: nodes_of_element
  use mesh_mod, only: mesh_t
  use scene_mod, only: material_t
  use small_matrix_mod, only: cross
  use strain_measures_mod, only: deformation_of
  use material_law_mod, only: law_t, finite_stress
  use anisotropic_stress_mod, only: contract, elasticity_tensor, goes_around, middle_of
  use increment_forces_mod, only: increment_forces_t
  implicit none
  private

  public :: add_second_order_forces, deformed_forces_of_second_order, areas_of_second_order

contains

  !> Add the forces, their rounding and the sums of element `e`, of displacements `u`.
  pure subroutine add_second_order_forces(mesh, materials, u, moved, e, forces)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    real(wp), intent(in) :: u(:, :)   !! (3,n_nodes) [length]
    real(wp), intent(in) :: moved(:)  !! (n_nodes) how far nodes are displaced [length]
    integer, intent(in) :: e
    type(increment_forces_t), intent(inout) :: forces
    real(wp), parameter :: operations = 64.0_wp ! rounded ones that add up in a nodal force
    real(wp), allocatable :: x(:, :), v(:, :), slope(:, :), f(:, :)
    real(wp) :: a(3, 3), b(3, 3), along(3, 3), h(3, 3), stress(3, 3), volume, energy, stiffness
    real(wp) :: c(3, 3, 3, 3), modulus
    integer :: g, i, n, body

    associate (cell => cells(mesh%connectivity%cell(e)), nodes => nodes_of_element( &
               mesh%connectivity, e), elastic => materials(mesh%material(e))%law%elastic)
      n = cell%n_nodes
      if (elastic%is_isotropic) then
        modulus = abs(elastic%lambda) + 2.0_wp*elastic%shear
        c = 0.0_wp
      else
        c = elasticity_tensor(mesh, materials(mesh%material(e)), e, middle_of(mesh, e))
        modulus = maxval(abs(c))
      end if
      allocate (x, source=from_middle(mesh%coordinates(:, nodes), cell%n_corners))
      allocate (v, source=from_middle(u(:, nodes), cell%n_corners))
      allocate (slope(3, n), f(3, n), source=0.0_wp)
      energy = 0.0_wp
      stiffness = 0.0_wp
      do g = 1, cell%n_points
        slope = shape_gradients_at(cell, cell%point(:, g))
        a = matmul(x, transpose(slope))
        along = matmul(v, transpose(slope))
        b = cofactors(a)
        volume = dot_product(a(:, 1), b(:, 1))
        h = matmul(along, transpose(b))/volume
        if (elastic%is_isotropic) then
          stress = elastic%shear*(h + transpose(h))
          do i = 1, 3
            stress(i, i) = stress(i, i) + elastic%lambda*(h(1, 1) + h(2, 2) + h(3, 3))
          end do
        else
          if (goes_around(mesh, materials(mesh%material(e)))) c = elasticity_tensor(mesh, &
            materials(mesh%material(e)), e, matmul(mesh%coordinates(:, nodes), &
            shape_functions(cell, cell%point(:, g))))
          stress = contract(c, h)
        end if
        energy = energy + 0.5_wp*cell%weight(g)*volume*sum(stress*h)
        f = f + cell%weight(g)*matmul(stress, matmul(b, slope))
        stiffness = stiffness + cell%weight(g)*sum(matmul(b, slope)**2)/volume
      end do
      ! The mean over the nodes of what each has by itself.
      stiffness = modulus*stiffness/real(n, wp)
      forces%internal(:, nodes) = forces%internal(:, nodes) + f
      forces%stiffness(nodes) = forces%stiffness(nodes) + stiffness
      forces%rounding(nodes) = forces%rounding(nodes) + operations*epsilon(1.0_wp)*stiffness* &
        maxval(moved(nodes))
      body = mesh%body(nodes(1))
    end associate
    associate (of => forces%of_elements)
      of%largest(body) = max(of%largest(body), maxval(norm2(f, dim=1)))
      of%energy(body) = of%energy(body) + energy
    end associate
  end subroutine add_second_order_forces

  !> Vectors at the nodes less their mean over the corners.
  pure function from_middle(v, n_corners) result(from)
    real(wp), intent(in) :: v(:, :)    !! (3,n_nodes) [length]
    integer, intent(in) :: n_corners
    real(wp) :: from(3, size(v, 2))

    from = v - spread(sum(v(:, :n_corners), dim=2)/real(n_corners, wp), 2, size(v, 2))
  end function from_middle

  !> The internal forces of an element at finite strain, by its deformed places: (8.26), where heat
  !> has stretched its edges by 1 + c with P of F/(1 + c) and expanded volumes.
  pure function deformed_forces_of_second_order(cell, x, u, c, law) result(f)
    integer, intent(in) :: cell               !! row of the table of cells
    real(wp), intent(in) :: x(:, :), u(:, :)  !! (3,n_nodes) nodes, their displacements [length]
    real(wp), intent(in) :: c                 !! [-]
    type(law_t), intent(in) :: law
    real(wp) :: f(3, size(x, 2))              !! [force]
    real(wp), dimension(3, size(x, 2)) :: place, moved, slope
    real(wp), dimension(3, 3) :: a, b, h, tau
    real(wp) :: volume
    integer :: g, i

    place = from_middle(x, cells(cell)%n_corners)
    moved = from_middle(u, cells(cell)%n_corners)
    f = 0.0_wp
    do g = 1, cells(cell)%n_points
      slope = shape_gradients_at(cells(cell), cells(cell)%point(:, g))
      a = matmul(place, transpose(slope))
      b = cofactors(a)
      volume = dot_product(a(:, 1), b(:, 1))
      h = matmul(matmul(moved, transpose(slope)), transpose(b))/volume
      do i = 1, 3
        h(i, i) = h(i, i) - c
      end do
      h = h/(1.0_wp + c)
      tau = matmul(finite_stress(law, h), transpose(deformation_of(h)))
      a = matmul(place + moved, transpose(slope))
      b = cofactors(a)
      f = f + cells(cell)%weight(g)*(1.0_wp + c)**3*volume/dot_product(a(:, 1), b(:, 1))* &
        matmul(tau, matmul(b, slope))
    end do
  end function deformed_forces_of_second_order

  !> int grad_X N_a dV: the area that a stress acts on at a node.
  pure function areas_of_second_order(cell, x) result(area)
    integer, intent(in) :: cell      !! row of the table of cells
    real(wp), intent(in) :: x(:, :)  !! (3,n_nodes) [length]
    real(wp) :: area(3, size(x, 2))  !! [length^2]
    real(wp) :: place(3, size(x, 2)), slope(3, size(x, 2))
    integer :: g

    place = from_middle(x, cells(cell)%n_corners)
    area = 0.0_wp
    do g = 1, cells(cell)%n_points
      slope = shape_gradients_at(cells(cell), cells(cell)%point(:, g))
      area = area + cells(cell)%weight(g)*matmul(cofactors(matmul(place, transpose(slope))), slope)
    end do
  end function areas_of_second_order

  !> b_j of a_j, columns.
  pure function cofactors(a) result(b)
    real(wp), intent(in) :: a(3, 3)
    real(wp) :: b(3, 3)

    b(:, 1) = cross(a(:, 2), a(:, 3))
    b(:, 2) = cross(a(:, 3), a(:, 1))
    b(:, 3) = cross(a(:, 1), a(:, 2))
  end function cofactors

end module second_order_forces_mod
