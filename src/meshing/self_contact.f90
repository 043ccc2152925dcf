!> Surfaces that touch themselves: the two sides that their faces take. docs/theory.md section 11.
module self_contact_mod
  use cells_mod, only: face_corners
  use connectivity_mod, only: corners_in, nodes_of_face
  use faces_mod, only: face_area_vectors
  use kinds_mod, only: wp
  use mesh_draft_mod, only: mesh_draft_t
  use small_matrix_mod, only: cross
  use sorting_mod, only: order_of
  use surface_reach_mod, only: against
  implicit none
  private

  public :: divide_surface

contains

  !> Give each face of a surface a side, 1 or 2, so that faces that see each other have two.
  !>
  !> From the middle of a face, and from near its corners, rays along its normal meet the first face
  !> that is turned towards it and shares no node with it. From the nearest two on, faces get the
  !> other side than what they see; of several that may be first, one whose neighbours have a side
  !> gets that of its neighbours. Faces that see nothing get the side of neighbours that they
  !> continue; around an edge they get none, and touch nothing.
  subroutine divide_surface(mesh, faces, side)
    type(mesh_draft_t), intent(in) :: mesh
    integer, intent(in) :: faces(:, :)            !! (2,n) element, face
    integer, allocatable, intent(out) :: side(:)  !! (n) 0: no face sees another
    integer :: corner(face_corners, size(faces, 2)), f
    real(wp) :: normal(3, size(faces, 2))
    integer, allocatable :: seen(:, :), order(:)  !! (2,n_seen) faces that see each other
    real(wp), allocatable :: distance(:)          !! (n_seen) [length]

    do f = 1, size(faces, 2)
      corner(:, f) = nodes_of_face(mesh%connectivity, faces(1, f), faces(2, f))
      normal(:, f) = sum(face_area_vectors(mesh%coordinates(:, &
        corner(:corners_in(corner(:, f)), f))), 2)
      normal(:, f) = normal(:, f)/max(norm2(normal(:, f)), tiny(1.0_wp))
    end do
    call look_along_normals(mesh, corner, normal, seen, distance)
    allocate (side(size(faces, 2)), source=0)
    if (size(distance) == 0) return
    ! Alike but for a millionth are in the order of the faces.
    call order_of(nint(distance*(1.0e6_wp/maxval(distance))), order)
    call colour(mesh, corner, normal, seen(:, order), side)
  end subroutine divide_surface

  !> Which faces see each other, and how far apart.
  subroutine look_along_normals(mesh, corner, normal, seen, distance)
    type(mesh_draft_t), intent(in) :: mesh
    integer, intent(in) :: corner(:, :)       !! (4,n) the fourth is 0 in a triangle
    real(wp), intent(in) :: normal(:, :)      !! (3,n)
    integer, allocatable, intent(out) :: seen(:, :)    !! (2,n_seen)
    real(wp), allocatable, intent(out) :: distance(:)  !! (n_seen) [length]
    real(wp), parameter :: inwards = 0.1_wp   !! of a ray near a corner, towards the middle [-]
    real(wp) :: from(3, face_corners + 1), middle(3), least, t
    integer :: f, g, k, n, first, n_seen

    allocate (seen(2, 5*size(corner, 2)), distance(5*size(corner, 2)))
    n_seen = 0
    do f = 1, size(corner, 2)
      n = corners_in(corner(:, f))
      middle = sum(mesh%coordinates(:, corner(:n, f)), 2)/n
      from(:, n + 1) = middle
      do k = 1, n
        from(:, k) = middle + (1.0_wp - inwards)*(mesh%coordinates(:, corner(k, f)) - middle)
      end do
      do k = 1, n + 1
        least = huge(1.0_wp)
        first = 0
        do g = 1, size(corner, 2)
          if (dot_product(normal(:, f), normal(:, g)) > against) cycle
          t = way_to(mesh%coordinates(:, corner(:corners_in(corner(:, g)), g)), from(:, k), &
            normal(:, f))
          if (t >= least) cycle
          least = t
          first = g
        end do
        if (first == 0) cycle
        if (share_a_node(corner(:, f), corner(:, first))) cycle
        n_seen = n_seen + 1
        seen(:, n_seen) = [f, first]
        distance(n_seen) = least
      end do
    end do
    seen = seen(:, :n_seen)
    distance = distance(:n_seen)
  end subroutine look_along_normals

  !> Whether two faces have a corner in common.
  pure logical function share_a_node(one, other) result(share)
    integer, intent(in) :: one(:), other(:) !! corners; the fourth is 0 in a triangle
    integer :: k

    share = .false.
    do k = 1, corners_in(one)
      share = share .or. any(other == one(k))
    end do
  end function share_a_node

  !> How far along a direction a face lies before a place; huge where it does not.
  pure real(wp) function way_to(corner, from, along) result(way)
    real(wp), intent(in) :: corner(:, :)  !! (3,3) or (3,4) [length]
    real(wp), intent(in) :: from(3), along(3)
    real(wp) :: normal(3), middle(3), slope
    integer :: k, n
    logical :: is_in

    n = size(corner, 2)
    middle = sum(corner, 2)/n
    normal = sum(face_area_vectors(corner), 2)
    slope = dot_product(normal, along)
    way = huge(1.0_wp)
    if (.not. slope < 0.0_wp) return
    is_in = .true.
    do k = 1, n
      associate (a => corner(:, k), b => corner(:, 1 + mod(k, n)))
        ! The edge seen along the ray, anticlockwise from the place.
        is_in = is_in .and. dot_product(along, cross(a - from, b - from)) <= 0.0_wp
      end associate
    end do
    if (.not. is_in) return
    if (dot_product(normal, middle - from)/slope > 0.0_wp) way = dot_product(normal, middle - &
      from)/slope
  end function way_to

  !> Give faces their sides, from the nearest two that see each other on.
  subroutine colour(mesh, corner, normal, seen, side)
    type(mesh_draft_t), intent(in) :: mesh
    integer, intent(in) :: corner(:, :)   !! (4,n)
    real(wp), intent(in) :: normal(:, :)  !! (3,n)
    integer, intent(in) :: seen(:, :)     !! (2,n_seen) the nearest first
    integer, intent(inout) :: side(:)     !! (n)
    integer :: of_node(0:mesh%n_nodes) !! side of each node
    integer :: face_of(0:mesh%n_nodes) !! the face that gave it
    integer :: k
    logical :: has_changed

    of_node = 0
    face_of = 0
    do
      ! What is seen from a side, then what lies beside one.
      has_changed = .false.
      do k = 1, size(seen, 2)
        if (side(seen(1, k)) > 0 .eqv. side(seen(2, k)) > 0) cycle
        if (side(seen(1, k)) > 0) then
          call give(seen(2, k), 3 - side(seen(1, k)))
        else
          call give(seen(1, k), 3 - side(seen(2, k)))
        end if
        has_changed = .true.
      end do
      if (has_changed) cycle
      do k = 1, size(seen, 2)
        if (side(seen(1, k)) > 0) cycle
        if (beside(seen(1, k)) == 0) cycle
        call give(seen(1, k), beside(seen(1, k)))
        has_changed = .true.
        exit
      end do
      if (has_changed) cycle
      k = findloc([(side(seen(1, k)) == 0, k=1, size(seen, 2))], .true., dim=1)
      if (k == 0) exit
      call give(seen(1, k), 1)
    end do
    do
      has_changed = .false.
      do k = 1, size(side)
        if (side(k) > 0) cycle
        if (beside(k) == 0 .or. .not. continues(k)) cycle
        call give(k, beside(k))
        has_changed = .true.
      end do
      if (.not. has_changed) exit
    end do

  contains

    subroutine give(face, its)
      integer, intent(in) :: face, its

      side(face) = its
      where (of_node(corner(:, face)) == 0) face_of(corner(:, face)) = face
      where (of_node(corner(:, face)) == 0) of_node(corner(:, face)) = its
      of_node(0) = 0
    end subroutine give

    !> Whether a face goes on from one that gave a corner of it its side, within 60 degrees.
    pure logical function continues(face)
      integer, intent(in) :: face
      real(wp), parameter :: flat = 0.5_wp !! cosine of the normals, at least
      integer :: i

      continues = .false.
      do i = 1, corners_in(corner(:, face))
        associate (node => corner(i, face))
          if (of_node(node) == 0) cycle
          continues = continues .or. dot_product(normal(:, face), normal(:, face_of(node))) >= flat
        end associate
      end do
    end function continues

    !> The side of most corners that have one; 0: none has.
    pure integer function beside(face)
      integer, intent(in) :: face

      beside = 0
      associate (of => of_node(corner(:, face)))
        if (all(of == 0)) return
        beside = merge(1, 2, count(of == 1) >= count(of == 2))
      end associate
    end function beside

  end subroutine colour

end module self_contact_mod
