!> How the contact problem of each group is made (condensed_contact_mod): the rows of its points, W,
!> and what its rigid motions do there. docs/theory.md section 2.
module condense_contact_mod
  use kinds_mod, only: wp
  use scene_mod, only: scene_t
  use controls_mod, only: solver_sweeps
  use mesh_mod, only: mesh_t
  use near_stiffness_mod, only: near_stiffness_t, turn_near, scale_near
  use contact_points_mod, only: contact_points_t, is_covered, is_in_middle
  use linearisation_mod, only: linearisation_t
  use dof_map_mod, only: dof_map_t, is_turned, turn_of
  use placement_mod, only: placement_t
  use dependent_rows_mod, only: find_dependent_rows
  use sparse_rows_mod, only: rows_t
  use transfer_mod, only: make_transfer, compliance_of_rows, movable, rows_of_points, &
    motions_at_rows, stiffness_left, give_way
  use solutions_map_mod, only: map_of_rows
  use compliance_map_mod, only: compliance_map_t
  use held_body_mod, only: hold_body
  use compliance_mod, only: compliance_t, take_matrix, take_map, get_matrix, add_square, &
    diagonal_of, is_map
  use problem_mod, only: make_problem, is_made_of
  use shared_nodes_mod, only: find_twins
  use dense_mod, only: null_space
  use floating_mod, only: see_motions, free_the_motions, sees_less
  use condensed_contact_mod, only: condensed_contact_t, contact_group_t
  implicit none
  private

  public :: condense_contact, few_rows

  integer, parameter :: few_rows = 300
  !! of a part of the points, up to which W is formed where products with it are solutions

  !> The rows of all points of a placement.
  type :: placed_rows_t
    integer, allocatable :: row(:, :)   !! (3,n_points) over all groups, 0 where there is none
    logical, allocatable :: can_move(:, :) !! (3,n_nodes) of `movable`
    logical, allocatable :: near(:)     !! (n_points) those that have rows
    type(rows_t) :: transfer
    real(wp) :: softness = 0.0_wp       !! of reactions that no body feels [-]
    real(wp), allocatable :: left(:)    !! (n_pairs) of the stiffness of slave nodes [-]
    logical, allocatable :: presses(:)  !! (n_points) as of condensed_contact_t
    real(wp), allocatable :: load(:)    !! (n_motions) likewise [force]
  end type placed_rows_t

contains

  !> The contact problems of a placement: with `near` of the groups that have points before curved
  !> obstacles, without it of the others.
  !>
  !> Only points that are `near` have rows; the others in reach are taken to be open. Where the near
  !> ones do not see all motions that the points in reach do, a group has the rows of all of these.
  !> Before round obstacles alone motions are neutral that points which press do not see, too, where
  !> no load drives these.
  subroutine condense_contact(scene, tolerance, points, body, undeformed, placement, contact, near)
    type(scene_t), intent(in) :: scene
    real(wp), intent(in) :: tolerance   !! of contact [-]
    type(contact_points_t), intent(in) :: points
    type(linearisation_t), intent(in) :: body
    type(placement_t), intent(in) :: undeformed, placement
    type(condensed_contact_t), intent(inout) :: contact !! of find_groups
    logical, intent(in), optional :: near(:) !! (n_points)
    type(placed_rows_t) :: rows
    integer :: i

    allocate (rows%row(3, points%n))
    rows%near = points%in_reach
    if (present(near)) rows%near = near
    rows%softness = softness_for(scene%contact%solver, tolerance)
    rows%can_move = movable(scene, body%prescribed)
    if (allocated(contact%presses)) then
      rows%presses = contact%presses
      rows%load = contact%load
    end if
    call rows_of_points(rows%can_move, points, placement%weights, placement%frame, rows%row)
    call make_transfer(body%inverse%map, points, placement%weights, rows%transfer)
    if (body%inverse%is_condensed) then
      rows%left = stiffness_left(body%inverse%map, points, rows%transfer, body%inverse%compliance)
    else
      rows%left = stiffness_left(body%inverse%map, points, rows%transfer, flexibility=body% &
        flexibility)
    end if
    do i = 1, size(contact%group)
      if (any(points%is_curved(contact%group(i)%point)) .neqv. present(near)) cycle
      call condense_group(scene%mesh, points, body, undeformed, placement, rows, contact%group(i))
    end do
  end subroutine condense_contact

  !> The contact problem of a group.
  subroutine condense_group(mesh, points, body, undeformed, placement, rows, group)
    type(mesh_t), intent(in) :: mesh
    type(contact_points_t), intent(in) :: points
    type(linearisation_t), intent(in) :: body
    type(placement_t), intent(in) :: undeformed, placement
    type(placed_rows_t), intent(in) :: rows  !! of the placement
    type(contact_group_t), intent(inout) :: group
    real(wp), allocatable :: g(:, :), undeformed_g(:, :)
    type(compliance_t) :: compliance
    type(near_stiffness_t) :: nearby
    real(wp) :: block(3, 3, points%n)
    integer, dimension(3, points%n) :: row, all_rows
    integer :: n

    all_rows = rows_of_group(rows%row, group%point)
    row = rows_of_group(rows%row, pack(group%point, rows%near(group%point)))
    if (size(group%motion) > 0) then
      undeformed_g = motions_at_rows(mesh, points, before_it_turned(points, group%point, &
        undeformed, placement), body%motions, all_rows)
      undeformed_g = undeformed_g(:, group%motion)
      if (allocated(rows%presses) .and. .not. any(points%on_surface(group%point))) undeformed_g = &
        seen_by_pressing(undeformed_g, pack(all_rows, all_rows > 0 .and. spread(rows%presses, 1, &
        3)), rows%load(group%motion))
      g = motions_at_rows(mesh, points, placement, body%motions, row)
      if (any(row /= all_rows)) then
        if (sees_less(g(:, group%motion), undeformed_g)) then
          row = all_rows
          g = motions_at_rows(mesh, points, placement, body%motions, row)
        end if
      end if
      g = g(:, group%motion)
    end if
    n = count(row > 0)
    call take_compliance(body, rows%transfer, placement, row, n < count(all_rows > 0), compliance)
    group%active = pack(group%point, row(1, group%point) > 0)
    group%node = points%node(group%active)
    group%far = pack(group%point, all_rows(1, group%point) > 0 .and. row(1, group%point) == 0)
    if (size(group%motion) > 0) then
      if (allocated(body%inverse%iterative) .and. n > 0) then
        call see_motions(g, undeformed_g, group%floating)
        group%undeformed_g = undeformed_g
      else
        call free_the_motions(g, undeformed_g, compliance, group%floating)
      end if
    end if
    call find_dependent_rows(points, placement%weights, placement%frame, row, rows%can_move, &
      body%constraints, group%null)
    if (is_map(compliance)) then
      block = give_way(rows%transfer, placement%frame, body%flexibility)
      if (allocated(body%inverse%iterative) .and. size(group%motion) > 0) then
        call give_way_at_pins(group%active, block)
      end if
      nearby = turn_near(body%stiffness, frames_of_factor(body%inverse%map, points, &
        placement%frame), group%active)
      call scale_near(nearby, rows%left(points%pair(group%active)))
      call soften(rows%softness, row, group, compliance, nearby, block)
      call make_problem(row(:, group%active), points%mu(group%active), compliance, group%problem, &
        nearby, block(:, :, group%active))
    else if (any(depends_on_others(body, points%node(group%active))) .or. &
      has_middles(group%active)) then
      ! The Schur complement says nothing of these: their stiffness is that of W.
      call soften(rows%softness, row, group, compliance)
      if (.not. is_made_of(group%problem, row(:, group%active), points%mu(group%active), &
        compliance)) call make_problem(row(:, group%active), points%mu(group%active), compliance, &
        group%problem)
    else
      nearby = turn_near(body%stiffness, frames_of_factor(body%inverse%map, points, &
        placement%frame), group%active)
      call scale_near(nearby, rows%left(points%pair(group%active)))
      call soften(rows%softness, row, group, compliance, nearby)
      call make_problem(row(:, group%active), points%mu(group%active), compliance, group%problem, &
        nearby)
      call find_twins(group%problem, points%node(group%active))
    end if
    group%problem%is_proximal = size(group%motion) > 0
    if (allocated(group%body)) deallocate (group%body)
    if (allocated(body%inverse%iterative) .and. n > 0 .and. size(group%null, 2) == 0) call &
      hold_body(body, points, &
      rows%transfer, placement, row, group%active, group%body)

  contains

    !> Whether some points take part of the ends of their edges.
    pure logical function has_middles(active)
      integer, intent(in) :: active(:)
      integer :: k

      has_middles = any([(is_in_middle(points, placement%weights, active(k)), k=1, size(active))])
    end function has_middles

    !> A pin is an unknown to iteration: it gives way as the others of its point do.
    subroutine give_way_at_pins(active, block)
      integer, intent(in) :: active(:)
      real(wp), intent(inout) :: block(:, :, :) !! (3,3,n_points) [length/force]
      integer :: k, j

      do k = 1, size(active)
        do j = 1, body%motions%n
          if (body%motions%node(j) /= points%node(active(k))) cycle
          associate (of_point => block(:, :, active(k)), dof => body%motions%dof(j), &
                     frame => placement%frame(:, :, active(k)))
            of_point = of_point + body%pin_flexibility(j)*matmul(reshape(frame(dof, :), [3, 1]), &
              reshape(frame(dof, :), [1, 3]))
          end associate
        end do
      end do
    end subroutine give_way_at_pins

  end subroutine condense_group

  !> How soft that is: so much more than the tolerance that a solver sees it, and so little that W
  !> keeps its digits. Sweeps take the longer the less it is.
  pure real(wp) function softness_for(solver, tolerance) result(softness)
    integer, intent(in) :: solver     !! as of contact_controls_t
    real(wp), intent(in) :: tolerance !! of contact [-]
    real(wp), parameter :: least = 1.0e-6_wp, most = 0.1_wp, of_sweeps = 1.0e-2_wp !! [-]
    real(wp), parameter :: by_tolerance = 1.0e3_wp                                 !! [-]

    softness = min(most, max(least, by_tolerance*tolerance))
    if (solver == solver_sweeps) softness = max(softness, of_sweeps)
  end function softness_for

  !> Make reactions a little soft that no body feels: W + softness N N^T. That takes the least of
  !> them, which the softness has no part in; what it leaves of gaps is taken out by solving again
  !> about the reactions found (solve_reactions_mod). docs/theory.md (11.20).
  subroutine soften(softness, row, group, compliance, nearby, block)
    real(wp), intent(in) :: softness
    !! beside what the points of a combination give way by, of that which does the least [-]
    integer, intent(in) :: row(:, :)                   !! (3,n_points) 0 where there is none
    type(contact_group_t), intent(inout) :: group      !! gets the softness
    type(compliance_t), intent(inout) :: compliance    !! over the rows [length/force]
    type(near_stiffness_t), intent(inout), optional :: nearby
    !! of the active points: what is soft is all that holds these combinations
    real(wp), intent(inout), optional :: block(:, :, :)
    !! (3,3,n_points) what stands for W_ii, of a map [length/force]
    real(wp), parameter :: nothing = 1.0e-9_wp !! of the largest: gives way by rounding [-]
    real(wp) :: along(3, size(group%null, 2)), own(size(group%null, 1))
    real(wp) :: of_combination(size(group%null, 2))
    integer :: k, a

    group%softness = 0.0_wp
    if (size(group%null, 2) == 0) return
    if (present(block)) then
      do k = 1, size(group%active)
        do a = 1, 3
          associate (here => row(a, group%active(k)))
            if (here > 0) own(here) = block(a, a, group%active(k))
          end associate
        end do
      end do
    else
      own = diagonal_of(compliance)
    end if
    group%flexibility = maxval(own)
    ! Of bodies that do not give way any.
    if (.not. group%flexibility > 0.0_wp) group%flexibility = 1.0_wp
    of_combination = matmul(own, group%null**2)
    group%softness = softness*min(group%flexibility, minval(of_combination, mask=of_combination > &
      nothing*group%flexibility))
    call add_square(compliance, group%softness, group%null)
    if (.not. present(nearby)) return
    do k = 1, size(group%active)
      along = 0.0_wp
      do a = 1, 3
        associate (here => row(a, group%active(k)))
          if (here > 0) along(a, :) = group%null(here, :)
        end associate
      end do
      associate (s => nearby%block(:, :, nearby%start(k)))
        s = s + matmul(along, transpose(along))/group%softness
      end associate
      if (.not. present(block)) cycle
      associate (w => block(:, :, group%active(k)))
        w = w + group%softness*matmul(along, transpose(along))
      end associate
    end do
  end subroutine soften

  !> W of some rows: as an array, or by its products where the compliance of the bodies is not
  !> formed. Of a few rows out of many it is an array in any case.
  subroutine take_compliance(body, transfer, placement, row, are_part, compliance)
    type(linearisation_t), intent(in) :: body
    type(rows_t), intent(in) :: transfer
    type(placement_t), intent(in) :: placement
    integer, intent(in) :: row(:, :)    !! (3,n_points) 0 where there is none
    logical, intent(in) :: are_part     !! there might be more rows
    type(compliance_t), intent(out) :: compliance
    class(compliance_map_t), allocatable :: map
    real(wp), allocatable :: w(:, :)
    integer :: n

    n = count(row > 0)
    if (body%inverse%is_condensed) then
      call compliance_of_rows(transfer, placement%frame, row, body%inverse%compliance, w)
      call take_matrix(w, compliance)
      return
    end if
    call map_of_rows(body%inverse, transfer, placement%frame, row, map)
    call take_map(map, n, compliance)
    if (.not. are_part .or. n > few_rows) return
    allocate (w(n, n))
    call get_matrix(compliance, w)
    call take_matrix(w, compliance)
  end subroutine take_compliance

  !> The frames along the axes of the equations, which may have turned with the points' bodies.
  pure function frames_of_factor(map, points, frame) result(frames)
    type(dof_map_t), intent(in) :: map
    type(contact_points_t), intent(in) :: points
    real(wp), intent(in) :: frame(:, :, :)          !! (3,3,n_points) columns n, t1, t2
    real(wp) :: frames(3, 3, size(frame, 3))
    integer :: i

    frames = frame
    do i = 1, points%n
      if (is_turned(map, points%node(i))) frames(:, :, i) = matmul(transpose(turn_of(map, &
        points%node(i))), frame(:, :, i))
    end do
  end function frames_of_factor

  !> Some points' rows, numbered from 1 on.
  pure function rows_of_group(all_rows, list) result(row)
    integer, intent(in) :: all_rows(:, :) !! (3,n_points) 0 where there is none
    integer, intent(in) :: list(:)        !! of the points
    integer :: row(3, size(all_rows, 2))  !! 0 where there is none, or the point is not listed
    integer :: i, a, n

    row = 0
    n = 0
    do i = 1, size(list)
      do a = 1, 3
        if (all_rows(a, list(i)) == 0) cycle
        n = n + 1
        row(a, list(i)) = n
      end do
    end do
  end function rows_of_group

  !> What points that press see of the motions, where loads drive none that they do not see; else
  !> what all see.
  !>
  !> A dome that stands on its pole in a wider cup, without friction: open points would see it move,
  !> but only once it has gone as far as to touch there. Turned normals bring it to rest before.
  function seen_by_pressing(all_g, pressing, load) result(g)
    real(wp), intent(in) :: all_g(:, :)   !! (m,n) what each motion does at all rows [-]
    integer, intent(in) :: pressing(:)    !! rows of these points
    real(wp), intent(in) :: load(:)       !! (n) [force]
    real(wp), allocatable :: g(:, :)
    real(wp), allocatable :: neutral(:, :)
    real(wp), parameter :: unseen = 1.0e-10_wp !! as of see_motions [-]

    g = all_g
    if (size(pressing) == 0) return
    neutral = null_space(all_g(pressing, :), unseen)
    if (any(abs(matmul(load, neutral)) > unseen*norm2(load))) return
    if (size(neutral, 2) == size(null_space(all_g, unseen), 2)) return
    g = all_g(pressing, :)
  end function seen_by_pressing

  !> The placement as far as the undeformed mesh says how points lie: normals before deformation
  !> turned them.
  !>
  !> What a surface covers of the undeformed mesh says nothing of what it covers now, and a point
  !> that has gone to faces of another slope is held as these are. Where it is still on the same
  !> ones a normal turns by no more than strains: what that holds is of second order.
  pure function before_it_turned(points, list, undeformed, placement) result(placed)
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: list(:)         !! the points of a group
    type(placement_t), intent(in) :: undeformed, placement
    type(placement_t) :: placed
    real(wp), parameter :: same_faces = 0.995_wp
    !! cosine: 6 degrees, what strains of a tenth turn faces by
    integer :: k

    if (.not. any(points%on_surface(list))) then
      placed = undeformed
      return
    end if
    placed = placement
    do k = 1, size(list)
      associate (i => list(k))
        if (.not. points%on_surface(i)) then
          placed%frame(:, :, i) = undeformed%frame(:, :, i)
        else if (is_covered(points, undeformed%weights, i)) then
          if (dot_product(undeformed%frame(:, 1, i), placement%frame(:, 1, i)) > same_faces) then
            placed%frame(:, :, i) = undeformed%frame(:, :, i)
          end if
        end if
      end associate
    end do
  end function before_it_turned

  !> Which nodes depend on others by constraints.
  pure function depends_on_others(body, nodes) result(depends)
    type(linearisation_t), intent(in) :: body
    integer, intent(in) :: nodes(:)
    logical :: depends(size(nodes)), of_node(size(body%prescribed, 2))

    depends = .false.
    if (body%constraints%n == 0) return
    of_node = .false.
    of_node(body%constraints%node(:body%constraints%n)) = .true.
    depends = of_node(nodes)
  end function depends_on_others

end module condense_contact_mod
