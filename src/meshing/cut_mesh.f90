!> Elements of the mesh as read replaced by their pieces, and its sets with them.
!>
!> What stands further down in the deck then means the finer mesh: surfaces and loads of faces take
!> the parts of the faces that they name, sets of elements their pieces. A new node is in a set of
!> nodes where all those that it lies between are. Forces on nodes and tables stay with the deck's
!> nodes.
module cut_mesh_mod
  use growing_lists_mod, only: append
  use kinds_mod, only: wp
  use cards_mod, only: reader_t, report
  use cell_cuts_mod, only: can_be_cut
  use cells_mod, only: cells, has_middles
  use connectivity_mod, only: all_nodes_of_face, connectivity_t, some_elements
  use find_faces_mod, only: find_outer_faces
  use matching_faces_mod, only: outer_faces
  use mesh_draft_mod, only: mesh_draft_t, reserve_elements, reserve_nodes
  use refine_elements_mod, only: pieces_t, value_between
  use sets_mod, only: extend_marks, finish, model_t, set_t
  use sorting_mod, only: order_of
  use text_mod, only: to_text
  implicit none
  private

  public :: nodes_by_id, elements_of, refuse_uncut, replace_elements

contains

  !> The elements of the mesh, in numbers of nodes or what these are called instead.
  pure type(connectivity_t) function elements_of(mesh, rank) result(connectivity)
    type(mesh_draft_t), intent(in) :: mesh
    integer, intent(in), optional :: rank(:) !! (1+n_nodes) instead of 0, 1, 2, ...
    integer :: e

    connectivity = some_elements(mesh%connectivity, [(e, e=1, mesh%n_elements)])
    if (present(rank)) connectivity%node = rank(1 + connectivity%node)
  end function elements_of

  !> Report a cell that cannot be cut.
  subroutine refuse_uncut(reader, mesh, chosen)
    type(reader_t), intent(inout) :: reader
    type(mesh_draft_t), intent(in) :: mesh
    logical, intent(in), optional :: chosen(:) !! (n_elements) left out: all are to be cut
    integer :: e

    do e = 1, mesh%n_elements
      if (can_be_cut(mesh%connectivity%cell(e))) cycle
      if (present(chosen)) then
        if (.not. chosen(e)) cycle
      end if
      call report(reader, mesh%element_position(e), 'element '//to_text(mesh%element_id(e))// &
        ' is a '//trim(cells(mesh%connectivity%cell(e))%name)//', which cannot be refined: its '// &
        'pieces would not be of one type')
      return
    end do
  end subroutine refuse_uncut

  !> Nodes by ascending id, in whose order sets of an equation go together, and the place of each
  !> node in this; 0 stays 0.
  pure subroutine nodes_by_id(mesh, node, rank)
    type(mesh_draft_t), intent(in) :: mesh
    integer, allocatable, intent(out) :: node(:) !! (0:n_nodes)
    integer, allocatable, intent(out) :: rank(:) !! (0:n_nodes)
    integer, allocatable :: order(:)
    integer :: i

    call order_of(mesh%node_id(:mesh%n_nodes), order)
    allocate (node(0:mesh%n_nodes), rank(0:mesh%n_nodes))
    node(0) = 0
    node(1:) = order
    rank(node) = [(i, i=0, mesh%n_nodes)]
  end subroutine nodes_by_id

  !> Put pieces in the place of elements, and new nodes behind all others.
  subroutine replace_elements(model, pieces, ids, between, place, ok)
    type(model_t), intent(inout) :: model
    type(pieces_t), intent(in) :: pieces
    integer, intent(in) :: ids(:)        !! (n) of the pieces
    integer, intent(in) :: between(:, :) !! (:,n_new) as of refine_elements
    real(wp), intent(in) :: place(:, :)  !! (3,n_new) likewise
    logical, intent(out) :: ok           !! false: there is no room
    integer :: first(model%mesh%n_elements + 1), n, i

    n = model%mesh%n_elements
    if (any(has_middles(model%mesh%connectivity%cell(:n)))) call add_middles(model, pieces)
    associate (mesh => model%mesh, origin => pieces%origin)
      if (.not. allocated(mesh%first_piece)) then
        mesh%n_given = mesh%n_nodes
        mesh%given_id = mesh%element_id(:n)
        mesh%first_piece = [(i, i=1, n + 1)]
        allocate (mesh%outer(6, n), source=.true.)
        mesh%outside = outer_faces(mesh)
        allocate (mesh%between(size(between, 1), 0), mesh%place(3, 0))
      end if
      call reserve_nodes(mesh, size(between, 2), ok)
      if (ok) call reserve_elements(mesh, size(origin) - n, ok)
      if (.not. ok) return
      call add_nodes(mesh, between, place)
      do i = size(origin), 1, -1
        first(origin(i)) = i
      end do
      first(n + 1) = size(origin) + 1
      mesh%first_piece = first(mesh%first_piece)
      n = size(origin)
      mesh%element_id(:n) = mesh%element_id(origin)
      mesh%element_position(:n) = mesh%element_position(origin)
      mesh%element_kind(:n) = mesh%element_kind(origin)
      if (allocated(mesh%collapsed)) mesh%collapsed = mesh%collapsed(origin)
      mesh%connectivity = pieces%connectivity
      mesh%piece_id = ids
      mesh%outer = mesh%outer(:, origin) .and. pieces%is_outer
      mesh%outside = mesh%outside(:, origin) .and. pieces%is_outer
      mesh%n_elements = n
    end associate
    call extend_marks(model, size(between, 2), .true.)
    call extend_node_sets(model, model%mesh%n_nodes - size(between, 2))
    do i = 1, model%element_sets%n
      call cut_members(first, model%element_sets%list(i))
    end do
  end subroutine replace_elements

  !> Add to sets that have corners of elements alone the mid-side nodes of faces that are cut.
  subroutine add_middles(model, pieces)
    type(model_t), intent(inout) :: model
    type(pieces_t), intent(in) :: pieces
    integer, allocatable :: faces(:, :)
    logical :: is_middle(model%mesh%n_nodes), is_cut(model%mesh%n_elements)
    integer :: i, e, f

    associate (mesh => model%mesh)
      is_middle = .false.
      do e = 1, mesh%n_elements
        is_middle(mesh%connectivity%node(mesh%connectivity%first(e) + cells( &
          mesh%connectivity%cell(e))%n_corners:mesh%connectivity%first(e + 1) - 1)) = .true.
      end do
      is_cut = .false.
      is_cut(pack(pieces%origin, pieces%number > 0)) = .true.
      do i = 1, model%node_sets%n
        associate (set => model%node_sets%list(i))
          if (.not. allocated(set%members)) cycle
          if (any(is_middle(set%members(:set%n)))) cycle
          call find_outer_faces(mesh, set%members(:set%n), faces)
          do f = 1, size(faces, 2)
            if (.not. is_cut(faces(1, f))) cycle
            associate (nodes => all_nodes_of_face(mesh%connectivity, faces(1, f), faces(2, f)))
              call append_all(set, pack(nodes, nodes > 0))
            end associate
          end do
          call finish(set)
        end associate
      end do
    end associate
  end subroutine add_middles

  pure subroutine append_all(set, nodes)
    type(set_t), intent(inout) :: set
    integer, intent(in) :: nodes(:)
    integer :: i

    do i = 1, size(nodes)
      call append(set%members, set%n, nodes(i))
    end do
  end subroutine append_all

  !> New nodes, behind all others, where those are that they lie between.
  subroutine add_nodes(mesh, between, place)
    type(mesh_draft_t), intent(inout) :: mesh
    integer, intent(in) :: between(:, :)
    real(wp), intent(in) :: place(:, :)
    integer :: i, a

    do i = 1, size(between, 2)
      associate (added => mesh%n_nodes + i)
        mesh%node_id(added) = mesh%highest_node + i
        mesh%node_position(added) = mesh%node_position(between(1, i))
        do a = 1, 3
          mesh%coordinates(a, added) = value_between(mesh%coordinates(a, :mesh%n_nodes), &
            between(:, i), place(:, i))
        end do
      end associate
    end do
    mesh%between = reshape([mesh%between, between], [size(between, 1), size(mesh%place, 2) + &
      size(place, 2)])
    mesh%place = reshape([mesh%place, place], [3, size(mesh%between, 2)])
    mesh%highest_node = mesh%highest_node + size(between, 2)
    mesh%n_nodes = mesh%n_nodes + size(between, 2)
  end subroutine add_nodes

  !> Add to every set of nodes the new ones that lie between members alone.
  subroutine extend_node_sets(model, n_before)
    type(model_t), intent(inout) :: model
    integer, intent(in) :: n_before !! nodes that are not new
    integer, allocatable :: first(:), list(:)
    logical, allocatable :: is_member(:)
    integer :: i, k, m, node, n_old

    call list_by_highest(model%mesh, n_before, first, list)
    allocate (is_member(0:model%mesh%n_nodes), source=.false.)
    is_member(0) = .true. ! in the place of a node that there is not
    do i = 1, model%node_sets%n
      associate (set => model%node_sets%list(i))
        if (.not. allocated(set%members)) cycle
        is_member(set%members(:set%n)) = .true.
        n_old = set%n
        do m = 1, n_old
          do k = first(set%members(m)), first(set%members(m) + 1) - 1
            node = list(k)
            if (.not. all(is_member(model%mesh%between(:, node - model%mesh%n_given)))) cycle
            is_member(node) = .true.
            call append(set%members, set%n, node)
          end do
        end do
        is_member(set%members(:set%n)) = .false.
        call finish(set)
      end associate
    end do
  end subroutine extend_node_sets

  !> The new nodes by the highest of those that they lie between.
  pure subroutine list_by_highest(mesh, n_before, first, list)
    type(mesh_draft_t), intent(in) :: mesh
    integer, intent(in) :: n_before !! nodes that are not new
    integer, allocatable, intent(out) :: first(:)
    !! (n_nodes + 1) where those of a node begin in `list`
    integer, allocatable, intent(out) :: list(:)  !! new nodes
    integer :: i, highest

    allocate (first(mesh%n_nodes + 1), source=0)
    allocate (list(mesh%n_nodes - n_before))
    do i = 1, size(list)
      highest = maxval(mesh%between(:, n_before - mesh%n_given + i))
      first(highest) = first(highest) + 1
    end do
    first(1) = first(1) + 1
    do i = 2, size(first)
      first(i) = first(i) + first(i - 1)
    end do
    ! Each one is where those of the next node begin: filled from behind.
    do i = size(list), 1, -1
      highest = maxval(mesh%between(:, n_before - mesh%n_given + i))
      first(highest) = first(highest) - 1
      list(first(highest)) = n_before + i
    end do
  end subroutine list_by_highest

  !> The pieces of the elements of a set.
  pure subroutine cut_members(first, set)
    integer, intent(in) :: first(:) !! (n+1) the first piece of each element
    type(set_t), intent(inout) :: set
    integer :: i, k

    if (.not. allocated(set%members)) return
    set%members = [((k, k=first(set%members(i)), first(set%members(i) + 1) - 1), &
      i=1, set%n)]
    set%n = size(set%members)
  end subroutine cut_members

end module cut_mesh_mod
