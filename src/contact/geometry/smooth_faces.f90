!> The faces of a slave surface, as flat as the elements have them and as round as their normals
!> say.
!>
!> Where faces turn by no more than 30 degrees a curved body is meant, of which the nodes are
!> points: between two nodes an arc goes through both, across the surface's normals there.
!> docs/theory.md (10.6), (10.7).
module smooth_faces_mod
  use kinds_mod, only: wp
  use lists_mod, only: lists_t, columns_with
  use small_matrix_mod, only: cross
  use cells_mod, only: face_corners
  use mesh_mod, only: mesh_t
  use face_overlap_mod, only: outward_normal
  use surfaces_mod, only: split_faces, surface_t
  implicit none
  private

  public :: smooth_faces_t, make_smooth_faces, smooth_faces_of, no_faces, bulge_at, shape_at, &
    find_closest

  !> The faces of one surface, undeformed.
  type :: smooth_faces_t
    integer,  allocatable :: nodes(:, :)
    !! (4, n_faces) anticlockwise seen from outside; a triangle is a quadrilateral whose third and
    !! fourth node are one
    real(wp), allocatable :: normal(:, :)   !! (3, n_faces) outward unit normals
    real(wp), allocatable :: bulge(:, :, :) !! (3, 4, n_faces) of edges 1-2, 2-3, 3-4, 4-1 [length]
    real(wp), allocatable :: half(:, :)     !! (4, n_faces) half the lengths of the edges [length]
  end type smooth_faces_t

  real(wp), parameter :: pi = acos(-1.0_wp)
  real(wp), parameter :: sharp = cos(30.0_wp*pi/180.0_wp)
  !! normals beyond it meet at an edge: a polygon of 12 stands for a circle
  real(wp), parameter :: xi_node(4) = [-1, 1, 1, -1]
  real(wp), parameter :: eta_node(4) = [-1, -1, 1, 1]

contains

  !> A surface without faces.
  pure type(smooth_faces_t) function no_faces() result(faces)

    allocate (faces%nodes(face_corners, 0), faces%normal(3, 0), faces%half(face_corners, 0))
    allocate (faces%bulge(3, face_corners, 0))
  end function no_faces

  !> The faces of a surface; none where it consists of nodes alone.
  pure type(smooth_faces_t) function make_smooth_faces(mesh, surface, places) result(faces)
    type(mesh_t), intent(in) :: mesh
    type(surface_t), intent(in) :: surface
    real(wp), intent(in), optional :: places(:, :) !! (3,n_nodes) in place of the mesh's [length]
    integer, allocatable :: corners(:, :), whole(:)

    allocate (corners(face_corners, 0))
    if (allocated(surface%faces)) call split_faces(surface%faces, mesh%connectivity, corners, whole)
    if (present(places)) then
      faces = smooth_faces_of(corners, places)
    else
      faces = smooth_faces_of(corners, mesh%coordinates)
    end if
  end function make_smooth_faces

  !> Faces over any list of places.
  pure type(smooth_faces_t) function smooth_faces_of(corners, places, meant) result(faces)
    integer, intent(in) :: corners(:, :)  !! (4,n_faces) as of smooth_faces_t, or 0 behind triangles
    real(wp), intent(in) :: places(:, :)  !! (3,n) [length]
    real(wp), intent(in), optional :: meant(:, :)
    !! (3,n_faces) normals that say which faces are one surface, in the place of theirs
    type(lists_t) :: at !! the faces at each node
    real(wp) :: x(3, face_corners), of_surface(3, size(corners, 2))
    integer :: f, n_faces

    n_faces = size(corners, 2)
    allocate (faces%nodes(face_corners, n_faces), faces%normal(3, n_faces))
    allocate (faces%half(face_corners, n_faces))
    allocate (faces%bulge(3, face_corners, n_faces), source=0.0_wp)
    do f = 1, n_faces
      faces%nodes(:, f) = merge(corners(:, f), corners(3, f), corners(:, f) > 0)
      x = places(:, faces%nodes(:, f))
      faces%normal(:, f) = outward_normal(x)
      faces%half(:, f) = 0.5_wp*norm2(cshift(x, 1, dim=2) - x, dim=1)
    end do
    at = columns_with(corners, size(places, 2))
    of_surface = faces%normal
    if (present(meant)) of_surface = meant
    do f = 1, n_faces
      call bend_edges(places, of_surface, faces, f, at)
    end do
  end function smooth_faces_of

  !> How far the arcs over a face's edges rise in their middle. docs/theory.md (10.7).
  !>
  !> Where the surface ends at a node, across the edge, its normal there says nothing about the
  !> edge: the arc is then as bent at that end as at the other.
  pure subroutine bend_edges(places, of_surface, faces, f, at)
    real(wp), intent(in) :: places(:, :) !! (3,n) of the nodes [length]
    real(wp), intent(in) :: of_surface(:, :) !! (3,n_faces) normals: far apart another surface
    type(smooth_faces_t), intent(inout) :: faces !! gets bulge(:, :, f)
    integer, intent(in) :: f
    type(lists_t), intent(in) :: at              !! the faces at each node
    real(wp) :: normal(3, face_corners), along(3)
    logical :: goes_on(face_corners) !! over the edge from corner k to another face
    integer :: k, a, b, m
    logical :: known_a, known_b

    m = corners_of(f)
    do a = 1, m
      normal(:, a) = normal_at(a)
      goes_on(a) = has_neighbour(faces%nodes(a, f), faces%nodes(next(a, m), f))
    end do
    do a = 1, m
      b = next(a, m)
      k = merge(face_corners, a, a == m) ! of a triangle the third edge has no length
      along = places(:, faces%nodes(b, f)) - places(:, faces%nodes(a, f))
      known_a = goes_on(last(a, m))
      known_b = goes_on(b)
      if (m < face_corners) then
        ! Beyond the edges at a triangle's corner may be nothing but what is beside it.
        known_a = lies_behind(faces%nodes(a, f), along)
        known_b = lies_behind(faces%nodes(b, f), -along)
      end if
      if (known_a) faces%bulge(:, k, f) = rise(0.5_wp*along, normal(:, a))
      if (known_b) faces%bulge(:, k, f) = faces%bulge(:, k, f) + rise(-0.5_wp*along, normal(:, b))
      if (known_a .and. known_b) faces%bulge(:, k, f) = 0.5_wp*faces%bulge(:, k, f)
    end do

  contains

    pure integer function corners_of(face)
      integer, intent(in) :: face

      corners_of = merge(face_corners - 1, face_corners, &
        faces%nodes(face_corners - 1, face) == faces%nodes(face_corners, face))
    end function corners_of

    !> The corner behind one of m, and that before it.
    pure integer function next(corner, m)
      integer, intent(in) :: corner, m

      next = 1 + mod(corner, m)
    end function next

    pure integer function last(corner, m)
      integer, intent(in) :: corner, m

      last = 1 + mod(corner + m - 2, m)
    end function last

    !> Height of an arc over the middle of its chord, `to_middle` from its end, where its normal is
    !> n: |to_middle| tan(theta/2), sin(theta) = to_middle . n/|to_middle|, along the face's normal.
    pure function rise(to_middle, n)
      real(wp), intent(in) :: to_middle(3), n(3)
      real(wp) :: rise(3)
      real(wp) :: height, c

      height = dot_product(to_middle, n)
      c = sqrt(max(0.0_wp, 1.0_wp - height**2/max(dot_product(to_middle, to_middle), &
        tiny(1.0_wp))))
      rise = -height/(1.0_wp + c)*faces%normal(:, f)
    end function rise

    !> The normal of the surface at a corner: that of a sphere or cylinder, where its nodes are on
    !> one, however long the faces. Those beyond an edge are another surface.
    pure function normal_at(corner) result(n)
      integer, intent(in) :: corner
      real(wp) :: n(3)
      real(wp) :: one(3), other(3)
      integer :: node, i, j, g

      node = faces%nodes(corner, f)
      n = 0.0_wp
      do i = at%first(node), at%first(node + 1) - 1
        g = at%item(i)
        if (dot_product(of_surface(:, g), of_surface(:, f)) < sharp) cycle
        j = findloc(faces%nodes(:, g), node, dim=1)
        one = places(:, faces%nodes(next(j, corners_of(g)), g)) - places(:, node)
        other = places(:, faces%nodes(last(j, corners_of(g)), g)) - places(:, node)
        n = n + cross(one, other)/max(sum(one**2)*sum(other**2), tiny(1.0_wp))
      end do
      n = n/max(norm2(n), tiny(1.0_wp))
    end function normal_at

    !> Whether the smooth surface goes on beyond an edge of the face.
    pure logical function has_neighbour(one, other)
      integer, intent(in) :: one, other !! nodes of the edge
      integer :: i, g

      has_neighbour = .false.
      do i = at%first(one), at%first(one + 1) - 1
        g = at%item(i)
        if (g == f) cycle
        if (dot_product(of_surface(:, g), of_surface(:, f)) < sharp) cycle
        if (any(faces%nodes(:, g) == other)) has_neighbour = .true.
      end do
    end function has_neighbour

    !> Whether a face of the smooth surface at a node lies behind it, seen along a direction.
    pure logical function lies_behind(node, direction)
      integer, intent(in) :: node
      real(wp), intent(in) :: direction(3)
      integer :: i

      lies_behind = .false.
      do i = at%first(node), at%first(node + 1) - 1
        associate (g => at%item(i))
          if (dot_product(of_surface(:, g), of_surface(:, f)) < sharp) cycle
          associate (corners => faces%nodes(:corners_of(g), g))
            if (dot_product(sum(places(:, corners), 2)/size(corners) - places(:, node), &
              direction) < 0.0_wp) lies_behind = .true.
          end associate
        end associate
      end do
    end function lies_behind

  end subroutine bend_edges

  !> How far the smooth surface is from the flat face at a point of it. docs/theory.md (10.7).
  pure function bulge_at(faces, f, xi, eta) result(b)
    type(smooth_faces_t), intent(in) :: faces
    integer, intent(in) :: f
    real(wp), intent(in) :: xi, eta !! -1 to 1
    real(wp) :: b(3)                !! [length]

    b = 0.5_wp*((1.0_wp - eta)*arc(1, xi) + (1.0_wp + xi)*arc(2, eta) + &
      (1.0_wp + eta)*arc(3, xi) + (1.0_wp - xi)*arc(4, eta))

  contains

    !> The arc over an edge, at `t` from its middle, its ends at -1 and 1.
    pure function arc(k, t)
      integer, intent(in) :: k
      real(wp), intent(in) :: t
      real(wp) :: arc(3)
      real(wp) :: height, c, curvature

      height = norm2(faces%bulge(:, k, f))
      c = faces%half(k, f)
      curvature = 2.0_wp*height/max(c**2 + height**2, tiny(1.0_wp))
      arc = (1.0_wp - 2.0_wp*(t*c)**2/max(c**2 + height**2, tiny(1.0_wp))/ &
        (1.0_wp + sqrt(max(0.0_wp, 1.0_wp - (t*c*curvature)**2))))*faces%bulge(:, k, f)
    end function arc

  end function bulge_at

  !> The bilinear shape functions of a face.
  pure function shape_at(xi, eta) result(n)
    real(wp), intent(in) :: xi, eta
    real(wp) :: n(4)

    n = 0.25_wp*(1.0_wp + xi*xi_node)*(1.0_wp + eta*eta_node)
  end function shape_at

  !> The point of a flat face, and of its way, that is closest to the origin, from a first guess.
  !>
  !> The distance is that of sum N_a(xi, eta) (x_a + s way_a): linear in each of xi, eta and s, so
  !> that each in turn has its best value in closed form.
  pure subroutine find_closest(x, way, s_range, xi, eta, s)
    real(wp), intent(in) :: x(3, 4)     !! the nodes at s = 0 [length]
    real(wp), intent(in) :: way(3, 4)   !! how far they go until s = 1 [length]
    real(wp), intent(in) :: s_range(2)
    real(wp), intent(inout) :: xi, eta, s
    integer, parameter :: rounds = 30
    real(wp) :: now(3, 4), before(3)
    integer :: i

    do i = 1, rounds
      before = [xi, eta, s]
      now = x + s*way
      xi = best(matmul(now, shape_at(0.0_wp, eta)), matmul(now, shape_at(1.0_wp, eta) - &
        shape_at(0.0_wp, eta)), xi, [-1.0_wp, 1.0_wp])
      eta = best(matmul(now, shape_at(xi, 0.0_wp)), matmul(now, shape_at(xi, 1.0_wp) - &
        shape_at(xi, 0.0_wp)), eta, [-1.0_wp, 1.0_wp])
      s = best(matmul(x, shape_at(xi, eta)), matmul(way, shape_at(xi, eta)), s, s_range)
      if (maxval(abs([xi, eta, s] - before)) < 1.0e-12_wp) return
    end do

  contains

    !> Where |a + t b| is least within a range.
    pure real(wp) function best(a, b, t, range)
      real(wp), intent(in) :: a(3), b(3), t, range(2)

      best = t
      if (.not. dot_product(b, b) > 0.0_wp) return
      best = min(range(2), max(range(1), -dot_product(a, b)/dot_product(b, b)))
    end function best

  end subroutine find_closest

end module smooth_faces_mod
