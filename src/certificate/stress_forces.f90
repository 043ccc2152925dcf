!> The internal forces of the certificate, from the stresses of all elements.
!>
!> With b_j the cofactors of the Jacobian (columns a_j = dx/dxi_j, j = a_1 . b_1),
!>
!>     du/dx = sum over j of (du/dxi_j) b_j^T / j,      int sigma g_a dV = sum over the points of
!>     sigma b_j dN_a/dxi_j,
!>
!> so that forces need no inverse and no volume. Every element is computed by itself, a few of them
!> side by side for the processor's vectors. Derivatives are sums of differences along edges:
!> displacements of a body as a whole cancel to the last bit. docs/theory.md, sections 6 and 8.
module stress_forces_mod
  use kinds_mod, only: wp
  use undefined_mod, only: undefined
  use cells_mod, only: has_middles
  use connectivity_mod, only: nodes_of_hexahedron
  use mesh_mod, only: mesh_t, kind_c3d8, kind_c3d8i, kind_c3d8b
  use scene_mod, only: material_t
  use increment_forces_mod, only: increment_forces_t
  use second_order_forces_mod, only: add_second_order_forces
  use anisotropic_stress_mod, only: contract, elasticity_tensor, goes_around
  implicit none
  private

  public :: find_stress_forces

  integer, parameter :: lanes = 8 !! elements side by side
  ! The nodes at the two ends of the edges along xi, eta and zeta. The four edges of a direction are
  ! ordered by the two other coordinates, the first of these fastest.
  integer, parameter :: from(4, 3) = reshape([1, 4, 5, 8,  1, 2, 5, 6,  1, 2, 4, 3], [4, 3])
  integer, parameter :: to(4, 3) = reshape([2, 3, 6, 7,  4, 3, 8, 7,  5, 6, 8, 7], [4, 3])
  ! The signs of the coordinates of the quadrature's points, and their edges of each direction.
  real(wp), parameter :: side(8, 3) = real(reshape([ &
    -1, 1, -1, 1, -1, 1, -1, 1,  -1, -1, 1, 1, -1, -1, 1, 1,  -1, -1, -1, -1, 1, 1, 1, 1], &
    [8, 3]), wp)
  integer, parameter :: edge_of(8, 3) = reshape([ &
    1, 1, 2, 2, 3, 3, 4, 4,  1, 2, 1, 2, 3, 4, 3, 4,  1, 2, 3, 4, 1, 2, 3, 4], [8, 3])
  ! What the nearer of two edges counts for at a point of the quadrature.
  real(wp), parameter :: near = 0.5_wp + 0.5_wp/sqrt(3.0_wp)

  !> Elements of one kind side by side: lane, then components.
  type :: batch_t
    integer :: n = 0                        !! elements in it
    integer :: node(8, lanes) = 0
    logical :: is_isotropic = .true.        !! all of them, or none
    logical :: is_averaged = .false.        !! their dilatation
    real(wp) :: lambda(lanes) = 0.0_wp, shear(lanes) = 0.0_wp !! then [force/length^2]
    real(wp) :: c(3, 3, 3, 3, 8, lanes) = 0.0_wp !! else, at the points [force/length^2]
    real(wp) :: x(lanes, 3, 4, 3) = 0.0_wp  !! dx/dxi_j: component, edge, j [length]
    real(wp) :: u(lanes, 3, 4, 3) = 0.0_wp  !! du/dxi_j [length]
    real(wp) :: b(lanes, 3, 3, 8) = 0.0_wp  !! cofactors: component, j, point [length^2]
    real(wp) :: volume(lanes, 8) = 0.0_wp   !! that a point stands for [length^3]
    real(wp) :: strain(lanes, 6, 8) = 0.0_wp !! XX YY ZZ XY YZ XZ [-]
    real(wp) :: force(lanes, 3, 4, 3) = 0.0_wp !! on the ends of the edges [force]
    real(wp) :: energy(lanes) = 0.0_wp      !! [energy]
    real(wp) :: centre(lanes, 3, 3) = 0.0_wp !! cofactors of the centre: component, j [length^2]
    real(wp) :: stiffness(lanes) = 0.0_wp   !! of a node [force/length]
  end type batch_t

contains

  !> Internal forces, their rounding (6.2) and the sums of the elements, of displacements `u`.
  pure subroutine find_stress_forces(mesh, materials, u, before, forces)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    real(wp), intent(in) :: u(:, :)       !! (3,n_nodes) [length]
    real(wp), intent(in) :: before(:, :)  !! (3,n_nodes) when the increment began [length]
    type(increment_forces_t), intent(inout) :: forces
    type(batch_t) :: batch
    real(wp) :: moved(mesh%n_nodes) !! the largest component of either displacement [length]
    integer :: e, next

    if (allocated(forces%internal)) deallocate (forces%internal, forces%rounding, forces%stiffness)
    allocate (forces%internal(3, mesh%n_nodes), source=0.0_wp)
    allocate (forces%rounding(mesh%n_nodes), forces%stiffness(mesh%n_nodes), source=0.0_wp)
    if (allocated(forces%of_elements%energy)) deallocate (forces%of_elements%energy, &
      forces%of_elements%largest)
    allocate (forces%of_elements%energy(0:mesh%n_bodies), &
      forces%of_elements%largest(0:mesh%n_bodies), source=0.0_wp)
    moved = max(maxval(abs(u), dim=1), maxval(abs(before), dim=1))
    e = 1
    do while (e <= mesh%n_elements)
      next = e + 1
      if (has_middles(mesh%connectivity%cell(e))) then
        call add_second_order_forces(mesh, materials, u, moved, e, forces)
        e = next
        cycle
      end if
      do while (next <= mesh%n_elements .and. next < e + lanes)
        if (mesh%element_kind(next) /= mesh%element_kind(e)) exit
        if (has_middles(mesh%connectivity%cell(next))) exit
        if (materials(mesh%material(next))%law%elastic%is_isotropic .neqv. &
          materials(mesh%material(e))%law%elastic%is_isotropic) exit
        next = next + 1
      end do
      call gather(mesh, materials, u, e, next - e, batch)
      call find_strains(batch)
      select case (mesh%element_kind(e))
      case (kind_c3d8)
      case (kind_c3d8i)
        call add_modes(batch)
      case (kind_c3d8b)
        call average_dilatation(batch)
      case default
        batch%u = undefined
      end select
      call find_forces(batch)
      call scatter(mesh, moved, batch, forces)
      e = next
    end do
  end subroutine find_stress_forces

  !> Elements side by side; lanes that are left repeat the last one.
  pure subroutine gather(mesh, materials, u, first, n, batch)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    real(wp), intent(in) :: u(:, :)        !! (3,n_nodes) [length]
    integer, intent(in) :: first, n        !! elements
    type(batch_t), intent(inout) :: batch
    integer :: l, e, k, j, a, b, g

    batch%n = n
    batch%is_averaged = .false.
    do l = 1, lanes
      e = first + min(l, n) - 1
      batch%node(:, l) = nodes_of_hexahedron(mesh%connectivity, e)
      associate (elastic => materials(mesh%material(e))%law%elastic)
        batch%is_isotropic = elastic%is_isotropic
        batch%lambda(l) = elastic%lambda
        batch%shear(l) = elastic%shear
      end associate
      if (.not. batch%is_isotropic) then
        do g = 1, 8
          if (g > 1 .and. .not. goes_around(mesh, materials(mesh%material(e)))) then
            batch%c(:, :, :, :, g, l) = batch%c(:, :, :, :, 1, l)
          else
            batch%c(:, :, :, :, g, l) = elasticity_tensor(mesh, materials(mesh%material(e)), e, &
              point_of(mesh%coordinates(:, batch%node(:, l)), side(g, :)/sqrt(3.0_wp)))
          end if
        end do
      end if
      do j = 1, 3
        do k = 1, 4
          a = batch%node(from(k, j), l)
          b = batch%node(to(k, j), l)
          batch%x(l, :, k, j) = 0.5_wp*(mesh%coordinates(:, b) - mesh%coordinates(:, a))
          batch%u(l, :, k, j) = 0.5_wp*(u(:, b) - u(:, a))
        end do
      end do
    end do
    call find_centre(batch)
    call to_points(batch%x)
    call to_points(batch%u)
  end subroutine gather

  !> A place in an element.
  pure function point_of(x, xi) result(place)
    real(wp), intent(in) :: x(3, 8)  !! nodes [length]
    real(wp), intent(in) :: xi(3)    !! natural coordinates [-]
    real(wp) :: place(3)             !! [length]
    real(wp) :: upper(3, 4)

    upper = 0.5_wp*((1.0_wp - xi(3))*x(:, :4) + (1.0_wp + xi(3))*x(:, 5:))
    place = 0.25_wp*((1.0_wp - xi(2))*((1.0_wp - xi(1))*upper(:, 1) + (1.0_wp + xi(1))* &
      upper(:, 2)) + (1.0_wp + xi(2))*((1.0_wp - xi(1))*upper(:, 4) + (1.0_wp + xi(1))* &
      upper(:, 3)))
  end function point_of

  !> The cofactors of the centre's Jacobian, and the stiffness of a node that these make:
  !> (|lambda| + 2 G) int |g_a|^2 dV with this Jacobian, the mean over the nodes; the largest number
  !> of C in the place of these constants where the material is not isotropic.
  pure subroutine find_centre(batch)
    type(batch_t), intent(inout) :: batch !! derivatives at the edges
    real(wp) :: a(lanes, 3, 3), determinant(lanes), modulus(lanes)

    modulus = abs(batch%lambda) + 2.0_wp*batch%shear
    if (.not. batch%is_isotropic) modulus = maxval(reshape(abs(batch%c), [648, lanes]), &
      dim=1)
    a = 0.25_wp*(batch%x(:, :, 1, :) + batch%x(:, :, 2, :) + batch%x(:, :, 3, :) + &
      batch%x(:, :, 4, :))
    call find_cofactors(a(:, :, 1), a(:, :, 2), a(:, :, 3), batch%centre, determinant)
    batch%stiffness = modulus*(2.0_wp/9.0_wp)*sum(sum(batch%centre**2, dim=3), dim=2)/determinant
  end subroutine find_centre

  !> Derivatives at the edges become those at the points of the quadrature, two of which share one.
  pure subroutine to_points(d)
    real(wp), intent(inout) :: d(lanes, 3, 4, 3)
    real(wp) :: low, high
    integer :: j, i, l

    do j = 1, 3
      do i = 1, 3
        do l = 1, lanes
          low = near*d(l, i, 1, j) + (1.0_wp - near)*d(l, i, 2, j)
          high = near*d(l, i, 3, j) + (1.0_wp - near)*d(l, i, 4, j)
          d(l, i, 2, j) = near*d(l, i, 2, j) + (1.0_wp - near)*d(l, i, 1, j)
          d(l, i, 4, j) = near*d(l, i, 4, j) + (1.0_wp - near)*d(l, i, 3, j)
          d(l, i, 1, j) = near*low + (1.0_wp - near)*high
          d(l, i, 3, j) = near*high + (1.0_wp - near)*low
          low = d(l, i, 2, j)
          d(l, i, 2, j) = near*low + (1.0_wp - near)*d(l, i, 4, j)
          d(l, i, 4, j) = near*d(l, i, 4, j) + (1.0_wp - near)*low
        end do
      end do
    end do
  end subroutine to_points

  !> b_1 = a_2 x a_3 and so on, and a_1 . b_1.
  pure subroutine find_cofactors(a1, a2, a3, b, determinant)
    real(wp), intent(in) :: a1(lanes, 3), a2(lanes, 3), a3(lanes, 3) !! [length]
    real(wp), intent(out) :: b(lanes, 3, 3)                          !! [length^2]
    real(wp), intent(out) :: determinant(lanes)                      !! [length^3]
    integer :: l

    do l = 1, lanes
      b(l, 1, 1) = a2(l, 2)*a3(l, 3) - a2(l, 3)*a3(l, 2)
      b(l, 2, 1) = a2(l, 3)*a3(l, 1) - a2(l, 1)*a3(l, 3)
      b(l, 3, 1) = a2(l, 1)*a3(l, 2) - a2(l, 2)*a3(l, 1)
      b(l, 1, 2) = a3(l, 2)*a1(l, 3) - a3(l, 3)*a1(l, 2)
      b(l, 2, 2) = a3(l, 3)*a1(l, 1) - a3(l, 1)*a1(l, 3)
      b(l, 3, 2) = a3(l, 1)*a1(l, 2) - a3(l, 2)*a1(l, 1)
      b(l, 1, 3) = a1(l, 2)*a2(l, 3) - a1(l, 3)*a2(l, 2)
      b(l, 2, 3) = a1(l, 3)*a2(l, 1) - a1(l, 1)*a2(l, 3)
      b(l, 3, 3) = a1(l, 1)*a2(l, 2) - a1(l, 2)*a2(l, 1)
      determinant(l) = a1(l, 1)*b(l, 1, 1) + a1(l, 2)*b(l, 2, 1) + a1(l, 3)*b(l, 3, 1)
    end do
  end subroutine find_cofactors

  !> The symmetric part of du/dx at the points.
  pure subroutine find_strains(batch)
    type(batch_t), intent(inout) :: batch
    integer :: g, j

    do g = 1, 8
      associate (edge => edge_of(g, :))
        call find_cofactors(batch%x(:, :, edge(1), 1), batch%x(:, :, edge(2), 2), &
          batch%x(:, :, edge(3), 3), batch%b(:, :, :, g), batch%volume(:, g))
        batch%strain(:, :, g) = 0.0_wp
        do j = 1, 3
          call add_strain(batch%u(:, :, edge(j), j), batch%b(:, :, j, g), batch%volume(:, g), &
            batch%strain(:, :, g))
        end do
      end associate
    end do
  end subroutine find_strains

  !> Add sym(u b^T)/volume.
  pure subroutine add_strain(u, b, volume, strain)
    real(wp), intent(in) :: u(lanes, 3), b(lanes, 3), volume(lanes)
    real(wp), intent(inout) :: strain(lanes, 6)
    real(wp) :: part
    integer :: l

    do l = 1, lanes
      part = 1.0_wp/volume(l)
      strain(l, 1) = strain(l, 1) + part*u(l, 1)*b(l, 1)
      strain(l, 2) = strain(l, 2) + part*u(l, 2)*b(l, 2)
      strain(l, 3) = strain(l, 3) + part*u(l, 3)*b(l, 3)
      part = 0.5_wp*part
      strain(l, 4) = strain(l, 4) + part*(u(l, 1)*b(l, 2) + u(l, 2)*b(l, 1))
      strain(l, 5) = strain(l, 5) + part*(u(l, 2)*b(l, 3) + u(l, 3)*b(l, 2))
      strain(l, 6) = strain(l, 6) + part*(u(l, 1)*b(l, 3) + u(l, 3)*b(l, 1))
    end do
  end subroutine add_strain

  !> C3D8B: the mean of the dilatation at all points.
  pure subroutine average_dilatation(batch)
    type(batch_t), intent(inout) :: batch
    real(wp) :: mean(lanes), dilatation(lanes, 8)
    integer :: g, i

    batch%is_averaged = .true.
    dilatation = batch%strain(:, 1, :) + batch%strain(:, 2, :) + batch%strain(:, 3, :)
    mean = sum(batch%volume*dilatation, dim=2)/sum(batch%volume, dim=2)
    do g = 1, 8
      do i = 1, 3
        batch%strain(:, i, g) = batch%strain(:, i, g) + (mean - dilatation(:, g))/3.0_wp
      end do
    end do
  end subroutine average_dilatation

  !> C3D8I: the strains of the incompatible modes, which their own forces balance.
  !>
  !> With c_k the cofactors of the centre and s_k = +-1 the side of a point, the strain of mode i is
  !> (s_i/j) sym(beta_i c_i^T), and its force (sum over the points of s_k sigma) c_k = 0:
  !>
  !>     sum over i of A_ki (lambda c_k c_i^T + G (c_i c_k^T + c_i.c_k I)) beta_i = -S_k c_k,
  !>
  !> A_ki = sum over the points of s_k s_i/j, S_k that of the stresses without modes; the sums of
  !> s_k s_i/j c_k C c_i in the place of A_ki and brackets where the material is not isotropic.
  pure subroutine add_modes(batch)
    type(batch_t), intent(inout) :: batch
    real(wp) :: a(lanes, 3, 3)       !! A_ki [1/length^3]
    real(wp) :: e(lanes, 6, 3)       !! the sums of s_k times strain [-]
    real(wp) :: k_modes(lanes, 9, 9), beta(lanes, 9)
    real(wp) :: trace(lanes), product(lanes)
    integer :: g, i, k, p, q

    a = 0.0_wp
    e = 0.0_wp
    do g = 1, 8
      do k = 1, 3
        e(:, :, k) = e(:, :, k) + side(g, k)*batch%strain(:, :, g)
        do i = 1, k
          a(:, k, i) = a(:, k, i) + side(g, k)*side(g, i)/batch%volume(:, g)
        end do
      end do
    end do
    if (.not. batch%is_isotropic) call find_modes(batch, k_modes, beta)
    associate (c => batch%centre, lambda => batch%lambda, shear => batch%shear)
      do k = 1, 3
        if (.not. batch%is_isotropic) exit
        trace = lambda*(e(:, 1, k) + e(:, 2, k) + e(:, 3, k))
        beta(:, 3*k - 2) = -(trace + 2.0_wp*shear*e(:, 1, k))*c(:, 1, k) - &
          2.0_wp*shear*(e(:, 4, k)*c(:, 2, k) + e(:, 6, k)*c(:, 3, k))
        beta(:, 3*k - 1) = -(trace + 2.0_wp*shear*e(:, 2, k))*c(:, 2, k) - &
          2.0_wp*shear*(e(:, 4, k)*c(:, 1, k) + e(:, 5, k)*c(:, 3, k))
        beta(:, 3*k) = -(trace + 2.0_wp*shear*e(:, 3, k))*c(:, 3, k) - &
          2.0_wp*shear*(e(:, 6, k)*c(:, 1, k) + e(:, 5, k)*c(:, 2, k))
        do i = 1, k
          product = shear*(c(:, 1, k)*c(:, 1, i) + c(:, 2, k)*c(:, 2, i) + c(:, 3, k)*c(:, 3, i))
          do q = 1, 3
            do p = 1, 3
              k_modes(:, 3*k - 3 + p, 3*i - 3 + q) = a(:, k, i)*(lambda*c(:, p, k)*c(:, q, i) + &
                shear*c(:, p, i)*c(:, q, k))
            end do
            k_modes(:, 3*k - 3 + q, 3*i - 3 + q) = k_modes(:, 3*k - 3 + q, 3*i - 3 + q) + &
              a(:, k, i)*product
          end do
        end do
      end do
      call solve_positive(k_modes, beta)
      do g = 1, 8
        associate (strain => batch%strain(:, :, g))
          do i = 1, 3
            product = side(g, i)/batch%volume(:, g)
            do p = 1, 3
              strain(:, p) = strain(:, p) + product*beta(:, 3*i - 3 + p)*c(:, p, i)
            end do
            product = 0.5_wp*product
            strain(:, 4) = strain(:, 4) + product*(beta(:, 3*i - 2)*c(:, 2, i) + &
              beta(:, 3*i - 1)*c(:, 1, i))
            strain(:, 5) = strain(:, 5) + product*(beta(:, 3*i - 1)*c(:, 3, i) + &
              beta(:, 3*i)*c(:, 2, i))
            strain(:, 6) = strain(:, 6) + product*(beta(:, 3*i - 2)*c(:, 3, i) + &
              beta(:, 3*i)*c(:, 1, i))
          end do
        end associate
      end do
    end associate
  end subroutine add_modes

  !> The equations of the modes where the material is not isotropic.
  pure subroutine find_modes(batch, k_modes, beta)
    type(batch_t), intent(in) :: batch
    real(wp), intent(out) :: k_modes(lanes, 9, 9) !! the lower triangle of blocks
    real(wp), intent(out) :: beta(lanes, 9)       !! right-hand sides
    real(wp) :: stress(3, 3), by_mode(3, 3)
    integer :: l, k, i, q, g

    k_modes = 0.0_wp
    beta = 0.0_wp
    do l = 1, lanes
      do g = 1, 8
        associate (c => batch%centre(l, :, :), tensor => batch%c(:, :, :, :, g, l))
          stress = contract(tensor, as_matrix(batch%strain(l, :, g)))
          do k = 1, 3
            beta(l, 3*k - 2:3*k) = beta(l, 3*k - 2:3*k) - side(g, k)*matmul(stress, c(:, k))
          end do
          do i = 1, 3
            do q = 1, 3
              by_mode = 0.0_wp
              by_mode(q, :) = side(g, i)/batch%volume(l, g)*c(:, i)
              stress = contract(tensor, by_mode)
              do k = i, 3
                k_modes(l, 3*k - 2:3*k, 3*i - 3 + q) = k_modes(l, 3*k - 2:3*k, 3*i - 3 + q) + &
                  side(g, k)*matmul(stress, c(:, k))
              end do
            end do
          end do
        end associate
      end do
    end do
  end subroutine find_modes

  !> A tensor of its six components.
  pure function as_matrix(six) result(matrix)
    real(wp), intent(in) :: six(6) !! XX YY ZZ XY YZ XZ
    real(wp) :: matrix(3, 3)

    matrix = reshape(six([1, 4, 6, 4, 2, 5, 6, 5, 3]), [3, 3])
  end function as_matrix

  !> Solve symmetric positive definite systems by Cholesky's factors, lower triangle given.
  pure subroutine solve_positive(k, b)
    real(wp), intent(inout) :: k(lanes, 9, 9) !! its lower triangle becomes the factor
    real(wp), intent(inout) :: b(lanes, 9)    !! right-hand sides, then solutions
    integer :: i, j, m

    do j = 1, 9
      do m = 1, j - 1
        do i = j, 9
          k(:, i, j) = k(:, i, j) - k(:, i, m)*k(:, j, m)
        end do
      end do
      k(:, j, j) = 1.0_wp/sqrt(k(:, j, j))
      do i = j + 1, 9
        k(:, i, j) = k(:, i, j)*k(:, j, j)
      end do
    end do
    do j = 1, 9
      b(:, j) = b(:, j)*k(:, j, j)
      do i = j + 1, 9
        b(:, i) = b(:, i) - k(:, i, j)*b(:, j)
      end do
    end do
    do j = 9, 1, -1
      do i = j + 1, 9
        b(:, j) = b(:, j) - k(:, i, j)*b(:, i)
      end do
      b(:, j) = b(:, j)*k(:, j, j)
    end do
  end subroutine solve_positive

  !> Stresses, what they do along the edges, and the energy of the strains.
  pure subroutine find_forces(batch)
    type(batch_t), intent(inout) :: batch
    real(wp) :: stress(lanes, 6, 8)
    integer :: g, j

    batch%force = 0.0_wp
    batch%energy = 0.0_wp
    do g = 1, 8
      if (batch%is_isotropic) then
        call find_stress(batch%lambda, batch%shear, batch%strain(:, :, g), batch%volume(:, g), &
          stress(:, :, g), batch%energy)
      else
        call find_anisotropic_stress(batch%c(:, :, :, :, g, :), batch%strain(:, :, g), &
          batch%volume(:, g), stress(:, :, g), batch%energy)
      end if
    end do
    ! What works on the mean dilatation is the mean pressure; of isotropic materials all are that.
    if (batch%is_averaged .and. .not. batch%is_isotropic) call average_pressure(batch%volume, &
      stress)
    do g = 1, 8
      do j = 1, 3
        call add_force(stress(:, :, g), batch%b(:, :, j, g), batch%force(:, :, edge_of(g, j), j))
      end do
    end do
    ! From the points back to the edges: the map of `to_points` is symmetric.
    call to_points(batch%force)
    batch%force = 0.5_wp*batch%force
  end subroutine find_forces

  !> The mean of the pressure at all points.
  pure subroutine average_pressure(volume, stress)
    real(wp), intent(in) :: volume(lanes, 8)
    real(wp), intent(inout) :: stress(lanes, 6, 8)
    real(wp) :: mean(lanes), trace(lanes, 8)
    integer :: g, i

    trace = stress(:, 1, :) + stress(:, 2, :) + stress(:, 3, :)
    mean = sum(volume*trace, dim=2)/sum(volume, dim=2)
    do g = 1, 8
      do i = 1, 3
        stress(:, i, g) = stress(:, i, g) + (mean - trace(:, g))/3.0_wp
      end do
    end do
  end subroutine average_pressure

  !> The stress at a point, and half its work on the strain.
  pure subroutine find_stress(lambda, shear, strain, volume, stress, energy)
    real(wp), intent(in) :: lambda(lanes), shear(lanes), strain(lanes, 6), volume(lanes)
    real(wp), intent(out) :: stress(lanes, 6)
    real(wp), intent(inout) :: energy(lanes)
    real(wp) :: pressure, twice
    integer :: l

    do l = 1, lanes
      twice = 2.0_wp*shear(l)
      pressure = lambda(l)*(strain(l, 1) + strain(l, 2) + strain(l, 3))
      stress(l, 1) = pressure + twice*strain(l, 1)
      stress(l, 2) = pressure + twice*strain(l, 2)
      stress(l, 3) = pressure + twice*strain(l, 3)
      stress(l, 4) = twice*strain(l, 4)
      stress(l, 5) = twice*strain(l, 5)
      stress(l, 6) = twice*strain(l, 6)
      energy(l) = energy(l) + 0.5_wp*volume(l)*(stress(l, 1)*strain(l, 1) + &
        stress(l, 2)*strain(l, 2) + stress(l, 3)*strain(l, 3) + 2.0_wp*(stress(l, 4)*strain(l, 4) &
        + stress(l, 5)*strain(l, 5) + stress(l, 6)*strain(l, 6)))
    end do
  end subroutine find_stress

  !> The same where the material is not isotropic.
  pure subroutine find_anisotropic_stress(c, strain, volume, stress, energy)
    real(wp), intent(in) :: c(3, 3, 3, 3, lanes), strain(lanes, 6), volume(lanes)
    real(wp), intent(out) :: stress(lanes, 6)
    real(wp), intent(inout) :: energy(lanes)
    real(wp) :: s(3, 3), of_point(3, 3)
    integer :: l

    do l = 1, lanes
      of_point = as_matrix(strain(l, :))
      s = contract(c(:, :, :, :, l), of_point)
      stress(l, :) = [s(1, 1), s(2, 2), s(3, 3), s(1, 2), s(2, 3), s(1, 3)]
      energy(l) = energy(l) + 0.5_wp*volume(l)*sum(s*of_point)
    end do
  end subroutine find_anisotropic_stress

  !> Add sigma b.
  pure subroutine add_force(stress, b, force)
    real(wp), intent(in) :: stress(lanes, 6), b(lanes, 3)
    real(wp), intent(inout) :: force(lanes, 3)
    integer :: l

    do l = 1, lanes
      force(l, 1) = force(l, 1) + stress(l, 1)*b(l, 1) + stress(l, 4)*b(l, 2) + stress(l, 6)*b(l, 3)
      force(l, 2) = force(l, 2) + stress(l, 4)*b(l, 1) + stress(l, 2)*b(l, 2) + stress(l, 5)*b(l, 3)
      force(l, 3) = force(l, 3) + stress(l, 6)*b(l, 1) + stress(l, 5)*b(l, 2) + stress(l, 3)*b(l, 3)
    end do
  end subroutine add_force

  !> Add the forces of the elements to the nodes, and what is kept of each body.
  pure subroutine scatter(mesh, moved, batch, forces)
    type(mesh_t), intent(in) :: mesh
    real(wp), intent(in) :: moved(:) !! (n_nodes) how far nodes are displaced [length]
    type(batch_t), intent(in) :: batch
    type(increment_forces_t), intent(inout) :: forces
    real(wp), parameter :: operations = 32.0_wp ! rounded ones that add up in a nodal force
    real(wp) :: f(3, 8), largest_motion
    integer :: l, j, k, a, body

    do l = 1, batch%n
      f = 0.0_wp
      do j = 1, 3
        do k = 1, 4
          f(:, from(k, j)) = f(:, from(k, j)) - batch%force(l, :, k, j)
          f(:, to(k, j)) = f(:, to(k, j)) + batch%force(l, :, k, j)
        end do
      end do
      largest_motion = maxval(moved(batch%node(:, l)))
      do a = 1, 8
        associate (node => batch%node(a, l))
          forces%internal(:, node) = forces%internal(:, node) + f(:, a)
          forces%stiffness(node) = forces%stiffness(node) + batch%stiffness(l)
          forces%rounding(node) = forces%rounding(node) + operations*epsilon(1.0_wp)* &
            batch%stiffness(l)*largest_motion
        end associate
      end do
      body = mesh%body(batch%node(1, l))
      associate (of => forces%of_elements)
        of%largest(body) = max(of%largest(body), sqrt(maxval(f(1, :)**2 + f(2, :)**2 + &
          f(3, :)**2)))
        of%energy(body) = of%energy(body) + batch%energy(l)
      end associate
    end do
  end subroutine scatter

end module stress_forces_mod
