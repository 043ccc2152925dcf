!> What loads that follow the body add to its tangent. docs/theory.md (8.28), (8.30), (8.40).
module load_stiffness_mod
  use kinds_mod, only: wp
  use growing_lists_mod, only: append, enlarge
  use cells_mod, only: face_nodes, most_nodes
  use connectivity_mod, only: all_nodes_of_face, nodes_of_element
  use loads_mod, only: following_t
  use scene_mod, only: scene_t
  use faces_mod, only: face_area_vectors
  use node_products_mod, only: cell_functions_t, find_node_products
  use grips_mod, only: is_turning_mean
  use turning_couplings_mod, only: mean_stiffness
  use dof_map_mod, only: dof_map_t, interface_terms_of
  use assembly_mod, only: triplets_t
  implicit none
  private

  public :: load_stiffness_t, loaded_nodes, load_stiffnesses, mean_stiffnesses, add_load_stiffness

  !> -df/du of the forces on a face, an element, or a surface with a mean, by its nodes' places.
  type :: load_stiffness_t
    integer, allocatable :: node(:)   !! (n)
    real(wp), allocatable :: k(:, :)  !! (3n,3n) not symmetric [force/length]
  end type load_stiffness_t

  real(wp), parameter :: rounding = 1.0e-9_wp
  !! of the sum of what cancels between faces: that has cancelled [-]

contains

  !> The nodes of what such loads act on, and of surfaces with means that turn, with repeats.
  pure function loaded_nodes(scene, following) result(nodes)
    type(scene_t), intent(in) :: scene
    type(following_t), intent(in) :: following
    integer, allocatable :: nodes(:)
    integer :: its(face_nodes), s, i, n

    allocate (nodes(0))
    n = 0
    do s = 1, size(scene%surfaces)
      if (.not. abs(following%pressure(s)) > 0.0_wp) cycle
      associate (faces => scene%surfaces(s)%faces)
        do i = 1, size(faces, 2)
          its = all_nodes_of_face(scene%mesh%connectivity, faces(1, i), faces(2, i))
          call append(nodes, n, its(:count(its > 0)))
        end do
      end associate
    end do
    do s = 1, size(scene%regions)
      if (.not. any(abs(following%gradient(:, :, s)) > 0.0_wp)) cycle
      do i = 1, size(scene%regions(s)%elements)
        call append(nodes, n, nodes_of_element(scene%mesh%connectivity, &
          scene%regions(s)%elements(i)))
      end do
    end do
    if (allocated(scene%rotations)) then
      do i = 1, size(scene%rotations)
        if (is_turning_mean(scene, i)) call append(nodes, n, scene%rotations(i)%surface_nodes)
      end do
    end if
    nodes = nodes(:n)
  end function loaded_nodes

  !> What the forces of these loads change by, face by face and element by element.
  pure function load_stiffnesses(scene, following, u) result(all)
    type(scene_t), intent(in) :: scene
    type(following_t), intent(in) :: following
    real(wp), intent(in) :: u(:, :)              !! (3,n_nodes) [length]
    type(load_stiffness_t), allocatable :: all(:)
    real(wp) :: products(most_nodes, most_nodes)
    type(cell_functions_t) :: functions
    integer :: its(face_nodes), s, i, n, l, pass

    do pass = 1, 2
      l = 0
      do s = 1, size(scene%surfaces)
        if (.not. abs(following%pressure(s)) > 0.0_wp) cycle
        associate (faces => scene%surfaces(s)%faces)
          do i = 1, size(faces, 2)
            l = l + 1
            if (pass == 1) cycle
            its = all_nodes_of_face(scene%mesh%connectivity, faces(1, i), faces(2, i))
            all(l)%node = its(:count(its > 0))
            all(l)%k = following%pressure(s)*area_derivatives(scene%mesh%coordinates(:, &
              all(l)%node) + u(:, all(l)%node))
          end do
        end associate
      end do
      do s = 1, size(scene%regions)
        if (.not. any(abs(following%gradient(:, :, s)) > 0.0_wp)) cycle
        do i = 1, size(scene%regions(s)%elements)
          l = l + 1
          if (pass == 1) cycle
          associate (e => scene%regions(s)%elements(i))
            all(l)%node = nodes_of_element(scene%mesh%connectivity, e)
            n = size(all(l)%node)
            call find_node_products(scene%mesh%connectivity%cell(e), &
              scene%mesh%coordinates(:, all(l)%node), functions, products(:n, :n))
            all(l)%k = -scene%materials(scene%mesh%material(e))%density* &
              by_axes(products(:n, :n), following%gradient(:, :, s))
          end associate
        end do
      end do
      if (pass == 1) allocate (all(l))
    end do
  end function load_stiffnesses

  !> What the forces on means over surfaces that turn change by. It joins all nodes of a surface,
  !> and is left out where it has more entries than the bodies have.
  pure function mean_stiffnesses(scene, u, f, most) result(all)
    type(scene_t), intent(in) :: scene
    real(wp), intent(in) :: u(:, :)              !! (3,n_nodes) [length]
    real(wp), intent(in) :: f(:, :)              !! (3,n_nodes) that acts on nodes [force]
    integer, intent(in) :: most                  !! entries of the matrix of the bodies
    type(load_stiffness_t), allocatable :: all(:)
    type(load_stiffness_t) :: of
    integer :: i

    allocate (all(0))
    if (.not. allocated(scene%rotations)) return
    do i = 1, size(scene%rotations)
      if (.not. is_turning_mean(scene, i)) cycle
      of%node = scene%rotations(i)%surface_nodes
      if ((3.0_wp*real(size(of%node), wp))**2 > real(most, wp)) cycle
      of%k = mean_stiffness(scene, i, u, f)
      if (size(of%k) > 0) all = [all, of]
    end do
  end function mean_stiffnesses

  !> Add the symmetric part of -df/du to K, f the forces of these loads, and say whether there is
  !> another one: then the work of the loads depends on the way.
  pure subroutine add_load_stiffness(map, of, k, is_symmetric)
    type(dof_map_t), intent(in) :: map           !! with the loaded nodes on its interface
    type(load_stiffness_t), intent(in) :: of(:)
    type(triplets_t), intent(inout) :: k
    logical, intent(out) :: is_symmetric
    type(triplets_t) :: added
    real(wp), allocatable :: skew(:), largest(:) !! (n_free) of a vector without a pattern
    integer :: l, n_added

    allocate (skew(map%n_free), largest(map%n_free), source=0.0_wp)
    allocate (added%row(0), added%column(0), added%value(0))
    n_added = 0
    do l = 1, size(of)
      call add_nodes(map, of(l)%node, of(l)%k, added, n_added, skew, largest)
    end do
    k%row = [k%row, added%row(:n_added)]
    k%column = [k%column, added%column(:n_added)]
    k%value = [k%value, added%value(:n_added)]
    is_symmetric = .not. maxval([0.0_wp, abs(skew)]) > rounding*maxval([0.0_wp, largest])
  end subroutine add_load_stiffness

  !> The matrix of nodes and axes that has products of what belongs to the nodes and to the axes.
  pure function by_axes(of_nodes, of_axes) result(of)
    real(wp), intent(in) :: of_nodes(:, :), of_axes(3, 3)            !! (n,n)
    real(wp) :: of(3*size(of_nodes, 1), 3*size(of_nodes, 1))
    integer :: a, b

    do b = 1, size(of_nodes, 2)
      do a = 1, size(of_nodes, 1)
        of(3*a - 2:3*a, 3*b - 2:3*b) = of_nodes(a, b)*of_axes
      end do
    end do
  end function by_axes

  !> The derivatives of a face's area vectors by its nodes' places: exact, as they are quadratic.
  pure function area_derivatives(x) result(of)
    real(wp), intent(in) :: x(:, :)                     !! (3,n) nodes [length]
    real(wp) :: of(3*size(x, 2), 3*size(x, 2))          !! of a row's by a column's [length]
    real(wp) :: moved(3, size(x, 2)), size_of_face
    integer :: b, j

    size_of_face = maxval(maxval(x, dim=2) - minval(x, dim=2))
    do b = 1, size(x, 2)
      do j = 1, 3
        moved = x - spread(x(:, 1), 2, size(x, 2))
        moved(j, b) = moved(j, b) + size_of_face
        of(:, 3*b - 3 + j) = reshape(face_area_vectors(moved), [size(of, 1)])
        moved(j, b) = moved(j, b) - 2.0_wp*size_of_face
        of(:, 3*b - 3 + j) = (of(:, 3*b - 3 + j) - reshape(face_area_vectors(moved), &
          [size(of, 1)]))/(2.0_wp*size_of_face)
      end do
    end do
  end function area_derivatives

  !> Add what is between the nodes of a face or an element: the symmetric part to the matrix, the
  !> other one times a vector to `skew`.
  pure subroutine add_nodes(map, nodes, ke, added, n_added, skew, largest)
    type(dof_map_t), intent(in) :: map
    integer, intent(in) :: nodes(:)              !! (n)
    real(wp), intent(in) :: ke(:, :)             !! (3 n,3 n) [force/length]
    type(triplets_t), intent(inout) :: added
    integer, intent(inout) :: n_added
    real(wp), intent(inout) :: skew(:), largest(:)
    integer, allocatable :: equations(:), own(:), dof(:)
    real(wp), allocatable :: weights(:), weight(:)
    real(wp) :: symmetric, other, z
    integer :: a, i, p, q

    allocate (equations(0), dof(0), weights(0))
    do a = 1, size(nodes)
      do i = 1, 3
        call interface_terms_of(map, nodes(a), i, own, weight)
        equations = [equations, map%n_free - map%n_interface + own]
        weights = [weights, weight]
        dof = [dof, spread(3*a - 3 + i, 1, size(own))]
      end do
    end do
    if (n_added + size(dof)**2 > size(added%row)) then
      associate (want => max(n_added + size(dof)**2, 2*n_added))
        call enlarge(added%row, n_added, want)
        call enlarge(added%column, n_added, want)
        call enlarge(added%value, n_added, want)
      end associate
    end if
    do q = 1, size(dof)
      ! A vector without a pattern: multiples of the golden section, without their whole part.
      z = modulo(0.6180339887498949_wp*real(equations(q), wp), 1.0_wp) - 0.5_wp
      do p = 1, size(dof)
        associate (there => weights(p)*ke(dof(p), dof(q))*weights(q), &
                   back => weights(p)*ke(dof(q), dof(p))*weights(q))
          symmetric = 0.5_wp*(there + back)
          other = 0.5_wp*(there - back)
        end associate
        skew(equations(p)) = skew(equations(p)) + other*z
        largest(equations(p)) = largest(equations(p)) + abs(other*z)
        if (equations(p) < equations(q)) cycle
        n_added = n_added + 1
        added%row(n_added) = equations(p)
        added%column(n_added) = equations(q)
        added%value(n_added) = symmetric
      end do
    end do
  end subroutine add_nodes

end module load_stiffness_mod
