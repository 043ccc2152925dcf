!> Some elements of a mesh cut into eight (of a slice into four), others not: which must be cut with
!> them, and which nodes hang.
!>
!> A node hangs where it lies on an edge or in a face that an uncut element has: there its
!> displacement must be that which the shape functions of the edge or face have there (without
!> mid-side nodes the mean of the two or four nodes around), so that the mesh does not open.
!> Elements that meet, if only at a node, differ by one cut at most. Then no node hangs from one
!> that hangs itself.
module local_refinement_mod
  use growing_lists_mod, only: append
  use kinds_mod, only: wp
  use cells_mod, only: cells, face_corners
  use connectivity_mod, only: connectivity_t, make_connectivity, some_elements
  use refine_elements_mod, only: division_t, pieces_t, refine_elements, side_dimensions
  use sorting_mod, only: order_of_columns
  use lists_mod, only: lists_t, lists_with
  implicit none
  private

  public :: between_t, cut_with, cut_some, find_hanging, parents_of, fold_to_parents, &
    hanging_of

  !> Nodes that lie between others.
  type :: between_t
    integer,  allocatable :: nodes(:, :) !! as of refine_elements
    real(wp), allocatable :: place(:, :) !! likewise
  end type between_t

contains

  !> The nodes that a node lies between.
  pure function parents_of(between) result(parents)
    integer, intent(in) :: between(:) !! as of refine_elements
    integer, allocatable :: parents(:)

    parents = pack(between, between > 0)
  end function parents_of

  !> Choose, too, every element that would be two cuts behind a neighbour if it stayed as it is.
  subroutine cut_with(connectivity, n_nodes, between, n_given, cuts, chosen)
    type(connectivity_t), intent(in) :: connectivity !! no longer than its elements
    integer, intent(in) :: n_nodes
    integer, intent(in) :: between(:, :)    !! (:,n_nodes-n_given) as of refine_elements
    integer, intent(in) :: n_given          !! nodes before those that lie between others
    integer, intent(in) :: cuts(:)          !! (n) how often each element was cut so far
    logical, intent(inout) :: chosen(:)     !! (n)
    type(lists_t) :: at !! the elements at each node
    integer, allocatable :: queue(:)
    integer :: next, n, k, e

    at = lists_with(connectivity%first, connectivity%node, n_nodes)
    n = 0
    do e = 1, size(chosen)
      if (chosen(e)) call append(queue, n, e)
    end do
    next = 0
    do while (next < n)
      next = next + 1
      e = queue(next)
      do k = connectivity%first(e), connectivity%first(e + 1) - 1
        associate (node => connectivity%node(k))
          call choose_behind([node])
          if (node > n_given) call choose_behind(parents_of(between(:, node - n_given)))
        end associate
      end do
    end do

  contains

    !> Choose elements with all of these nodes that were cut less often.
    subroutine choose_behind(nodes)
      integer, intent(in) :: nodes(:)
      integer :: k, i

      do k = at%first(nodes(1)), at%first(nodes(1) + 1) - 1
        associate (other => at%item(k))
          if (chosen(other) .or. cuts(other) >= cuts(e)) cycle
          associate (its => connectivity%node(connectivity%first(other): &
                     connectivity%first(other + 1) - 1))
            if (.not. all([(any(its == nodes(i)), i=1, size(nodes))])) cycle
          end associate
          chosen(other) = .true.
          call append(queue, n, other)
        end associate
      end do
    end subroutine choose_behind

  end subroutine cut_with

  !> Cut the chosen elements. Their pieces take their place, as those of refine_elements follow each
  !> other. A node that an earlier cut put on an edge or in a face is found again.
  subroutine cut_some(n_nodes, connectivity, earlier, chosen, division, pieces, added)
    integer, intent(in) :: n_nodes
    type(connectivity_t), intent(in) :: connectivity !! no longer than its elements
    type(between_t), intent(in) :: earlier           !! the last nodes
    logical, intent(in) :: chosen(:)                 !! (n)
    type(division_t), intent(in) :: division         !! in two parts
    type(pieces_t), intent(out) :: pieces
    type(between_t), intent(out) :: added            !! new nodes
    type(between_t) :: new
    type(pieces_t) :: cut
    integer, allocatable :: node(:), which(:), nodes(:)
    logical, parameter :: uncut(6) = .true.
    integer :: e, k, n, m, at

    which = pack([(e, e=1, size(chosen))], chosen)
    call refine_elements(n_nodes, some_elements(connectivity, which), &
      division_t(division%parts, division%variant(which)), cut, new%nodes, new%place)
    call find_again(new, earlier, n_nodes, node, added)
    n = count(.not. chosen) + size(cut%origin)
    allocate (pieces%origin(n), pieces%number(n), pieces%is_outer(6, n))
    allocate (nodes(size(connectivity%node) + size(cut%connectivity%node)))
    n = 0
    m = 0
    at = 0
    do e = 1, size(chosen)
      if (.not. chosen(e)) then
        call add(connectivity%node(connectivity%first(e):connectivity%first(e + 1) - 1), 0, &
          uncut)
        cycle
      end if
      do k = m + 1, size(cut%origin)
        if (which(cut%origin(k)) /= e) exit
        associate (its => cut%connectivity%node(cut%connectivity%first(k): &
                   cut%connectivity%first(k + 1) - 1))
          call add(merge(its, node(max(1, its - n_nodes)), its <= n_nodes), cut%number(k), &
            cut%is_outer(:, k))
        end associate
        m = k
      end do
    end do
    pieces%connectivity = make_connectivity(connectivity%cell(pieces%origin), nodes(:at))

  contains

    subroutine add(its, number, is_outer)
      integer, intent(in) :: its(:), number
      logical, intent(in) :: is_outer(:)

      n = n + 1
      pieces%origin(n) = e
      pieces%number(n) = number
      pieces%is_outer(:, n) = is_outer
      nodes(at + 1:at + size(its)) = its
      at = at + size(its)
    end subroutine add

  end subroutine cut_some

  !> The numbers of nodes between others: those of earlier ones in the same place between the same
  !> nodes, new ones of others.
  pure subroutine find_again(new, earlier, n_nodes, node, added)
    type(between_t), intent(in) :: new           !! (m)
    type(between_t), intent(in) :: earlier       !! (n_old) the last nodes
    integer, intent(in) :: n_nodes
    integer, allocatable, intent(out) :: node(:) !! (m)
    type(between_t), intent(out) :: added        !! (n_new) of `new` what is new
    integer :: key(face_corners + 1, size(earlier%nodes, 2) + size(new%nodes, 2)), i, n_old
    integer :: first, n
    integer, allocatable :: order(:)

    n_old = size(earlier%nodes, 2)
    key(:face_corners, :n_old) = earlier%nodes(:face_corners, :)
    key(:face_corners, n_old + 1:) = new%nodes(:face_corners, :)
    key(face_corners + 1, :n_old) = number_of(earlier%place)
    key(face_corners + 1, n_old + 1:) = number_of(new%place)
    call order_of_columns(key, order)
    allocate (node(size(new%nodes, 2)), source=0)
    first = 0
    do i = 1, size(order)
      if (i == 1) then
        first = 1
      else if (any(key(:, order(i)) /= key(:, order(first)))) then
        first = i
      end if
      ! Equal ones stand in the order of their numbers: an earlier node comes first. What lies in an
      ! element is of no other.
      if (order(i) <= n_old .or. order(first) > n_old) cycle
      if (side_dimensions(new%place(:, order(i) - n_old)) == 3) cycle
      node(order(i) - n_old) = n_nodes - n_old + order(first)
    end do
    added%nodes = new%nodes(:, pack([(i, i=1, size(node))], node == 0))
    added%place = new%place(:, pack([(i, i=1, size(node))], node == 0))
    n = n_nodes
    do i = 1, size(node)
      if (node(i) > 0) cycle
      n = n + 1
      node(i) = n
    end do
  end subroutine find_again

  !> A number of its own for each place on a grid in two parts with nodes in their middles.
  pure function number_of(place) result(number)
    real(wp), intent(in) :: place(:, :) !! as of refine_elements
    integer :: number(size(place, 2))
    integer, parameter :: steps = 4

    number = nint(steps*(place(1, :) + (steps + 1)*(place(2, :) + (steps + 1)*place(3, :))))
  end function number_of

  !> Which nodes lie on an edge or in a face of an element that has others there.
  pure function find_hanging(n_nodes, connectivity, between, n_given) result(hangs)
    integer, intent(in) :: n_nodes
    type(connectivity_t), intent(in) :: connectivity !! no longer than its elements
    type(between_t), intent(in) :: between  !! (n_nodes-n_given)
    integer, intent(in) :: n_given
    logical :: hangs(n_nodes)
    type(lists_t) :: at !! the elements at each node
    integer :: i, k, dimensions, n_corners

    at = lists_with(connectivity%first, connectivity%node, n_nodes)
    hangs = .false.
    do i = 1, size(between%nodes, 2)
      dimensions = side_dimensions(between%place(:, i))
      if (dimensions == 3) cycle
      n_corners = corners_of(between%nodes(:, i), dimensions)
      associate (nodes => between%nodes(:n_corners, i), node => n_given + i)
        do k = at%first(nodes(1)), at%first(nodes(1) + 1) - 1
          hangs(node) = has_side(connectivity, at%item(k), nodes)
          if (hangs(node)) exit
        end do
      end associate
    end do
  end function find_hanging

  !> How many corners the edge or face has that a node lies on; they come first.
  pure integer function corners_of(between, dimensions) result(n)
    integer, intent(in) :: between(:)
    integer, intent(in) :: dimensions !! 1 or 2

    n = count(between > 0)
    if (dimensions == 1) then
      n = 2
    else if (n > face_corners) then
      n = n/2 ! as many are in the middles of edges
    end if
  end function corners_of

  !> Whether nodes are the corners of an edge or a face of an element.
  pure logical function has_side(connectivity, e, nodes)
    type(connectivity_t), intent(in) :: connectivity
    integer, intent(in) :: e
    integer, intent(in) :: nodes(:) !! two to four
    integer :: at(size(nodes)), side, i

    has_side = .false.
    associate (row => connectivity%cell(e), its => connectivity%node(connectivity%first(e): &
               connectivity%first(e + 1) - 1))
      do i = 1, size(nodes)
        at(i) = findloc(its, nodes(i), dim=1)
        if (at(i) == 0) return
      end do
      if (size(nodes) == 2) then
        do side = 1, cells(row)%n_edges
          has_side = has_side .or. all(cells(row)%edge(:, side) == at) .or. &
            all(cells(row)%edge(:, side) == at([2, 1]))
        end do
      else
        do side = 1, cells(row)%n_faces
          if (cells(row)%n_face_corners(side) /= size(nodes)) cycle
          has_side = has_side .or. all([(any(cells(row)%face(:size(nodes), side) == at(i)), &
            i=1, size(nodes))])
        end do
      end if
    end associate
  end function has_side

  !> Those of some nodes that hang, with those that they lie between, which are among them too.
  pure function hanging_of(hangs, between, n_given, nodes) result(hanging)
    logical, allocatable, intent(in) :: hangs(:)      !! (n_nodes) not allocated: none does
    integer, allocatable, intent(in) :: between(:, :) !! (:,n_nodes-n_given) as of refine_elements
    integer, intent(in) :: n_given
    integer, intent(in) :: nodes(:)
    integer, allocatable :: hanging(:, :)   !! (5,m) node, its parents: two, then 0, or four
    logical, allocatable :: among(:)
    integer :: i, n

    allocate (hanging(5, 0))
    if (.not. allocated(hangs)) return
    allocate (among(0:size(hangs)), source=.false.)
    among([0, nodes]) = .true.
    n = 0
    do i = 1, size(nodes)
      if (.not. hangs(nodes(i))) cycle
      associate (parents => between(:4, nodes(i) - n_given))
        if (all(among(parents))) call append(hanging, n, [nodes(i), parents])
      end associate
    end do
    hanging = hanging(:, :n)
  end function hanging_of

  !> What belongs to nodes that hang, given in equal parts to those that they lie between.
  pure subroutine fold_to_parents(hangs, between, n_given, values)
    logical, intent(in) :: hangs(:)         !! (n_nodes)
    integer, intent(in) :: between(:, :)    !! (:,n_nodes-n_given) as of refine_elements
    integer, intent(in) :: n_given
    real(wp), intent(inout) :: values(:)    !! (n_nodes) 0 afterwards where they hang
    integer :: node

    do node = n_given + 1, size(hangs)
      if (.not. hangs(node)) cycle
      associate (nodes => parents_of(between(:, node - n_given)))
        values(nodes) = values(nodes) + values(node)/real(size(nodes), wp)
        values(node) = 0.0_wp
      end associate
    end do
  end subroutine fold_to_parents

end module local_refinement_mod
