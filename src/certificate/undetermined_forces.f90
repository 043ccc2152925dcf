!> Reactions that equilibrium does not determine: they act on supports and constraints alone, or are
!> so large that their last bits are. docs/theory.md section 6.
module undetermined_forces_mod
  use kinds_mod, only: wp
  use constraints_mod, only: constraint_of
  use mesh_mod, only: mesh_t
  use contact_points_mod, only: contact_points_t
  use increment_report_mod, only: contact_fields_t
  use increment_forces_mod, only: increment_forces_t
  use error_measures_mod, only: ratio, rounded
  implicit none
  private

  public :: largest_undetermined

  real(wp), parameter :: nearly_none = 0.05_wp
  !! of a point's weights: on the edge of clamps that slide by 1e-3 of an element 1e-3 are free [-]

contains

  !> The largest normal reaction that nothing determines, beside the scale of forces at its point.
  !>
  !> It is one that does no more to degrees of freedom which neither supports nor constraints hold
  !> than is allowed of itself and of the scale; or that supports take at the slave node and at
  !> nearly all of what it faces. Of all reactions the last bits count, where they are worth more
  !> than is allowed.
  pure real(wp) function largest_undetermined(mesh, points, contact, forces, f, allowed) &
    result(worst)
    type(mesh_t), intent(in) :: mesh
    type(contact_points_t), intent(in) :: points
    type(contact_fields_t), intent(in) :: contact  !! frames, weights, reactions
    type(increment_forces_t), intent(in) :: forces
    real(wp), intent(in) :: f(:)                   !! (n_points) scale of forces [force]
    real(wp), intent(in) :: allowed                !! [-]
    integer :: number(3, mesh%n_nodes)   !! of the constraint that a degree of freedom has, or 0
    real(wp) :: acting(3, mesh%n_nodes)  !! on free degrees of freedom, of one point [force]
    real(wp) :: last_bits, here, most, of_slave, free_weight
    integer :: i, k

    worst = 0.0_wp
    acting = 0.0_wp
    number = 0
    if (forces%constraints%n > 0) number = constraint_of(forces%constraints, mesh%n_nodes)
    do i = 1, points%n
      last_bits = epsilon(1.0_wp)*norm2(contact%reaction(:, i))
      if (last_bits > allowed*f(i)) worst = max(worst, ratio(last_bits, f(i)))
      here = contact%reaction(1, i)
      if (here <= max(allowed, worst)*f(i)) cycle
      associate (first => contact%weights%first(i), last => contact%weights%first(i + 1) - 1, &
        node => contact%weights%node, weight => contact%weights%weight, &
        normal => contact%frame(:, 1, i), slave => points%node(i))
        ! Together, in which forces on a node and on what depends on it may cancel.
        call put(slave, here*normal, acting)
        do k = first, last
          call put(node(k), -weight(k)*here*normal, acting)
        end do
        most = 0.0_wp
        call take(slave, acting, most)
        do k = first, last
          call take(node(k), acting, most)
        end do
        if (most > allowed*min(here, f(i))) then
          ! One by one.
          of_slave = 0.0_wp
          call put(slave, normal, acting)
          call take(slave, acting, of_slave)
          if (of_slave > rounded) cycle
          free_weight = 0.0_wp
          do k = first, last
            most = 0.0_wp
            call put(node(k), normal, acting)
            call take(node(k), acting, most)
            if (most > rounded) free_weight = free_weight + abs(weight(k))
          end do
          if (free_weight > nearly_none*sum(abs(weight(first:last)))) cycle
        end if
      end associate
      worst = max(worst, ratio(here, f(i)))
    end do

  contains

    !> Put a force on a node, or on what its degrees of freedom depend on; on supports it is lost.
    pure recursive subroutine put(node, force, acting, only)
      integer, intent(in) :: node
      real(wp), intent(in) :: force(3)
      real(wp), intent(inout) :: acting(:, :)
      integer, intent(in), optional :: only !! degree of freedom
      real(wp) :: of_master(3)
      integer :: dof, l

      do dof = 1, 3
        if (present(only)) then
          if (dof /= only) cycle
        end if
        if (forces%prescribed(dof, node)) cycle
        if (number(dof, node) == 0) then
          acting(dof, node) = acting(dof, node) + force(dof)
          cycle
        end if
        associate (all => forces%constraints, c => number(dof, node))
          do l = all%first(c), all%first(c + 1) - 1
            of_master = all%weight(l)*force(dof)
            call put(all%master(l), of_master, acting, all%master_dof(l))
          end do
        end associate
      end do
    end subroutine put

    !> Take off what `put` has put there, and remember the most of it.
    pure recursive subroutine take(node, acting, most, only)
      integer, intent(in) :: node
      real(wp), intent(inout) :: acting(:, :), most
      integer, intent(in), optional :: only !! degree of freedom
      integer :: dof, l

      do dof = 1, 3
        if (present(only)) then
          if (dof /= only) cycle
        end if
        if (forces%prescribed(dof, node)) cycle
        if (number(dof, node) == 0) then
          most = max(most, abs(acting(dof, node)))
          acting(dof, node) = 0.0_wp
          cycle
        end if
        associate (all => forces%constraints, c => number(dof, node))
          do l = all%first(c), all%first(c + 1) - 1
            call take(all%master(l), acting, most, all%master_dof(l))
          end do
        end associate
      end do
    end subroutine take

  end function largest_undetermined

end module undetermined_forces_mod
