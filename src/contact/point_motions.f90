!> What the free motions of bodies and obstacles do at the contact points.
module point_motions_mod
  use kinds_mod, only: wp
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use rigid_modes_mod, only: free_motions_t, motion_at
  use follow_points_mod, only: locate_at
  implicit none
  private

  public :: motions_at_rows, motion_of_point, undeformed_frames

  real(wp), parameter :: rounding = 1.0e-12_wp !! of a motion, whose pin moves by 1: none

contains

  !> What the free motions do at the rows of the contact points, G of docs/theory.md (9.2).
  !>
  !> A row across a motion is exactly 0: were it rounding, contact would seem to hold a body that
  !> slides along it.
  pure function motions_at_rows(scene, points, motions, frame, row) result(g)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(free_motions_t), intent(in) :: motions
    real(wp), intent(in) :: frame(:, :, :)  !! (3,3,n_points)
    integer, intent(in) :: row(:, :)        !! (3,n_points) 0 where there is none
    real(wp), allocatable :: g(:, :)        !! (n_rows,n_motions) [-]
    real(wp) :: motion(3)
    integer :: i, j, a

    allocate (g(count(row > 0), motions%n))
    do i = 1, points%n
      if (row(1, i) == 0) cycle
      do j = 1, motions%n
        motion = motion_of_point(scene, points, motions, i, j)
        do a = 1, 3
          if (row(a, i) == 0) cycle
          g(row(a, i), j) = dot_product(frame(:, a, i), motion)
          if (abs(g(row(a, i), j)) <= rounding*max(1.0_wp, norm2(motion))) g(row(a, i), j) = 0.0_wp
        end do
      end do
    end do
  end function motions_at_rows

  !> What free motion `j` does to a point's node, less what it does to its obstacle.
  pure function motion_of_point(scene, points, motions, i, j) result(motion)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(free_motions_t), intent(in) :: motions
    integer, intent(in) :: i, j
    real(wp) :: motion(3) !! [-]

    motion = motion_at(motions, scene%mesh, j, points%node(i))
    if (points%ref_node(i) > 0) motion = motion - motion_at(motions, scene%mesh, j, &
      points%ref_node(i))
  end function motion_of_point

  !> Frames of the contact points before anything moved.
  pure function undeformed_frames(scene, points) result(frame)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    real(wp) :: frame(3, 3, points%n)
    real(wp) :: gap, nothing(3, scene%mesh%n_nodes)
    integer :: i

    nothing = 0.0_wp
    do i = 1, points%n
      call locate_at(scene, points, i, nothing, gap, frame(:, :, i))
    end do
  end function undeformed_frames

end module point_motions_mod
