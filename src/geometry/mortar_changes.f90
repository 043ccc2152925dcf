!> What the rows of a mortar change by as nodes move.
!>
!> Each slave face adds integrals to its rows that depend on the places of its own nodes and of
!> those of the master faces that cover it, on no others. They are differenced face by face with
!> what covers it held; quotients of the sums over faces are differentiated by formula.
!> docs/theory.md (11.24).
module mortar_changes_mod
  use kinds_mod, only: wp
  use lists_mod, only: lists_t, lists_by_key
  use sorting_mod, only: sort_unique
  use cells_mod, only: face_nodes
  use mortar_rows_mod, only: mortar_t, slave_t, changes_t, new_mortar
  use weight_rows_mod, only: entries_t
  use slave_face_mod, only: face_t
  use covering_parts_mod, only: part_t, cover_again
  use dual_weights_mod, only: add_face
  implicit none
  private

  public :: face_changes_t, note_changes, join_changes

  !> What a slave face adds to its rows, and the differences of that over the step.
  type :: face_changes_t
    integer :: n = 0                          !! nodes of the face
    integer :: row(face_nodes) = 0
    integer, allocatable :: node(:)           !! (m) that it depends on
    integer, allocatable :: master(:)         !! (k) with weights
    real(wp), allocatable :: area(:, :)       !! (n,0:3m) 0: as it is [length^2], [length]
    real(wp), allocatable :: normal(:, :, :)  !! (3,n,0:3m) likewise
    real(wp), allocatable :: apart(:, :, :)   !! (3,n,0:3m) likewise, where there are no weights
    real(wp), allocatable :: weight(:, :, :)  !! (n,k,0:3m) likewise, of each master
  end type face_changes_t

  !> The derivatives of one row, as of changes_t.
  type :: row_changes_t
    integer, allocatable :: node(:), master(:)
    real(wp), allocatable :: normal(:, :, :), faced(:, :, :)
    real(wp), allocatable :: weight(:, :, :) !! (3,n_masters,n_nodes)
  end type row_changes_t

  ! Of a face: with more the differences see the curvature, with less the digits of places.
  real(wp), parameter :: step = 1.0e-7_wp !! [-]

contains

  !> Difference what a face adds.
  pure subroutine note_changes(face, parts, makes_rows, place, new)
    type(face_t), intent(in) :: face
    type(part_t), intent(in) :: parts(:)       !! that cover it
    logical, intent(in) :: makes_rows          !! as of make_mortar
    real(wp), intent(inout) :: place(:, :)     !! (3,n_nodes) moved, and back again [length]
    type(face_changes_t), intent(inout) :: new !! empty; stays so where nothing covers the face
    type(face_t) :: moved
    type(part_t), dimension(size(parts)) :: of, as_it_is
    type(mortar_t) :: added
    type(entries_t) :: entries
    logical :: moves(size(parts)) !! with a node
    real(wp) :: length, before
    integer :: i, c, d, copy, n_moved

    if (size(parts) == 0) return
    new%n = face%n
    new%row = face%row
    new%node = face%node(:face%n)
    if (makes_rows) then
      do i = 1, size(parts)
        new%node = [new%node, parts(i)%node(:parts(i)%n)]
      end do
      call sort_unique(new%node)
    end if
    new%master = new%node
    length = step*sqrt(face%area)
    associate (n => face%n, m => size(new%node))
      allocate (new%area(n, 0:3*m), new%normal(3, n, 0:3*m), new%apart(3, n, 0:3*m), &
        new%weight(n, size(new%master), 0:3*m), source=0.0_wp)
      added = new_mortar(slave_t(faces=reshape([integer ::], [0, 0]), nodes=[(i, i=1, n)]))
    end associate
    moved = face
    moved%row(:face%n) = [(i, i=1, face%n)]
    of = parts
    do i = 1, size(parts)
      call cover_again(place, face, of(i))
    end do
    as_it_is = of
    copy = 0
    call take_copy(moved, place, of, makes_rows, copy, added, entries, new)
    ! Where all move alike nothing changes.
    n_moved = merge(size(new%node) - 1, size(new%node), makes_rows)
    do c = 1, n_moved
      moves = [(any(parts(i)%node == new%node(c)), i=1, size(parts))] .or. any(face%node(:face%n) &
        == new%node(c))
      do d = 1, 3
        copy = copy + 1
        associate (at => place(d, new%node(c)))
          before = at
          at = at + length
          moved%x(:, :face%n) = place(:, face%node(:face%n))
          do i = 1, size(parts)
            if (moves(i)) call cover_again(place, moved, of(i))
          end do
          call take_copy(moved, place, of, makes_rows, copy, added, entries, new)
          do i = 1, size(parts)
            if (moves(i)) of(i) = as_it_is(i)
          end do
          at = before
        end associate
      end do
    end do
    do copy = 1, 3*n_moved
      new%area(:, copy) = (new%area(:, copy) - new%area(:, 0))/length
      new%normal(:, :, copy) = (new%normal(:, :, copy) - new%normal(:, :, 0))/length
      new%apart(:, :, copy) = (new%apart(:, :, copy) - new%apart(:, :, 0))/length
      new%weight(:, :, copy) = (new%weight(:, :, copy) - new%weight(:, :, 0))/length
    end do
    do copy = 3*n_moved + 1, 3*size(new%node)
      d = copy - 3*n_moved
      new%area(:, copy) = -sum(new%area(:, d:3*n_moved:3), dim=2)
      new%normal(:, :, copy) = -sum(new%normal(:, :, d:3*n_moved:3), dim=3)
      new%weight(:, :, copy) = -sum(new%weight(:, :, d:3*n_moved:3), dim=3)
    end do
  end subroutine note_changes

  !> What the face adds where it is moved to.
  pure subroutine take_copy(face, x, parts, makes_rows, copy, added, entries, new)
    type(face_t), intent(in) :: face          !! its rows are the numbers of its nodes
    real(wp), intent(in) :: x(:, :)           !! (3,n_nodes) [length]
    type(part_t), intent(in) :: parts(:)
    logical, intent(in) :: makes_rows         !! as of make_mortar
    integer, intent(in) :: copy               !! where to put it
    type(mortar_t), intent(inout) :: added    !! work space, of the face's nodes
    type(entries_t), intent(inout) :: entries !! work space
    type(face_changes_t), intent(inout) :: new
    integer :: e, k

    added%area = 0.0_wp
    added%normal = 0.0_wp
    added%apart = 0.0_wp
    entries%n = 0
    call add_face(face, x, parts, makes_rows, .true., added, entries)
    new%area(:, copy) = added%area
    new%normal(:, :, copy) = added%normal
    new%apart(:, :, copy) = added%apart
    do e = 1, entries%n
      associate (entry => entries%list(e))
        k = findloc(new%master, entry%node, dim=1)
        new%weight(entry%row, k, copy) = new%weight(entry%row, k, copy) + entry%weight
      end associate
    end do
  end subroutine take_copy

  !> The derivatives of rows from those of faces: of n = N/|N|, P = M/a and what these face.
  pure subroutine join_changes(noted, x, nodes, makes_rows, mortar)
    type(face_changes_t), intent(in) :: noted(:)
    real(wp), intent(in) :: x(:, :)        !! (3,n_nodes) [length]
    integer, intent(in) :: nodes(:)        !! (n) of the rows
    logical, intent(in) :: makes_rows      !! as of make_mortar
    type(mortar_t), intent(inout) :: mortar
    !! its areas, and normals and, before facets, distances not yet divided; gets the changes
    type(row_changes_t) :: rows(size(nodes))
    type(changes_t) :: changes
    type(lists_t) :: faces                 !! of each row: 8 f + number of its node in the face
    integer, allocatable :: key(:)
    integer :: i, f, a, m, k, n

    allocate (key(face_nodes*size(noted)), source=0)
    do f = 1, size(noted)
      do a = 1, noted(f)%n
        if (mortar%area(noted(f)%row(a)) > 0.0_wp) key(face_nodes*(f - 1) + a) = noted(f)%row(a)
      end do
    end do
    faces = lists_by_key(key, size(nodes))
    allocate (changes%first(size(nodes) + 1), changes%first_master(size(nodes) + 1), source=1)
    do i = 1, size(nodes)
      rows(i) = changes_of_row(noted, faces%item(faces%first(i):faces%first(i + 1) - 1), x, &
        nodes(i), makes_rows, mortar%area(i), mortar%normal(:, i), mortar%apart(:, i))
      changes%first(i + 1) = changes%first(i) + size(rows(i)%node)
      changes%first_master(i + 1) = changes%first_master(i) + size(rows(i)%master)
    end do
    n = changes%first(size(nodes) + 1) - 1
    allocate (changes%node(n), changes%normal(3, 3, n), changes%faced(3, 3, n))
    allocate (changes%first_weight(n + 1), source=1)
    allocate (changes%master(changes%first_master(size(nodes) + 1) - 1))
    do i = 1, size(nodes)
      associate (first => changes%first(i), last => changes%first(i + 1) - 1)
        changes%node(first:last) = rows(i)%node
        changes%normal(:, :, first:last) = rows(i)%normal
        changes%faced(:, :, first:last) = rows(i)%faced
        changes%master(changes%first_master(i):changes%first_master(i + 1) - 1) = rows(i)%master
        do m = first, last
          changes%first_weight(m + 1) = changes%first_weight(m) + size(rows(i)%master)
        end do
      end associate
    end do
    allocate (changes%weight(3, changes%first_weight(n + 1) - 1))
    do i = 1, size(nodes)
      k = size(rows(i)%master)
      do m = 1, size(rows(i)%node)
        associate (first => changes%first_weight(changes%first(i) + m - 1))
          changes%weight(:, first:first + k - 1) = rows(i)%weight(:, :, m)
        end associate
      end do
    end do
    mortar%changes = changes
  end subroutine join_changes

  !> The derivatives of one row.
  pure type(row_changes_t) function changes_of_row(noted, its, x, slave, makes_rows, area, normal, &
    apart) result(row)
    type(face_changes_t), intent(in) :: noted(:)
    integer, intent(in) :: its(:)          !! faces, as of join_changes
    real(wp), intent(in) :: x(:, :)        !! (3,n_nodes) [length]
    integer, intent(in) :: slave           !! node of the row
    logical, intent(in) :: makes_rows      !! as of make_mortar
    real(wp), intent(in) :: area           !! of the row [length^2]
    real(wp), intent(in) :: normal(3), apart(3) !! not yet divided [length^2], [length^3]
    real(wp), allocatable :: by_area(:, :), own(:)
    real(wp) :: unit(3), length
    integer :: j, c, d, k, p, q

    allocate (row%node(0), row%master(0))
    do j = 1, size(its)
      associate (face => noted(1 + (its(j) - 1)/face_nodes))
        row%node = [row%node, face%node]
        row%master = [row%master, face%master]
      end associate
    end do
    call sort_unique(row%node)
    call sort_unique(row%master)
    associate (m => size(row%node), n => size(row%master))
      allocate (row%normal(3, 3, m), row%faced(3, 3, m), row%weight(3, n, m), by_area(3, m), &
        own(n), source=0.0_wp)
    end associate
    do j = 1, size(its)
      associate (face => noted(1 + (its(j) - 1)/face_nodes), &
                 a => 1 + modulo(its(j) - 1, face_nodes))
        do c = 1, size(face%node)
          p = findloc(row%node, face%node(c), dim=1)
          do d = 1, 3
            by_area(d, p) = by_area(d, p) + face%area(a, 3*c - 3 + d)
            row%normal(:, d, p) = row%normal(:, d, p) + face%normal(:, a, 3*c - 3 + d)
            row%faced(:, d, p) = row%faced(:, d, p) + face%apart(:, a, 3*c - 3 + d)
          end do
        end do
        do k = 1, size(face%master)
          q = findloc(row%master, face%master(k), dim=1)
          own(q) = own(q) + face%weight(a, k, 0)
          do c = 1, size(face%node)
            p = findloc(row%node, face%node(c), dim=1)
            row%weight(:, q, p) = row%weight(:, q, p) + face%weight(a, k, 3*c - 2:3*c)
          end do
        end do
      end associate
    end do
    length = max(norm2(normal), tiny(1.0_wp))
    unit = normal/length
    do p = 1, size(row%node)
      do d = 1, 3
        row%normal(:, d, p) = (row%normal(:, d, p) - unit*dot_product(unit, &
          row%normal(:, d, p)))/length
        row%weight(d, :, p) = (row%weight(d, :, p) - own/area*by_area(d, p))/area
        if (makes_rows) then
          ! Weights add up to 1: places count from that of the node.
          row%faced(:, d, p) = matmul(x(:, row%master) - spread(x(:, slave), 2, &
            size(row%master)), row%weight(d, :, p))
        else
          row%faced(:, d, p) = -(row%faced(:, d, p) - apart/area*by_area(d, p))/area
        end if
      end do
    end do
  end function changes_of_row

end module mortar_changes_mod
