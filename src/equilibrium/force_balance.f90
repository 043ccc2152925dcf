!> The forces that are out of balance, beside those of their bodies.
module force_balance_mod
  use kinds_mod, only: wp
  use constraints_mod, only: constraints_t, give_to_masters
  use mesh_mod, only: mesh_t
  use increment_forces_mod, only: increment_forces_t
  implicit none
  private

  public :: out_of_balance, scale_of_forces

contains

  !> f_ext + B^T r - f_int on the free degrees of freedom, and the largest of a node beside the
  !> largest force of its body, less what rounding makes of it.
  !>
  !> Rounding of many nodes may add up in the balance of a body: where the certificate has not
  !> passed it is no excuse, and what is left is taken out as far as it goes.
  pure subroutine out_of_balance(mesh, active, forces, closely, residual, relative, left)
    type(mesh_t), intent(in) :: mesh
    type(constraints_t), intent(in) :: active               !! chains substituted
    type(increment_forces_t), intent(in) :: forces
    logical, intent(in) :: closely                          !! rounding is no excuse
    real(wp), intent(inout) :: residual(:, :)
    !! (3,n_nodes) of all nodes in; given to masters, 0 where prescribed out [force]
    real(wp), intent(out) :: relative                       !! [-]
    real(wp), intent(out) :: left                           !! of the same node [force]
    real(wp) :: scale(0:mesh%n_bodies), rounding(mesh%n_nodes)
    integer :: node, c, k

    call give_to_masters(active, residual)
    rounding = forces%rounding
    do c = 1, active%n
      do k = active%first(c), active%first(c + 1) - 1
        associate (of_master => rounding(active%master(k)))
          of_master = of_master + abs(active%weight(k))*forces%rounding(active%node(c))
        end associate
      end do
    end do
    where (forces%prescribed) residual = 0.0_wp
    scale = scale_of_forces(mesh, forces)
    relative = 0.0_wp
    left = 0.0_wp
    do node = 1, mesh%n_nodes
      associate (beyond => norm2(residual(:, node)) - merge(0.0_wp, rounding(node), closely), &
        of_body => scale(mesh%body(node)))
        if (beyond <= relative*of_body) cycle
        relative = beyond/of_body
        left = beyond
      end associate
    end do
  end subroutine out_of_balance

  !> The largest force of each body, 1 where there is none; of nodes without elements that of all.
  pure function scale_of_forces(mesh, forces) result(scale)
    type(mesh_t), intent(in) :: mesh
    type(increment_forces_t), intent(in) :: forces
    real(wp) :: scale(0:mesh%n_bodies) !! [force]
    integer :: node

    scale = 0.0_wp
    if (allocated(forces%of_elements%largest)) scale = forces%of_elements%largest
    do node = 1, mesh%n_nodes
      associate (of_body => scale(mesh%body(node)))
        of_body = max(of_body, norm2(forces%internal(:, node)), norm2(forces%external(:, node)))
      end associate
    end do
    scale(0) = maxval(scale)
    where (scale <= 0.0_wp) scale = 1.0_wp
  end function scale_of_forces

end module force_balance_mod
