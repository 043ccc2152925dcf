!> Weights of a master's nodes for the nodes of a slave surface: a mortar with dual multipliers,
!> over the part of each slave face that the master covers.
!>
!> docs/theory.md (11.1) to (11.4).
module mortar_mod
  use kinds_mod, only: wp
  use connectivity_mod, only: corners_in
  use surfaces_mod, only: cut_at_middles, find_middles
  use face_overlap_mod, only: plane_t, plane_of_face
  use mortar_rows_mod, only: mortar_t, slave_t, new_mortar, without_rounding
  use sight_mod, only: screen_t, make_screen
  use weight_rows_mod, only: entries_t, make_rows
  use slave_face_mod, only: face_t, what_neighbours_get, add_whole
  use covering_parts_mod, only: master_t, part_t, cut_master, find_parts, look_opposite
  use dual_weights_mod, only: add_face
  use mortar_changes_mod, only: face_changes_t, note_changes, join_changes
  use hanging_rows_mod, only: fold_rows
  use tied_rows_mod, only: rows_of_nodes
  implicit none
  private

  public :: make_mortar

contains

  !> The weights of the master's nodes where nodes are at `x`.
  !>
  !> Rows add up to 1, and give places on a flat master exactly, to rounding.
  pure subroutine make_mortar(slave, master, x, reach, mortar, behind, is_rigid, is_tie)
    type(slave_t), intent(in) :: slave
    integer, intent(in) :: master(:, :)  !! (4,n_master) or (8,n_master) the same
    real(wp), intent(in) :: x(:, :)      !! (3,n_nodes) [length]
    real(wp), intent(in) :: reach        !! how far apart faces may be, along their normals [length]
    type(mortar_t), intent(out) :: mortar
    real(wp), intent(in), optional :: behind
    !! how deep places may be in the master, where that is another distance [length]
    logical, intent(in), optional :: is_rigid
    !! the master moves as one: its nodes need no weights, and rows have nodes of the slave alone
    logical, intent(in), optional :: is_tie
    !! functions are dual, as of slave_t, and rows are of nodes; those beside nodes that hang have
    !! some of the slave's own
    type(master_t) :: in_parts
    type(screen_t) :: screen
    type(part_t), allocatable :: parts(:), more(:)
    type(entries_t) :: entries
    type(face_changes_t), allocatable :: noted(:)
    real(wp), allocatable :: place(:, :)
    type(plane_t) :: plane
    type(face_t) :: face
    real(wp) :: length, alpha(size(x, 2))
    integer, allocatable :: corners(:, :), whole(:)
    integer :: number(size(x, 2)), ends(2, size(x, 2)), n, f, i, s
    logical :: makes_rows, are_of_nodes, are_plain, finds_changes

    makes_rows = .true.
    if (present(is_rigid)) makes_rows = .not. is_rigid
    are_of_nodes = .false.
    if (present(is_tie)) are_of_nodes = is_tie
    are_plain = .not. (are_of_nodes .or. slave%is_dual)
    n = size(slave%nodes)
    number(slave%nodes) = [(i, i=1, n)]
    mortar = new_mortar(slave)
    allocate (parts(0))
    finds_changes = slave%asked%changes
    if (allocated(slave%hanging)) finds_changes = finds_changes .and. size(slave%hanging, 2) == 0
    if (finds_changes) then
      allocate (noted(size(slave%faces, 2)))
      place = x
    end if
    in_parts = cut_master(master, x)
    call cut_at_middles(slave%faces, corners, whole)
    alpha = 0.0_wp
    ends = 0
    call find_middles(slave%faces, ends, alpha)
    mortar%has_middles = any(alpha(slave%nodes) > 0.0_wp)
    if (allocated(slave%skin)) then
      call make_screen(slave%skin, corners, in_parts%part, x, screen, slave%piece)
    else
      call make_screen(reshape([corners, in_parts%part], [4, size(corners, 2) + &
        size(in_parts%part, 2)]), corners, in_parts%part, x, screen)
    end if
    screen%asks_way_out = slave%asks_way_out
    screen%reach = reach
    if (present(behind)) screen%reach(2) = behind
    s = 0
    face%breadth = slave%breadth
    do f = 1, size(slave%faces, 2)
      face%n = count(slave%faces(:, f) > 0)
      face%node(:size(slave%faces, 1)) = slave%faces(:, f)
      associate (n => face%n, nodes => face%node(:face%n), row => face%row(:face%n))
        row = number(nodes)
        if (allocated(slave%asked%is_far)) then
          if (all(slave%asked%is_far(row))) then
            s = s + count(whole == f)
            cycle
          end if
        end if
        face%x(:, :n) = x(:, nodes)
        face%alpha(:n) = alpha(nodes)
        face%given = what_neighbours_get(slave, row)
        face%area = 0.0_wp
        parts = parts(:0)
        do
          s = s + 1
          associate (mine => corners(:corners_in(corners(:, s)), s))
            plane = plane_of_face(x(:, mine))
            face%area = face%area + plane%area
            face%part = corners(:, s)
            call find_parts(in_parts, x, face, plane, screen, slave, more, mortar%trapped)
            if (allocated(slave%asks)) call look_opposite(slave%asks(number(mine)), plane, x, &
              in_parts, more, number(mine), mortar%opposite)
          end associate
          do i = 1, size(more)
            more(i)%slave_corner = corners(:, s)
          end do
          if (size(parts) == 0) then
            call move_alloc(more, parts)
          else
            parts = [parts, more]
          end if
          if (s == size(whole)) exit
          if (whole(s + 1) > f) exit
        end do
        call add_whole(face, plane, mortar)
        call add_face(face, x, parts, makes_rows, are_plain, mortar, entries)
        if (finds_changes) call note_changes(face, parts, makes_rows, place, noted(f))
      end associate
    end do
    if (allocated(slave%hanging)) call fold_rows(slave, number, mortar, entries)
    if (allocated(slave%is_fixed)) then
      where (slave%is_fixed) mortar%area = 0.0_wp
    end if
    if (finds_changes) call join_changes(noted, x, slave%nodes, makes_rows, mortar)
    do i = 1, n
      length = norm2(mortar%normal(:, i))
      if (length > 0.0_wp) mortar%normal(:, i) = mortar%normal(:, i)/length
      mortar%faced_area(i) = -dot_product(mortar%normal(:, i), mortar%outward(:, i))
      length = norm2(mortar%outward(:, i))
      if (length > 0.0_wp) mortar%outward(:, i) = mortar%outward(:, i)/length
    end do
    call make_rows(mortar%area, entries, mortar%weights)
    if (are_of_nodes .and. mortar%has_middles) then
      call rows_of_nodes(slave%nodes, number, ends, alpha, mortar)
      alpha = 0.0_wp
    end if
    do i = 1, n
      if (.not. mortar%area(i) > 0.0_wp) cycle
      if (.not. makes_rows) then
        mortar%apart(:, i) = mortar%apart(:, i)/mortar%area(i)
        cycle
      end if
      if (allocated(slave%u)) then
        mortar%apart(:, i) = at_rest(slave%mesh, i) + apart_at(slave%u, i)
      else
        mortar%apart(:, i) = at_rest(x, i)
      end if
    end do

  contains

    !> From the mean of what a row faces to its node, where nothing has moved.
    pure function at_rest(places, i) result(q)
      real(wp), intent(in) :: places(:, :) !! (3,n_nodes) [length]
      integer, intent(in) :: i             !! row
      real(wp) :: q(3)                     !! [length]

      associate (first => mortar%weights%first(i), last => mortar%weights%first(i + 1) - 1)
        q = without_rounding(apart_at(places, i), mortar%normal(:, i), slave%rounding* &
          sum(abs(mortar%weights%weight(first:last))))
      end associate
    end function at_rest

    !> From the mean of what a row faces to its node, of places; or of displacements.
    pure function apart_at(of_nodes, i) result(q)
      real(wp), intent(in) :: of_nodes(:, :) !! (3,n_nodes) [length]
      integer, intent(in) :: i               !! row
      real(wp) :: q(3)                       !! [length]
      integer :: k

      q = of_nodes(:, slave%nodes(i))
      associate (a => alpha(slave%nodes(i)), between => ends(:, slave%nodes(i)))
        if (a > 0.0_wp) q = (q - a*(of_nodes(:, between(1)) + of_nodes(:, between(2))))/ &
          (1.0_wp - 2.0_wp*a)
      end associate
      do k = mortar%weights%first(i), mortar%weights%first(i + 1) - 1
        q = q - mortar%weights%weight(k)*of_nodes(:, mortar%weights%node(k))
      end do
    end function apart_at

  end subroutine make_mortar

end module mortar_mod
