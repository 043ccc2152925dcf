!> Internal forces at finite strain by another formula than the solver's: about the deformed places.
!>
!>     x = X + u,   F_u = dx/dX,   tau = P F^T,   f_a = sum of w tau grad_x N_a
!>
!> w are the undeformed volumes of the points. C3D8B: F = (theta/J)^(1/3) F_u, theta the deformed
!> over the undeformed volume, and the mean pressure in the place of that of each point. C3D8I:
!> F = F_u + F_0 M, M of the modes, and N_a's gradient turns in part to that of the centre. Where
!> heat has stretched an element by 1 + c, P is that of F/(1 + c), and w are the expanded volumes.
!> P is that of the law, which the solver asks too: what is wrong in a law is not seen.
!> docs/theory.md (8.26), (8.31), (8.27).
module deformed_forces_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: determinant, inverse
  use cells_mod, only: has_middles
  use connectivity_mod, only: nodes_of_element, nodes_of_hexahedron
  use second_order_forces_mod, only: deformed_forces_of_second_order, areas_of_second_order
  use mesh_mod, only: mesh_t, kind_c3d8i, kind_c3d8b
  use scene_mod, only: material_t
  use element_laws_mod, only: law_at
  use state_mod, only: state_t
  use elasticity_mod, only: thermal_stress_of
  use strain_measures_mod, only: deformation_of, growth_of
  use material_law_mod, only: law_t, finite_stress
  use increment_forces_mod, only: increment_forces_t
  implicit none
  private

  public :: find_deformed_forces

  real(wp), parameter :: gauss = 1.0_wp/sqrt(3.0_wp) !! coordinate of the points, of weight 1
  real(wp), parameter :: corner(3, 8) = real(reshape([-1, -1, -1, 1, -1, -1, 1, 1, -1, -1, 1, -1, &
    -1, -1, 1, 1, -1, 1, 1, 1, 1, -1, 1, 1], [3, 8]), wp)

  !> An element at its Gauss points; places and displacements from the first node.
  type :: deformed_t
    real(wp) :: growth           !! c, of its edges by heat [-]
    real(wp) :: volume(8)        !! freely expanded, that a point stands for [length^3]
    real(wp) :: h(3, 3, 8)       !! F_u/(1 + c) - I by the nodes [-]
    real(wp) :: spatial(3, 8, 8) !! grad_x N_a: component, node, point [1/length]
  end type deformed_t

contains

  !> Internal forces and the largest of an element of each body, in the place of those of small
  !> strain, whose stiffness and rounding stay; and what is left of the forces of C3D8I's modes.
  pure subroutine find_deformed_forces(mesh, materials, rise, state, forces)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    real(wp), intent(in) :: rise(:)        !! (n_nodes) of temperatures, or (0): none [temperature]
    type(state_t), intent(in) :: state     !! its displacement and modes, J > 0
    type(increment_forces_t), intent(inout) :: forces
    real(wp), dimension(3, 8) :: place, moved, of_element
    type(deformed_t) :: deformed
    real(wp) :: of_modes(3, 3), c
    real(wp) :: local(3, 8, 8) !! dN_a/dxi at the points [-]
    integer :: e, a, nodes(8)

    do a = 1, 8
      local(:, :, a) = local_gradients(gauss*corner(:, a))
    end do
    forces%is_finite = .true.
    forces%internal = 0.0_wp
    forces%of_elements%largest = 0.0_wp
    if (allocated(forces%of_elements%on_modes)) deallocate (forces%of_elements%on_modes)
    allocate (forces%of_elements%on_modes(0:mesh%n_bodies), source=0.0_wp)
    do e = 1, mesh%n_elements
      nodes = nodes_of_hexahedron(mesh%connectivity, e)
      ! From the first node: elements far from the origin, or that have moved far, lose no digits.
      place = mesh%coordinates(:, nodes) - spread(mesh%coordinates(:, nodes(1)), 2, 8)
      moved = state%displacement(:, nodes) - spread(state%displacement(:, nodes(1)), 2, 8)
      c = 0.0_wp
      if (size(rise) > 0) then
        associate (each => nodes_of_element(mesh%connectivity, e))
          c = materials(mesh%material(e))%expansion*sum(rise(each))/real(size(each), wp)
        end associate
      end if
      if (has_middles(mesh%connectivity%cell(e))) then
        call add_second_order(mesh, materials, state, e, c, forces)
        cycle
      end if
      deformed = deform(place, moved, c, local)
      of_modes = 0.0_wp
      associate (law => law_at(mesh, materials, e))
        select case (mesh%element_kind(e))
        case (kind_c3d8i)
          call find_forces_with_modes(place, moved, deformed, state%modes%amplitude(:, :, e), law, &
            of_element, of_modes)
        case (kind_c3d8b)
          of_element = forces_of_mean(place, moved, deformed, law)
        case default
          of_element = forces_of_points(deformed, law)
        end select
      end associate
      do a = 1, 8
        forces%internal(:, nodes(a)) = forces%internal(:, nodes(a)) + of_element(:, a)
      end do
      associate (sums => forces%of_elements, body => mesh%body(nodes(1)))
        ! What would hold a warmer element in its shape is a measure where nothing else acts.
        sums%largest(body) = max(sums%largest(body), maxval(norm2(of_element, dim=1)), &
          maxval(abs(thermal_stress_of(c, materials(mesh%material(e))%law%elastic)))* &
          maxval(norm2(areas_of(place), dim=1)))
        sums%on_modes(body) = max(sums%on_modes(body), maxval(norm2(of_modes, dim=1)) - &
          maxval(forces%rounding(nodes)))
      end associate
    end do
  end subroutine find_deformed_forces

  !> The same of an element of second order.
  pure subroutine add_second_order(mesh, materials, state, e, c, forces)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    type(state_t), intent(in) :: state
    integer, intent(in) :: e
    real(wp), intent(in) :: c        !! as of deformed_t [-]
    type(increment_forces_t), intent(inout) :: forces

    associate (nodes => nodes_of_element(mesh%connectivity, e), cell => mesh%connectivity%cell(e), &
               law => law_at(mesh, materials, e))
      associate (f => deformed_forces_of_second_order(cell, mesh%coordinates(:, nodes), &
                 state%displacement(:, nodes), c, law), &
                 largest => forces%of_elements%largest(mesh%body(nodes(1))))
        forces%internal(:, nodes) = forces%internal(:, nodes) + f
        largest = max(largest, maxval(norm2(f, dim=1)), maxval(abs(thermal_stress_of(c, &
          law%elastic)))* &
          maxval(norm2(areas_of_second_order(cell, mesh%coordinates(:, nodes)), dim=1)))
      end associate
    end associate
  end subroutine add_second_order

  !> dN_a/dxi at a point.
  pure function local_gradients(point) result(local)
    real(wp), intent(in) :: point(3) !! xi, eta, zeta [-]
    real(wp) :: local(3, 8)          !! [-]
    integer :: i, a

    do a = 1, 8
      do i = 1, 3
        local(i, a) = 0.125_wp*corner(i, a)*product(1.0_wp + point*corner(:, a), &
          mask=[1, 2, 3] /= i)
      end do
    end do
  end function local_gradients

  !> dx/dX/(1 + c) - I at a point.
  pure function gradient_at(place, moved, local, c) result(h)
    real(wp), intent(in) :: place(3, 8), moved(3, 8) !! as of find_deformed_forces [length]
    real(wp), intent(in) :: local(3, 8)              !! dN_a/dxi there [-]
    real(wp), intent(in) :: c                        !! as of deformed_t [-]
    real(wp) :: h(3, 3)                              !! [-]
    integer :: i

    h = matmul(matmul(moved, transpose(local)), inverse(matmul(place, transpose(local))))
    do i = 1, 3
      h(i, i) = h(i, i) - c
    end do
    h = h/(1.0_wp + c)
  end function gradient_at

  !> grad_x N_a at a point, by the deformed places.
  pure function spatial_at(place, moved, local) result(spatial)
    real(wp), intent(in) :: place(3, 8), moved(3, 8) !! as of find_deformed_forces [length]
    real(wp), intent(in) :: local(3, 8)              !! dN_a/dxi there [-]
    real(wp) :: spatial(3, 8)                        !! [1/length]

    spatial = matmul(transpose(inverse(matmul(place + moved, transpose(local)))), local)
  end function spatial_at

  !> int grad_X N_a dV: the area that a stress acts on at a node.
  pure function areas_of(place) result(area)
    real(wp), intent(in) :: place(3, 8) !! [length]
    real(wp) :: area(3, 8)              !! [length^2]
    real(wp) :: by_xi(3, 3)
    integer :: g

    area = 0.0_wp
    do g = 1, 8
      associate (local => local_gradients(gauss*corner(:, g)))
        by_xi = matmul(place, transpose(local))
        area = area + determinant(by_xi)*matmul(transpose(inverse(by_xi)), local)
      end associate
    end do
  end function areas_of

  pure type(deformed_t) function deform(place, moved, c, local) result(deformed)
    real(wp), intent(in) :: place(3, 8), moved(3, 8) !! as of find_deformed_forces [length]
    real(wp), intent(in) :: c                        !! as of deformed_t [-]
    real(wp), intent(in) :: local(3, 8, 8)           !! dN_a/dxi at the points [-]
    integer :: g

    deformed%growth = c
    do g = 1, 8
      deformed%volume(g) = (1.0_wp + c)**3*determinant(matmul(place, transpose(local(:, :, g))))
      deformed%h(:, :, g) = gradient_at(place, moved, local(:, :, g), c)
      deformed%spatial(:, :, g) = spatial_at(place, moved, local(:, :, g))
    end do
  end function deform

  !> Kirchhoff's stress of a displacement gradient.
  pure function kirchhoff(law, h) result(tau)
    type(law_t), intent(in) :: law
    real(wp), intent(in) :: h(3, 3) !! [-]
    real(wp) :: tau(3, 3)           !! [force/length^2]

    tau = matmul(finite_stress(law, h), transpose(deformation_of(h)))
  end function kirchhoff

  !> C3D8.
  pure function forces_of_points(deformed, law) result(f)
    type(deformed_t), intent(in) :: deformed
    type(law_t), intent(in) :: law
    real(wp) :: f(3, 8) !! [force]
    integer :: g

    f = 0.0_wp
    do g = 1, 8
      f = f + deformed%volume(g)*matmul(kirchhoff(law, deformed%h(:, :, g)), &
        deformed%spatial(:, :, g))
    end do
  end function forces_of_points

  !> C3D8B: what deviates of the stress of F_b, with J times the mean of the Cauchy pressure.
  pure function forces_of_mean(place, moved, deformed, law) result(f)
    real(wp), intent(in) :: place(3, 8), moved(3, 8) !! as of find_deformed_forces [length]
    type(deformed_t), intent(in) :: deformed
    type(law_t), intent(in) :: law
    real(wp) :: f(3, 8) !! [force]
    real(wp) :: swept(8), h(3, 3), tau(3, 3, 8), mean, b, growth, third, pressure
    integer :: g, i

    mean = 0.0_wp
    do g = 1, 8
      swept(g) = determinant(matmul(place + moved, transpose(local_gradients(gauss*corner(:, g)))))
      ! Of J - 1: so small strains lose no digits.
      mean = mean + deformed%volume(g)*growth_of(deformed%h(:, :, g))/sum(deformed%volume)
    end do
    pressure = 0.0_wp
    do g = 1, 8
      growth = growth_of(deformed%h(:, :, g))
      b = (sum(swept)*deformed%volume(g)/(sum(deformed%volume)*swept(g)))**(1.0_wp/3.0_wp)
      h = b*deformed%h(:, :, g)
      do i = 1, 3
        h(i, i) = h(i, i) + (mean - growth)/(1.0_wp + growth)/(b**2 + b + 1.0_wp)
      end do
      tau(:, :, g) = kirchhoff(law, h)
      third = (tau(1, 1, g) + tau(2, 2, g) + tau(3, 3, g))/3.0_wp
      pressure = pressure + deformed%volume(g)*third/sum(swept)
      do i = 1, 3
        tau(i, i, g) = tau(i, i, g) - third
      end do
    end do
    f = 0.0_wp
    do g = 1, 8
      f = f + deformed%volume(g)*matmul(tau(:, :, g), deformed%spatial(:, :, g)) + &
        swept(g)*pressure*deformed%spatial(:, :, g)
    end do
  end function forces_of_mean

  !> C3D8I: with T = F_0 M F^-1 and the gradients c_a of the centre,
  !> f_a = sum of w tau (grad_x N_a + T^T (c_a - grad_x N_a)), and on beta_k F^-1 tau F_0 m_k.
  pure subroutine find_forces_with_modes(place, moved, deformed, beta, law, f, on_modes)
    real(wp), intent(in) :: place(3, 8), moved(3, 8) !! as of find_deformed_forces [length]
    type(deformed_t), intent(in) :: deformed
    real(wp), intent(in) :: beta(3, 3)               !! component, mode [length]
    type(law_t), intent(in) :: law
    real(wp), intent(out) :: f(3, 8), on_modes(3, 3) !! [force]
    real(wp), dimension(3, 3) :: by_xi, back, f_0, mode, part, h, tau, turned
    real(wp) :: centre(3, 8), local(3, 8)
    integer :: g, k

    local = local_gradients([0.0_wp, 0.0_wp, 0.0_wp])
    by_xi = (1.0_wp + deformed%growth)*matmul(place, transpose(local))
    back = transpose(inverse(by_xi))
    centre = spatial_at(place, moved, local)
    f_0 = deformation_of(gradient_at(place, moved, local, deformed%growth))
    f = 0.0_wp
    on_modes = 0.0_wp
    do g = 1, 8
      ! F_0 m_k = (j_0/j) F_0 J_0^-T d(1 - xi_k^2)/dxi
      do k = 1, 3
        mode(:, k) = determinant(by_xi)/deformed%volume(g)*(-2.0_wp*gauss*corner(k, g))* &
          matmul(f_0, back(:, k))
      end do
      part = matmul(mode, transpose(beta))
      h = deformed%h(:, :, g) + part
      tau = kirchhoff(law, h)
      turned = matmul(part, inverse(deformation_of(h)))
      associate (spatial => deformed%spatial(:, :, g), w => deformed%volume(g))
        f = f + w*matmul(tau, spatial + matmul(transpose(turned), centre - spatial))
        on_modes = on_modes + w*matmul(matmul(inverse(deformation_of(h)), tau), mode)
      end associate
    end do
  end subroutine find_forces_with_modes

end module deformed_forces_mod
