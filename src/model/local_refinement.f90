!> Some elements of a mesh cut into eight (of a slice into four), others not: which must be cut with
!> them, and which nodes hang.
!>
!> A node hangs where it lies in the middle of an edge or of a face that an uncut element has: there
!> its displacement must be the mean of the two or four nodes around, so that the mesh does not
!> open. Elements that meet, if only at a node, differ by one cut at most. Then no node hangs from
!> one that hangs itself.
module local_refinement_mod
  use growing_lists_mod, only: append
  use kinds_mod, only: wp
  use refine_elements_mod, only: edge_nodes, face_nodes, n_pieces, pieces_t, refine_elements
  use sorting_mod, only: order_of_columns, sort_ascending
  use lists_mod, only: lists_t, columns_with
  implicit none
  private

  public :: cut_with, cut_some, find_hanging, parents_of, fold_to_parents, &
    hanging_of

contains

  !> The nodes that a node lies between: two, four or eight.
  pure function parents_of(between) result(parents)
    integer, intent(in) :: between(8) !! as of refine_elements
    integer, allocatable :: parents(:)

    parents = pack(between, between > 0)
  end function parents_of

  !> Choose, too, every element that would be two cuts behind a neighbour if it stayed as it is.
  subroutine cut_with(elements, n_nodes, between, n_given, cuts, chosen)
    integer, intent(in) :: elements(:, :)     !! (8,n)
    integer, intent(in) :: n_nodes
    integer, intent(in) :: between(:, :)    !! (8,n_nodes-n_given) as of refine_elements
    integer, intent(in) :: n_given          !! nodes before those that lie between others
    integer, intent(in) :: cuts(:)          !! (n) how often each element was cut so far
    logical, intent(inout) :: chosen(:)     !! (n)
    type(lists_t) :: at !! the elements at each node
    integer, allocatable :: queue(:)
    integer :: next, n, a, e

    at = columns_with(elements, n_nodes)
    n = 0
    do e = 1, size(chosen)
      if (chosen(e)) call append(queue, n, e)
    end do
    next = 0
    do while (next < n)
      next = next + 1
      e = queue(next)
      do a = 1, 8
        associate (node => elements(a, e))
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
          if (.not. all([(any(elements(:, other) == nodes(i)), i=1, size(nodes))])) cycle
          chosen(other) = .true.
          call append(queue, n, other)
        end associate
      end do
    end subroutine choose_behind

  end subroutine cut_with

  !> Cut every edge of the chosen elements in two, but for those not to be cut. Their pieces take
  !> their place, as those of refine_elements follow each other. A node that an earlier cut put in
  !> the middle of an edge or face is found again.
  subroutine cut_some(n_nodes, elements, between, chosen, uncut, pieces, added)
    integer, intent(in) :: n_nodes
    integer, intent(in) :: elements(:, :)              !! (8,n)
    integer, intent(in) :: between(:, :)             !! (8,..) as of refine_elements: the last nodes
    logical, intent(in) :: chosen(:)                 !! (n)
    integer, intent(in) :: uncut(:)                  !! (n) as of refine_elements
    type(pieces_t), intent(out) :: pieces
    integer, allocatable, intent(out) :: added(:, :) !! (8,n_new) as `between`, of new nodes
    integer, allocatable :: cut(:, :), middle(:, :), node(:)
    real(wp), allocatable :: place(:, :)
    integer :: of_each, e, k, n, m

    of_each = n_pieces(2, uncut)
    call refine_elements(n_nodes, elements(:, pack([(e, e=1, size(chosen))], chosen)), 2, &
      pack(uncut, chosen), cut, middle, place)
    call find_again(middle, between, n_nodes, node, added)
    n = size(chosen) + (of_each - 1)*count(chosen)
    allocate (pieces%nodes(8, n), pieces%origin(n))
    allocate (pieces%number(n), source=0)
    pieces%uncut = uncut
    n = 0
    m = 0
    do e = 1, size(chosen)
      if (.not. chosen(e)) then
        n = n + 1
        pieces%nodes(:, n) = elements(:, e)
        pieces%origin(n) = e
        cycle
      end if
      do k = 1, of_each
        pieces%nodes(:, n + k) = merge(cut(:, m + k), node(max(1, cut(:, m + k) - n_nodes)), &
          cut(:, m + k) <= n_nodes)
        pieces%number(n + k) = k
      end do
      pieces%origin(n + 1:n + of_each) = e
      n = n + of_each
      m = m + of_each
    end do
  end subroutine cut_some

  !> The numbers of middles: those of earlier ones between the same nodes, new ones of others.
  pure subroutine find_again(middle, between, n_nodes, node, added)
    integer, intent(in) :: middle(:, :)              !! (8,m) as of refine_elements
    integer, intent(in) :: between(:, :)             !! (8,n_old) likewise: the last nodes
    integer, intent(in) :: n_nodes
    integer, allocatable, intent(out) :: node(:)     !! (m)
    integer, allocatable, intent(out) :: added(:, :) !! (8,n_new) of `middle` what is new
    integer :: key(4, size(between, 2) + size(middle, 2)), i, n, n_old, first
    integer, allocatable :: order(:)

    n_old = size(between, 2)
    do i = 1, size(key, 2)
      if (i <= n_old) then
        key(:, i) = between(:4, i)
      else
        key(:, i) = middle(:4, i - n_old)
      end if
      call sort_ascending(key(:, i))
    end do
    call order_of_columns(key, order)
    allocate (node(size(middle, 2)), source=0)
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
      if (middle(5, order(i) - n_old) > 0 .or. between(5, order(first)) > 0) cycle
      node(order(i) - n_old) = n_nodes - n_old + order(first)
    end do
    n = count(node == 0)
    allocate (added(8, n))
    n = 0
    do i = 1, size(node)
      if (node(i) > 0) cycle
      n = n + 1
      node(i) = n_nodes + n
      added(:, n) = middle(:, i)
    end do
  end subroutine find_again

  !> Which nodes lie in the middle of an edge or a face of an element.
  pure function find_hanging(n_nodes, elements, between, n_given) result(hangs)
    integer, intent(in) :: n_nodes
    integer, intent(in) :: elements(:, :)   !! (8,n)
    integer, intent(in) :: between(:, :)  !! (8,n_nodes-n_given) as of refine_elements
    integer, intent(in) :: n_given
    logical :: hangs(n_nodes)
    type(lists_t) :: at !! the elements at each node
    integer :: i, k

    at = columns_with(elements, n_nodes)
    hangs = .false.
    do i = 1, size(between, 2)
      associate (nodes => parents_of(between(:, i)), node => n_given + i)
        if (size(nodes) == 8) cycle
        do k = at%first(nodes(1)), at%first(nodes(1) + 1) - 1
          hangs(node) = hangs(node) .or. has_side(elements(:, at%item(k)), nodes)
        end do
      end associate
    end do
  end function find_hanging

  !> Whether nodes are those of an edge or a face of an element.
  pure logical function has_side(element, nodes)
    integer, intent(in) :: element(8)
    integer, intent(in) :: nodes(:) !! two or four
    integer :: side, i

    has_side = .false.
    if (size(nodes) == 2) then
      do side = 1, 12
        has_side = has_side .or. all([(any(element(edge_nodes(:, side)) == nodes(i)), i=1, 2)])
      end do
    else
      do side = 1, 6
        has_side = has_side .or. all([(any(element(face_nodes(:, side)) == nodes(i)), i=1, 4)])
      end do
    end if
  end function has_side

  !> Those of some nodes that hang, with those that they lie between, which are among them too.
  pure function hanging_of(hangs, between, n_given, nodes) result(hanging)
    logical, allocatable, intent(in) :: hangs(:)      !! (n_nodes) not allocated: none does
    integer, allocatable, intent(in) :: between(:, :) !! (8,n_nodes-n_given) as of refine_elements
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
    integer, intent(in) :: between(:, :)    !! (8,n_nodes-n_given) as of refine_elements
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
