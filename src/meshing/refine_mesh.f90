!> The mesh as read with every edge of its elements cut into equal parts.
module refine_mesh_mod
  use cards_mod, only: note, reader_t, report
  use diagnostics_mod, only: any_mistakes
  use connectivity_mod, only: connectivity_t
  use cut_mesh_mod, only: elements_of, nodes_by_id, refuse_uncut, replace_elements
  use kinds_mod, only: i8, wp
  use mesh_draft_mod, only: max_nodes
  use refine_elements_mod, only: divide_elements, pieces_t, refine_elements
  use resource_limits_mod, only: has_memory
  use sets_mod, only: model_t
  use text_mod, only: to_text
  implicit none
  private

  public :: refine_mesh

  !> Of an element with all that it takes to cut it: edges and faces, sorted, and what comes of it.
  integer(i8), parameter :: bytes_of_element = 2000_i8
  integer(i8), parameter :: most_new = 8_i8 !! nodes a piece, of one element with mid-side nodes

contains

  !> Cut every edge of the elements into so many parts, but for those across a slice; sets have been
  !> read.
  subroutine refine_mesh(reader, model, parts, across)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(inout) :: model
    integer, intent(in) :: parts
    integer, intent(in) :: across !! as of mesh_size_t
    integer :: n_elements
    integer(i8) :: pieces, nodes
    logical :: ok

    if (parts == 1 .or. model%mesh%n_elements == 0 .or. any_mistakes(reader%diagnostics)) return
    call refuse_uncut(reader, model%mesh)
    if (any_mistakes(reader%diagnostics)) return
    n_elements = model%mesh%n_elements
    pieces = int(parts, i8)**merge(2, 3, across > 0)
    nodes = pieces*n_elements
    ok = has_memory(bytes_of_element*nodes/8)
    if (nodes > max_nodes .or. .not. ok) then
      call report(reader, 0, 'the mesh cannot be '//in_words(parts)//': that is '// &
        to_text(nodes)//' elements, at most '//to_text(max_nodes)//' are possible, '// &
        'memory permitting')
    else if (pieces*model%mesh%highest_element + nodes > huge(parts) .or. &
      model%mesh%highest_node + most_new*nodes > huge(parts)) then
      call report(reader, 0, 'the mesh cannot be '//in_words(parts)// &
        ': its ids are too high, which those of its parts are above')
    end if
    if (any_mistakes(reader%diagnostics)) return
    call cut_elements(model, parts, across, ok)
    if (.not. ok) then
      call report(reader, 0, 'the mesh cannot be '//in_words(parts)//': there is no room '// &
        'for its nodes (at most '//to_text(max_nodes)//', memory permitting)')
      return
    end if
    call note(reader, in_words(parts)//': the '// &
      to_text(n_elements)//' elements of the deck are '//to_text(model%mesh%n_elements)// &
      ', its '//to_text(model%mesh%n_given)//' nodes '//to_text(model%mesh%n_nodes))
  end subroutine refine_mesh

  !> Cut every element. Those that element `id` is cut into are (id - 1) pieces + 1 and so on.
  subroutine cut_elements(model, parts, across, ok)
    type(model_t), intent(inout) :: model
    integer, intent(in) :: parts, across
    logical, intent(out) :: ok !! false: there is no room
    type(connectivity_t) :: elements
    type(pieces_t) :: pieces
    integer, allocatable :: between(:, :), node(:), rank(:)
    real(wp), allocatable :: place(:, :)
    integer :: of_each, n_nodes, i

    n_nodes = model%mesh%n_nodes
    call nodes_by_id(model%mesh, node, rank)
    elements = elements_of(model%mesh, rank)
    call refine_elements(n_nodes, elements, divide_elements(model%mesh%coordinates(:, &
      node(1:n_nodes)), elements, parts, across), pieces, between, place)
    node = [node, [(n_nodes + i, i=1, size(between, 2))]]
    pieces%connectivity%node = node(1 + pieces%connectivity%node)
    of_each = size(pieces%origin)/model%mesh%n_elements
    call replace_elements(model, pieces, of_each*(model%mesh%element_id(pieces%origin) - 1) + &
      pieces%number, reshape(node(1 + [between]), shape(between)), place, ok)
  end subroutine cut_elements

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
