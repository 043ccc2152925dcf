!> The stiffness of the free degrees of freedom as iterations see it: products with it, and an
!> approximate inverse.
!>
!> Some directions at some nodes may be held, as contact holds them: with P the projection on what
!> is left the approximate inverse is that of P K P. docs/theory.md (4.15).
!>
!> Of bodies that move freely the pins are unknowns too, after the equations: K is the stiffness of
!> bodies that nothing pins, and singular. The approximate inverse is that of K with a spring at
!> every pin.
module iterative_body_mod
  use kinds_mod, only: wp, i8
  use errors_mod, only: error_t, raise, exit_not_solved
  use text_mod, only: to_text
  use springs_mod, only: springs_t
  use dof_map_mod, only: dof_map_t
  implicit none
  private

  public :: iterative_body_t, numbering_t

  integer, parameter :: most_iterations = 500 !! of conjugate gradients, for one solution

  !> Which unknowns a body has.
  type :: numbering_t
    type(dof_map_t) :: whole            !! the rows of its stiffness, where nothing is pinned
    type(dof_map_t) :: map              !! its equations, pins held
    integer, allocatable :: pin_node(:), pin_dof(:) !! (n_pins) of free motions of bodies
    integer, allocatable :: facing(:)   !! nodes that springs may join, ascending
  end type numbering_t

  type, abstract :: iterative_body_t
    integer :: n = 0                !! equations
    integer :: n_pins = 0           !! of free motions
    integer(i8) :: iterations = 0   !! each with a product and an approximate inverse, summed
    integer(i8) :: solutions = 0    !! right-hand sides solved for
    real(wp), allocatable :: diagonal(:) !! (n+n_pins) of the stiffness [force/length]
    type(error_t), allocatable :: failure !! of the library; it holds for good
  contains
    procedure(hold_directions), deferred :: hold
    procedure(multiply), deferred :: product
    procedure(multiply), deferred :: precondition
    procedure :: solve => solve_by_conjugate_gradients
  end type iterative_body_t

  abstract interface
    !> Hold directions at nodes from now on, and no others. The approximate inverse sees it on the
    !> unknowns alone, not on what these are coarsened to: that is made once, so that what an
    !> increment computes depends on no other.
    !>
    !> Springs between nodes, that the approximate inverse sees too: in the place of what contact of
    !> bodies with each other holds.
    subroutine hold_directions(body, node, held, stiffer, springs, of_spring)
      import :: iterative_body_t, springs_t, wp
      implicit none
      class(iterative_body_t), intent(inout) :: body
      integer, intent(in) :: node(:)           !! (m) distinct, of the mesh
      real(wp), intent(in) :: held(:, :, :)    !! (3,3,m) projection on what is held, x, y, z [-]
      real(wp), intent(in) :: stiffer(:, :, :)
      !! (3,3,m) stiffness that the inverse takes for one of the node, 0 along what is held
      !! [force/length]
      type(springs_t), intent(in) :: springs   !! between nodes of the mesh
      real(wp), intent(in) :: of_spring(:, :, :) !! (3,3,n_springs) stiffness [force/length]
    end subroutine hold_directions

    !> K x, whatever is held; or the approximate inverse of P K P with x, 0 along what is held.
    subroutine multiply(body, x, y)
      import :: iterative_body_t, wp
      implicit none
      class(iterative_body_t), intent(inout) :: body
      real(wp), intent(in) :: x(:)  !! (n+n_pins)
      real(wp), intent(out) :: y(:) !! (n+n_pins)
    end subroutine multiply
  end interface

contains

  !> K x = b by conjugate gradients, the pins held and nothing else, to |b - K x| <= tolerance |b|.
  subroutine solve_by_conjugate_gradients(body, b, tolerance, error)
    class(iterative_body_t), intent(inout) :: body
    real(wp), intent(inout) :: b(:)       !! (n) [force] in, [length] out
    real(wp), intent(in) :: tolerance     !! [-]
    type(error_t), allocatable, intent(out) :: error !! of the library; it does not converge
    real(wp), dimension(body%n + body%n_pins) :: left, x, z, p, q
    real(wp) :: size_b, rho, last_rho, curvature
    real(wp) :: nothing(3, 3, 0)
    type(springs_t) :: no_springs
    integer :: i

    call body%hold([integer ::], nothing, nothing, no_springs, nothing)
    body%solutions = body%solutions + 1
    size_b = norm2(b)
    x = 0.0_wp
    last_rho = 0.0_wp
    left = 0.0_wp
    left(:body%n) = b
    iterations: do i = 1, most_iterations
      if (norm2(left) <= tolerance*size_b) exit iterations
      call body%precondition(left, z)
      z(body%n + 1:) = 0.0_wp
      rho = dot_product(left, z)
      if (i == 1) then
        p = z
      else
        p = z + rho/last_rho*p
      end if
      last_rho = rho
      call body%product(p, q)
      q(body%n + 1:) = 0.0_wp
      body%iterations = body%iterations + 1
      curvature = dot_product(p, q)
      if (allocated(body%failure)) then
        error = body%failure
        return
      end if
      if (.not. (curvature > 0.0_wp .and. rho > 0.0_wp)) exit iterations
      x = x + rho/curvature*p
      left = left - rho/curvature*q
    end do iterations
    if (norm2(left) > tolerance*size_b) call raise(error, exit_not_solved, &
      'conjugate gradients do not solve for the body: after '//to_text(min(i, most_iterations))// &
      ' iterations '//to_text(norm2(left)/size_b, 2)//' of the load is still out of balance; '// &
      '*BODY SOLVER, TYPE=FACTOR solves for it with a factor')
    b = x(:body%n)
  end subroutine solve_by_conjugate_gradients

end module iterative_body_mod
