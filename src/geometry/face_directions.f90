!> The faces of a surface by the direction of their normals: what may be turned towards a face, and
!> whether a surface may come to touch itself.
module face_directions_mod
  use connectivity_mod, only: corners_in
  use face_overlap_mod, only: outward_normal
  use kinds_mod, only: wp
  use lists_mod, only: columns_with, lists_by_key, lists_t
  use surface_reach_mod, only: against
  implicit none
  private

  public :: directions_t, directions_of, looks_at, are_before, may_touch_itself, &
    add_what_continues

  integer, parameter :: cells = 4 !! of directions along each edge of a cube
  integer, parameter :: n_cells = 6*cells**2

  !> The box of the faces of each cell.
  type :: directions_t
    real(wp) :: low(3, n_cells), high(3, n_cells) !! empty where low > high [length]
    real(wp) :: least(3, n_cells), most(3, n_cells) !! of the components of their normals [-]
    type(lists_t) :: faces                          !! of each cell, ascending
  end type directions_t

contains

  !> The faces of a surface by their directions.
  pure type(directions_t) function directions_of(corner, x) result(of)
    integer, intent(in) :: corner(:, :) !! (4,n_faces) the fourth is 0 in a triangle
    real(wp), intent(in) :: x(:, :)     !! (3,n_nodes) [length]
    integer :: f, k, cell(size(corner, 2))
    real(wp) :: normal(3)

    of%low = huge(1.0_wp)
    of%high = -huge(1.0_wp)
    of%least = 1.0_wp
    of%most = -1.0_wp
    do f = 1, size(corner, 2)
      associate (its => x(:, corner(:corners_in(corner(:, f)), f)))
        normal = outward_normal(its)
        k = cell_of(normal)
        cell(f) = k
        of%low(:, k) = min(of%low(:, k), minval(its, 2))
        of%high(:, k) = max(of%high(:, k), maxval(its, 2))
        of%least(:, k) = min(of%least(:, k), normal)
        of%most(:, k) = max(of%most(:, k), normal)
      end associate
    end do
    of%faces = lists_by_key(cell, n_cells)
  end function directions_of

  !> Whether a face has something before it that may be turned towards it.
  pure logical function looks_at(face, other, depth) result(looks)
    real(wp), intent(in) :: face(:, :) !! (3,3) or (3,4) its corners [length]
    type(directions_t), intent(in) :: other
    real(wp), intent(in) :: depth      !! behind the face that counts as before it, too [length]
    real(wp) :: n(3)
    integer :: k

    n = outward_normal(face)
    looks = .false.
    do k = 1, n_cells
      looks = looks_at_cell(face, n, other, k, depth)
      if (looks) return
    end do
  end function looks_at

  pure logical function looks_at_cell(face, n, other, k, depth) result(looks)
    real(wp), intent(in) :: face(:, :), n(3) !! corners and normal
    type(directions_t), intent(in) :: other
    integer, intent(in) :: k
    real(wp), intent(in) :: depth            !! as of looks_at [length]

    looks = .false.
    if (other%low(1, k) > other%high(1, k)) return
    if (sum(min(n*other%least(:, k), n*other%most(:, k))) > against) return
    looks = sum(max(n*other%low(:, k), n*other%high(:, k))) + depth > minval(matmul(n, face))
  end function looks_at_cell

  !> Whether two faces are before each other and turned towards each other.
  pure logical function are_before(one, other, close_by)
    real(wp), intent(in) :: one(:, :), other(:, :) !! (3,3) or (3,4) corners [length]
    real(wp), intent(in) :: close_by               !! that far before is not [length]
    real(wp) :: n(3), m(3)

    n = outward_normal(one)
    m = outward_normal(other)
    are_before = dot_product(n, m) <= against
    if (are_before) are_before = maxval(matmul(n, other)) > minval(matmul(n, one)) + close_by &
      .and. maxval(matmul(m, one)) > minval(matmul(m, other)) + close_by
  end function are_before

  !> Whether two faces of a surface are before each other and turned towards each other: then it may
  !> come to touch itself by bending, though nothing lies along the normal of a face yet.
  pure logical function may_touch_itself(corner, x) result(may)
    integer, intent(in) :: corner(:, :) !! (4,n_faces) the fourth is 0 in a triangle
    real(wp), intent(in) :: x(:, :)     !! (3,n_nodes) [length]
    real(wp), parameter :: rounding = 1.0e-9_wp !! of the surface's size [-]
    type(directions_t) :: by_direction
    real(wp) :: close_by
    integer :: f, i, k

    may = .false.
    if (size(corner, 2) == 0) return
    by_direction = directions_of(corner, x)
    close_by = rounding*maxval(maxval(by_direction%high, 2) - minval(by_direction%low, 2))
    do f = 1, size(corner, 2)
      associate (face => x(:, corner(:corners_in(corner(:, f)), f)))
        do k = 1, n_cells
          if (.not. looks_at_cell(face, outward_normal(face), by_direction, k, -close_by)) cycle
          do i = by_direction%faces%first(k), by_direction%faces%first(k + 1) - 1
            associate (g => by_direction%faces%item(i))
              may = are_before(face, x(:, corner(:corners_in(corner(:, g)), g)), close_by)
            end associate
            if (may) return
          end do
        end do
      end associate
    end do

  end function may_touch_itself

  !> Add to some faces those that continue them, and these, within 60 degrees from face to face.
  pure subroutine add_what_continues(corner, x, is_one)
    integer, intent(in) :: corner(:, :)    !! (4,n_faces) the fourth is 0 in a triangle
    real(wp), intent(in) :: x(:, :)        !! (3,n_nodes) [length]
    logical, intent(inout) :: is_one(:)    !! (n_faces)
    real(wp), parameter :: flat = 0.5_wp   !! cosine of the normals, at least
    type(lists_t) :: about                 !! of each node the faces that have it
    real(wp) :: normal(3, size(is_one))
    integer :: queue(size(is_one)), n, next, c, f, i

    about = columns_with(corner, size(x, 2))
    n = 0
    do f = 1, size(is_one)
      normal(:, f) = outward_normal(x(:, corner(:corners_in(corner(:, f)), f)))
      if (.not. is_one(f)) cycle
      n = n + 1
      queue(n) = f
    end do
    next = 0
    do while (next < n)
      next = next + 1
      do c = 1, corners_in(corner(:, queue(next)))
        associate (node => corner(c, queue(next)))
          do i = about%first(node), about%first(node + 1) - 1
            f = about%item(i)
            if (is_one(f)) cycle
            if (dot_product(normal(:, f), normal(:, queue(next))) < flat) cycle
            is_one(f) = .true.
            n = n + 1
            queue(n) = f
          end do
        end associate
      end do
    end do
  end subroutine add_what_continues

  !> The cell of a direction on the faces of a cube.
  pure integer function cell_of(normal) result(cell)
    real(wp), intent(in) :: normal(3)
    integer :: axis, place(2)

    axis = maxloc(abs(normal), dim=1)
    associate (others => pack(normal, [1, 2, 3] /= axis)/max(abs(normal(axis)), tiny(1.0_wp)))
      place = min(cells - 1, int(0.5_wp*cells*(others + 1.0_wp)))
    end associate
    cell = 1 + place(1) + cells*(place(2) + cells*(2*(axis - 1) + merge(1, 0, normal(axis) > &
      0.0_wp)))
  end function cell_of

end module face_directions_mod
