!> Tied surfaces: the nodes of a slave surface are moved onto the faces of its master, and depend on
!> them from then on.
!>
!>     u_slave = sum of weight times u_master,   the weights of docs/theory.md (11.2)
!>
!> Weights give a place on the master only where the node is there: elsewhere bodies that turn would
!> be strained. So what is to stay off its master (ADJUST=NO) is at the end of an arm that turns
!> with the master's nodes, (11.33); elsewhere it is refused.
module ties_mod
  use inverted_elements_mod, only: first_inverted
  use cards_mod, only: keep_reading, note, reader_t, report
  use contact_points_mod, only: weights_t
  use constraints_mod, only: constraints_t, add_constraint, constraint_on_cycle, constraint_of
  use diagnostics_mod, only: quoted
  use kinds_mod, only: wp
  use loads_mod, only: load_step_t
  use local_refinement_mod, only: hanging_of
  use cells_mod, only: face_corners
  use connectivity_mod, only: corners_in
  use mesh_mod, only: deck_rounding, solids
  use surface_reach_mod, only: reach_of_faces, face_each_other
  use mortar_rows_mod, only: mortar_t, slave_t
  use tied_rows_mod, only: take_up_shifts
  use mortar_mod, only: make_mortar
  use own_weights_mod, only: solve_for_own
  use refine_locally_mod, only: place_hanging
  use scene_mod, only: contact_pair_t
  use sets_mod, only: model_t
  use small_matrix_mod, only: determinant, inverse
  use surfaces_mod, only: surface_t, all_nodes_of, nodes_of
  use text_mod, only: counted, to_text
  implicit none
  private

  public :: tie_t, check_tie, move_tied_nodes, make_constraints, refuse_tied_pairs, note_held

  !> A *TIE.
  type :: tie_t
    character(:), allocatable :: name
    integer :: slave = 0, master = 0   !! surfaces
    logical :: adjust = .true.         !! slave nodes may be moved
    real(wp) :: tolerance = -1.0_wp
    !! how far, at most; < 0: a fraction of the edges of the master's faces [length]
    integer :: position = 0            !! in the deck
  end type tie_t

  real(wp), parameter :: near = 0.025_wp !! of the mean edge of the master: moved if nothing is said
  real(wp), parameter :: on = 1.0e-9_wp  !! of that edge: a node so far away is on its master
  real(wp), parameter :: nothing = 1.0e-14_wp !! weights below it are rounding [-]
  integer, parameter :: most_rounds = 60

contains

  !> Report surfaces that share a node, or are turned away from each other.
  subroutine check_tie(reader, model, surfaces, tie, ok)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(surface_t), intent(in) :: surfaces(:)
    type(tie_t), intent(in) :: tie
    logical, intent(out) :: ok
    integer, allocatable :: slave(:, :), master(:, :)
    logical :: is_slave(model%mesh%n_nodes)
    integer :: i

    associate (one => surfaces(tie%slave), other => surfaces(tie%master))
      is_slave = .false.
      is_slave(one%nodes) = .true.
      ok = .not. any(is_slave(other%nodes))
      if (.not. ok) then
        i = findloc(is_slave(other%nodes), .true., dim=1)
        call report(reader, tie%position, quoted(one%name)//' and '//quoted(other%name)// &
          ' share node '//to_text(model%mesh%node_id(other%nodes(i)))// &
          ': the surfaces of a tie must have nodes of their own')
        return
      end if
      allocate (slave, source=all_nodes_of(one%faces, model%mesh%connectivity))
      allocate (master, source=all_nodes_of(other%faces, model%mesh%connectivity))
      ok = face_each_other(slave, master, model%mesh%coordinates(:, :model%mesh%n_nodes))
      if (.not. ok) call report(reader, tie%position, 'no face of '//quoted(other%name)// &
        ' is turned towards one of '//quoted(one%name)//': these sides cannot be tied')
    end associate
  end subroutine check_tie

  !> Move the slave nodes of all ties onto their masters, and say how many and how far.
  !>
  !> What they face changes as they move, and may itself be tied; nodes that hang go with those that
  !> they lie between: round after round until nothing moves any more.
  subroutine move_tied_nodes(reader, model, surfaces, ties)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(inout) :: model      !! its nodes are moved
    type(surface_t), intent(in) :: surfaces(:)
    type(tie_t), intent(in) :: ties(:)
    real(wp), allocatable :: before(:, :)
    type(mortar_t) :: mortar
    logical, allocatable :: tied(:)
    integer :: mover(model%mesh%n_nodes)
    real(wp) :: farthest, far, moved, last, rounding
    integer :: t, i, n, round, node

    if (size(ties) == 0) return
    mover = 0
    last = huge(last)
    associate (x => model%mesh%coordinates)
      allocate (before(3, model%mesh%n_nodes), source=x(:, :model%mesh%n_nodes))
      rounding = 8.0_wp*epsilon(1.0_wp)*maxval(abs(before))
      do round = 1, most_rounds
        farthest = 0.0_wp
        do t = 1, size(ties)
          if (.not. ties(t)%adjust) cycle
          associate (slaves => surfaces(ties(t)%slave)%nodes)
            call face_master(model, surfaces, ties(t), mortar, tied)
            far = tolerance_of(model, surfaces, ties(t))
            do i = 1, size(slaves)
              node = slaves(i)
              if (.not. tied(i) .or. norm2(mortar%apart(:, i)) <= rounding) cycle
              moved = norm2(x(:, node) - mortar%apart(:, i) - before(:, node))
              if (moved > far) then
                call report(reader, ties(t)%position, 'tie '//quoted(ties(t)%name)//': node '// &
                  to_text(model%mesh%node_id(node))//' is '//to_text(moved, 3)// &
                  ' from its master, more than '//to_text(far, 3)// &
                  ': mesh both surfaces closer to each other, or allow it by POSITION TOLERANCE=')
                return
              end if
              farthest = max(farthest, norm2(mortar%apart(:, i)))
              x(:, node) = x(:, node) - mortar%apart(:, i)
              mover(node) = t
            end do
          end associate
        end do
        call place_hanging(model%mesh)
        if (farthest <= rounding) exit
        if (round > 5 .and. farthest > 0.9_wp*last .and. farthest < 1.0e-12_wp* &
          maxval(abs(before))) exit
        last = farthest
      end do
      do t = 1, size(ties)
        n = 0
        moved = 0.0_wp
        do node = 1, model%mesh%n_nodes
          if (mover(node) /= t) cycle
          associate (way => norm2(x(:, node) - before(:, node)))
            if (way <= 1.0e-12_wp*maxval(abs(before))) cycle
            n = n + 1
            moved = max(moved, way)
          end associate
        end do
        if (n > 0) call note(reader, 'tie '//ties(t)%name//' moved '//to_text(n)// &
          ' of its slave nodes, by '//to_text(moved, 3)//' at most')
      end do
    end associate
    call check_elements(reader, model, ties, mover)
  end subroutine move_tied_nodes

  !> Report an element that the moved nodes turned inside out, one of each tie.
  subroutine check_elements(reader, model, ties, mover)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(tie_t), intent(in) :: ties(:)
    integer, intent(in) :: mover(:) !! (n_nodes) the tie that moved the node
    integer :: inverted(size(ties)), t

    inverted = first_inverted(model%mesh%coordinates, model%mesh%connectivity, &
      model%mesh%n_elements, mover, size(ties))
    do t = 1, size(ties)
      if (inverted(t) > 0 .and. keep_reading(reader)) call report(reader, ties(t)%position, &
        'tie '//quoted(ties(t)%name)//' turns element '//to_text(model%mesh%element_id( &
        inverted(t)))//' inside out: mesh its surfaces closer to each other')
    end do
  end subroutine check_elements

  !> The constraints of all ties, where all nodes are at last.
  subroutine make_constraints(reader, model, surfaces, ties, constraints)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(surface_t), intent(in) :: surfaces(:)
    type(tie_t), intent(in) :: ties(:)
    type(constraints_t), intent(inout) :: constraints !! gets them, behind what there is
    type(mortar_t) :: mortar
    logical, allocatable :: tied(:)
    real(wp) :: off, given, longest
    integer :: tie_of(model%mesh%n_nodes), t, i, n, node, c, n_arms
    logical :: is_held

    given = 16.0_wp*deck_rounding(model%mesh%coordinates(:, :model%mesh%n_nodes), &
      model%mesh%origin)
    tie_of = 0
    do t = 1, size(ties)
      associate (slaves => surfaces(ties(t)%slave)%nodes, at => ties(t)%position, &
                 name => 'tie '//quoted(ties(t)%name), id => model%mesh%node_id)
        call face_master(model, surfaces, ties(t), mortar, tied)
        if (.not. any(tied)) then
          call report(reader, at, name//': no node of '//quoted(surfaces(ties(t)%slave)%name)// &
            ' lies on '//quoted(surfaces(ties(t)%master)%name))
          cycle
        end if
        off = max(on*edge_of(model, surfaces(ties(t)%master)), given)
        n_arms = 0
        longest = 0.0_wp
        do i = 1, size(slaves)
          node = slaves(i)
          if (.not. tied(i)) cycle
          if (tie_of(node) > 0) then
            call report(reader, at, name//': node '//to_text(id(node))//' is tied already, by '// &
              quoted(ties(tie_of(node))%name)//': a node can be a slave in one tie only')
            exit
          end if
          tie_of(node) = t
          if (norm2(mortar%apart(:, i)) > off) then
            if (ties(t)%adjust) then
              call report(reader, at, name//': node '//to_text(id(node))//' is '// &
                to_text(norm2(mortar%apart(:, i)), 3)//' off its master after all nodes were '// &
                'moved: does ADJUST of a *CONTACT PAIR move it, or another tie?')
              exit
            end if
            call tie_by_arm(model, node, mortar, i, constraints, is_held)
            if (is_held) then
              n_arms = n_arms + 1
              longest = max(longest, norm2(mortar%apart(:, i)))
              cycle
            end if
            call report(reader, at, name//': ADJUST=NO leaves node '//to_text(id(node))//' '// &
              to_text(norm2(mortar%apart(:, i)), 3)//' off its master, where a tie would '// &
              'strain bodies that turn: it must be moved onto it (ADJUST=YES)')
            exit
          end if
          associate (first => mortar%weights%first(i), last => mortar%weights%first(i + 1) - 1)
            call tie_node(node, mortar%weights%node(first:last), &
              mortar%weights%weight(first:last), constraints)
          end associate
        end do
        if (n_arms > 0) call note(reader, 'tie '//ties(t)%name//': '//counted(n_arms, 'node')// &
          ' off the master by up to '//to_text(longest, 3)//' (ADJUST=NO) turn with its faces')
        if (allocated(model%mesh%hangs)) tied = tied .or. model%mesh%hangs(slaves)
        n = count(.not. tied)
        if (n > 0) then
          i = findloc(tied, .false., dim=1)
          call note(reader, 'tie '//ties(t)%name//': '//to_text(n)//' of '//to_text(size(tied))// &
            ' slave nodes are not tied, as the master does not cover them (the first: node '// &
            to_text(id(slaves(i)))//')')
        end if
      end associate
    end do
    c = constraint_on_cycle(constraints, model%mesh%n_nodes)
    if (c > 0) then
      node = constraints%node(c)
      call report(reader, ties(tie_of(node))%position, 'tie '// &
        quoted(ties(tie_of(node))%name)//': node '//to_text(model%mesh%node_id(node))// &
        ' depends on itself, as its master is tied to it: which side is the slave?')
    end if
  end subroutine make_constraints

  !> The constraints of a node, without weights that are rounding: the largest takes these.
  pure subroutine tie_node(node, masters, weights, constraints)
    integer, intent(in) :: node
    integer, intent(in) :: masters(:)   !! (m) each once
    real(wp), intent(in) :: weights(:)  !! (m) [-]
    type(constraints_t), intent(inout) :: constraints
    real(wp) :: weight(size(weights))
    integer, allocatable :: kept(:)
    integer :: i, largest

    weight = weights
    largest = maxloc(abs(weight), dim=1)
    weight(largest) = weight(largest) + sum(weight, mask=abs(weight) <= nothing)
    kept = pack([(i, i=1, size(weight))], abs(weight) > nothing)
    do i = 1, 3
      call add_constraint(constraints, node, i, masters(kept), spread(i, 1, size(kept)), &
        weight(kept))
    end do
  end subroutine tie_node

  !> The constraints of a node off its master, docs/theory.md (11.33): the arm to it turns with the
  !> masters, by the rotation that fits their displacements best. Rigid motions strain nothing.
  pure subroutine tie_by_arm(model, node, mortar, i, constraints, is_held)
    type(model_t), intent(in) :: model
    integer, intent(in) :: node
    type(mortar_t), intent(in) :: mortar
    integer, intent(in) :: i             !! its row
    type(constraints_t), intent(inout) :: constraints
    logical, intent(out) :: is_held
    !! false in a plane, and where masters in a line do not say how they turn
    real(wp), parameter :: least = 1.0e-6_wp !! of the moments of a ball [-]
    real(wp) :: moment(3, 3)
    real(wp), allocatable :: r(:, :), weight(:, :, :)
    integer, allocatable :: master(:)
    integer :: k, d

    master = mortar%weights%node(mortar%weights%first(i):mortar%weights%first(i + 1) - 1)
    r = model%mesh%coordinates(:, master)
    r = r - spread(sum(r, dim=2)/size(master), 2, size(master))
    moment = -matmul(r, transpose(r))
    do d = 1, 3
      moment(d, d) = moment(d, d) + sum(r**2)
    end do
    is_held = model%mesh%plane == solids .and. determinant(moment) > least*sum(r**2)**3
    if (.not. is_held) return
    allocate (weight(3, 3, size(master)))
    do k = 1, size(master)
      weight(:, :, k) = -matmul(cross_with(mortar%apart(:, i)), matmul(inverse(moment), &
        cross_with(r(:, k))))
      do d = 1, 3
        weight(d, d, k) = weight(d, d, k) + mortar%weights%weight(mortar%weights%first(i) + k - 1)
      end do
    end do
    do d = 1, 3
      associate (row => [(weight(d, :, k), k=1, size(master))])
        associate (kept => pack([(k, k=1, size(row))], abs(row) > nothing))
          call add_constraint(constraints, node, d, master((kept + 2)/3), modulo(kept - 1, 3) + 1, &
            row(kept))
        end associate
      end associate
    end do

  contains

    !> The matrix of a vector product, a x b = A b.
    pure function cross_with(a)
      real(wp), intent(in) :: a(3)
      real(wp) :: cross_with(3, 3)

      cross_with = reshape([0.0_wp, a(3), -a(2), -a(3), 0.0_wp, a(1), a(2), -a(1), 0.0_wp], [3, 3])
    end function cross_with

  end subroutine tie_by_arm

  !> What the slave nodes of a tie face, and which of them the master covers.
  subroutine face_master(model, surfaces, tie, mortar, tied)
    type(model_t), intent(in) :: model
    type(surface_t), intent(in) :: surfaces(:)
    type(tie_t), intent(in) :: tie
    type(mortar_t), intent(out) :: mortar
    logical, allocatable, intent(out) :: tied(:)
    type(slave_t) :: slave
    integer, allocatable :: master(:, :)
    integer :: i

    slave = slave_t(all_nodes_of(surfaces(tie%slave)%faces, model%mesh%connectivity), &
      surfaces(tie%slave)%nodes, hanging_of(model%mesh%hangs, model%mesh%between, &
      model%mesh%n_given, surfaces(tie%slave)%nodes))
    allocate (master, source=all_nodes_of(surfaces(tie%master)%faces, model%mesh%connectivity))
    associate (x => model%mesh%coordinates(:, :model%mesh%n_nodes))
      call make_mortar(slave, master, x, max(tolerance_of(model, surfaces, tie), &
        reach_of_faces(slave%faces, master, x)), mortar, is_tie=.true.)
      allocate (tied(size(mortar%area)))
      tied = mortar%area > mortar%least*mortar%whole_area
      if (size(slave%hanging, 2) > 0) then
        call solve_for_own(slave%nodes, tied, slave%hanging, model%mesh%n_nodes, mortar%weights)
        do i = 1, size(tied)
          if (tied(i)) mortar%apart(:, i) = x(:, slave%nodes(i)) - place_of_row(mortar%weights, &
            i, x)
        end do
      end if
      call take_up_shifts(slave%nodes, x, mortar)
    end associate
  end subroutine face_master

  !> The place that the weights of a row give.
  pure function place_of_row(weights, i, x) result(place)
    type(weights_t), intent(in) :: weights
    integer, intent(in) :: i
    real(wp), intent(in) :: x(:, :) !! (3,n_nodes) [length]
    real(wp) :: place(3)            !! [length]
    integer :: k

    place = 0.0_wp
    do k = weights%first(i), weights%first(i + 1) - 1
      place = place + weights%weight(k)*x(:, weights%node(k))
    end do
  end function place_of_row

  !> How far the nodes of a tie may be moved.
  pure real(wp) function tolerance_of(model, surfaces, tie) result(far)
    type(model_t), intent(in) :: model
    type(surface_t), intent(in) :: surfaces(:)
    type(tie_t), intent(in) :: tie

    far = tie%tolerance
    if (far < 0.0_wp) far = near*edge_of(model, surfaces(tie%master))
  end function tolerance_of

  !> The mean edge of the faces of a surface.
  pure real(wp) function edge_of(model, surface) result(mean)
    type(model_t), intent(in) :: model
    type(surface_t), intent(in) :: surface
    integer :: nodes(face_corners, size(surface%faces, 2)), f, k

    nodes = nodes_of(surface%faces, model%mesh%connectivity)
    mean = 0.0_wp
    do f = 1, size(nodes, 2)
      do k = 1, corners_in(nodes(:, f))
        mean = mean + norm2(model%mesh%coordinates(:, nodes(k, f)) - &
          model%mesh%coordinates(:, nodes(mod(k, corners_in(nodes(:, f))) + 1, f)))
      end do
    end do
    mean = mean/real(count(nodes > 0), wp)
  end function edge_of

  !> Report ties whose faces face each other in a contact pair as well: nothing moves there.
  subroutine refuse_tied_pairs(reader, surfaces, ties, pairs)
    type(reader_t), intent(inout) :: reader
    type(surface_t), intent(in) :: surfaces(:)
    type(tie_t), intent(in) :: ties(:)
    type(contact_pair_t), intent(in) :: pairs(:)
    integer :: t, p

    do t = 1, size(ties)
      do p = 1, size(pairs)
        if (pairs(p)%master_surface == 0) cycle
        associate (slave => surfaces(ties(t)%slave), master => surfaces(ties(t)%master), &
                   one => surfaces(pairs(p)%surface), other => surfaces(pairs(p)%master_surface))
          if (.not. (meet(slave, one) .and. meet(master, other) .or. meet(slave, other) .and. &
            meet(master, one))) cycle
        end associate
        call report(reader, ties(t)%position, 'tie '//quoted(ties(t)%name)//' and contact pair '// &
          quoted(pairs(p)%name)//' join the same faces: what is tied cannot touch')
      end do
    end do
  end subroutine refuse_tied_pairs

  !> Whether two surfaces have a face in common.
  pure logical function meet(one, other)
    type(surface_t), intent(in) :: one, other
    integer :: f, g

    meet = .true.
    do f = 1, size(one%faces, 2)
      do g = 1, size(other%faces, 2)
        if (all(one%faces(:, f) == other%faces(:, g))) return
      end do
    end do
    meet = .false.
  end function meet

  !> Note that supports hold tied nodes, which leaves the tie along their axes.
  subroutine note_held(reader, constraints, n_nodes, hangs, steps)
    type(reader_t), intent(inout) :: reader
    type(constraints_t), intent(in) :: constraints
    integer, intent(in) :: n_nodes
    logical, allocatable, intent(in) :: hangs(:) !! (n_nodes) they are not tied; not allocated: none
    type(load_step_t), intent(in) :: steps(:)
    integer :: number(3, n_nodes), step, i
    logical :: held(3, n_nodes)

    if (constraints%n == 0) return
    number = constraint_of(constraints, n_nodes)
    where (number > constraints%n - constraints%n_equations) number = 0
    if (allocated(hangs)) then
      where (spread(hangs, 1, 3)) number(:, :size(hangs)) = 0
    end if
    held = .false.
    do step = 1, size(steps)
      if (.not. allocated(steps(step)%boundary)) cycle
      do i = 1, size(steps(step)%boundary)
        associate (b => steps(step)%boundary(i))
          held(b%dof, b%node) = number(b%dof, b%node) > 0
        end associate
      end do
    end do
    if (any(held)) call note(reader, 'supports hold '//to_text(count(held))// &
      ' degrees of freedom of tied slave nodes: along these the tie does not hold')
  end subroutine note_held

end module ties_mod
