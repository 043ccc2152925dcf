!> Contact and the displacements of the bodies together, where need be a part of the way after the
!> other. docs/theory.md (4.18).
!>
!> Where friction spreads far in an increment Newton's method may go to and fro between points that
!> stick and slide. Of what it starts from a neighbouring problem is made that this solves, and
!> what that differs by is taken back in parts.
module contact_in_parts_mod
  use kinds_mod, only: wp
  use controls_mod, only: contact_controls_t
  use increment_report_mod, only: ended_unbalanced
  use friction_laws_mod, only: largest_friction
  use problem_mod, only: contact_problem_t, contact_report_t, pack_rows, unpack_rows
  use whole_newton_mod, only: bodies_t, solve_with_body
  use body_map_mod, only: body_map_t
  implicit none
  private

  public :: solve_in_parts

  real(wp), parameter :: first_part = 0.25_wp        !! of the way [-]
  real(wp), parameter :: smallest_part = 1.0_wp/64.0_wp
  real(wp), parameter :: growth = 1.5_wp             !! of a part that was soon done [-]
  integer,  parameter :: soon = 6                    !! iterations
  real(wp), parameter :: on_the_way = 1.0e-3_wp      !! residual at the end of a part [-]

  !> What a neighbouring problem has beside the one to solve.
  type :: neighbour_t
    real(wp), allocatable :: x(:)    !! (n_rows) gaps and slips [length]
    real(wp), allocatable :: load(:) !! (n) of the bodies [force]
  end type neighbour_t

contains

  !> Solve contact at once, or else in parts.
  !>
  !> Not converging is no error: the report says so, and all is as the attempt at once left it.
  subroutine solve_in_parts(problem, body, x_free, controls, bodies, r, report)
    type(contact_problem_t), target, intent(in) :: problem
    class(body_map_t), target, intent(inout) :: body
    real(wp), intent(in) :: x_free(:)       !! (n_rows) without reactions and load [length]
    type(contact_controls_t), intent(in) :: controls
    type(bodies_t), intent(inout) :: bodies
    real(wp), intent(inout) :: r(:, :)      !! (3,n_points) warm start in, solution out [force]
    type(contact_report_t), intent(out) :: report
    type(bodies_t) :: start, reached, part
    type(contact_controls_t) :: roughly
    type(contact_report_t) :: of_part
    type(neighbour_t) :: beside
    real(wp), dimension(3, problem%n_points) :: r_reached, r_part
    real(wp) :: done, width, next

    start = bodies
    r_reached = r
    call solve_with_body(problem, body, x_free, controls, bodies, r, report)
    if (report%converged() .or. report%ending == ended_unbalanced) return
    ! Bodies that move freely have no place of their own to start from.
    if (size(bodies%motions, 2) > 0) return
    reached = start
    call make_solved(problem, body, x_free, start, r_reached, beside)
    roughly = controls
    roughly%tolerance = max(controls%tolerance, on_the_way)
    done = 0.0_wp
    width = first_part
    do while (width >= smallest_part)
      next = min(1.0_wp, done + width)
      part = start
      part%v = reached%v
      part%load = start%load + (1.0_wp - next)*beside%load
      r_part = r_reached
      if (next < 1.0_wp) then
        call solve_with_body(problem, body, x_free + (1.0_wp - next)*beside%x, roughly, part, &
          r_part, of_part)
      else
        call solve_with_body(problem, body, x_free, controls, part, r_part, of_part)
      end if
      report%iterations = report%iterations + of_part%iterations
      report%products = report%products + of_part%products
      if (.not. of_part%converged()) then
        width = 0.5_wp*width
        cycle
      end if
      reached = part
      r_reached = r_part
      done = next
      if (.not. done < 1.0_wp) exit
      if (of_part%iterations <= soon) width = growth*width
    end do
    if (done < 1.0_wp) return
    of_part%iterations = report%iterations
    of_part%products = report%products
    report = of_part
    bodies = reached
    r = r_reached
  end subroutine solve_in_parts

  !> What a problem has beside this one where the start solves it: its forces are within their
  !> cones, its points touch where they press and else are apart, and the bodies are in balance.
  subroutine make_solved(problem, body, x_free, start, r, beside)
    type(contact_problem_t), intent(in) :: problem
    class(body_map_t), intent(in) :: body
    real(wp), intent(in) :: x_free(:)
    type(bodies_t), intent(in) :: start
    real(wp), intent(inout) :: r(:, :) !! (3,n_points) of the start; projected on the cones [force]
    type(neighbour_t), intent(out) :: beside
    real(wp) :: x(3, problem%n_points), tangential, limit, slope
    integer :: i

    call body%at_points(start%v, x)
    x = -x - unpack_rows(problem, x_free)
    do i = 1, problem%n_points
      if (r(1, i) > 0.0_wp .or. problem%stays(i)) then
        call largest_friction(problem%mu(i), problem%law, i, r(1, i), limit, slope)
        tangential = norm2(r(2:, i))
        if (tangential > limit) r(2:, i) = limit/tangential*r(2:, i)
      else
        r(:, i) = 0.0_wp
        x(1, i) = max(0.0_wp, x(1, i))
        x(2:, i) = 0.0_wp
      end if
    end do
    beside%x = pack_rows(problem, x)
    allocate (beside%load(size(start%v)))
    call body%product(start%v, beside%load)
    beside%load = beside%load - start%load
    call body%add_from_points(-r, beside%load)
  end subroutine make_solved

end module contact_in_parts_mod
