!> The forces of the springs of the deck by the certificate's own code: loads on the bodies that
!> they join.
!>
!> The line of an axial one that turns is that of its deformed ends. docs/theory.md (6.2).
module spring_pulls_mod
  use kinds_mod, only: wp
  use mesh_mod, only: mesh_t
  use spring_elements_mod, only: listed_springs, spring_elements_t
  use increment_forces_mod, only: increment_forces_t
  implicit none
  private

  public :: add_spring_pulls

contains

  !> Add what springs pull at the nodes, and the rounding of that.
  pure subroutine add_spring_pulls(mesh, u, forces)
    type(mesh_t), intent(in) :: mesh
    real(wp), intent(in) :: u(:, :)  !! (3,n_nodes) [length]
    type(increment_forces_t), intent(inout) :: forces !! its strain is known
    real(wp), parameter :: operations = 32.0_wp ! rounded ones that add up, as of (6.2)
    real(wp) :: old_line(3), new_line(3), along(3), growth, size_of_terms, force, rigidity
    integer :: s, m

    do s = 1, listed_springs(mesh%springs)
      associate (springs => mesh%springs, from => mesh%springs%first(s), &
                 to => mesh%springs%first(s + 1) - 1)
        associate (ends => springs%node(from:to))
          rigidity = springs%stiffness(s)
          if (springs%is_axial(s)) then
            old_line = mesh%coordinates(:, ends(2)) - mesh%coordinates(:, ends(1))
            new_line = old_line + (u(:, ends(2)) - u(:, ends(1)))
            if (forces%is_finite) then
              along = new_line/sqrt(sum(new_line**2))
              growth = sqrt(sum(new_line**2)) - sqrt(sum(old_line**2))
            else
              along = old_line/sqrt(sum(old_line**2))
              growth = dot_product(new_line - old_line, along)
            end if
            size_of_terms = maxval(abs(u(:, ends)))
            if (forces%is_finite) size_of_terms = size_of_terms + maxval(abs(new_line))
            force = rigidity*growth
            if (forces%is_finite) call take_from_table(springs, s, growth, force)
            forces%external(:, ends(1)) = forces%external(:, ends(1)) + force*along
            forces%external(:, ends(2)) = forces%external(:, ends(2)) - force*along
            forces%rounding(ends) = forces%rounding(ends) + operations*epsilon(1.0_wp)*rigidity* &
              size_of_terms
            cycle
          end if
          growth = 0.0_wp
          size_of_terms = 0.0_wp
          do m = from, to
            growth = growth + dot_product(u(:, springs%node(m)), springs%direction(:, m))
            size_of_terms = size_of_terms + dot_product(abs(u(:, springs%node(m))), &
              abs(springs%direction(:, m)))
          end do
          force = rigidity*growth
          if (forces%is_finite) call take_from_table(springs, s, growth, force)
          do m = from, to
            associate (node => springs%node(m))
              forces%external(:, node) = forces%external(:, node) - force*springs%direction(:, m)
              forces%rounding(node) = forces%rounding(node) + operations*epsilon(1.0_wp)* &
                rigidity*size_of_terms*maxval(abs(springs%direction(:, m)))
            end associate
          end do
        end associate
      end associate
    end do
  end subroutine add_spring_pulls

  !> Of a spring with a table: the force there, between the two rows about the growth.
  pure subroutine take_from_table(springs, s, growth, force)
    type(spring_elements_t), intent(in) :: springs
    integer, intent(in) :: s
    real(wp), intent(in) :: growth      !! [length]
    real(wp), intent(inout) :: force    !! kept where there is no table [force]
    integer :: row, last
    real(wp) :: part

    if (springs%table(s) == 0) return
    associate (table => springs%tables(springs%table(s)))
      last = size(table%force)
      force = table%force(last)
      do row = last, 1, -1
        if (growth > table%elongation(row)) exit
        force = table%force(row)
        if (row == 1) exit
        if (growth <= table%elongation(row - 1)) cycle
        part = (table%elongation(row) - growth)/(table%elongation(row) - table%elongation(row - 1))
        force = part*table%force(row - 1) + (1.0_wp - part)*table%force(row)
        exit
      end do
    end associate
  end subroutine take_from_table

end module spring_pulls_mod
