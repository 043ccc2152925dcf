!> Random contact points and problems for the units of several folders, and a judge of their
!> solutions that knows no projection.
module contact_samples
  use kinds_mod, only: wp
  use small_matrix_mod, only: largest_eigenvalue
  use near_stiffness_mod, only: near_stiffness_t
  use local_point_mod, only: local_point_t
  use bipotential_mod, only: bipotential_residual
  use pseudopotential_mod, only: pseudopotential_residual
  use problem_mod, only: contact_problem_t, make_problem, relative_gaps, pack_rows, unpack_gaps, &
    add_driven_friction
  implicit none
  private

  public :: random_point, new_point, random_compliance, law_defect, random_problem, problem_defect
  public :: identity, stack_of_blocks, nodes_in_a_corner

  real(wp), parameter :: identity(3, 3) = reshape([real(wp) :: 1, 0, 0, 0, 1, 0, 0, 0, 1], [3, 3])

contains

  !> A point with a random compliance and a random x_loc, and its natural rho.
  function random_point(mu, bipotential) result(point)
    real(wp), intent(in) :: mu
    logical, intent(in) :: bipotential
    type(local_point_t) :: point
    real(wp) :: x(3)

    call random_number(x)
    point = new_point(mu, random_compliance(), 2.0_wp*x - [1.6_wp, 1.0_wp, 1.0_wp], bipotential)
  end function random_point

  !> A point with the natural rho of its compliance.
  function new_point(mu, w, x_loc, bipotential) result(point)
    real(wp), intent(in) :: mu, w(3, 3), x_loc(3)
    logical, intent(in) :: bipotential
    type(local_point_t) :: point
    real(wp) :: tangential(3, 3)

    point%mu = mu
    point%w = w
    point%x_loc = x_loc
    point%rho = 1.0_wp/largest_eigenvalue(w)
    point%rho_n = 1.0_wp/w(1, 1)
    tangential = w
    tangential(1, :) = 0.0_wp
    tangential(:, 1) = 0.0_wp
    point%rho_t = 1.0_wp/largest_eigenvalue(tangential)
    if (bipotential) then
      point%residual => bipotential_residual
    else
      point%residual => pseudopotential_residual
    end if
  end function new_point

  !> A symmetric positive definite matrix coupled weakly enough for one solution up to mu = 1.
  function random_compliance() result(w)
    real(wp) :: w(3, 3), m(3, 3)

    do
      call random_number(m)
      m = m - 0.5_wp
      w = matmul(m, transpose(m)) + 0.1_wp*identity
      if (norm2(w(1, 2:)) < 0.7_wp*w(1, 1)) return
    end do
  end function random_compliance

  !> How far (r, x) is from Signorini's and Coulomb's laws, relative to the forces and lengths of a
  !> point: 0 at a solution.
  pure function law_defect(mu, x, r, length, force) result(defect)
    real(wp), intent(in) :: mu, x(3), r(3)
    real(wp), intent(in) :: length, force !! scales
    real(wp) :: defect, x_t, r_t, disc

    x_t = norm2(x(2:))
    r_t = norm2(r(2:))
    disc = mu*r(1)
    defect = max(0.0_wp, -x(1)/length, -r(1)/force, abs(x(1)/length*(r(1)/force)))
    defect = max(defect, (r_t - disc)/max(force, disc))
    ! It sticks, or it slides on the cone against its slip: |x_t| r_t = -disc x_t.
    defect = max(defect, norm2(x_t*r(2:) + disc*x(2:))/(length*max(force, disc)))
  end function law_defect

  !> A problem of n points with random coupling; some tangential rows missing if wanted.
  subroutine random_problem(n, mu, missing, problem, x_free)
    integer, intent(in) :: n
    real(wp), intent(in) :: mu
    logical, intent(in) :: missing !! points 2, 5, .. lose t1, points 3, 6, .. t2, 4, 8, .. both
    type(contact_problem_t), intent(out) :: problem
    real(wp), allocatable, intent(out) :: x_free(:) !! (n_rows)
    real(wp), allocatable :: w(:, :), m(:, :)
    integer :: row(3, n), i, a, n_rows
    logical :: there(3)

    n_rows = 0
    row = 0
    do i = 1, n
      there = .true.
      if (missing) there(2) = mod(i, 3) /= 2 .and. mod(i, 4) /= 0
      if (missing) there(3) = mod(i, 3) /= 0 .and. mod(i, 4) /= 0
      do a = 1, 3
        if (.not. there(a)) cycle
        n_rows = n_rows + 1
        row(a, i) = n_rows
      end do
    end do
    allocate (m(n_rows, n_rows), x_free(n_rows))
    call random_number(m)
    m = m - 0.5_wp
    w = matmul(m, transpose(m))/n_rows
    do i = 1, n_rows
      w(i, i) = w(i, i) + 0.1_wp
    end do
    call make_problem(row, spread(mu, 1, n), w, problem)
    call random_number(x_free)
    x_free = x_free - 0.5_wp
    do i = 1, n
      x_free(row(1, i)) = x_free(row(1, i)) - 0.3_wp
    end do
  end subroutine random_problem

  !> Rigid blocks of mass and inertia 1 on one another and on the ground, touching at four corners
  !> each, with velocities of their own: W = H^T H of rank 6 a block among 12 rows.
  subroutine stack_of_blocks(n, mu, problem, x_free)
    integer, intent(in) :: n                        !! blocks
    real(wp), intent(in) :: mu
    type(contact_problem_t), intent(out) :: problem !! 4 n points
    real(wp), allocatable, intent(out) :: x_free(:) !! (12 n)
    real(wp), parameter :: corner(2, 4) = reshape([real(wp) :: 1, 1, 1, -1, -1, 1, -1, -1], [2, 4])
    real(wp), parameter :: axis(3, 3) = reshape([real(wp) :: 0, 0, 1, 1, 0, 0, 0, 1, 0], [3, 3])
    real(wp) :: h(6*n, 12*n), v(6*n), arm(3)
    real(wp), allocatable :: w(:, :)
    integer :: i, point, a, column

    h = 0.0_wp
    do i = 1, n
      v(6*i - 5:6*i) = [0.3_wp*sin(real(i, wp)), 0.2_wp*cos(real(i, wp)), -1.0_wp, &
        0.05_wp*sin(2.0_wp*i), 0.1_wp*cos(3.0_wp*i), 0.2_wp]
      do point = 1, 4
        do a = 1, 3
          column = 12*(i - 1) + 3*(point - 1) + a
          arm = [corner(:, point), -1.0_wp]
          h(6*i - 5:6*i, column) = [axis(:, a), cross(arm, axis(:, a))]
          if (i == 1) cycle
          arm(3) = 1.0_wp
          h(6*i - 11:6*i - 6, column) = -[axis(:, a), cross(arm, axis(:, a))]
        end do
      end do
    end do
    w = matmul(transpose(h), h)
    x_free = matmul(v, h)
    call make_problem(reshape([(i, i=1, 12*n)], [3, 4*n]), spread(mu, 1, 4*n), w, problem)
  end subroutine stack_of_blocks

  !> Nodes of an elastic body pressed on a floor and, the first two of them, on a wall: these have
  !> six rows, and three ways to move. What is near says nothing of that: it is that of the nodes.
  subroutine nodes_in_a_corner(n, mu, problem, x_free, node)
    integer, intent(in) :: n                        !! nodes, two or more
    real(wp), intent(in) :: mu(2)                   !! floor and wall [-]
    type(contact_problem_t), intent(out) :: problem !! n + 2 points; one row where mu is 0
    real(wp), allocatable, intent(out) :: x_free(:) !! (n_rows)
    integer, intent(out) :: node(n + 2)             !! of each point
    real(wp), parameter :: wall(3, 3) = reshape([real(wp) :: 0, -1, 0, 1, 0, 0, 0, 0, 1], [3, 3])
    real(wp), parameter :: floor(3, 3) = reshape([real(wp) :: 0, 0, 1, 1, 0, 0, 0, 1, 0], [3, 3])
    real(wp) :: a(3*n, 3*n), m(3*n, 3*n), of_point(3*n, 3*(n + 2)), frame(3, 3)
    real(wp), allocatable :: w(:, :)
    type(near_stiffness_t) :: near
    integer :: row(3, n + 2), i, k, n_rows

    call random_number(m)
    a = matmul(m - 0.5_wp, transpose(m - 0.5_wp))/n
    of_point = 0.0_wp
    node = [(i, i=1, n), 1, 2]
    row = 0
    n_rows = 0
    allocate (near%start(n + 3), near%other(n + 2), near%block(3, 3, n + 2))
    near%start = [(i, i=1, n + 3)]
    near%other = [(i, i=1, n + 2)]
    do i = 1, n + 2
      frame = merge(floor, wall, i <= n)
      do k = 1, merge(3, 1, mu(merge(1, 2, i <= n)) > 0.0_wp)
        n_rows = n_rows + 1
        row(k, i) = n_rows
        of_point(3*node(i) - 2:3*node(i), n_rows) = frame(:, k)
      end do
      near%block(:, :, i) = identity
    end do
    do i = 1, 3*n
      a(i, i) = a(i, i) + 1.0_wp
    end do
    w = matmul(transpose(of_point(:, :n_rows)), matmul(a, of_point(:, :n_rows)))
    call make_problem(row, [(mu(merge(1, 2, i <= n)), i=1, n + 2)], w, problem, near)
    call random_number(m(1, :))
    ! All go down and to the wall, and along both.
    x_free = matmul([(-[0.5_wp, -1.0_wp, 1.5_wp] - 0.2_wp*m(1, 3*i - 2:3*i), i=1, n)], &
      of_point(:, :n_rows))
  end subroutine nodes_in_a_corner

  pure function cross(a, b) result(c)
    real(wp), intent(in) :: a(3), b(3)
    real(wp) :: c(3)

    c = [a(2)*b(3) - a(3)*b(2), a(3)*b(1) - a(1)*b(3), a(1)*b(2) - a(2)*b(1)]
  end function cross

  !> The largest law_defect of the points of a problem.
  function problem_defect(problem, x_free, r) result(defect)
    type(contact_problem_t), intent(in) :: problem
    real(wp), intent(in) :: x_free(:), r(:, :)
    real(wp) :: defect, length, force
    real(wp), dimension(3, problem%n_points) :: x, whole
    integer :: i

    x = unpack_gaps(problem, relative_gaps(problem, x_free, pack_rows(problem, r)))
    whole = r
    call add_driven_friction(problem, x, whole)
    length = maxval(abs(x_free))
    force = max(maxval(abs(r)), length/maxval(problem%block))
    defect = 0.0_wp
    do i = 1, problem%n_points
      defect = max(defect, law_defect(problem%mu(i), x(:, i), whole(:, i), length, force))
    end do
  end function problem_defect

end module contact_samples
