!> A deck, from its file to a scene.
!>
!> The deck is cut into cards, which are read in the order of what they build on: parameters, nodes
!> and elements, sets, properties, surfaces, joints, contact, steps. So a card may name what stands
!> further down. Every error is kept, and all are reported at the end in the order of the deck.
module read_deck_mod
  use adjust_mod, only: adjust_nodes, adjust_t
  use build_mesh_mod, only: build_mesh, check_elements, check_locking, mark_used_nodes, &
    note_unused_nodes
  use cards_mod, only: find_cards, is_data_line, note, read_parameters, reader_t, reading_t, &
    report, report_missing_element
  use diagnostics_mod, only: add_plain_mistake, any_mistakes, diagnostics_t, guess, &
    mistakes_as_error, mistakes_in_lines, notes_as_list, quoted
  use face_couplings_mod, only: couple, coupling_t, keep_in_plane, mark_coupled, rotations_of
  use equation_list_mod, only: equation_list_t, join_equations, mark_named, refuse_held, &
    refuse_loose
  use errors_mod, only: error_t
  use flat_deck_mod, only: flat_deck
  use found_faces_mod, only: found_faces
  use general_pairs_mod, only: general_contact_t
  use generate_mesh_mod, only: generate_mesh
  use flatten_assembly_mod, only: flatten_assembly
  use kinds_mod, only: i8, wp
  use loads_mod, only: load_step_t
  use mesh_size_mod, only: blocks_t, mesh_size_t
  use local_origin_mod, only: move_origin
  use matching_faces_mod, only: check_matching, find_skin, strengthen_reduced
  use local_axes_mod, only: along_directions, take_transforms, transforms_t
  use name_table_mod, only: name_table_t
  use named_sets_mod, only: keep_named_sets
  use obstacles_mod, only: obstacle_t
  use options_mod, only: allow_options, card_t, open_card
  use parameters_mod, only: add_override, find_parameter, parameter_table_t
  use read_amplitudes_mod, only: amplitude_list_t, read_amplitudes
  use read_block_mod, only: read_block
  use read_contact_mod, only: read_contact
  use read_general_contact_mod, only: bodies_in_contact, is_general_contact, &
    read_general_contact
  use read_interactions_mod, only: interactions_t, read_interactions
  use read_controls_mod, only: read_contact_controls, read_output_controls
  use read_foundations_mod, only: read_foundations
  use read_gap_elements_mod, only: gap_element_t, make_gap_pairs, read_gap_elements
  use read_gaps_mod, only: read_clearances, read_gaps
  use read_cyclic_mod, only: read_cyclic
  use read_couplings_mod, only: find_coupled_surfaces, read_couplings
  use read_equations_mod, only: read_equations
  use pretension_mod, only: join_sections, section_t
  use read_pretension_mod, only: cut_bolts, read_sections_of_bolts
  use plane_mesh_mod, only: across_plane, hold_plane, spread_equations
  use read_plane_mod, only: check_even, find_plane, give_thickness, read_plane
  use read_mesh_mod, only: connect_mesh, read_elements, read_nodes, system_t
  use read_obstacles_mod, only: read_obstacles
  use read_precision_mod, only: read_precision
  use read_body_solver_mod, only: read_body_solver
  use read_prints_mod, only: read_prints
  use rigid_links_mod, only: add_links
  use read_accuracy_mod, only: read_accuracy
  use read_rigid_bodies_mod, only: find_rigid_nodes, join_rigid_bodies, read_rigid_bodies, &
    rigid_bodies_t
  use read_properties_mod, only: find_weights, read_materials, read_sections
  use read_sets_mod, only: read_sets
  use read_springs_mod, only: read_springs, refuse_loose_springs, refuse_tables, &
    scale_turned_springs
  use read_surface_behavior_mod, only: read_surface_behavior
  use read_source_mod, only: read_source, source_from_text
  use read_refinements_mod, only: read_refinements
  use refine_locally_mod, only: constrain_hanging, place_hanging, refinement_t, refine_locally, &
    refuse_hanging
  use refine_mesh_mod, only: refine_mesh
  use read_system_mod, only: read_system
  use read_temperatures_mod, only: read_first_temperatures
  use read_dynamics_mod, only: check_dynamics, read_first_velocities
  use follow_velocities_mod, only: follow_velocities
  use read_steps_mod, only: read_steps
  use read_surfaces_mod, only: read_surfaces
  use read_transforms_mod, only: read_transforms
  use read_ties_mod, only: read_ties
  use rigid_facets_mod, only: find_facets, make_obstacles
  use static_steps_mod, only: leave_out_steps
  use surface_list_mod, only: surface_list_t
  use controls_mod, only: compliance_auto, compliance_dense, output_controls_t, solver_auto
  use grips_mod, only: is_turning
  use finite_strain_limits_mod, only: beyond_finite_strain
  use mesh_draft_mod, only: solids
  use cells_mod, only: has_middles
  use element_laws_mod, only: varies
  use mesh_mod, only: kind_c3d8, kind_c3d8b
  use scene_mod, only: scene_t
  use sets_mod, only: model_t
  use spring_elements_mod, only: spring_elements_t
  use text_mod, only: string_t, to_text
  use trim_pairs_mod, only: trim_pairs
  use ties_mod, only: tie_t, make_constraints, move_tied_nodes, note_held, refuse_tied_pairs
  use read_units_mod, only: read_units
  use turns_mod, only: largest_turn, turn_allowed
  implicit none
  private

  public :: read_deck, read_deck_text

  !> What one family of cards leaves to the next, beside the scene.
  type :: draft_t
    type(model_t) :: model
    type(mesh_size_t) :: mesh_size
    type(surface_list_t) :: surfaces
    type(rigid_bodies_t) :: bodies
    type(name_table_t) :: obstacles
    type(tie_t), allocatable :: ties(:)
    type(coupling_t), allocatable :: couplings(:)
    type(section_t), allocatable :: bolts(:)
    type(equation_list_t) :: equations
    type(transforms_t) :: transforms
    type(refinement_t), allocatable :: refinements(:)
    integer, allocatable :: material(:) !! (n_elements)
    type(spring_elements_t) :: springs
    type(gap_element_t), allocatable :: gaps(:)
    integer :: n_equations = 0 !! of the deck; others follow
  end type draft_t

contains

  !> Read the deck at `path`.
  subroutine read_deck(path, overrides, scene, error, in_lines, flat, mesh_size, reading)
    character(*), intent(in) :: path
    type(string_t), intent(in) :: overrides(:)   !! name=value, in place of the deck's parameters
    type(scene_t), intent(out) :: scene
    type(error_t), allocatable, intent(out) :: error !! every mistake, one after the other
    logical, intent(in), optional :: in_lines !! tell each mistake in one line, for editors
    type(string_t), intent(out), optional :: flat
    !! the deck as one text without parameters and blocks
    type(mesh_size_t), intent(in), optional :: mesh_size !! left out: as written
    type(reading_t), intent(in), optional :: reading !! left out: as written
    type(reader_t) :: reader

    if (present(reading)) reader%reading = reading
    call read_source(path, reader%source, reader%diagnostics)
    call read_scene(reader, overrides, scene, error, flat, mesh_size)
    if (present(in_lines)) then
      if (in_lines) call mistakes_in_lines(reader%diagnostics, path, error)
    end if
    scene%name = name_of(path)
  end subroutine read_deck

  !> Read a deck that is given as text; `path` is what mistakes call it.
  subroutine read_deck_text(text, path, overrides, scene, error)
    character(*), intent(in) :: text
    character(*), intent(in) :: path
    type(string_t), intent(in) :: overrides(:)
    type(scene_t), intent(out) :: scene
    type(error_t), allocatable, intent(out) :: error
    type(reader_t) :: reader

    call source_from_text(text, path, reader%source, reader%diagnostics)
    call read_scene(reader, overrides, scene, error)
    scene%name = name_of(path)
  end subroutine read_deck_text

  !> The scene of a deck whose source is there.
  subroutine read_scene(reader, overrides, scene, error, flat, mesh_size)
    type(reader_t), intent(inout) :: reader
    type(string_t), intent(in) :: overrides(:)
    type(scene_t), intent(inout) :: scene
    type(error_t), allocatable, intent(out) :: error
    type(string_t), intent(out), optional :: flat
    type(mesh_size_t), intent(in), optional :: mesh_size
    logical :: readable

    call take_overrides(overrides, reader%parameters, reader%diagnostics, scene%overrides)
    ! Without its full text a deck is not worth reading: what follows would be guesses.
    if (.not. any_mistakes(reader%diagnostics)) then
      if (reader%reading%static_steps) call leave_out_steps(reader)
      call find_cards(reader)
      call read_parameters(reader)
      call flatten_assembly(reader, readable)
      if (readable) then
        call check_overrides(reader)
        call read_cards(reader, scene, flat, mesh_size)
        call check_parameter_use(reader)
      end if
    end if
    call mistakes_as_error(reader%diagnostics, error)
    call notes_as_list(reader%diagnostics, scene%notes)
    if (allocated(error)) return
    scene%deck = reader%source%text(:reader%source%length)
    scene%files = reader%source%files(:reader%source%n_files)
    call add_files_of_obstacles(scene)
  end subroutine read_scene

  !> Files of facets: their paths, and in the deck that is kept what tells one from another.
  subroutine add_files_of_obstacles(scene)
    type(scene_t), intent(inout) :: scene
    type(string_t) :: path
    integer :: i

    do i = 1, size(scene%obstacles)
      associate (obstacle => scene%obstacles(i))
        if (.not. allocated(obstacle%file)) cycle
        path%text = obstacle%file
        scene%files = [scene%files, path]
        scene%deck = scene%deck//'** '//obstacle%file//': '// &
          to_text(size(obstacle%facet, 2))//' triangles, checksum '//to_text(obstacle%checksum)// &
          new_line('a')
      end associate
    end do
  end subroutine add_files_of_obstacles

  !> Everything but the parameters.
  subroutine read_cards(reader, scene, flat, mesh_size)
    type(reader_t), intent(inout) :: reader
    type(scene_t), intent(inout) :: scene
    type(string_t), intent(out), optional :: flat
    type(mesh_size_t), intent(in), optional :: mesh_size
    type(draft_t) :: draft
    type(name_table_t) :: materials

    call read_heading(reader, scene%title)
    call read_units(reader, scene%units)
    if (present(mesh_size)) draft%mesh_size = mesh_size
    call read_mesh(reader, draft, scene, flat)
    call read_materials(reader, scene%materials, materials)
    call read_sections(reader, draft%model, materials, scene%materials, draft%material)
    call check_locking(reader, draft%model%mesh, scene%materials, draft%material)
    call find_weights(scene%materials, draft%material, draft%model%weighs)
    call read_surfaces_and_joints(reader, draft, scene)
    call read_contact_controls(reader, scene%contact)
    call read_precision(reader, scene%precision)
    call read_body_solver(reader, scene%precision)
    call read_accuracy(reader, draft%model, draft%surfaces%list(:draft%surfaces%n), scene%pairs, &
      scene%accuracy)
    call read_output_controls(reader, scene%output)
    call read_prints(reader, draft%model, draft%springs, scene%output%prints)
    call read_loading(reader, draft, scene)
    if (draft%model%mesh%n_elements == 0 .and. .not. any_mistakes(reader%diagnostics)) then
      call report_missing_element(reader, 0, 'the deck has no elements (*ELEMENT or *BLOCK)')
    end if
    if (reader%n_steps == 0) call report(reader, 0, 'the deck has no *STEP')
    if (any_mistakes(reader%diagnostics)) return

    scene%surfaces = draft%surfaces%list(:draft%surfaces%n)
    if (size(draft%couplings) > 0) scene%rotations = rotations_of(draft%model, &
      scene%surfaces, draft%couplings)
    if (allocated(scene%first_temperature)) scene%first_temperature = &
      [scene%first_temperature, spread(0.0_wp, 1, draft%model%mesh%n_stand_ins)]
    if (allocated(scene%first_velocity)) scene%first_velocity = reshape([scene%first_velocity, &
      spread(0.0_wp, 1, 3*draft%model%mesh%n_stand_ins)], [3, size(scene%first_velocity, 2) + &
      draft%model%mesh%n_stand_ins])
    call note_held(reader, scene%constraints, draft%model%mesh%n_nodes, draft%model%mesh%hangs, &
      scene%steps)
    call refuse_held(reader, draft%model, draft%equations, [pack(draft%couplings%node, &
      draft%couplings%distributes), pack(draft%couplings%rotation_node, &
      draft%couplings%distributes)], scene%steps)
    scene%mesh%springs = draft%springs
    call build_mesh(draft%model%mesh, draft%material, scene%constraints, scene%mesh)
    call refuse_loose_springs(reader, draft%model%mesh, scene%mesh)
    call refuse_tables(reader, scene%mesh%springs, scene%finite_strain)
    call add_foundations(scene)
    where (scene%obstacles%ref_node > 0) scene%obstacles%is_on_body = scene%mesh%body(max(1, &
      scene%obstacles%ref_node)) > 0
    call refuse_loose(reader, draft%equations, scene%mesh)
    call refuse_warm_axes(reader, scene)
    call check_turns(reader, scene)
    call check_dynamics(reader, scene)
    if (any(scene%steps%is_dynamic)) then
      scene%precision%body_is_given = .true.
      scene%precision%factor_is_given = .true.
      scene%precision%low_rank_is_given = .true.
    else if (allocated(scene%first_velocity)) then
      deallocate (scene%first_velocity)
    end if
    if (scene%finite_strain) then
      call prepare_finite_strain(reader, allocated(draft%equations%links), scene)
    else if (scene%precision%renews_tangent) then
      call note(reader, 'TANGENT of *BODY SOLVER is ignored: it applies to NLGEOM only')
      scene%precision%renews_tangent = .false.
    end if
  end subroutine read_cards

  !> The mesh, cut as the deck and the command line ask for; what its nodes belong to.
  subroutine read_mesh(reader, draft, scene, flat)
    type(reader_t), intent(inout) :: reader
    type(draft_t), intent(inout) :: draft
    type(scene_t), intent(inout) :: scene !! gets the obstacles
    type(string_t), intent(out), optional :: flat

    associate (model => draft%model, mesh => draft%model%mesh, size_read => draft%mesh_size)
      mesh%scale = size_read%blocks
      mesh%across = size_read%across
      call find_plane(reader, mesh)
      call read_mesh_cards(reader, model)
      if (present(flat)) call flat_deck(reader, mesh, flat)
      call connect_mesh(reader, mesh)
      call read_plane(reader, mesh)
      if (mesh%plane /= solids) size_read%across = across_plane
      call read_couplings(reader, model, draft%couplings)
      call mark_used_nodes(model)
      call mark_coupled(model)
      call move_origin(mesh, model%used)
      call read_obstacles(reader, model, scene%obstacles, draft%obstacles)
      call read_rigid_bodies(reader, model, scene%obstacles, draft%bodies)
      call read_sections_of_bolts(reader, model, draft%bolts)
      ! Nodes that equations and springs alone name may be named by sets.
      if (.not. joins_single_nodes(reader)) call &
        note_unused_nodes(reader, model)
      call check_elements(reader, mesh)
      call check_matching(reader, mesh)
      call read_sets(reader, model)
      call give_thickness(reader, model)
      call join_rigid_bodies(reader, model, draft%bodies, draft%couplings)
      call keep_in_plane(model, draft%couplings)
      call refine_mesh(reader, model, size_read%parts, size_read%across)
      call read_refinements(reader, model, draft%refinements)
      call refine_locally(reader, model, draft%refinements, size_read%zone, size_read%across)
      call cut_bolts(reader, model, draft%bolts)
    end associate
  end subroutine read_mesh

  !> Surfaces, the pairs that may touch, and all that joins nodes: equations, springs, ties,
  !> couplings, sections of bolts, nodes that hang.
  subroutine read_surfaces_and_joints(reader, draft, scene)
    type(reader_t), intent(inout) :: reader
    type(draft_t), intent(inout) :: draft
    type(scene_t), intent(inout) :: scene
    type(adjust_t), allocatable :: adjusts(:)
    type(interactions_t) :: interactions
    type(general_contact_t) :: contact

    associate (model => draft%model, equations => draft%equations, surfaces => draft%surfaces)
      call read_transforms(reader, model, draft%transforms)
      call read_equations(reader, model, equations)
      call spread_equations(model, equations)
      draft%n_equations = equations%list%n
      call read_springs(reader, model, draft%springs)
      call read_gap_elements(reader, model, draft%gaps)
      if (joins_single_nodes(reader)) call note_unused_nodes(reader, model)
      call find_facets(reader, model, draft%bodies)
      call read_surfaces(reader, model, surfaces)
      if (.not. any_mistakes(reader%diagnostics)) call find_skin(model%mesh)
      call keep_named_sets(reader, model, surfaces, scene)
      call make_obstacles(reader, model, is_general_contact(reader), draft%bodies, surfaces, &
        scene%obstacles)
      call check_even(reader, model%mesh, scene%obstacles)
      call read_ties(reader, model, surfaces, draft%obstacles, draft%ties)
      call find_coupled_surfaces(reader, model, surfaces, draft%couplings)
      call find_rigid_nodes(reader, model, draft%bodies, draft%couplings)
      if (.not. any_mistakes(reader%diagnostics)) then
        call move_tied_nodes(reader, model, surfaces%list(:surfaces%n), draft%ties)
        call place_hanging(model%mesh)
      end if
      call read_interactions(reader, interactions)
      call read_contact(reader, model, surfaces, scene%obstacles, draft%obstacles, interactions, &
        scene%pairs, adjusts)
      if (is_general_contact(reader) .and. allocated(model%mesh%piece)) contact = &
        bodies_in_contact(model, scene%materials(draft%material), draft%bodies, draft%ties%slave)
      call read_general_contact(reader, model, contact, scene%obstacles, interactions, surfaces, &
        scene%pairs, adjusts)
      call move_alloc(contact%may_overlap, scene%may_overlap)
      call read_surface_behavior(reader)
      if (.not. any_mistakes(reader%diagnostics)) call refuse_hanging(reader, model%mesh, &
        surfaces%list(:surfaces%n), [scene%pairs%surface, draft%ties%slave], draft%refinements)
      if (.not. any_mistakes(reader%diagnostics)) then
        call adjust_nodes(reader, model, surfaces%list(:surfaces%n), scene%obstacles, &
          scene%pairs, adjusts)
        call place_hanging(model%mesh)
        call refuse_tied_pairs(reader, surfaces%list(:surfaces%n), draft%ties, scene%pairs)
        call constrain_hanging(model%mesh, scene%constraints)
        call make_constraints(reader, model, surfaces%list(:surfaces%n), draft%ties, &
          scene%constraints)
      end if
      if (.not. any_mistakes(reader%diagnostics)) then
        call couple(reader, model, surfaces%list(:surfaces%n), draft%couplings, equations)
        call join_sections(draft%bolts, equations)
        call read_cyclic(reader, model, surfaces, equations)
        call scale_turned_springs(model, draft%springs)
      end if
      call mark_named(model, equations)
      ! After a mistake couplings and sections are not made: what they would name is not known.
      if (any_mistakes(reader%diagnostics) .and. (size(draft%couplings) > 0 .or. has_card(reader, &
        'PRE-TENSION SECTION'))) model%named = .true.
      call make_gap_pairs(model, draft%gaps, surfaces, scene%obstacles, scene%pairs)
      call read_gaps(reader, model, surfaces, scene%pairs, scene%gaps)
      call read_clearances(reader, scene%pairs)
    end associate
  end subroutine read_surfaces_and_joints

  !> Steps with their supports and loads, and the constraints in the directions of these.
  subroutine read_loading(reader, draft, scene)
    type(reader_t), intent(inout) :: reader
    type(draft_t), intent(inout) :: draft
    type(scene_t), intent(inout) :: scene
    type(amplitude_list_t) :: amplitudes
    real(wp), allocatable :: along_local(:, :) !! (3,n_nodes) first velocities [length/time]

    associate (model => draft%model, equations => draft%equations)
      call read_amplitudes(reader, amplitudes)
      call read_foundations(reader, model, draft%surfaces, scene%foundations)
      call read_first_temperatures(reader, model, scene%first_temperature)
      call read_first_velocities(reader, model, scene%first_velocity)
      call read_steps(reader, model, amplitudes, scene%pairs, draft%surfaces, scene%steps, &
        scene%regions, scene%finite_strain)
      if (allocated(scene%first_velocity)) then
        along_local = scene%first_velocity
        call along_directions(draft%transforms, model%mesh%coordinates, along_local)
      end if
      call follow_velocities(reader, model, along_local, amplitudes%list, scene%steps)
      call move_alloc(amplitudes%list, scene%amplitudes)
      scene%accuracy%chooses_theory = reader%chooses_theory
      scene%accuracy%keeps_small_strain = reader%keeps_small_strain
      if (.not. any_mistakes(reader%diagnostics)) call strengthen_reduced(reader, model%mesh, &
        scene%steps, scene%constraints)
      if (.not. any_mistakes(reader%diagnostics)) call trim_pairs(model, scene%finite_strain, &
        scene%amplitudes, scene%obstacles, draft%surfaces, scene%pairs, scene%steps)
      if (.not. any_mistakes(reader%diagnostics)) then
        scene%blocks = free_blocks(reader, model, scene%steps)
        call add_links(reader, model, scene%constraints, scene%steps, equations)
        call take_transforms(reader, model, draft%transforms, draft%n_equations, &
          scene%constraints, equations, scene%steps, scene%local_axes)
      end if
      if (.not. any_mistakes(reader%diagnostics)) then
        call hold_plane(model, scene%constraints, equations, scene%steps)
        call join_equations(reader, model, equations, scene%constraints)
      end if
    end associate
    call mark_turning(scene%steps, scene%obstacles)
    if (all(abs(scene%materials%expansion) <= 0.0_wp) .and. has_card(reader, 'TEMPERATURE')) call &
      note(reader, '*TEMPERATURE changes nothing: no material has an *EXPANSION')
    if (.not. scene%finite_strain) call keep_to_small_strain(reader, scene%output)
  end subroutine read_loading

  !> The springs of the foundations.
  subroutine add_foundations(scene)
    type(scene_t), intent(inout) :: scene
    integer :: i

    if (.not. allocated(scene%foundations)) return
    do i = 1, size(scene%foundations)
      associate (foundation => scene%foundations(i))
        call found_faces(scene%mesh, scene%surfaces(foundation%surface)%faces, &
          foundation%stiffness)
      end associate
    end do
  end subroutine add_foundations

  !> Whether cards of the deck may join nodes of no element to bodies.
  pure logical function joins_single_nodes(reader)
    type(reader_t), intent(in) :: reader

    joins_single_nodes = has_card(reader, 'EQUATION') .or. has_card(reader, 'MPC') .or. &
      has_card(reader, 'SPRING') .or. has_card(reader, 'GAP')
  end function joins_single_nodes

  !> Whether a keyword stands in the deck.
  pure logical function has_card(reader, keyword)
    type(reader_t), intent(in) :: reader
    character(*), intent(in) :: keyword !! upper case, without star

    has_card = any(reader%cards(:reader%n_cards)%keyword == keyword)
  end function has_card

  !> The blocks of a deck that would say the same of blocks of more or fewer elements: all elements
  !> are of blocks, of which none is meant by its number, nor a node; and no node has a force of its
  !> own, for on more nodes it would be more.
  pure function free_blocks(reader, model, steps) result(blocks)
    type(reader_t), intent(in) :: reader
    type(model_t), intent(in) :: model
    type(load_step_t), intent(in) :: steps(:)
    type(blocks_t) :: blocks(3) !! their elements along each axis
    integer :: i, n

    n = 0
    do i = 1, model%mesh%n_blocks
      n = n + product(model%mesh%blocks(i)%n)
    end do
    if (reader%numbers_block .or. model%mesh%n_elements /= n) return
    do i = 1, size(steps)
      if (any(model%used(steps(i)%forces%node))) return
    end do
    blocks = model%mesh%counts
  end function free_blocks

  !> Note what a run at small strain leaves out.
  subroutine keep_to_small_strain(reader, output)
    type(reader_t), intent(inout) :: reader
    type(output_controls_t), intent(inout) :: output

    if (has_card(reader, 'HYPERELASTIC') .or. has_card(reader, 'HYPERFOAM')) call note(reader, &
      'without NLGEOM *HYPERELASTIC and *HYPERFOAM act by their shear and bulk modulus at '// &
      'small strain')
    if (output%green_strain .or. output%pk2_stress) call note(reader, &
      '*EL FILE: EG and PK2 are not written without NLGEOM: at small strain they are E and S')
    output%green_strain = .false.
    output%pk2_stress = .false.
  end subroutine keep_to_small_strain

  !> Find the obstacles that rotations of their reference nodes turn.
  pure subroutine mark_turning(steps, obstacles)
    type(load_step_t), intent(in) :: steps(:)
    type(obstacle_t), intent(inout) :: obstacles(:)
    integer :: step, i

    do step = 1, size(steps)
      if (.not. allocated(steps(step)%rotations)) cycle ! of a deck with mistakes
      do i = 1, size(steps(step)%rotations)
        associate (rotation => steps(step)%rotations(i))
          if (.not. abs(rotation%value) > 0.0_wp) cycle
          where (obstacles%ref_node == rotation%node) obstacles%turns = .true.
        end associate
      end do
    end do
  end subroutine mark_turning

  !> Report steps whose increments turn an obstacle too far, as they are or cut as far as that goes.
  subroutine check_turns(reader, scene)
    type(reader_t), intent(inout) :: reader
    type(scene_t), intent(in) :: scene
    real(wp), parameter :: degrees = 180.0_wp/acos(-1.0_wp)
    type(card_t) :: card
    real(wp) :: turn
    integer :: step, k

    do step = 1, size(scene%steps)
      turn = largest_turn(scene, step)
      if (turn <= turn_allowed(scene, step)) cycle
      do k = 1, reader%n_cards
        if (reader%cards(k)%keyword /= 'STATIC' .or. reader%cards(k)%step /= step) cycle
        call open_card(reader, k, card)
        call report(reader, card%position, 'an obstacle turns by '//to_text(turn*degrees, 4)// &
          ' degrees in an increment of this step'//trim(merge(', which DIRECT keeps', &
          '                    ', scene%steps(step)%direct))//': that can be '// &
          to_text(turn_allowed(scene, step)*degrees, 4)//' at most')
        exit
      end do
    end do
  end subroutine check_turns

  !> Refuse warmth where axes go around in elements with incompatible modes or a mean dilatation:
  !> free of stress they would have forces.
  subroutine refuse_warm_axes(reader, scene)
    type(reader_t), intent(inout) :: reader
    type(scene_t), intent(in) :: scene
    type(card_t) :: card
    integer :: e

    if (.not. (has_card(reader, 'TEMPERATURE') .and. has_card(reader, 'EXPANSION'))) return
    do e = 1, scene%mesh%n_elements
      associate (material => scene%materials(scene%mesh%material(e)))
        if (scene%mesh%element_kind(e) == kind_c3d8 .or. has_middles(scene%mesh%connectivity% &
          cell(e)) .or. .not. abs(material%expansion) > 0.0_wp) cycle
        if (.not. varies(scene%mesh, material)) cycle
      end associate
      call open_card(reader, findloc(reader%cards(:reader%n_cards)%keyword == 'EXPANSION', .true., &
        dim=1), card)
      call report(reader, card%position, 'materials whose axes go around (SYSTEM=CYLINDRICAL '// &
        'of *ORIENTATION, axisymmetric elements) do not expand in elements computed as C3D8I '// &
        'or C3D8B', 'elements of second order do')
      return
    end do
  end subroutine refuse_warm_axes

  !> Refuse what NLGEOM does not cover; but where the deck asks for others its factor is exact, its
  !> compliance is formed, and couplings that turn freely are solved for with their contact: a kept
  !> tangent takes tens of iterations as they turn, and shorter increments.
  subroutine prepare_finite_strain(reader, has_links, scene)
    type(reader_t), intent(inout) :: reader
    logical, intent(in) :: has_links !! of *MPC
    type(scene_t), intent(inout) :: scene
    character(:), allocatable :: beyond
    type(card_t) :: card
    integer :: i

    if (any(scene%pairs%small_sliding)) call note(reader, 'NLGEOM: SMALL SLIDING is ignored, '// &
      'surfaces face what they have slid to; --nlgeom no runs the deck by small strain')
    scene%pairs%small_sliding = .false.
    beyond = beyond_finite_strain(scene)
    if (beyond == '' .and. has_links) beyond = '*MPC, LINK: its nodes would move on circles, '// &
      'as those of a stiff SPRINGA do'
    if (beyond /= '') then
      call open_card(reader, findloc(reader%cards(:reader%n_cards)%keyword == 'STEP', .true., &
        dim=1), card)
      call report(reader, card%position, 'NLGEOM does not cover '//beyond, &
        '--nlgeom no runs the deck by small strain')
      return
    end if
    if (any(.not. scene%materials(scene%mesh%material)%law%elastic%is_isotropic)) call note( &
      reader, 'NLGEOM: of materials that are not isotropic it is not checked whether they lose '// &
      'their ellipticity, stretched far')
    if (has_card(reader, 'EQUATION')) call note(reader, 'NLGEOM: *EQUATION joins displacements '// &
      'along fixed directions and does not turn with the body')
    if (has_card(reader, 'PRE-TENSION SECTION')) call note(reader, 'NLGEOM: the normal of a '// &
      '*PRE-TENSION SECTION does not turn with the bolt')
    if (any(scene%mesh%element_kind == kind_c3d8b)) call note(reader, 'C3D8B at finite strain: '// &
      'pressed to 0.8 of its length, nearly incompressible material is unstable on the mesh, '// &
      'where it is not in nature; C3D8I neither locks nor does this')
    scene%precision%body_is_given = .true.
    scene%precision%factor_is_given = .true.
    scene%precision%low_rank_is_given = .true.
    if (scene%contact%compliance == compliance_auto) scene%contact%compliance = compliance_dense
    if (scene%precision%tangent_is_given .or. .not. allocated(scene%rotations)) return
    scene%precision%renews_tangent = scene%contact%solver == solver_auto .and. any( &
      [(is_turning(scene, i), i=1, size(scene%rotations))])
  end subroutine prepare_finite_strain

  !> *NODE, *ELEMENT and *BLOCK, in the order of the deck.
  subroutine read_mesh_cards(reader, model)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(inout) :: model
    type(card_t) :: card
    type(system_t) :: system
    integer(i8) :: work
    integer :: k

    work = 0
    do k = 1, reader%n_cards
      select case (reader%cards(k)%keyword)
      case ('NODE')
        call open_card(reader, k, card)
        call read_nodes(reader, card, system, model%mesh)
      case ('ELEMENT')
        call open_card(reader, k, card)
        call read_elements(reader, card, model%mesh)
      case ('BLOCK')
        call open_card(reader, k, card)
        call read_block(reader, card, model%mesh)
      case ('SYSTEM')
        call open_card(reader, k, card)
        call read_system(reader, card, system)
      case ('NGEN', 'NFILL', 'NCOPY', 'ELGEN', 'ELCOPY')
        call open_card(reader, k, card)
        call generate_mesh(reader, k, card, model%mesh, work)
      case default
        cycle
      end select
    end do
  end subroutine read_mesh_cards

  !> *HEADING: the lines below the first one are the title. Files that are included may have their
  !> own, which say nothing of the deck.
  subroutine read_heading(reader, title)
    type(reader_t), intent(inout) :: reader
    character(:), allocatable, intent(out) :: title
    integer, parameter :: max_title = 1000 !! [byte]
    type(card_t) :: card
    integer :: k, line, last

    title = ''
    do k = 1, reader%n_cards
      if (reader%cards(k)%keyword /= 'HEADING') cycle
      call open_card(reader, k, card)
      call allow_options(reader, card)
      if (reader%source%file(reader%cards(k)%header) /= 1) cycle
      if (len(title) > 0) then
        call note(reader, 'only the first *HEADING is the title: another one is left out')
        cycle
      end if
      do line = card%place%first, card%place%last
        if (.not. is_data_line(reader%source, line)) cycle
        last = min(reader%source%first(line + 1) - 2, reader%source%first(line) + max_title)
        ! Not in the middle of a UTF-8 character.
        do while (iand(iachar(reader%source%text(last + 1:last + 1)), 192) == 128)
          last = last - 1
        end do
        if (len(title) + last - reader%source%first(line) > max_title) exit
        if (len(title) > 0) title = title//new_line('a')
        title = title//trim(adjustl(reader%source%text(reader%source%first(line):last)))
      end do
    end do
  end subroutine read_heading

  !> Enter what the command line says in place of the deck's parameters.
  subroutine take_overrides(overrides, table, diagnostics, text)
    type(string_t), intent(in) :: overrides(:)
    type(parameter_table_t), intent(inout) :: table
    type(diagnostics_t), intent(inout) :: diagnostics
    character(:), allocatable, intent(out) :: text !! one a line
    integer :: i
    logical :: ok

    text = ''
    do i = 1, size(overrides)
      call add_override(table, overrides(i)%text, ok)
      if (.not. ok) call add_plain_mistake(diagnostics, 'error: --set '// &
        quoted(overrides(i)%text)//' is not of the form name=value', 0)
      if (i > 1) text = text//new_line('a')
      text = text//overrides(i)%text
    end do
  end subroutine take_overrides

  !> Report overrides that name no parameter of the deck.
  subroutine check_overrides(reader)
    type(reader_t), intent(inout) :: reader
    type(string_t), allocatable :: names(:)
    integer :: i

    allocate (names(reader%parameters%n))
    do i = 1, reader%parameters%n
      names(i)%text = reader%parameters%list(i)%name
    end do
    do i = 1, reader%parameters%n_overrides
      if (find_parameter(reader%parameters, reader%parameters%overrides(i)%name) > 0) cycle
      call report(reader, 0, 'the deck has no parameter '// &
        quoted(reader%parameters%overrides(i)%name)//' that --set could change', &
        guess(reader%parameters%overrides(i)%name, names))
    end do
  end subroutine check_overrides

  !> Note parameters that nothing uses.
  subroutine check_parameter_use(reader)
    type(reader_t), intent(inout) :: reader
    integer :: i

    do i = 1, reader%parameters%n
      if (reader%parameters%list(i)%used) cycle
      call note(reader, 'parameter '//quoted(reader%parameters%list(i)%name)//' is not used')
    end do
  end subroutine check_parameter_use

  !> A path's file name without folder and ending.
  pure function name_of(path) result(name)
    character(*), intent(in) :: path
    character(:), allocatable :: name
    integer :: dot

    name = path(index(path, '/', back=.true.) + 1:)
    dot = index(name, '.', back=.true.)
    if (dot > 1) name = name(:dot - 1)
  end function name_of

end module read_deck_mod
