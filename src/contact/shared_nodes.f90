!> Nodes that several contact pairs press: which of their points leave W singular, and what each of
!> them takes of the force.
!>
!> At the edge between a rough floor and a wall the floor's friction and the wall's normal reaction
!> act along one line. Coulomb's law leaves open how the two share a force there, and with it what
!> the pairs take in all. Of the shares that it allows, those nearest to the ones before are taken:
!> they do not depend on the solver, and converge as increments get smaller. docs/theory.md (4.22).
module shared_nodes_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: solve_small
  use compliance_mod, only: block_of, is_map
  use problem_mod, only: contact_problem_t
  use law_mod, only: project_on_cone
  implicit none
  private

  public :: shared_point_t, find_twins, share_nodes, nearest_shares, has_shared_nodes

  !> What Coulomb's law allows one of the points of a node: the whole cone where it sticks, one line
  !> where it slides or has no friction, nothing where it is open.
  type :: shared_point_t
    real(wp) :: mu = 0.0_wp               !! [-]
    real(wp) :: frame(3, 3) = 0.0_wp      !! columns n, t1, t2 [-]
    logical  :: moves(3) = .true.         !! directions that supports leave it
    logical  :: sticks = .false.          !! all of the cone is allowed
    real(wp) :: along(3) = 0.0_wp         !! else what is along this, n, t1, t2; 0: nothing [-]
  end type shared_point_t

contains

  !> Find twins: two points of a node, the normal motion of one a combination of the motions of the
  !> other. They may share a force along it in any way, so W is singular. docs/theory.md section 4.
  pure subroutine find_twins(problem, node)
    type(contact_problem_t), intent(inout) :: problem
    integer, intent(in) :: node(:)           !! (n_points) of each
    real(wp), parameter :: none = 1.0e-8_wp
    !! of the motion is independent: rounding leaves 5e-11 to 3e-10 before a master that deforms [-]
    real(wp) :: across(3, 3), of_other(3)
    integer, allocatable :: n_at(:)
    integer :: twin(size(node)), i, j
    logical :: regular

    if (is_map(problem%compliance)) return
    n_at = points_of(node)
    twin = 0
    do j = 1, size(node)
      if (n_at(node(j)) == 1) cycle
      do i = 1, size(node)
        if (i == j .or. node(i) /= node(j)) cycle
        across = block_of(problem%compliance, problem%row(:, j), problem%row(:, i))
        call solve_small(problem%block(:, :, j), across(:, 1), of_other, regular)
        if (.not. regular) cycle
        associate (w_nn => problem%block(1, 1, i))
          if (w_nn - dot_product(across(:, 1), of_other) <= none*w_nn) twin([i, j]) = [j, i]
        end associate
      end do
    end do
    if (any(twin > 0)) problem%twin = twin
  end subroutine find_twins

  !> Whether there is something to share: a node has several points, and friction presses one.
  pure logical function has_shared_nodes(problem, node, r)
    type(contact_problem_t), intent(in) :: problem
    integer, intent(in) :: node(:)  !! (n_points) of each; 0: what it faces gives way
    real(wp), intent(in) :: r(:, :) !! (3,n_points) reactions [force]
    integer :: k

    has_shared_nodes = .false.
    associate (n_at => points_of(node))
      do k = 1, size(node)
        if (node(k) > 0 .and. problem%mu(k) > 0.0_wp .and. r(1, k) > 0.0_wp) has_shared_nodes = &
          has_shared_nodes .or. n_at(node(k)) > 1
      end do
    end associate
  end function has_shared_nodes

  !> Share the force of each node among its points; the sum stays, and with it all displacements.
  pure subroutine share_nodes(problem, node, frame, x, before, allowed, r)
    type(contact_problem_t), intent(in) :: problem
    integer, intent(in) :: node(:)          !! (n_points) of each; 0: what it faces gives way
    real(wp), intent(in) :: frame(:, :, :)  !! (3,3,n_points) columns n, t1, t2 [-]
    real(wp), intent(in) :: x(:, :)         !! (3,n_points) gaps and slips of the solution [length]
    real(wp), intent(in) :: before(:, :)    !! (3,n_points) shares as the increment began [force]
    real(wp), intent(in) :: allowed         !! how far the solution is from the law [force]
    real(wp), intent(inout) :: r(:, :)      !! (3,n_points) its reactions n, t1, t2 [force]
    real(wp), allocatable :: shares(:, :)
    type(shared_point_t), allocatable :: point(:)
    integer, allocatable :: n_at(:), those(:)
    integer :: i, k
    logical :: found

    ! Where friction depends on the pressure, so would what each of them may have.
    if (allocated(problem%law)) return
    n_at = points_of(node)
    do i = 1, size(n_at)
      if (n_at(i) < 2) cycle
      those = pack([(k, k=1, size(node))], node == i)
      if (any(abs(problem%driven(:, those)) > 0.0_wp)) cycle
      point = [(shared_point(those(k)), k=1, size(those))]
      if (.not. any(point%sticks)) cycle
      shares = r(:, those)
      call nearest_shares(point, merge(before(:, those), 0.0_wp, problem%row(:, those) > 0), &
        allowed, shares, found)
      if (found) r(:, those) = shares
    end do

  contains

    pure type(shared_point_t) function shared_point(k) result(point)
      integer, intent(in) :: k
      real(wp) :: slip

      point%mu = problem%mu(k)
      point%frame = frame(:, :, k)
      point%moves = problem%row(:, k) > 0
      slip = norm2(x(2:, k))
      associate (rho => problem%rho_map(k))
        point%sticks = point%mu > 0.0_wp .and. any(point%moves(2:)) .and. r(1, k) > 0.0_wp .and. &
          rho*slip <= allowed
        if (r(1, k) <= 0.0_wp .and. rho*x(1, k) > allowed) return
      end associate
      point%along(1) = 1.0_wp
      if (point%mu > 0.0_wp .and. slip > 0.0_wp) point%along(2:) = -point%mu*x(2:, k)/slip
    end function shared_point

  end subroutine share_nodes

  !> How many points each node has.
  pure function points_of(node) result(n)
    integer, intent(in) :: node(:)
    integer :: n(maxval([0, node]))
    integer :: k

    n = 0
    do k = 1, size(node)
      if (node(k) > 0) n(node(k)) = n(node(k)) + 1
    end do
  end function points_of

  !> The shares of a node's points with the sum of those given that are nearest to the ones before,
  !> by Dykstra's alternating projections [BD86]: on what has the sum, and on what each point is
  !> allowed.
  pure subroutine nearest_shares(point, before, allowed, r, found)
    type(shared_point_t), intent(in) :: point(:) !! (m)
    real(wp), intent(in) :: before(:, :)         !! (3,m) 0 along what does not move [force]
    real(wp), intent(in) :: allowed              !! how far from the law they may be [force]
    real(wp), intent(inout) :: r(:, :)           !! (3,m) [force]
    logical, intent(out) :: found                !! else r has no meaning
    ! Where a share ends on the side of its cone they gain slowly: 1600 were seen, at the end of the
    ! edge of a block of C3D20 between a rough floor and a rough wall.
    integer, parameter :: most_projections = 10000
    real(wp), parameter :: sharp = 1.0e-3_wp !! part of what is allowed
    real(wp), dimension(3, size(point)) :: y, beyond, of_law
    real(wp) :: whole(3), of_sum(3, 3)
    integer :: i, j, k, status

    whole = sum_of(r)
    ! Regular, also where no point can move along some direction: nothing is missing there.
    of_sum = 0.0_wp
    do j = 1, 3
      of_sum(j, j) = epsilon(1.0_wp)
    end do
    do k = 1, size(point)
      do j = 1, 3
        if (point(k)%moves(j)) of_sum = of_sum + spread(point(k)%frame(:, j), 2, 3)* &
          spread(point(k)%frame(:, j), 1, 3)
      end do
    end do
    y = before
    beyond = 0.0_wp
    found = .false.
    do i = 1, most_projections
      call project_on_sum(y)
      do k = 1, size(point)
        associate (z => y(:, k) + beyond(:, k), along => point(k)%along)
          if (point(k)%sticks) then
            call project_on_cone(point(k)%mu, z, of_law(:, k), status)
          else
            of_law(:, k) = max(0.0_wp, dot_product(z, along))*along/max(1.0_wp, &
              dot_product(along, along))
          end if
          beyond(:, k) = z - of_law(:, k)
        end associate
      end do
      found = maxval(norm2(of_law - y, dim=1)) <= sharp*allowed
      if (found) exit
      y = of_law
    end do
    r = of_law ! on the cones to rounding

  contains

    pure subroutine project_on_sum(y)
      real(wp), intent(inout) :: y(:, :)
      real(wp) :: missing(3)
      logical :: regular
      integer :: l, repeated

      ! The second time takes out what the regularised matrix leaves of the first.
      do repeated = 1, 2
        call solve_small(of_sum, whole - sum_of(y), missing, regular)
        do l = 1, size(point)
          where (point(l)%moves) y(:, l) = y(:, l) + matmul(missing, point(l)%frame)
        end do
      end do
    end subroutine project_on_sum

    pure function sum_of(shares) result(total)
      real(wp), intent(in) :: shares(:, :)
      real(wp) :: total(3)
      integer :: l

      total = 0.0_wp
      do l = 1, size(point)
        total = total + matmul(point(l)%frame, shares(:, l))
      end do
    end function sum_of

  end subroutine nearest_shares

end module shared_nodes_mod
