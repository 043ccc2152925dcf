!> What of a piece of a slave face's plane sees a master, for the certificate: triangles of other
!> faces are veils, and cut it into what they hide and what they do not. docs/theory.md section 11.
module veils_mod
  use kinds_mod, only: wp
  implicit none
  private

  public :: veil_t, triangle_t, draw

  type :: triangle_t
    real(wp) :: x(2, 3) = 0.0_wp       !! corners in the plane [length]
  end type triangle_t

  !> A triangle of a face over or under the plane.
  type :: veil_t
    integer :: of = 0                  !! the face that it is a part of
    type(triangle_t) :: seen           !! from above
    real(wp) :: height(3) = 0.0_wp     !! of its corners above the plane [length]
    logical :: is_turned_here = .false. !! the plane sees its outer side from below
    logical :: leans = .false.         !! it faces neither side: it counts behind the plane alone
    logical :: is_of_slave = .false., is_of_master = .false. !! a face of this body
    real(wp) :: warp = -1.0_wp
    !! of a neighbour of the slave face or the master's: how far their edges are from their planes,
    !! by which it must be between them; else below 0 [length]
  end type veil_t

contains

  !> Take what veils hide of a master out of triangles. Before the plane each does, and where its
  !> outer side touches plane or master: what is beyond is in a body. Behind it a place and what it
  !> sees are of bodies that do not overlap there where both bodies end between them; of one body
  !> each veil that does not lean hides.
  pure subroutine draw(veils, master, rounding, least, triangles)
    type(veil_t), intent(in) :: veils(:)
    real(wp), intent(in) :: master(3)   !! height at the origin, slopes of the master [length, -, -]
    real(wp), intent(in) :: rounding    !! heights that are one [length]
    real(wp), intent(in) :: least       !! area that counts, times two [length^2]
    type(triangle_t), allocatable, intent(inout) :: triangles(:)
    type(triangle_t), allocatable :: in_slave(:), beyond(:), in_master(:), apart(:)
    logical :: is_one_body
    integer :: i

    do i = 1, size(veils)
      if (.not. veils(i)%leans) call take(limits_of(veils(i), master, rounding, .true.), least, &
        triangles)
    end do
    allocate (beyond(0), apart(0))
    in_slave = triangles
    is_one_body = any(veils%is_of_slave .and. veils%is_of_master)
    do i = 1, size(veils)
      if (.not. veils(i)%is_of_slave .or. (is_one_body .and. veils(i)%leans)) cycle
      call take(limits_of(veils(i), master, rounding, .false.), least, in_slave, beyond)
    end do
    if (is_one_body) then
      call move_alloc(in_slave, triangles)
    else if (size(beyond) > 0) then
      in_master = beyond
      do i = 1, size(veils)
        if (veils(i)%is_of_master) call take(limits_of(veils(i), master, rounding, .false.), &
          least, in_master, apart)
      end do
      if (size(apart) > 0) triangles = [in_slave, in_master]
    end if
  end subroutine draw

  !> Take out of triangles what of them is within all limits.
  pure subroutine take(limits, least, triangles, taken)
    real(wp), intent(in) :: limits(3, 6) !! as of limits_of
    real(wp), intent(in) :: least        !! as of draw [length^2]
    type(triangle_t), allocatable, intent(inout) :: triangles(:)
    type(triangle_t), allocatable, intent(inout), optional :: taken(:) !! gets that
    type(triangle_t), allocatable :: inside(:), outside(:), rest(:), left(:), within(:)
    logical :: is_cut(size(triangles))
    integer :: n_left, n_within, i, k, limit

    do i = 1, size(triangles)
      is_cut(i) = reaches(limits, triangles(i))
    end do
    if (.not. any(is_cut)) return
    n_left = 0
    n_within = 0
    allocate (left(count(is_cut)), within(count(is_cut)))
    do i = 1, size(triangles)
      if (.not. is_cut(i)) cycle
      allocate (inside, source=triangles(i:i))
      allocate (outside(0))
      do limit = 1, 6
        allocate (rest(0))
        do k = 1, size(inside)
          call cut(values(limits(:, limit), inside(k)), least, inside(k), rest, outside)
        end do
        call move_alloc(rest, inside)
      end do
      is_cut(i) = size(inside) > 0
      if (is_cut(i)) then
        call append(outside, left, n_left)
        call append(inside, within, n_within)
      end if
      deallocate (inside, outside)
    end do
    if (n_within == 0) return
    triangles = [pack(triangles, .not. is_cut), left(:n_left)]
    if (present(taken)) taken = [taken, within(:n_within)]
  end subroutine take

  !> Add triangles to the first n of a list.
  pure subroutine append(new, list, n)
    type(triangle_t), intent(in) :: new(:)
    type(triangle_t), allocatable, intent(inout) :: list(:) !! room for n or more
    integer, intent(inout) :: n

    if (n + size(new) > size(list)) list = [list, new, list]
    list(n + 1:n + size(new)) = new
    n = n + size(new)
  end subroutine append

  !> Whether some of a triangle may be within all limits: else the veil hides nothing of it.
  pure logical function reaches(limits, triangle)
    real(wp), intent(in) :: limits(3, 6) !! as of limits_of
    type(triangle_t), intent(in) :: triangle
    integer :: i

    reaches = .false.
    do i = 1, 6
      if (maxval(values(limits(:, i), triangle)) <= 0.0_wp) return
    end do
    reaches = .true.
  end function reaches

  !> What is below 0 outside the six limits of what a veil hides, its three edges, and heights
  !> between the plane and the master: at the origin, and its slopes.
  pure function limits_of(veil, master, rounding, is_before) result(f)
    type(veil_t), intent(in) :: veil
    real(wp), intent(in) :: master(3), rounding !! as of draw
    logical, intent(in) :: is_before            !! the plane; or behind it
    real(wp) :: f(3, 6)
    real(wp) :: height(3)
    integer :: k

    height = 0.0_wp
    do k = 1, 3
      associate (from => veil%seen%x(:, 1 + mod(k, 3)), to => veil%seen%x(:, 1 + mod(k + 1, 3)))
        f(:, k) = [from(1)*to(2) - from(2)*to(1), from(2) - to(2), to(1) - from(1)]/ &
          doubled(veil%seen)
      end associate
      height = height + f(:, k)*veil%height(k)
    end do
    f(:, 4) = merge(master, -master, is_before)
    f(:, 5) = merge(height, -height, is_before)
    f(:, 6) = f(:, 4) - f(:, 5)
    if (veil%warp >= 0.0_wp) then
      f(1, 5:) = f(1, 5:) - merge(rounding, -rounding, is_before) - veil%warp
    else
      f(1, 5) = f(1, 5) + merge(rounding, -rounding, is_before .and. veil%is_turned_here)
      f(1, 6) = f(1, 6) + merge(rounding, -rounding, is_before .and. .not. veil%is_turned_here)
    end if
  end function limits_of

  !> A linear function at the corners of a triangle.
  pure function values(f, triangle) result(at)
    real(wp), intent(in) :: f(3)      !! at the origin, and its slopes
    type(triangle_t), intent(in) :: triangle
    real(wp) :: at(3)

    at = f(1) + f(2)*triangle%x(1, :) + f(3)*triangle%x(2, :)
  end function values

  !> Cut a triangle along a line into triangles on either side of it.
  pure subroutine cut(side, least, triangle, inside, outside)
    real(wp), intent(in) :: side(3)           !! above 0 where a corner is inside
    real(wp), intent(in) :: least             !! as of draw [length^2]
    type(triangle_t), intent(in) :: triangle
    type(triangle_t), allocatable, intent(inout) :: inside(:), outside(:)
    real(wp) :: one(2), other(2)
    integer :: lone

    if (minval(side) >= 0.0_wp) then
      inside = [inside, triangle]
    else if (maxval(side) <= 0.0_wp) then
      outside = [outside, triangle]
    else
      ! The corner that is on its side alone, and where the line crosses its edges.
      lone = merge(minloc(side, 1), maxloc(side, 1), count(side >= 0.0_wp) > 1)
      associate (a => triangle%x(:, lone), b => triangle%x(:, 1 + mod(lone, 3)), &
                 c => triangle%x(:, 1 + mod(lone + 1, 3)), s => cshift(side, lone - 1))
        one = a + s(1)/(s(1) - s(2))*(b - a)
        other = a + s(1)/(s(1) - s(3))*(c - a)
        associate (tip => [triangle_t(reshape([a, one, other], [2, 3]))], base => [triangle_t( &
                   reshape([one, b, c], [2, 3])), triangle_t(reshape([one, c, other], [2, 3]))])
          if (side(lone) > 0.0_wp) then
            inside = [inside, pack(tip, abs(doubled(tip)) >= least)]
            outside = [outside, pack(base, abs(doubled(base)) >= least)]
          else
            outside = [outside, pack(tip, abs(doubled(tip)) >= least)]
            inside = [inside, pack(base, abs(doubled(base)) >= least)]
          end if
        end associate
      end associate
    end if
  end subroutine cut

  !> Twice the area; below 0 where corners are clockwise.
  pure elemental real(wp) function doubled(triangle)
    type(triangle_t), intent(in) :: triangle

    associate (x => triangle%x)
      doubled = turned(x(:, 1), x(:, 2), x(:, 3))
    end associate
  end function doubled

  !> The same of three corners.
  pure real(wp) function turned(a, b, c)
    real(wp), intent(in) :: a(2), b(2), c(2) !! [length]

    turned = (b(1) - a(1))*(c(2) - a(2)) - (b(2) - a(2))*(c(1) - a(1))
  end function turned

end module veils_mod
