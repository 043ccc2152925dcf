!> Equations between displacements.
!>
!>     *EQUATION
!>     2                              number of terms; more equations may follow
!>     TOP, 3, 1.,  900, 3, -1.       node or set, dof, coefficient; up to four terms a line
!>     *MPC
!>     TIE, LEFT, RIGHT               nodes of the first move as those of the second
!>     LINK, LEFT, RIGHT              and those keep their distance
module read_equations_mod
  use cards_mod, only: keep_reading, reader_t, report, report_in_field
  use diagnostics_mod, only: quoted
  use equation_list_mod, only: add_equation, equation_list_t
  use fields_mod, only: any_number, field_position, field_text, fields_t, integer_field, &
    is_empty_field, limit_fields, next_data_line, real_field, reference_field, reference_t
  use kinds_mod, only: i8, wp
  use mesh_draft_mod, only: nodes_of_plane, solids
  use options_mod, only: allow_options, card_t, open_card
  use sets_mod, only: model_t, referenced_nodes
  use sorting_mod, only: order_of
  use text_mod, only: to_text, upper
  implicit none
  private

  public :: read_equations

  integer, parameter :: most_terms = 20000   !! of an equation
  integer(i8), parameter :: max_work = 50000000 !! terms of all equations, node by node
  integer, parameter :: on_a_line = 4           !! terms

  !> A term: nodes that share dof and coefficient, one for each equation that its line means, or one
  !> for all.
  type :: term_t
    integer, allocatable :: nodes(:)
    integer :: dof = 0 !! 1 to 6
    real(wp) :: coefficient = 0.0_wp
    integer :: position = 0
  end type term_t

contains

  !> Read all *EQUATION cards, and what *MPC says by equations. Nodes that no element has are joined
  !> to what the equations name.
  subroutine read_equations(reader, model, equations)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(inout) :: model
    type(equation_list_t), intent(inout) :: equations
    type(card_t) :: card
    integer(i8) :: work
    integer :: k

    work = 0
    do k = 1, reader%n_cards
      if (reader%cards(k)%keyword == 'MPC') then
        call open_card(reader, k, card)
        call read_mpc(reader, card, model, equations, work)
      else if (reader%cards(k)%keyword == 'EQUATION') then
        call open_card(reader, k, card)
        call allow_options(reader, card)
        call read_card(reader, card, model, equations, work)
      end if
    end do
  end subroutine read_equations

  !> Lines TIE, PIN or LINK of an *MPC card: nodes that move as others, one by one; with TIE
  !> reference nodes also turn as others do, with LINK nodes keep their distance. *MPC with BEAM is
  !> a coupling.
  subroutine read_mpc(reader, card, model, equations, work)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(model_t), intent(inout) :: model
    type(equation_list_t), intent(inout) :: equations
    integer(i8), intent(inout) :: work !! terms so far
    type(fields_t) :: fields
    type(reference_t) :: reference
    type(term_t) :: terms(2)
    character(:), allocatable :: kind
    integer :: i, dof, most
    logical :: found, ok(2)

    do
      call next_data_line(reader, card, fields, found, any_number, '')
      if (.not. found) return
      kind = upper(field_text(reader, fields, 1))
      if (kind /= 'TIE' .and. kind /= 'PIN' .and. kind /= 'LINK') cycle
      call limit_fields(reader, fields, 3, 'TIE, PIN or LINK, and two nodes or sets of nodes')
      most = 3
      if (kind == 'TIE' .and. allocated(model%rotation_node)) most = 6
      do i = 1, 2
        call reference_field(reader, fields, i + 1, 'a node or a set of nodes', reference, ok(i))
        if (.not. ok(i)) cycle
        call referenced_nodes(reader, model, reference, terms(i)%nodes)
        terms(i)%nodes = nodes_of_plane(model%mesh, terms(i)%nodes)
        terms(i)%coefficient = 3 - 2*i
        terms(i)%position = reference%position
        ok(i) = size(terms(i)%nodes) > 0
        if (most == 6 .and. ok(i)) then
          if (any(model%rotation_node(terms(i)%nodes) == 0)) most = 3
        end if
      end do
      if (.not. all(ok)) cycle
      if (size(terms(1)%nodes) /= size(terms(2)%nodes) .and. size(terms(2)%nodes) > 1) then
        call report(reader, fields%start, 'a set of '//to_text(size(terms(1)%nodes))// &
          ' nodes cannot move as one of '//to_text(size(terms(2)%nodes))//': as many, or one node')
        cycle
      end if
      if (kind == 'LINK') then
        call match_links(reader, model, terms, equations)
        cycle
      end if
      do dof = 1, merge(2, most, model%mesh%plane /= solids)
        terms%dof = dof
        call match_terms(reader, model, terms, equations, work)
      end do
      if (work > max_work) then
        call report(reader, fields%start, 'the equations of the deck have too many terms')
        return
      end if
    end do
  end subroutine read_mpc

  !> The nodes of a line LINK, node by node, or all with the only one.
  subroutine match_links(reader, model, terms, equations)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(inout) :: model
    type(term_t), intent(in) :: terms(2)
    type(equation_list_t), intent(inout) :: equations
    integer :: pairs(2, size(terms(1)%nodes)), i

    pairs(1, :) = terms(1)%nodes
    pairs(2, :) = [(terms(2)%nodes(min(i, size(terms(2)%nodes))), i=1, size(pairs, 2))]
    do i = 1, size(pairs)
      associate (node => pairs(2 - modulo(i, 2), (i + 1)/2))
        if (model%reference(node) .or. (model%rigid(node) .and. .not. model%used(node))) then
          call report(reader, terms(2 - modulo(i, 2))%position, 'node '// &
            to_text(model%mesh%node_id(node))//' belongs to an obstacle or to facets: links '// &
            'cannot join it')
          return
        end if
        if (.not. model%used(node)) model%joined(node) = .true.
      end associate
    end do
    if (.not. allocated(equations%links)) allocate (equations%links(2, 0), &
      equations%link_position(0))
    equations%links = reshape([equations%links, pairs], [2, size(equations%links, 2) + &
      size(pairs, 2)])
    equations%link_position = [equations%link_position, spread(terms(1)%position, 1, &
      size(pairs, 2))]
  end subroutine match_links

  !> A card: a line with a number of terms, then these, again and again.
  subroutine read_card(reader, card, model, equations, work)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(model_t), intent(inout) :: model
    type(equation_list_t), intent(inout) :: equations
    integer(i8), intent(inout) :: work !! terms so far
    type(fields_t) :: fields
    type(term_t), allocatable :: terms(:)
    integer :: n, position
    logical :: found, ok, is_first

    is_first = .true.
    do
      call next_data_line(reader, card, fields, found, 1, 'the number of terms of an equation')
      if (.not. found) exit
      is_first = .false.
      position = fields%start
      call integer_field(reader, fields, 1, 'the number of terms', 2, n, ok)
      if (.not. ok) return ! where the next equation begins is not known
      if (n > most_terms) then
        call report(reader, position, 'an equation has at most '//to_text(most_terms)//' terms')
        return
      end if
      call read_terms(reader, card, model, n, position, fields, terms, ok)
      if (.not. allocated(terms)) return
      if (.not. ok) cycle
      call match_terms(reader, model, terms, equations, work)
      if (work > max_work) then
        call report(reader, position, 'the equations of the deck have too many terms')
        return
      end if
    end do
    if (is_first) call report(reader, card%position, '*EQUATION needs data lines: the number '// &
      'of terms, then node, dof, coefficient of each')
  end subroutine read_card

  !> The terms of an equation, up to four a line.
  subroutine read_terms(reader, card, model, n, position, fields, terms, ok)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(model_t), intent(in) :: model
    integer, intent(in) :: n, position
    type(fields_t), intent(inout) :: fields
    type(term_t), allocatable, intent(out) :: terms(:) !! not allocated: they are not all there
    logical, intent(out) :: ok                         !! false: a mistake was reported
    type(term_t), allocatable :: room(:)
    integer :: done, i
    logical :: found, term_ok

    allocate (room(n))
    ok = .true.
    done = 0
    do while (done < n)
      call next_data_line(reader, card, fields, found, 3*on_a_line, &
        'up to four terms: node or set, dof, coefficient')
      if (.not. found) then
        if (keep_reading(reader)) call report(reader, position, 'an equation of '// &
          to_text(n)//' terms has '//to_text(done)//': node or set, dof, coefficient of each')
        return
      end if
      do i = 1, on_a_line
        if (i > 1 .and. is_rest_empty(fields, 3*i - 2)) exit
        if (done == n) then
          call report(reader, field_position(reader, fields, 3*i - 2), 'unexpected '// &
            quoted(field_text(reader, fields, 3*i - 2))//': the equation has '//to_text(n)// &
            ' terms')
          return
        end if
        done = done + 1
        call read_term(reader, model, fields, 3*i - 2, room(done), term_ok)
        ok = ok .and. term_ok
      end do
    end do
    call move_alloc(room, terms)
  end subroutine read_terms

  pure logical function is_rest_empty(fields, first)
    type(fields_t), intent(in) :: fields
    integer, intent(in) :: first
    integer :: i

    is_rest_empty = all([(is_empty_field(fields, i), i=first, fields%n)])
  end function is_rest_empty

  !> A term, from field `i` on.
  subroutine read_term(reader, model, fields, i, term, ok)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(fields_t), intent(in) :: fields
    integer, intent(in) :: i
    type(term_t), intent(out) :: term
    logical, intent(out) :: ok
    type(reference_t) :: reference
    logical :: each(3)
    integer, allocatable :: order(:)
    integer :: k, before

    allocate (term%nodes(0))
    call reference_field(reader, fields, i, 'a node or a set of nodes', reference, each(1))
    call integer_field(reader, fields, i + 1, 'the dof', 1, term%dof, each(2))
    call real_field(reader, fields, i + 2, 'the coefficient', term%coefficient, each(3))
    term%position = reference%position
    ok = all(each)
    if (.not. each(1)) return
    before = reader%diagnostics%n_mistakes
    call referenced_nodes(reader, model, reference, term%nodes)
    if (size(term%nodes) == 0) then
      ok = .false.
      if (reader%diagnostics%n_mistakes == before) call report(reader, reference%position, &
        'node set '//quoted(reference%name)//' has no nodes for an equation')
    end if
    if (.not. ok) return
    ! One of a plane stands for those beside it.
    term%nodes = nodes_of_plane(model%mesh, term%nodes)
    if (model%mesh%plane /= solids .and. (term%dof == 3 .or. term%dof == 4 .or. term%dof == 5)) then
      call report_in_field(reader, field_position(reader, fields, i + 1), 'with elements of a '// &
        'plane the dof must be 1 or 2 (6 on reference nodes of couplings), not '// &
        quoted(field_text(reader, fields, i + 1)))
      ok = .false.
      return
    end if
    ! Those that hang go with others.
    if (allocated(model%mesh%hangs)) term%nodes = pack(term%nodes, .not. &
      model%mesh%hangs(term%nodes))
    if (any(model%turned(term%nodes) > 0)) then
      ! Those of rotations: dofs 1 to 3 are dofs 4 to 6 of the reference nodes.
      if (term%dof > 3 .or. any(model%turned(term%nodes) == 0)) then
        call report(reader, reference%position, 'the ROT NODE of a rigid body has dofs 1 to 3, '// &
          'and stands alone in a term')
        ok = .false.
        return
      end if
      term%nodes = model%turned(term%nodes)
      term%dof = term%dof + 3
    end if
    ! By their numbers in the deck: it may define nodes in any order.
    call order_of(model%mesh%node_id(term%nodes), order)
    term%nodes = term%nodes(order)
    do k = 1, size(term%nodes)
      associate (node => term%nodes(k))
        if (model%reference(node)) then
          call report(reader, reference%position, 'node '//to_text(model%mesh%node_id(node))// &
            ' is the reference node of an obstacle, which equations cannot join')
          ok = .false.
        else if (model%rigid(node) .and. .not. model%used(node)) then
          call report(reader, reference%position, 'node '//to_text(model%mesh%node_id(node))// &
            ' belongs to facets, not to solid elements: equations cannot join it')
          ok = .false.
        else if (term%dof > 3) then
          ok = term%dof <= 6 .and. model%rotation_node(node) > 0
          if (.not. ok) call report_in_field(reader, field_position(reader, fields, i + 1), &
            'the dof must be 1, 2 or 3 (4 to 6 on reference nodes of couplings), not '// &
            quoted(field_text(reader, fields, i + 1)))
        end if
      end associate
      if (.not. ok) return
    end do
  end subroutine read_term

  !> The equations that a list of terms means: one, or one for each node of its sets, in ascending
  !> order; a single node stands in each.
  subroutine match_terms(reader, model, terms, equations, work)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(inout) :: model
    type(term_t), intent(in) :: terms(:)
    type(equation_list_t), intent(inout) :: equations
    integer(i8), intent(inout) :: work
    integer :: node(size(terms)), dof(size(terms)), i, k, n

    if (.not. abs(terms(1)%coefficient) > 0.0_wp) then
      call report(reader, terms(1)%position, 'the coefficient of the first term is 0: that is '// &
        'what depends on the others')
      return
    end if
    n = size(terms(1)%nodes)
    do i = 2, size(terms)
      if (size(terms(i)%nodes) == n .or. size(terms(i)%nodes) == 1) cycle
      call report(reader, terms(i)%position, 'this set has '//to_text(size(terms(i)%nodes))// &
        ' nodes and the first term '//to_text(n)//': sets of an equation go together node by node')
      return
    end do
    work = work + int(n, i8)*size(terms)
    if (work > max_work) return
    do k = 1, n
      do i = 1, size(terms)
        node(i) = terms(i)%nodes(min(k, size(terms(i)%nodes)))
        dof(i) = terms(i)%dof
        if (.not. model%used(node(i))) model%joined(node(i)) = .true.
        if (dof(i) <= 3) cycle
        node(i) = model%rotation_node(node(i))
        dof(i) = dof(i) - 3
      end do
      i = twice(node, dof)
      if (i > 0) then
        call report(reader, terms(i)%position, 'dof '//to_text(terms(i)%dof)//' of node '// &
          to_text(model%mesh%node_id(terms(i)%nodes(min(k, size(terms(i)%nodes)))))// &
          ' occurs twice in the equation')
        return
      end if
      call add_equation(equations, terms(1)%position, node, dof, &
        -terms(2:)%coefficient/terms(1)%coefficient)
    end do
  end subroutine match_terms

  !> A term that names what an earlier one does; 0: none.
  pure integer function twice(node, dof)
    integer, intent(in) :: node(:), dof(:)

    do twice = 2, size(node)
      if (any(node(:twice - 1) == node(twice) .and. dof(:twice - 1) == dof(twice))) return
    end do
    twice = 0
  end function twice

end module read_equations_mod
