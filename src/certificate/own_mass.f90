!> The mass of bodies as the certificate has it: from the mesh and the contact points, by its own
!> integrals and its own sums. docs/theory.md, section 13.
module own_mass_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: cross, determinant, solve_small
  use cells_mod, only: cells
  use connectivity_mod, only: nodes_of_element
  use mesh_mod, only: mesh_t, deck_rounding, plane_strain, plane_stress, axisymmetric
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use turning_weights_mod, only: points_t, find_points
  implicit none
  private

  public :: own_mass_t, own_mass_of, nodal_masses, weigh, inertia_off, momentum_about_centres

  !> What is spread over elements, what stands at nodes, and the inertia of pieces by integrals.
  type :: own_mass_t
    integer :: step = 0
    integer,  allocatable :: first(:)   !! (n_elements+1) entries of each element before contact
    real(wp), allocatable :: spread(:)  !! consistent masses of elements away from it [mass]
    real(wp), allocatable :: at_node(:) !! (n_nodes) [mass]
    real(wp), allocatable :: inertia(:, :, :)  !! (6,6,n_pieces) by integrals [mass]
    real(wp), allocatable :: of_sum(:, :, :)   !! (6,6,n_pieces) of the two above [mass]
    real(wp), allocatable :: carried(:, :, :)
    !! (3,6,n_nodes) momentum of these sums along rigid motions of each piece [mass]
    logical,  allocatable :: counts(:, :)      !! (6,n_pieces) motions that are put right
    real(wp), allocatable :: centre(:, :)      !! (3,n_pieces) about which motions turn [length]
    real(wp), allocatable :: reach(:)          !! (n_pieces) that turns are divided by [length]
  end type own_mass_t

contains

  !> The mass in a *STEP.
  pure type(own_mass_t) function own_mass_of(scene, points, step, held) result(own)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: step
    logical, intent(in) :: held(:, :)      !! (3,n_nodes) by supports
    type(points_t) :: of_cell(size(cells)) !! those that are needed
    logical :: is_skin(scene%mesh%n_nodes)
    integer :: e, n, k

    own%step = step
    is_skin = .false.
    do k = 1, points%n
      is_skin(points%node(k)) = .true.
    end do
    associate (mesh => scene%mesh)
      allocate (own%first(mesh%n_elements + 1), source=1)
      allocate (own%at_node(mesh%n_nodes), own%centre(3, mesh%n_pieces), &
        own%reach(mesh%n_pieces), own%inertia(6, 6, mesh%n_pieces), &
        own%of_sum(6, 6, mesh%n_pieces), own%carried(3, 6, mesh%n_nodes), source=0.0_wp)
      do e = 1, mesh%n_elements
        n = size(nodes_of_element(mesh%connectivity, e))
        own%first(e + 1) = own%first(e)
        if (.not. any(is_skin(nodes_of_element(mesh%connectivity, e)))) own%first(e + 1) = &
          own%first(e) + n*n
      end do
      allocate (own%spread(own%first(mesh%n_elements + 1) - 1), source=0.0_wp)
      call find_middles(mesh, own)
      do e = 1, mesh%n_elements
        associate (cell => mesh%connectivity%cell(e))
          if (.not. allocated(of_cell(cell)%weight)) call find_points(cell, of_cell(cell))
          call take_element(scene, e, of_cell(cell), is_skin, own)
        end associate
      end do
      ! What stands in the deformed body does not turn with it.
      own%counts = .not. (are_barred(scene, step, held) .or. scene%finite_strain)
    end associate
    call sum_inertia(scene%mesh, own)
  end function own_mass_of

  !> Where the pieces are, and how far they reach.
  pure subroutine find_middles(mesh, own)
    type(mesh_t), intent(in) :: mesh
    type(own_mass_t), intent(inout) :: own
    integer :: n(mesh%n_pieces), node

    n = 0
    do node = 1, mesh%n_nodes
      associate (p => mesh%piece(node))
        if (p == 0) cycle
        n(p) = n(p) + 1
        own%centre(:, p) = own%centre(:, p) + mesh%coordinates(:, node)
      end associate
    end do
    own%centre = own%centre/spread(real(max(1, n), wp), 1, 3)
    do node = 1, mesh%n_nodes
      associate (p => mesh%piece(node))
        if (p > 0) own%reach(p) = max(own%reach(p), norm2(mesh%coordinates(:, node) - &
          own%centre(:, p)))
      end associate
    end do
  end subroutine find_middles

  !> The mass of an element, and its inertia.
  pure subroutine take_element(scene, e, points, is_skin, own)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: e
    type(points_t), intent(in) :: points     !! of its cell
    logical, intent(in) :: is_skin(:)        !! (n_nodes)
    type(own_mass_t), intent(inout) :: own
    real(wp) :: jacobian(3, 3), place(3), motion(3, 6)
    real(wp), allocatable :: square(:)
    real(wp) :: mass, total
    integer :: g, a, b, n

    associate (mesh => scene%mesh, nodes => nodes_of_element(scene%mesh%connectivity, e))
      n = size(nodes)
      allocate (square(n), source=0.0_wp)
      total = 0.0_wp
      do g = 1, size(points%weight)
        jacobian = matmul(mesh%coordinates(:, nodes) - spread(mesh%coordinates(:, nodes(1)), 2, &
          n), transpose(points%slope(:, :, g)))
        mass = scene%materials(mesh%material(e))%density*points%weight(g)*determinant(jacobian)
        total = total + mass
        square = square + mass*points%value(:, g)**2
        place = matmul(mesh%coordinates(:, nodes), points%value(:, g))
        associate (p => mesh%piece(nodes(1)))
          motion = motions_of(own, p, place)
          own%inertia(:, :, p) = own%inertia(:, :, p) + mass*matmul(transpose(motion), motion)
        end associate
        if (own%first(e + 1) == own%first(e)) cycle
        do b = 1, n
          do a = 1, n
            associate (entry => own%spread(own%first(e) + n*(b - 1) + a - 1))
              entry = entry + mass*points%value(a, g)*points%value(b, g)
            end associate
          end do
        end do
      end do
      if (own%first(e + 1) > own%first(e)) return
      square = square*(total/sum(square))
      do a = 1, n
        if (.not. is_skin(nodes(a))) then
          own%at_node(nodes(a)) = own%at_node(nodes(a)) + square(a)
        else if (any(.not. is_skin(nodes))) then
          associate (to => beside(mesh%connectivity%cell(e), a, pack([(b, b=1, n)], &
                     .not. is_skin(nodes))))
            own%at_node(nodes(to)) = own%at_node(nodes(to)) + square(a)/size(to)
          end associate
        end if
      end do
      if (all(is_skin(nodes))) then
        associate (to => nearest_inside(mesh, nodes, is_skin))
          own%at_node(to) = own%at_node(to) + total/max(1, size(to))
        end associate
      end if
    end associate
  end subroutine take_element

  !> Those of some nodes of a cell that have an edge in common with one: its middle, else its other
  !> end; all of them where none has.
  pure function beside(cell, a, those) result(to)
    integer, intent(in) :: cell, a
    integer, intent(in) :: those(:) !! in the cell
    integer, allocatable :: to(:)
    integer :: kind(size(those)), i, k

    kind = 3
    do k = 1, size(those)
      do i = 1, cells(cell)%n_edges
        associate (ends => cells(cell)%edge(:, i), middle => merge(cells(cell)%n_corners + i, 0, &
                   cells(cell)%n_nodes > cells(cell)%n_corners))
          if (any(ends == a) .and. middle == those(k)) kind(k) = min(kind(k), 1)
          if (any(ends == a) .and. any(ends == those(k))) kind(k) = min(kind(k), 2)
          if (middle == a .and. any(ends == those(k))) kind(k) = min(kind(k), 2)
        end associate
      end do
    end do
    to = pack(those, kind == minval(kind))
  end function beside

  !> Up to three nodes off the skin, of those that the fewest elements lie before the nearest.
  pure function nearest_inside(mesh, nodes, is_skin) result(to)
    type(mesh_t), intent(in) :: mesh
    integer, intent(in) :: nodes(:)
    logical, intent(in) :: is_skin(:)
    integer, allocatable :: to(:)
    logical :: has(mesh%n_nodes), next(mesh%n_nodes)
    real(wp) :: middle(3)
    integer :: e, k, best

    has = .false.
    has(nodes) = .true.
    do
      next = has
      do e = 1, mesh%n_elements
        associate (of => nodes_of_element(mesh%connectivity, e))
          if (any(has(of))) next(of) = .true.
        end associate
      end do
      if (any(next .and. .not. is_skin) .or. .not. any(next .neqv. has)) exit
      has = next
    end do
    next = next .and. .not. is_skin
    middle = [(sum(mesh%coordinates(k, nodes))/size(nodes), k=1, 3)]
    allocate (to(0))
    do while (size(to) < 3 .and. any(next))
      best = 0
      do k = 1, mesh%n_nodes
        if (.not. next(k)) cycle
        if (best == 0) then
          best = k
        else if (norm2(mesh%coordinates(:, k) - middle) < norm2(mesh%coordinates(:, best) - &
          middle)) then
          best = k
        end if
      end do
      to = [to, best]
      next(best) = .false.
    end do
  end function nearest_inside

  !> Unit translations and rotations at a place.
  pure function motions_of(own, p, place) result(motion)
    type(own_mass_t), intent(in) :: own
    integer, intent(in) :: p             !! piece
    real(wp), intent(in) :: place(3)     !! [length]
    real(wp) :: motion(3, 6)             !! [-]
    integer :: i

    motion = 0.0_wp
    do i = 1, 3
      motion(i, i) = 1.0_wp
      motion(:, 3 + i) = cross(motion(:, i), (place - own%centre(:, p))/own%reach(p))
    end do
  end function motions_of

  !> Motions across planes of symmetry, and across the plane of a slice.
  pure function are_barred(scene, step, held) result(barred)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step
    logical, intent(in) :: held(:, :)    !! (3,n_nodes)
    logical :: barred(6, scene%mesh%n_pieces)
    real(wp) :: end(2), width
    logical :: rests(3, scene%mesh%n_nodes)
    integer :: p, axis, k, s, i, n, other

    barred = .false.
    if (any(scene%mesh%plane == [plane_strain, plane_stress, axisymmetric])) then
      barred(3, :) = .true.
      barred(4:5, :) = .true.
      if (scene%mesh%plane == axisymmetric) barred(1, :) = .true.
      if (scene%mesh%plane == axisymmetric) barred(6, :) = .true.
      return
    end if
    rests = held
    do s = 1, step
      do i = 1, size(scene%steps(s)%boundary)
        associate (b => scene%steps(s)%boundary(i))
          rests(b%dof, b%node) = held(b%dof, b%node) .and. .not. abs(b%value) > 0.0_wp
        end associate
      end do
    end do
    associate (x => scene%mesh%coordinates, piece => scene%mesh%piece)
      width = max(1.0e-9_wp*maxval([(maxval(x(i, :)) - minval(x(i, :)), i=1, 3)]), &
        16.0_wp*deck_rounding(x, scene%mesh%origin))
      do p = 1, scene%mesh%n_pieces
        do axis = 1, 3
          end = [minval(x(axis, :), mask=piece == p), maxval(x(axis, :), mask=piece == p)]
          ends: do k = 1, 2
            n = 0
            do i = 1, size(piece)
              if (piece(i) /= p .or. abs(x(axis, i) - end(k)) > width) cycle
              n = n + 1
              if (.not. rests(axis, i)) cycle ends
            end do
            if (n < 3) cycle ends
            do other = 1, 3
              if (other == axis) cycle
              associate (aside => piece /= p .or. abs(x(axis, :) - end(k)) > width)
                if (all(held(other, :) .or. aside)) cycle ends
              end associate
            end do
            barred(axis, p) = .true.
            do i = 1, 3
              if (i /= axis) barred(3 + i, p) = .true.
            end do
          end do ends
        end do
      end do
    end associate
  end function are_barred

  !> The inertia that the sums have.
  pure subroutine sum_inertia(mesh, own)
    type(mesh_t), intent(in) :: mesh
    type(own_mass_t), intent(inout) :: own
    real(wp) :: field(3, mesh%n_nodes, 6), answer(3, mesh%n_nodes)
    integer :: node, k, l

    field = 0.0_wp
    do node = 1, mesh%n_nodes
      if (mesh%piece(node) > 0) field(:, node, :) = motions_of(own, mesh%piece(node), &
        mesh%coordinates(:, node))
    end do
    do k = 1, 6
      call add_sums(mesh, own, field(:, :, k), answer)
      own%carried(:, k, :) = answer
      do node = 1, mesh%n_nodes
        if (mesh%piece(node) == 0) cycle
        do l = 1, 6
          associate (entry => own%of_sum(l, k, mesh%piece(node)))
            entry = entry + dot_product(field(:, node, l), answer(:, node))
          end associate
        end do
      end do
    end do
  end subroutine sum_inertia

  !> How far the inertia that the sums have is from that by integrals, along the rigid motions of
  !> pieces: their centres and moments of inertia. 0 where it is put right.
  pure real(wp) function inertia_off(own) result(off)
    type(own_mass_t), intent(in) :: own
    integer :: p, i, k

    off = 0.0_wp
    do p = 1, size(own%reach)
      if (any(own%counts(:, p))) cycle
      do i = 1, 6
        do k = 1, 6
          off = max(off, abs(own%of_sum(i, k, p) - own%inertia(i, k, p))/sqrt( &
            own%inertia(i, i, p)*own%inertia(k, k, p)))
        end do
      end do
    end do
  end function inertia_off

  !> The angular momentum of each piece about its centre of mass, of velocities, or the torque of
  !> forces: sum of x x M v, and of x x f.
  pure function momentum_about_centres(mesh, own, x, f) result(momentum)
    type(mesh_t), intent(in) :: mesh
    type(own_mass_t), intent(in) :: own
    real(wp), intent(in) :: x(:, :), f(:, :)   !! (3,n_nodes) places, and momenta or forces
    real(wp) :: momentum(3, mesh%n_pieces)
    real(wp) :: centre(3, mesh%n_pieces), weight(mesh%n_pieces), one(3, mesh%n_nodes)
    integer :: node

    one = 1.0_wp
    one = weigh(mesh, own, one)
    centre = 0.0_wp
    weight = 0.0_wp
    do node = 1, mesh%n_nodes
      associate (p => mesh%piece(node))
        if (p == 0) cycle
        centre(:, p) = centre(:, p) + one(1, node)*x(:, node)
        weight(p) = weight(p) + one(1, node)
      end associate
    end do
    centre = centre/spread(weight, 1, 3)
    momentum = 0.0_wp
    do node = 1, mesh%n_nodes
      associate (p => mesh%piece(node))
        if (p > 0) momentum(:, p) = momentum(:, p) + cross(x(:, node) - centre(:, p), f(:, node))
      end associate
    end do
  end function momentum_about_centres

  !> The masses of elements and nodes times a field.
  pure subroutine add_sums(mesh, own, a, f)
    type(mesh_t), intent(in) :: mesh
    type(own_mass_t), intent(in) :: own
    real(wp), intent(in) :: a(:, :)   !! (3,n_nodes)
    real(wp), intent(out) :: f(:, :)
    real(wp) :: of_node(3)
    integer :: e, i, j, k

    f = spread(own%at_node, 1, 3)*a
    do e = 1, mesh%n_elements
      if (own%first(e + 1) == own%first(e)) cycle
      associate (nodes => nodes_of_element(mesh%connectivity, e))
        k = own%first(e)
        do j = 1, size(nodes)
          of_node = 0.0_wp
          do i = 1, size(nodes)
            of_node = of_node + own%spread(k)*a(:, nodes(i))
            k = k + 1
          end do
          f(:, nodes(j)) = f(:, nodes(j)) + of_node
        end do
      end associate
    end do
  end subroutine add_sums

  !> The mass that nodes have by themselves; 0 of those that have none.
  pure function nodal_masses(mesh, own) result(mass)
    type(mesh_t), intent(in) :: mesh
    type(own_mass_t), intent(in) :: own
    real(wp) :: mass(mesh%n_nodes)       !! [mass]
    integer :: e, a

    mass = own%at_node
    do e = 1, mesh%n_elements
      if (own%first(e + 1) == own%first(e)) cycle
      associate (nodes => nodes_of_element(mesh%connectivity, e))
        do a = 1, size(nodes)
          mass(nodes(a)) = mass(nodes(a)) + own%spread(own%first(e) + (a - 1)*(size(nodes) + 1))
        end do
      end associate
    end do
  end function nodal_masses

  !> The mass times accelerations, or velocities: of what is left of these beside the rigid motion
  !> with the same momentum, the sums of elements and nodes; of that, its inertia by integrals.
  pure function weigh(mesh, own, a) result(f)
    type(mesh_t), intent(in) :: mesh
    type(own_mass_t), intent(in) :: own
    real(wp), intent(in) :: a(:, :)      !! (3,n_nodes)
    real(wp) :: f(3, size(a, 2))
    real(wp) :: momentum(6, mesh%n_pieces), lacks(6, mesh%n_pieces)
    real(wp) :: system(6, 6), rate(6), rest(6)
    integer :: node, p, k, i
    logical :: is_regular

    call add_sums(mesh, own, a, f)
    if (.not. any(own%counts)) return
    momentum = 0.0_wp
    do node = 1, mesh%n_nodes
      p = mesh%piece(node)
      if (p == 0) cycle
      do k = 1, 6
        momentum(k, p) = momentum(k, p) + dot_product(own%carried(:, k, node), a(:, node))
      end do
    end do
    lacks = 0.0_wp
    do p = 1, mesh%n_pieces
      system = own%of_sum(:, :, p)
      do i = 1, 6
        if (own%counts(i, p)) cycle
        system(:, i) = 0.0_wp
        system(i, :) = 0.0_wp
        system(i, i) = own%of_sum(1, 1, p)
        momentum(i, p) = 0.0_wp
      end do
      call solve_small(system, momentum(:, p), rate, is_regular)
      rest = matmul(own%inertia(:, :, p) - own%of_sum(:, :, p), rate)
      where (.not. own%counts(:, p)) rest = 0.0_wp
      call solve_small(system, rest, lacks(:, p), is_regular)
    end do
    do node = 1, mesh%n_nodes
      p = mesh%piece(node)
      if (p > 0) f(:, node) = f(:, node) + matmul(own%carried(:, :, node), lacks(:, p))
    end do
  end function weigh

end module own_mass_mod
