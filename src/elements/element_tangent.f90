!> The tangent of an element at finite strain, of any kind: the second derivative of its energy by
!> the displacements of its nodes. docs/theory.md (8.22), (8.23).
module element_tangent_mod
  use kinds_mod, only: wp
  use undefined_mod, only: undefined
  use dense_mod, only: symmetric_eigenvectors
  use strain_measures_mod, only: growth_of, deformation_of
  use material_law_mod, only: law_t, finite_stress, finite_tangent
  use mesh_mod, only: kind_c3d8, kind_c3d8i, kind_c3d8b
  use small_matrix_mod, only: inverse
  use finite_strain_mod, only: finite_element_t, gradients_of_law, mode_part
  implicit none
  private

  public :: tangent_of, mode_stiffness, project, couple

  real(wp), parameter :: remnant = 0.1_wp
  !! of what is negative in an element, with the other sign: with all of it rubber and ironing take
  !! 3 to 13 % more iterations, with a tenth 0 to 2 % [-]

contains

  !> K, C3D8I's modes eliminated, and the number of negative pivots of their stiffness: with one the
  !> equilibrium of the modes is not a minimum of the energy.
  pure subroutine tangent_of(element, modes, law, k, negative)
    type(finite_element_t), intent(in) :: element !! det F > 0
    real(wp), intent(in) :: modes(3, 3)  !! amplitudes of C3D8I's modes, in equilibrium [length]
    type(law_t), intent(in) :: law
    real(wp), intent(out) :: k(24, 24)   !! node by node, x y z [force/length]
    integer, intent(out) :: negative
    real(wp) :: h(3, 3, 8)
    integer :: g

    negative = 0
    select case (element%kind)
    case (kind_c3d8b)
      call add_mean_dilatation(element, law, k)
    case (kind_c3d8i)
      call condense_modes(element, modes, law, k, negative)
    case (kind_c3d8)
      k = 0.0_wp
      h = element%h
      do g = 1, 8
        k = k + couple(element%weight(g)*finite_tangent(law, h(:, :, g)), &
          element%gradient(:, :, g), element%gradient(:, :, g))
      end do
    case default
      k = undefined
    end select
  end subroutine tangent_of

  !> Replace negative eigenvalues of a matrix, or a part of them, by a small part of their size: all
  !> of them make it positive semi-definite. With 0 the sum over the elements may be singular.
  subroutine project(part, k)
    real(wp), intent(in) :: part          !! [-]
    real(wp), intent(inout) :: k(:, :)    !! symmetric but for rounding
    real(wp) :: vectors(size(k, 1), size(k, 1)), values(size(k, 1))
    logical :: ok
    integer :: i

    vectors = 0.5_wp*(k + transpose(k))
    call symmetric_eigenvectors(vectors, values, ok)
    if (.not. ok .or. values(1) >= 0.0_wp) return
    do i = 1, size(k, 1)
      if (values(i) >= 0.0_wp) exit
      k = k - (part*(1.0_wp + remnant)*values(i))*spread(vectors(:, i), 2, size(k, 1))* &
        spread(vectors(:, i), 1, size(k, 1))
    end do
  end subroutine project

  !> sum over j and l of A_ijkl g_aj h_bl: what a tensor makes between gradients.
  pure function couple(a, left, right) result(k)
    real(wp), intent(in) :: a(3, 3, 3, 3)
    real(wp), intent(in) :: left(:, :), right(:, :)           !! (3,n), (3,m)
    real(wp) :: k(3*size(left, 2), 3*size(right, 2))          !! (i a, k b)
    real(wp) :: along(3*size(left, 2), 3)
    integer :: b, c, m, l

    do m = 1, 3
      do l = 1, 3
        do c = 1, size(left, 2)
          along(3*c - 2:3*c, l) = a(:, 1, m, l)*left(1, c) + a(:, 2, m, l)*left(2, c) + &
            a(:, 3, m, l)*left(3, c)
        end do
      end do
      do b = 1, size(right, 2)
        k(:, 3*(b - 1) + m) = along(:, 1)*right(1, b) + along(:, 2)*right(2, b) + along(:, 3)* &
          right(3, b)
      end do
    end do
  end function couple

  !> C3D8B. With d = F^-T : dF, h = d(theta)/theta, dF_b = b dF + (h - d)/3 F_b:
  !>
  !>     K = sum of w [ b^2 A_b + (a + c) (h - d)^T b/3 + (h - d) (a + c)^T b/3
  !>         + (F_b : A_b : F_b + p) (h - d) (h - d)^T/9 - p h h^T/3 + q J d d^T + (p/3 - q J) X ]
  !>
  !> a = A_b : F_b and c = P_b on dF, p = P_b : F_b, q of (8.14), X = tr(F^-1 dF F^-1 dF).
  pure subroutine add_mean_dilatation(element, law, k)
    type(finite_element_t), intent(in) :: element
    type(law_t), intent(in) :: law
    real(wp), intent(out) :: k(24, 24)
    real(wp) :: h(3, 3, 8), a(3, 3, 3, 3), f(3, 3), p_b(3, 3, 8), back(3, 3, 8), of_f(3, 3)
    real(wp) :: d(24, 8), mean(24), rest(24), both(24), jacobian(8), p(8), b, q, theta, volume
    integer :: g, i, j, m, l

    h = gradients_of_law(element, spread([0.0_wp, 0.0_wp, 0.0_wp], 2, 3))
    do g = 1, 8
      jacobian(g) = 1.0_wp + growth_of(element%h(:, :, g))
      back(:, :, g) = transpose(inverse(deformation_of(element%h(:, :, g))))
      d(:, g) = reshape(matmul(back(:, :, g), element%gradient(:, :, g)), [24])
      p_b(:, :, g) = finite_stress(law, h(:, :, g))
      p(g) = sum(p_b(:, :, g)*deformation_of(h(:, :, g)))
    end do
    volume = sum(element%weight)
    theta = dot_product(element%weight, jacobian)/volume
    mean = matmul(d, element%weight*jacobian)/(volume*theta)
    q = dot_product(element%weight, p)/(3.0_wp*theta*volume)
    k = 0.0_wp
    do g = 1, 8
      b = (theta/jacobian(g))**(1.0_wp/3.0_wp)
      f = deformation_of(h(:, :, g))
      a = finite_tangent(law, h(:, :, g))
      do l = 1, 3
        do m = 1, 3
          of_f(m, l) = sum(a(:, :, m, l)*f)
        end do
      end do
      rest = (mean - d(:, g))/3.0_wp
      both = b*reshape(matmul(of_f + p_b(:, :, g), element%gradient(:, :, g)), [24])
      a = b**2*a
      do l = 1, 3
        do m = 1, 3
          do j = 1, 3
            a(:, j, m, l) = a(:, j, m, l) + (p(g)/3.0_wp - q*jacobian(g))*back(m, j, g)* &
              back(:, l, g)
          end do
        end do
      end do
      associate (w => element%weight(g))
        k = k + couple(w*a, element%gradient(:, :, g), element%gradient(:, :, g))
        do i = 1, 24
          k(:, i) = k(:, i) + w*(both*rest(i) + (both(i) + (sum(of_f*f) + p(g))*rest(i))*rest - &
            p(g)/3.0_wp*mean(i)*mean + q*jacobian(g)*d(i, g)*d(:, g))
        end do
      end associate
    end do
  end subroutine add_mean_dilatation

  !> C3D8I: of nodes, with gradients g_a + M^T g_a0, and of modes, F_0 m_k (x) e_J; the modes are
  !> eliminated.
  pure subroutine condense_modes(element, modes, law, k, negative)
    type(finite_element_t), intent(in) :: element
    real(wp), intent(in) :: modes(3, 3)
    type(law_t), intent(in) :: law
    real(wp), intent(out) :: k(24, 24)
    integer, intent(out) :: negative
    real(wp) :: full(33, 33), h(3, 3, 8), a(3, 3, 3, 3), p(3, 3), by_node(3, 8), by_mode(3, 3)
    real(wp) :: both(24, 9), common(8, 3)
    integer :: g, i, j, node

    h = gradients_of_law(element, modes)
    full = 0.0_wp
    do g = 1, 8
      a = element%weight(g)*finite_tangent(law, h(:, :, g))
      p = element%weight(g)*finite_stress(law, h(:, :, g))
      by_node = element%gradient(:, :, g) + matmul(transpose(mode_part(element, modes, g)), &
        element%at_centre)
      by_mode = moved_modes(element, g)
      full(10:, 10:) = full(10:, 10:) + couple(a, by_node, by_node)
      full(:9, :9) = full(:9, :9) + couple(reshape(a, [3, 3, 3, 3], order=[2, 1, 4, 3]), by_mode, &
        by_mode)
      both = couple(reshape(a, [3, 3, 3, 3], order=[1, 2, 4, 3]), by_node, by_mode)
      ! P : (du_a (x) g_a0) (m_k (x) dbeta_k)
      common = matmul(transpose(element%at_centre), element%mode(:, :, g))
      do i = 1, 3
        do node = 1, 8
          both(3*node - 2:3*node, 3*i - 2:3*i) = both(3*node - 2:3*node, 3*i - 2:3*i) + &
            common(node, i)*p
        end do
      end do
      full(:9, 10:) = full(:9, 10:) + transpose(both)
    end do
    negative = 0
    do i = 1, 9
      if (full(i, i) < 0.0_wp) negative = negative + 1
      do j = i + 1, 33
        full(i + 1:min(j, 9), j) = full(i + 1:min(j, 9), j) - full(i, i + 1:min(j, 9))* &
          (full(i, j)/full(i, i))
        if (j > 9) full(10:, j) = full(10:, j) - full(i, 10:)*(full(i, j)/full(i, i))
      end do
    end do
    k = full(10:, 10:)
  end subroutine condense_modes

  !> Stiffness of C3D8I's modes, the displacements of its nodes held.
  pure function mode_stiffness(element, modes, law) result(k)
    type(finite_element_t), intent(in) :: element !! C3D8I, det F > 0
    real(wp), intent(in) :: modes(3, 3)           !! [length]
    type(law_t), intent(in) :: law
    real(wp) :: k(9, 9)                           !! mode by mode, component first [force/length]
    real(wp) :: h(3, 3, 8)
    integer :: g

    h = gradients_of_law(element, modes)
    k = 0.0_wp
    do g = 1, 8
      k = k + couple(reshape(element%weight(g)*finite_tangent(law, h(:, :, g)), [3, 3, 3, 3], &
        order=[2, 1, 4, 3]), moved_modes(element, g), moved_modes(element, g))
    end do
  end function mode_stiffness

  !> F_0 m_k at a Gauss point.
  pure function moved_modes(element, g) result(moved)
    type(finite_element_t), intent(in) :: element
    integer, intent(in) :: g
    real(wp) :: moved(3, 3) !! [1/length]

    moved = element%mode(:, :, g) + matmul(element%h_0, element%mode(:, :, g))
  end function moved_modes

end module element_tangent_mod
