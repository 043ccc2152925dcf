!> Planes across an axis at which surfaces end, or about which facets are their own mirror images.
!> docs/theory.md section 11.
!>
!> Whether supports make such a plane one of symmetry is not said here.
module mirror_planes_mod
  use kinds_mod, only: wp
  use connectivity_mod, only: corners_in
  use obstacles_mod, only: obstacle_t
  use face_grid_mod, only: face_grid_t, make_face_grid, faces_near
  implicit none
  private

  public :: is_mirrored, keep_on_ends

  real(wp), parameter :: single = 1.0e-6_wp   !! of the size of both: corners of files [-]
  real(wp), parameter :: rounding = 1.0e-9_wp !! of the size of both: nodes on one plane [-]
  real(wp), parameter :: leaning = 0.5_wp     !! sine: surfaces that lean by more do not end there

contains

  !> Whether the facets of an obstacle end at a plane, on the side of the slave, or have their
  !> mirror images among them as far from it as the slave's faces there.
  pure logical function is_mirrored(slave, x, obstacle, axis, place)
    integer, intent(in) :: slave(:, :)  !! (4,n_slave) nodes of the faces; the fourth may be 0
    real(wp), intent(in) :: x(:, :)     !! (3,n_nodes) [length]
    type(obstacle_t), intent(in) :: obstacle
    integer, intent(in) :: axis
    real(wp), intent(in) :: place       !! of the plane along the axis [length]
    real(wp) :: close_by, width, inwards
    integer :: f

    close_by = single*max(maxval(maxval(x, dim=2) - minval(x, dim=2)), &
      maxval(maxval(obstacle%corner, dim=2) - minval(obstacle%corner, dim=2)))
    width = 0.0_wp
    inwards = 0.0_wp
    do f = 1, size(slave, 2)
      associate (way => x(axis, slave(:corners_in(slave(:, f)), f)) - place)
        if (minval(abs(way)) <= close_by) width = max(width, maxval(abs(way)))
        inwards = inwards + sum(way)
      end associate
    end do
    associate (way => sign(1.0_wp, inwards)*(obstacle%corner(axis, :) - place))
      if (minval(way) >= -close_by) then
        is_mirrored = minval(way) <= close_by
      else
        is_mirrored = has_images(obstacle, axis, place, width, close_by)
      end if
    end associate
  end function is_mirrored

  !> Whether the corners of facets near a plane have corners as mirror images, and there are some.
  !> How quadrilaterals are cut into triangles need not be alike on both sides.
  pure logical function has_images(obstacle, axis, place, width, close_by)
    type(obstacle_t), intent(in) :: obstacle
    integer, intent(in) :: axis
    real(wp), intent(in) :: place       !! of the plane along the axis [length]
    real(wp), intent(in) :: width       !! from it on facets need none [length]
    real(wp), intent(in) :: close_by    !! how far an image may be off [length]
    type(face_grid_t) :: grid
    logical :: is_near(size(obstacle%corner, 2))
    real(wp) :: image(3)
    integer :: f, i, n

    is_near = .false.
    do f = 1, size(obstacle%facet, 2)
      n = count(obstacle%facet(:, f) > 0)
      associate (corners => obstacle%facet(:n, f))
        if (minval(obstacle%corner(axis, corners)) <= place + width .and. &
          maxval(obstacle%corner(axis, corners)) >= place - width) is_near(corners) = .true.
      end associate
    end do
    has_images = any(is_near)
    if (.not. has_images) return
    grid = make_face_grid(obstacle%facet, obstacle%corner)
    do i = 1, size(is_near)
      if (.not. is_near(i)) cycle
      image = obstacle%corner(:, i)
      image(axis) = 2.0_wp*place - image(axis)
      has_images = is_corner(obstacle, grid, image, close_by)
      if (.not. has_images) return
    end do
  end function has_images

  !> Whether a facet has a corner at a place.
  pure logical function is_corner(obstacle, grid, place, close_by)
    type(obstacle_t), intent(in) :: obstacle
    type(face_grid_t), intent(in) :: grid !! of its facets
    real(wp), intent(in) :: place(3)      !! [length]
    real(wp), intent(in) :: close_by      !! how far it may be off [length]
    integer, allocatable :: near(:)
    integer :: i, k

    is_corner = .true.
    call faces_near(grid, place - close_by, place + close_by, near)
    do i = 1, size(near)
      do k = 1, count(obstacle%facet(:, near(i)) > 0)
        if (maxval(abs(obstacle%corner(:, obstacle%facet(k, near(i))) - place)) <= close_by) return
      end do
    end do
    is_corner = .false.
  end function is_corner

  !> Turn the normals of nodes at which both surfaces end into the planes across which they do.
  !>
  !> A normal there is a mean over the faces of one side, and leans: what is moved along it would
  !> leave the plane.
  pure subroutine keep_on_ends(slave, slave_nodes, x, normal, master_nodes, obstacle)
    integer, intent(in) :: slave(:, :)       !! (4,n_slave) nodes of the faces; the fourth may be 0
    integer, intent(in) :: slave_nodes(:)    !! (n) each once
    real(wp), intent(in) :: x(:, :)          !! (3,n_nodes) [length]
    real(wp), intent(inout) :: normal(:, :)  !! (3,n) of these; 0 where nothing covers one [-]
    integer, intent(in), optional :: master_nodes(:) !! of the other surface; or
    type(obstacle_t), intent(in), optional :: obstacle
    logical :: on(size(slave_nodes))
    real(wp) :: close_by, place, other, length
    integer :: axis, end, i

    close_by = rounding*maxval(maxval(x, dim=2) - minval(x, dim=2))
    do axis = 1, 3
      do end = 1, 2
        place = minval(x(axis, slave_nodes))
        if (end == 2) place = maxval(x(axis, slave_nodes))
        on = abs(x(axis, slave_nodes) - place) <= close_by
        if (all(on) .or. any(on .and. abs(normal(axis, :)) > leaning)) cycle
        if (present(master_nodes)) then
          other = minval(x(axis, master_nodes))
          if (end == 2) other = maxval(x(axis, master_nodes))
          if (abs(other - place) > close_by) cycle
        end if
        if (present(obstacle)) then
          if (.not. is_mirrored(slave, x, obstacle, axis, place)) cycle
        end if
        do i = 1, size(slave_nodes)
          if (.not. on(i)) cycle
          normal(axis, i) = 0.0_wp
          length = norm2(normal(:, i))
          if (length > 0.0_wp) normal(:, i) = normal(:, i)/length
        end do
      end do
    end do
  end subroutine keep_on_ends

end module mirror_planes_mod
