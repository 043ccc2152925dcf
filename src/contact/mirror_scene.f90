!> Planes of symmetry of a scene, across x, y or z: mesh, supports, loads, pairs and obstacles are
!> their own mirror images, to rounding. Half of such a scene, with supports on the plane, has the
!> results of the whole, as long as these are symmetric, too: at small strain and without friction
!> they are, and else where no other solution branches off (--symmetry). docs/theory.md section 11.
module mirror_scene_mod
  use kinds_mod, only: wp
  use equal_columns_mod, only: number_columns
  use text_mod, only: to_text
  use sorting_mod, only: sort_ascending
  use cells_mod, only: face_nodes
  use connectivity_mod, only: nodes_of_element
  use mesh_mod, only: deck_rounding
  use surfaces_mod, only: surface_t, all_nodes_of
  use obstacles_mod, only: obstacle_t, ref_nodes
  use loads_mod, only: nodal_value_t
  use scene_mod, only: scene_t
  use part_of_scene_mod, only: leave_out_elements
  use obstacle_shapes_mod, only: locate_point
  use step_loads_mod, only: step_loads_t, resolve_loads, prescribed_dofs, pattern_factors
  implicit none
  private

  public :: planes_in_words, part_in_words, take_half

  real(wp), parameter :: rounding = 1.0e-9_wp !! of the size of the mesh, or of the largest load [-]
  real(wp), parameter :: off = 0.3137_wp
  !! of a cell of places that count as one: off round numbers, where rounding would part images [-]
  character, parameter :: axis_names(3) = ['x', 'y', 'z']

  !> A plane of symmetry.
  type :: mirror_t
    integer :: axis = 0
    real(wp) :: place = 0.0_wp       !! along the axis, as places of the mesh [length]
    integer, allocatable :: image(:)
    !! (n_nodes) the node at the mirror image; 0 of nodes without elements
  end type mirror_t

contains

  !> "x = 0.5 and y = 0": planes of symmetry that elements end at; '' where there is none.
  function planes_in_words(scene) result(words)
    type(scene_t), intent(in) :: scene
    character(:), allocatable :: words
    type(mirror_t) :: mirror
    integer :: axis

    words = ''
    do axis = 1, 3
      call find_mirror(scene, axis, mirror)
      if (mirror%axis == 0) cycle
      if (words /= '') words = words//' and '
      words = words//axis_names(axis)//' = '//to_text(mirror%place + scene%mesh%origin(axis), 6)
    end do
  end function planes_in_words

  !> What is left where each plane halves: "half", "quarter" or "eighth".
  pure function part_in_words(planes) result(words)
    character(*), intent(in) :: planes !! as of planes_in_words
    character(:), allocatable :: words
    integer :: i
    character(7), parameter :: parts(3) = ['half   ', 'quarter', 'eighth ']

    words = trim(parts(count([(planes(i:i) == '=', i=1, len(planes))])))
  end function part_in_words

  !> Keep one half of a scene at each plane of symmetry: the one before it. Nodes on the plane, and
  !> obstacles, do not move across it, and carry half of their forces.
  subroutine take_half(scene, words)
    type(scene_t), intent(inout) :: scene
    character(:), allocatable, intent(out) :: words !! as of planes_in_words
    type(mirror_t) :: mirror
    logical, allocatable :: on_plane(:)
    integer :: axis, step, node

    words = planes_in_words(scene)
    do axis = 1, 3
      ! Of what is left.
      call find_mirror(scene, axis, mirror)
      if (mirror%axis == 0) cycle
      on_plane = mirror%image == [(node, node=1, scene%mesh%n_nodes)]
      do step = 1, size(scene%steps)
        associate (this => scene%steps(step))
          where (on_plane(this%forces%node)) this%forces%value = 0.5_wp*this%forces%value
          if (step > 1 .and. .not. this%replace_boundary) cycle
          this%boundary = [this%boundary, pack([(nodal_value_t(node=node, dof=axis), node=1, &
            scene%mesh%n_nodes)], on_plane)]
        end associate
      end do
      call leave_out_elements(scene, lies_before(scene, mirror))
    end do
  end subroutine take_half

  !> The plane of symmetry across an axis; of axis 0 where there is none.
  subroutine find_mirror(scene, axis, mirror)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: axis
    type(mirror_t), intent(out) :: mirror
    logical :: ok
    integer :: k

    ! What joins nodes is not looked at, nor what is along other axes.
    if (any([(allocated(scene%pairs(k)%left_open), k=1, size(scene%pairs))])) return
    if (scene%constraints%n > 0 .or. scene%mesh%springs%n > 0 .or. allocated(scene%local_axes) &
      .or. allocated(scene%rotations) .or. size(scene%gaps) > 0 .or. &
      any(scene%obstacles%is_on_body) .or. scene%mesh%sector_angle > 0.0_wp) return
    ! The images of axes aslant are others.
    if (any(.not. scene%materials%law%elastic%is_isotropic)) return
    associate (x => scene%mesh%coordinates(axis, scene%mesh%element_nodes))
      mirror%place = 0.5_wp*(minval(x) + maxval(x))
    end associate
    call find_images(scene, axis, mirror%place, mirror%image, ok)
    if (ok) ok = has_mirrored_elements(scene, mirror%image)
    if (ok) ok = .not. any(cut_by(scene, axis, mirror%place))
    if (ok) ok = has_mirrored_pairs(scene, axis, mirror)
    if (ok) ok = has_mirrored_loads(scene, axis, mirror%image)
    if (ok) mirror%axis = axis
  end subroutine find_mirror

  !> How far places may be off [length].
  pure real(wp) function close_by(scene)
    type(scene_t), intent(in) :: scene

    associate (x => scene%mesh%coordinates(:, scene%mesh%element_nodes))
      close_by = max(rounding*maxval(maxval(x, dim=2) - minval(x, dim=2)), &
        16.0_wp*deck_rounding(x, scene%mesh%origin))
    end associate
  end function close_by

  !> The node at the mirror image of each node that elements use, in the same piece of the mesh;
  !> reference nodes of obstacles are their own.
  subroutine find_images(scene, axis, place, image, ok)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: axis
    real(wp), intent(in) :: place
    integer, allocatable, intent(out) :: image(:) !! (n_nodes)
    logical, intent(out) :: ok                    !! each has one, and no other
    integer, allocatable :: key(:, :), first(:)
    real(wp) :: apart(size(scene%mesh%element_nodes)), low(3), cell
    integer :: i, k, n

    cell = 64.0_wp*close_by(scene)
    associate (nodes => scene%mesh%element_nodes, x => scene%mesh%coordinates)
      n = size(nodes)
      apart = x(axis, nodes) - place
      low = minval(x(:, nodes), dim=2)
      allocate (key(4, n))
      do k = 1, 3
        key(k, :) = floor((x(k, nodes) - low(k))/cell + off)
      end do
      key(axis, :) = floor(abs(apart)/cell + off)
      key(4, :) = scene%mesh%piece(nodes)
      call number_columns(key, first)
      allocate (image(scene%mesh%n_nodes), source=0)
      ok = .true.
      do i = 1, n
        if (abs(apart(i)) <= 0.5_wp*cell) then
          ok = ok .and. first(i) == i .and. image(nodes(i)) == 0
          image(nodes(i)) = nodes(i)
        else if (first(i) /= i) then
          associate (one => nodes(first(i)), other => nodes(i))
            ok = ok .and. image(one) == 0 .and. apart(i)*apart(first(i)) < 0.0_wp
            image(one) = other
            image(other) = one
          end associate
        end if
        if (.not. ok) return
      end do
      ok = all(image(nodes) > 0)
      image(ref_nodes(scene%obstacles)) = ref_nodes(scene%obstacles)
    end associate
  end subroutine find_images

  !> Whether each element has an image of the same kind and material.
  logical function has_mirrored_elements(scene, image) result(ok)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: image(:)
    integer, allocatable :: nodes(:, :), images(:, :)
    integer :: e

    associate (mesh => scene%mesh, first => scene%mesh%connectivity%first)
      allocate (nodes(maxval(first(2:mesh%n_elements + 1) - first(:mesh%n_elements)), &
        mesh%n_elements), source=0)
      images = nodes
      do e = 1, mesh%n_elements
        associate (of_element => nodes_of_element(mesh%connectivity, e))
          nodes(:size(of_element), e) = of_element
          images(:size(of_element), e) = image(of_element)
        end associate
      end do
      ok = are_same_lists(nodes, images, reshape([mesh%element_kind, mesh%material, &
        mesh%connectivity%cell], [mesh%n_elements, 3]))
    end associate
  end function has_mirrored_elements

  !> Whether each of some lists of numbers, in any order, is among others, with the same marks.
  logical function are_same_lists(others, lists, marks) result(ok)
    integer, intent(in) :: others(:, :), lists(:, :) !! (m,n)
    integer, intent(in), optional :: marks(:, :)     !! (n,k) of both; left out: none
    integer, allocatable :: key(:, :), first(:)
    integer :: i, m, n, k

    m = size(lists, 1)
    n = size(lists, 2)
    k = 0
    if (present(marks)) k = size(marks, 2)
    allocate (key(m + k, 2*n))
    key(:m, :n) = others
    key(:m, n + 1:) = lists
    do i = 1, 2*n
      call sort_ascending(key(:m, i))
    end do
    if (present(marks)) then
      key(m + 1:, :n) = transpose(marks)
      key(m + 1:, n + 1:) = key(m + 1:, :n)
    end if
    call number_columns(key, first)
    ok = all(first(n + 1:) <= n)
  end function are_same_lists

  !> Elements on both sides of a plane.
  function cut_by(scene, axis, place) result(is_cut)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: axis
    real(wp), intent(in) :: place
    logical :: is_cut(scene%mesh%n_elements)
    real(wp) :: near
    integer :: e

    near = close_by(scene)
    do e = 1, scene%mesh%n_elements
      associate (apart => scene%mesh%coordinates(axis, nodes_of_element( &
          scene%mesh%connectivity, e)) - place)
        is_cut(e) = any(apart < -near) .and. any(apart > near)
      end associate
    end do
  end function cut_by

  !> The elements before a plane that cuts none.
  function lies_before(scene, mirror) result(is_before)
    type(scene_t), intent(in) :: scene
    type(mirror_t), intent(in) :: mirror
    logical :: is_before(scene%mesh%n_elements)
    integer :: e

    do e = 1, scene%mesh%n_elements
      is_before(e) = sum(scene%mesh%coordinates(mirror%axis, nodes_of_element( &
        scene%mesh%connectivity, e)) - mirror%place) < 0.0_wp
    end do
  end function lies_before

  !> Whether the surfaces of each pair, and obstacles, are their own images.
  logical function has_mirrored_pairs(scene, axis, mirror) result(ok)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: axis
    type(mirror_t), intent(in) :: mirror
    integer :: k

    ok = .true.
    do k = 1, size(scene%pairs)
      associate (pair => scene%pairs(k))
        ok = ok .and. is_mirrored(scene, scene%surfaces(pair%surface), mirror%image)
        if (ok .and. pair%master_surface > 0) ok = is_mirrored(scene, scene%surfaces( &
          pair%master_surface), mirror%image)
        if (ok .and. pair%master > 0) ok = is_own_image(scene, scene%obstacles(pair%master), &
          scene%surfaces(pair%surface)%nodes, axis, mirror%place)
      end associate
      if (.not. ok) return
    end do
  end function has_mirrored_pairs

  !> Whether a surface has the images of its faces and nodes.
  logical function is_mirrored(scene, surface, image) result(ok)
    type(scene_t), intent(in) :: scene
    type(surface_t), intent(in) :: surface
    integer, intent(in) :: image(:)
    logical :: has(scene%mesh%n_nodes)
    integer :: nodes(face_nodes, size(surface%faces, 2)), images(0:scene%mesh%n_nodes)

    has = .false.
    has(surface%nodes) = .true.
    ok = all(image(surface%nodes) > 0)
    if (ok) ok = all(has(image(surface%nodes)))
    if (.not. ok .or. size(surface%faces, 2) == 0) return
    nodes = all_nodes_of(surface%faces, scene%mesh%connectivity)
    images = [0, image]
    ok = are_same_lists(nodes, reshape(images(reshape(nodes, [size(nodes)])), shape(nodes)))
  end function is_mirrored

  !> Whether an obstacle is its own image: facets by their corners, what has a distance by that of
  !> some nodes, and of places beside them, and of their images.
  logical function is_own_image(scene, obstacle, nodes, axis, place) result(ok)
    type(scene_t), intent(in) :: scene
    type(obstacle_t), intent(in) :: obstacle
    integer, intent(in) :: nodes(:)
    integer, intent(in) :: axis
    real(wp), intent(in) :: place
    real(wp), parameter :: beside(3, 4) = reshape([0.0_wp, 0.0_wp, 0.0_wp, 0.37_wp, 0.11_wp, &
      0.23_wp, -0.19_wp, 0.41_wp, -0.13_wp, 0.07_wp, -0.29_wp, 0.31_wp], [3, 4])
    real(wp) :: x(3), gap(2), normal(3, 2), size_of_mesh, at_rest(3), near
    integer :: i, k

    if (allocated(obstacle%facet)) then
      ok = has_mirrored_facets(scene, obstacle, axis, place)
      return
    end if
    near = close_by(scene)
    size_of_mesh = near/rounding
    at_rest = 0.0_wp
    ok = .true.
    do i = 1, size(nodes)
      do k = 1, size(beside, 2)
        x = scene%mesh%coordinates(:, nodes(i)) + size_of_mesh*beside(:, k)
        call locate_point(obstacle, at_rest, x, gap(1), normal(:, 1))
        x(axis) = 2.0_wp*place - x(axis)
        call locate_point(obstacle, at_rest, x, gap(2), normal(:, 2))
        ok = ok .and. abs(gap(1) - gap(2)) <= near
        if (.not. ok) return
      end do
    end do
  end function is_own_image

  !> Whether the corners of facets, and the facets, have their images among them.
  logical function has_mirrored_facets(scene, obstacle, axis, place) result(ok)
    type(scene_t), intent(in) :: scene
    type(obstacle_t), intent(in) :: obstacle
    integer, intent(in) :: axis
    real(wp), intent(in) :: place
    integer, allocatable :: key(:, :), first(:)
    integer :: images(0:size(obstacle%corner, 2)), n, k
    real(wp) :: x(3, size(obstacle%corner, 2)), low(3), cell

    n = size(obstacle%corner, 2)
    x = obstacle%corner
    cell = 64.0_wp*close_by(scene)
    low = minval(x, dim=2)
    ! Both halves by the same numbers, as an image is as far from the plane.
    low(axis) = place - maxval(abs(x(axis, :) - place))
    allocate (key(3, 2*n))
    do k = 1, 3
      key(k, :n) = floor((x(k, :) - low(k))/cell + off)
      if (k == axis) x(k, :) = 2.0_wp*place - x(k, :)
      key(k, n + 1:) = floor((x(k, :) - low(k))/cell + off)
    end do
    call number_columns(key, first)
    ok = all(first(n + 1:) <= n)
    if (.not. ok) return
    images = [0, first(n + 1:)]
    associate (facet => obstacle%facet)
      ok = are_same_lists(facet, reshape(images(reshape(facet, [size(facet)])), shape(facet)))
    end associate
  end function has_mirrored_facets

  !> Whether supports, prescribed displacements, forces and turns of all *STEPs are mirrored.
  logical function has_mirrored_loads(scene, axis, image) result(ok)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: axis
    integer, intent(in) :: image(:)
    type(step_loads_t) :: loads
    logical :: prescribed(3, scene%mesh%n_nodes)
    real(wp) :: u(3, scene%mesh%n_nodes) !! as a step begins, where supports say it [length]
    integer, allocatable :: nodes(:)
    integer :: step, g, node

    nodes = pack([(node, node=1, size(image))], image > 0)
    u = 0.0_wp
    ok = .true.
    do step = 1, size(scene%steps)
      prescribed = prescribed_dofs(scene, step)
      call resolve_loads(scene, step, u, loads)
      ok = all(prescribed(:, nodes) .eqv. prescribed(:, image(nodes))) .and. &
        all([(is_even(loads%displacement(:, :, g)) .and. is_even(loads%force(:, :, g)), g=1, &
        loads%n_patterns)])
      if (allocated(loads%turns%held)) then
        do node = 1, 3
          if (node == axis) cycle
          ok = ok .and. .not. (any(abs(loads%turns%held(node, :)) > 0.0_wp) .or. &
            any(abs(loads%turns%ramp(node, :)) > 0.0_wp) .or. &
            any(abs(loads%turns%by_amplitude(node, :, :)) > 0.0_wp))
        end do
      end if
      if (.not. ok) return
      associate (factor => pattern_factors(scene, loads, 1.0_wp, scene%steps(step)%period))
        u = 0.0_wp
        do g = 1, loads%n_patterns
          u = u + factor(g)*loads%displacement(:, :, g)
        end do
      end associate
    end do

  contains

    !> Whether vectors at nodes are the images of one another.
    pure logical function is_even(v)
      real(wp), intent(in) :: v(:, :) !! (3,n_nodes)
      real(wp) :: turned(3, size(nodes))

      turned = v(:, image(nodes))
      turned(axis, :) = -turned(axis, :)
      is_even = .not. any(abs(v(:, nodes) - turned) > rounding*maxval(abs(v)))
    end function is_even

  end function has_mirrored_loads

end module mirror_scene_mod
