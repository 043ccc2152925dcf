!> The table of a plan: what exists in the run and why, a line each.
!>
!> A line is its name, how it is meant (fixed, at most, about), and the rest in words.
module plan_table_mod
  use kinds_mod, only: wp
  use text_mod, only: string_t, to_text, counted, percent
  use friction_laws_mod, only: falls_with_rate, friction_law_t
  use scene_mod, only: scene_t
  use controls_mod, only: subject_in_words, is_bounded, contact_controls_t, solver_auto, &
                          solver_global_newton, formulation_bipotential, stop_at_change, &
                          is_exact, accuracy_controls_t, precision_in_words
  use output_field_mod, only: field_t, at_start
  use view_fields_mod, only: list_view_fields
  use gauss_fields_mod, only: list_gauss_fields
  use compliance_mod, only: rows_worth_rounding
  use contact_points_mod, only: contact_nodes, n_sides
  use plan_mod, only: plan_t, bound_fixed, bound_at_most, bound_about, bound_in_words
  use rigid_modes_mod, only: free_motions_t
  use describe_motions_mod, only: body_in_words, motions_together
  use alternatives_mod, only: where_in_words
  use amounts_mod, only: bytes_in_words, bounds_in_words
  use shadow_run_mod, only: count_shadows
  use dynamic_step_mod, only: crossing_time
  use mesh_mod, only: mesh_t, plane_strain, plane_stress, axisymmetric
  implicit none
  private

  public :: describe, describe_choice, describe_products, describe_iterative, &
    bound_of_increments, add_line

  integer, parameter :: most_listed = 6 !! bodies or pairs that get a line of their own
  character(*), parameter :: factorisations = 'factorisations'
  character(*), parameter :: matrix_line = 'contact matrix'
  integer, parameter :: name_width = 16, bound_width = 9 !! of a line's first two columns

contains

  !> Begin the table: what the scene alone says.
  subroutine describe(scene, motions, plan)
    type(scene_t), intent(in) :: scene
    type(free_motions_t), intent(in) :: motions !! that the supports of the first step leave
    type(plan_t), intent(inout) :: plan
    character(:), allocatable :: mesh, accuracy
    integer :: bound
    real(wp) :: copy !! of the contact matrix in single precision, a number [bytes]

    allocate (plan%lines(0), plan%brief(0))
    bound = bound_at_most
    if (plan%is_constant) bound = bound_fixed
    mesh = to_text(size(scene%mesh%element_nodes))//' nodes, '//to_text(scene%mesh%n_elements)// &
      ' elements'
    call add_line(plan, 'mesh', bound_fixed, mesh, mesh)
    mesh = plane_in_words(scene%mesh)
    if (mesh /= '') call add_line(plan, 'model', bound_fixed, mesh, mesh)
    call describe_bodies(scene, motions, plan)
    call add_line(plan, 'equations', bound, to_text(plan%n_equations)//', '// &
      to_text(plan%n_interface)//' of them on contact nodes')
    if (plan%points%n > 0) call describe_pairs(scene, plan)
    if (sum(plan%rows) > 0) then
      copy = merge(2.0_wp, 0.0_wp, sum(plan%rows) >= rows_worth_rounding)
      call add_line(plan, matrix_line, bound, blocks_in_words(plan)// &
        ' on contact nodes, '//to_text(sum(plan%rows))//' x '// &
        to_text(sum(plan%rows))//' for the reactions: dense, double precision'// &
        trim(merge(' and a copy in single precision', repeat(' ', 31), copy > 0.0_wp))// &
        ', '//bytes_in_words(8.0_wp*sum(real(plan%blocks, wp)**2) + &
        (8.0_wp + copy)*real(sum(plan%rows), wp)**2))
    end if
    call add_line(plan, factorisations, merge(bound_about, bound_at_most, scene%finite_strain), &
      factorisations_in_words(plan, scene%finite_strain))
    call add_line(plan, 'increments', bound_of_increments(scene, plan), &
      increments_in_words(scene, plan), counted_increments(scene, plan))
    if (any(scene%steps%is_dynamic)) call add_line(plan, 'inertia', 0, 'sound takes '// &
      to_text(crossing_time(scene, plan%points), 2)//' across the smallest element at contact: '// &
      'what impacts want of increments')
    accuracy = accuracy_in_words(scene%accuracy)
    if (scene%accuracy%wanted > 0.0_wp .or. is_bounded(scene%accuracy)) call add_line(plan, &
      'accuracy', 0, accuracy, accuracy)
    if (count_shadows(scene) > 0 .and. .not. plan%choices%precision%iterative) call add_line(plan, &
      'small strain', 0, 'its error by a run at finite strain beside this one'//trim(merge( &
      ', with each of two laws', repeat(' ', 23), count_shadows(scene) > 1)))
    if (sum(plan%rows) > 0) call add_line(plan, 'contact solver', 0, &
      solver_in_words(scene%contact, plan%choices%tolerance, scene%finite_strain .and. &
      plan%choices%precision%renews_tangent))
    call add_line(plan, 'fields', bound_of_increments(scene, plan), fields_in_words(scene, plan))
  end subroutine describe

  !> Plane stress, thickness 1 (not given); empty of solids.
  pure function plane_in_words(mesh) result(words)
    type(mesh_t), intent(in) :: mesh
    character(:), allocatable :: words

    words = ''
    select case (mesh%plane)
    case (plane_strain)
      words = 'plane strain (CPE)'
    case (plane_stress)
      words = 'plane stress (CPS)'
    case (axisymmetric)
      words = 'bodies of revolution (CAX) about the y axis, forces are for 360 degrees'
      return
    case default
      return
    end select
    words = words//', thickness '//to_text(mesh%thickness(1), 6)
    if (mesh%thickness(2) > mesh%thickness(1)) words = words//' to '//to_text(mesh%thickness(2), 6)
    if (.not. mesh%is_thickness_given) words = words//' (not given)'
  end function plane_in_words

  !> 75 x 75, or of several bodies 2 blocks, the largest 75 x 75,
  function blocks_in_words(plan) result(words)
    type(plan_t), intent(in) :: plan
    character(:), allocatable :: words

    words = to_text(maxval([plan%blocks, 0]))
    words = words//' x '//words
    if (size(plan%blocks) > 1) words = to_text(size(plan%blocks))//' blocks, the largest '// &
      words//','
  end function blocks_in_words

  !> How the number of increments is meant: fixed where no *STEP lets them be cut.
  pure integer function bound_of_increments(scene, plan)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan

    bound_of_increments = bound_about
    if (all(scene%steps%direct) .and. plan%n_cuts == 0) bound_of_increments = bound_fixed
  end function bound_of_increments

  !> 50 in 2 steps; up to 4 more at breakpoints of amplitudes or first contact; halved if not
  !> converged.
  pure function increments_in_words(scene, plan) result(words)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    character(:), allocatable :: words

    words = counted_increments(scene, plan)
    if (plan%n_fewest < plan%n_increments) words = words// &
      ', which grow while load steps make little error'
    if (plan%n_cuts > 0) words = words//'; '//to_text(plan%n_cuts)// &
      ' more for the accuracy or for obstacles that turn'
    if (all(scene%steps%direct)) return
    if (plan%n_events > 0) words = words//'; up to '//to_text(plan%n_events)// &
      ' more at breakpoints of amplitudes or first contact'
    words = words//'; halved if not converged'
    if (any(scene%steps%is_dynamic .and. .not. scene%steps%direct)) words = words// &
      ' or wrong in time, doubled while they are hardly so'
    if (scene%accuracy%wanted > 0.0_wp) words = words//' or not accurate enough'
  end function increments_in_words

  !> 50 in 2 steps; 17 to 100 in 1 step where they may grow.
  pure function counted_increments(scene, plan) result(words)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    character(:), allocatable :: words

    words = to_text(plan%n_increments)//' in '//counted(size(scene%steps), 'step')
    if (plan%n_fewest < plan%n_increments) words = to_text(plan%n_fewest)//' to '//words
  end function counted_increments

  !> 1 % of the contact forces; the mesh is chosen for it, within 60 s of CPU time.
  function accuracy_in_words(accuracy) result(words)
    type(accuracy_controls_t), intent(in) :: accuracy
    character(:), allocatable :: words

    words = 'any'
    if (accuracy%wanted > 0.0_wp) then
      words = percent(accuracy%wanted)//' of '//subject_in_words(accuracy)
      if (accuracy%keeps_mesh) then
        words = words//', at the end of each step'
      else
        words = words//'; the mesh is chosen for it'
      end if
    else if (.not. accuracy%keeps_mesh) then
      words = 'the best of '//subject_in_words(accuracy)//'; the mesh is chosen for it'
    end if
    if (is_bounded(accuracy)) words = words//', within '//bounds_in_words(accuracy)
  end function accuracy_in_words

  !> Where W is not formed: that in the table, and why.
  subroutine describe_products(plan, why)
    type(plan_t), intent(inout) :: plan
    character(*), intent(in) :: why !! in words

    call replace_words(plan, matrix_line, to_text(sum(plan%rows))//' x '// &
      to_text(sum(plan%rows))// &
      ' for the reactions, not formed: each product with it is a solution with the factor ('// &
      why//'; dense it would take '//bytes_in_words(8.0_wp*sum(real(plan%blocks, wp)**2) + &
      8.0_wp*real(sum(plan%rows), wp)**2)//')')
  end subroutine describe_products

  !> Where bodies are solved for by iteration, and contact together with them.
  subroutine describe_iterative(plan)
    type(plan_t), intent(inout) :: plan

    call replace_words(plan, matrix_line, &
      'none: contact is solved together with the displacements')
    call replace_words(plan, factorisations, factorisations_in_words(plan, .false.))
  end subroutine describe_iterative

  !> Where the plan has chosen how the stiffness is factorised: that in the table, and why.
  subroutine describe_choice(scene, reasons, plan)
    type(scene_t), intent(in) :: scene
    character(*), intent(in) :: reasons   !! why nothing better, in words
    type(plan_t), intent(inout) :: plan

    call replace_words(plan, factorisations, factorisations_in_words(plan, scene%finite_strain))
    call add_line(plan, 'chosen', 0, where_in_words(plan%choices%precision)//': '//reasons)
  end subroutine describe_choice

  !> Give the line of a name other words, where it is there.
  subroutine replace_words(plan, name, words)
    type(plan_t), intent(inout) :: plan
    character(*), intent(in) :: name, words
    integer :: i

    do i = 1, size(plan%lines)
      associate (line => plan%lines(i))
        if (index(line%text, name//' ') == 1) line%text = line%text(:name_width + bound_width)// &
          words
      end associate
    end do
  end subroutine replace_words

  !> A line of the table; without a bound (0) its column stays empty.
  subroutine add_line(plan, name, bound, words, brief)
    type(plan_t), intent(inout) :: plan
    character(*), intent(in) :: name, words
    integer, intent(in) :: bound
    character(*), intent(in), optional :: brief !! in the words that every run prints
    character(name_width) :: column
    character(bound_width) :: meant

    column = name
    meant = ''
    if (bound > 0) meant = bound_in_words(bound)
    call append_text(plan%lines, column//meant//trim(words))
    if (present(brief)) call add_brief(plan, name, brief)
  end subroutine add_line

  !> A line of what every run prints.
  subroutine add_brief(plan, name, words)
    type(plan_t), intent(inout) :: plan
    character(*), intent(in) :: name, words
    character(name_width) :: column

    column = name
    call append_text(plan%brief, column//words)
  end subroutine add_brief

  !> One more text behind a list. (With gfortran 12 texts of constructors within a list leak.)
  pure subroutine append_text(list, text)
    type(string_t), allocatable, intent(inout) :: list(:)
    character(*), intent(in) :: text
    type(string_t), allocatable :: longer(:)
    integer :: i

    allocate (longer(size(list) + 1))
    do i = 1, size(list)
      call move_alloc(list(i)%text, longer(i)%text)
    end do
    longer(size(longer))%text = text
    call move_alloc(longer, list)
  end subroutine append_text

  !> Which bodies their supports hold, which contact must hold, and which nothing can.
  subroutine describe_bodies(scene, motions, plan)
    type(scene_t), intent(in) :: scene
    type(free_motions_t), intent(in) :: motions
    type(plan_t), intent(inout) :: plan
    logical :: touches(0:scene%mesh%n_bodies), held(0:scene%mesh%n_bodies)
    character(:), allocatable :: held_by
    integer :: i, j, n, listed

    touches = .false.
    held = .true.
    touches(scene%mesh%body(contact_nodes(plan%points))) = .true.
    touches(0) = .true.
    held(motions%body) = .false.
    n = count(held(1:))
    if (n > 0) call add_line(plan, 'bodies', bound_fixed, to_text(n)//', held by '// &
      trim(merge('its  ', 'their', n == 1))//' supports')
    j = 1
    listed = 0
    do while (j <= motions%n)
      n = motions_together(motions, j)
      held_by = 'held by contact alone'
      i = motions%body(j)
      if (.not. touches(i)) held_by = 'held by nothing'
      if (n == 6 .and. touches(i)) held_by = 'held by contact alone: it has no supports'
      listed = listed + 1
      if (listed <= most_listed) call add_line(plan, 'free motions', bound_at_most, &
        to_text(n)//' of '//body_in_words(scene%mesh, motions, j)//', '//held_by)
      j = j + n
    end do
    if (listed > most_listed) call add_line(plan, 'free motions', bound_at_most, 'those of '// &
      to_text(listed - most_listed)//' more bodies or obstacles: '//to_text(motions%n)//' in all')
  end subroutine describe_bodies

  !> A line a pair: its points by the reactions they have. In brief a line in all.
  subroutine describe_pairs(scene, plan)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(inout) :: plan
    integer :: i, listed

    listed = min(size(scene%pairs), most_listed)
    do i = 1, listed
      call add_line(plan, 'contact', bound_at_most, points_in_words(scene, plan, i, .true.))
    end do
    associate (a => plan%points%first(listed + 1))
      if (listed < size(scene%pairs)) call add_line(plan, 'contact', bound_at_most, &
        to_text(size(scene%pairs) - listed)//' more pairs: '// &
        to_text(count(plan%points%in_reach(a:)))//' points, '// &
        counted(sum(plan%rows(a:)), 'reaction'))
    end associate
    if (size(scene%pairs) == 1) then
      call add_brief(plan, 'contact', points_in_words(scene, plan, 1, .false.))
    else
      call add_brief(plan, 'contact', to_text(size(scene%pairs))//' pairs, '// &
        to_text(count(plan%points%in_reach))//' points')
    end if
  end subroutine describe_pairs

  !> Of a pair: mu = 0.3; or mu = 0.1 to 0.3 by the pressure (or the rate of slip), a friction
  !> stress of at most 5.
  pure function friction_in_words(law, mu) result(words)
    type(friction_law_t), intent(in) :: law
    real(wp), intent(in) :: mu !! the largest [-]
    character(:), allocatable :: words

    words = ', mu = '
    if (allocated(law%share)) words = words//to_text(mu*minval(law%share))//' to '
    if (falls_with_rate(law)) words = words//to_text(mu*law%kinetic)//' to '
    words = words//to_text(mu)
    if (falls_with_rate(law)) words = words//' by the rate of slip'
    if (allocated(law%share)) words = words//' by the pressure'
    if (law%most < huge(1.0_wp)) words = words//', a friction stress of at most '// &
      to_text(mu*law%most)
  end function friction_in_words

  !> top:tool: 289 points, mu = 0.3, 3 reactions each; or 25 points, mu = 0.3: 20 with 3 reactions,
  !> 5 with 2 reactions (one tangent prescribed); and how many cannot reach the obstacle.
  pure function points_in_words(scene, plan, i, with_reactions) result(words)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    integer, intent(in) :: i !! the pair
    logical, intent(in) :: with_reactions
    character(:), allocatable :: words
    integer, allocatable :: kept(:)
    integer :: n, of_kind

    associate (a => plan%points%first(i), b => plan%points%first(i + 1) - 1, &
               sides => n_sides(plan%points, i), mu => scene%pairs(i)%mu)
      kept = pack(plan%rows(a:b), plan%points%in_reach(a:b))
      words = scene%pairs(i)%name//': '//counted(size(kept), 'point')
      if (size(kept) < b - a + 1) words = words//' of '//to_text(b - a + 1)// &
        ' (the others cannot reach it)'
      if (sides > 1) words = words//' before '//to_text(sides)// &
        ' sides of the master, which concave edges or steps divide'
      if (size(kept) == 0) return
      if (mu > 0.0_wp) words = words//friction_in_words(scene%pairs(i)%law, mu)
      if (mu <= 0.0_wp) words = words//', frictionless'
      if (.not. with_reactions) return
      if (all(kept == kept(1)) .and. kept(1) > 0) then
        words = words//', '//counted(kept(1), 'reaction')//' each'
        return
      end if
      words = words//':'
      do n = 3, 0, -1
        of_kind = count(kept == n)
        if (of_kind == 0) cycle
        words = words//' '//to_text(of_kind)//' with '//counted(n, 'reaction')
        if (n == 0) words = words//' (normal prescribed)'
        if (n == 2) words = words//' (one tangent prescribed)'
        if (n == 1 .and. mu > 0.0_wp) words = words//' (both prescribed)'
        words = words//','
      end do
    end associate
    words = words(:len(words) - 1)
  end function points_in_words

  function factorisations_in_words(plan, is_finite) result(words)
    type(plan_t), intent(in) :: plan
    logical, intent(in) :: is_finite !! strain
    character(:), allocatable :: words

    if (plan%choices%precision%iterative) then
      words = 'none: solutions '//precision_in_words(plan%choices%precision)//', coarsened for '// &
        counted(plan%n_factorisations, 'set')//' of supports'
      return
    end if
    words = '1 for the whole run (small strain, same supports throughout)'
    if (plan%n_factorisations > 1) words = to_text(plan%n_factorisations)// &
      ' (steps prescribe different degrees of freedom)'
    if (is_finite) words = to_text(plan%n_factorisations)// &
      ', and of tangents as iterations take longer (finite strain)'
    if (plan%n_tangents > 0) words = to_text(plan%n_factorisations + plan%n_tangents)// &
      ', of the tangent in every iteration (finite strain, TANGENT=NEWTON)'
    words = words//'; LDL^T, '//where_in_words(plan%choices%precision)
    if (.not. is_exact(plan%choices%precision)) words = words//', refined in double precision'
  end function factorisations_in_words

  !> What is written, and how often.
  function fields_in_words(scene, plan) result(words)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    character(:), allocatable :: words
    type(field_t), allocatable :: fields(:)

    words = ''
    call list_view_fields(scene, plan%points%n > 0, fields)
    call add_names(fields, '')
    call list_gauss_fields(scene, fields)
    call add_names(fields, ' at Gauss points')
    if (words == '' .or. plan%n_outputs == 0) then
      words = 'none'
    else
      words = words(3:)//', at '//counted(plan%n_outputs, 'increment')
    end if

  contains

    !> The names of fields that are not there yet.
    subroutine add_names(of, place)
      type(field_t), intent(in) :: of(:)
      character(*), intent(in) :: place !! said behind each
      character(:), allocatable :: name
      integer :: i, k

      do i = 1, size(of)
        if (of(i)%written == at_start) cycle
        name = of(i)%name(index(of(i)%name, '/') + 1:)
        do k = 1, len(name)
          if (name(k:k) == '_') name(k:k) = ' '
        end do
        if (index(words//',', ', '//name//place//',') == 0) words = words//', '//name//place
      end do
    end subroutine add_names

  end function fields_in_words

  pure function solver_in_words(controls, tolerance, renews_tangent) result(words)
    type(contact_controls_t), intent(in) :: controls
    real(wp), intent(in) :: tolerance
    logical, intent(in) :: renews_tangent !! at finite strain
    character(:), allocatable :: words

    if (renews_tangent .and. controls%solver == solver_auto) then
      words = 'Newton''s method for displacements and contact forces together (finite strain, '// &
        'TANGENT=NEWTON); tolerance '//to_text(tolerance)
      return
    end if
    select case (controls%solver)
    case (solver_auto)
      words = 'automatic: global Newton, then accelerated sweeps if that fails; '
    case (solver_global_newton)
      words = 'global Newton, '
    case default
      words = sweeps_in_words(controls)
    end select
    words = words//'tolerance '//to_text(tolerance)
    if (controls%stop_rule == stop_at_change) words = words//' on the change per sweep'
    if (controls%solver /= solver_global_newton) words = words//', at most '// &
      to_text(controls%max_sweeps)//' sweeps'
  end function solver_in_words

  pure function sweeps_in_words(controls) result(words)
    type(contact_controls_t), intent(in) :: controls
    character(:), allocatable :: words
    character(*), parameter :: solvers(*) = [character(12) :: 'Uzawa', 'Newton (3x3)', &
      'Newton (6x6)', 'exact'] !! local_uzawa and its kin

    words = 'sweeps, pseudo-potential, local '
    if (controls%formulation == formulation_bipotential) words = 'sweeps, bi-potential, local '
    words = words//trim(solvers(controls%local))//', rho '//to_text(controls%rho)// &
      ', relaxation '//to_text(controls%relaxation)//', '
  end function sweeps_in_words

end module plan_table_mod
