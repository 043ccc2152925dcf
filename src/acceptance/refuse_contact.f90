!> Contact that is missed, and bodies inside one another: what ends a run for it, in words.
module refuse_contact_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t
  use text_mod, only: to_text
  use scene_mod, only: scene_t, master_name
  use contact_points_mod, only: contact_points_t
  use increments_mod, only: increment_t
  use connectivity_mod, only: corners_in
  use faces_between_nodes_mod, only: face_entry_t, entries_t, entered_at_end, entered_on_way, &
    entered_and_left
  use nodes_behind_mod, only: node_behind_t
  use bodies_inside_mod, only: inside_t
  use name_refusal_mod, only: raise_at, node_name
  implicit none
  private

  public :: refuse_missed_contact, refuse_unfelt_overlap, refuse_deep_overlap, refuse_inside, &
    refuse_folded_through, inside_in_words, nearest_in_words, nodes_in_words

contains

  !> A contact that lies between the nodes ends the run: no force would answer it.
  subroutine refuse_missed_contact(scene, increment, entries, error)
    type(scene_t), intent(in) :: scene
    type(increment_t), intent(in) :: increment
    type(entries_t), intent(in) :: entries !! of the increment
    type(error_t), allocatable, intent(out) :: error
    character(:), allocatable :: obstacle, face
    real(wp) :: needed !! edge of a square whose corners are as deep as its middle [length]

    associate (missed => entries%missed)
      if (.not. missed%depth > 0.0_wp) return
      needed = 0.0_wp
      if (entries%how == entered_at_end) needed = 2.0_wp*sqrt(scene%obstacles(scene%pairs( &
        missed%pair)%master)%radius*missed%depth)
      obstacle = master_name(scene, missed%pair)
      face = to_text(missed%depth, 3)//' deep into the face of '//nodes_in_words(scene, &
        missed%nodes)//' of '//scene%surfaces(scene%pairs(missed%pair)%surface)%name
    end associate
    select case (entries%how)
    case (entered_on_way)
      face = obstacle//' gets '//face//' within the increment, and passes it or leaves it '// &
        'without contact: contact is missed; use '
      if (entries%passed%depth > 0.0_wp) face = face//'smaller increments, or '
      face = face//'smaller elements'
    case (entered_and_left)
      face = obstacle//' was '//face//' when the increment began, and has left it without '// &
        'touching a node: contact is missed; use smaller elements, or smaller increments'
    case default
      face = obstacle//' is '//face//', but no node of that face or of its neighbours touches '// &
        'it: contact is missed; use smaller elements, with edges below about '// &
        to_text(needed, 2)//', or smaller increments'
    end select
    call raise_at(increment, error, face)
  end subroutine refuse_missed_contact

  !> So does one that the means over faces do not feel.
  subroutine refuse_unfelt_overlap(scene, increment, unfelt, error)
    type(scene_t), intent(in) :: scene
    type(increment_t), intent(in) :: increment
    type(face_entry_t), intent(in) :: unfelt !! at the end of a *STEP
    type(error_t), allocatable, intent(out) :: error
    character(:), allocatable :: advice

    advice = 'smaller elements'
    associate (pair => scene%pairs(unfelt%pair))
      if (pair%master == 0) advice = master_name(scene, unfelt%pair)//' as the slave, or '//advice
      call raise_at(increment, error, master_name(scene, unfelt%pair)//' is '// &
        to_text(unfelt%depth, 3)//' deep into the face of '//nodes_in_words(scene, unfelt%nodes)// &
        ' of '//scene%surfaces(pair%surface)%name//', but no node of that face or of its '// &
        'neighbours touches it: contact is missed; use '//advice)
    end associate
  end subroutine refuse_unfelt_overlap

  !> Bodies that begin deeper in one another than the elements there are thick end the run.
  subroutine refuse_deep_overlap(scene, points, increment, point, depth, element, error)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(increment_t), intent(in) :: increment
    integer, intent(in) :: point
    real(wp), intent(in) :: depth  !! before the first step [length]
    integer, intent(in) :: element !! behind the face
    type(error_t), allocatable, intent(out) :: error

    call raise_at(increment, error, node_name(scene, points, point)// &
      ' of '//scene%pairs(points%pair(point))%name//' begins '//to_text(depth, 3)// &
      ' inside its master, which is more than element '// &
      to_text(scene%mesh%element_id(element))//' behind it is thick; move the bodies apart, '// &
      'or close the overlap with ADJUST= of *CONTACT PAIR')
    error%n_meshes = 1
  end subroutine refuse_deep_overlap

  !> A body inside another ends the run where everything may touch everything, but for what the deck
  !> leaves out.
  subroutine refuse_inside(scene, increment, inside, error)
    type(scene_t), intent(in) :: scene
    type(increment_t), intent(in) :: increment
    type(inside_t), intent(in) :: inside
    type(error_t), allocatable, intent(out) :: error

    character(:), allocatable :: advice

    advice = 'give their surfaces a *CONTACT PAIR of their own, or name them by *CONTACT '// &
      'EXCLUSIONS if they may overlap'
    if (inside%pair > 0) advice = 'use smaller elements'
    if (scene%mesh%piece(inside%node) == inside%piece) advice = 'use smaller increments, or '// &
      'smaller elements'
    call raise_at(increment, error, inside_in_words(scene, inside)//': contact is missed; '//advice)
  end subroutine refuse_inside

  !> So does a body that has gone through itself.
  subroutine refuse_folded_through(scene, increment, node, error)
    type(scene_t), intent(in) :: scene
    type(increment_t), intent(in) :: increment
    integer, intent(in) :: node !! that has
    type(error_t), allocatable, intent(out) :: error

    call raise_at(increment, error, 'node '//to_text(scene%mesh%node_id(node))//' of '// &
      piece_name(scene, scene%mesh%piece(node))//' goes through a wall of its own body within '// &
      'the increment: contact is missed; use smaller increments')
  end subroutine refuse_folded_through

  !> "node 17 of UP is 0.2 inside LOW, where no contact pair keeps it out"; "the edge of nodes 3 and
  !> 4 of UP is 0.1 inside LOW, and no node of S:M feels it".
  pure function inside_in_words(scene, inside) result(words)
    type(scene_t), intent(in) :: scene
    type(inside_t), intent(in) :: inside
    character(:), allocatable :: words

    words = 'node '//to_text(scene%mesh%node_id(inside%node))
    if (inside%other_node > 0) words = 'the edge of nodes '//to_text(scene%mesh%node_id( &
      inside%node))//' and '//to_text(scene%mesh%node_id(inside%other_node))
    words = words//' of '//piece_name(scene, scene%mesh%piece(inside%node))//' is '// &
      to_text(inside%depth, 3)//' inside '
    if (scene%mesh%piece(inside%node) == inside%piece) then
      words = words//'its own body'
    else
      words = words//piece_name(scene, inside%piece)
    end if
    if (inside%pair > 0) then
      words = words//', and no node of '//scene%pairs(inside%pair)%name//' feels it'
    else if (scene%mesh%piece(inside%node) /= inside%piece) then
      words = words//', where no contact pair keeps it out'
    end if
  end function inside_in_words

  !> The first element set that is a piece of the mesh; else the body of a node.
  pure function piece_name(scene, piece) result(name)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: piece
    character(:), allocatable :: name
    integer :: k

    associate (connectivity => scene%mesh%connectivity)
      associate (pieces => scene%mesh%piece(connectivity%node(connectivity%first( &
                 :scene%mesh%n_elements))))
        do k = 1, size(scene%element_sets)
          associate (members => scene%element_sets(k)%members)
            if (size(members) /= count(pieces == piece)) cycle
            if (any(pieces(members) /= piece)) cycle
          end associate
          name = scene%element_sets(k)%name
          return
        end do
      end associate
    end associate
    name = 'the body of node '//to_text(scene%mesh%node_id(findloc(scene%mesh%piece, piece, dim=1)))
  end function piece_name

  !> Which node that contact does not see has come near an obstacle, and what to do; '' if none.
  pure function nearest_in_words(scene, nearest) result(words)
    type(scene_t), intent(in) :: scene
    type(node_behind_t), intent(in) :: nearest
    character(:), allocatable :: words

    words = ''
    if (nearest%node == 0) return
    associate (surface => scene%surfaces(scene%pairs(nearest%pair)%surface)%name)
      words = new_line('a')//'  Node '//to_text(scene%mesh%node_id(nearest%node))// &
        ' has come to '//to_text(max(0.0_wp, -nearest%depth), 2)//' of '//master_name(scene, &
        nearest%pair)//', and its faces are not in '//surface//': add all faces that may touch '// &
        'to '//surface
    end associate
  end function nearest_in_words

  !> "nodes 1, 2, 11 and 10".
  pure function nodes_in_words(scene, nodes) result(words)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: nodes(:) !! of a face; what is behind those of a triangle is left out
    character(:), allocatable :: words
    integer :: k, n

    n = corners_in(nodes)
    if (nodes(n) == nodes(n - 1)) n = n - 1
    associate (id => scene%mesh%node_id)
      words = 'nodes '//to_text(id(nodes(1)))
      do k = 2, n - 1
        words = words//', '//to_text(id(nodes(k)))
      end do
      words = words//' and '//to_text(id(nodes(n)))
    end associate
  end function nodes_in_words

end module refuse_contact_mod
