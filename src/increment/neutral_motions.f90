!> Motions that contact does not see until normals have turned. docs/theory.md section 9.
module neutral_motions_mod
  use kinds_mod, only: wp
  use dense_mod, only: null_space, solve_least_squares
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use rigid_modes_mod, only: free_motions_t, add_motions
  use state_mod, only: state_t
  use placement_mod, only: placement_t, place_curved
  use transfer_mod, only: motion_of_point
  implicit none
  private

  public :: led_t, neutral_step, unturned_motions

  real(wp), parameter :: difference = 1.0e-4_wp !! of the size of the mesh
  real(wp), parameter :: too_much = 0.5_wp      !! of what was left before a step [-]

  !> The last step along neutral motions, from which the next one learns.
  type :: led_t
    real(wp), allocatable :: step(:) !! (n_motions) not allocated before the first [length]
    real(wp), allocatable :: from(:) !! (n_motions) what was left on them before it [force]
  end type led_t

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

end module neutral_motions_mod
