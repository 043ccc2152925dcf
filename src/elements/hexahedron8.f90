!> The 8-node brick C3D8: trilinear shape functions, 2x2x2 Gauss points, small strain.
!>
!>        8-------7        zeta
!>       /|      /|         |  eta
!>      5-------6 |         | /
!>      | 4-----|-3         |/
!>      |/      |/          +---- xi
!>      1-------2        node 1 at (-1,-1,-1), node 7 at (1,1,1)
!>
!> Stresses and strains are ordered XX YY ZZ XY YZ XZ; shear strains enter as tensor components.
module hexahedron8_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: determinant, inverse
  implicit none
  private

  public :: stiffness, nodal_force, mean_stress, volume, jacobian_determinants, lame_constants

  real(wp), parameter :: xi_node(8) = [-1, 1, 1, -1, -1, 1, 1, -1]
  real(wp), parameter :: eta_node(8) = [-1, -1, 1, 1, -1, -1, 1, 1]
  real(wp), parameter :: zeta_node(8) = [-1, -1, -1, -1, 1, 1, 1, 1]
  real(wp), parameter :: gauss = 1.0_wp/sqrt(3.0_wp) !! coordinate of the Gauss points, weight 1

contains

  !> Lame's constants lambda and G of an isotropic material.
  pure subroutine lame_constants(young, poisson, lambda, shear)
    real(wp), intent(in)  :: young    !! E > 0 [force/length^2]
    real(wp), intent(in)  :: poisson  !! -1 < nu < 0.5 [-]
    real(wp), intent(out) :: lambda   !! [force/length^2]
    real(wp), intent(out) :: shear    !! G [force/length^2]

    lambda = young*poisson/((1.0_wp + poisson)*(1.0_wp - 2.0_wp*poisson))
    shear = young/(2.0_wp*(1.0_wp + poisson))
  end subroutine lame_constants

  !> Gradients of the shape functions at Gauss point `g`, and the volume it stands for.
  pure subroutine shape_gradients(x, g, gradient, weight)
    real(wp), intent(in)  :: x(3, 8)        !! nodes [length]
    integer,  intent(in)  :: g              !! Gauss point 1..8, placed like the nodes
    real(wp), intent(out) :: gradient(3, 8) !! dN_a/dx_i [1/length]
    real(wp), intent(out) :: weight         !! Jacobian's determinant [length^3]
    real(wp) :: d(3, 8), jacobian(3, 3)

    call local_gradients(g, d)
    jacobian = matmul(x, transpose(d))       ! dx_i/dxi_j
    weight = determinant(jacobian)
    gradient = matmul(transpose(inverse(jacobian)), d)
  end subroutine shape_gradients

  !> dN_a/dxi_j at Gauss point `g`.
  pure subroutine local_gradients(g, d)
    integer,  intent(in)  :: g
    real(wp), intent(out) :: d(3, 8)
    real(wp) :: a(8), b(8), c(8)

    a = 1.0_wp + gauss*xi_node(g)*xi_node
    b = 1.0_wp + gauss*eta_node(g)*eta_node
    c = 1.0_wp + gauss*zeta_node(g)*zeta_node
    d(1, :) = 0.125_wp*xi_node*b*c
    d(2, :) = 0.125_wp*a*eta_node*c
    d(3, :) = 0.125_wp*a*b*zeta_node
  end subroutine local_gradients

  !> The Jacobian's determinant at the eight Gauss points and the eight nodes; all positive in a
  !> usable brick.
  pure function jacobian_determinants(x) result(d)
    real(wp), intent(in) :: x(3, 8) !! nodes [length]
    real(wp) :: d(16)               !! [length^3/8]
    real(wp) :: local(3, 8), a(8), b(8), c(8)
    integer :: g

    do g = 1, 8
      call local_gradients(g, local)
      d(g) = determinant(matmul(x, transpose(local)))
      a = 1.0_wp + xi_node(g)*xi_node
      b = 1.0_wp + eta_node(g)*eta_node
      c = 1.0_wp + zeta_node(g)*zeta_node
      local(1, :) = 0.125_wp*xi_node*b*c
      local(2, :) = 0.125_wp*a*eta_node*c
      local(3, :) = 0.125_wp*a*b*zeta_node
      d(8 + g) = determinant(matmul(x, transpose(local)))
    end do
  end function jacobian_determinants

  !> Volume of the brick.
  pure function volume(x) result(v)
    real(wp), intent(in) :: x(3, 8) !! nodes [length]
    real(wp) :: v                   !! [length^3]
    real(wp) :: d(16)

    d = jacobian_determinants(x)
    v = sum(d(:8))
  end function volume

  !> Stiffness of the brick, K_ab = int lambda g_a g_b^T + G (g_b g_a^T + g_a.g_b I).
  pure function stiffness(x, lambda, shear) result(k)
    real(wp), intent(in) :: x(3, 8)       !! nodes [length]
    real(wp), intent(in) :: lambda, shear !! Lame's constants [force/length^2]
    real(wp) :: k(24, 24)                 !! node by node, x y z [force/length]
    real(wp) :: gradient(3, 8), scaled(3, 8), moment(24, 24), block(3, 3), weight, trace
    integer :: g, a, b, i, j

    ! All products g_a g_b^T summed over the points first: the material enters once a pair of nodes.
    moment = 0.0_wp
    do g = 1, 8
      call shape_gradients(x, g, gradient, weight)
      scaled = weight*gradient
      do b = 1, 8
        do j = 1, 3
          do a = 1, b
            do i = 1, 3
              moment(3*a - 3 + i, 3*b - 3 + j) = moment(3*a - 3 + i, 3*b - 3 + j) + &
                gradient(i, a)*scaled(j, b)
            end do
          end do
        end do
      end do
    end do
    do b = 1, 8
      do a = 1, b
        block = moment(3*a - 2:3*a, 3*b - 2:3*b)
        trace = shear*(block(1, 1) + block(2, 2) + block(3, 3))
        block = lambda*block + shear*transpose(block)
        do i = 1, 3
          block(i, i) = block(i, i) + trace
        end do
        k(3*a - 2:3*a, 3*b - 2:3*b) = block
        k(3*b - 2:3*b, 3*a - 2:3*a) = transpose(block)
      end do
    end do
  end function stiffness

  !> Internal force of the brick, f_a = int sigma g_a, from the displacements themselves (no
  !> stiffness matrix).
  pure function nodal_force(x, u, lambda, shear) result(f)
    real(wp), intent(in) :: x(3, 8), u(3, 8) !! nodes and their displacements [length]
    real(wp), intent(in) :: lambda, shear    !! Lame's constants [force/length^2]
    real(wp) :: f(3, 8)                      !! [force]
    real(wp) :: gradient(3, 8), sigma(3, 3), weight
    integer :: g, a

    f = 0.0_wp
    do g = 1, 8
      call shape_gradients(x, g, gradient, weight)
      sigma = weight*stress(gradient, u, lambda, shear)
      do a = 1, 8
        f(:, a) = f(:, a) + sigma(:, 1)*gradient(1, a) + sigma(:, 2)*gradient(2, a) + &
          sigma(:, 3)*gradient(3, a)
      end do
    end do
  end function nodal_force

  !> Stress averaged over the brick's volume.
  pure function mean_stress(x, u, lambda, shear) result(s)
    real(wp), intent(in) :: x(3, 8), u(3, 8) !! nodes and their displacements [length]
    real(wp), intent(in) :: lambda, shear    !! Lame's constants [force/length^2]
    real(wp) :: s(6)                         !! XX YY ZZ XY YZ XZ [force/length^2]
    real(wp) :: gradient(3, 8), sigma(3, 3), weight, total
    integer :: g

    sigma = 0.0_wp
    total = 0.0_wp
    do g = 1, 8
      call shape_gradients(x, g, gradient, weight)
      sigma = sigma + weight*stress(gradient, u, lambda, shear)
      total = total + weight
    end do
    sigma = sigma/total
    s = [sigma(1, 1), sigma(2, 2), sigma(3, 3), sigma(1, 2), sigma(2, 3), sigma(1, 3)]
  end function mean_stress

  !> sigma = lambda tr(eps) I + 2 G eps.
  pure function stress(gradient, u, lambda, shear) result(sigma)
    real(wp), intent(in) :: gradient(3, 8), u(3, 8), lambda, shear
    real(wp) :: sigma(3, 3), h(3, 3), pressure
    integer :: i, a

    h = 0.0_wp ! displacement gradient du_i/dx_j
    do a = 1, 8
      h(:, 1) = h(:, 1) + u(:, a)*gradient(1, a)
      h(:, 2) = h(:, 2) + u(:, a)*gradient(2, a)
      h(:, 3) = h(:, 3) + u(:, a)*gradient(3, a)
    end do
    sigma = shear*(h + transpose(h))
    pressure = lambda*(h(1, 1) + h(2, 2) + h(3, 3))
    do i = 1, 3
      sigma(i, i) = sigma(i, i) + pressure
    end do
  end function stress

end module hexahedron8_mod
