!> What ends a run that found no solution, in words.
module refuse_unsolved_mod
  use kinds_mod, only: wp, i8
  use resource_limits_mod, only: has_memory
  use errors_mod, only: error_t, raise, exit_not_solved
  use text_mod, only: to_text, counted, percent
  use sorting_mod, only: sort_unique
  use choices_mod, only: choices_t
  use scene_mod, only: scene_t, master_name
  use bodies_mod, only: is_linear
  use controls_mod, only: local_uzawa, solver_sweeps, solver_auto, &
    precision_in_words, is_exact, compliance_products
  use contact_points_mod, only: contact_points_t
  use plan_mod, only: plan_t
  use increments_mod, only: increment_t, increment_name
  use increment_report_mod, only: increment_report_t, has_converged, is_solved, &
    contact_fields_t, certificate_t, worst_entry, ended_well, ended_at_limit, ended_stalled, &
    ended_unbalanced, ended_moving, ended_passed, ended_inverted, ended_out_of_balance, &
    ended_indefinite
  use formed_compliance_mod, only: dense_bytes
  use amounts_mod, only: bytes_in_words
  use mesh_mod, only: mesh_t, kind_c3d8
  use cells_mod, only: hexahedron_20_reduced
  use connectivity_mod, only: corners_in
  use inverted_elements_mod, only: jacobians_of
  use placement_mod, only: no_gap
  use stability_mod, only: stability_t
  use faces_between_nodes_mod, only: face_entry_t, entries_t, entered_at_end, entered_on_way, &
    entered_and_left
  use nodes_behind_mod, only: node_behind_t
  use bodies_inside_mod, only: inside_t
  use elasticity_mod, only: elasticity_t, bulk_modulus
  use law_limits_mod, only: stretched_t
  use console_mod, only: solver_name
  implicit none
  private

  public :: hint_t, refuse_unsolved, refuse_missed_contact, refuse_unfelt_overlap, &
    refuse_inverted, refuse_deep_overlap, refuse_folded, refuse_lost_energy, &
    refuse_gained_energy, refuse_lost_law, &
    refuse_unstable, refuse_jump, unstable_in_words, nearest_in_words, meshes_that_buckle, &
    nodes_in_words, stretches_in_words, neo_hooke_in_words, tolerance_in_reach, &
    next_tolerance, refuse_inside, refuse_folded_through, inside_in_words

  ! Beside displacements with contact: free sheets of elements 50 and 500 times as wide as high have
  ! 7e6 and 7e9 [-]
  real(wp), parameter :: far_off = 1.0e3_wp
  real(wp), parameter :: reach = 100.0_wp !! times the tolerance: a residual worth naming [-]

  !> With what an increment was solved that was not solved as it was asked for.
  type :: hint_t
    real(wp) :: tolerance = 0.0_wp !! 0: with none that was tried [-]
    integer :: parts = 0           !! as many equal ones; 0: in none
  end type hint_t

contains

  !> The tolerance that a residual just meets, in words; '' where it is far from the one asked for.
  pure function tolerance_in_reach(needed, tolerance) result(words)
    real(wp), intent(in) :: needed, tolerance !! residual reached, and asked for [-]
    character(:), allocatable :: words
    real(wp) :: met

    words = ''
    met = rounded_up(needed, tolerance)
    if (met > 0.0_wp) words = '; a tolerance of '//to_text(met, 2)//' would be met'
  end function tolerance_in_reach

  !> The tolerance that an increment which was not solved may meet; 0 where it is far from its own.
  pure real(wp) function next_tolerance(report, tolerance) result(next)
    type(increment_report_t), intent(in) :: report
    real(wp), intent(in) :: tolerance  !! that it has not met [-]
    real(wp) :: needed

    next = 0.0_wp
    if (any(report%ending%cause == [ended_unbalanced, ended_moving, ended_inverted, &
      ended_out_of_balance, ended_indefinite])) return
    needed = 0.1_wp*worst_entry(report%certificate)
    if (.not. has_converged(report)) needed = max(needed, report%residual)
    next = rounded_up(needed, tolerance)
    if (next <= tolerance) next = 0.0_wp
  end function next_tolerance

  !> The least Jacobian of an element in the mesh, beside its largest.
  pure real(wp) function least_of_largest(mesh, e) result(part)
    type(mesh_t), intent(in) :: mesh
    integer, intent(in) :: e

    associate (jacobians => jacobians_of(mesh%coordinates, mesh%connectivity, e))
      part = minval(jacobians)/maxval(jacobians)
    end associate
  end function least_of_largest

  !> A residual rounded up to one digit, with room for another order of summation; 0 where it is far
  !> above the tolerance.
  pure real(wp) function rounded_up(needed, tolerance) result(met)
    real(wp), intent(in) :: needed, tolerance !! residual reached, and asked for [-]
    real(wp) :: power

    met = 0.0_wp
    if (.not. (needed > 0.0_wp .and. needed <= reach*tolerance)) return
    power = 10.0_wp**floor(log10(1.01_wp*needed))
    met = ceiling(1.01_wp*needed/power)*power
  end function rounded_up

  !> A step that did not converge or is not certified ends the run; only comparisons (STOP=CHANGE)
  !> go on past one that converged and is not certified.
  subroutine refuse_unsolved(scene, plan, choices, increment, report, condition, hint, error)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    type(choices_t), intent(in) :: choices !! as they are now
    type(increment_t), intent(in) :: increment
    type(increment_report_t), intent(in) :: report
    real(wp), intent(in) :: condition !! of the stiffness, at least [-]
    type(hint_t), intent(in) :: hint
    type(error_t), allocatable, intent(out) :: error
    character(:), allocatable :: words
    integer(i8) :: bytes

    if (is_solved(scene, report)) return
    select case (report%ending%cause)
    case (ended_unbalanced)
      words = 'nothing balances the loads along '//report%ending%motions//new_line('a')//'  '// &
        what_would_balance()
      if (hint%parts > 0) words = 'no balance of the loads along '// &
        report%ending%motions//' was found in one increment, but in '// &
        to_text(hint%parts)//' parts of it: use smaller increments, or leave out DIRECT'
    case (ended_passed)
      words = passed()
    case (ended_inverted)
      associate (element => report%ending%element)
        words = 'element '//to_text(scene%mesh%element_id(element))//' turns inside out; '// &
          'smaller increments, a finer mesh or a better shape of it may help (undeformed its '// &
          'Jacobian falls to '//to_text(least_of_largest(scene%mesh, element), 2)// &
          ' of its largest)'
      end associate
    case (ended_out_of_balance)
      words = 'the forces of finite strain do not come to balance (what is left is '// &
        to_text(report%ending%how_far, 3)//' of the largest); smaller increments may help'
    case (ended_indefinite)
      words = 'the tangent stiffness of iteration '// &
        to_text(report%newton_raphson_iterations + 1)//' is not positive definite, and contact '// &
        'is not determined with it; SOLVER=AUTO of *CONTACT SOLVER, and TANGENT=KEPT of *BODY '// &
        'SOLVER, do without that'
    case (ended_moving)
      words = moving()
    case (ended_well)
      words = 'not certified, '//certificate_in_words(report%certificate)//', allowed '// &
        to_text(10.0_wp*choices%tolerance)//' (condition of the stiffness at least '// &
        to_text(condition, 2)//')'//torn_in_words(scene, plan%points, report)//inaccurate()
    case default
      words = unreached()
    end select
    if (hint%tolerance > 0.0_wp) words = words//'; with a tolerance of '// &
      to_text(hint%tolerance, 2)//' this increment is solved, and those after it were not tried'
    if (report%ending%cause /= ended_unbalanced) then
      if (choices%precision%iterative) then
        words = words//'; bodies were solved for by iteration: TYPE=FACTOR of *BODY SOLVER has '// &
          'other solvers of contact to fall back on'
      else if (choices%compliance == compliance_products .and. .not. has_converged(report) .and. &
        report%ending%cause /= ended_moving) then
        bytes = dense_bytes(sum(plan%rows))
        if (.not. has_memory(bytes)) words = words//'; other solvers need the dense contact '// &
          'matrix, '//bytes_in_words(real(bytes, wp))//' of memory'
      end if
      words = words//wedge_in_words(scene, plan%points, report%contact)
    end if
    call raise_at(increment, error, words)

  contains

    !> A contact solver that stopped above its tolerance.
    function unreached() result(words)
      character(:), allocatable :: words

      words = solver_name(report%solver)//' did not reach the tolerance '// &
        to_text(choices%tolerance)//' in '//to_text(report%contact_iterations)//' iterations, '// &
        ending()//' (best residual '//to_text(report%residual, 3)
      if (report%worst_point > 0) words = words//', largest at '// &
        node_name(scene, plan%points, report%worst_point)
      words = words//'; condition of the stiffness at least '//to_text(condition, 2)//')'
      if (scene%contact%local == local_uzawa .and. report%solver == solver_sweeps) words = words// &
        '; rho = '//to_text(scene%contact%rho)//' times its natural scale is outside the range '// &
        'in which Uzawa converges here: below 2, often less'
    end function unreached

    !> What arithmetic leaves of the certificate.
    function inaccurate() result(words)
      character(:), allocatable :: words

      words = ''
      if (.not. (is_exact(choices%precision) .or. choices%precision%iterative)) then
        words = '; the factor ('//precision_in_words(choices%precision)//') left '// &
          to_text(report%unrefined, 2)//' of the forces out of balance, Newton-Raphson '// &
          to_text(report%imbalance, 2)//'; full rank and FACTOR=DOUBLE of *PRECISION are more '// &
          'accurate'
      else if (report%certificate%equilibrium >= worst_entry(report%certificate)) then
        words = ': displacements in double precision cannot balance these forces any closer'
        if (report%without_contact > far_off .and. is_linear(scene)) words = ': without '// &
          'contact the loads would move the bodies '//to_text(report%without_contact, 1)// &
          ' times as far, and double precision loses as many digits of their forces; prescribe '// &
          'displacements instead of loads, or use thicker elements'
      end if
    end function inaccurate

    !> What an obstacle does that passes a point, and the increment in which it does not.
    function passed() result(words)
      character(:), allocatable :: words
      real(wp) :: length, power

      associate (point => report%ending%point, step => scene%steps(increment%step))
        ! Rounded down to one digit.
        length = report%ending%part_to_try*(increment%fraction - increment%begin)*step%period
        power = 10.0_wp**floor(log10(max(length, tiny(1.0_wp))))
        words = node_name(scene, plan%points, point)//' of '// &
          scene%surfaces(scene%pairs(plan%points%pair(point))%surface)%name
        if (report%ending%part_to_try >= 1.0_wp) then
          words = master_name(scene, plan%points%pair(point))//' presses '//words// &
            ' from inside its body; is the body on the right side of it, and are all faces '// &
            'that it may touch in the surface?'
          return
        end if
        words = master_name(scene, plan%points%pair(point))//' passes '//words// &
          ' within the increment and would press it from behind; use '
        if (report%ending%part_to_try < 0.5_wp) then
          words = words//'increments of '//to_text(floor(length/power)*power, 1)//' or less'
          if (step%direct) words = words//', or leave out DIRECT'
        else
          words = words//'smaller elements, or a slave surface with all faces that may touch'
        end if
      end associate
    end function passed

    !> What to look at where loads are not balanced.
    function what_would_balance() result(words)
      character(:), allocatable :: words

      if (report%ending%pulls_off) then
        words = 'they pull the body off what it touches: a pressure is positive into the body, '// &
          'and forces point along the axes; is a sign wrong?'
      else if (size(scene%pairs) > 0) then
        words = 'supports (*BOUNDARY), contact or friction must hold this motion; a *DYNAMIC '// &
          'step lets it go'
      else
        words = 'supports (*BOUNDARY) or a *CONTACT PAIR must hold this motion; a *DYNAMIC '// &
          'step lets it go'
      end if
    end function what_would_balance

    !> Contact points that have not settled.
    function moving() result(words)
      character(:), allocatable :: words

      words = 'the contact points on curved obstacles'
      associate (point => report%ending%point)
        if (point > 0) words = 'the contact points on the master of '// &
          scene%pairs(plan%points%pair(point))%name//', most of all '// &
          node_name(scene, plan%points, point)//','
      end associate
      words = words//' do not settle ('
      if (report%ending%how_far < epsilon(1.0_wp)*no_gap) then
        words = words//'they still move by '//to_text(report%ending%how_far, 3)
      else
        words = words//'their master covers one of them at times'
      end if
      words = words//'); smaller increments '
      if (scene%contact%solver /= solver_auto) words = words//'or SOLVER=AUTO '
      words = words//'may help'
    end function moving

    !> Why a contact solver gave up.
    function ending() result(words)
      character(:), allocatable :: words

      select case (report%ending%cause)
      case (ended_at_limit)
        words = 'their limit'
      case (ended_stalled)
        words = 'no longer making progress'
      case default
        words = 'with reactions growing without bound'
      end select
    end function ending

  end subroutine refuse_unsolved

  !> An error that says in which increment it is.
  pure subroutine raise_at(increment, error, words)
    type(increment_t), intent(in) :: increment
    type(error_t), allocatable, intent(out) :: error
    character(*), intent(in) :: words

    call raise(error, exit_not_solved, increment_name(increment)//': '//words)
  end subroutine raise_at

  !> Where the largest reactions belong to one node and balance one another, in words; else ''.
  !>
  !> The cones of friction of two contacts may hold opposite forces. Reactions can then be added to
  !> a node without bound, and where it would have to slide along both there need be no solution.
  pure function wedge_in_words(scene, points, contact) result(words)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(contact_fields_t), intent(in) :: contact
    character(:), allocatable :: words
    real(wp), parameter :: small = 1.0e-2_wp !! sum of such reactions, of the largest [-]
    real(wp) :: force(3, points%n)
    integer :: i, worst

    words = ''
    if (points%n == 0) return
    do i = 1, points%n
      force(:, i) = matmul(contact%frame(:, :, i), contact%reaction(:, i))
    end do
    worst = maxloc(norm2(contact%reaction, 1), 1)
    associate (node => points%node(worst))
      if (count(points%node == node) < 2 .or. .not. norm2(force(:, worst)) > 0.0_wp) return
      if (norm2([(sum(force(i, :), points%node == node), i = 1, 3)]) > &
        small*norm2(force(:, worst))) return
      words = '; node '//to_text(scene%mesh%node_id(node))//' is wedged: its reactions, up to '// &
        to_text(norm2(force(:, worst)), 2)//', balance one another, and with so much '// &
        'friction there may be no solution'
    end associate
  end function wedge_in_words

  !> What to do where the mean gap of a point is over both faces of a step, or of a concave edge;
  !> '' where that of none is.
  pure function torn_in_words(scene, points, report) result(words)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(increment_report_t), intent(in) :: report
    character(:), allocatable :: words
    integer, allocatable :: of_point(:), of_master(:) !! bodies
    integer :: point, pair

    words = ''
    point = report%certificate%torn_point
    if (point == 0) return
    pair = points%pair(point)
    words = ': '//node_name(scene, points, point)//' of '// &
      scene%surfaces(scene%pairs(pair)%surface)%name//' faces both sides of a step or of a '// &
      'concave edge of its master, and a mean over both is no contact: '
    allocate (of_point(0), of_master(0))
    if (scene%pairs(pair)%master == 0) then
      associate (weights => report%contact%weights)
        of_point = scene%mesh%body(weights%node(weights%first(point):weights%first(point + 1) - 1))
      end associate
      of_master = scene%mesh%body(scene%surfaces(scene%pairs(pair)%master_surface)%nodes)
      call sort_unique(of_point)
      call sort_unique(of_master)
    end if
    if (size(of_point) > 1) then
      words = words//'the master '//master_name(scene, pair)//' has '// &
        to_text(size(of_master))//' bodies that part: give each a pair of its own'
    else
      words = words//'use smaller faces of the slave there, or give each side of '// &
        master_name(scene, pair)//' a pair of its own'
    end if
  end function torn_in_words

  !> "node 17", of a contact point.
  pure function node_name(scene, points, point) result(name)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: point
    character(:), allocatable :: name

    name = 'node '//to_text(scene%mesh%node_id(points%node(point)))
  end function node_name

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

  !> An element that is inside out ends the run: no theory has such a body.
  subroutine refuse_inverted(scene, increment, element, least, error)
    type(scene_t), intent(in) :: scene
    type(increment_t), intent(in) :: increment
    integer, intent(in) :: element
    real(wp), intent(in) :: least !! det(I + grad u) [-]
    type(error_t), allocatable, intent(out) :: error

    call raise_at(increment, error, 'element '//to_text(scene%mesh%element_id(element))// &
      ' is turned inside out, det(I + grad u) = '//to_text(least, 2)//': the body would go '// &
      'through itself, far beyond small strain; check loads, prescribed displacements '// &
      'and units')
  end subroutine refuse_inverted

  !> A law that has lost its ellipticity ends the run: what follows depends on the mesh.
  subroutine refuse_lost_law(scene, increment, lost, error)
    type(scene_t), intent(in) :: scene
    type(increment_t), intent(in) :: increment
    type(stretched_t), intent(in) :: lost
    type(error_t), allocatable, intent(out) :: error

    associate (material => scene%materials(scene%mesh%material(lost%element)))
      call raise_at(increment, error, 'the law of material '//material%name//' does not hold '// &
        'in element '//to_text(scene%mesh%element_id(lost%element))//', stretched by '// &
        stretches_in_words(lost%stretch)//': it has lost its ellipticity (its acoustic tensor '// &
        'is not positive), and a layer of elements collapses or tears; smaller increments do '// &
        'not help; '//neo_hooke_in_words(material%law%elastic)//' holds at all stretches')
    end associate
  end subroutine refuse_lost_law

  !> "0.702, 1 and 1".
  pure function stretches_in_words(stretch) result(words)
    real(wp), intent(in) :: stretch(3) !! the largest first [-]
    character(:), allocatable :: words

    words = to_text(stretch(3), 3)//', '//to_text(stretch(2), 3)//' and '//to_text(stretch(1), 3)
  end function stretches_in_words

  !> The neo-Hookean law of an elasticity, as a deck has it.
  pure function neo_hooke_in_words(elastic) result(words)
    type(elasticity_t), intent(in) :: elastic
    character(:), allocatable :: words

    words = '*HYPERELASTIC, NEO HOOKE with C10 = '//to_text(0.5_wp*elastic%shear, 4)// &
      ' and D1 = '//to_text(2.0_wp/bulk_modulus(elastic), 4)
  end function neo_hooke_in_words

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

  !> A contact face whose corner has been pushed or twisted inwards ends the run: no gap, weight or
  !> pressure is computed over it.
  subroutine refuse_folded(scene, points, increment, point, error)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(increment_t), intent(in) :: increment
    integer, intent(in) :: point !! as of certificate_t
    type(error_t), allocatable, intent(out) :: error

    if (point == 0) return
    call raise_at(increment, error, 'at '//node_name(scene, points, point)//' of '// &
      scene%pairs(points%pair(point))%name//' a face is folded, or one before it: seen along '// &
      'the normal of the first surface a corner points inwards, and contact cannot be '// &
      'computed there; less motion, less load, or other faces')
  end subroutine refuse_folded

  !> Energy that contact gives or takes along the path, and that smaller increments do not make
  !> smaller, ends the run. docs/theory.md (6.5).
  subroutine refuse_lost_energy(increment, report, error)
    type(increment_t), intent(in) :: increment
    type(increment_report_t), intent(in) :: report
    type(error_t), allocatable, intent(out) :: error

    associate (left => report%left_over, strain => report%energy%strain)
      if (.not. left(1) > 0.0_wp) return
      call raise_at(increment, error, 'contact gains or loses '//to_text(left(1), 2)// &
        ' of energy that is neither work nor friction, beside a strain energy of '// &
        to_text(strain, 2)//', and '//to_text(left(2), 2)//' in increments of a quarter of the '// &
        'size: points pass edges or their master turns too far; use much smaller increments, '// &
        'or another mesh')
    end associate
  end subroutine refuse_lost_energy

  !> Bodies must not gain energy that nothing has given them.
  subroutine refuse_gained_energy(mesh, increment, report, error)
    type(mesh_t), intent(in) :: mesh
    type(increment_t), intent(in) :: increment
    type(increment_report_t), intent(in) :: report
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: most = 0.03_wp !! of the largest energy so far [-]

    character(:), allocatable :: whom, given

    if (max(report%energy%risen, report%energy%risen_of_one) <= most) return
    whom = 'the bodies'
    given = percent(report%energy%risen)//' of their'
    if (report%energy%risen <= most) then
      whom = 'the body of node '//to_text(mesh%node_id(findloc(mesh%body, &
        report%energy%risen_body, dim=1)))
      given = percent(report%energy%risen_of_one)//' of its'
    end if
    call raise_at(increment, error, 'contact and the scheme in time have given '//whom//' '//given &
      //' largest energy, and in nature they give none: increments no longer than an element '// &
      'over the speed of sound give less, and an ALPHA of *DYNAMIC below 0 takes some')
  end subroutine refuse_gained_energy

  !> An equilibrium that the least disturbance leaves is not what a body does.
  subroutine refuse_unstable(mesh, increment, stability, error)
    type(mesh_t), intent(in) :: mesh
    type(increment_t), intent(in) :: increment
    type(stability_t), intent(in) :: stability !! with unstable motions
    type(error_t), allocatable, intent(out) :: error

    call raise_at(increment, error, 'the equilibrium is unstable'//unstable_in_words(stability))
    error%n_meshes = meshes_that_buckle(mesh)
  end subroutine refuse_unstable

  !> How many meshes have to buckle until all finer ones do. Those are softer, so one is enough, but
  !> for elements that may be too soft where they are large.
  pure integer function meshes_that_buckle(mesh) result(n)
    type(mesh_t), intent(in) :: mesh

    n = merge(1, 2, all(mesh%element_kind == kind_c3d8 .and. mesh%connectivity%cell /= &
      hexahedron_20_reduced))
  end function meshes_that_buckle

  !> A solution beyond which the one before does not go on.
  subroutine refuse_jump(increment, lost, strain, error)
    type(increment_t), intent(in) :: increment
    real(wp), intent(in) :: lost, strain !! energy that is lost, and of the strains [energy]
    type(error_t), allocatable, intent(out) :: error

    call raise_at(increment, error, 'the solution jumps: '//to_text(lost, 2)//' of energy is '// &
      'neither work nor friction, beside a strain energy of '//to_text(strain, 2)// &
      ', however small the increment. The body snaps over to another shape, or a surface slips '// &
      'off its master at once; what it does then is a matter of its inertia'//new_line('a')// &
      '  Prescribed motions instead of forces, a finer mesh at edges, or a step that ends '// &
      'before, may avoid it')
    error%n_meshes = 2
  end subroutine refuse_jump

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

  !> In how many ways an equilibrium is unstable, and what may be done.
  pure function unstable_in_words(stability) result(words)
    type(stability_t), intent(in) :: stability
    character(:), allocatable :: words

    words = ' ('//counted(stability%n_unstable, 'motion')//' of the body would release '// &
      'energy): it buckles'
    if (stability%by_element) then
      words = words//', or the elements do: C3D8I instead of C3D8B, or smaller strains, tell'
    else
      words = words//'; a small imperfection of its shape or a small force across it leads to '// &
        'the stable equilibrium'
    end if
  end function unstable_in_words

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

  pure function certificate_in_words(c) result(words)
    type(certificate_t), intent(in) :: c
    character(:), allocatable :: words

    words = 'penetration '//to_text(c%penetration, 2)//', adhesion '//to_text(c%adhesion, 2)// &
      ', complementarity '//to_text(c%complementarity, 2)//', cone '//to_text(c%cone, 2)// &
      ', law '//to_text(c%law, 2)//', equilibrium '//to_text(c%equilibrium, 2)//', balance '// &
      to_text(c%balance, 2)
    if (c%energy > 0.0_wp) words = words//', energy '//to_text(c%energy, 2)
    if (c%undetermined > 0.0_wp) words = words//', reactions that nothing determines '// &
      to_text(c%undetermined, 2)
    if (c%dissipation > 0.0_wp) words = words//', work done by friction '//to_text(c%dissipation, 2)
    if (c%support > 0.0_wp) words = words//', supports kept to '//to_text(c%support, 2)
  end function certificate_in_words

end module refuse_unsolved_mod
