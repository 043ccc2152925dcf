!> Some elements of the mesh as read cut into eight, of a slice into four, again and again: those of
!> a set, those at the nodes of a set, those about a zone. Where they meet others, nodes hang.
!>
!> docs/theory.md section 11.
module refine_locally_mod
  use cards_mod, only: note, reader_t, report
  use cells_mod, only: has_middles
  use connectivity_mod, only: all_nodes_of_face, connectivity_t, nodes_of_element
  use constraints_mod, only: add_constraint, constraints_t
  use cut_mesh_mod, only: elements_of, nodes_by_id, refuse_uncut, replace_elements
  use diagnostics_mod, only: any_mistakes, quoted
  use kinds_mod, only: i8, wp
  use local_refinement_mod, only: between_t, cut_some, cut_with, find_hanging, parents_of
  use mesh_draft_mod, only: max_nodes, mesh_draft_t
  use mesh_size_mod, only: is_near, zone_t
  use refine_elements_mod, only: divide_elements, pieces_t, side_weights, value_between, widest
  use resource_limits_mod, only: has_memory
  use sets_mod, only: model_t
  use surfaces_mod, only: surface_t
  use text_mod, only: to_text
  implicit none
  private

  public :: refinement_t, refine_locally, refuse_hanging, place_hanging, constrain_hanging, &
    most_times

  integer, parameter :: most_times = 10
  !> Of an element with all that it takes to cut it. [byte]
  integer(i8), parameter :: bytes_of_element = 2000_i8
  integer, parameter :: most_new = 64 !! nodes of an element that is cut

  !> A *REFINE.
  type :: refinement_t
    integer :: position = 0
    integer :: times = 1
    integer :: node_set = 0    !! elements at its nodes, those between them too; 0: none
    integer :: element_set = 0 !! its elements; 0: none
    type(zone_t) :: zone = zone_t() !! elements about it
  end type refinement_t

contains

  !> Cut what the deck's cards and the zone say; sets have been read.
  subroutine refine_locally(reader, model, refinements, zone, across)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(inout) :: model
    type(refinement_t), intent(in) :: refinements(:)
    type(zone_t), intent(in) :: zone
    integer, intent(in) :: across !! as of mesh_size_t
    integer, allocatable :: cuts(:)
    logical, allocatable :: chosen(:)
    integer :: pass, n_before
    logical :: ok

    if (max(zone%times, maxval([refinements%times, 0])) == 0 .or. model%mesh%n_elements == 0 .or. &
      any_mistakes(reader%diagnostics)) return
    n_before = model%mesh%n_elements
    allocate (cuts(n_before), source=0)
    ok = fewest_elements(model, refinements) < max_nodes
    if (.not. ok) call refuse()
    if (.not. ok) return
    do pass = 1, max(zone%times, maxval([refinements%times, 0]))
      if (pass == 1) call refuse_far(reader, model, refinements)
      chosen = choose_elements(model, refinements, zone, pass, across)
      if (.not. any(chosen)) cycle
      if (allocated(model%mesh%between)) then
        call cut_with(elements_of(model%mesh), model%mesh%n_nodes, model%mesh%between, &
          model%mesh%n_given, cuts, chosen)
      end if
      call refuse_uncut(reader, model%mesh, chosen)
      if (any_mistakes(reader%diagnostics)) return
      call cut_chosen(model, chosen, across, cuts, ok)
      if (.not. ok) call refuse()
      if (.not. ok) return
    end do
    if (.not. any(cuts > 0)) return
    associate (mesh => model%mesh)
      mesh%hangs = find_hanging(mesh%n_nodes, elements_of(mesh), between_t(mesh%between, &
        mesh%place), mesh%n_given)
      if (.not. any(mesh%hangs)) deallocate (mesh%hangs)
      call note(reader, 'refined locally: '//to_text(n_before)//' elements are '// &
        to_text(mesh%n_elements))
    end associate

  contains

    subroutine refuse()
      integer :: position

      position = 0
      if (size(refinements) > 0) position = refinements(1)%position
      call report(reader, position, 'the mesh cannot be refined locally: there is no room for '// &
        'its nodes, or its ids are too high (at most '//to_text(max_nodes)// &
        ' nodes, memory permitting)')
    end subroutine refuse

  end subroutine refine_locally

  !> Report balls that lie where no element is.
  subroutine refuse_far(reader, model, refinements)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(refinement_t), intent(in) :: refinements(:)
    integer :: i

    do i = 1, size(refinements)
      if (refinements(i)%zone%times == 0) cycle
      if (any(choose_elements(model, refinements(i:i), zone_t(), 1, 0))) cycle
      call report(reader, refinements(i)%position, &
        'there is no element to be cut: none is near the balls')
    end do
  end subroutine refuse_far

  !> How many elements there will be at least.
  pure real(wp) function fewest_elements(model, refinements) result(n)
    type(model_t), intent(in) :: model
    type(refinement_t), intent(in) :: refinements(:)
    integer :: i

    n = 0.0_wp
    do i = 1, size(refinements)
      if (refinements(i)%element_set == 0) cycle
      associate (set => model%element_sets%list(refinements(i)%element_set))
        if (allocated(set%members)) n = max(n, size(set%members)*8.0_wp**refinements(i)%times)
      end associate
    end do
  end function fewest_elements

  !> The elements that are to be cut for the n-th time.
  function choose_elements(model, refinements, zone, pass, across) result(chosen)
    type(model_t), intent(in) :: model
    type(refinement_t), intent(in) :: refinements(:)
    type(zone_t), intent(in) :: zone
    integer, intent(in) :: pass, across
    logical :: chosen(model%mesh%n_elements)
    logical :: at(model%mesh%n_nodes)
    integer :: i, e

    chosen = .false.
    at = .false.
    do i = 1, size(refinements)
      if (refinements(i)%times < pass) cycle
      call choose_near(refinements(i)%zone)
      if (refinements(i)%element_set > 0) then
        associate (set => model%element_sets%list(refinements(i)%element_set))
          if (allocated(set%members)) chosen(set%members) = .true.
        end associate
      else if (refinements(i)%node_set > 0) then
        associate (set => model%node_sets%list(refinements(i)%node_set))
          if (allocated(set%members)) at(set%members) = .true.
        end associate
      end if
    end do
    if (any(at)) then
      do e = 1, model%mesh%n_elements
        chosen(e) = chosen(e) .or. any(at(nodes_of_element(model%mesh%connectivity, e)))
      end do
    end if
    call choose_near(zone)

  contains

    subroutine choose_near(zone)
      type(zone_t), intent(in) :: zone
      integer :: k

      if (pass > zone%times) return
      associate (mesh => model%mesh)
        do k = 1, mesh%n_elements
          if (.not. chosen(k)) chosen(k) = is_near(zone, mesh%coordinates(:, &
            nodes_of_element(mesh%connectivity, k)), across)
        end do
      end associate
    end subroutine choose_near

  end function choose_elements

  !> Cut the chosen elements, every edge in two but for those across a slice.
  subroutine cut_chosen(model, chosen, across, cuts, ok)
    type(model_t), intent(inout) :: model
    logical, intent(in) :: chosen(:)
    integer, intent(in) :: across
    integer, allocatable, intent(inout) :: cuts(:) !! (n_elements) how often each was cut
    logical, intent(out) :: ok                     !! false: there is no room
    type(connectivity_t) :: elements
    type(pieces_t) :: pieces
    type(between_t) :: between, added
    integer, allocatable :: node(:), rank(:), ids(:)
    integer :: n, n_nodes, highest, i

    n = model%mesh%n_elements
    n_nodes = model%mesh%n_nodes
    ids = model%mesh%element_id(:n)
    if (allocated(model%mesh%piece_id)) ids = model%mesh%piece_id
    highest = maxval(ids)
    ok = has_memory(8*bytes_of_element*count(chosen)) .and. n + 7*count(chosen) < &
      max_nodes .and. highest < huge(highest) - 8*count(chosen) .and. &
      model%mesh%highest_node < huge(highest) - most_new*count(chosen)
    if (.not. ok) return
    call nodes_by_id(model%mesh, node, rank)
    elements = elements_of(model%mesh, rank)
    if (allocated(model%mesh%between)) then
      between = between_t(reshape(rank([model%mesh%between]), shape(model%mesh%between)), &
        model%mesh%place)
    else
      allocate (between%nodes(widest(elements), 0), between%place(3, 0))
    end if
    call cut_some(n_nodes, elements, between, chosen, divide_elements(model%mesh%coordinates(:, &
      node(1:n_nodes)), elements, 2, across), pieces, added)
    node = [node, [(n_nodes + i, i=1, size(added%nodes, 2))]]
    pieces%connectivity%node = node(1 + pieces%connectivity%node)
    ids = ids(pieces%origin)
    do i = 1, size(ids)
      if (pieces%number(i) == 0) cycle
      highest = highest + 1
      ids(i) = highest
    end do
    call replace_elements(model, pieces, ids, reshape(node(1 + [added%nodes]), &
      shape(added%nodes)), added%place, ok)
    if (ok) cuts = cuts(pieces%origin) + merge(1, 0, pieces%number > 0)
  end subroutine cut_chosen

  !> Report slave faces with mid-side nodes that have nodes that hang: these have negative parts of
  !> some of the nodes about them, which would get negative areas of contact.
  subroutine refuse_hanging(reader, mesh, surfaces, slaves, refinements)
    type(reader_t), intent(inout) :: reader
    type(mesh_draft_t), intent(in) :: mesh
    type(surface_t), intent(in) :: surfaces(:)
    integer, intent(in) :: slaves(:) !! rows of `surfaces`: of pairs and ties
    type(refinement_t), intent(in) :: refinements(:)
    integer :: i, f

    if (.not. allocated(mesh%hangs)) return
    do i = 1, size(slaves)
      associate (faces => surfaces(slaves(i))%faces)
        do f = 1, size(faces, 2)
          if (.not. has_middles(mesh%connectivity%cell(faces(1, f)))) cycle
          associate (nodes => all_nodes_of_face(mesh%connectivity, faces(1, f), faces(2, f)))
            if (.not. any(mesh%hangs(pack(nodes, nodes > 0)))) cycle
          end associate
          call report(reader, refinements(1)%position, 'slave surface '// &
            quoted(surfaces(slaves(i))%name)//' consists of faces with mid-side nodes, and '// &
            'this refines a part of it: refine all elements at it, or none')
          return
        end do
      end associate
    end do
  end subroutine refuse_hanging

  !> Put nodes that hang back into the middle, after others were moved.
  pure subroutine place_hanging(mesh)
    type(mesh_draft_t), intent(inout) :: mesh
    integer :: node, a

    if (.not. allocated(mesh%hangs)) return
    do node = mesh%n_given + 1, mesh%n_nodes
      if (.not. mesh%hangs(node)) cycle
      do a = 1, 3
        mesh%coordinates(a, node) = value_between(mesh%coordinates(a, :mesh%n_nodes), &
          mesh%between(:, node - mesh%n_given), mesh%place(:, node - mesh%n_given))
      end do
    end do
  end subroutine place_hanging

  !> Nodes that hang move as those that they lie between: in front of all other constraints.
  pure subroutine constrain_hanging(mesh, constraints)
    type(mesh_draft_t), intent(in) :: mesh
    type(constraints_t), intent(inout) :: constraints
    integer :: node, dof

    if (.not. allocated(mesh%hangs)) return
    do node = mesh%n_given + 1, size(mesh%hangs)
      if (.not. mesh%hangs(node)) cycle
      associate (parents => parents_of(mesh%between(:, node - mesh%n_given)))
        associate (weights => side_weights(size(parents), mesh%place(:, node - mesh%n_given)))
          do dof = 1, 3
            call add_constraint(constraints, node, dof, pack(parents, abs(weights) > 0.0_wp), &
              spread(dof, 1, count(abs(weights) > 0.0_wp)), pack(weights, abs(weights) > 0.0_wp))
          end do
        end associate
      end associate
    end do
  end subroutine constrain_hanging

end module refine_locally_mod
