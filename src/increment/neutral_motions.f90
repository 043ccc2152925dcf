!> Motions that contact does not see until normals have turned. docs/theory.md section 9.
module neutral_motions_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: cross
  use dense_mod, only: null_space, solve_least_squares, singular_values
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use rigid_modes_mod, only: free_motions_t, add_motions, place_of, is_joined
  use state_mod, only: state_t
  use placement_mod, only: placement_t, place_curved
  use transfer_mod, only: motion_of_point
  implicit none
  private

  public :: led_t, neutral_step, unturned_motions, way_to_rest

  real(wp), parameter :: difference = 1.0e-4_wp !! of the size of the mesh
  real(wp), parameter :: too_much = 0.5_wp      !! of what was left before a step [-]

  !> The last step along neutral motions, from which the next one learns.
  type :: led_t
    real(wp), allocatable :: step(:) !! (n_motions) not allocated before the first [length]
    real(wp), allocatable :: from(:) !! (n_motions) what was left on them before it [force]
  end type led_t

  !> A body, a piece of one that equations join, or an obstacle, that free motions move.
  type :: moving_part_t
    integer,  allocatable :: node(:)        !! of it
    real(wp), allocatable :: motion(:, :)
    !! (6,n) translation of its centre, and rotation times its extent, by each motion [-]
    real(wp) :: centre(3) = 0.0_wp          !! mean of the nodes [length]
    real(wp) :: extent = 0.0_wp
    !! root of the mean square of distances from it, 0 of a single node [length]
  end type moving_part_t

contains

  !> How far the neutral motions go until what turned normals leave on them is 0: a Newton step, the
  !> derivative by a difference, and by what the last step has done. Nothing where normals do not
  !> turn.
  !>
  !> Residual and derivative are those of where the bodies are now. The difference takes reactions
  !> as they are. Where bodies are thin these change more than normals do, as surfaces that are not
  !> flat any more slide over each other. Where a step has left too much the derivative takes
  !> Broyden's correction. docs/theory.md section 9.
  subroutine neutral_step(scene, points, motions, neutral, placement, state, residual, led)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(free_motions_t), intent(in) :: motions
    real(wp), intent(in) :: neutral(:, :)   !! (n,k) orthonormal [-]
    type(placement_t), intent(in) :: placement !! in which the reactions were found
    type(state_t), intent(in) :: state      !! its reactions, displacement and rotations
    real(wp), intent(in) :: residual(:)     !! (k) what turned normals leave on them [force]
    type(led_t), intent(inout) :: led       !! the last step in, this one out
    real(wp), dimension(size(residual)) :: along, left, here
    real(wp) :: stiffness(size(residual), size(residual)), moved(3, scene%mesh%n_nodes)
    type(placement_t) :: turned
    real(wp) :: step
    integer :: k

    step = step_of_difference(scene)
    ! While places settle bodies are not where the reactions were found.
    turned = placement
    call place_curved(scene, points, state%displacement, turned, state%rotation)
    here = along_neutral(turned)
    left = residual + here - along_neutral(placement)
    do k = 1, size(residual)
      moved = state%displacement
      call add_motions(motions, scene%mesh, step*neutral(:, k), moved)
      call place_curved(scene, points, moved, turned, state%rotation)
      stiffness(:, k) = (here - along_neutral(turned))/step
    end do
    if (allocated(led%step)) then
      along = matmul(led%step, neutral)
      if (norm2(left) > too_much*norm2(matmul(led%from, neutral)) .and. &
        any(abs(along) > 0.0_wp)) stiffness = stiffness + spread(matmul(led%from, neutral) - &
        left - matmul(stiffness, along), 2, size(along))*spread(along, 1, size(along))/ &
        dot_product(along, along)
    end if
    led%step = matmul(neutral, solve_least_squares(stiffness, left))
    led%from = matmul(neutral, left)

  contains

    !> What the reactions do along the neutral motions where normals and weights are others [force].
    pure function along_neutral(turned) result(along)
      type(placement_t), intent(in) :: turned
      real(wp) :: along(size(neutral, 2))
      real(wp) :: force(3)
      integer :: i, j

      along = 0.0_wp
      do i = 1, points%n
        if (.not. points%is_curved(i) .or. .not. any(abs(state%reaction(:, i)) > 0.0_wp)) cycle
        force = matmul(turned%frame(:, :, i), matmul(state%reaction(:, i), &
          placement%frame(:, :, i)))
        do j = 1, motions%n
          along = along + dot_product(force, motion_of_point(scene%mesh, points, turned%weights, &
            motions, i, j))*neutral(j, :)
        end do
      end do
    end function along_neutral

  end subroutine neutral_step

  !> The motions of a space that turn no normal at a pressing point, orthonormal: along the axis of
  !> a cylinder, not about it.
  function unturned_motions(scene, points, motions, list, from, placement, state) result(unturned)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(free_motions_t), intent(in) :: motions
    integer, intent(in) :: list(:)          !! the motions of a group of bodies
    real(wp), intent(in) :: from(:, :)      !! (n,k) of these, orthonormal [-]
    type(placement_t), intent(in) :: placement
    type(state_t), intent(in) :: state      !! its reactions, displacement and rotations
    real(wp), allocatable :: unturned(:, :) !! (n,l) [-]
    ! A block between two cylinders: 1e-11 to 1e-6 and 0 to 1e-10 give the same displacements.
    real(wp), parameter :: still = 1.0e-6_wp     !! of the largest turn of a normal [-]
    real(wp), parameter :: rounding = 1.0e-13_wp !! of a normal, where no motion turns one [-]
    type(placement_t) :: here, turned
    real(wp) :: moved(3, scene%mesh%n_nodes), step
    real(wp) :: turn(3*points%n, size(from, 2)), motion(motions%n)
    integer :: i, k

    step = step_of_difference(scene)
    here = placement
    call place_curved(scene, points, state%displacement, here, state%rotation)
    turn = 0.0_wp
    do k = 1, size(from, 2)
      motion = 0.0_wp
      motion(list) = step*from(:, k)
      moved = state%displacement
      call add_motions(motions, scene%mesh, motion, moved)
      turned = placement
      call place_curved(scene, points, moved, turned, state%rotation)
      do i = 1, points%n
        if (.not. points%is_curved(i) .or. .not. abs(state%reaction(1, i)) > 0.0_wp) cycle
        turn(3*i - 2:3*i, k) = turned%frame(:, 1, i) - here%frame(:, 1, i)
      end do
    end do
    where (abs(turn) <= rounding) turn = 0.0_wp
    unturned = matmul(from, null_space(turn, still))
  end function unturned_motions

  !> Length of a step by which derivatives are taken [length].
  pure real(wp) function step_of_difference(scene) result(step)
    type(scene_t), intent(in) :: scene

    step = difference*maxval(maxval(scene%mesh%coordinates, dim=2) - minval( &
      scene%mesh%coordinates, dim=2))
  end function step_of_difference

  !> How far the neutral motions go until bodies are, on the average of their nodes, where they
  !> were: deformed about one pin, a body that is pressed in its middle would no longer lie there,
  !> and where it lay would depend on the axes.
  !>
  !> Of the rigid motions that fit best first the rotations are taken back as far as neutral motions
  !> can, then the translations as far as is left open: what leads a body along is no neutral
  !> motion, even where a neutral motion would bring it nearer to where it was by turning it.
  !> docs/theory.md (9.6a).
  function way_to_rest(scene, motions, list, neutral, moved) result(a)
    type(scene_t), intent(in) :: scene
    type(free_motions_t), intent(in) :: motions
    integer, intent(in) :: list(:)          !! the motions of a group of bodies
    real(wp), intent(in) :: neutral(:, :)   !! (n,k) of these, orthonormal [-]
    real(wp), intent(in) :: moved(:, :)     !! (3,n_nodes) since bodies were there [length]
    real(wp) :: a(size(list))               !! [length]
    real(wp), parameter :: nothing = 1.0e-10_wp !! of what moves most: does not turn [-]
    type(moving_part_t), allocatable :: parts(:)
    real(wp), allocatable :: turns(:, :), shifts(:, :), turned(:), shifted(:)
    real(wp), dimension(size(neutral, 2)) :: share, s
    real(wp) :: v(size(neutral, 2), size(neutral, 2)), six(6)
    integer :: i, n
    logical :: ok

    a = 0.0_wp
    allocate (parts, source=moving_parts(scene, motions, list))
    n = size(parts)
    allocate (turns(3*n, size(s)), shifts(3*n, size(s)), turned(3*n), shifted(3*n))
    do i = 1, n
      shifts(3*i - 2:3*i, :) = matmul(parts(i)%motion(:3, :), neutral)
      turns(3*i - 2:3*i, :) = matmul(parts(i)%motion(4:, :), neutral)
      six = best_fit(scene, motions, parts(i), moved)
      shifted(3*i - 2:3*i) = six(:3)
      turned(3*i - 2:3*i) = six(4:)
    end do
    call singular_values(turns, s, v, ok)
    if (.not. ok) return
    n = count(s > nothing*max(maxval(abs(turns)), maxval(abs(shifts))))
    share = matmul(v(:, :n), solve_least_squares(matmul(turns, v(:, :n)), turned))
    share = share + matmul(v(:, n + 1:), solve_least_squares(matmul(shifts, v(:, n + 1:)), &
      shifted - matmul(shifts, share)))
    a = -matmul(neutral, share)
  end function way_to_rest

  !> The bodies that motions move, of one that equations join its pieces, and the reference nodes of
  !> obstacles.
  function moving_parts(scene, motions, list) result(parts)
    type(scene_t), intent(in) :: scene
    type(free_motions_t), intent(in) :: motions
    integer, intent(in) :: list(:)   !! the motions
    type(moving_part_t), allocatable :: parts(:)
    integer :: first, p, i
    logical :: together(size(list))

    allocate (parts(0))
    do first = 1, size(list)
      associate (body => motions%body(list(first)), node => motions%node(list(first)))
        together = motions%body(list) == body .and. (body > 0 .or. motions%node(list) == node)
        if (any(together(:first - 1))) cycle
        if (body == 0) then
          call add_part([node])
        else if (.not. is_joined(motions, body)) then
          call add_part(pack([(i, i=1, scene%mesh%n_nodes)], scene%mesh%body == body))
        else
          do p = 1, size(motions%piece_extent)
            call add_part(pack([(i, i=1, scene%mesh%n_nodes)], scene%mesh%body == body .and. &
              motions%piece(:scene%mesh%n_nodes) == p))
          end do
        end if
      end associate
    end do

  contains

    !> One more part, if it moves: by what motions do to the mean of its nodes.
    subroutine add_part(nodes)
      integer, intent(in) :: nodes(:)
      type(moving_part_t) :: part
      real(wp) :: translation(3), rotation(3), about(3)
      integer :: j, k, piece

      if (size(nodes) == 0) return
      allocate (part%node, source=nodes)
      allocate (part%motion(6, size(list)), source=0.0_wp)
      do k = 1, size(nodes)
        part%centre = part%centre + place_of(motions, scene%mesh, nodes(k))/real(size(nodes), wp)
      end do
      do k = 1, size(nodes)
        part%extent = part%extent + sum((place_of(motions, scene%mesh, nodes(k)) - &
          part%centre)**2)/real(size(nodes), wp)
      end do
      part%extent = sqrt(part%extent)
      piece = 0
      if (allocated(motions%piece)) piece = motions%piece(nodes(1))
      do k = 1, size(list)
        if (.not. together(k)) cycle
        j = list(k)
        if (motions%body(j) == 0 .or. piece == 0) then
          translation = motions%translation(:, j)
          rotation = motions%rotation(:, j)
          about = motions%centre(:, j)
        else
          translation = motions%piece_translation(:, piece, j)
          rotation = motions%piece_rotation(:, piece, j)
          about = motions%piece_centre(:, piece)
        end if
        part%motion(:3, k) = translation + cross(rotation, part%centre - about)
        part%motion(4:, k) = part%extent*rotation
      end do
      if (any(abs(part%motion) > 0.0_wp)) parts = [parts, part]
    end subroutine add_part

  end function moving_parts

  !> Translation of a part's centre, and rotation times its extent, that fit displacements best.
  function best_fit(scene, motions, part, moved) result(six)
    type(scene_t), intent(in) :: scene
    type(free_motions_t), intent(in) :: motions
    type(moving_part_t), intent(in) :: part
    real(wp), intent(in) :: moved(:, :)       !! (3,n_nodes) [length]
    real(wp) :: six(6)                        !! [length]
    real(wp) :: inertia(3, 3), moment(3), arm(3)
    integer :: k, i

    six = 0.0_wp
    inertia = 0.0_wp
    moment = 0.0_wp
    do k = 1, size(part%node)
      associate (u => moved(:, part%node(k)))
        arm = place_of(motions, scene%mesh, part%node(k)) - part%centre
        six(:3) = six(:3) + u/real(size(part%node), wp)
        moment = moment + cross(arm, u)
        do i = 1, 3
          inertia(:, i) = inertia(:, i) - arm*arm(i)
          inertia(i, i) = inertia(i, i) + dot_product(arm, arm)
        end do
      end associate
    end do
    ! A line turns about itself by nothing that nodes would see.
    if (part%extent > 0.0_wp) six(4:) = part%extent*solve_least_squares(inertia, moment)
  end function best_fit

end module neutral_motions_mod
