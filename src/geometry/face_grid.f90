!> Which faces of a surface are near a place: a grid of cells, each with the faces whose boxes meet
!> it.
module face_grid_mod
  use kinds_mod, only: wp
  use growing_lists_mod, only: append
  use lists_mod, only: lists_t, lists_by_key
  use sorting_mod, only: sort_unique
  implicit none
  private

  public :: face_grid_t, make_face_grid, faces_near

  !> The cells of a box around all faces, x fastest.
  type :: face_grid_t
    integer  :: n(3) = 0                 !! cells along x, y, z
    real(wp) :: low(3) = 0.0_wp          !! corner of the box [length]
    real(wp) :: size(3) = 1.0_wp         !! of a cell [length]
    type(lists_t) :: faces               !! of each cell, ascending
    integer, allocatable :: cell(:, :, :) !! (3,2,n_faces) first and last of each face
    real(wp), allocatable :: box(:, :, :) !! (3,2,n_faces) lowest and highest coordinates [length]
  end type face_grid_t

  integer, parameter :: max_cells = 256 !! along an axis

contains

  !> The grid of a surface whose nodes are at `x`. Cells are as large as faces are on average, along
  !> each axis by itself: faces may be slender.
  pure type(face_grid_t) function make_face_grid(faces, x) result(grid)
    integer, intent(in) :: faces(:, :)  !! (4,n_faces) or (8,n_faces) nodes, 0 behind them
    real(wp), intent(in) :: x(:, :)     !! (3,n_nodes) [length]
    real(wp) :: extent(3), mean(3)
    integer :: f, i, j, k, n
    integer, allocatable :: cell(:), face(:) !! of each that a face meets

    allocate (grid%box(3, 2, size(faces, 2)))
    do f = 1, size(faces, 2)
      grid%box(:, 1, f) = x(:, faces(1, f))
      grid%box(:, 2, f) = x(:, faces(1, f))
      do k = 2, count(faces(:, f) > 0)
        grid%box(:, 1, f) = min(grid%box(:, 1, f), x(:, faces(k, f)))
        grid%box(:, 2, f) = max(grid%box(:, 2, f), x(:, faces(k, f)))
      end do
    end do
    if (size(faces, 2) == 0) return
    grid%low = minval(grid%box(:, 1, :), 2)
    extent = maxval(grid%box(:, 2, :), 2) - grid%low
    mean = sum(grid%box(:, 2, :) - grid%box(:, 1, :), 2)/real(size(faces, 2), wp)
    grid%n = 1
    do k = 1, 3
      if (mean(k) > 0.0_wp) grid%n(k) = max(1, min(max_cells, int(min(extent(k)/mean(k), &
        real(max_cells, wp)))))
    end do
    ! Cells of a solid box would mostly be empty: as many as there are faces are enough.
    do while (product(real(grid%n, wp)) > 8.0_wp*real(size(faces, 2), wp) + 8.0_wp)
      grid%n = max(1, grid%n/2)
    end do
    grid%size = max(extent/real(grid%n, wp), tiny(1.0_wp))
    allocate (grid%cell(3, 2, size(faces, 2)))
    do f = 1, size(faces, 2)
      grid%cell(:, 1, f) = cell_of(grid, grid%box(:, 1, f))
      grid%cell(:, 2, f) = cell_of(grid, grid%box(:, 2, f))
    end do
    allocate (cell(sum(product(grid%cell(:, 2, :) - grid%cell(:, 1, :) + 1, 1))))
    allocate (face(size(cell)))
    n = 0
    do f = 1, size(faces, 2)
      associate (first => grid%cell(:, 1, f), last => grid%cell(:, 2, f))
        do k = first(3), last(3)
          do j = first(2), last(2)
            do i = first(1), last(1)
              n = n + 1
              cell(n) = i + grid%n(1)*(j - 1 + grid%n(2)*(k - 1))
              face(n) = f
            end do
          end do
        end do
      end associate
    end do
    grid%faces = lists_by_key(cell, product(grid%n))
    grid%faces%item = face(grid%faces%item)
  end function make_face_grid

  !> The faces whose boxes meet a box, ascending, each once.
  pure subroutine faces_near(grid, low, high, near)
    type(face_grid_t), intent(in) :: grid
    real(wp), intent(in) :: low(3), high(3)     !! of the box [length]
    integer, allocatable, intent(out) :: near(:)
    integer :: i, j, k, f, n, first(3), last(3), cell, entry

    n = 0
    allocate (near(64))
    if (size(grid%box, 3) > 0) then
      first = cell_of(grid, low)
      last = cell_of(grid, high)
      do k = first(3), last(3)
        do j = first(2), last(2)
          do i = first(1), last(1)
            cell = i + grid%n(1)*(j - 1 + grid%n(2)*(k - 1))
            do entry = grid%faces%first(cell), grid%faces%first(cell + 1) - 1
              f = grid%faces%item(entry)
              ! In the first of its cells that the box meets.
              if (any(max(grid%cell(:, 1, f), first) /= [i, j, k])) cycle
              if (all(grid%box(:, 1, f) <= high) .and. all(grid%box(:, 2, f) >= low)) call &
                append(near, n, f)
            end do
          end do
        end do
      end do
    end if
    near = near(:n)
    call sort_unique(near)
  end subroutine faces_near

  !> The cell of a place; of one outside the box the nearest.
  pure function cell_of(grid, x) result(cell)
    type(face_grid_t), intent(in) :: grid
    real(wp), intent(in) :: x(3)  !! [length]
    integer :: cell(3)
    real(wp) :: inside(3) !! [length]

    ! Cells of a flat surface may be next to nothing across it: no quotient of a place far away.
    inside = min(max(x - grid%low, 0.0_wp), grid%size*real(grid%n, wp))
    cell = 1 + min(int(inside/grid%size), grid%n - 1)
  end function cell_of

end module face_grid_mod
