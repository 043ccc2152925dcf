!> The whole mesh at finite strain: internal forces and strain energy, summed over the elements, and
!> what is asked of one element of it.
module finite_forces_mod
  use kinds_mod, only: wp
  use cells_mod, only: has_middles
  use connectivity_mod, only: nodes_of_element, nodes_of_hexahedron
  use mesh_mod, only: mesh_t, kind_c3d8i
  use scene_mod, only: material_t
  use element_laws_mod, only: law_at
  use state_mod, only: modes_t
  use small_matrix_mod, only: inverse
  use strain_measures_mod, only: growth_of, deformation_of, green_strain, logarithmic_strain
  use material_law_mod, only: finite_stress, finite_energy
  use logarithmic_stress_mod, only: logarithmic_stress
  use finite_strain_mod, only: finite_element_t, finite_element, is_inverted, gradients_of_law, &
    stresses_of, forces_on_nodes, energy_of
  use element_tangent_mod, only: tangent_of, project
  use relaxed_modes_mod, only: relax_modes, find_modes
  use expansion_mod, only: expand_freely
  use second_order_mod, only: second_order_t
  use spring_forces_mod, only: add_spring_forces, add_tangent_forces, spring_energy
  use finite_second_order_mod, only: expand_element, look_inside_out, force_of, &
    tangent_of_second_order => tangent_of, energy_of_second_order => energy_of
  implicit none
  private

  public :: tangent_t, element_tangent, tangent_force
  public :: finite_internal_force, finite_strain_energy, finite_strain_energies, &
    elastic_gradients, finite_tensors, undeformed_tensors, logarithmic_stresses, work_of_heat

  !> Where a tangent is taken.
  type :: tangent_t
    real(wp), allocatable :: at(:, :) !! (3,n_nodes) displacement, det F > 0 [length]
    real(wp), allocatable :: free(:)  !! (n_elements) strain by free expansion there [-]
    real(wp) :: projection = 1.0_wp   !! part of what is negative in each element's, left out [-]
    type(modes_t) :: modes            !! at `at`, where they are known
  end type tangent_t

  real(wp), parameter :: no_modes(3, 3) = 0.0_wp

contains

  !> f_a = int P g_a, summed over the elements, and an element with det F <= 0 at a Gauss point (of
  !> second order: or at a node), or that would shrink to nothing, whose stress no law gives, or
  !> whose modes find no equilibrium: then forces are 0.
  pure subroutine finite_internal_force(mesh, materials, free, u, modes, f, inverted)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    real(wp), intent(in) :: free(:)    !! (n_elements) strain by free expansion [-]
    real(wp), intent(in) :: u(:, :)    !! (3,n_nodes) displacement [length]
    type(modes_t), intent(inout) :: modes !! of a displacement nearby, or none, in; of `u` out
    real(wp), intent(out) :: f(:, :)   !! (3,n_nodes) [force]
    integer, intent(out) :: inverted   !! element, 0: there is none
    type(finite_element_t) :: element
    type(second_order_t) :: of_second_order
    real(wp), allocatable :: h(:, :, :)
    real(wp), dimension(3, 8) :: force, x, moved
    logical :: is_whole, is_inside_out
    integer :: e, a, nodes(8)

    if (any(mesh%element_kind == kind_c3d8i) .and. .not. allocated(modes%amplitude)) allocate ( &
      modes%amplitude(3, 3, mesh%n_elements), modes%inverse(9, 9, mesh%n_elements), source=0.0_wp)
    f = 0.0_wp
    inverted = findloc(free <= -1.0_wp, .true., dim=1)
    if (inverted > 0) return
    do e = 1, mesh%n_elements
      if (has_middles(mesh%connectivity%cell(e))) then
        associate (its => nodes_of_element(mesh%connectivity, e))
          call find_second_order(mesh, free(e), u, e, of_second_order, h)
          call look_inside_out(mesh%coordinates(:, its) + u(:, its), h, of_second_order, &
            is_inside_out)
          if (is_inside_out) then
            inverted = e
            f = 0.0_wp
            return
          end if
          f(:, its) = f(:, its) + force_of(of_second_order, h, law_at(mesh, materials, e))
        end associate
        cycle
      end if
      nodes = nodes_of_hexahedron(mesh%connectivity, e)
      x = mesh%coordinates(:, nodes)
      moved = u(:, nodes)
      call expand_freely(free(e), x, moved)
      call finite_element(mesh%element_kind(e), x, moved, element)
      associate (law => law_at(mesh, materials, e))
        if (mesh%element_kind(e) == kind_c3d8i) then
          is_whole = any(abs(modes%inverse(:, :, e)) > 0.0_wp)
          if (is_whole) call relax_modes(element, law, modes%amplitude(:, :, e), &
            modes%inverse(:, :, e), is_whole)
          if (.not. is_whole) call find_modes(x, moved, law, modes%amplitude(:, :, e), &
            modes%inverse(:, :, e), is_whole)
          if (is_whole) force = forces_on_nodes(element, modes%amplitude(:, :, e), stresses_of( &
            element, modes%amplitude(:, :, e), law))
        else
          is_whole = .not. is_inverted(element)
          if (is_whole) force = forces_on_nodes(element, no_modes, stresses_of(element, no_modes, &
            law))
        end if
      end associate
      if (.not. is_whole) then
        inverted = e
        f = 0.0_wp
        return
      end if
      do a = 1, 8
        f(:, nodes(a)) = f(:, nodes(a)) + force(:, a)
      end do
    end do
    call add_spring_forces(mesh, u, .true., f)
  end subroutine finite_internal_force

  !> An element from where it has expanded freely, and the amplitudes of its modes.
  pure subroutine find_element(mesh, materials, free, u, e, element, modes, known)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    real(wp), intent(in) :: free             !! its strain by free expansion [-]
    real(wp), intent(in) :: u(:, :)          !! (3,n_nodes) displacement, det F > 0 [length]
    integer, intent(in) :: e                 !! element
    type(finite_element_t), intent(out) :: element
    real(wp), intent(out) :: modes(3, 3)     !! as of finite_force, 0 of other kinds [length]
    type(modes_t), intent(in), optional :: known !! of the mesh at `u`, or none
    real(wp) :: x(3, 8), moved(3, 8), inverse_stiffness(9, 9)
    logical :: is_found
    integer :: nodes(8)

    nodes = nodes_of_hexahedron(mesh%connectivity, e)
    x = mesh%coordinates(:, nodes)
    moved = u(:, nodes)
    call expand_freely(free, x, moved)
    call finite_element(mesh%element_kind(e), x, moved, element)
    modes = 0.0_wp
    if (mesh%element_kind(e) /= kind_c3d8i) return
    if (present(known)) then
      if (allocated(known%amplitude)) then
        modes = known%amplitude(:, :, e)
        return
      end if
    end if
    call find_modes(x, moved, law_at(mesh, materials, e), modes, inverse_stiffness, is_found)
    if (.not. is_found) modes = 0.0_wp
  end subroutine find_element

  !> An element of second order from where it has expanded freely, and the gradients of its
  !> displacement at its points.
  pure subroutine find_second_order(mesh, free, u, e, element, h)
    type(mesh_t), intent(in) :: mesh
    real(wp), intent(in) :: free             !! its strain by free expansion [-]
    real(wp), intent(in) :: u(:, :)          !! (3,n_nodes) displacement [length]
    integer, intent(in) :: e                 !! element
    type(second_order_t), intent(inout) :: element !! another one, or none
    real(wp), allocatable, intent(inout) :: h(:, :, :) !! (3,3,n_points) [-]

    associate (nodes => nodes_of_element(mesh%connectivity, e))
      call expand_element(mesh%connectivity%cell(e), mesh%coordinates(:, nodes), u(:, nodes), &
        free, element, h)
    end associate
  end subroutine find_second_order

  !> The strain energy of all elements, int W dV, and that of the springs.
  pure real(wp) function finite_strain_energy(mesh, materials, free, u, modes) result(energy)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    real(wp), intent(in) :: free(:)       !! (n_elements) strain by free expansion [-]
    real(wp), intent(in) :: u(:, :)       !! (3,n_nodes) displacement, det F > 0 [length]
    type(modes_t), intent(in) :: modes    !! of `u`

    energy = sum(finite_strain_energies(mesh, materials, free, u, modes))
  end function finite_strain_energy

  !> The same of each body; of springs first.
  pure function finite_strain_energies(mesh, materials, free, u, modes) result(energy)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    real(wp), intent(in) :: free(:), u(:, :) !! as of finite_strain_energy
    type(modes_t), intent(in) :: modes
    real(wp) :: energy(0:mesh%n_bodies)      !! [energy]
    type(finite_element_t) :: element
    type(second_order_t) :: of_second_order
    real(wp), allocatable :: h(:, :, :)
    real(wp) :: x(3, 8), moved(3, 8), of_element(3, 3)
    integer :: e, nodes(8)

    energy = 0.0_wp
    energy(0) = spring_energy(mesh, u, .true.)
    of_element = 0.0_wp
    do e = 1, mesh%n_elements
      associate (here => energy(mesh%body(mesh%connectivity%node(mesh%connectivity%first(e)))))
        if (has_middles(mesh%connectivity%cell(e))) then
          call find_second_order(mesh, free(e), u, e, of_second_order, h)
          here = here + energy_of_second_order(of_second_order, h, law_at(mesh, materials, e))
          cycle
        end if
        nodes = nodes_of_hexahedron(mesh%connectivity, e)
        x = mesh%coordinates(:, nodes)
        moved = u(:, nodes)
        call expand_freely(free(e), x, moved)
        call finite_element(mesh%element_kind(e), x, moved, element)
        if (allocated(modes%amplitude)) of_element = modes%amplitude(:, :, e)
        here = here + energy_of(element, of_element, law_at(mesh, materials, e))
      end associate
    end do
  end function finite_strain_energies

  !> What the strain energy changes by as elements expand further, (1 + free)^3 W(F/(1 + free)) at
  !> the same F: of an element W less a third of P : F, times the growth of its free volume.
  pure real(wp) function work_of_heat(mesh, materials, free, u, further) result(work)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    real(wp), intent(in) :: free(:)    !! (n_elements) strain by free expansion [-]
    real(wp), intent(in) :: u(:, :)    !! (3,n_nodes) displacement, det F > 0 [length]
    real(wp), intent(in) :: further(:) !! (n_elements) by how much more they expand [-]
    type(finite_element_t) :: element
    type(second_order_t) :: of_second_order
    real(wp), allocatable :: h(:, :, :), weight(:)
    real(wp) :: modes(3, 3), of_element
    integer :: e, g

    work = 0.0_wp
    allocate (h(3, 3, 8), weight(8))
    do e = 1, mesh%n_elements
      if (.not. abs(further(e)) > 0.0_wp) cycle
      if (has_middles(mesh%connectivity%cell(e))) then
        call find_second_order(mesh, free(e), u, e, of_second_order, h)
        weight = of_second_order%weight(:size(h, 3))
      else
        call find_element(mesh, materials, free(e), u, e, element, modes)
        h = gradients_of_law(element, modes)
        weight = element%weight
      end if
      of_element = 0.0_wp
      associate (law => law_at(mesh, materials, e))
        do g = 1, size(weight)
          of_element = of_element + weight(g)*(finite_energy(law, h(:, :, g)) - &
            sum(finite_stress(law, h(:, :, g))*deformation_of(h(:, :, g)))/3.0_wp)
        end do
      end associate
      work = work + 3.0_wp*further(e)/(1.0_wp + free(e))*of_element
    end do
  end function work_of_heat

  !> Tangent of an element, docs/theory.md (8.22).
  !>
  !> Projected: without what is negative in it, the next positive semi-definite matrix. A soft body
  !> that is pressed has a tangent that is not positive, and a compliance of which contact problems
  !> have several solutions.
  subroutine element_tangent(mesh, materials, tangent, e, k, n_negative)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    type(tangent_t), intent(in) :: tangent
    integer, intent(in) :: e           !! element
    real(wp), intent(out) :: k(:, :)
    !! node by node, x y z; without mid-side nodes (24,24), by the nodes of a hexahedron
    !! [force/length]
    integer, intent(out), optional :: n_negative !! pivots that the modes of C3D8I have
    type(second_order_t) :: of_second_order
    type(finite_element_t) :: element
    real(wp), allocatable :: h(:, :, :)
    real(wp) :: modes(3, 3)
    integer :: negative

    negative = 0
    if (has_middles(mesh%connectivity%cell(e))) then
      call find_second_order(mesh, tangent%free(e), tangent%at, e, of_second_order, h)
      k = tangent_of_second_order(of_second_order, h, law_at(mesh, materials, e))
    else
      call find_element(mesh, materials, tangent%free(e), tangent%at, e, element, modes, &
        tangent%modes)
      call tangent_of(element, modes, law_at(mesh, materials, e), k, negative)
    end if
    if (present(n_negative)) n_negative = negative
    if (tangent%projection > 0.0_wp) call project(tangent%projection, k)
  end subroutine element_tangent

  !> What displacements change forces by, by the tangents of another displacement.
  subroutine tangent_force(mesh, materials, tangent, u, f)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    type(tangent_t), intent(in) :: tangent
    real(wp), intent(in) :: u(:, :, :)  !! (3,n_nodes,n) of several displacements [length]
    real(wp), intent(out) :: f(:, :, :) !! (3,n_nodes,n) [force]
    real(wp), allocatable :: k(:, :), of_element(:, :)
    integer, allocatable :: nodes(:)
    integer :: e, g, a, n

    f = 0.0_wp
    allocate (nodes(8), k(24, 24), of_element(3, 8))
    do e = 1, mesh%n_elements
      if (has_middles(mesh%connectivity%cell(e))) then
        nodes = nodes_of_element(mesh%connectivity, e)
      else
        nodes = nodes_of_hexahedron(mesh%connectivity, e)
      end if
      if (.not. any(abs(u(:, nodes, :)) > 0.0_wp)) cycle
      n = 3*size(nodes)
      if (size(k, 1) /= n) then
        deallocate (k)
        allocate (k(n, n))
      end if
      call element_tangent(mesh, materials, tangent, e, k)
      do g = 1, size(u, 3)
        of_element = reshape(matmul(k, reshape(u(:, nodes, g), [n])), [3, size(nodes)])
        ! Nodes of one that is computed as a hexahedron may be there several times.
        do a = 1, size(nodes)
          f(:, nodes(a), g) = f(:, nodes(a), g) + of_element(:, a)
        end do
      end do
    end do
    call add_tangent_forces(mesh, tangent%at, tangent%projection, u, f)
  end subroutine tangent_force

  !> Logarithmic strain, that by expansion included, and Cauchy stress of an element at its Gauss
  !> points: sigma = P F^T/J. The strain is that of the gradients that the law is asked at.
  subroutine finite_tensors(mesh, materials, free, u, e, strain, stress)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    real(wp), intent(in) :: free               !! strain by free expansion [-]
    real(wp), intent(in) :: u(:, :)            !! (3,n_nodes) displacement [length]
    integer, intent(in) :: e                   !! element
    real(wp), intent(out) :: strain(:, :)      !! (6,n_points) XX YY ZZ XY YZ XZ [-]
    real(wp), intent(out) :: stress(:, :)      !! (6,n_points) [force/length^2]
    real(wp), dimension(3, 3, size(strain, 2)) :: of_law, h, p
    integer :: g

    call find_stresses(mesh, materials, free, u, e, of_law, h, p)
    do g = 1, size(strain, 2)
      strain(:, g) = six_of(logarithmic_strain(of_law(:, :, g)))
      ! F is free of stress times (1 + free).
      strain(:3, g) = strain(:3, g) + log(1.0_wp + free)
      stress(:, g) = six_of(matmul(p(:, :, g), transpose(deformation_of(h(:, :, g))))/ &
        (1.0_wp + growth_of(h(:, :, g))))
    end do
  end subroutine finite_tensors

  !> Green's strain, that by expansion included, and second Piola-Kirchhoff stress of an element at
  !> its Gauss points: S = F^-1 P, both of the volume and the places before any expansion.
  pure subroutine undeformed_tensors(mesh, materials, free, u, e, strain, stress)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    real(wp), intent(in) :: free               !! strain by free expansion [-]
    real(wp), intent(in) :: u(:, :)            !! (3,n_nodes) displacement [length]
    integer, intent(in) :: e                   !! element
    real(wp), intent(out) :: strain(:, :)      !! (6,n_points) XX YY ZZ XY YZ XZ [-]
    real(wp), intent(out) :: stress(:, :)      !! (6,n_points) [force/length^2]
    real(wp), dimension(3, 3, size(strain, 2)) :: of_law, h, p
    integer :: g

    call find_stresses(mesh, materials, free, u, e, of_law, h, p)
    do g = 1, size(strain, 2)
      ! F = (1 + free) F_e, and P = (1 + free)^2 P_e on the faces before the expansion.
      stress(:, g) = (1.0_wp + free)*six_of(matmul(inverse(deformation_of(h(:, :, g))), p(:, :, g)))
      strain(:, g) = (1.0_wp + free)**2*six_of(green_strain(of_law(:, :, g)))
      strain(:3, g) = strain(:3, g) + free*(1.0_wp + 0.5_wp*free)
    end do
  end subroutine undeformed_tensors

  !> The stresses that work on the logarithmic strains of an element at its Gauss points, a volume
  !> that expansion has made, and the gradients that the law is asked at.
  subroutine logarithmic_stresses(mesh, materials, free, u, e, of_law, stress)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    real(wp), intent(in) :: free                !! strain by free expansion [-]
    real(wp), intent(in) :: u(:, :)             !! (3,n_nodes) displacement, det F > 0 [length]
    integer, intent(in) :: e                    !! element, without mid-side nodes
    real(wp), intent(out) :: of_law(3, 3, 8)    !! [-]
    real(wp), intent(out) :: stress(6, 8)       !! XX YY ZZ XY YZ XZ [force/length^2]
    real(wp), dimension(3, 3, 8) :: h, p
    integer :: g

    call find_stresses(mesh, materials, free, u, e, of_law, h, p)
    do g = 1, 8
      stress(:, g) = six_of(logarithmic_stress(h(:, :, g), p(:, :, g)))
    end do
  end subroutine logarithmic_stresses

  !> The displacement gradients at the points of an element that the law is asked at: without free
  !> expansion.
  pure function elastic_gradients(mesh, materials, free, u, e) result(h)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    real(wp), intent(in) :: free            !! strain by free expansion [-]
    real(wp), intent(in) :: u(:, :)         !! (3,n_nodes) displacement, det F > 0 [length]
    integer, intent(in) :: e                !! element
    real(wp), allocatable :: h(:, :, :)     !! (3,3,n_points) [-]
    type(finite_element_t) :: element
    type(second_order_t) :: of_second_order
    real(wp) :: modes(3, 3)

    if (has_middles(mesh%connectivity%cell(e))) then
      call find_second_order(mesh, free, u, e, of_second_order, h)
      return
    end if
    call find_element(mesh, materials, free, u, e, element, modes)
    allocate (h, source=gradients_of_law(element, modes))
  end function elastic_gradients

  !> At the points of an element: the gradients of its law, those that its first Piola-Kirchhoff
  !> stresses P do work on (of C3D8B the nodes'), and P; from the free expansion.
  pure subroutine find_stresses(mesh, materials, free, u, e, of_law, h, p)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    real(wp), intent(in) :: free, u(:, :)
    integer, intent(in) :: e
    real(wp), dimension(:, :, :), intent(out) :: of_law, h, p
    !! (3,3,n_points) [-], [-], [force/length^2]
    type(finite_element_t) :: element
    real(wp) :: modes(3, 3)
    integer :: g

    if (has_middles(mesh%connectivity%cell(e))) then
      of_law = elastic_gradients(mesh, materials, free, u, e)
      h = of_law
      do g = 1, size(h, 3)
        p(:, :, g) = finite_stress(law_at(mesh, materials, e), h(:, :, g))
      end do
      return
    end if
    call find_element(mesh, materials, free, u, e, element, modes)
    of_law = gradients_of_law(element, modes)
    h = element%h
    if (element%kind == kind_c3d8i) h = of_law
    p = stresses_of(element, modes, law_at(mesh, materials, e))
  end subroutine find_stresses

  !> The six components of a symmetric tensor.
  pure function six_of(t) result(six)
    real(wp), intent(in) :: t(3, 3)
    real(wp) :: six(6)

    six = [t(1, 1), t(2, 2), t(3, 3), t(1, 2), t(2, 3), t(1, 3)]
  end function six_of

end module finite_forces_mod
