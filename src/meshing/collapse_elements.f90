!> Elements that name a node twice, or have two nodes in one place, taken as the wedges, pyramids,
!> tetrahedra and triangles that they are.
!>
!> Nodes in one place are one where an edge of an element joins them: other elements, sets, supports
!> and loads that name the second then mean the first.
module collapse_elements_mod
  use cards_mod, only: keep_reading, note, reader_t, report
  use cells_mod, only: cells, has_middles, most_faces, most_nodes, pyramid_13, pyramid_5, &
    wedge_15, wedge_6
  use collapsed_cells_mod, only: collapse_cell
  use connectivity_mod, only: connectivity_t, make_connectivity, nodes_of_element
  use growing_lists_mod, only: append
  use kinds_mod, only: wp
  use mesh_draft_mod, only: mesh_draft_t, not_a_coordinate, solids
  use mesh_mod, only: kind_c3d8
  use text_mod, only: to_text
  implicit none
  private

  public :: join_places, collapse_elements

  real(wp), parameter :: rounding = 1.0e-9_wp !! of the size of an element, to be in one place [-]

contains

  !> Take nodes as one that an edge of no length joins, or that are in one place between the same
  !> corners, where elements are wedges, pyramids or tetrahedra then.
  subroutine join_places(reader, draft)
    type(reader_t), intent(inout) :: reader
    type(mesh_draft_t), intent(inout) :: draft !! elements are in numbers of nodes
    integer :: instead(draft%n_nodes), first(most_nodes), e, i, k
    integer :: solid, place(most_nodes), face_of(most_faces)
    logical :: joined

    instead = [(i, i=1, draft%n_nodes)]
    joined = .false.
    do e = 1, draft%n_elements
      associate (cell => draft%connectivity%cell(e), &
                 nodes => nodes_of_element(draft%connectivity, e))
        call find_places(draft, cell, nodes, first, joined)
        if (.not. joined) cycle
        call collapse_cell(cell, first(:size(nodes)), solid, place, face_of)
        if (solid == 0) cycle
        do k = 1, size(nodes)
          associate (both => [joined_to(nodes(k)), joined_to(nodes(first(k)))])
            instead(maxval(both)) = minval(both)
          end associate
        end do
      end associate
    end do
    k = count(instead /= [(i, i=1, draft%n_nodes)])
    if (k == 0) return
    do i = 1, draft%n_nodes
      instead(i) = instead(instead(i)) ! the lower one, which is done
    end do
    if (allocated(draft%nodes%instead)) then
      draft%nodes%instead = instead(draft%nodes%instead)
    else
      draft%nodes%instead = instead
    end if
    i = findloc(instead /= [(i, i=1, draft%n_nodes)], .true., dim=1)
    call note(reader, 'nodes that an edge of no length joins are one: '//to_text(k)// &
      ' (the first: node '//to_text(draft%node_id(i))//' is node '// &
      to_text(draft%node_id(instead(i)))//')')
    associate (all_nodes => draft%connectivity%node(:draft%connectivity%first(draft%n_elements + &
               1) - 1))
      all_nodes = instead(all_nodes)
    end associate

  contains

    !> The node that stands for a node.
    pure integer function joined_to(node)
      integer, intent(in) :: node

      joined_to = node
      do while (instead(joined_to) /= joined_to)
        joined_to = instead(joined_to)
      end do
    end function joined_to
  end subroutine join_places

  !> The first node of an element that each of them is, or is in the place of where an edge joins
  !> both, or both are between the same corners.
  subroutine find_places(draft, cell, nodes, first, joined)
    type(mesh_draft_t), intent(in) :: draft
    integer, intent(in) :: cell
    integer, intent(in) :: nodes(:)
    integer, intent(out) :: first(most_nodes)
    logical, intent(out) :: joined !! some are others in one place
    real(wp) :: size_of_it
    integer :: i, k, ends(2), others(2)

    joined = .false.
    first = [(k, k=1, most_nodes)]
    if (any(draft%coordinates(:, nodes) >= not_a_coordinate)) return
    associate (of => cells(cell), x => draft%coordinates, apart => set_apart(draft, cell, nodes))
      size_of_it = 0.0_wp
      do k = 2, of%n_corners
        size_of_it = max(size_of_it, maxval(abs(x(:, nodes(k)) - x(:, nodes(1)))))
      end do
      do k = 1, of%n_edges
        call join(of%edge(1, k), of%edge(2, k))
      end do
      if (has_middles(cell) .and. any(first(:of%n_corners) /= [(k, k=1, of%n_corners)])) then
        do k = 1, of%n_edges
          ends = first(of%edge(:, k))
          if (ends(1) == ends(2)) call join(ends(1), of%n_corners + k)
          do i = 1, k - 1
            others = first(of%edge(:, i))
            if (all(others == ends) .or. all(others == ends([2, 1]))) call join(of%n_corners + i, &
              of%n_corners + k)
          end do
        end do
      end if
      ! What is named twice is one wherever it stands.
      if (.not. joined) return
      do k = 2, size(nodes)
        i = findloc(apart, apart(k), dim=1)
        others = first([i, k])
        where (first == maxval(others)) first = minval(others)
      end do
    end associate

  contains

    !> Take two nodes of the element as one if they are in one place, and not on both sides of a
    !> plane.
    subroutine join(a, b)
      integer, intent(in) :: a, b
      integer :: both(2)

      associate (x => draft%coordinates)
        if (maxval(abs(x(:, nodes(b)) - x(:, nodes(a)))) > rounding*size_of_it) return
      end associate
      if (draft%plane /= solids .and. are_opposite(cells(cell)%n_corners/2, a, b)) return
      if (nodes(a) /= nodes(b)) joined = .true.
      both = first([a, b])
      where (first == maxval(both)) first = minval(both)
    end subroutine join
  end subroutine find_places

  !> Give elements whose nodes are not all different the cell that they are.
  subroutine collapse_elements(reader, draft)
    type(reader_t), intent(inout) :: reader
    type(mesh_draft_t), intent(inout) :: draft !! elements are in numbers of nodes
    type(connectivity_t) :: all_elements
    integer :: solid, place(most_nodes), face_of(most_faces)
    integer :: e, k, n, n_nodes, n_faces, repeated, n_of(size(cells)), first
    integer, allocatable :: cell(:), node(:)
    character(:), allocatable :: twice

    n = draft%n_elements
    if (n == 0) return
    twice = ' twice'
    if (allocated(draft%nodes%instead)) twice = twice//', or another in its place'
    n_of = 0
    n_faces = 0
    first = 0
    do e = 1, n
      associate (nodes => nodes_of_element(draft%connectivity, e))
        if (all(nodes == nodes(1))) cycle ! some are not defined, which was reported
        call find_repeated(set_apart(draft, draft%connectivity%cell(e), nodes), repeated)
        if (repeated == 0) cycle
        if (.not. keep_reading(reader)) return
        call collapse_cell(draft%connectivity%cell(e), set_apart(draft, &
          draft%connectivity%cell(e), nodes), solid, place, face_of)
        if (solid == 0) then
          call report(reader, draft%element_position(e), 'element '// &
            to_text(draft%element_id(e))//' names node '//to_text(draft%node_id(nodes( &
            repeated)))//twice)
          draft%connectivity%node(draft%connectivity%first(e):draft%connectivity%first(e + 1) - &
            1) = nodes(1)
          cycle
        end if
        if (.not. allocated(draft%collapsed)) then
          allocate (draft%collapsed(n), source=0)
          allocate (draft%faces_of(most_faces, 16))
          first = e
        end if
        n_of(solid) = n_of(solid) + 1
        call append(draft%faces_of, n_faces, face_of)
        draft%collapsed(e) = n_faces
        draft%element_kind(e) = kind_c3d8
      end associate
    end do
    if (n_faces == 0) return
    call note(reader, to_text(n_faces)//' of '//to_text(n)//' elements name a node twice, and '// &
      'are taken as '//in_words(n_of, draft%plane)//' (the first: element '// &
      to_text(draft%element_id(first))//')')
    cell = draft%connectivity%cell(:n)
    allocate (node(draft%connectivity%first(n + 1) - 1))
    n_nodes = 0
    do e = 1, n
      associate (nodes => nodes_of_element(draft%connectivity, e))
        if (draft%collapsed(e) == 0) then
          node(n_nodes + 1:n_nodes + size(nodes)) = nodes
        else
          call collapse_cell(cell(e), set_apart(draft, cell(e), nodes), solid, place, face_of)
          cell(e) = solid
          do k = 1, cells(solid)%n_nodes
            node(n_nodes + k) = nodes(place(k))
          end do
        end if
        n_nodes = n_nodes + cells(cell(e))%n_nodes
      end associate
    end do
    all_elements = make_connectivity(cell, node(:n_nodes))
    draft%connectivity = all_elements
  end subroutine collapse_elements

  !> Whether two places of an element of a plane are on both sides of it.
  pure logical function are_opposite(n, a, b)
    integer, intent(in) :: n !! corners in the plane
    integer, intent(in) :: a, b

    are_opposite = side(a) /= side(b)

  contains

    !> 0: in the plane, 1: opposite, 2: between.
    pure integer function side(place)
      integer, intent(in) :: place

      side = (place - 1)/n
      if (place > 2*n) side = merge(2, side - 2, place > 4*n)
    end function side
  end function are_opposite

  !> The nodes of an element, those beside the plane of plane elements by numbers of their own.
  pure function set_apart(draft, cell, nodes) result(apart)
    type(mesh_draft_t), intent(in) :: draft
    integer, intent(in) :: cell
    integer, intent(in) :: nodes(:) !! those of the plane twice or three times
    integer :: apart(size(nodes))

    apart = nodes
    if (draft%plane == solids) return
    associate (n => cells(cell)%n_corners/2)
      apart(n + 1:2*n) = nodes(n + 1:2*n) + draft%n_nodes
      if (size(nodes) == 2*n) return
      apart(3*n + 1:4*n) = nodes(3*n + 1:4*n) + draft%n_nodes
      apart(4*n + 1:) = nodes(4*n + 1:) + 2*draft%n_nodes
    end associate
  end function set_apart

  !> The first place whose node is that of a place before; 0: all are different.
  pure subroutine find_repeated(nodes, place)
    integer, intent(in) :: nodes(:)
    integer, intent(out) :: place

    do place = 2, size(nodes)
      if (any(nodes(:place - 1) == nodes(place))) return
    end do
    place = 0
  end subroutine find_repeated

  !> How many wedges, pyramids and tetrahedra, or triangles.
  function in_words(n_of, plane) result(words)
    integer, intent(in) :: n_of(:) !! of each row of the table of cells
    integer, intent(in) :: plane
    character(:), allocatable :: words
    character(11) :: name
    integer :: row

    words = 'triangles'
    if (plane /= solids) return
    words = ''
    do row = 1, size(n_of)
      if (n_of(row) == 0) cycle
      name = merge('tetrahedron', 'tetrahedra ', n_of(row) == 1)
      if (row == wedge_6 .or. row == wedge_15) name = 'wedge'
      if (row == pyramid_5 .or. row == pyramid_13) name = 'pyramid'
      if (name(1:1) /= 't' .and. n_of(row) > 1) name = trim(name)//'s'
      if (words /= '') words = words//', '
      words = words//to_text(n_of(row))//' '//trim(name)
    end do
  end function in_words

end module collapse_elements_mod
