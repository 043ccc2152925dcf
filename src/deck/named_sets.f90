!> The named sets of a deck as the scene keeps them, for the result file.
module named_sets_mod
  use cards_mod, only: note, reader_t
  use lookup_mod, only: find_name
  use scene_mod, only: named_set_t, scene_t
  use sets_mod, only: model_t, set_list_t
  use surface_list_mod, only: surface_list_t
  use text_mod, only: to_text
  implicit none
  private

  public :: keep_named_sets

  !> Sets of a kind that are kept. Each is a dataset of the result: 2000 took 0.4 s of CPU time and
  !> 0.8 MB beside input/block.inp.
  integer, parameter :: most_sets = 2000

contains

  !> Keep the sets and count the surfaces that have names; the surfaces have just been read. Those
  !> of nodes become sets of nodes.
  subroutine keep_named_sets(reader, model, surfaces, scene)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(surface_list_t), intent(in) :: surfaces
    type(scene_t), intent(inout) :: scene
    type(named_set_t), allocatable :: of_nodes(:)
    integer :: i, n

    call keep_sets(reader, model%element_sets, 'element', scene%element_sets)
    call keep_sets(reader, model%node_sets, 'node', scene%node_sets)
    scene%n_named_surfaces = min(surfaces%n_named, most_sets)
    if (surfaces%n_named > most_sets) call note_left_out(reader, 'surfaces', surfaces%n_named)
    n = size(scene%node_sets)
    allocate (of_nodes(n + count(surfaces%of_nodes(:scene%n_named_surfaces))))
    of_nodes(:n) = scene%node_sets
    do i = 1, scene%n_named_surfaces
      if (.not. surfaces%of_nodes(i)) cycle
      n = n + 1
      of_nodes(n)%name = surfaces%list(i)%name
      of_nodes(n)%members = surfaces%list(i)%nodes
    end do
    call move_alloc(of_nodes, scene%node_sets)
  end subroutine keep_named_sets

  !> Copy the sets of one kind that have members, each once.
  subroutine keep_sets(reader, sets, kind, kept)
    type(reader_t), intent(inout) :: reader
    type(set_list_t), intent(in) :: sets
    character(*), intent(in) :: kind !! in words
    type(named_set_t), allocatable, intent(out) :: kept(:)
    logical :: has_members(sets%n)
    integer :: i, n

    do i = 1, sets%n
      ! A later card of a name adds to the set of the first one.
      has_members(i) = find_name(sets%lookup, sets%names, sets%names(i)%text) == i .and. &
        sets%list(i)%n > 0
    end do
    allocate (kept(min(count(has_members), most_sets)))
    n = 0
    do i = 1, sets%n
      if (.not. has_members(i) .or. n == most_sets) cycle
      n = n + 1
      kept(n)%name = sets%names(i)%text
      kept(n)%members = sets%list(i)%members(:sets%list(i)%n)
    end do
    if (count(has_members) > most_sets) call note_left_out(reader, kind//' sets', &
      count(has_members))
  end subroutine keep_sets

  subroutine note_left_out(reader, what, n)
    type(reader_t), intent(inout) :: reader
    character(*), intent(in) :: what
    integer, intent(in) :: n

    call note(reader, 'the result file has the first '//to_text(most_sets)//' of '//to_text(n)// &
      ' '//what)
  end subroutine note_left_out

end module named_sets_mod
