!> An increment that did not converge or is not certified ends a run: why, in words.
module refuse_unsolved_mod
  use kinds_mod, only: wp, i8
  use resource_limits_mod, only: has_memory
  use errors_mod, only: error_t
  use text_mod, only: to_text
  use sorting_mod, only: sort_unique
  use choices_mod, only: choices_t
  use scene_mod, only: scene_t, master_name
  use bodies_mod, only: is_linear
  use controls_mod, only: local_uzawa, solver_sweeps, solver_auto, precision_in_words, is_exact, &
    compliance_products
  use contact_points_mod, only: contact_points_t
  use plan_mod, only: plan_t
  use increments_mod, only: increment_t
  use increment_report_mod, only: increment_report_t, has_converged, is_solved, contact_fields_t, &
    certificate_t, worst_entry, ended_well, ended_at_limit, ended_stalled, ended_unbalanced, &
    ended_moving, ended_passed, ended_inverted, ended_out_of_balance, ended_indefinite
  use formed_compliance_mod, only: dense_bytes
  use amounts_mod, only: bytes_in_words
  use mesh_mod, only: mesh_t
  use inverted_elements_mod, only: jacobians_of
  use placement_mod, only: no_gap
  use console_mod, only: solver_name
  use name_refusal_mod, only: raise_at, node_name
  implicit none
  private

  public :: hint_t, refuse_unsolved, tolerance_in_reach, next_tolerance

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

  !> The errors of a certificate, in words; those that are rare only where there are any.
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
