!> Reactions that equilibrium does not determine: they act on supports and constraints alone, or are
!> so large that their last bits are. docs/theory.md section 6.
module undetermined_forces_mod
  use kinds_mod, only: wp
  use constraints_mod, only: constraints_t, constraint_of
  use mesh_mod, only: mesh_t
  use contact_points_mod, only: contact_points_t
  use increment_report_mod, only: contact_fields_t
  use increment_forces_mod, only: increment_forces_t
  use error_measures_mod, only: ratio
  implicit none
  private

  public :: largest_undetermined

contains

  !> The largest reaction that nothing determines, beside the scale of forces at its point.
  !>
  !> It counts where what it does to degrees of freedom that neither supports nor constraints hold
  !> is no more than is allowed of itself, and of the scale; and as far as its last bits are worth
  !> more than that.
  pure real(wp) function largest_undetermined(mesh, points, contact, reaction, forces, f, &
    allowed) result(worst)
    type(mesh_t), intent(in) :: mesh
    type(contact_points_t), intent(in) :: points
    type(contact_fields_t), intent(in) :: contact  !! its weights
    real(wp), intent(in) :: reaction(:, :)         !! (3,n_points) x, y, z [force]
    type(increment_forces_t), intent(in) :: forces
    real(wp), intent(in) :: f(:)                   !! (n_points) scale of forces [force]
    real(wp), intent(in) :: allowed                !! [-]
    integer :: number(3, mesh%n_nodes)   !! of the constraint that a degree of freedom has, or 0
    real(wp) :: acting(3, mesh%n_nodes)  !! on free degrees of freedom, of one point [force]
    real(wp) :: here, most
    integer :: i, k, dof

    worst = 0.0_wp
    acting = 0.0_wp
    number = 0
    if (forces%constraints%n > 0) number = constraint_of(forces%constraints, mesh%n_nodes)
    do i = 1, points%n
      here = norm2(reaction(:, i))
      if (here <= max(allowed, worst)*f(i)) cycle
      if (epsilon(1.0_wp)*here > allowed*f(i)) then
        worst = max(worst, ratio(epsilon(1.0_wp)*here, f(i)))
        cycle
      end if
      most = 0.0_wp
      associate (first => contact%weights%first(i), last => contact%weights%first(i + 1) - 1, &
        node => contact%weights%node, weight => contact%weights%weight)
        do dof = 1, 3
          call put(points%node(i), dof, reaction(dof, i), acting)
          do k = first, last
            call put(node(k), dof, -weight(k)*reaction(dof, i), acting)
          end do
        end do
        do dof = 1, 3
          call take(points%node(i), dof, acting, most)
          do k = first, last
            call take(node(k), dof, acting, most)
          end do
        end do
      end associate
      if (most <= allowed*min(here, f(i))) worst = max(worst, ratio(here, f(i)))
    end do

  contains

    !> Put a force on a degree of freedom, or on what it depends on; on supports it is lost.
    pure recursive subroutine put(node, dof, force, acting)
      integer, intent(in) :: node, dof
      real(wp), intent(in) :: force
      real(wp), intent(inout) :: acting(:, :)
      integer :: l

      if (forces%prescribed(dof, node)) return
      if (number(dof, node) == 0) then
        acting(dof, node) = acting(dof, node) + force
        return
      end if
      associate (all => forces%constraints, c => number(dof, node))
        do l = all%first(c), all%first(c + 1) - 1
          call put(all%master(l), all%master_dof(l), all%weight(l)*force, acting)
        end do
      end associate
    end subroutine put

    !> Take off what `put` has put there, and remember the most of it.
    pure recursive subroutine take(node, dof, acting, most)
      integer, intent(in) :: node, dof
      real(wp), intent(inout) :: acting(:, :), most
      integer :: l

      if (forces%prescribed(dof, node)) return
      if (number(dof, node) == 0) then
        most = max(most, abs(acting(dof, node)))
        acting(dof, node) = 0.0_wp
        return
      end if
      associate (all => forces%constraints, c => number(dof, node))
        do l = all%first(c), all%first(c + 1) - 1
          call take(all%master(l), all%master_dof(l), acting, most)
        end do
      end associate
    end subroutine take

  end function largest_undetermined

end module undetermined_forces_mod
