!> Cells of which several nodes are one: the wedges, pyramids and tetrahedra that they are.
!>
!>        8-------7            7,8               Corners 3 and 4 are one, and so are 7 and 8: the
!>       /|      /|            / \               face 3-4-8-7 is a line, and what remains has two
!>      5-------6 |           5---6              triangles and three quadrilaterals.
!>      | 4-----|-3    -->    | 3,4
!>      |/      |/            |/ \|
!>      1-------2             1---2
module collapsed_cells_mod
  use cells_mod, only: cells, face_corners, has_middles, most_faces, most_nodes, pyramid_13, &
    pyramid_5, tetrahedron_10, tetrahedron_4, wedge_15, wedge_6
  implicit none
  private

  public :: collapse_cell, no_area

  integer, parameter :: no_area = 0 !! a face that is a line or a point

contains

  !> The cell that one is whose nodes are not all different; nodes between the corners of an edge
  !> that is a point are its corner, and those of two edges that are one are one.
  pure subroutine collapse_cell(cell, nodes, solid, place, face_of)
    integer, intent(in) :: cell     !! row of the table of cells
    integer, intent(in) :: nodes(:) !! (nodes of the cell)
    integer, intent(out) :: solid   !! row of the table; 0: it is none of them
    integer, intent(out) :: place(most_nodes)
    !! where the nodes of the solid are among `nodes`; zeros behind them
    integer, intent(out) :: face_of(most_faces)
    !! of each face of the cell the face of the solid that it is, or no_area; -1: it has no such
    integer :: loop(face_corners, most_faces), n_corners(most_faces)
    integer :: first, f, k
    logical :: ok

    place = 0
    face_of = -1
    n_corners = 0
    associate (of => cells(cell))
      do f = 1, of%n_faces
        call find_loop(nodes, of%face(:of%n_face_corners(f), f), loop(:, f), n_corners(f))
        face_of(f) = no_area
      end do
      ! The first face of the solid: of a wedge a triangle, of a pyramid the quadrilateral.
      solid = 0
      first = 1
      if (all([count(n_corners == 3), count(n_corners == 4)] == [4, 0])) then
        solid = merge(tetrahedron_10, tetrahedron_4, has_middles(cell))
        first = findloc(n_corners, 3, dim=1)
      else if (all([count(n_corners == 3), count(n_corners == 4)] == [2, 3])) then
        solid = merge(wedge_15, wedge_6, has_middles(cell))
        first = findloc(n_corners, 3, dim=1)
      else if (all([count(n_corners == 3), count(n_corners == 4)] == [4, 1])) then
        solid = merge(pyramid_13, pyramid_5, has_middles(cell))
        first = findloc(n_corners, 4, dim=1)
      end if
      if (solid == 0) return
      do k = 1, n_corners(first)
        place(cells(solid)%face(k, 1)) = loop(k, first)
      end do
      call find_opposite(cell, nodes, n_corners(first), solid, place)
    end associate
    ok = all(place(:cells(solid)%n_corners) > 0)
    if (ok) call find_faces(nodes, loop, n_corners, solid, place, face_of, ok)
    if (ok .and. has_middles(cell)) call find_middles(cell, nodes, solid, place, ok)
    do k = 2, merge(cells(solid)%n_nodes, 0, ok)
      ok = ok .and. all(nodes(place(:k - 1)) /= nodes(place(k)))
    end do
    if (.not. ok) solid = 0
  end subroutine collapse_cell

  !> The corners of a face, each of several that are one once; none where fewer than three remain.
  pure subroutine find_loop(nodes, corners, loop, n)
    integer, intent(in) :: nodes(:)
    integer, intent(in) :: corners(:) !! places
    integer, intent(out) :: loop(face_corners)
    integer, intent(out) :: n
    integer :: k

    loop = 0
    n = 0
    do k = 1, size(corners)
      if (nodes(corners(k)) == nodes(corners(mod(k, size(corners)) + 1))) cycle
      n = n + 1
      loop(n) = corners(k)
    end do
    if (n < 3) n = 0
  end subroutine find_loop

  !> The corners of the solid that are not on its first face: beside those of a wedge's triangle,
  !> else the one that remains.
  pure subroutine find_opposite(cell, nodes, n, solid, place)
    integer, intent(in) :: cell
    integer, intent(in) :: nodes(:)
    integer, intent(in) :: n !! corners of the first face
    integer, intent(in) :: solid
    integer, intent(inout) :: place(:)
    integer :: i, k, e

    associate (of => cells(cell), base => nodes(place(:n)))
      if (cells(solid)%n_corners == n + 1) then
        do i = 1, of%n_corners
          if (all(base /= nodes(i))) place(n + 1) = i
        end do
        return
      end if
      do e = 1, of%n_edges
        do k = 1, 2
          associate (here => of%edge(k, e), there => of%edge(3 - k, e))
            if (any(base == nodes(there))) cycle
            i = findloc(base, nodes(here), dim=1)
            if (i > 0) place(n + i) = there
          end associate
        end do
      end do
    end associate
  end subroutine find_opposite

  !> Which faces of the solid those of the cell are; each must be one.
  pure subroutine find_faces(nodes, loop, n_corners, solid, place, face_of, ok)
    integer, intent(in) :: nodes(:)
    integer, intent(in) :: loop(:, :), n_corners(:)
    integer, intent(in) :: solid, place(:)
    integer, intent(inout) :: face_of(:)
    logical, intent(out) :: ok
    integer :: f, g, k

    ok = .true.
    associate (of => cells(solid))
      do f = 1, size(n_corners)
        if (n_corners(f) == 0) cycle
        do g = 1, of%n_faces
          if (of%n_face_corners(g) /= n_corners(f) .or. any(face_of == g)) cycle
          associate (corners => nodes(place(of%face(:of%n_face_corners(g), g))))
            if (all([(any(corners == nodes(loop(k, f))) .and. any(nodes(loop(:n_corners(f), f)) &
              == corners(k)), k=1, n_corners(f))])) exit
          end associate
        end do
        ok = g <= of%n_faces
        if (.not. ok) return
        face_of(f) = g
      end do
    end associate
  end subroutine find_faces

  !> The nodes between the corners.
  pure subroutine find_middles(cell, nodes, solid, place, ok)
    integer, intent(in) :: cell
    integer, intent(in) :: nodes(:)
    integer, intent(in) :: solid
    integer, intent(inout) :: place(:)
    logical, intent(out) :: ok
    integer :: e, k

    ok = .true.
    associate (of => cells(cell), to => cells(solid))
      do e = 1, of%n_edges
        associate (ends => nodes(of%edge(:, e)), middle => of%n_corners + e)
          if (ends(1) == ends(2)) then
            ok = nodes(middle) == ends(1)
            if (.not. ok) return
            cycle
          end if
          do k = 1, to%n_edges
            associate (corners => nodes(place(to%edge(:, k))))
              if (all(corners == ends) .or. all(corners == ends([2, 1]))) exit
            end associate
          end do
          ok = k <= to%n_edges
          if (.not. ok) return
          associate (there => place(to%n_corners + k))
            if (there == 0) there = middle
            ok = nodes(there) == nodes(middle)
          end associate
          if (.not. ok) return
        end associate
      end do
      ok = all(place(:to%n_nodes) > 0)
    end associate
  end subroutine find_middles

end module collapsed_cells_mod
