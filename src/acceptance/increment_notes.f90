!> What a run has to say of an increment beside its line: notes, made here and printed elsewhere.
module increment_notes_mod
  use kinds_mod, only: wp, i8
  use text_mod, only: to_text, percent, counted
  use scene_mod, only: scene_t, master_name
  use spring_elements_mod, only: past_table, spring_state, spring_state_t
  use contact_points_mod, only: contact_points_t
  use state_mod, only: state_t
  use increments_mod, only: increment_t, increment_name, count_increments, whole_increment, &
    duration_of
  use increment_report_mod, only: increment_report_t, energy_t, count_redundant
  use kinks_mod, only: has_too_many
  use turns_mod, only: largest_turn, most_turn
  use placement_mod, only: is_before_flat
  use nodes_behind_mod, only: node_behind_t
  use bodies_inside_mod, only: inside_t
  use faces_between_nodes_mod, only: face_entry_t
  use opposed_reactions_mod, only: opposed_t, find_opposed_reactions
  use follow_points_mod, only: rounding_of_places
  use contact_resolution_mod, only: small_contact_t, find_small_contacts
  use own_mass_mod, only: own_mass_t, inertia_off
  use stability_mod, only: stability_t
  use shadow_run_mod, only: is_unstable, may_be_unstable
  use load_cycles_mod, only: load_cycles_t
  use settled_cycles_mod, only: followed_cycle_t
  use law_limits_mod, only: stretched_t
  use yielded_bodies_mod, only: yielded_t
  use sector_slips_mod, only: past_side_t
  use refuse_contact_mod, only: inside_in_words, nodes_in_words
  use refuse_shapes_mod, only: stretches_in_words, neo_hooke_in_words
  use refuse_unstable_mod, only: unstable_in_words
  implicit none
  private

  public :: note_t, note_unsolved, note_started, note_widened, note_unheld, note_entries, &
    note_unfelt, note_apart, note_node_behind, note_inside, note_passed, note_small_contacts, &
    note_kinks, note_touch, note_turn, note_double, note_redundant, note_opposed_reactions, &
    note_unusual, note_unstable, note_hourglass, note_coincident, note_unknown_stability, &
    note_lost_shadow, note_followed, note_settled, note_yielded, note_past_side, note_grown, &
    note_energy, note_turning, note_too_long, note_jump, note_past_table, note_slow, &
    note_given

  !> A line for the console.
  type :: note_t
    character(:), allocatable :: text
    logical :: even_if_quiet = .true.
  end type note_t

contains

  !> Add a note on a *STEP, or on one of its increments.
  pure subroutine add_note(notes, increment, of_increment, text, even_if_quiet)
    type(note_t), allocatable, intent(inout) :: notes(:)
    type(increment_t), intent(in) :: increment
    logical, intent(in) :: of_increment !! else of its *STEP
    character(*), intent(in) :: text
    logical, intent(in), optional :: even_if_quiet
    type(note_t) :: note

    note%text = 'note: step '//to_text(increment%step)
    if (of_increment) note%text = 'note: '//increment_name(increment)
    note%text = note%text//text
    if (present(even_if_quiet)) note%even_if_quiet = even_if_quiet
    notes = [notes, note]
  end subroutine add_note

  !> What slides past the side of a sector meets nothing there.
  pure subroutine note_past_side(scene, points, increment, past, notes)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(increment_t), intent(in) :: increment
    type(past_side_t), intent(in) :: past
    type(note_t), allocatable, intent(inout) :: notes(:)
    real(wp), parameter :: little = 1.0e-3_wp !! of a sector: what is not worth a word [-]

    if (past%share <= little) return
    call add_note(notes, increment, .false., ': node '//to_text(scene%mesh%node_id(points%node( &
      past%point)))//' of '//scene%pairs(points%pair(past%point))%name//' is past the side of '// &
      'its sector by '//percent(past%share)//' of the sector''s angle: it meets nothing there, '// &
      'and the forces of this pair are wrong by about as much; more of the body, or all of it, '// &
      'has no such sides')
  end subroutine note_past_side

  !> Springs past the ends of their tables have forces that do not grow: the one that is farthest.
  pure subroutine note_past_table(scene, increment, u, notes)
    type(scene_t), intent(in) :: scene
    type(increment_t), intent(in) :: increment
    real(wp), intent(in) :: u(:, :) !! (3,n_nodes) at the end of the increment [length]
    type(note_t), allocatable, intent(inout) :: notes(:)
    type(spring_state_t) :: state, farthest
    real(wp) :: past, most
    integer :: s, n, worst

    n = 0
    most = 0.0_wp
    worst = 0
    associate (springs => scene%mesh%springs)
      if (.not. allocated(springs%tables)) return
      do s = 1, springs%n
        state = spring_state(springs, s, scene%mesh%coordinates, u, scene%finite_strain)
        past = past_table(springs, s, state%elongation)
        if (past > 0.0_wp) n = n + 1
        if (past <= most) cycle
        most = past
        worst = s
        farthest = state
      end do
      if (worst == 0) return
      call add_note(notes, increment, .false., ': '//counted(n, 'spring')//' past the end of '// &
        'the table, where forces do not grow; the farthest is element '// &
        to_text(springs%id(worst))//', by '//to_text(most, 3)//', at an elongation of '// &
        to_text(farthest%elongation, 3)//' with a force of '//to_text(farthest%pull, 3))
    end associate
  end subroutine note_past_table

  !> How much of each body that could yield is above its first yield stress.
  pure subroutine note_yielded(scene, increment, yielded, notes)
    type(scene_t), intent(in) :: scene
    type(increment_t), intent(in) :: increment
    type(yielded_t), intent(in) :: yielded(:)
    type(note_t), allocatable, intent(inout) :: notes(:)
    character(:), allocatable :: words
    integer :: i

    words = ''
    do i = 1, size(yielded)
      associate (it => yielded(i), mesh => scene%mesh)
        associate (material => scene%materials(mesh%material(it%element)))
          words = ': body '//to_text(it%body)//' (of node '//to_text(mesh%node_id(findloc( &
            mesh%body, it%body, dim=1)))//') '
          if (it%largest > 1.0_wp) then
            words = words//'is above its first yield stress in '//percent(it%share)// &
              ' of its volume: von Mises'' stress gets to '
          else
            words = words//'does not yield: von Mises'' stress gets to '
          end if
          words = words//to_text(it%largest, 3)//' times that of '//material%name//' ('// &
            to_text(material%yield, 4)//'), in element '//to_text(mesh%element_id(it%element))
          call add_note(notes, increment, .false., words)
        end associate
      end associate
    end do
  end subroutine note_yielded

  !> An increment that was not solved is cut; where it ended as contact begins, it is made to end
  !> later.
  pure subroutine note_unsolved(increment, is_passed, notes)
    type(increment_t), intent(in) :: increment
    logical, intent(in) :: is_passed !! the beginning of contact is
    type(note_t), allocatable, intent(inout) :: notes(:)
    character(:), allocatable :: words

    words = ') did not converge: retrying with half the increment'
    if (is_passed) words = ', at first contact) did not converge: retrying with a later end'
    call add_note(notes, increment, .true., ' (to time '//to_text(increment%time)//words)
  end subroutine note_unsolved

  !> An increment that the deck keeps whole is solved from where its parts led.
  pure subroutine note_started(increment, notes)
    type(increment_t), intent(in) :: increment
    type(note_t), allocatable, intent(inout) :: notes(:)

    call add_note(notes, increment, .true., ' (to time '//to_text(increment%time)// &
      ') is large for its contact: it was solved only from where smaller increments led')
  end subroutine note_started

  !> A node of a slave body is behind an obstacle, which it does not touch for it is in no slave
  !> surface.
  pure subroutine note_node_behind(scene, increment, behind, notes)
    type(scene_t), intent(in) :: scene
    type(increment_t), intent(in) :: increment
    type(node_behind_t), intent(in) :: behind
    type(note_t), allocatable, intent(inout) :: notes(:)

    if (behind%node == 0) return
    associate (pair => scene%pairs(behind%pair))
      call add_note(notes, increment, .false., ': node '//to_text(scene%mesh%node_id( &
        behind%node))//' of the body is '//to_text(behind%depth, 3)//' inside '// &
        master_name(scene, behind%pair)//' without contact, for it is not in '// &
        scene%surfaces(pair%surface)%name)
    end associate
  end subroutine note_node_behind

  !> A body is inside another that it has no contact with.
  pure subroutine note_inside(scene, increment, inside, notes, since)
    type(scene_t), intent(in) :: scene
    type(increment_t), intent(in) :: increment
    type(inside_t), intent(in) :: inside
    type(note_t), allocatable, intent(inout) :: notes(:)
    character(*), intent(in), optional :: since !! when; left out: this increment
    character(:), allocatable :: words

    words = inside_in_words(scene, inside)
    if (present(since)) words = words//since
    call add_note(notes, increment, .false., ': '//words)
  end subroutine note_inside

  !> An increment is cut in which an obstacle would pass a point, or a face.
  pure subroutine note_passed(scene, points, increment, point, entry, notes)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(increment_t), intent(in) :: increment
    integer, intent(in) :: point            !! 0: a face
    type(face_entry_t), intent(in) :: entry !! of the face
    type(note_t), allocatable, intent(inout) :: notes(:)
    character(:), allocatable :: what, how
    integer :: pair

    if (point > 0) then
      pair = points%pair(point)
      what = 'press node '//to_text(scene%mesh%node_id(points%node(point)))
      how = 'from behind'
    else
      pair = entry%pair
      what = 'pass the face of '//nodes_in_words(scene, entry%nodes)
      how = 'without contact'
    end if
    call add_note(notes, increment, .true., ' (to time '//to_text(increment%time)//'): '// &
      master_name(scene, pair)//' would '//what//' of '// &
      scene%surfaces(scene%pairs(pair)%surface)%name//' '//how//': retrying with half the '// &
      'increment')
  end subroutine note_passed

  !> A single factor that was chosen to save time does not hold the scene.
  pure subroutine note_double(increment, notes)
    type(increment_t), intent(in) :: increment
    type(note_t), allocatable, intent(inout) :: notes(:)

    call add_note(notes, increment, .false., ': a factor in single precision, chosen to save '// &
      'time, does not hold this scene; it is factorised in double precision from here on')
  end subroutine note_double

  !> A node went further than the plan had it go.
  pure subroutine note_widened(scene, points, increment, point, notes)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(increment_t), intent(in) :: increment
    integer, intent(in) :: point
    type(note_t), allocatable, intent(inout) :: notes(:)
    character(:), allocatable :: words

    if (is_before_flat(points%turns(point), points%in_reach(point), points%is_curved(point))) then
      words = ' crosses the edge of '//master_name(scene, points%pair(point))// &
        ', which the plan had taken for a whole plane; the increment is repeated with its '// &
        'single facets'
    else
      words = ' reaches '//master_name(scene, points%pair(point))//', which the plan had '// &
        'thought out of reach; the increment is repeated with whole slave surfaces'
    end if
    call add_note(notes, increment, .true., ': node '// &
      to_text(scene%mesh%node_id(points%node(point)))//words)
  end subroutine note_widened

  !> Which rigid motions nothing holds, where that has changed.
  pure subroutine note_unheld(increment, report, before, notes)
    type(increment_t), intent(in) :: increment
    type(increment_report_t), intent(in) :: report
    character(:), allocatable, intent(inout) :: before
    !! the motions that nothing held in the increment before; of this one, out
    type(note_t), allocatable, intent(inout) :: notes(:)
    character(:), allocatable :: now

    now = ''
    if (allocated(report%unheld)) now = report%unheld
    if (now == before) return
    before = now
    if (now == '') now = 'none any more'
    call add_note(notes, increment, .true., &
      ': rigid-body modes that are unconstrained and not loaded are left as they are: '//now)
  end subroutine note_unheld

  !> Where reactions are not determined at the end of a *STEP.
  pure subroutine note_redundant(scene, points, increment, report, notes)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(increment_t), intent(in) :: increment
    type(increment_report_t), intent(in) :: report
    type(note_t), allocatable, intent(inout) :: notes(:)
    integer, parameter :: most = 4 !! nodes that are named
    character(:), allocatable :: words
    integer :: n, i

    n = count_redundant(report%contact)
    if (n == 0) return
    associate (nodes => scene%mesh%node_id(pack(points%node, report%contact%is_redundant)))
      words = 'node '
      if (n > 1) words = 'nodes '
      do i = 1, min(n, most)
        if (i > 1) words = words//', '
        words = words//to_text(nodes(i))
      end do
    end associate
    if (n > most) words = words//', ...'
    call add_note(notes, increment, .false., ': contact reactions are not determined at '// &
      counted(n, 'point')//' ('//words//'), for constraints can carry the same forces: the '// &
      'least reactions are given, and left out of pressures')
  end subroutine note_redundant

  !> An equilibrium that may be unstable: where points slide, friction may hold it, and so may
  !> pressures without an energy and the curvature of surfaces that touch.
  pure subroutine note_unstable(increment, stability, notes)
    type(increment_t), intent(in) :: increment
    type(stability_t), intent(in) :: stability !! with unstable motions
    type(note_t), allocatable, intent(inout) :: notes(:)
    character(:), allocatable :: what

    what = 'Points that slide on surfaces of bodies'
    if (stability%follows) what = 'Pressures whose work depends on the way'
    if (stability%slides) what = 'Points that slide with friction'
    call add_note(notes, increment, .true., ': the equilibrium may be unstable'// &
      unstable_in_words(stability)//'. '//what//' may yet hold it')
  end subroutine note_unstable

  !> Motions that reduced integration alone leaves unstable.
  pure subroutine note_hourglass(increment, stability, notes)
    type(increment_t), intent(in) :: increment
    type(stability_t), intent(in) :: stability
    type(note_t), allocatable, intent(inout) :: notes(:)

    call add_note(notes, increment, .true., ': '//counted(stability%n_hourglass, &
      'hourglass motion')//' of elements with reduced integration would release energy, and '// &
      'with full integration would not: the body does not buckle that way')
  end subroutine note_hourglass

  !> The matrix whose pivots tell could not be factorised.
  pure subroutine note_unknown_stability(increment, notes)
    type(increment_t), intent(in) :: increment
    type(note_t), allocatable, intent(inout) :: notes(:)

    call add_note(notes, increment, .true., ': whether the equilibrium is stable is not known: '// &
      'the bordered tangent could not be factorised')
  end subroutine note_unknown_stability

  !> A run at finite strain goes along that nobody asked for.
  pure subroutine note_followed(increment, far_off, notes)
    type(increment_t), intent(in) :: increment
    real(wp), intent(in) :: far_off !! [-]
    type(note_t), allocatable, intent(inout) :: notes(:)

    call add_note(notes, increment, .false., ': small strain may be off by more than '// &
      percent(far_off)//': a run at finite strain beside this one estimates it')
  end subroutine note_followed

  !> From here on it is not known how far small strain is off, by a law.
  pure subroutine note_lost_shadow(increment, stability, is_other_law, notes)
    type(increment_t), intent(in) :: increment
    integer, intent(in) :: stability !! as of shadow_solver_t
    logical, intent(in) :: is_other_law
    type(note_t), allocatable, intent(inout) :: notes(:)
    character(:), allocatable :: why, law

    law = ''
    if (is_other_law) law = ' and neo-Hooke''s law'
    why = ' there is no equilibrium near the small-strain solution'
    if (stability == is_unstable) why = ' the equilibrium is unstable (it buckles)'
    if (stability == may_be_unstable) why = ' the equilibrium may be unstable (it buckles)'
    call add_note(notes, increment, .true., ': at finite strain'//law//why//': how far small '// &
      'strain is off is not known')
  end subroutine note_lost_shadow

  !> Obstacles that touch nodes along one normal with unlike friction, at the end of a *STEP: where
  !> neither of the two is free to move the law lets them share the force at will.
  pure subroutine note_coincident(scene, points, tolerance, increment, prescribed, state, report, &
                                  notes)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    real(wp), intent(in) :: tolerance       !! of contact [-]
    type(increment_t), intent(in) :: increment
    logical, intent(in) :: prescribed(:, :) !! (3,n_nodes)
    type(state_t), intent(in) :: state      !! at its end
    type(increment_report_t), intent(in) :: report
    type(note_t), allocatable, intent(inout) :: notes(:)
    real(wp), parameter :: along = 1.0_wp - 1.0e-9_wp !! cosine of normals that are one [-]
    integer :: point(scene%mesh%n_nodes) !! of a pair that touches each node; 0: none
    real(wp) :: slack
    integer :: one, other, i, n

    slack = 10.0_wp*tolerance*maxval(abs(state%displacement)) + &
      rounding_of_places(scene, state%displacement)
    associate (contact => report%contact, pairs => scene%pairs)
      do one = 1, size(pairs)
        if (.not. stays(one)) cycle
        point = 0
        do i = points%first(one), points%first(one + 1) - 1
          if (contact%gap(i) <= slack) point(points%node(i)) = i
        end do
        do other = one + 1, size(pairs)
          if (.not. stays(other)) cycle
          n = 0
          do i = points%first(other), points%first(other + 1) - 1
            associate (j => point(points%node(i)))
              if (j == 0 .or. contact%gap(i) > slack) cycle
              if (.not. abs(points%mu(i) - points%mu(j)) > 0.0_wp) cycle
              if (max(contact%reaction(1, i), contact%reaction(1, j)) > 0.0_wp .and. &
                dot_product(contact%frame(:, 1, i), contact%frame(:, 1, j)) > along) n = n + 1
            end associate
          end do
          if (n > 0) call add_note(notes, increment, .false., ': '//pairs(one)%name//' and '// &
            pairs(other)%name//' touch '//counted(n, 'node')//' along the same normal, with '// &
            'unlike friction coefficients: the shares of the two in the force, and so the '// &
            'friction, are not determined')
        end do
      end do
    end associate

  contains

    !> Whether a pair is before an obstacle that only supports move.
    pure logical function stays(pair)
      integer, intent(in) :: pair

      stays = scene%pairs(pair)%master > 0
      if (.not. stays) return
      associate (ref_node => scene%obstacles(scene%pairs(pair)%master)%ref_node)
        if (ref_node > 0) stays = all(prescribed(:, ref_node))
      end associate
    end function stays

  end subroutine note_coincident

  !> Where contact forces are many times what drives them at the end of a *STEP.
  subroutine note_opposed_reactions(scene, points, first_gap, increment, state, report, notes)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    real(wp), intent(in) :: first_gap(:)    !! (n_points) of the undeformed mesh [length]
    type(increment_t), intent(in) :: increment
    type(state_t), intent(in) :: state      !! at its end
    type(increment_report_t), intent(in) :: report
    type(note_t), allocatable, intent(inout) :: notes(:)
    type(opposed_t), allocatable :: opposed(:)
    character(:), allocatable :: words
    integer :: i

    words = ''
    call find_opposed_reactions(scene%mesh, points, report%contact, state, scene%constraints, &
      opposed)
    do i = 1, size(opposed)
      associate (one => opposed(i), pair => scene%pairs(opposed(i)%pair))
        ! Of two that balance each other one is enough.
        if (one%other > 0) then
          if (any(opposed(:i - 1)%pair == one%other .and. opposed(:i - 1)%other == one%pair)) cycle
        end if
        words = ': contact forces of '//pair%name//' add up to '//to_text(one%pressed, 3)//', '// &
          to_text(one%pressed/one%driven_by, 2)//' times the loads and the forces of moving '// &
          'supports. '
        if (one%resultant < 0.5_wp*one%pressed) then
          words = words//'They balance each other within the pair'
        else if (one%other > 0) then
          words = words//'They and those of '//scene%pairs(one%other)%name// &
            ' balance each other, as on a wedge'
        else
          words = words//'Supports at rest balance them, as guides of a wedge do'
        end if
        associate (gap => first_gap(points%first(one%pair):points%first(one%pair + 1) - 1))
          if (any(gap < -rounding_of_places(scene, state%displacement))) words = words// &
            '; its surfaces overlap by up to '//to_text(maxval(-gap), 3)//' in the undeformed mesh'
        end associate
        call add_note(notes, increment, .false., words//'. Such forces are sensitive to small '// &
          'changes of the shape')
      end associate
    end do
  end subroutine note_opposed_reactions

  !> Stretches beyond those that a law is used for.
  pure subroutine note_unusual(scene, increment, unusual, notes)
    type(scene_t), intent(in) :: scene
    type(increment_t), intent(in) :: increment
    type(stretched_t), intent(in) :: unusual
    type(note_t), allocatable, intent(inout) :: notes(:)

    associate (law => scene%materials(scene%mesh%material(unusual%element))%law)
      call add_note(notes, increment, .true., ': element '// &
        to_text(scene%mesh%element_id(unusual%element))//' is stretched by '// &
        stretches_in_words(unusual%stretch)//': '//trim(law%beyond_usual)//' there; '// &
        neo_hooke_in_words(law%elastic)//' is closest to them')
    end associate
  end subroutine note_unusual

  !> How deep obstacles were in faces between their nodes in a *STEP.
  pure subroutine note_entries(scene, increment, deepest, notes)
    type(scene_t), intent(in) :: scene
    type(increment_t), intent(in) :: increment
    type(face_entry_t), intent(in) :: deepest !! of the *STEP
    type(note_t), allocatable, intent(inout) :: notes(:)
    character(:), allocatable :: words

    if (.not. deepest%depth > 0.0_wp) return
    words = ': faces of '//scene%surfaces(scene%pairs(deepest%pair)%surface)%name// &
      ' penetrate '//master_name(scene, deepest%pair)
    words = words//' between their nodes by up to '//to_text(deepest%depth, 3)//', at '// &
      nodes_in_words(scene, deepest%nodes)
    call add_note(notes, increment, .false., words, even_if_quiet=.false.)
  end subroutine note_entries

  !> How deep meshes of a hollow and what is in it were in each other where nothing pressed.
  pure subroutine note_unfelt(scene, increment, unfelt, notes)
    type(scene_t), intent(in) :: scene
    type(increment_t), intent(in) :: increment
    type(face_entry_t), intent(in) :: unfelt !! at the end of the *STEP
    type(note_t), allocatable, intent(inout) :: notes(:)

    if (unfelt%depth > 0.0_wp) call add_note(notes, increment, .false., ': faces of '// &
      scene%surfaces(scene%pairs(unfelt%pair)%surface)%name//' overlap '// &
      master_name(scene, unfelt%pair)//' between their nodes by '//to_text(unfelt%depth, 3)// &
      ', at '//nodes_in_words(scene, unfelt%nodes)//', and nothing presses there: no more than '// &
      'the faces of a hollow stand out of it')
  end subroutine note_unfelt

  !> Pairs that press though all that they see of each other is apart: what edges of up to 30
  !> degrees make of faces that are taken for arcs.
  pure subroutine note_apart(scene, points, increment, report, allowed, notes)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(increment_t), intent(in) :: increment
    type(increment_report_t), intent(in) :: report
    real(wp), intent(in) :: allowed    !! a gap that is none [length]
    type(note_t), allocatable, intent(inout) :: notes(:)
    real(wp) :: least                  !! [length]
    integer :: pair

    do pair = 1, size(scene%pairs)
      associate (first => points%first(pair), last => points%first(pair + 1) - 1)
        if (.not. any(points%on_surface(first:last) .and. report%contact%reaction(1, first:last) &
          > 0.0_wp)) cycle
        least = minval(report%contact%least_gap(first:last))
      end associate
      if (least > allowed) call add_note(notes, increment, .false., ': '//scene%pairs(pair)%name// &
        ' presses though all that its faces see of each other is apart, by '//to_text(least, 3)// &
        ' at least: edges of up to 30 degrees are taken for arcs that stand out of the faces; '// &
        'smaller faces of the slave lessen that')
    end do
  end subroutine note_apart

  !> Where a pressure is that of one node or two.
  pure subroutine note_small_contacts(scene, points, increment, prescribed, report, notes)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(increment_t), intent(in) :: increment
    logical, intent(in) :: prescribed(:, :) !! (3,n_nodes)
    type(increment_report_t), intent(in) :: report
    type(note_t), allocatable, intent(inout) :: notes(:)
    type(small_contact_t) :: small(size(scene%pairs))
    character(:), allocatable :: words
    integer :: i

    small = find_small_contacts(scene, points, prescribed, report%contact)
    do i = 1, size(small)
      if (small(i)%count == 0) cycle
      words = 'one point'
      if (small(i)%n_points == 2) words = 'two points'
      words = words//' at node '//to_text(scene%mesh%node_id(small(i)%node))
      if (small(i)%count > 1) words = words//' (and in '// &
        to_text(small(i)%count - 1)//' more places)'
      call add_note(notes, increment, .false., ': '//scene%pairs(i)%name//' touches at '// &
        words//': contact pressure is not resolved; that takes elements of about '// &
        to_text(small(i)%edge, 2))
    end do
  end subroutine note_small_contacts

  !> Kinks that increments of the *STEP go across.
  pure subroutine note_kinks(scene, increment, kinks, notes)
    type(scene_t), intent(in) :: scene
    type(increment_t), intent(in) :: increment
    integer(i8), intent(in) :: kinks(:) !! of the *STEP, in parts of the deck's increments
    type(note_t), allocatable, intent(inout) :: notes(:)

    associate (step => scene%steps(increment%step))
      if (step%direct) then
        call add_note(notes, increment, .false., &
          ': breakpoints of amplitudes inside increments: '//to_text(size(kinks))// &
          '; without DIRECT increments would end there')
      else if (has_too_many(kinks, step)) then
        call add_note(notes, increment, .false., ': breakpoints of amplitudes: '// &
          to_text(size(kinks))// &
          ' in '//to_text(step%n_increments)//' increments of the deck, too many for an '// &
          'increment to end at each; what that changes is not estimated: it takes smaller '// &
          'increments, or an accuracy that is asked for')
      end if
    end associate
  end subroutine note_kinks

  !> Increments of a *STEP that is over: fewer than the deck's, as they grew.
  pure subroutine note_grown(scene, increment, notes)
    type(scene_t), intent(in) :: scene
    type(increment_t), intent(in) :: increment !! the last of the *STEP
    type(note_t), allocatable, intent(inout) :: notes(:)

    associate (n => scene%steps(increment%step)%n_increments)
      if (scene%steps(increment%step)%is_dynamic .and. increment%number /= n) then
        call add_note(notes, increment, .false., ': '//to_text(increment%number)// &
          ' increments in place of '//to_text(n)//', by their error in time')
        return
      end if
      if (increment%position < n*whole_increment .or. increment%number >= n) return
      call add_note(notes, increment, .false., ': '//to_text(increment%number)// &
        ' increments in place of '//to_text(n)//': they grew, as load steps make less error '// &
        'than a third of the mesh''s')
    end associate
  end subroutine note_grown

  !> An amplitude that jumps inside an increment of a dynamic *STEP.
  pure subroutine note_jump(increment, notes)
    type(increment_t), intent(in) :: increment
    type(note_t), allocatable, intent(inout) :: notes(:)

    call add_note(notes, increment, .true., ': an amplitude jumps inside it: loads go there in '// &
      'a straight line; without DIRECT an increment would end at the jump')
  end subroutine note_jump

  !> Increments of the *STEP in which an obstacle turns far.
  pure subroutine note_turn(scene, increment, notes)
    type(scene_t), intent(in) :: scene
    type(increment_t), intent(in) :: increment
    type(note_t), allocatable, intent(inout) :: notes(:)
    character(:), allocatable :: words
    real(wp) :: turn !! the farthest in one of the deck's increments [rad]

    turn = largest_turn(scene, increment%step)
    if (turn <= most_turn) return
    words = ': an obstacle turns by up to '//to_text(turn*45.0_wp/atan(1.0_wp), 3)// &
      ' degrees in an increment of the deck'
    if (scene%steps(increment%step)%direct) then
      call add_note(notes, increment, .false., words//', and its slip is the chord of that; '// &
        'without DIRECT none would turn it by more than 10')
    else
      call add_note(notes, increment, .false., words// &
        ', which is cut so that none turns it by more than 10')
    end if
  end subroutine note_turn

  !> Contact that begins inside an increment.
  pure subroutine note_touch(increment, is_direct, notes)
    type(increment_t), intent(in) :: increment
    logical, intent(in) :: is_direct
    type(note_t), allocatable, intent(inout) :: notes(:)
    character(:), allocatable :: words

    words = ': contact begins inside increment '//to_text(increment%number)
    if (is_direct) words = words//'; without DIRECT an increment would end there'
    call add_note(notes, increment, .false., words)
  end subroutine note_touch

  !> A load cycle has settled; what that saves, or could.
  pure subroutine note_settled(scene, increment, cycles, cycle, change, ends, notes)
    type(scene_t), intent(in) :: scene
    type(increment_t), intent(in) :: increment
    type(load_cycles_t), intent(in) :: cycles
    type(followed_cycle_t), intent(in) :: cycle
    real(wp), intent(in) :: change !! from the end of the cycle before [-]
    logical, intent(in) :: ends    !! the run ends here
    type(note_t), allocatable, intent(inout) :: notes(:)
    character(:), allocatable :: words
    integer :: done, n_left

    words = ': the load cycle has settled: cycle '//to_text(cycle%n_ends)//' ('//to_text( &
      cycles%length)//' increments of the deck) repeats the one before to '
    if (change > 0.0_wp) then
      words = words//percent(change)//' of the changes within it'
    else
      words = words//'the tolerance of contact'
    end if
    done = cycles%first + cycle%n_ends*cycles%length
    n_left = count_increments(scene%steps) - done
    if (cycles%last < count_increments(scene%steps)) then
      words = words//'; other loads follow'
    else if (ends) then
      words = words//'. Left out: the last '//to_text(n_left)//' increments of the deck, which '// &
        'would repeat it'
    else if (n_left > 0) then
      words = words//'. --until-steady leaves out the '//to_text(n_left)//' increments of the '// &
        'deck that follow'
    end if
    call add_note(notes, increment, .true., words)
  end subroutine note_settled

  !> A dynamic *STEP in which inertia does little.
  pure subroutine note_slow(increment, state, notes)
    type(increment_t), intent(in) :: increment !! the last of the *STEP
    type(state_t), intent(in) :: state
    type(note_t), allocatable, intent(inout) :: notes(:)
    real(wp), parameter :: little = 0.01_wp !! of the largest force [-]

    if (state%most_inertia > little*state%most_force .or. .not. state%most_force > 0.0_wp) return
    call add_note(notes, increment, .false., ': inertia is at most '//percent( &
      state%most_inertia/state%most_force)//' of the largest force: *STATIC would do, if '// &
      'supports and contact hold the bodies')
  end subroutine note_slow

  !> What turns of bodies at finite strain have of errors: slave nodes without mass, and the scheme.
  pure subroutine note_turning(increment, own, turned, notes)
    type(increment_t), intent(in) :: increment   !! the last of the *STEP
    type(own_mass_t), intent(in) :: own
    real(wp), intent(in) :: turned               !! as of energy_t [-]
    type(note_t), allocatable, intent(inout) :: notes(:)
    real(wp), parameter :: little = 0.01_wp

    if (inertia_off(own) > little) call add_note(notes, increment, .false., ': slave nodes '// &
      'carry no mass, so centres of mass and moments of inertia of bodies are wrong by up to '// &
      percent(inertia_off(own))//'; smaller elements at contact, or slave surfaces with fewer '// &
      'faces, reduce this error')
    if (turned > little) call add_note(notes, increment, .false., ': the scheme in time '// &
      'changed the angular momentum of a body by '//percent(turned)//'; shorter increments '// &
      'reduce this error')
  end subroutine note_turning

  !> An increment that is as short as increments get, and too long for its error in time.
  pure subroutine note_too_long(scene, increment, error, notes)
    type(scene_t), intent(in) :: scene
    type(increment_t), intent(in) :: increment
    real(wp), intent(in) :: error !! as of error_in_time [-]
    type(note_t), allocatable, intent(inout) :: notes(:)

    associate (step => scene%steps(increment%step))
      call add_note(notes, increment, .true., ': of '//to_text(duration_of(step, &
        increment%position - increment%start), 2)//', as short as increments get, and the '// &
        'error in time is '//percent(error)//'; a third number of *DYNAMIC allows shorter ones')
    end associate
  end subroutine note_too_long

  !> What the scheme in time has taken of the energy at the end of a dynamic *STEP, and what contact
  !> has given that does no work in nature.
  pure subroutine note_energy(increment, energy, largest, notes)
    type(increment_t), intent(in) :: increment
    type(energy_t), intent(in) :: energy
    real(wp), intent(in) :: largest !! that has been there or was turned over [energy]
    type(note_t), allocatable, intent(inout) :: notes(:)

    character(:), allocatable :: scheme, contact

    if (.not. largest > 0.0_wp) return
    scheme = 'took'
    if (energy%balance < 0.0_wp) scheme = 'gave'
    contact = 'gave'
    if (energy%contact < 0.0_wp) contact = 'took'
    call add_note(notes, increment, .false., ': the scheme in time '//scheme//' '// &
      percent(abs(energy%balance)/largest)//' of the energy, and contact, which does no work '// &
      'in nature, '//contact//' '//percent(abs(energy%contact)/largest)//'; shorter increments '// &
      'reduce both')
  end subroutine note_energy

  !> Energy that contact has given or taken by the end of a static *STEP at finite strain, where
  !> that is much: at small strain such an increment ends the run.
  pure subroutine note_given(increment, energy, most_strained, notes)
    type(increment_t), intent(in) :: increment
    type(energy_t), intent(in) :: energy       !! of the run so far
    real(wp), intent(in) :: most_strained      !! largest strain energy so far [energy]
    type(note_t), allocatable, intent(inout) :: notes(:)
    ! Of strain energy and friction. What few increments make of work along a path is up to 0.31 in
    ! 120 random decks at finite strain; a catch that slid up a ramp as the slave of it has 1.6 [-]
    real(wp), parameter :: much = 0.5_wp

    associate (there => most_strained + energy%dissipation)
      if (.not. abs(energy%balance) > much*there) return
      call add_note(notes, increment, .false., ': contact has '//merge('given', 'taken', &
        energy%balance < 0.0_wp)//' '//to_text(abs(energy%balance), 2)//' of energy, beside '// &
        to_text(there, 2)//' of strain energy and friction: forces may be wrong where a corner '// &
        'of the master slides over the slave (docs/deck/contact.md); smaller increments tell '// &
        'whether it is the increments')
    end associate
  end subroutine note_given

end module increment_notes_mod
