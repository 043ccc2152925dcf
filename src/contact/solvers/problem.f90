!> The condensed contact problem: x = W r + x_free with Coulomb's law at every point.
!>
!> A point has three rows (n, t1, t2), fewer where a direction cannot move or has no friction. Along
!> a tangent that cannot move there is friction all the same where it is driven: where supports
!> slide the point by a known slip. docs/theory.md sections 2 and 3.
module problem_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: largest_eigenvalue
  use controls_mod, only: solver_none
  use friction_laws_mod, only: friction_law_t, largest_friction, share_of_friction
  use increment_report_mod, only: ended_well, not_ended
  use near_stiffness_mod, only: near_stiffness_t, find_near
  use couplings_mod, only: couplings_t
  use compliance_mod, only: compliance_t, take_matrix, take_compliance, are_same, is_map, &
    product_with, rough_product, coupled_product, rough_rows, block_of, get_inverse, couplings_of, &
    add_rough_copy
  use law_mod, only: project_on_cone, project_on_disc, project_prediction, driven_friction
  implicit none
  private

  public :: contact_problem_t, contact_report_t, make_problem, is_made_of, pack_rows, &
    unpack_rows, unpack_gaps, add_driven_friction, relative_gaps, product_with_w, &
    rough_product_with_w, natural_map, copy_laws, force_scale, measure, project_reactions, mu_at

  !> What stays while the points keep their frames; r and x_free come as arguments, packed by rows.
  type :: contact_problem_t
    integer :: n_points = 0
    integer :: n_rows = 0
    logical :: is_proximal = .false. !! x_free holds a proximal term and says nothing of forces
    real(wp) :: began = 0.0_wp !! |r| of the points at the end of the increment before [force]
    integer,  allocatable :: row(:, :) !! (3,n_points) row of each component, 0 where there is none
    real(wp), allocatable :: mu(:)          !! (n_points) the largest [-]
    type(friction_law_t), allocatable :: law(:)
    !! (n_points) what the normal reaction makes of it; not allocated: nothing
    logical,  allocatable :: stays(:)
    !! (n_points) closed, in this increment: the normal reaction may pull
    real(wp), allocatable :: driven(:, :)
    !! (2,n_points) slip along t1, t2 where a tangent without a row is driven, else 0 [length]
    type(compliance_t) :: compliance        !! W, over the rows [length/force]
    real(wp), allocatable :: block(:, :, :)
    !! (3,3,n_points) W_ii; a missing row has its diagonal alone
    real(wp), allocatable :: rho(:)
    !! (n_points) 1/lambda_max(W_ii), scale of the bi-potential [force/length]
    real(wp), allocatable :: rho_n(:)       !! (n_points) 1/W_nn, of the normal part [force/length]
    real(wp), allocatable :: rho_t(:)
    !! (n_points) 1/lambda_max(W_tt), of the tangential part [force/length]
    real(wp), allocatable :: rho_map(:)
    !! (n_points) rows/trace(W_ii), of the natural map [force/length]
    real(wp), allocatable :: rho_global(:, :)
    !! (2,n_points) normal and tangential, of the global Newton [force/length]
    type(near_stiffness_t) :: near
    !! blocks of W^-1, about; what is not allocated in it is not known [force/length]
    type(couplings_t) :: couplings !! which points a sparse W couples
    integer, allocatable :: twin(:)
    !! (n_points) another point of the same node that moves alike, 0: none; allocated if any has one
  end type contact_problem_t

  !> What a contact solver says of its solution.
  type :: contact_report_t
    integer  :: solver = solver_none
    integer  :: iterations = 0        !! sweeps or Newton iterations
    integer  :: local_iterations = 0  !! summed over points and sweeps
    integer  :: products = 0          !! of W with a vector; a sweep counts as one
    real(wp) :: residual = 0.0_wp     !! scaled natural map [-]
    integer  :: worst_point = 0       !! where it is largest
    integer  :: ending = not_ended    !! or ended_well, ...
    integer  :: stages = 0            !! of AUTO: 1 when its first choice did it
    logical  :: wants_exact = .false. !! GMRES was not exact enough for Newton's method
    integer  :: improved_at = 0       !! iteration of the last real progress
    real(wp) :: lowest_residual = huge(1.0_wp) !! then [-]
  contains
    procedure :: converged
  end type contact_report_t

  !> From W as an array, or as a compliance.
  interface make_problem
    module procedure problem_of_matrix, problem_of_compliance
  end interface make_problem

contains

  !> Whether the solver got to what was asked of it.
  pure logical function converged(report)
    class(contact_report_t), intent(in) :: report

    converged = report%ending == ended_well
  end function converged

  !> Complete a problem from its rows and its compliance.
  subroutine problem_of_matrix(row, mu, w, problem, near)
    integer,  intent(in) :: row(:, :)   !! (3,n_points) as in the type; the first is never 0
    real(wp), intent(in) :: mu(:)       !! (n_points) [-]
    real(wp), allocatable, intent(inout) :: w(:, :)
    !! (n_rows,n_rows), moved into the problem [length/force]
    type(contact_problem_t), intent(out) :: problem
    type(near_stiffness_t), intent(in), optional :: near !! blocks of W^-1, where known
    type(compliance_t) :: compliance

    call take_matrix(w, compliance)
    call problem_of_compliance(row, mu, compliance, problem, near)
  end subroutine problem_of_matrix

  !> The same, the compliance moved into the problem. Of one that is a map the blocks have to be
  !> told, and what is near.
  subroutine problem_of_compliance(row, mu, compliance, problem, near, block)
    integer,  intent(in) :: row(:, :)   !! (3,n_points) as in the type; the first is never 0
    real(wp), intent(in) :: mu(:)       !! (n_points) [-]
    type(compliance_t), intent(inout) :: compliance
    type(contact_problem_t), intent(out) :: problem
    type(near_stiffness_t), intent(in), optional :: near !! blocks of W^-1, where known
    real(wp), intent(in), optional :: block(:, :, :)
    !! (3,3,n_points) what stands for W_ii where W is a map [length/force]
    integer :: i

    problem%n_points = size(mu)
    problem%n_rows = count(row > 0)
    problem%row = row
    problem%mu = mu
    allocate (problem%stays(size(mu)), source=.false.)
    allocate (problem%driven(2, size(mu)), source=0.0_wp)
    call take_compliance(compliance, problem%compliance)
    call add_rough_copy(problem%compliance)
    call set_blocks(problem, block)
    allocate (problem%rho_map(size(mu)))
    do i = 1, size(mu)
      associate (block => problem%block(:, :, i), has => row(:, i) > 0)
        problem%rho_map(i) = real(count(has), wp)/sum([block(1, 1), block(2, 2), block(3, 3)], &
          mask=has)
      end associate
    end do
    if (present(near)) then
      problem%near = near
      if (present(block)) call stand_alone(problem)
    else
      call couplings_of(problem%compliance, row, problem%couplings)
      call invert_near(problem)
    end if
    call scale_global_newton(problem)
  end subroutine problem_of_compliance

  !> Whether a problem is that of such rows and W already, as before flat obstacles wherever their
  !> points are placed: what follows from these need not be made again.
  pure logical function is_made_of(problem, row, mu, compliance)
    type(contact_problem_t), intent(in) :: problem
    integer,  intent(in) :: row(:, :)              !! as of make_problem
    real(wp), intent(in) :: mu(:)                  !! likewise [-]
    type(compliance_t), intent(in) :: compliance   !! likewise

    is_made_of = allocated(problem%row)
    if (is_made_of) is_made_of = problem%n_points == size(mu)
    if (is_made_of) is_made_of = all(problem%row == row) .and. .not. any(abs(problem%mu - mu) > &
      0.0_wp)
    if (is_made_of) is_made_of = are_same(problem%compliance, compliance)
  end function is_made_of

  !> Blocks of W on its diagonal, and the rho of the local solvers.
  pure subroutine set_blocks(problem, blocks)
    type(contact_problem_t), intent(inout) :: problem
    real(wp), intent(in), optional :: blocks(:, :, :) !! (3,3,n_points) what stands for them
    real(wp) :: tangential(3, 3), smallest
    integer :: i, a, n

    n = problem%n_points
    if (.not. allocated(problem%block)) then
      allocate (problem%block(3, 3, n), problem%rho(n), problem%rho_n(n), problem%rho_t(n))
    end if
    do i = 1, n
      associate (block => problem%block(:, :, i), row => problem%row(:, i))
        if (present(blocks)) then
          block = blocks(:, :, i)
          do a = 2, 3
            if (row(a) > 0) cycle
            block(a, :) = 0.0_wp
            block(:, a) = 0.0_wp
          end do
        else
          block = block_of(problem%compliance, row, row)
        end if
        ! A positive diagonal keeps the 3x3 systems regular and the missing reaction at 0; the
        ! smallest of the others does not enter the largest eigenvalues.
        smallest = minval([(block(a, a), a=1, 3)], mask=row > 0)
        do a = 2, 3
          if (row(a) == 0) block(a, a) = smallest
        end do
        problem%rho(i) = 1.0_wp/largest_eigenvalue(block)
        problem%rho_n(i) = 1.0_wp/block(1, 1)
        tangential = block
        tangential(1, :) = 0.0_wp
        tangential(:, 1) = 0.0_wp
        problem%rho_t(i) = 1.0_wp/largest_eigenvalue(tangential)
      end associate
    end do
  end subroutine set_blocks

  !> Rows of which nothing near is known, for their points hang on others, are as stiff as they are
  !> alone.
  pure subroutine stand_alone(problem)
    type(contact_problem_t), intent(inout) :: problem
    real(wp), parameter :: nothing = 1.0e-6_wp
    integer :: i, a

    do i = 1, problem%n_points
      associate (s => problem%near%block(:, :, problem%near%start(i)))
        do a = 1, 3
          if (problem%row(a, i) == 0) cycle
          if (s(a, a)*problem%block(a, a, i) < nothing) s(a, a) = 1.0_wp/problem%block(a, a, i)
        end do
      end associate
    end do
  end subroutine stand_alone

  !> Blocks of W^-1 from W; none where W is singular.
  subroutine invert_near(problem)
    type(contact_problem_t), intent(inout) :: problem
    real(wp), allocatable :: s(:, :)
    logical :: regular

    call get_inverse(problem%compliance, s, regular)
    if (regular) call find_near(problem%row, s, problem%near)
  end subroutine invert_near

  !> The two rho a point of the global Newton: sqrt(S_nn/W_nn) and sqrt(tr S_tt/tr W_tt), S = W^-1.
  !>
  !> Where S is not known, rows/trace(W_ii) for both. docs/theory.md (4.10).
  pure subroutine scale_global_newton(problem)
    type(contact_problem_t), intent(inout) :: problem
    real(wp) :: s_tt, w_tt
    integer :: i, a

    allocate (problem%rho_global(2, problem%n_points))
    problem%rho_global = spread(problem%rho_map, 1, 2)
    if (.not. allocated(problem%near%block)) return
    do i = 1, problem%n_points
      associate (row => problem%row(:, i), w => problem%block(:, :, i), &
                 s => problem%near%block(:, :, problem%near%start(i)))
        s_tt = 0.0_wp
        w_tt = 0.0_wp
        do a = 2, 3
          if (row(a) == 0) cycle
          s_tt = s_tt + s(a, a)
          w_tt = w_tt + w(a, a)
        end do
        if (s(1, 1) > 0.0_wp) problem%rho_global(1, i) = sqrt(s(1, 1)/w(1, 1))
        if (min(s_tt, w_tt) > 0.0_wp) problem%rho_global(2, i) = sqrt(s_tt/w_tt)
      end associate
    end do
  end subroutine scale_global_newton

  !> From three components a point to the rows there are.
  pure function pack_rows(problem, v) result(packed)
    type(contact_problem_t), intent(in) :: problem
    real(wp), intent(in) :: v(:, :)     !! (3,n_points)
    real(wp) :: packed(problem%n_rows)
    integer :: i, a

    do i = 1, problem%n_points
      do a = 1, 3
        if (problem%row(a, i) > 0) packed(problem%row(a, i)) = v(a, i)
      end do
    end do
  end function pack_rows

  !> From rows to three components a point, 0 where there is no row.
  pure function unpack_rows(problem, packed) result(v)
    type(contact_problem_t), intent(in) :: problem
    real(wp), intent(in) :: packed(:)   !! (n_rows)
    real(wp) :: v(3, problem%n_points)
    integer :: i, a

    v = 0.0_wp
    do i = 1, problem%n_points
      do a = 1, 3
        if (problem%row(a, i) > 0) v(a, i) = packed(problem%row(a, i))
      end do
    end do
  end function unpack_rows

  !> Gaps and slips: from rows, and what drives the tangents that have none.
  pure function unpack_gaps(problem, packed) result(x)
    type(contact_problem_t), intent(in) :: problem
    real(wp), intent(in) :: packed(:)      !! (n_rows) [length]
    real(wp) :: x(3, problem%n_points)     !! [length]

    x = unpack_rows(problem, packed)
    x(2:, :) = x(2:, :) + problem%driven
  end function unpack_gaps

  !> The coefficient that belongs to a normal reaction. docs/theory.md (3.13).
  pure real(wp) function mu_at(problem, i, r_n) result(mu)
    type(contact_problem_t), intent(in) :: problem
    integer, intent(in) :: i        !! point
    real(wp), intent(in) :: r_n     !! normal reaction [force]
    real(wp) :: share, change

    mu = problem%mu(i)
    if (.not. allocated(problem%law)) return
    call share_of_friction(problem%law(i), r_n, share, change)
    mu = share*mu
  end function mu_at

  !> Friction along driven tangents, which follows from the normal reaction and the slip. It has no
  !> part in W r. docs/theory.md (3.8).
  pure subroutine add_driven_friction(problem, x, r)
    type(contact_problem_t), intent(in) :: problem
    real(wp), intent(in) :: x(:, :)        !! (3,n_points) gaps and slips [length]
    real(wp), intent(inout) :: r(:, :)     !! (3,n_points) gets those components [force]
    integer :: i, a

    do i = 1, problem%n_points
      do a = 1, 2
        if (abs(problem%driven(a, i)) > 0.0_wp) r(1 + a, i) = driven_friction(mu_at(problem, i, &
          r(1, i)), r(1, i), x(2:, i), a)
      end do
    end do
  end subroutine add_driven_friction

  !> x = W r + x_free. [JFT07] eq. (11), docs/theory.md (2.1).
  function relative_gaps(problem, x_free, r) result(x)
    type(contact_problem_t), intent(in) :: problem
    real(wp), intent(in) :: x_free(:), r(:) !! (n_rows) [length], [force]
    real(wp) :: x(problem%n_rows)           !! [length]

    x = x_free + product_with_w(problem, r)
  end function relative_gaps

  !> W v, from its blocks alone where it is sparse.
  function product_with_w(problem, v) result(w_v)
    type(contact_problem_t), intent(in) :: problem
    real(wp), contiguous, intent(in) :: v(:) !! (n_rows) [force]
    real(wp) :: w_v(problem%n_rows)     !! [length]
    integer :: i, a

    if (.not. allocated(problem%couplings%other)) then
      w_v = product_with(problem%compliance, v)
      return
    end if
    do i = 1, problem%n_points
      do a = 1, 3
        associate (row => problem%row(a, i))
          if (row > 0) w_v(row) = coupled_product(problem%compliance, problem%couplings, &
            problem%row, i, row, v)
        end associate
      end do
    end do
  end function product_with_w

  !> W v to the digits of single precision where W is large: for directions, not for residuals.
  function rough_product_with_w(problem, v) result(w_v)
    type(contact_problem_t), intent(in) :: problem
    real(wp), contiguous, intent(in) :: v(:) !! (n_rows) [force]
    real(wp) :: w_v(problem%n_rows)     !! [length]

    if (rough_rows(problem%compliance) > 0 .or. is_map(problem%compliance)) then
      w_v = rough_product(problem%compliance, v)
    else
      w_v = product_with_w(problem, v)
    end if
  end function rough_product_with_w

  !> Z_i = r_i - P_K(r_i - rho_i x*_i) of every point, rho_i = rows/trace(W_ii): zero exactly at the
  !> solution.
  !>
  !> Source: [JFT07] eq. (9), docs/theory.md (5.1).
  pure subroutine natural_map(problem, x, r, z, status)
    type(contact_problem_t), intent(in) :: problem
    real(wp), intent(in)  :: x(:, :)   !! (3,n_points) [length]
    real(wp), intent(in)  :: r(:, :)   !! (3,n_points) [force]
    real(wp), intent(out) :: z(:, :)   !! (3,n_points) [force]
    integer,  intent(out) :: status(:) !! (n_points) branch of each projection
    real(wp) :: p(3)
    integer :: i

    do i = 1, problem%n_points
      call project_prediction(mu_at(problem, i, r(1, i)), problem%stays(i), problem%rho_map(i), &
        r(:, i), x(:, i), p, status(i))
      z(:, i) = r(:, i) - p
    end do
  end subroutine natural_map

  !> Reactions projected on their cones; where points stay closed those that pull lose friction.
  pure function project_reactions(problem, r) result(p)
    type(contact_problem_t), intent(in) :: problem
    real(wp), intent(in) :: r(:, :)          !! (3,n_points) [force]
    real(wp) :: p(3, problem%n_points)       !! [force]
    real(wp) :: tangential(2), radius, slope
    integer :: i, status
    logical :: inside

    do i = 1, problem%n_points
      call project_on_cone(mu_at(problem, i, r(1, i)), r(:, i), p(:, i), status)
      if (allocated(problem%law)) then
        call largest_friction(problem%mu(i), problem%law, i, p(1, i), radius, slope)
        call project_on_disc(radius, p(2:, i), tangential, inside)
        p(2:, i) = tangential
      end if
      if (problem%stays(i) .and. r(1, i) < 0.0_wp) p(:, i) = [r(1, i), 0.0_wp, 0.0_wp]
    end do
  end function project_reactions

  !> The laws of some points of a problem, as those of another.
  pure subroutine copy_laws(problem, those, some)
    type(contact_problem_t), intent(in) :: problem
    integer, intent(in) :: those(:)              !! (n_points of `some`) points of `problem`
    type(contact_problem_t), intent(inout) :: some !! of make_problem

    some%stays = problem%stays(those)
    some%driven = problem%driven(:, those)
    if (allocated(problem%law)) some%law = problem%law(those)
    some%is_proximal = problem%is_proximal
    some%began = problem%began
  end subroutine copy_laws

  !> The force that residuals are measured by: the largest of |r|, |r at the start|, |r| of the
  !> increment before and |P_K(-rho x*_free)|, the last not where x_free holds a proximal term.
  pure function force_scale(problem, x_free, r, r_start) result(scale)
    type(contact_problem_t), intent(in) :: problem
    real(wp), intent(in) :: x_free(:, :)          !! (3,n_points) [length]
    real(wp), intent(in) :: r(:, :), r_start(:, :) !! (3,n_points) [force]
    real(wp) :: scale                             !! [force]
    real(wp), parameter :: no_force(3) = 0.0_wp
    real(wp) :: p(3), z(3, problem%n_points)
    integer :: i, status

    scale = max(norm2(r), norm2(r_start), problem%began)
    if (problem%is_proximal) return
    do i = 1, problem%n_points
      call project_prediction(mu_at(problem, i, 0.0_wp), problem%stays(i), problem%rho_map(i), &
        no_force, x_free(:, i), p, status)
      z(:, i) = p
    end do
    scale = max(scale, norm2(z))
  end function force_scale

  !> The scaled residual of docs/theory.md (5.2) and the point where it is largest, into the report.
  subroutine measure(problem, x_free, x, r, r_start, report)
    type(contact_problem_t), intent(in) :: problem
    real(wp), intent(in) :: x_free(:)      !! (n_rows) [length]
    real(wp), intent(in) :: x(:), r(:)     !! (n_rows) x = W r + x_free [length], [force]
    real(wp), intent(in) :: r_start(:, :)  !! (3,n_points) that the solver began with [force]
    type(contact_report_t), intent(inout) :: report
    real(wp), dimension(3, problem%n_points) :: r_points, x_points, z
    integer :: status(problem%n_points)
    real(wp) :: scale

    r_points = unpack_rows(problem, r)
    x_points = unpack_gaps(problem, x)
    call add_driven_friction(problem, x_points, r_points)
    call natural_map(problem, x_points, r_points, z, status)
    scale = force_scale(problem, unpack_rows(problem, x_free), r_points, r_start)
    call subtract_rounding(problem, unpack_rows(problem, x_free), r_points, z)
    report%residual = norm2(z)
    if (scale > 0.0_wp) then
      report%residual = report%residual/scale
    else if (report%residual > 0.0_wp) then
      report%residual = 1.0_wp ! forces are needed and there are none
    end if
    report%worst_point = 0
    if (problem%n_points > 0) report%worst_point = maxloc(sum(z**2, dim=1), dim=1)
  end subroutine measure

  !> Take off what rounding makes of Z where friction is large: a point that sticks has x_t = 0 to
  !> the rounding of W r + x_free, which Z multiplies by mu. docs/theory.md (5.3).
  pure subroutine subtract_rounding(problem, x_free, r, z)
    type(contact_problem_t), intent(in) :: problem
    real(wp), intent(in) :: x_free(:, :)     !! (3,n_points) [length]
    real(wp), intent(in) :: r(:, :)          !! (3,n_points) [force]
    real(wp), intent(inout) :: z(:, :)       !! (3,n_points) [force]
    real(wp) :: rounding, size_z, largest, mu
    integer :: i

    largest = 0.0_wp
    if (problem%n_points > 0) largest = maxval(norm2(r, dim=1))
    do i = 1, problem%n_points
      mu = mu_at(problem, i, r(1, i))
      if (mu <= 1.0_wp) cycle
      rounding = problem%n_rows*epsilon(1.0_wp)*(mu - 1.0_wp)* &
        (problem%rho_map(i)*norm2(x_free(:, i)) + largest)
      size_z = norm2(z(:, i))
      if (size_z > rounding) z(:, i) = (1.0_wp - rounding/size_z)*z(:, i)
      if (size_z <= rounding) z(:, i) = 0.0_wp
    end do
  end subroutine subtract_rounding

end module problem_mod
