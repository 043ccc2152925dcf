!> Whether loads that nothing balances pull bodies off what they touch, for the message.
module pull_off_mod
  use kinds_mod, only: wp
  use mesh_mod, only: mesh_t
  use contact_points_mod, only: contact_points_t
  use rigid_modes_mod, only: free_motions_t, add_motions
  use placement_mod, only: placement_t
  use transfer_mod, only: relative_motion
  implicit none
  private

  public :: pulls_off

contains

  !> Whether contact opens, and closes nowhere, both along the motion that nothing balances and
  !> where the resultants of the loads point.
  pure logical function pulls_off(mesh, points, placement, motions, unbalanced, external)
    type(mesh_t), intent(in) :: mesh
    type(contact_points_t), intent(in) :: points
    type(placement_t), intent(in) :: placement
    type(free_motions_t), intent(in) :: motions
    real(wp), intent(in) :: unbalanced(:)  !! (n) of each motion
    real(wp), intent(in) :: external(:, :) !! (3,n_nodes) [force]
    real(wp) :: away(3, mesh%n_nodes)

    away = 0.0_wp
    call add_motions(motions, mesh, unbalanced, away)
    pulls_off = opens_contact(points, placement, away)
    if (pulls_off) pulls_off = opens_contact(points, placement, pulled(mesh, motions, external))
  end function pulls_off

  !> Every free body moved as the resultant of its loads points, and free obstacles likewise.
  pure function pulled(mesh, motions, external) result(u)
    type(mesh_t), intent(in) :: mesh
    type(free_motions_t), intent(in) :: motions
    real(wp), intent(in) :: external(:, :) !! (3,n_nodes) [force]
    real(wp) :: u(3, size(external, 2))
    real(wp) :: resultant(3, mesh%n_bodies)
    integer :: node

    u = 0.0_wp
    resultant = 0.0_wp
    do node = 1, mesh%n_nodes
      associate (body => mesh%body(node))
        if (body > 0) resultant(:, body) = resultant(:, body) + external(:, node)
      end associate
    end do
    do node = 1, mesh%n_nodes
      associate (body => mesh%body(node))
        if (body > 0) then
          if (any(motions%body == body)) u(:, node) = resultant(:, body)
        else if (any(motions%body == 0 .and. motions%node == node)) then
          u(:, node) = external(:, node)
        end if
      end associate
    end do
  end function pulled

  !> Whether a motion closes no contact, and opens some.
  pure logical function opens_contact(points, placement, motion)
    type(contact_points_t), intent(in) :: points
    type(placement_t), intent(in) :: placement
    real(wp), intent(in) :: motion(:, :) !! (3,n_nodes)
    real(wp), parameter :: rounding = 1.0e-9_wp !! of the motion: no opening [-]
    real(wp) :: opening(points%n)
    integer :: i

    do i = 1, points%n
      opening(i) = dot_product(placement%frame(:, 1, i), relative_motion(points, &
        placement%weights, i, motion))
    end do
    opens_contact = .false.
    if (points%n > 0) opens_contact = maxval(opening) > rounding*maxval(abs(motion)) .and. &
      minval(opening) >= -rounding*maxval(abs(motion))
  end function opens_contact

end module pull_off_mod
