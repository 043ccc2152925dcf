!> A run on an FCLIB problem: read, condense, solve, certify, write.
module solve_problem_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t, raise, exit_not_solved
  use text_mod, only: as_list, string_t, to_text
  use system_mod, only: wall_seconds
  use controls_mod, only: contact_controls_t, solver_none
  use increment_report_mod, only: certificate_t, worst_entry, not_ended, ended_well, &
    ended_at_limit, ended_diverging
  use certify_problem_mod, only: certify_problem
  use problem_mod, only: contact_report_t, pack_rows, measure, relative_gaps, unpack_rows
  use solve_mod, only: solve_contact
  use fclib_mod, only: fclib_problem_t, fclib_solution_t, read_fclib, write_fclib_solution
  use fclib_matrix_mod, only: times
  use fresh_file_mod, only: beginning_of
  use output_names_mod, only: keep_inputs, output_name
  use condense_problem_mod, only: condensed_t, condense_problem, motion_of, rank_of, imbalance_of
  use command_line_mod, only: options_t
  use refuse_unsolved_mod, only: tolerance_in_reach
  use console_mod, only: console_t, open_console, say, print_lines, seconds_in_words, &
    solver_name
  use version_mod, only: version
  implicit none
  private

  public :: run_problem

  integer,  parameter :: max_corrections = 30        !! for a W that is not symmetric
  integer,  parameter :: largest_ranked = 3000       !! rows up to which the rank is worth its time
  real(wp), parameter :: rounding = 1.0e-12_wp       !! asymmetry of W below this is none [-]

contains

  !> Solve the problem in a file.
  subroutine run_problem(options, error)
    type(options_t), intent(in) :: options
    type(error_t), allocatable, intent(out) :: error !! wrong file, not solved, machine failed
    type(console_t) :: console
    type(fclib_problem_t) :: given
    type(condensed_t) :: condensed
    type(contact_report_t) :: report
    type(fclib_solution_t) :: solution
    type(certificate_t) :: certificate
    type(string_t) :: labels(2), lines(2)
    character(:), allocatable :: path
    real(wp) :: seconds, processor, processor_now !! of the solver, with what it prepares [s]

    console = open_console(options%quiet, options%verbose)
    path = output_name(options%output, solution_path(options%deck), '.hdf5')
    call keep_problem(options%deck, path, error)
    if (allocated(error)) return
    call read_fclib(options%deck, given, error)
    if (allocated(error)) return
    call condense_problem(options%deck, given, condensed, error)
    if (allocated(error)) return
    call print_lines(console, describe(options%deck, given, condensed))

    call cpu_time(processor)
    seconds = wall_seconds()
    call solve(given, condensed, options%controls, solution, report)
    seconds = wall_seconds() - seconds + condensed%seconds
    call cpu_time(processor_now)
    processor = processor_now - processor + condensed%processor_seconds
    call certify(given, condensed, options%controls, solution, certificate, error)
    if (allocated(error)) return
    call add_facts(options%controls, report, certificate, condensed%asymmetry, &
      [seconds, processor], solution)
    lines(1)%text = solver_in_words(report)//': '//to_text(report%iterations)//' iterations, '// &
      to_text(report%local_iterations)//' local iterations, '//to_text(report%products)// &
      ' products, residual '//to_text(report%residual, 3)//', '//seconds_in_words(seconds)
    lines(2)%text = 'penetration '//to_text(certificate%penetration, 2)//', adhesion '// &
      to_text(certificate%adhesion, 2)//', complementarity '// &
      to_text(certificate%complementarity, 2)//', cone '//to_text(certificate%cone, 2)// &
      ', law '//to_text(certificate%law, 2)
    if (given%is_global) lines(2)%text = lines(2)%text//', equilibrium '// &
      to_text(certificate%equilibrium, 2)
    call print_lines(console, lines)
    labels(1)%text = file_name(options%deck)
    labels(2)%text = 'bipot '//version//': the problem of '//file_name(options%deck)//', solved'
    call write_fclib_solution(path, given, labels, solution, options%overwrite, error)
    if (allocated(error)) return
    call close_run(options, report, certificate, path, error)
  end subroutine run_problem

  !> Refuse to write the solution in the place of the problem.
  subroutine keep_problem(problem, solution, error)
    character(*), intent(in) :: problem, solution !! paths
    type(error_t), allocatable, intent(out) :: error
    type(string_t) :: input(1), outputs(2)

    input(1)%text = problem
    outputs(1)%text = solution
    outputs(2)%text = beginning_of(solution)
    call keep_inputs(input, outputs, error)
  end subroutine keep_problem

  !> PROBLEM.hdf5 -> PROBLEM.solution.hdf5, in the working directory.
  pure function solution_path(problem) result(path)
    character(*), intent(in) :: problem
    character(:), allocatable :: path
    integer :: point

    path = file_name(problem)
    point = index(path, '.', back=.true.)
    if (point > 1) path = path(:point - 1)
    path = path//'.solution.hdf5'
  end function solution_path

  !> A path without its folders.
  pure function file_name(path) result(name)
    character(*), intent(in) :: path
    character(:), allocatable :: name

    name = path(index(path, '/', back=.true.) + 1:)
  end function file_name

  !> What the file holds.
  function describe(path, given, condensed) result(lines)
    character(*), intent(in) :: path
    type(fclib_problem_t), intent(in) :: given
    type(condensed_t), intent(in) :: condensed
    type(string_t), allocatable :: lines(:)
    character(:), allocatable :: text

    text = 'bipot '//version//': '//path//': '//to_text(given%n_points)//' points, '// &
      to_text(condensed%problem%n_rows)//' rows'
    if (given%is_global) text = text//' condensed from '//to_text(given%m%m)//' equations'
    if (condensed%problem%n_rows <= largest_ranked) text = text//', rank '// &
      to_text(rank_of(condensed%problem))
    if (minval(given%mu) < maxval(given%mu)) then
      text = text//', mu '//to_text(minval(given%mu))//' to '//to_text(maxval(given%mu))
    else
      text = text//', mu '//to_text(given%mu(1))
    end if
    allocate (lines(merge(2, 1, condensed%asymmetry > rounding)))
    lines(1)%text = text
    if (size(lines) > 1) lines(2)%text = 'W is not symmetric: '// &
      to_text(condensed%asymmetry, 2)//' of its largest entry; its symmetric part is solved, '// &
      'and corrected until the W of the file holds'
  end function describe

  !> Reactions from a start at 0.
  !>
  !> A W that is not quite symmetric: its symmetric part is solved again and again, with what it
  !> leaves out taken from the reactions before. The residual is that of the file's own W.
  subroutine solve(given, condensed, controls, solution, report)
    type(fclib_problem_t), intent(in) :: given
    type(condensed_t), intent(in) :: condensed
    type(contact_controls_t), intent(in) :: controls
    type(fclib_solution_t), intent(inout) :: solution
    type(contact_report_t), intent(out) :: report
    type(contact_report_t) :: total
    type(contact_controls_t) :: tighter
    real(wp), dimension(3, given%n_points) :: r, best, start, u, x_free
    real(wp) :: last
    integer :: i

    associate (problem => condensed%problem)
      r = 0.0_wp
      x_free = reshape(condensed%q, shape(x_free))
      if (condensed%asymmetry <= rounding) then
        call solve_contact(problem, pack_rows(problem, x_free), controls, r, report)
        solution%r = reshape(r, [size(r)])
        return
      end if
      tighter = controls
      ! No more exactly than the asymmetry leaves of it.
      tighter%tolerance = max(0.3_wp*controls%tolerance, condensed%asymmetry)
      start = 0.0_wp
      best = 0.0_wp
      total%residual = huge(last)
      corrections: do i = 1, max_corrections
        call solve_contact(problem, pack_rows(problem, x_free), tighter, r, report)
        total%iterations = total%iterations + report%iterations
        total%local_iterations = total%local_iterations + report%local_iterations
        total%products = total%products + report%products
        total%solver = report%solver
        total%ending = merge(not_ended, report%ending, report%converged())
        u = reshape(times(given%w, reshape(r, [size(r)])), shape(u))
        last = total%residual
        call measure(problem, pack_rows(problem, reshape(condensed%q, shape(u))), &
          pack_rows(problem, u + reshape(condensed%q, shape(u))), pack_rows(problem, r), start, &
          report)
        if (report%residual < total%residual) then
          total%residual = report%residual
          total%worst_point = report%worst_point
          best = r
        end if
        if (total%residual <= controls%tolerance) total%ending = ended_well
        if (total%converged() .or. total%residual > 0.5_wp*last) exit corrections
        tighter%tolerance = max(0.3_wp*controls%tolerance, condensed%asymmetry*total%residual)
        x_free = u + reshape(condensed%q, shape(u)) - unpack_rows(problem, &
          relative_gaps(problem, 0.0_wp*pack_rows(problem, u), pack_rows(problem, r)))
      end do corrections
      report = total
      solution%r = reshape(best, [size(best)])
    end associate
  end subroutine solve

  !> u and v from the file's own matrices, and what they are worth.
  subroutine certify(given, condensed, controls, solution, certificate, error)
    type(fclib_problem_t), intent(in) :: given
    type(condensed_t), intent(inout) :: condensed
    type(contact_controls_t), intent(in) :: controls
    type(fclib_solution_t), intent(inout) :: solution
    type(certificate_t), intent(out) :: certificate
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: imbalance
    integer :: shape_of_points(2)

    imbalance = 0.0_wp
    allocate (solution%u(size(solution%r)))
    if (given%is_global) then
      call motion_of(given, condensed, solution%r, solution%v, solution%u, error)
      if (allocated(error)) return
      imbalance = imbalance_of(given, solution%r, solution%v)
    else
      solution%u = times(given%w, solution%r) + given%q
    end if
    shape_of_points = [3, given%n_points]
    certificate = certify_problem(given%mu, reshape(solution%r, shape_of_points), &
      reshape(solution%u, shape_of_points), reshape(condensed%q, shape_of_points), imbalance, &
      controls%tolerance)
  end subroutine certify

  !> What the solution file says of the solution.
  subroutine add_facts(controls, report, certificate, asymmetry, seconds, solution)
    type(contact_controls_t), intent(in) :: controls
    type(contact_report_t), intent(in) :: report
    type(certificate_t), intent(in) :: certificate
    real(wp), intent(in) :: asymmetry, seconds(2) !! [-]; wall and processor [s]
    type(fclib_solution_t), intent(inout) :: solution

    solution%solver = solver_in_words(report)
    solution%converged = report%converged()
    solution%fact_name = as_list([character(17) :: 'tolerance', 'residual', 'iterations', &
      'local_iterations', 'products', 'seconds', 'processor_seconds', 'asymmetry', &
      'penetration', 'adhesion', 'complementarity', 'cone', 'law', 'equilibrium'])
    solution%fact = [controls%tolerance, report%residual, real(report%iterations, wp), &
      real(report%local_iterations, wp), real(report%products, wp), seconds, asymmetry, &
      certificate%penetration, certificate%adhesion, certificate%complementarity, &
      certificate%cone, certificate%law, certificate%equilibrium]
  end subroutine add_facts

  !> The one sentence that says how it went.
  subroutine close_run(options, report, certificate, path, error)
    type(options_t), intent(in) :: options
    type(contact_report_t), intent(in) :: report
    type(certificate_t), intent(in) :: certificate
    character(*), intent(in) :: path
    type(error_t), allocatable, intent(out) :: error

    if (report%converged()) then
      call say('solved to '//to_text(options%controls%tolerance)//' by '// &
        solver_in_words(report)//', residual '//to_text(report%residual, 3)// &
        ', worst error '//to_text(worst_entry(certificate), 2)//': '//path)
      return
    end if
    call raise(error, exit_not_solved, options%deck//': not solved to '// &
      to_text(options%controls%tolerance)//': '//solver_in_words(report)//' '// &
      ending_in_words(report)//' after '//to_text(report%iterations)// &
      ' iterations, residual '//to_text(report%residual, 3)//', largest at point '// &
      to_text(report%worst_point)// &
      tolerance_in_reach(report%residual, options%controls%tolerance)// &
      '; the best iterate is in '//path)
  end subroutine close_run

  pure function solver_in_words(report) result(words)
    type(contact_report_t), intent(in) :: report
    character(:), allocatable :: words

    words = solver_name(report%solver)
    if (report%solver == solver_none) words = 'nothing to iterate'
  end function solver_in_words

  pure function ending_in_words(report) result(words)
    type(contact_report_t), intent(in) :: report
    character(:), allocatable :: words

    words = 'stopped making progress'
    if (report%ending == ended_at_limit) words = 'reached its limit'
    if (report%ending == ended_diverging) words = 'diverged'
  end function ending_in_words

end module solve_problem_mod
