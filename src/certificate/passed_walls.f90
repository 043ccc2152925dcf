!> Bodies that have gone through themselves within an increment.
!>
!> By code of its own, from moved places alone. docs/theory.md section 6.
module passed_walls_mod
  use kinds_mod, only: wp
  use box_tree_mod, only: box_tree_t, list_meeting, make_box_tree
  use connectivity_mod, only: corners_in
  use hulls_mod, only: hulls_t, make_hulls, middle_of, n_triangles, normal_of, triangle
  use mesh_mod, only: mesh_t
  use small_matrix_mod, only: cross
  implicit none
  private

  public :: passed_wall

  real(wp), parameter :: rounding = 1.0e-9_wp
  !! of places in a triangle, of its area: what passes the edge of two must not miss both [-]
  real(wp), parameter :: same_way = 0.2_wp
  !! cosine of normals that look the same way, at least: as that of what presses from inside,
  !! (9.10) [-]

  type :: moving_t
    type(hulls_t) :: before, after
    type(box_tree_t) :: tree               !! of the boxes in which faces move
    real(wp), allocatable :: normal(:, :)  !! (6,n_faces) before and after [-]
  end type moving_t

contains

  !> A node of an outer face that has gone into its own body through one face and out of it on the
  !> other side of that wall; 0: there is none.
  !>
  !> Places go straight from where they were to where they are: of a body that turns as a whole that
  !> is a turn with a change of size, in which nothing meets. Nodes and middles of faces are
  !> followed through the moving triangles of faces with which they have no node in common.
  pure integer function passed_wall(mesh, old, new, folds) result(node)
    type(mesh_t), intent(in) :: mesh
    real(wp), intent(in) :: old(:, :), new(:, :) !! (3,n_nodes) displacements [length]
    logical, intent(in) :: folds(:)              !! (n_pieces) others may go through themselves
    type(moving_t) :: moving
    real(wp) :: way(3, 2)
    logical :: is_done(mesh%n_nodes)
    integer :: f, k

    node = 0
    if (.not. allocated(mesh%skin)) return
    call make_moving(mesh, old, new, moving)
    is_done = .false.
    do f = 1, size(mesh%skin, 2)
      if (.not. folds(moving%before%piece(f))) cycle
      associate (nodes => mesh%skin(:corners_in(mesh%skin(:, f)), f))
        way = reshape([middle_of(moving%before, f), middle_of(moving%after, f)], [3, 2])
        if (goes_through(moving, f, nodes, way)) node = nodes(1)
        do k = 1, size(nodes)
          if (is_done(nodes(k)) .or. node > 0) cycle
          is_done(nodes(k)) = .true.
          way = reshape([moving%before%x(:, nodes(k)), moving%after%x(:, nodes(k))], [3, 2])
          if (goes_through(moving, f, nodes(k:k), way)) node = nodes(k)
        end do
      end associate
      if (node > 0) return
    end do
  end function passed_wall

  !> The outer faces at the two ends of an increment.
  pure subroutine make_moving(mesh, old, new, moving)
    type(mesh_t), intent(in) :: mesh
    real(wp), intent(in) :: old(:, :), new(:, :) !! (3,n_nodes) displacements [length]
    type(moving_t), intent(out) :: moving
    real(wp) :: box(6, size(mesh%skin, 2))
    integer :: f

    call make_hulls(mesh, mesh%coordinates + old, moving%before)
    call make_hulls(mesh, mesh%coordinates + new, moving%after)
    allocate (moving%normal(6, size(mesh%skin, 2)))
    do f = 1, size(box, 2)
      associate (nodes => mesh%skin(:corners_in(mesh%skin(:, f)), f), &
                 from => moving%before%x, to => moving%after%x)
        box(:, f) = [min(minval(from(:, nodes), 2), minval(to(:, nodes), 2)), &
          max(maxval(from(:, nodes), 2), maxval(to(:, nodes), 2))]
      end associate
      moving%normal(:, f) = [normal_of(moving%before, f), normal_of(moving%after, f)]
    end do
    call make_box_tree(box, moving%normal(4:, :), moving%before%piece, moving%tree)
  end subroutine make_moving

  !> Whether a place of a face goes into its piece and, later, out of it through a face that looks
  !> the other way than the one by which it came.
  pure logical function goes_through(moving, face, own, way)
    type(moving_t), intent(in) :: moving
    integer, intent(in) :: face, own(:)   !! nodes whose faces are not met
    real(wp), intent(in) :: way(3, 2)     !! from, to [length]
    real(wp), allocatable :: entries(:, :), exits(:, :) !! (4,n) normal [-] and time
    integer, allocatable :: near(:)
    integer :: i, j, n

    goes_through = .false.
    call list_meeting(moving%tree, [minval(way, 2), maxval(way, 2)], n, near)
    call list_events(moving, face, own, way, near(:n), .true., entries)
    if (size(entries, 2) == 0) return
    call list_events(moving, face, own, way, near(:n), .false., exits)
    do i = 1, size(entries, 2)
      do j = 1, size(exits, 2)
        goes_through = goes_through .or. (exits(4, j) > entries(4, i) .and. &
          dot_product(exits(:3, j), entries(:3, i)) < 0.0_wp)
      end do
    end do
  end function goes_through

  !> When and where a place of a face comes into its piece, or out of it. A face that it comes in
  !> through looks another way than its own.
  pure subroutine list_events(moving, face, own, way, near, inwards, events)
    type(moving_t), intent(in) :: moving
    integer, intent(in) :: face, own(:), near(:)
    real(wp), intent(in) :: way(3, 2)     !! [length]
    logical, intent(in) :: inwards
    real(wp), allocatable, intent(out) :: events(:, :) !! (4,n) normal [-] and time
    real(wp) :: c0(3, 3), c1(3, 3), times(3), normal(3)
    integer :: i, k, m, n

    allocate (events(4, 0))
    associate (before => moving%before, after => moving%after)
      do i = 1, size(near)
        associate (f => near(i))
          if (before%piece(f) /= before%piece(face)) cycle
          if (inwards .and. looks_alike(moving, f, face)) cycle
          if (any([(any(before%face(:, f) == own(k)), k=1, size(own))])) cycle
          do k = 1, n_triangles(before, f)
            c0 = triangle(before, f, k)
            c1 = triangle(after, f, k)
            call find_meetings(way, c0, c1, times, n)
            do m = 1, n
              if ((times(m) > 0.0_wp) .neqv. inwards) cycle
              normal = area_at(c0, c1, abs(times(m)))
              events = reshape([events, normal/max(tiny(1.0_wp), norm2(normal)), &
                abs(times(m))], [4, size(events, 2) + 1])
            end do
          end do
        end associate
      end do
    end associate
  end subroutine list_events

  !> Whether two faces look the same way before and after.
  pure logical function looks_alike(moving, one, other)
    type(moving_t), intent(in) :: moving
    integer, intent(in) :: one, other

    looks_alike = dot_product(moving%normal(:3, one), moving%normal(:3, other)) > same_way .and. &
      dot_product(moving%normal(4:, one), moving%normal(4:, other)) > same_way
  end function looks_alike

  !> When a place meets a triangle, in parts of the increment: negative where it comes from behind.
  !>
  !> Its height above the plane, times the area, is a cubic of time: between its extremes it has one
  !> root at most.
  pure subroutine find_meetings(way, c0, c1, times, n)
    real(wp), intent(in) :: way(3, 2)         !! [length]
    real(wp), intent(in) :: c0(3, 3), c1(3, 3) !! corners before and after [length]
    real(wp), intent(out) :: times(3)
    integer, intent(out) :: n
    real(wp) :: h(4), a(0:3), ends(4), low, high, middle, disc, sign_low
    integer :: k, step

    n = 0
    ! Its values at four times give the coefficients; those of Bernstein bound it.
    h = [(height(way, c0, c1, real(k, wp)/3.0_wp), k=0, 3)]
    a = [h(1), -5.5_wp*h(1) + 9.0_wp*h(2) - 4.5_wp*h(3) + h(4), 9.0_wp*h(1) - 22.5_wp*h(2) + &
      18.0_wp*h(3) - 4.5_wp*h(4), -4.5_wp*h(1) + 13.5_wp*h(2) - 13.5_wp*h(3) + 4.5_wp*h(4)]
    associate (b => [a(0), a(0) + a(1)/3.0_wp, a(0) + (2.0_wp*a(1) + a(2))/3.0_wp, sum(a)])
      if (all(b > 0.0_wp) .or. all(b < 0.0_wp)) return
    end associate
    ends = [0.0_wp, 1.0_wp, 1.0_wp, 1.0_wp]
    disc = a(2)**2 - 3.0_wp*a(1)*a(3)
    if (disc > 0.0_wp) then
      ! Both extremes by quotients that lose no digits.
      low = -(a(2) + sign(sqrt(disc), a(2)))
      high = merge(a(1)/low, 2.0_wp, abs(low) > abs(a(1))*epsilon(1.0_wp))
      low = merge(low/(3.0_wp*a(3)), 2.0_wp, abs(3.0_wp*a(3)) > abs(low)*epsilon(1.0_wp))
      ends(2:3) = max(0.0_wp, min(1.0_wp, [min(low, high), max(low, high)]))
    else if (abs(a(3)) <= 0.0_wp .and. abs(a(2)) > 0.0_wp) then
      ends(2:3) = max(0.0_wp, min(1.0_wp, -0.5_wp*a(1)/a(2)))
    end if
    do k = 1, 3
      low = ends(k)
      high = ends(k + 1)
      if (.not. high > low) cycle
      sign_low = height(way, c0, c1, low)
      if ((sign_low > 0.0_wp) .eqv. (height(way, c0, c1, high) > 0.0_wp)) cycle
      do step = 1, 52
        middle = 0.5_wp*(low + high)
        if ((height(way, c0, c1, middle) > 0.0_wp) .eqv. (sign_low > 0.0_wp)) then
          low = middle
        else
          high = middle
        end if
      end do
      if (.not. is_within(way, c0, c1, high)) cycle
      n = n + 1
      times(n) = merge(high, -high, sign_low > 0.0_wp)
    end do
  end subroutine find_meetings

  !> The height of a moving place above a moving triangle, times twice its area [length^3].
  pure real(wp) function height(way, c0, c1, time)
    real(wp), intent(in) :: way(3, 2), c0(3, 3), c1(3, 3), time
    real(wp) :: corner(3)

    corner = (1.0_wp - time)*c0(:, 1) + time*c1(:, 1)
    height = dot_product(area_at(c0, c1, time), (1.0_wp - time)*way(:, 1) + time*way(:, 2) - corner)
  end function height

  !> Twice the area vector of a moving triangle [length^2].
  pure function area_at(c0, c1, time) result(area)
    real(wp), intent(in) :: c0(3, 3), c1(3, 3), time
    real(wp) :: area(3), c(3, 3)

    c = (1.0_wp - time)*c0 + time*c1
    area = cross(c(:, 2) - c(:, 1), c(:, 3) - c(:, 1))
  end function area_at

  !> Whether a place in the plane of a moving triangle is in it, or on its edge.
  pure logical function is_within(way, c0, c1, time) result(is)
    real(wp), intent(in) :: way(3, 2), c0(3, 3), c1(3, 3), time
    real(wp) :: c(3, 3), place(3), area(3)
    integer :: k

    c = (1.0_wp - time)*c0 + time*c1
    place = (1.0_wp - time)*way(:, 1) + time*way(:, 2)
    area = area_at(c0, c1, time)
    is = .true.
    do k = 1, 3
      is = is .and. dot_product(area, cross(c(:, 1 + mod(k, 3)) - place, c(:, 1 + mod(k + 1, 3)) - &
        place)) >= -rounding*dot_product(area, area)
    end do
  end function is_within

end module passed_walls_mod
