!> How much of each body is above its first yield stress, where a deck with *PLASTIC runs as elastic
!> (--elastic).
module yielded_bodies_mod
  use kinds_mod, only: wp
  use cells_mod, only: has_middles, most_points
  use connectivity_mod, only: first_points, nodes_of_element, nodes_of_hexahedron
  use hexahedron8_mod, only: jacobian_determinants
  use invariants_mod, only: von_mises
  use mesh_fields_mod, only: fill_tensors_of
  use mesh_mod, only: mesh_t
  use scene_mod, only: scene_t
  use second_order_mod, only: second_order_t, second_order
  use state_mod, only: state_t
  use step_fields_mod, only: tensor_field_t
  implicit none
  private

  public :: yielded_t, find_yielded

  !> A body whose materials have yield stresses.
  type :: yielded_t
    integer :: body = 0
    real(wp) :: share = 0.0_wp    !! of its volume, of Gauss points above the yield stress [-]
    real(wp) :: largest = 0.0_wp  !! of von Mises' stress over the yield stress [-]
    integer :: element = 0        !! that has it
  end type yielded_t

contains

  !> Bodies with yield stresses, by von Mises' stress at the Gauss points of a state.
  subroutine find_yielded(scene, state, yielded)
    type(scene_t), intent(in) :: scene
    type(state_t), intent(in) :: state
    type(yielded_t), allocatable, intent(out) :: yielded(:)
    type(yielded_t) :: of(scene%mesh%n_bodies)
    type(tensor_field_t) :: strain, stress
    real(wp) :: volume(scene%mesh%n_bodies)
    real(wp) :: ratio(most_points), weight(most_points)
    integer :: first(scene%mesh%n_elements + 1), e, i, n

    first = first_points(scene%mesh%connectivity)
    allocate (stress%at_gauss_points(6, first(size(first)) - 1))
    call fill_tensors_of(scene, state, strain, stress)
    of%body = [(i, i=1, size(of))]
    volume = 0.0_wp
    do e = 1, scene%mesh%n_elements
      associate (yield => scene%materials(scene%mesh%material(e))%yield, &
                 body => scene%mesh%body(scene%mesh%connectivity%node( &
                 scene%mesh%connectivity%first(e))))
        weight = weights_of(scene%mesh, e)
        volume(body) = volume(body) + sum(weight)
        if (.not. yield > 0.0_wp) cycle
        n = first(e + 1) - first(e)
        ratio(:n) = von_mises(stress%at_gauss_points(:, first(e):first(e + 1) - 1))/yield
        of(body)%share = of(body)%share + sum(weight(:n), ratio(:n) > 1.0_wp)
        if (of(body)%element > 0 .and. maxval(ratio(:n)) <= of(body)%largest) cycle
        of(body)%largest = maxval(ratio(:n))
        of(body)%element = e
      end associate
    end do
    where (volume > 0.0_wp) of%share = of%share/volume
    yielded = pack(of, of%element > 0)
  end subroutine find_yielded

  !> The volume that each Gauss point of an element stands for, zeros behind. [length^3]
  pure function weights_of(mesh, e) result(weight)
    type(mesh_t), intent(in) :: mesh
    integer, intent(in) :: e
    real(wp) :: weight(most_points)
    type(second_order_t) :: element
    real(wp) :: d(16)

    weight = 0.0_wp
    associate (cell => mesh%connectivity%cell(e))
      if (has_middles(cell)) then
        call second_order(cell, mesh%coordinates(:, nodes_of_element(mesh%connectivity, e)), &
          element)
        weight(:element%n_points) = element%weight(:element%n_points)
      else
        d = jacobian_determinants(mesh%coordinates(:, nodes_of_hexahedron(mesh%connectivity, e)))
        weight(:8) = d(:8)
      end if
    end associate
  end function weights_of

end module yielded_bodies_mod
