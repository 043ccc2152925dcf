!> Contact pairs of two surfaces: what of the surfaces must hold before anything may be computed.
module surface_pairs_mod
  use cards_mod, only: note, reader_t, report
  use diagnostics_mod, only: quoted
  use mortar_mod, only: face_each_other
  use scene_mod, only: contact_pair_t
  use sets_mod, only: model_t
  use surface_list_mod, only: find_faces_of_nodes, surface_list_t
  use surfaces_mod, only: nodes_of
  use text_mod, only: to_text
  implicit none
  private

  public :: check_surface_pair

contains

  !> Report what keeps two surfaces from being a pair: `pair` loses its master then.
  subroutine check_surface_pair(reader, model, surfaces, slave_position, master_position, pair)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(surface_list_t), intent(inout) :: surfaces !! faces of a surface of nodes are found
    integer, intent(in) :: slave_position, master_position !! of the names in the deck
    type(contact_pair_t), intent(inout) :: pair
    integer :: shared
    logical :: ok

    if (.not. allocated(surfaces%list(pair%surface)%faces)) return
    call find_faces_of_nodes(reader, model, surfaces, pair%master_surface)
    associate (slave => surfaces%list(pair%surface), &
               master => surfaces%list(pair%master_surface), mesh => model%mesh)
      ok = .not. (surfaces%flawed(pair%surface) .or. surfaces%flawed(pair%master_surface))
      if (ok) then
        call check_faces(pair%surface, slave_position, 'slave')
        call check_faces(pair%master_surface, master_position, 'master')
      end if
      if (ok) then
        shared = shared_node(slave%nodes, master%nodes, mesh%n_nodes)
        if (shared > 0) then
          call report(reader, master_position, quoted(slave%name)//' and '//quoted(master%name)// &
            ' share node '//to_text(mesh%node_id(shared))//': the surfaces of a contact pair '// &
            'must not touch by their mesh')
          ok = .false.
        end if
      end if
      if (ok) then
        ok = face_each_other(nodes_of(slave%faces, mesh%connectivity), &
          nodes_of(master%faces, mesh%connectivity), mesh%coordinates)
        if (.not. ok) call report(reader, master_position, 'no face of '//quoted(master%name)// &
          ' is turned towards one of '//quoted(slave%name)//': these sides cannot touch')
      end if
    end associate
    if (.not. ok) pair%master_surface = 0

  contains

    !> A surface of a pair consists of faces, and all of its nodes are theirs.
    subroutine check_faces(index, position, side)
      integer, intent(in) :: index, position
      character(*), intent(in) :: side
      logical :: on_face(model%mesh%n_nodes)

      associate (surface => surfaces%list(index))
        on_face = .false.
        on_face(reshape(nodes_of(surface%faces, model%mesh%connectivity), &
          [4*size(surface%faces, 2)])) = .true.
        if (size(surface%faces, 2) > 0 .and. all(on_face(surface%nodes))) return
        call report(reader, position, 'the '//side//' '//quoted(surface%name)// &
          ' of a pair of two surfaces has nodes without faces: it must consist of faces '// &
          '(*SURFACE, TYPE=ELEMENT)')
        ok = .false.
      end associate
    end subroutine check_faces

  end subroutine check_surface_pair

  !> A node that two lists have in common; 0: none.
  pure integer function shared_node(one, other, n_nodes) result(node)
    integer, intent(in) :: one(:), other(:), n_nodes
    logical :: is_one(n_nodes)
    integer :: i

    is_one = .false.
    is_one(one) = .true.
    node = 0
    do i = 1, size(other)
      if (.not. is_one(other(i))) cycle
      node = other(i)
      return
    end do
  end function shared_node

end module surface_pairs_mod
