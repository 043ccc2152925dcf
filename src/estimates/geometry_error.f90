!> Errors of the contact forces that the geometry of faces makes where meshes do not match, and
!> that no recovery of stresses sees: faces that round obstacles enter between their nodes, or that
!> stay flat where the bodies have bent, edges of the master within faces of the slave, flat faces
!> that stand for arcs.
!>
!> Each is what the forces change by where the points have the gaps that the faces would have: a
!> solution of the last contact problem. docs/theory.md (10.23), (10.24), (10.31).
module geometry_error_mod
  use kinds_mod, only: wp
  use lists_mod, only: lists_t, columns_with
  use small_matrix_mod, only: cross
  use surfaces_mod, only: nodes_of
  use scene_mod, only: scene_t
  use bodies_mod, only: is_linear
  use contact_points_mod, only: contact_points_t
  use candidate_points_mod, only: areas_at
  use state_mod, only: state_t
  use increment_report_mod, only: increment_report_t, contact_fields_t, force_sums
  use facet_rises_mod, only: gaps_of_arcs
  use faces_between_nodes_mod, only: entries_t
  use step_solver_mod, only: step_solver_t
  use other_gaps_mod, only: react_to_gaps, wide_open
  implicit none
  private

  public :: estimate_geometry

contains

  !> The three parts and their sum, at the end of a *STEP; negative where one of them is not known.
  subroutine estimate_geometry(scene, points, solver, state, entries, report)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(step_solver_t), intent(in) :: solver
    !! with the last contact problem of the increment, and its tolerance
    type(state_t), intent(in) :: state    !! where it ends
    type(entries_t), intent(in) :: entries !! of round obstacles, at that end
    type(increment_report_t), intent(inout) :: report !! gets the errors
    real(wp), parameter :: clear = 10.0_wp
    !! times what gaps are solved to: a depth, known to a digit [-]
    real(wp), parameter :: least = 1.0e-6_wp
    !! of the largest displacement: rounding is less; 370 random decks end alike with 1e-7 to 1e-5
    !! [-]
    real(wp), dimension(points%n) :: of_mesh, between !! [length]
    type(contact_fields_t) :: other
    real(wp) :: change
    integer :: i

    associate (errors => report%errors, contact => report%contact)
      errors%between_nodes = 0.0_wp
      errors%at_edges = 0.0_wp
      errors%of_facets = 0.0_wp
      if (any(contact%reaction(1, :) > 0.0_wp)) then
        call gaps_of_arcs(scene, points, solver%first_gap, state, of_mesh, between)
        where (.not. points%on_surface) between = -entries%depth
        where (abs(between) <= max(least, clear*report%certificate%penetration)* &
          maxval(abs(state%displacement))) between = 0.0_wp
        change = change_by(between, other)
        errors%between_nodes = change
        if (change > 0.0_wp) then
          if (presses_more(points, contact, other) .and. .not. any(points%on_surface .and. &
            abs(between) > 0.0_wp)) errors%too_soft = change
          do i = 1, points%n
            if (abs(between(i)) > 0.0_wp .and. .not. points%on_surface(i)) call lean(entries% &
              towards(:, i), other%frame(:, :, i))
          end do
          errors%between_nodes = max(change, apart(points, contact, other))
        end if
        errors%of_facets = change_by(of_mesh, other)
        call open_edges()
      end if
      errors%geometry = errors%between_nodes + errors%at_edges + errors%of_facets
      if (min(errors%between_nodes, errors%at_edges, errors%of_facets) < 0.0_wp) errors%geometry = &
        -1.0_wp
    end associate

  contains

    !> Edges of the master within faces of the slave: the points that press beyond them act as if
    !> the edge were at their nodes, and without them as if it were at the next ones.
    subroutine open_edges()
      logical :: is_beyond(points%n)
      real(wp) :: part(points%n)

      associate (contact => report%contact, error => report%errors%at_edges)
        is_beyond = contact%is_partly_covered .and. contact%reaction(1, :) > 0.0_wp
        if (.not. any(is_beyond)) return
        part = part_covered(scene, points, contact, state%displacement)
        error = change_by(merge(wide_open(solver, contact), 0.0_wp, is_beyond), other)
        if (error > 0.0_wp) error = error*sum((1.0_wp - part)*contact%reaction(1, :), is_beyond)/ &
          sum(contact%reaction(1, :), is_beyond)
      end associate
    end subroutine open_edges

    !> What other gaps change of the resultants of the pairs, normal forces or friction, beside the
    !> largest; negative where that is not known.
    real(wp) function change_by(gaps, other) result(change)
      real(wp), intent(in) :: gaps(:) !! (n_points) added [length]
      type(contact_fields_t), intent(out) :: other !! with these, where they change anything
      logical :: is_known

      change = 0.0_wp
      if (.not. any(abs(gaps) > 0.0_wp)) return
      other%frame = report%contact%frame
      allocate (other%reaction, mold=report%contact%reaction)
      call react_to_gaps(scene, solver, size(report%x_free), report%contact, gaps, &
        other%reaction, is_known)
      change = -1.0_wp
      if (is_known) change = apart(points, report%contact, other)
    end function change_by

  end subroutine estimate_geometry

  !> Whether no pair is pressed less.
  pure logical function presses_more(points, contact, other)
    type(contact_points_t), intent(in) :: points
    type(contact_fields_t), intent(in) :: contact, other
    integer :: p

    presses_more = all([(sum(other%reaction(1, points%first(p):points%first(p + 1) - 1)) >= &
      sum(contact%reaction(1, points%first(p):points%first(p + 1) - 1)), p=1, &
      size(points%first) - 1)])
  end function presses_more

  !> Turn a point's frame until its normal is along or against a direction, the shorter way.
  pure subroutine lean(direction, frame)
    real(wp), intent(in) :: direction(3)     !! of any length; 0: none
    real(wp), intent(inout) :: frame(3, 3)   !! n, t1, t2
    real(wp) :: to(3), turn(3)
    integer :: k

    if (.not. norm2(direction) > 0.0_wp) return
    to = sign(1.0_wp/norm2(direction), dot_product(direction, frame(:, 1)))*direction
    turn = cross(frame(:, 1), to)
    associate (c => dot_product(frame(:, 1), to))
      do k = 3, 1, -1
        frame(:, k) = frame(:, k) + cross(turn, frame(:, k)) + cross(turn, cross(turn, &
          frame(:, k)))/(1.0_wp + c)
      end do
    end associate
  end subroutine lean

  !> The largest change of a pair's normal force, or of its friction, beside the largest force;
  !> where normal forces of a pair balance each other all around it, of their sum.
  pure real(wp) function apart(points, contact, other)
    type(contact_points_t), intent(in) :: points
    type(contact_fields_t), intent(in) :: contact, other
    real(wp), parameter :: balanced = 0.5_wp !! of their sum: what is left of normal forces [-]
    real(wp) :: largest, change, sums(3, 2), changes(3, 2), pressing
    integer :: p

    largest = 0.0_wp
    change = 0.0_wp
    do p = 1, size(points%first) - 1
      associate (a => points%first(p), b => points%first(p + 1) - 1)
        sums = force_sums(contact, a, b)
        changes = force_sums(other, a, b) - sums
        pressing = sum(contact%reaction(1, a:b))
        if (norm2(sums(:, 1)) < balanced*pressing) then
          sums(:, 1) = [pressing, 0.0_wp, 0.0_wp]
          changes(:, 1) = [sum(other%reaction(1, a:b)) - pressing, 0.0_wp, 0.0_wp]
        end if
        largest = max(largest, norm2(sums(:, 1)))
        change = max(change, maxval(norm2(changes, dim=1)))
      end associate
    end do
    apart = 0.0_wp
    if (largest > 0.0_wp) apart = change/largest
  end function apart

  !> How much of the faces beyond an edge of its master is covered, at points of which less than
  !> half is: the part f of a face has the share f^2/2 of its outer node, or at a corner of the
  !> master (f f')^2/4.
  pure function part_covered(scene, points, contact, u) result(part)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(contact_fields_t), intent(in) :: contact
    real(wp), intent(in) :: u(:, :) !! (3,n_nodes) displacement [length]
    real(wp) :: part(points%n)      !! 1 of other points [-]
    real(wp) :: whole(points%n), share
    logical :: is_well(scene%mesh%n_nodes) !! covered by half and more
    integer, allocatable :: faces(:, :)
    type(lists_t) :: at
    integer :: pair, i

    part = 1.0_wp
    whole = points%area
    if (.not. is_linear(scene)) whole = areas_at(scene, points, u)
    do pair = 1, size(scene%pairs)
      associate (first => points%first(pair), last => points%first(pair + 1) - 1)
        if (.not. any(contact%is_partly_covered(first:last))) cycle
        faces = nodes_of(scene%surfaces(scene%pairs(pair)%surface)%faces, scene%mesh%connectivity)
        at = columns_with(faces, scene%mesh%n_nodes)
        is_well = .false.
        do i = first, last
          is_well(points%node(i)) = contact%covered_area(i) > 0.0_wp .and. .not. &
            contact%is_partly_covered(i)
        end do
        do i = first, last
          if (.not. contact%is_partly_covered(i)) cycle
          share = contact%covered_area(i)/max(whole(i), tiny(1.0_wp))
          part(i) = min(1.0_wp, merge(sqrt(2.0_wp*share), 2.0_wp*sqrt(share), &
            is_beside_well(points%node(i))))
        end do
      end associate
    end do

  contains

    !> Whether an edge of a face goes from a node to one that is covered well.
    pure logical function is_beside_well(node)
      integer, intent(in) :: node
      integer :: k, m, j

      is_beside_well = .false.
      do k = at%first(node), at%first(node + 1) - 1
        associate (face => faces(:, at%item(k)))
          m = count(face > 0)
          j = findloc(face, node, dim=1)
          is_beside_well = is_beside_well .or. is_well(face(1 + mod(j, m))) .or. &
            is_well(face(1 + mod(j + m - 2, m)))
        end associate
      end do
    end function is_beside_well

  end function part_covered

end module geometry_error_mod
