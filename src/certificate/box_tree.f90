!> The boxes of faces in a binary tree: which of n meet a box, or each other, is found in some log n
!> steps for each that does.
module box_tree_mod
  use kinds_mod, only: wp
  implicit none
  private

  public :: box_tree_t, make_box_tree, list_meeting, list_pairs

  integer, parameter :: few = 4 !! boxes that are looked at one by one
  real(wp), parameter :: same_way = 1.3694384060045659_wp
  !! angle between faces of a body that look the same way: the cosine is above 0.2 [rad]

  !> Each node of the tree has half of its parent's boxes: node k has the children 2k and 2k+1.
  type :: box_tree_t
    private
    integer :: levels = 0                 !! below the root
    integer,  allocatable :: item(:)      !! (n) boxes in the order of the leaves
    real(wp), allocatable :: own(:, :)    !! (6,n) box of each in that order: low, high [length]
    real(wp), allocatable :: around(:, :) !! (6,n_tree) of each node of the tree [length]
    real(wp), allocatable :: cone(:, :)
    !! (4,n_tree) a direction, and the largest angle of a face's normal to it [-], [rad]
    integer,  allocatable :: piece(:)     !! (n_tree) that all of its faces are of; 0: of several
  end type box_tree_t

contains

  !> Sort faces into a tree: each part is cut across its longest side, half of it on either.
  pure subroutine make_box_tree(boxes, normal, piece, tree)
    real(wp), intent(in) :: boxes(:, :)  !! (6,n) low, high [length]
    real(wp), intent(in) :: normal(:, :) !! (3,n) unit vectors [-]
    integer, intent(in) :: piece(:)      !! (n) of the mesh
    type(box_tree_t), intent(out) :: tree
    integer :: i, n

    do while (few*2**tree%levels < size(boxes, 2))
      tree%levels = tree%levels + 1
    end do
    n = 2**(tree%levels + 1) - 1
    allocate (tree%around(6, n), tree%cone(4, n), tree%piece(n))
    tree%item = [(i, i=1, size(boxes, 2))]
    call divide(tree, boxes, normal, piece, 1, 1, size(boxes, 2))
    tree%own = boxes(:, tree%item)
  end subroutine make_box_tree

  !> Put the faces first..last below a node of the tree.
  pure recursive subroutine divide(tree, boxes, normal, piece, node, first, last)
    type(box_tree_t), intent(inout) :: tree
    real(wp), intent(in) :: boxes(:, :), normal(:, :) !! [length], [-]
    integer, intent(in) :: piece(:), node, first, last
    real(wp) :: low(3), high(3)
    integer :: i, k, middle

    low = huge(1.0_wp)
    high = -huge(1.0_wp)
    do i = first, last
      low = min(low, boxes(:3, tree%item(i)))
      high = max(high, boxes(4:, tree%item(i)))
    end do
    tree%around(:, node) = [low, high]
    if (2*node > size(tree%around, 2)) then
      associate (items => tree%item(first:last))
        tree%piece(node) = merge(piece(items(1)), 0, all(piece(items) == piece(items(1))))
        tree%cone(:, node) = cone_of(normal(:, items), spread(0.0_wp, 1, size(items)))
      end associate
      return
    end if
    middle = half(first, last)
    k = maxloc(high - low, dim=1)
    call part(tree%item(first:last), boxes(k, tree%item(first:last)) + boxes(k + 3, &
      tree%item(first:last)), middle - first + 1)
    call divide(tree, boxes, normal, piece, 2*node, first, middle)
    call divide(tree, boxes, normal, piece, 2*node + 1, middle + 1, last)
    tree%piece(node) = merge(tree%piece(2*node), 0, tree%piece(2*node) == tree%piece(2*node + 1))
    tree%cone(:, node) = cone_of(tree%cone(:3, 2*node:2*node + 1), tree%cone(4, 2*node:2*node + 1))
  end subroutine divide

  !> A cone around cones: their mean direction, and the largest angle to it.
  pure function cone_of(direction, angle) result(cone)
    real(wp), intent(in) :: direction(:, :), angle(:) !! (3,n) unit vectors [-], [rad]
    real(wp) :: cone(4)
    integer :: i

    cone(:3) = sum(direction, 2)
    cone(:3) = cone(:3)/max(tiny(1.0_wp), norm2(cone(:3)))
    cone(4) = 0.0_wp
    do i = 1, size(angle)
      cone(4) = max(cone(4), angle(i) + angle_between(cone, direction(:, i)))
    end do
  end function cone_of

  !> The angle between two unit vectors [rad].
  pure real(wp) function angle_between(one, other)
    real(wp), intent(in) :: one(:), other(:)

    angle_between = acos(max(-1.0_wp, min(1.0_wp, one(1)*other(1) + one(2)*other(2) + one(3)* &
      other(3))))
  end function angle_between

  !> The last of the first half of first..last.
  pure integer function half(first, last)
    integer, intent(in) :: first, last

    half = first + (last - first + 1)/2 - 1
  end function half

  !> Order a list until the first n have keys that are not above those of the rest.
  pure subroutine part(list, keys, n)
    integer, intent(inout) :: list(:)
    real(wp), intent(in) :: keys(:) !! of the members of the list
    integer, intent(in) :: n
    real(wp) :: key(size(keys)), pivot
    integer :: low, high, i, j

    key = keys
    low = 1
    high = size(list)
    do while (low < high)
      pivot = key((low + high)/2)
      i = low
      j = high
      do
        do while (key(i) < pivot)
          i = i + 1
        end do
        do while (key(j) > pivot)
          j = j - 1
        end do
        if (i <= j) then
          list([i, j]) = list([j, i])
          key([i, j]) = key([j, i])
          i = i + 1
          j = j - 1
        end if
        if (i > j) exit
      end do
      if (n <= j) then
        high = j
      else if (n >= i) then
        low = i
      else
        return
      end if
    end do
  end subroutine part

  !> List the boxes that meet a box.
  pure subroutine list_meeting(tree, box, n, found)
    type(box_tree_t), intent(in) :: tree
    real(wp), intent(in) :: box(6) !! low, high [length]
    integer, intent(out) :: n      !! so many
    integer, allocatable, intent(inout) :: found(:) !! their numbers, and room behind them
    integer :: stack(3, 64), top, node, first, last, i

    n = 0
    if (.not. allocated(found)) allocate (found(64))
    stack(:, 1) = [1, 1, size(tree%item)]
    top = 1
    do while (top > 0)
      node = stack(1, top)
      first = stack(2, top)
      last = stack(3, top)
      top = top - 1
      if (.not. meet(tree%around(:, node), box)) cycle
      if (2*node < size(tree%around, 2)) then
        stack(:, top + 1) = first_child([node, first, last])
        stack(:, top + 2) = second_child([node, first, last])
        top = top + 2
        cycle
      end if
      do i = first, last
        if (.not. meet(tree%own(:, i), box)) cycle
        if (n == size(found)) found = [found, found]
        n = n + 1
        found(n) = tree%item(i)
      end do
    end do
  end subroutine list_meeting

  !> List the pairs of faces of which the boxes meet, each once; not those of one piece that look
  !> the same way.
  pure subroutine list_pairs(tree, n, pairs)
    type(box_tree_t), intent(in) :: tree
    integer, intent(out) :: n                        !! so many
    integer, allocatable, intent(out) :: pairs(:, :) !! (2,n) and room behind them
    integer :: stack(6, 4*(tree%levels + 1)), top, one(3), other(3), i, k, from

    n = 0
    allocate (pairs(2, 64))
    stack(:, 1) = [1, 1, size(tree%item), 1, 1, size(tree%item)]
    top = 1
    do while (top > 0)
      one = stack(:3, top)
      other = stack(4:, top)
      top = top - 1
      if (.not. meet(tree%around(:, one(1)), tree%around(:, other(1)))) cycle
      if (look_alike(tree, one(1), other(1))) cycle
      if (2*one(1) < size(tree%around, 2)) then
        if (one(1) == other(1)) then
          stack(:, top + 1) = [first_child(one), first_child(one)]
          stack(:, top + 2) = [second_child(one), second_child(one)]
          stack(:, top + 3) = [first_child(one), second_child(one)]
          top = top + 3
        else
          stack(:, top + 1) = [first_child(one), first_child(other)]
          stack(:, top + 2) = [first_child(one), second_child(other)]
          stack(:, top + 3) = [second_child(one), first_child(other)]
          stack(:, top + 4) = [second_child(one), second_child(other)]
          top = top + 4
        end if
        cycle
      end if
      do i = one(2), one(3)
        from = merge(i + 1, other(2), one(1) == other(1))
        do k = from, other(3)
          if (.not. meet(tree%own(:, i), tree%own(:, k))) cycle
          if (n == size(pairs, 2)) pairs = reshape([pairs, pairs], [2, 2*n])
          n = n + 1
          pairs(:, n) = tree%item([i, k])
        end do
      end do
    end do
  end subroutine list_pairs

  !> Whether the faces below two nodes of a tree are of one piece and look the same way.
  pure logical function look_alike(tree, one, other)
    type(box_tree_t), intent(in) :: tree
    integer, intent(in) :: one, other

    look_alike = tree%piece(one) > 0 .and. tree%piece(one) == tree%piece(other)
    if (look_alike) look_alike = tree%cone(4, one) + tree%cone(4, other) + angle_between( &
      tree%cone(:, one), tree%cone(:, other)) < same_way
  end function look_alike

  !> The halves of a node of a tree, as of a stack: node, and the first and last of its faces.
  pure function first_child(node) result(child)
    integer, intent(in) :: node(3)
    integer :: child(3)

    child = [2*node(1), node(2), half(node(2), node(3))]
  end function first_child

  pure function second_child(node) result(child)
    integer, intent(in) :: node(3)
    integer :: child(3)

    child = [2*node(1) + 1, half(node(2), node(3)) + 1, node(3)]
  end function second_child

  !> Whether two boxes have a place in common.
  pure logical function meet(one, other)
    real(wp), intent(in) :: one(6), other(6) !! low, high [length]

    meet = one(1) <= other(4) .and. other(1) <= one(4) .and. one(2) <= other(5) .and. &
      other(2) <= one(5) .and. one(3) <= other(6) .and. other(3) <= one(6)
  end function meet

end module box_tree_mod
