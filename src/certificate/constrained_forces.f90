!> What the certificate knows of constraints: whether they are kept, and where forces go that act on
!> what depends on others. docs/theory.md section 11.
module constrained_forces_mod
  use kinds_mod, only: wp
  use constraints_mod, only: constraints_t
  use mesh_mod, only: mesh_t
  use rigid_patterns_mod, only: rigid_patterns_t
  use turning_means_mod, only: turning_means_t, is_of_mean
  use error_measures_mod, only: ratio
  implicit none
  private

  public :: torn, hand_over, hand_down, mark_masters

contains

  !> How far what depends is from where its masters say it is, beside what they add up and the size
  !> of the mesh. docs/theory.md (11.11).
  pure real(wp) function torn(mesh, u, constraints, prescribed, patterns, means)
    type(mesh_t), intent(in) :: mesh
    real(wp), intent(in) :: u(:, :)  !! (3,n_nodes) [length]
    type(constraints_t), intent(in) :: constraints
    logical, intent(in) :: prescribed(:, :) !! (3,n_nodes) by supports, which come first
    type(rigid_patterns_t), intent(in) :: patterns !! whose constraints are no lines
    type(turning_means_t), intent(in) :: means     !! likewise
    real(wp) :: size_of_mesh, here, sum_of_sizes, part
    integer :: c, k

    torn = 0.0_wp
    size_of_mesh = maxval(maxval(mesh%coordinates, dim=2) - minval(mesh%coordinates, dim=2))
    associate (all => constraints)
      do c = 1, all%n
        if (prescribed(all%dof(c), all%node(c))) cycle
        if (patterns%n > 0) then
          if (patterns%of_node(all%node(c)) > 0) cycle
        end if
        if (is_of_mean(means, all%node(c), all%dof(c))) cycle
        here = u(all%dof(c), all%node(c))
        sum_of_sizes = abs(here)
        do k = all%first(c), all%first(c + 1) - 1
          part = all%weight(k)*u(all%master_dof(k), all%master(k))
          here = here - part
          sum_of_sizes = sum_of_sizes + abs(part)
        end do
        torn = max(torn, ratio(abs(here), max(sum_of_sizes, size_of_mesh)))
      end do
    end associate
  end function torn

  !> Give the forces on what depends to its masters, again and again where these depend in their
  !> turn, and the rounding of internal forces with them.
  pure subroutine hand_over(constraints, prescribed, residual, rounding)
    type(constraints_t), intent(in) :: constraints
    logical, intent(in) :: prescribed(:, :)   !! (3,n_nodes) held by supports
    real(wp), intent(inout) :: residual(:, :) !! (3,n_nodes) [force]
    real(wp), intent(inout) :: rounding(:)    !! (n_nodes) of internal forces [force]
    real(wp) :: along(3, size(residual, 2))
    integer :: c, k, round

    if (constraints%n == 0) return
    along = spread(rounding, 1, 3)
    associate (all => constraints)
      ! No chain is longer than there are constraints.
      do round = 1, all%n
        do c = 1, all%n
          associate (i => all%dof(c), node => all%node(c))
            if (prescribed(i, node)) cycle
            do k = all%first(c), all%first(c + 1) - 1
              associate (to => all%master(k), j => all%master_dof(k))
                residual(j, to) = residual(j, to) + all%weight(k)*residual(i, node)
                along(j, to) = along(j, to) + abs(all%weight(k))*along(i, node)
              end associate
            end do
            residual(i, node) = 0.0_wp
            along(i, node) = 0.0_wp
          end associate
        end do
        if (.not. some_left()) exit
      end do
    end associate
    rounding = maxval(along, dim=1)

  contains

    pure logical function some_left()
      integer :: l

      some_left = .false.
      do l = 1, constraints%n
        associate (i => constraints%dof(l), node => constraints%node(l))
          if (prescribed(i, node)) cycle
          some_left = some_left .or. abs(residual(i, node)) > 0.0_wp .or. along(i, node) > 0.0_wp
        end associate
      end do
    end function some_left

  end subroutine hand_over

  !> Let what depends move as its masters do, again and again where these depend in their turn.
  pure subroutine hand_down(constraints, prescribed, moves)
    type(constraints_t), intent(in) :: constraints
    logical, intent(in) :: prescribed(:, :) !! (3,n_nodes) held by supports
    real(wp), intent(inout) :: moves(:, :)  !! (3,n_nodes) displacements, or their rates
    real(wp) :: before(3, size(moves, 2))
    integer :: c, k, round

    associate (all => constraints)
      do round = 1, all%n
        before = moves
        do c = 1, all%n
          associate (here => moves(all%dof(c), all%node(c)))
            if (prescribed(all%dof(c), all%node(c))) cycle
            here = 0.0_wp
            do k = all%first(c), all%first(c + 1) - 1
              here = here + all%weight(k)*moves(all%master_dof(k), all%master(k))
            end do
          end associate
        end do
        if (.not. any(abs(moves - before) > 0.0_wp)) exit
      end do
    end associate
  end subroutine hand_down

  !> Mark also what marked degrees of freedom depend on, again and again.
  pure subroutine mark_masters(constraints, prescribed, marked)
    type(constraints_t), intent(in) :: constraints
    logical, intent(in) :: prescribed(:, :) !! (3,n_nodes) held by supports
    logical, intent(inout) :: marked(:, :)  !! (3,n_nodes)
    integer :: c, k, n_before

    associate (all => constraints)
      do
        n_before = count(marked)
        do c = 1, all%n
          if (prescribed(all%dof(c), all%node(c)) .or. .not. marked(all%dof(c), all%node(c))) cycle
          do k = all%first(c), all%first(c + 1) - 1
            marked(all%master_dof(k), all%master(k)) = .true.
          end do
        end do
        if (count(marked) == n_before) exit
      end do
    end associate
  end subroutine mark_masters

end module constrained_forces_mod
