!> Contacts too small for the mesh: a round body or obstacle that rests on one or two points.
!>
!> Force and approach may be right there; the pressure is the force over whatever area one node has.
!> How small the elements should be follows from Hertz. docs/theory.md (10.5).
module contact_resolution_mod
  use kinds_mod, only: wp
  use elasticity_mod, only: plane_strain_modulus
  use connectivity_mod, only: corners_in
  use surfaces_mod, only: split_faces
  use face_overlap_mod, only: outward_normal
  use obstacle_shapes_mod, only: is_before_faces, is_flat
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use increment_report_mod, only: contact_fields_t, status_open
  implicit none
  private

  public :: small_contact_t, find_small_contacts

  !> Of a pair the contact on one or two points that needs the smallest elements.
  type :: small_contact_t
    integer  :: count = 0          !! contacts like it in the pair; 0: there is none
    integer  :: n_points = 0       !! 1 or 2
    integer  :: node = 0           !! the one that carries more
    real(wp) :: edge = 0.0_wp      !! four of these across the contact [length]
  end type small_contact_t

  real(wp), parameter :: pi = acos(-1.0_wp)
  real(wp), parameter :: sharp = cos(60.0_wp*pi/180.0_wp) !! normals beyond it meet at an edge
  real(wp), parameter :: flat = cos(1.0_wp*pi/180.0_wp)   !! within it: no curvature
  real(wp), parameter :: elements_of_radius = 2.0_wp        !! that show the pressure

  !> The slave faces of a pair, and its points.
  type :: slave_faces_t
    integer :: pair = 0
    integer,  allocatable :: point(:)      !! (n_nodes) of each node in the pair, 0: none
    integer,  allocatable :: nodes(:, :)   !! (4, n_faces) the fourth is 0 in a triangle
    integer,  allocatable :: element(:)    !! (n_faces)
    real(wp), allocatable :: normal(:, :)  !! (3, n_faces) outward unit normals
  end type slave_faces_t

contains

  !> Look for such contacts, pair by pair. Edges and corners have no pressure that elements could
  !> show, nor have nodes without faces a shape: they are left out.
  pure function find_small_contacts(scene, points, prescribed, contact) result(small)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    logical, intent(in) :: prescribed(:, :)       !! (3,n_nodes) in the present step
    type(contact_fields_t), intent(in) :: contact !! at the end of an increment
    type(small_contact_t) :: small(size(scene%pairs))
    type(slave_faces_t) :: faces
    integer :: other(points%n), n_others(points%n)
    integer :: pair, i, partner
    real(wp) :: edge

    do pair = 1, size(scene%pairs)
      associate (first => points%first(pair), last => points%first(pair + 1) - 1)
        ! Two bodies have two curvatures, facets none.
        if (is_before_faces(scene%pairs(pair), scene%obstacles)) cycle
        if (.not. any(contact%status(first:last) /= status_open)) cycle
        faces = faces_of(scene, points, pair)
        call find_active_neighbours(faces, contact%status, other, n_others)
        do i = first, last
          if (contact%status(i) == status_open .or. n_others(i) > 1) cycle
          partner = 0
          if (n_others(i) == 1) then
            partner = other(i)
            if (n_others(partner) > 1) cycle
            ! The one that carries more speaks for both, the first where they are equal.
            if (contact%reaction(1, partner) > contact%reaction(1, i)) cycle
            if (contact%reaction(1, partner) >= contact%reaction(1, i) .and. partner < i) cycle
          end if
          edge = edge_needed(scene, points, faces, prescribed, contact, i, partner)
          if (.not. edge > 0.0_wp) cycle
          small(pair)%count = small(pair)%count + 1
          if (small(pair)%count > 1 .and. edge >= small(pair)%edge) cycle
          small(pair)%edge = edge
          small(pair)%node = points%node(i)
          small(pair)%n_points = merge(1, 2, partner == 0)
        end do
      end associate
    end do
  end function find_small_contacts

  !> Half the radius of the contact, or half its half width where it is a line: 0 where there is
  !> none.
  !>
  !> 1/R is the largest curvature of the gap between the point and its neighbours; F is that of the
  !> whole contact where symmetry planes cut it. docs/theory.md (10.5).
  pure real(wp) function edge_needed(scene, points, faces, prescribed, contact, i, partner) &
    result(edge)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(slave_faces_t), intent(in) :: faces
    logical, intent(in) :: prescribed(:, :)       !! (3,n_nodes)
    type(contact_fields_t), intent(in) :: contact
    integer, intent(in) :: i, partner             !! points of the contact, the second may be 0
    real(wp) :: force, curvature, nearest, arm(3), n(3), along, young, length
    logical :: is_flat_pair
    integer :: f, k, j, node, planes

    edge = 0.0_wp
    node = points%node(i)
    n = contact%frame(:, 1, i)
    planes = count(prescribed(:, node) .and. abs(n) < 0.5_wp)
    is_flat_pair = is_flat(scene%obstacles(scene%pairs(faces%pair)%master))
    associate (first => points%first(faces%pair), last => points%first(faces%pair + 1) - 1)
      is_flat_pair = is_flat_pair .and. .not. maxval(points%extra_gap(first:last)) > &
        minval(points%extra_gap(first:last))
    end associate
    if (.not. is_smooth(faces, node, planes > 0, is_flat_pair)) return
    force = contact%reaction(1, i)
    length = 0.0_wp
    if (partner > 0) then
      force = force + contact%reaction(1, partner)
      length = length_of_line(scene, prescribed, node, points%node(partner))
      if (length > 0.0_wp) planes = planes - 1
    end if
    force = force*2.0_wp**planes
    curvature = 0.0_wp
    nearest = huge(nearest)
    young = 0.0_wp
    do f = 1, size(faces%element)
      if (.not. any(faces%nodes(:, f) == node)) cycle
      young = plane_strain_modulus(scene%materials(scene%mesh%material(faces%element(f)))% &
        law%elastic)
      do k = 1, corners_in(faces%nodes(:, f))
        j = faces%point(faces%nodes(k, f))
        if (j == 0 .or. j == i .or. j == partner) cycle
        arm = scene%mesh%coordinates(:, points%node(j)) - scene%mesh%coordinates(:, node)
        along = norm2(arm - dot_product(arm, n)*n)
        if (.not. along > 0.0_wp) cycle
        nearest = min(nearest, along)
        curvature = max(curvature, 2.0_wp*(contact%gap(j) - max(0.0_wp, contact%gap(i)))/along**2)
      end do
    end do
    if (.not. (force > 0.0_wp .and. curvature > 0.0_wp)) return
    if (length > 0.0_wp) then
      edge = sqrt(4.0_wp*force/(pi*length*curvature*young))/elements_of_radius
    else
      edge = (0.75_wp*force/(curvature*young))**(1.0_wp/3.0_wp)/elements_of_radius
    end if
    edge = min(edge, 0.5_wp*nearest)
  end function edge_needed

  !> The distance of two nodes where neither moves along it, as in plane strain: 0 elsewhere.
  pure real(wp) function length_of_line(scene, prescribed, node, other) result(length)
    type(scene_t), intent(in) :: scene
    logical, intent(in) :: prescribed(:, :) !! (3,n_nodes)
    integer, intent(in) :: node, other
    real(wp) :: arm(3)
    integer :: axis

    length = 0.0_wp
    arm = scene%mesh%coordinates(:, other) - scene%mesh%coordinates(:, node)
    axis = maxloc(abs(arm), dim=1)
    if (abs(arm(axis)) > 0.9_wp*norm2(arm) .and. prescribed(axis, node) .and. &
      prescribed(axis, other)) length = norm2(arm)
  end function length_of_line

  !> Whether the surface is smooth at a node, and it or the obstacle round.
  pure logical function is_smooth(faces, node, on_plane, flat_obstacle)
    type(slave_faces_t), intent(in) :: faces
    integer, intent(in) :: node
    logical, intent(in) :: on_plane      !! of symmetry: where the surface ends there it goes on
    logical, intent(in) :: flat_obstacle
    logical :: here(size(faces%element)), near(size(faces%element))
    integer, allocatable :: list(:)
    integer :: f, g, k, m

    is_smooth = .false.
    here = [(any(faces%nodes(:, f) == node), f=1, size(faces%element))]
    list = pack([(f, f=1, size(here))], here)
    if (size(list) == 0) return
    do f = 1, size(list)
      if (.not. on_plane) then
        ! Every edge at the node belongs to two faces but on a rim.
        m = corners_in(faces%nodes(:, list(f)))
        k = findloc(faces%nodes(:, list(f)), node, dim=1)
        if (count(here .and. has(faces%nodes(modulo(k, m) + 1, list(f)))) < 2) return
        if (count(here .and. has(faces%nodes(modulo(k - 2, m) + 1, list(f)))) < 2) return
      end if
      do g = 1, f - 1
        if (dot_product(faces%normal(:, list(f)), faces%normal(:, list(g))) < sharp) return
      end do
    end do
    is_smooth = .true.
    if (.not. flat_obstacle) return
    near = .false.
    do f = 1, size(list)
      do k = 1, corners_in(faces%nodes(:, list(f)))
        near = near .or. has(faces%nodes(k, list(f)))
      end do
    end do
    is_smooth = any(near .and. matmul(faces%normal(:, list(1)), faces%normal) < flat)

  contains

    pure function has(n)
      integer, intent(in) :: n
      logical :: has(size(faces%element))

      has = any(faces%nodes == n, dim=1)
    end function has

  end function is_smooth

  !> Of every closed point how many closed points share a face with it, up to 2, and one of them.
  pure subroutine find_active_neighbours(faces, status, other, n_others)
    type(slave_faces_t), intent(in) :: faces
    integer, intent(in) :: status(:)    !! (n_points)
    integer, intent(out) :: other(:)    !! (n_points)
    integer, intent(out) :: n_others(:) !! (n_points)
    integer :: f, k, l, i, j

    other = 0
    n_others = 0
    do f = 1, size(faces%element)
      do k = 1, corners_in(faces%nodes(:, f))
        i = faces%point(faces%nodes(k, f))
        if (i == 0) cycle
        if (status(i) == status_open) cycle
        do l = 1, corners_in(faces%nodes(:, f))
          j = faces%point(faces%nodes(l, f))
          if (j == 0 .or. j == i .or. j == other(i)) cycle
          if (status(j) == status_open) cycle
          n_others(i) = min(2, n_others(i) + 1)
          other(i) = j
        end do
      end do
    end do
  end subroutine find_active_neighbours

  !> The faces of a pair's slave surface; none where it consists of nodes alone.
  pure type(slave_faces_t) function faces_of(scene, points, pair) result(faces)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: pair
    integer, allocatable :: whole(:)
    integer :: f, i, n_faces

    faces%pair = pair
    allocate (faces%point(scene%mesh%n_nodes), source=0)
    do i = points%first(pair), points%first(pair + 1) - 1
      faces%point(points%node(i)) = i
    end do
    associate (surface => scene%surfaces(scene%pairs(pair)%surface), mesh => scene%mesh)
      call split_faces(surface%faces, mesh%connectivity, faces%nodes, whole)
      n_faces = size(whole)
      allocate (faces%element(n_faces), faces%normal(3, n_faces))
      do f = 1, n_faces
        faces%element(f) = surface%faces(1, whole(f))
        faces%normal(:, f) = outward_normal(mesh%coordinates(:, faces%nodes( &
          :corners_in(faces%nodes(:, f)), f)))
      end do
    end associate
  end function faces_of

end module contact_resolution_mod
