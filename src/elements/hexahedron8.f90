!> What all 8-node hexahedra share: trilinear shape functions, 2x2x2 Gauss points.
!>
!>        8-------7        zeta
!>       /|      /|         |  eta
!>      5-------6 |         | /
!>      | 4-----|-3         |/
!>      |/      |/          +---- xi
!>      1-------2        node 1 at (-1,-1,-1), node 7 at (1,1,1)
!>
!> Gauss point g is the one near node g. Stresses and strains are ordered XX YY ZZ XY YZ XZ; shear
!> strains are tensor components (half of the engineering ones). docs/theory.md, section 8.
module hexahedron8_mod
  use kinds_mod, only: wp
  use elasticity_mod, only: elasticity_t, matrix_of
  use small_matrix_mod, only: determinant, inverse
  implicit none
  private

  public :: shape_gradients, centre_shape_gradients, centre_jacobian, centre_gradient
  public :: jacobian_determinants, volume
  public :: along_edges
  public :: stiffness_length
  public :: displacement_gradients, strain_of, mode_strain_of, force_of
  public :: elastic_stiffness, strain_matrix
  public :: volume_mean, gradient_in_middle, extrapolate_to_nodes
  public :: xi_node, eta_node, zeta_node, gauss

  real(wp), parameter :: xi_node(8) = [-1, 1, 1, -1, -1, 1, 1, -1]
  real(wp), parameter :: eta_node(8) = [-1, -1, 1, 1, -1, -1, 1, 1]
  real(wp), parameter :: zeta_node(8) = [-1, -1, -1, -1, 1, 1, 1, 1]
  real(wp), parameter :: gauss = 1.0_wp/sqrt(3.0_wp) !! coordinate of the Gauss points, weight 1

contains

  ! ------------------------------------------------------------------ geometry

  !> Gradients of the shape functions at the eight Gauss points, and the volumes these stand for.
  pure subroutine shape_gradients(x, gradient, weight, inverse_jacobian)
    real(wp), intent(in)  :: x(3, 8)           !! nodes [length]
    real(wp), intent(out) :: gradient(3, 8, 8) !! dN_a/dx_i at point g: (i,a,g) [1/length]
    real(wp), intent(out) :: weight(8)         !! the Jacobian's determinants [length^3/8]
    real(wp), intent(out), optional :: inverse_jacobian(3, 3, 8)
    !! dxi_j/dx_i at point g: (j,i,g) [1/length]
    real(wp) :: along(3, 4, 3), d(3, 8), jacobian(3, 3), b(3, 3)
    integer :: g, a

    along = along_edges(x)
    do g = 1, 8
      d = local_gradients(gauss*xi_node(g), gauss*eta_node(g), gauss*zeta_node(g))
      jacobian = jacobian_of(along, gauss*xi_node(g), gauss*eta_node(g), gauss*zeta_node(g))
      weight(g) = determinant(jacobian)
      b = inverse(jacobian)
      if (present(inverse_jacobian)) inverse_jacobian(:, :, g) = b
      b = transpose(b)
      do a = 1, 8
        gradient(:, a, g) = b(:, 1)*d(1, a) + b(:, 2)*d(2, a) + b(:, 3)*d(3, a)
      end do
    end do
  end subroutine shape_gradients

  !> What vectors at the nodes change by along the edges of the element.
  !>
  !> All derivatives come from these: an element far from the origin, one that has moved far and a
  !> long thin one that has turned lose no digits.
  pure function along_edges(v) result(along)
    real(wp), intent(in) :: v(3, 8)  !! places or displacements of the nodes [length]
    real(wp) :: along(3, 4, 3)       !! component, edge, direction of the edge: xi, eta, zeta

    along(:, :, 1) = v(:, [2, 3, 6, 7]) - v(:, [1, 4, 5, 8])
    along(:, :, 2) = v(:, [4, 3, 8, 7]) - v(:, [1, 2, 5, 6])
    along(:, :, 3) = v(:, [5, 6, 8, 7]) - v(:, [1, 2, 4, 3])
  end function along_edges

  !> dv_i/dxi_j anywhere in the element, of vectors that change so along its edges.
  pure function jacobian_of(along, xi, eta, zeta) result(jacobian)
    real(wp), intent(in) :: along(3, 4, 3)
    real(wp), intent(in) :: xi, eta, zeta !! from -1 to 1
    real(wp) :: jacobian(3, 3)
    real(wp) :: part(4, 3)
    integer :: j

    part(:, 1) = between_edges(eta, zeta)
    part(:, 2) = between_edges(xi, zeta)
    part(:, 3) = between_edges(xi, eta)
    do j = 1, 3
      jacobian(:, j) = part(1, j)*along(:, 1, j) + part(2, j)*along(:, 2, j) + &
        part(3, j)*along(:, 3, j) + part(4, j)*along(:, 4, j)
    end do
  end function jacobian_of

  !> What the four edges of a direction count for, between them.
  pure function between_edges(s, t) result(part)
    real(wp), intent(in) :: s, t !! the other two coordinates, from -1 to 1
    real(wp) :: part(4)         !! their sum is 1/2: an edge is 2 long

    part = 0.125_wp*[(1.0_wp - s)*(1.0_wp - t), (1.0_wp + s)*(1.0_wp - t), &
      (1.0_wp - s)*(1.0_wp + t), (1.0_wp + s)*(1.0_wp + t)]
  end function between_edges

  !> The Jacobian dx_i/dxi_j of the element's centre.
  pure function centre_jacobian(x) result(jacobian)
    real(wp), intent(in) :: x(3, 8)  !! nodes [length]
    real(wp) :: jacobian(3, 3)       !! [length]

    jacobian = jacobian_of(along_edges(x), 0.0_wp, 0.0_wp, 0.0_wp)
  end function centre_jacobian

  !> Gradients of the shape functions at the element's centre.
  pure function centre_shape_gradients(x) result(gradient)
    real(wp), intent(in) :: x(3, 8)  !! nodes [length]
    real(wp) :: gradient(3, 8)       !! dN_a/dx_i: (i,a) [1/length]
    real(wp) :: back(3, 3)

    back = inverse(centre_jacobian(x))
    gradient = matmul(transpose(back), local_gradients(0.0_wp, 0.0_wp, 0.0_wp))
  end function centre_shape_gradients

  !> The displacement gradient du_i/dx_j at the element's centre, where incompatible modes have
  !> none.
  pure function centre_gradient(x, u) result(h)
    real(wp), intent(in) :: x(3, 8) !! nodes [length]
    real(wp), intent(in) :: u(3, 8) !! their displacements [length]
    real(wp) :: h(3, 3)             !! [-]
    real(wp) :: by_xi(3, 3), back(3, 3)

    by_xi = centre_jacobian(u)
    back = inverse(centre_jacobian(x))
    h = matmul(by_xi, back)
  end function centre_gradient

  !> How large a nodal stiffness of the element is beside its elastic constants: int |g_a|^2 dV, the
  !> Jacobian taken at the centre, the mean over the nodes. A third of the edge of a cube; of a thin
  !> element far more.
  pure function stiffness_length(x) result(length)
    real(wp), intent(in) :: x(3, 8) !! nodes [length]
    real(wp) :: length              !! [length]
    real(wp) :: jacobian(3, 3)

    jacobian = centre_jacobian(x)
    ! Over the parent cube (dN_a/dxi_i)(dN_a/dxi_j) is 2/9 for i = j, else 1/6 and -1/6 in turns.
    length = 2.0_wp/9.0_wp*determinant(jacobian)*sum(inverse(jacobian)**2)
  end function stiffness_length

  !> dN_a/dxi_j anywhere in the element.
  pure function local_gradients(xi, eta, zeta) result(d)
    real(wp), intent(in) :: xi, eta, zeta !! from -1 to 1
    real(wp) :: d(3, 8)
    real(wp) :: a(8), b(8), c(8)

    a = 1.0_wp + xi*xi_node
    b = 1.0_wp + eta*eta_node
    c = 1.0_wp + zeta*zeta_node
    d(1, :) = 0.125_wp*xi_node*b*c
    d(2, :) = 0.125_wp*a*eta_node*c
    d(3, :) = 0.125_wp*a*b*zeta_node
  end function local_gradients

  !> The Jacobian's determinant at the eight Gauss points and the eight nodes; all positive in a
  !> usable element.
  pure function jacobian_determinants(x) result(d)
    real(wp), intent(in) :: x(3, 8) !! nodes [length]
    real(wp) :: d(16)               !! [length^3/8]
    real(wp) :: along(3, 4, 3)
    integer :: g

    along = along_edges(x)
    do g = 1, 8
      d(g) = determinant(jacobian_of(along, gauss*xi_node(g), gauss*eta_node(g), &
        gauss*zeta_node(g)))
      d(8 + g) = determinant(jacobian_of(along, xi_node(g), eta_node(g), zeta_node(g)))
    end do
  end function jacobian_determinants

  !> Volume of the element.
  pure function volume(x) result(v)
    real(wp), intent(in) :: x(3, 8) !! nodes [length]
    real(wp) :: v                   !! [length^3]
    real(wp) :: d(16)

    d = jacobian_determinants(x)
    v = sum(d(:8))
  end function volume

  ! ------------------------------------------------------------------ strain, force, stiffness

  !> du_i/dx_j at the Gauss points.
  pure function displacement_gradients(inverse_jacobian, u) result(h)
    real(wp), intent(in) :: inverse_jacobian(3, 3, 8) !! dxi_j/dx_i at point g: (j,i,g) [1/length]
    real(wp), intent(in) :: u(3, 8)                   !! displacements of the nodes [length]
    real(wp) :: h(3, 3, 8)                            !! (i,j,g) [-]
    real(wp) :: along(3, 4, 3)
    integer :: g

    along = along_edges(u)
    do g = 1, 8
      h(:, :, g) = matmul(jacobian_of(along, gauss*xi_node(g), gauss*eta_node(g), &
        gauss*zeta_node(g)), inverse_jacobian(:, :, g))
    end do
  end function displacement_gradients

  !> Strain at the Gauss points, the symmetric part of du/dx.
  pure function strain_of(inverse_jacobian, u) result(strain)
    real(wp), intent(in) :: inverse_jacobian(3, 3, 8) !! dxi_j/dx_i at point g: (j,i,g) [1/length]
    real(wp), intent(in) :: u(3, 8)                   !! displacements of the nodes [length]
    real(wp) :: strain(6, 8)                          !! [-]
    real(wp) :: h(3, 3, 8)
    integer :: g

    h = displacement_gradients(inverse_jacobian, u)
    do g = 1, 8
      strain(:, g) = symmetric_part(h(:, :, g))
    end do
  end function strain_of

  !> Strain at the Gauss points of shape functions that are no nodes', the symmetric part of
  !> sum u_a g_a^T.
  pure function mode_strain_of(n, gradient, factor) result(strain)
    integer,  intent(in) :: n                 !! shape functions
    real(wp), intent(in) :: gradient(3, n, 8) !! their gradients [1/length]
    real(wp), intent(in) :: factor(3, n)      !! their factors [length]
    real(wp) :: strain(6, 8)                  !! [-]
    real(wp) :: h(3, 3)
    integer :: g, a

    do g = 1, 8
      h = 0.0_wp
      do a = 1, n
        h(:, 1) = h(:, 1) + factor(:, a)*gradient(1, a, g)
        h(:, 2) = h(:, 2) + factor(:, a)*gradient(2, a, g)
        h(:, 3) = h(:, 3) + factor(:, a)*gradient(3, a, g)
      end do
      strain(:, g) = symmetric_part(h)
    end do
  end function mode_strain_of

  !> The strain of a displacement gradient.
  pure function symmetric_part(h) result(strain)
    real(wp), intent(in) :: h(3, 3) !! du_i/dx_j [-]
    real(wp) :: strain(6)           !! [-]

    strain = [h(1, 1), h(2, 2), h(3, 3), 0.5_wp*(h(1, 2) + h(2, 1)), 0.5_wp*(h(2, 3) + h(3, 2)), &
      0.5_wp*(h(1, 3) + h(3, 1))]
  end function symmetric_part

  !> int sigma g_a, the forces that stresses at the Gauss points exert on the shape functions.
  pure function force_of(n, gradient, weight, stress) result(f)
    integer,  intent(in) :: n                 !! shape functions
    real(wp), intent(in) :: gradient(3, n, 8) !! their gradients [1/length]
    real(wp), intent(in) :: weight(8)         !! [length^3]
    real(wp), intent(in) :: stress(6, 8)      !! [force/length^2]
    real(wp) :: f(3, n)                       !! [force]
    real(wp) :: s(6)
    integer :: g, a

    f = 0.0_wp
    do g = 1, 8
      s = weight(g)*stress(:, g)
      do a = 1, n
        associate (d => gradient(:, a, g))
          f(1, a) = f(1, a) + s(1)*d(1) + s(4)*d(2) + s(6)*d(3)
          f(2, a) = f(2, a) + s(4)*d(1) + s(2)*d(2) + s(5)*d(3)
          f(3, a) = f(3, a) + s(6)*d(1) + s(5)*d(2) + s(3)*d(3)
        end associate
      end do
    end do
  end function force_of

  !> K_ab = int lambda g_a g_b^T + G (g_b g_a^T + g_a.g_b I), for any set of shape functions; (8.51)
  !> where the material is not isotropic.
  pure function elastic_stiffness(n, n_points, gradient, weight, elastic) result(k)
    integer,  intent(in) :: n                 !! shape functions
    integer,  intent(in) :: n_points          !! Gauss points
    real(wp), intent(in) :: gradient(3*n, n_points) !! gradients at the Gauss points [1/length]
    real(wp), intent(in) :: weight(n_points)  !! [length^3]
    type(elasticity_t), intent(in) :: elastic(:) !! one, or one a point
    real(wp) :: k(3*n, 3*n)                   !! node by node, x y z [force/length]
    real(wp) :: moment(3*n, 3*n), block(3, 3), trace, c(6, 6), strain(6, 3*n)
    integer :: g, a, b, i, j

    if (.not. elastic(1)%is_isotropic) then
      k = 0.0_wp
      do g = 1, n_points
        strain = strain_matrix(n, gradient(:, g))
        c = weight(g)*matrix_of(elastic(min(g, size(elastic))))
        k = k + matmul(transpose(strain), matmul(c, strain))
      end do
      return
    end if
    ! All products g_a g_b^T summed over the points first: the material enters once a pair of nodes.
    moment = 0.0_wp
    do g = 1, n_points
      do b = 1, n
        do j = 3*b - 2, 3*b
          moment(:3*b, j) = moment(:3*b, j) + weight(g)*gradient(j, g)*gradient(:3*b, g)
        end do
      end do
    end do
    do b = 1, n
      do a = 1, b
        block = moment(3*a - 2:3*a, 3*b - 2:3*b)
        trace = elastic(1)%shear*(block(1, 1) + block(2, 2) + block(3, 3))
        block = elastic(1)%lambda*block + elastic(1)%shear*transpose(block)
        do i = 1, 3
          block(i, i) = block(i, i) + trace
        end do
        k(3*a - 2:3*a, 3*b - 2:3*b) = block
        k(3*b - 2:3*b, 3*a - 2:3*a) = transpose(block)
      end do
    end do
  end function elastic_stiffness

  !> B: the engineering strains of the factors of shape functions.
  pure function strain_matrix(n, gradient) result(b)
    integer,  intent(in) :: n              !! shape functions
    real(wp), intent(in) :: gradient(3, n) !! at a point [1/length]
    real(wp) :: b(6, 3*n)                  !! XX YY ZZ XY YZ XZ by function, x y z [1/length]
    integer :: a

    b = 0.0_wp
    do a = 1, n
      associate (of => b(:, 3*a - 2:3*a), d => gradient(:, a))
        of(1, 1) = d(1)
        of(2, 2) = d(2)
        of(3, 3) = d(3)
        of(4, :2) = [d(2), d(1)]
        of(5, 2:) = [d(3), d(2)]
        of(6, [1, 3]) = [d(3), d(1)]
      end associate
    end do
  end function strain_matrix

  ! ------------------------------------------------------------------ fields

  !> Average over the element's volume of what is known at its Gauss points.
  pure function volume_mean(x, values) result(mean)
    real(wp), intent(in) :: x(3, 8)      !! nodes [length]
    real(wp), intent(in) :: values(6, 8) !! at the Gauss points
    real(wp) :: mean(6)
    real(wp) :: d(16)

    d = jacobian_determinants(x)
    mean = matmul(values, d(:8))/sum(d(:8))
  end function volume_mean

  !> The gradient, in the middle of the element, of what is trilinear in its coordinates through
  !> the values at the Gauss points.
  pure function gradient_in_middle(x, values) result(gradient)
    real(wp), intent(in) :: x(3, 8)      !! nodes [length]
    real(wp), intent(in) :: values(6, 8) !! at the Gauss points
    real(wp) :: gradient(3, 6)           !! [1/length]
    real(wp) :: by_xi(6, 3)

    by_xi = 0.125_wp/gauss*matmul(values, reshape([xi_node, eta_node, zeta_node], [8, 3]))
    gradient = transpose(matmul(by_xi, inverse(centre_jacobian(x))))
  end function gradient_in_middle

  !> Values at the nodes: trilinear in the element's coordinates through those at the Gauss points.
  pure function extrapolate_to_nodes(values) result(at_nodes)
    real(wp), intent(in) :: values(6, 8) !! at the Gauss points
    real(wp) :: at_nodes(6, 8)
    real(wp) :: factor(8)
    integer :: a

    do a = 1, 8
      factor = 0.125_wp*(1.0_wp + xi_node(a)*xi_node/gauss)*(1.0_wp + eta_node(a)*eta_node/gauss)* &
        (1.0_wp + zeta_node(a)*zeta_node/gauss)
      at_nodes(:, a) = matmul(values, factor)
    end do
  end function extrapolate_to_nodes

end module hexahedron8_mod
