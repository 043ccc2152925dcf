!> What the values of a quantity in runs of three sizes and more, of elements or of increments, say
!> of the error of the last one.
!>
!> docs/theory.md (10.9) to (10.15).
module follow_sizes_mod
  use kinds_mod, only: wp
  use mesh_sequence_mod, only: mesh_sequence_t, change, values_in
  use convergence_mod, only: convergence_t, observe_convergence, fitted_order, error_at_least, &
    error_by_differences, least_order, safety, about_twice
  implicit none
  private

  public :: follow_sizes

contains

  !> What three sizes and more, of elements or of increments, say of the error of the last one: of
  !> the finest as many as span twice its size, and three at least.
  pure subroutine follow_sizes(sequence, all_runs, all_sizes, highest_order, k, scale, observed, &
    n_rising)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: all_runs(:)   !! the coarsest first
    real(wp), intent(in) :: all_sizes(:) !! theirs [-]
    real(wp), intent(in) :: highest_order !! that an error in such sizes has [-]
    integer, intent(in) :: k       !! the quantity
    real(wp), intent(in) :: scale
    type(convergence_t), intent(out) :: observed
    integer, intent(out) :: n_rising !! as of sequence_error_t
    integer, parameter :: fitted_to = 4 !! sizes is an order, where there are so many
    real(wp), parameter :: most_fitted = 1.25_wp !! of such an order that is believed, of elements
    real(wp), parameter :: widest = 2.0_wp
    !! sizes over the last, beyond which coarser ones are forgotten: what they miss is of its own
    integer, allocatable :: runs(:)
    real(wp), allocatable :: h(:)
    real(wp) :: order, error
    integer :: i, j, n, first

    n = size(all_runs)
    first = max(1, n - 2)
    do while (first > 1 .and. all_sizes(first) < widest*all_sizes(n))
      first = first - 1
    end do
    runs = all_runs(first:)
    h = all_sizes(first:)
    n_rising = 0
    do i = 3, n
      observed = observe_convergence(all_sizes(i - 2:i), [change(sequence, k, scale, &
        all_runs(i - 2), all_runs(i - 1)), change(sequence, k, scale, all_runs(i - 1), &
        all_runs(i))], highest_order)
      n_rising = merge(0, n_rising + 1, observed%converges)
    end do
    n = size(runs)
    if (size(all_runs) >= fitted_to) then
      first = size(all_runs) - fitted_to + 1
      order = min(most_fitted, highest_order, fitted_order(all_sizes(first:), &
        all_values(all_runs(first:))))
      if (order > least_order) then
        error = error_by_differences(all_sizes(first:), [(change(sequence, k, scale, &
          all_runs(i), runs(n)), i=first, size(all_runs) - 1)], order)
        if (error < observed%error) observed = convergence_t(order, error, &
          h(n)**order/(h(n - 1)**order - h(n)**order))
        n_rising = 0
      end if
    end if
    ! One that seems to fall faster was met by accident.
    do i = 1, n - 1
      do j = i + 1, n
        observed%error = max(observed%error, error_at_least(h([i, j]), change(sequence, k, scale, &
          runs(i), runs(j)), h(n), highest_order))
      end do
    end do
    if (size(all_runs) >= fitted_to) observed%error = min(observed%error, by_distant_sizes())

  contains

    !> The same of four sizes and more, the first of which is about twice the last: what those
    !> differ by that are near each other is how far values scatter, and does not grow beyond that.
    pure real(wp) function by_distant_sizes() result(error)
      real(wp), allocatable :: sizes(:)
      integer, allocatable :: those(:)
      real(wp) :: order, times
      integer :: first, m, i, j

      error = huge(1.0_wp)
      m = size(all_runs)
      first = m - fitted_to + 1
      do while (first > 1 .and. all_sizes(first) < about_twice*all_sizes(m))
        first = first - 1
      end do
      if (all_sizes(first) < about_twice*all_sizes(m)) return
      sizes = all_sizes(first:)
      those = all_runs(first:)
      m = size(those)
      order = min(most_fitted, highest_order, fitted_order(sizes, all_values(those)))
      if (order <= least_order) return
      error = 0.0_wp
      do i = 1, m - 1
        do j = i + 1, m
          times = error_at_least(sizes([i, j]), 1.0_wp, sizes(m), highest_order)
          if (j == m) times = max(times, error_by_differences(sizes([i, j]), [1.0_wp], order))
          if (sizes(i) < about_twice*sizes(j)) times = min(times, safety)
          error = max(error, times*change(sequence, k, scale, those(i), those(j)))
        end do
      end do
    end function by_distant_sizes

    !> The quantity's values over the increments, a run a column.
    pure function all_values(runs) result(values)
      integer, intent(in) :: runs(:)
      real(wp) :: values(sequence%list(k)%n*sequence%n_increments, size(runs))
      integer :: i

      do i = 1, size(runs)
        values(:, i) = reshape(values_in(sequence, runs(i), k), [size(values, 1)])
      end do
    end function all_values

  end subroutine follow_sizes

end module follow_sizes_mod
