!> The mesh as read with every edge of its bricks cut into equal parts, and its sets with it.
!>
!> What stands further down in the deck then means the finer mesh: surfaces and loads of faces take
!> the parts of the faces that they name, sets of bricks their pieces. A new node is in a set of
!> nodes where all those that it lies between are. Forces on nodes and tables stay with the deck's
!> nodes.
module refine_mesh_mod
  use cards_mod, only: note, reader_t, report
  use diagnostics_mod, only: any_mistakes
  use growing_lists_mod, only: append
  use kinds_mod, only: i8, wp
  use mesh_draft_mod, only: max_nodes, mesh_draft_t, reserve_elements, reserve_nodes
  use refine_bricks_mod, only: piece_faces, refine_bricks, value_between
  use resource_limits_mod, only: has_memory
  use sets_mod, only: finish, model_t, set_t
  use sorting_mod, only: order_of
  use text_mod, only: to_text
  implicit none
  private

  public :: refine_mesh

  !> Of a brick with all that it takes to cut it: edges and faces, sorted, and what comes of it.
  integer(i8), parameter :: bytes_of_brick = 2000_i8

contains

  !> Cut every edge of the bricks into so many parts; sets have been read.
  subroutine refine_mesh(reader, model, parts)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(inout) :: model
    integer, intent(in) :: parts
    integer :: n_elements, i
    integer(i8) :: pieces, nodes
    logical :: ok

    if (parts == 1 .or. model%mesh%n_elements == 0 .or. any_mistakes(reader%diagnostics)) return
    n_elements = model%mesh%n_elements
    pieces = int(parts, i8)**3
    nodes = pieces*n_elements
    ok = has_memory(bytes_of_brick*nodes/8)
    if (nodes > max_nodes .or. .not. ok) then
      call report(reader, 0, 'the mesh cannot be '//in_words(parts)//': that is '// &
        to_text(nodes)//' bricks, at most '//to_text(max_nodes)//' are possible, memory permitting')
    else if (pieces*model%mesh%highest_element + nodes > huge(parts) .or. &
      model%mesh%highest_node + 2*nodes > huge(parts)) then
      call report(reader, 0, 'the mesh cannot be '//in_words(parts)// &
        ': its ids are too high, which those of its parts are above')
    end if
    if (any_mistakes(reader%diagnostics)) return
    model%mesh%n_given = model%mesh%n_nodes
    model%mesh%given_id = model%mesh%element_id(:n_elements)
    call cut_bricks(model%mesh, parts, ok)
    if (.not. ok) then
      call report(reader, 0, 'the mesh cannot be '//in_words(parts)//': there is no room '// &
        'for its nodes (at most '//to_text(max_nodes)//', memory permitting)')
      return
    end if
    call extend_marks(model)
    call extend_node_sets(model)
    do i = 1, model%element_sets%n
      call cut_members(model%mesh%pieces, model%element_sets%list(i))
    end do
    call note(reader, in_words(parts)//': the '// &
      to_text(n_elements)//' bricks of the deck are '//to_text(model%mesh%n_elements)// &
      ', its '//to_text(model%mesh%n_given)//' nodes '//to_text(model%mesh%n_nodes))
  end subroutine refine_mesh

  !> Cut every brick.
  subroutine cut_bricks(mesh, parts, ok)
    type(mesh_draft_t), intent(inout) :: mesh
    integer, intent(in) :: parts
    logical, intent(out) :: ok !! false: there is no room
    integer, allocatable :: fine(:, :), node(:), rank(:)
    !! nodes by ascending id; the place of a node in this
    integer :: n, n_new, e, a, i

    n = mesh%n_elements
    ! By the ids, in whose order sets of an equation go together.
    call order_of(mesh%node_id(:mesh%n_nodes), node)
    allocate (rank(0:mesh%n_nodes))
    rank(0) = 0
    rank(node) = [(i, i=1, mesh%n_nodes)]
    call refine_bricks(mesh%n_nodes, reshape(rank([mesh%connectivity(:, :n)]), [8, n]), parts, &
      fine, mesh%between, mesh%place)
    n_new = size(mesh%between, 2)
    node = [0, node, [(mesh%n_nodes + i, i=1, n_new)]]
    fine = reshape(node(1 + [fine]), shape(fine))
    mesh%between = reshape(node(1 + [mesh%between]), shape(mesh%between))
    mesh%pieces = parts**3
    call reserve_nodes(mesh, n_new, ok)
    if (ok) call reserve_elements(mesh, (mesh%pieces - 1)*n, ok)
    if (.not. ok) return
    do i = 1, n_new
      associate (added => mesh%n_nodes + i)
        mesh%node_id(added) = mesh%highest_node + i
        mesh%node_position(added) = mesh%node_position(mesh%between(1, i))
        do a = 1, 3
          mesh%coordinates(a, added) = value_between(mesh%coordinates(a, :mesh%n_nodes), &
            mesh%between(:, i), mesh%place(:, i))
        end do
      end associate
    end do
    allocate (mesh%outer(6, mesh%pieces*n))
    do e = n, 1, -1
      do a = mesh%pieces, 1, -1
        i = mesh%pieces*(e - 1) + a
        mesh%element_id(i) = mesh%element_id(e)
        mesh%element_position(i) = mesh%element_position(e)
        mesh%element_kind(i) = mesh%element_kind(e)
        mesh%outer(:, i) = piece_faces(a, parts)
      end do
    end do
    mesh%connectivity(:, :mesh%pieces*n) = fine
    mesh%highest_node = mesh%highest_node + n_new
    mesh%n_nodes = mesh%n_nodes + n_new
    mesh%n_elements = mesh%pieces*n
  end subroutine cut_bricks

  !> What was said of the deck's nodes one by one, said of the new ones: bricks have them.
  subroutine extend_marks(model)
    type(model_t), intent(inout) :: model
    integer :: more

    more = model%mesh%n_nodes - model%mesh%n_given
    model%used = [model%used, spread(.true., 1, more)]
    model%reference = [model%reference, spread(.false., 1, more)]
    model%rigid = [model%rigid, spread(.false., 1, more)]
    model%joined = [model%joined, spread(.false., 1, more)]
    model%rotation_node = [model%rotation_node, spread(0, 1, more)]
    model%rotation_arm = [model%rotation_arm, spread(1.0_wp, 1, more)]
  end subroutine extend_marks

  !> Add to every set of nodes the new ones that lie between members alone.
  subroutine extend_node_sets(model)
    type(model_t), intent(inout) :: model
    integer, allocatable :: first(:), list(:)
    logical, allocatable :: is_member(:)
    integer :: i, k, m, node

    call list_by_highest(model%mesh, first, list)
    allocate (is_member(0:model%mesh%n_nodes), source=.false.)
    is_member(0) = .true. ! in the place of a node that there is not
    do i = 1, model%node_sets%n
      associate (set => model%node_sets%list(i))
        if (.not. allocated(set%members)) cycle
        is_member(set%members(:set%n)) = .true.
        ! The list grows while it is gone through: what one refinement adds stands behind all that
        ! was there before, so that of a node all that it lies between have been decided on.
        m = 0
        do while (m < set%n)
          m = m + 1
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
  pure subroutine list_by_highest(mesh, first, list)
    type(mesh_draft_t), intent(in) :: mesh
    integer, allocatable, intent(out) :: first(:)
    !! (n_nodes + 1) where those of a node begin in `list`
    integer, allocatable, intent(out) :: list(:)  !! new nodes
    integer :: i, highest

    allocate (first(mesh%n_nodes + 1), source=0)
    allocate (list(size(mesh%between, 2)))
    do i = 1, size(list)
      highest = maxval(mesh%between(:, i))
      first(highest) = first(highest) + 1
    end do
    first(1) = first(1) + 1
    do i = 2, size(first)
      first(i) = first(i) + first(i - 1)
    end do
    ! Each one is where those of the next node begin: filled from behind.
    do i = size(list), 1, -1
      highest = maxval(mesh%between(:, i))
      first(highest) = first(highest) - 1
      list(first(highest)) = mesh%n_given + i
    end do
  end subroutine list_by_highest

  !> The pieces of the bricks of a set.
  pure subroutine cut_members(pieces, set)
    integer, intent(in) :: pieces
    type(set_t), intent(inout) :: set
    integer :: i, k

    if (.not. allocated(set%members)) return
    set%members = [((pieces*(set%members(i) - 1) + k, k=1, pieces), i=1, set%n)]
    set%n = size(set%members)
  end subroutine cut_members

  !> Refined once, or so many times; else in how many parts edges are cut.
  pure function in_words(parts) result(words)
    integer, intent(in) :: parts
    character(:), allocatable :: words
    integer :: times

    times = bit_size(parts) - 1 - leadz(parts)
    words = 'refined '//to_text(times)//' times'
    if (times == 1) words = 'refined once'
    if (popcnt(parts) > 1) words = 'refined, every edge in '//to_text(parts)//' parts'
  end function in_words

end module refine_mesh_mod
