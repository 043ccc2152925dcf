!> Where a displacement takes the elements beyond what the laws of their materials hold for.
module law_limits_mod
  use kinds_mod, only: wp
  use cells_mod, only: has_middles
  use connectivity_mod, only: nodes_of_hexahedron
  use mesh_mod, only: mesh_t, kind_c3d8
  use scene_mod, only: material_t
  use element_laws_mod, only: law_at
  use ellipticity_mod, only: principal_stretches, is_elliptic, elliptic_reach
  use finite_forces_mod, only: elastic_gradients
  use inverted_elements_mod, only: gradient_bound
  implicit none
  private

  public :: stretched_t, find_limits, find_stretched

  !> A Gauss point and its principal stretches.
  type :: stretched_t
    integer :: element = 0              !! 0: none
    real(wp) :: stretch(3) = 1.0_wp     !! the largest first [-]
  end type stretched_t

contains

  !> How large grad u may be for a material to need no look: its law is strongly elliptic and within
  !> its usual stretches. The ellipticity of laws that are not isotropic is not looked at.
  pure elemental real(wp) function find_limits(material) result(limit)
    type(material_t), intent(in) :: material

    limit = min(1.0_wp - material%law%usual_from, material%law%usual_to - 1.0_wp)
    if (material%law%elastic%is_isotropic) limit = min(limit, elliptic_reach(material%law))
  end function find_limits

  !> The points that are stretched most where a law has lost its ellipticity, and of those beyond
  !> the usual stretches of their law. Laws are asked of what free expansion leaves, F/(1 + free).
  pure subroutine find_stretched(mesh, materials, limit, reach, free, u, lost, unusual)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    real(wp), intent(in) :: limit(:)    !! (n_materials) as of find_limits [-]
    real(wp), intent(in) :: reach(:, :) !! (3,n_elements) as of find_reach [1/length]
    real(wp), intent(in) :: free(:)     !! (n_elements) strain by free expansion [-]
    real(wp), intent(in) :: u(:, :)     !! (3,n_nodes) displacement, det F > 0 [length]
    type(stretched_t), intent(out) :: lost, unusual
    real(wp), allocatable :: h(:, :, :)
    real(wp) :: stretch(3)
    integer :: e, g, nodes(8)

    allocate (h(3, 3, 8))
    do e = 1, mesh%n_elements
      nodes = nodes_of_hexahedron(mesh%connectivity, e)
      associate (law => law_at(mesh, materials, e), within => limit(mesh%material(e)), &
        bound => gradient_bound(reach(:, e), u(:, nodes)))
        ! Edges between corners say nothing of modes, mean dilatations and mid-side nodes.
        if (mesh%element_kind(e) == kind_c3d8 .and. .not. has_middles(mesh%connectivity%cell(e)) &
          .and. bound + abs(free(e)) < within*(1.0_wp + free(e))) cycle
        h = elastic_gradients(mesh, materials, free(e), u, e)
        do g = 1, size(h, 3)
          stretch = principal_stretches(h(:, :, g))
          if (maxval(abs(stretch - 1.0_wp)) < within) cycle
          if (stretch(1) > law%usual_to .or. stretch(3) < law%usual_from) call take(unusual)
          if (.not. law%elastic%is_isotropic) cycle
          if (.not. is_elliptic(law, stretch)) call take(lost)
        end do
      end associate
    end do

  contains

    !> Keep the point that is stretched more, by the logarithms; of those that are alike the first.
    pure subroutine take(most)
      type(stretched_t), intent(inout) :: most
      real(wp), parameter :: alike = 1.0e-6_wp !! beyond what rounding and tolerances leave [-]

      if (most%element > 0) then
        if (maxval(abs(log(stretch))) <= maxval(abs(log(most%stretch))) + alike) return
      end if
      most = stretched_t(e, stretch)
    end subroutine take

  end subroutine find_stretched

end module law_limits_mod
