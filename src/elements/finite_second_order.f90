!> Elements of second order at finite strain: forces, tangent and energy of one, by the displacement
!> gradients H at the points of its quadrature.
!>
!>     f_a = sum of w P(H) g_a,   K_ab = sum of w A(H) : g_a (x) g_b,   W = sum of w W(H)
!>
!> det F > 0 is required at these points and at the nodes, as positive Jacobians of the mesh are: an
!> element may be inverted between few points. docs/theory.md (8.12), (8.22).
module finite_second_order_mod
  use kinds_mod, only: wp
  use strain_measures_mod, only: growth_of
  use material_law_mod, only: law_t, finite_stress, finite_tangent, finite_energy
  use element_tangent_mod, only: couple
  use second_order_mod, only: second_order_t, second_order, displacement_gradients, &
    find_jacobians_at_nodes
  use expansion_mod, only: expand_freely
  implicit none
  private

  public :: expand_element, look_inside_out, force_of, tangent_of, energy_of

contains

  !> An element from where it has expanded freely, and the gradients of its displacement from there
  !> at its points.
  pure subroutine expand_element(cell, x, u, free, element, h)
    integer,  intent(in) :: cell                   !! row of the table of cells
    real(wp), intent(in) :: x(:, :), u(:, :)       !! (3,n_nodes) nodes, how far they move [length]
    real(wp), intent(in) :: free                   !! strain by free expansion [-]
    type(second_order_t), intent(inout) :: element !! another one, or none
    real(wp), allocatable, intent(inout) :: h(:, :, :) !! (3,3,n_points) [-]
    real(wp), dimension(3, size(x, 2)) :: place, moved

    place = x
    moved = u
    call expand_freely(free, place, moved)
    call second_order(cell, place, element)
    if (allocated(h)) then
      if (size(h, 3) /= element%n_points) deallocate (h)
    end if
    if (.not. allocated(h)) allocate (h(3, 3, element%n_points))
    h = displacement_gradients(element, moved)
  end subroutine expand_element

  !> Whether det F <= 0 at a point of the quadrature or at a node.
  pure subroutine look_inside_out(place, h, element, is_inside_out)
    real(wp), intent(in) :: place(:, :)  !! (3,n_nodes) of displaced nodes [length]
    real(wp), intent(in) :: h(:, :, :)   !! (3,3,n_points) as of expand_element [-]
    type(second_order_t), intent(inout) :: element
    logical, intent(out) :: is_inside_out
    real(wp) :: determinants(size(place, 2))
    integer :: g

    call find_jacobians_at_nodes(place, element, determinants)
    is_inside_out = any(determinants <= 0.0_wp) .or. any([(growth_of(h(:, :, g)) <= -1.0_wp, g=1, &
      size(h, 3))])
  end subroutine look_inside_out

  !> The internal forces at the nodes.
  pure function force_of(element, h, law) result(f)
    type(second_order_t), intent(in) :: element
    real(wp), intent(in) :: h(:, :, :)     !! (3,3,n_points) det(I + H) > 0 [-]
    type(law_t), intent(in) :: law
    real(wp) :: f(3, element%n_nodes)      !! [force]
    real(wp) :: p(3, 3)
    integer :: g, a

    f = 0.0_wp
    do g = 1, element%n_points
      p = element%weight(g)*finite_stress(law, h(:, :, g))
      do a = 1, element%n_nodes
        associate (d => element%gradient(:, a, g))
          f(:, a) = f(:, a) + p(:, 1)*d(1) + p(:, 2)*d(2) + p(:, 3)*d(3)
        end associate
      end do
    end do
  end function force_of

  !> The second derivative of the energy by the displacements of the nodes.
  pure function tangent_of(element, h, law) result(k)
    type(second_order_t), intent(in) :: element
    real(wp), intent(in) :: h(:, :, :)     !! (3,3,n_points) det(I + H) > 0 [-]
    type(law_t), intent(in) :: law
    real(wp) :: k(3*element%n_nodes, 3*element%n_nodes) !! node by node, x y z [force/length]
    integer :: g

    k = 0.0_wp
    associate (n => element%n_nodes)
      do g = 1, element%n_points
        k = k + couple(element%weight(g)*finite_tangent(law, h(:, :, g)), &
          element%gradient(:, :n, g), element%gradient(:, :n, g))
      end do
    end associate
  end function tangent_of

  !> The strain energy, int W dV.
  pure real(wp) function energy_of(element, h, law) result(energy)
    type(second_order_t), intent(in) :: element
    real(wp), intent(in) :: h(:, :, :)     !! (3,3,n_points) det(I + H) > 0 [-]
    type(law_t), intent(in) :: law
    integer :: g

    energy = 0.0_wp
    do g = 1, element%n_points
      energy = energy + element%weight(g)*finite_energy(law, h(:, :, g))
    end do
  end function energy_of

end module finite_second_order_mod
