!> For the certificate: slips past obstacles that turn and the work of their torques, from positions
!> and rotation vectors. It shares no code with placement and solvers, rotations included.
module turned_slips_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: cross
  use contact_points_mod, only: contact_points_t, weights_t
  use scene_mod, only: scene_t, pair_turns
  use sectors_mod, only: without_turn
  use state_mod, only: state_t
  use increment_report_mod, only: contact_fields_t
  use edge_middles_mod, only: edge_middles_t, vector_at_point
  implicit none
  private

  public :: turned_slips_t, slips_of_turns, ways_of_turns, work_of_torques, orientation

  !> Slips past obstacles that turn.
  type :: turned_slips_t
    logical,  allocatable :: is_turned(:) !! (n_points) the obstacle turns
    real(wp), allocatable :: slip(:, :)   !! (2,n_points) along t1, t2, 0 elsewhere [length]
  end type turned_slips_t

contains

  !> The slips of an increment past obstacles that turn: the chord on which a point goes over the
  !> material, as the obstacle stands halfway. docs/theory.md (9.8).
  pure function slips_of_turns(scene, points, middles, contact, old, new) result(turned)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(edge_middles_t), intent(in) :: middles
    type(contact_fields_t), intent(in) :: contact !! of the increment
    type(state_t), intent(in) :: old, new
    type(turned_slips_t) :: turned
    real(wp) :: before(3, 3), after(3, 3), chord(3)
    integer :: i

    allocate (turned%slip(2, points%n), source=0.0_wp)
    allocate (turned%is_turned(points%n), source=.false.)
    if (.not. any(scene%obstacles%turns)) return
    do i = 1, points%n
      turned%is_turned(i) = pair_turns(scene, points%pair(i))
      if (.not. turned%is_turned(i)) cycle
      associate (obstacle => scene%pairs(points%pair(i))%master)
        before = orientation(old%rotation(:, obstacle))
        after = orientation(new%rotation(:, obstacle))
        chord = matmul(arm_of(scene, points, middles, contact%weights, i, new), after) - &
          matmul(arm_of(scene, points, middles, contact%weights, i, old), before)
        chord = matmul(matmul(orientation(0.5_wp*turn_of(matmul(after, transpose(before)))), &
          before), chord)
        turned%slip(:, i) = matmul(without_turn(scene%mesh, points%node(i), .false., chord), &
          contact%frame(:, 2:, i))
      end associate
    end do
  end function slips_of_turns

  !> How far obstacles that turn take along what is at the points, in an increment.
  pure function ways_of_turns(scene, points, middles, weights, old, new) result(way)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(edge_middles_t), intent(in) :: middles
    type(weights_t), intent(in) :: weights
    type(state_t), intent(in) :: old, new
    real(wp) :: way(3, points%n) !! 0 of other points [length]
    integer :: i

    way = 0.0_wp
    if (.not. any(scene%obstacles%turns)) return
    do i = 1, points%n
      if (.not. pair_turns(scene, points%pair(i))) cycle
      way(:, i) = 0.5_wp*cross(turn_between(old, new, scene%pairs(points%pair(i))%master), &
        arm_of(scene, points, middles, weights, i, old) + arm_of(scene, points, middles, &
        weights, i, new))
    end do
  end function ways_of_turns

  !> Where a point is, from the reference node of its obstacle.
  pure function arm_of(scene, points, middles, weights, i, state) result(arm)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(edge_middles_t), intent(in) :: middles
    type(weights_t), intent(in) :: weights
    integer, intent(in) :: i
    type(state_t), intent(in) :: state
    real(wp) :: arm(3) !! [length]
    integer :: k

    associate (node => points%node(i), x => scene%mesh%coordinates, u => state%displacement, &
               ref_node => scene%obstacles(scene%pairs(points%pair(i))%master)%ref_node)
      arm = (vector_at_point(middles, node, i, x) - x(:, ref_node)) + &
        (vector_at_point(middles, node, i, u) - u(:, ref_node))
      ! A row may stand for places of other nodes of its slave, too.
      do k = weights%first(i), weights%first(i + 1) - 1
        associate (other => weights%node(k))
          if (other /= ref_node) arm = arm - weights%weight(k)*(x(:, other) + u(:, other))
        end associate
      end do
    end associate
  end function arm_of

  !> The work of the torques that turn the obstacles, in an increment, by the trapezoidal rule.
  !>
  !> The turn is read off the matrix that takes one orientation to the other. docs/theory.md (9.9).
  pure function work_of_torques(scene, points, middles, before, after, old, new) result(work)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(edge_middles_t), intent(in) :: middles
    type(weights_t), intent(in) :: before, after !! of old and new
    type(state_t), intent(in) :: old, new
    real(wp) :: work  !! [energy]
    real(wp) :: turn(3)
    integer :: i

    work = 0.0_wp
    if (.not. any(scene%obstacles%turns)) return
    do i = 1, points%n
      if (.not. pair_turns(scene, points%pair(i))) cycle
      associate (obstacle => scene%pairs(points%pair(i))%master)
        turn = turn_between(old, new, obstacle)
        work = work + 0.5_wp*dot_product(turn, &
          cross(arm_of(scene, points, middles, before, i, old), old%reaction(:, i)) + &
          cross(arm_of(scene, points, middles, after, i, new), new%reaction(:, i)))
      end associate
    end do
  end function work_of_torques

  !> The turn of an obstacle in an increment.
  pure function turn_between(old, new, obstacle) result(turn)
    type(state_t), intent(in) :: old, new
    integer, intent(in) :: obstacle
    real(wp) :: turn(3) !! [rad]

    turn = turn_of(matmul(orientation(new%rotation(:, obstacle)), transpose(orientation( &
      old%rotation(:, obstacle)))))
  end function turn_between

  !> The axes of a frame turned by a rotation vector, each on its circle about it.
  pure function orientation(vector) result(axes)
    real(wp), intent(in) :: vector(3) !! [rad]
    real(wp) :: axes(3, 3)            !! columns
    real(wp) :: along(3), part(3), angle
    integer :: i

    axes = reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [3, 3])
    angle = norm2(vector)
    if (angle <= 0.0_wp) return
    along = vector/angle
    do i = 1, 3
      part = dot_product(along, axes(:, i))*along
      axes(:, i) = part + cos(angle)*(axes(:, i) - part) + sin(angle)*cross(along, axes(:, i))
    end do
  end function orientation

  !> The rotation vector of a rotation by less than a half turn.
  pure function turn_of(r) result(turn)
    real(wp), intent(in) :: r(3, 3)
    real(wp) :: turn(3) !! [rad]
    real(wp) :: sine

    turn = 0.5_wp*[r(3, 2) - r(2, 3), r(1, 3) - r(3, 1), r(2, 1) - r(1, 2)]
    sine = norm2(turn)
    if (sine > 0.0_wp) turn = atan2(sine, 0.5_wp*(r(1, 1) + r(2, 2) + r(3, 3) - 1.0_wp))/sine*turn
  end function turn_of

end module turned_slips_mod
