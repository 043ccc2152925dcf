!> From an FCLIB problem to the condensed one that the solvers take.
!>
!> A local problem has its W; a global one gets W = H^T M^-1 H and q = w + H^T M^-1 f from one
!> sparse factorisation of M, whose solution also gives v back.
module condense_problem_mod
  use kinds_mod, only: wp, i8
  use errors_mod, only: error_t, raise, exit_wrong_input, exit_not_solved, exit_machine
  use text_mod, only: to_text
  use lists_mod, only: lists_t, lists_by_key
  use system_mod, only: wall_seconds
  use resource_limits_mod, only: has_memory, memory_left
  use assembly_mod, only: triplets_t
  use dof_map_mod, only: map_of_matrix
  use ordering_mod, only: order_equations
  use sparse_factor_mod, only: sparse_factor_t, factorise
  use compliance_mod, only: get_matrix
  use problem_mod, only: contact_problem_t, make_problem
  use fclib_mod, only: fclib_problem_t
  use fclib_matrix_mod, only: sparse_matrix_t, times, transposed_times, is_usable
  implicit none
  private

  public :: condensed_t, condense_problem, motion_of, rank_of, imbalance_of

  real(wp), parameter :: asymmetric = 1.0e-6_wp    !! M beyond this is refused [-]
  real(wp), parameter :: negligible = 1.0e-20_wp   !! of W's largest entry: not a diagonal [-]
  real(wp), parameter :: smallest_w = 1.0e-40_wp   !! of W's largest entry
  integer,  parameter :: block_size = 64           !! right-hand sides at once

  !> A problem and what leads to it.
  type :: condensed_t
    type(contact_problem_t) :: problem           !! with the symmetric part of W
    real(wp), allocatable :: q(:)                !! (3 n_points) u without reactions [length]
    real(wp) :: asymmetry = 0.0_wp               !! largest of W - W^T over largest of W [-]
    type(sparse_factor_t) :: factor              !! of M, global only
    real(wp) :: seconds = 0.0_wp                 !! for the solvers' scales, W^-1 among them
    real(wp) :: processor_seconds = 0.0_wp       !! the same by the processor
  end type condensed_t

  interface
    !> LAPACK: Cholesky factor with pivoting of a positive semi-definite matrix.
    subroutine dpstrf(uplo, n, a, lda, piv, rank, tol, work, info)
      import :: wp
      implicit none
      character, intent(in) :: uplo
      integer, intent(in) :: n, lda
      real(wp), intent(inout) :: a(lda, *)
      integer, intent(out) :: piv(*), rank, info
      real(wp), intent(in) :: tol
      real(wp), intent(out) :: work(*)
    end subroutine dpstrf
  end interface

contains

  !> Make the condensed problem.
  subroutine condense_problem(path, given, condensed, error)
    character(*), intent(in) :: path               !! for messages
    type(fclib_problem_t), intent(in) :: given
    type(condensed_t), intent(inout) :: condensed
    type(error_t), allocatable, intent(out) :: error !! M or W cannot be used, no memory
    real(wp), allocatable :: w(:, :)
    real(wp) :: processor
    integer :: n, i

    n = 3*given%n_points
    if (.not. given%is_global) then
      call check_diagonal(path, diagonal_of(given%w), given%mu, given%q, error)
    end if
    if (.not. allocated(error)) call check_memory(path, n, error)
    if (allocated(error)) return
    allocate (w(n, n), source=0.0_wp)
    if (given%is_global) then
      call factorise_m(path, given%m, condensed%factor, error)
      if (.not. allocated(error)) call condense_global(given, condensed, w, error)
    else
      call fill(given%w, w)
      condensed%q = given%q
    end if
    if (.not. allocated(error)) call check_usable(path, w, condensed%q, error)
    if (allocated(error)) return
    if (given%is_global) then
      call check_diagonal(path, [(w(i, i), i=1, n)], given%mu, condensed%q, error)
      if (allocated(error)) return
    end if
    call symmetrise(w, condensed%asymmetry)
    call cpu_time(processor)
    condensed%seconds = wall_seconds()
    call make_rows(path, given, w, condensed%q, condensed%problem, error)
    condensed%seconds = wall_seconds() - condensed%seconds
    call cpu_time(condensed%processor_seconds)
    condensed%processor_seconds = condensed%processor_seconds - processor
  end subroutine condense_problem

  !> v = M^-1 (H r + f) of a global problem, and u = H^T v + w from it.
  subroutine motion_of(given, condensed, r, v, u, error)
    type(fclib_problem_t), intent(in) :: given
    type(condensed_t), intent(inout) :: condensed
    real(wp), intent(in) :: r(:)                  !! (3 n_points) [force]
    real(wp), allocatable, intent(out) :: v(:)    !! (n) [length]
    real(wp), intent(out) :: u(:)                 !! (3 n_points) [length]
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: b(given%m%m, 1)

    b(:, 1) = times(given%h, r) + given%f
    call condensed%factor%solve(b, error)
    v = b(:, 1)
    u = transposed_times(given%h, v) + given%q
  end subroutine motion_of

  !> |M v - H r - f| over the largest of |H r| and |f|, largest entries.
  function imbalance_of(given, r, v) result(relative)
    type(fclib_problem_t), intent(in) :: given
    real(wp), intent(in) :: r(:), v(:)
    real(wp) :: relative, hr(given%m%m), scale
    type(triplets_t) :: lower
    integer :: k

    call lower_triangle(given%m, lower)
    hr = times(given%h, r)
    scale = max(maxval(abs(hr)), maxval(abs(given%f)))
    hr = -hr - given%f
    do k = 1, size(lower%value)
      associate (i => lower%row(k), j => lower%column(k), value => lower%value(k))
        hr(i) = hr(i) + value*v(j)
        if (i /= j) hr(j) = hr(j) + value*v(i)
      end associate
    end do
    relative = maxval(abs(hr))
    if (scale > 0.0_wp) relative = relative/scale
  end function imbalance_of

  !> The rank of W by a pivoted Cholesky factorisation.
  integer function rank_of(problem) result(rank)
    type(contact_problem_t), intent(in) :: problem
    real(wp), allocatable :: a(:, :), work(:)
    integer :: pivot(problem%n_rows), info, i
    real(wp) :: largest

    allocate (a(problem%n_rows, problem%n_rows), work(2*problem%n_rows))
    call get_matrix(problem%compliance, a)
    largest = maxval([(a(i, i), i=1, problem%n_rows)])
    call dpstrf('L', problem%n_rows, a, problem%n_rows, pivot, rank, 1.0e-10_wp*largest, work, info)
  end function rank_of

  ! ------------------------------------------------------------------ global problems

  !> One triangle of a symmetric matrix that is given by one triangle or by both.
  subroutine lower_triangle(m, lower)
    type(sparse_matrix_t), intent(in) :: m
    type(triplets_t), intent(out) :: lower
    logical :: one_triangle

    one_triangle = .not. (any(m%row > m%column .and. abs(m%value) > 0.0_wp) .and. &
      any(m%row < m%column .and. abs(m%value) > 0.0_wp))
    lower%n = m%m
    lower%row = max(m%row, m%column)
    lower%column = min(m%row, m%column)
    lower%value = m%value
    ! Of both triangles each gives its half: what they sum to is the symmetric part.
    if (.not. one_triangle) where (m%row /= m%column) lower%value = 0.5_wp*lower%value
  end subroutine lower_triangle

  !> Factorise M, in METIS's order.
  subroutine factorise_m(path, m, factor, error)
    character(*), intent(in) :: path
    type(sparse_matrix_t), intent(in) :: m
    type(sparse_factor_t), intent(inout) :: factor
    type(error_t), allocatable, intent(out) :: error
    type(triplets_t) :: lower
    integer, allocatable :: position(:)
    real(wp), allocatable :: schur(:, :)
    real(wp) :: probe(m%m), difference
    integer :: i
    integer, allocatable :: start(:), neighbours(:)

    call lower_triangle(m, lower)
    if (any(m%row > m%column .and. abs(m%value) > 0.0_wp) .and. &
        any(m%row < m%column .and. abs(m%value) > 0.0_wp)) then
      probe = [(sin(real(i, wp)), i=1, m%m)]
      difference = norm2(times(m, probe) - transposed_times(m, probe))
      if (difference > asymmetric*norm2(times(m, probe))) then
        call raise(error, exit_wrong_input, path//': error: the matrix M is not symmetric')
        return
      end if
    end if
    call list_neighbours(lower, start, neighbours)
    call order_equations(map_of_matrix(lower%n), start, neighbours, position, error)
    if (allocated(error)) return
    call factorise(lower, position, 0, factor, schur, error)
    if (.not. allocated(error)) return
    if (error%exit_status == exit_not_solved) call raise(error, exit_wrong_input, &
      path//': error: the matrix M is not positive definite')
  end subroutine factorise_m

  !> The neighbours of each equation, each once: METIS takes no edge twice.
  subroutine list_neighbours(lower, start, neighbours)
    type(triplets_t), intent(in) :: lower
    integer, allocatable, intent(out) :: start(:), neighbours(:)
    integer :: ends(2, size(lower%value)), other(2*size(lower%value))
    type(lists_t) :: entries !! of each equation, in `other`
    integer, allocatable :: seen(:)
    integer :: i, k, n, pass

    ends(1, :) = lower%row(:size(lower%value))
    ends(2, :) = lower%column(:size(lower%value))
    entries = lists_by_key([ends], lower%n)
    other = [ends(2:1:-1, :)]
    ! Each once: counted, and put down.
    allocate (start(lower%n + 1), seen(lower%n))
    do pass = 1, 2
      seen = 0
      n = 0
      do i = 1, lower%n
        start(i) = n + 1
        do k = entries%first(i), entries%first(i + 1) - 1
          associate (found => other(entries%item(k)))
            if (seen(found) == i .or. found == i) cycle
            seen(found) = i
            n = n + 1
            if (pass == 2) neighbours(n) = found
          end associate
        end do
      end do
      start(lower%n + 1) = n + 1
      if (pass == 1) allocate (neighbours(n))
    end do
  end subroutine list_neighbours

  !> W = H^T M^-1 H, a block of columns at a time, and q = w + H^T M^-1 f.
  subroutine condense_global(given, condensed, w, error)
    type(fclib_problem_t), intent(in) :: given
    type(condensed_t), intent(inout) :: condensed
    real(wp), intent(inout) :: w(:, :)
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: b(:, :)
    type(lists_t) :: entries !! of each column
    integer :: first, last, column, k

    entries = lists_by_key(given%h%column, given%h%n)
    do first = 1, size(w, 2), block_size
      last = min(first + block_size - 1, size(w, 2))
      if (allocated(b)) deallocate (b)
      allocate (b(given%m%m, first:last), source=0.0_wp)
      do column = first, last
        do k = entries%first(column), entries%first(column + 1) - 1
          associate (entry => entries%item(k))
            b(given%h%row(entry), column) = b(given%h%row(entry), column) + given%h%value(entry)
          end associate
        end do
      end do
      call condensed%factor%solve(b, error)
      if (allocated(error)) return
      do column = first, last
        w(:, column) = transposed_times(given%h, b(:, column))
      end do
    end do
    b = reshape(given%f, [size(given%f), 1])
    call condensed%factor%solve(b, error)
    if (allocated(error)) return
    condensed%q = given%q + transposed_times(given%h, b(:, 1))
  end subroutine condense_global

  ! ------------------------------------------------------------------ W

  subroutine fill(a, w)
    type(sparse_matrix_t), intent(in) :: a
    real(wp), intent(inout) :: w(:, :) !! 0 on entry
    integer :: k

    do k = 1, size(a%value)
      w(a%row(k), a%column(k)) = w(a%row(k), a%column(k)) + a%value(k)
    end do
  end subroutine fill

  pure function diagonal_of(a) result(diagonal)
    type(sparse_matrix_t), intent(in) :: a
    real(wp) :: diagonal(a%n)
    integer :: k

    diagonal = 0.0_wp
    do k = 1, size(a%value)
      if (a%row(k) == a%column(k)) diagonal(a%row(k)) = diagonal(a%row(k)) + a%value(k)
    end do
  end function diagonal_of

  !> Every point needs a normal compliance, and a tangential one unless nothing happens there.
  subroutine check_diagonal(path, diagonal, mu, q, error)
    character(*), intent(in) :: path
    real(wp), intent(in) :: diagonal(:)   !! (3 n_points) of W [length/force]
    real(wp), intent(in) :: mu(:)         !! (n_points)
    real(wp), intent(in) :: q(:)          !! (3 n_points)
    type(error_t), allocatable, intent(inout) :: error
    character(2), parameter :: direction(3) = ['n ', 't1', 't2']
    real(wp) :: largest
    integer :: k, point, a

    largest = maxval(diagonal)
    do k = 1, size(diagonal)
      if (diagonal(k) > negligible*largest) cycle
      point = (k + 2)/3
      a = k - 3*(point - 1)
      if (a > 1 .and. mu(point) <= 0.0_wp) cycle
      if (a > 1 .and. max(abs(diagonal(k)), abs(q(k))) <= 0.0_wp) cycle
      call raise(error, exit_wrong_input, path//': error: point '//to_text(point)// &
        ': the diagonal of W along '//trim(direction(a))//' is '//to_text(diagonal(k), 3)// &
        ', so that no reaction can move the point')
      return
    end do
  end subroutine check_diagonal

  !> Too large for this machine is said before it is tried: W, its inverse, and what works on them.
  subroutine check_memory(path, n, error)
    character(*), intent(in) :: path
    integer, intent(in) :: n !! rows
    type(error_t), allocatable, intent(out) :: error
    integer(i8) :: needed, available

    needed = 3_i8*8_i8*int(n, i8)**2
    available = memory_left()
    if (has_memory(needed)) return
    call raise(error, exit_machine, path//': error: '//to_text(n)//' rows need '// &
      to_text(real(needed, wp)*1.0e-9_wp, 2)//' GB of memory, and '// &
      to_text(real(available, wp)*1.0e-9_wp, 2)//' GB are free')
  end subroutine check_memory

  subroutine check_usable(path, w, q, error)
    character(*), intent(in) :: path
    real(wp), intent(in) :: w(:, :), q(:)
    type(error_t), allocatable, intent(out) :: error

    if (.not. (all(is_usable(w)) .and. all(is_usable(q)))) then
      call raise(error, exit_wrong_input, path//': error: W or q has numbers beyond 1e40')
    else if (maxval(abs(w)) < smallest_w) then
      call raise(error, exit_wrong_input, path//': error: the entries of W are 0, or below 1e-40')
    end if
  end subroutine check_usable

  !> Replace W by its symmetric part.
  subroutine symmetrise(w, asymmetry)
    real(wp), intent(inout) :: w(:, :)
    real(wp), intent(out) :: asymmetry !! largest of W - W^T over largest of W [-]
    integer :: i, j
    real(wp) :: largest

    asymmetry = 0.0_wp
    largest = maxval(abs(w))
    do j = 1, size(w, 2)
      do i = j + 1, size(w, 1)
        asymmetry = max(asymmetry, abs(w(i, j) - w(j, i)))
        w(i, j) = 0.5_wp*(w(i, j) + w(j, i))
        w(j, i) = w(i, j)
      end do
    end do
    asymmetry = asymmetry/largest
  end subroutine symmetrise

  !> The rows there are: without friction the normal alone; no tangent that cannot move.
  subroutine make_rows(path, given, w, q, problem, error)
    character(*), intent(in) :: path
    type(fclib_problem_t), intent(in) :: given
    real(wp), allocatable, intent(inout) :: w(:, :)  !! moved, or copied in part
    real(wp), intent(in) :: q(:)
    type(contact_problem_t), intent(out) :: problem
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: part(:, :)
    integer, allocatable :: kept(:)
    integer :: row(3, given%n_points), i, a, k

    row = 0
    allocate (kept(0))
    do i = 1, given%n_points
      do a = 1, 3
        k = 3*(i - 1) + a
        if (a > 1 .and. given%mu(i) <= 0.0_wp) exit
        if (.not. w(k, k) > 0.0_wp) then
          if (all(abs(w(:, k)) <= 0.0_wp) .and. abs(q(k)) <= 0.0_wp) cycle
          call raise(error, exit_wrong_input, path//': error: point '//to_text(i)// &
            ': W has no positive diagonal, but other entries or q')
          return
        end if
        row(a, i) = 1
      end do
    end do
    kept = pack([(k, k=1, size(row))], reshape(row > 0, [size(row)]))
    row = unpack([(k, k=1, size(kept))], row > 0, 0)
    if (size(kept) == size(w, 1)) then
      call make_problem(row, given%mu, w, problem)
    else
      part = w(kept, kept)
      deallocate (w)
      call make_problem(row, given%mu, part, problem)
    end if
  end subroutine make_rows

end module condense_problem_mod
