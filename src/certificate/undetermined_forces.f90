!> Reactions that equilibrium does not determine: they act on supports and constraints alone, or are
!> so large that their last bits are. docs/theory.md section 6.
module undetermined_forces_mod
  use kinds_mod, only: wp
  use growing_lists_mod, only: append
  use constraints_mod, only: constraint_of
  use mesh_mod, only: mesh_t
  use contact_points_mod, only: contact_points_t
  use increment_report_mod, only: contact_fields_t
  use increment_forces_mod, only: increment_forces_t
  use error_measures_mod, only: ratio, rounded
  implicit none
  private

  public :: largest_undetermined

  !> Forces of one point on free degrees of freedom.
  type :: free_forces_t
    real(wp), allocatable :: force(:, :)  !! (3,n_nodes) 0 but at those of the list [force]
    integer :: n = 0
    integer, allocatable :: at(:, :)      !! (2,n) degree of freedom, node; some may be there twice
  end type free_forces_t

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
    type(free_forces_t) :: acting
    real(wp) :: last_bits, here, most, of_slave, free_weight
    integer :: i, k

    worst = 0.0_wp
    allocate (acting%force(3, mesh%n_nodes), source=0.0_wp)
    allocate (acting%at(2, 64))
    number = 0
    if (forces%constraints%n > 0) number = constraint_of(forces%constraints, mesh%n_nodes)
    do i = 1, points%n
      last_bits = epsilon(1.0_wp)*norm2(contact%reaction(:, i))
      if (last_bits > allowed*f(i)) worst = max(worst, ratio(last_bits, f(i)))
      here = contact%reaction(1, i)
      if (here <= max(allowed, worst)*f(i)) cycle
      associate (first => contact%weights%first(i), last => contact%weights%first(i + 1) - 1, &
        node => contact%weights%node, weight => contact%weights%weight, &
        normal => contact%frame(:, 1, i))
        ! Together, in which forces on a node and on what depends on it may cancel.
        call put_on_slave(i, here*normal, acting)
        do k = first, last
          call put(node(k), -weight(k)*here*normal, acting)
        end do
        call take(acting, most)
        if (most > allowed*min(here, f(i))) then
          ! One by one.
          call put_on_slave(i, normal, acting)
          call take(acting, of_slave)
          if (of_slave > rounded) cycle
          free_weight = 0.0_wp
          do k = first, last
            call put(node(k), normal, acting)
            call take(acting, most)
            if (most > rounded) free_weight = free_weight + abs(weight(k))
          end do
          if (free_weight > nearly_none*sum(abs(weight(first:last)))) cycle
        end if
      end associate
      worst = max(worst, ratio(here, f(i)))
    end do

  contains

    !> Put the reaction of a point on the nodes of its slave.
    pure subroutine put_on_slave(i, force, acting)
      integer, intent(in) :: i
      real(wp), intent(in) :: force(3)
      type(free_forces_t), intent(inout) :: acting
      real(wp) :: own
      integer :: end

      own = 1.0_wp
      if (forces%middles%is_any) own = 1.0_wp/(1.0_wp - 2.0_wp*forces%middles%a(i))
      call put(points%node(i), own*force, acting)
      if (.not. own > 1.0_wp) return
      do end = 1, 2
        call put(forces%middles%nodes(end, i), -forces%middles%a(i)*own*force, acting)
      end do
    end subroutine put_on_slave

    !> Put a force on a node, or on what its degrees of freedom depend on; on supports it is lost.
    pure recursive subroutine put(node, force, acting, only)
      integer, intent(in) :: node
      real(wp), intent(in) :: force(3)
      type(free_forces_t), intent(inout) :: acting
      integer, intent(in), optional :: only !! degree of freedom
      real(wp) :: of_master(3)
      integer :: dof, l

      do dof = 1, 3
        if (present(only)) then
          if (dof /= only) cycle
        end if
        if (forces%prescribed(dof, node)) cycle
        if (number(dof, node) == 0) then
          acting%force(dof, node) = acting%force(dof, node) + force(dof)
          call append(acting%at, acting%n, [dof, node])
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

  end function largest_undetermined

  !> Take off all forces, and say how large the largest was.
  pure subroutine take(acting, most)
    type(free_forces_t), intent(inout) :: acting
    real(wp), intent(out) :: most  !! [force]
    integer :: k

    most = 0.0_wp
    do k = 1, acting%n
      associate (force => acting%force(acting%at(1, k), acting%at(2, k)))
        most = max(most, abs(force))
        force = 0.0_wp
      end associate
    end do
    acting%n = 0
  end subroutine take

end module undetermined_forces_mod
