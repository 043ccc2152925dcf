!> FCLIB's HDF5 files: frictional contact problems and their solutions, exchanged with others.
!>
!>     /fclib_local/{spacedim, W/..., vectors/{q, mu}, info/...}
!>     /fclib_global/{spacedim, M/..., H/..., vectors/{f, w, mu}, info/...}
!>     /guesses/{number_of_guesses, 1/{r, u}}    /solution/{r, u[, v]}
!>
!> Local: u = W r + q; global: M v = H r + f, u = H^T v + w. Components in the order n, t1, t2.
!> A file that this module writes is a complete problem with its solution; docs/fclib.md.
module fclib_mod
  use kinds_mod, only: wp, i8
  use errors_mod, only: error_t, raise, exit_wrong_input, exit_machine
  use text_mod, only: string_t
  use hdf5_files_mod, only: hdf5_file_t, look_at_file, create_file, open_file, close_file, &
    create_group, exists, file_absent, file_readable, file_locked, file_foreign
  use hdf5_attributes_mod, only: write_attribute, read_attribute
  use hdf5_datasets_mod, only: write_dataset, write_text
  use fclib_matrix_mod, only: sparse_matrix_t, read_matrix, write_matrix, sparse_of, &
                              read_numbers, read_count, times, blame, most_rows
  use fresh_file_mod, only: beginning_of, take_place, delete_file
  use compliance_mod, only: get_column
  use problem_mod, only: contact_problem_t
  implicit none
  private

  public :: fclib_problem_t, fclib_solution_t, is_fclib_path, read_fclib, write_fclib_solution, &
            export_fclib

  character(*), parameter :: local_group = '/fclib_local'
  character(*), parameter :: global_group = '/fclib_global'
  character(*), parameter :: program_name = 'bipot'

  !> A problem as it stands in its file.
  type :: fclib_problem_t
    logical :: is_global = .false.
    integer :: n_points = 0
    real(wp), allocatable :: mu(:)      !! (n_points) [-]
    type(sparse_matrix_t) :: w          !! (3 n_points)^2, local only [length/force]
    real(wp), allocatable :: q(:)       !! (3 n_points) u without reactions; global: w [length]
    type(sparse_matrix_t) :: m          !! (n,n) both triangles or one, global only [force/length]
    type(sparse_matrix_t) :: h          !! (n,3 n_points) global only [-]
    real(wp), allocatable :: f(:)       !! (n) global only [force]
  end type fclib_problem_t

  !> What is written beside a problem.
  type :: fclib_solution_t
    real(wp), allocatable :: r(:)               !! (3 n_points) reactions [force]
    real(wp), allocatable :: u(:)               !! (3 n_points) gaps and slips [length]
    real(wp), allocatable :: v(:)               !! (n) of a global problem [length]
    type(string_t), allocatable :: fact_name(:) !! attributes of /solution
    real(wp), allocatable :: fact(:)            !! and their values
    character(:), allocatable :: solver         !! in words
    logical :: converged = .false.
  end type fclib_solution_t

contains

  ! ------------------------------------------------------------------ reading

  !> Say whether a path names an HDF5 file, by its signature or, where there is none, its ending.
  logical function is_fclib_path(path) result(yes)
    character(*), intent(in) :: path
    integer :: found

    yes = ends_with(path, '.hdf5') .or. ends_with(path, '.h5')
    if (yes) return
    found = look_at_file(path)
    yes = found /= file_absent .and. found /= file_foreign
  end function is_fclib_path

  pure logical function ends_with(text, ending) result(yes)
    character(*), intent(in) :: text, ending

    yes = .false.
    if (len(text) > len(ending)) yes = text(len(text) - len(ending) + 1:) == ending
  end function ends_with

  !> Read a problem and check everything that a solver relies on.
  subroutine read_fclib(path, problem, error)
    character(*), intent(in) :: path
    type(fclib_problem_t), intent(out) :: problem
    type(error_t), allocatable, intent(out) :: error !! wrong file
    type(hdf5_file_t) :: file
    type(error_t), allocatable :: closing

    select case (look_at_file(path))
    case (file_absent)
      call raise(error, exit_wrong_input, path//': error: there is no such file')
    case (file_locked)
      call raise(error, exit_machine, path//': error: another program has the file open')
    case (file_foreign)
      call raise(error, exit_wrong_input, path//': error: this is not an HDF5 file')
    case (file_readable)
      call open_file(path, .false., file, error)
      if (.not. allocated(error)) call read_problem(file, problem, error)
      call close_file(file, closing)
    case default
      call raise(error, exit_wrong_input, path//': error: the file is damaged or cut off')
    end select
  end subroutine read_fclib

  subroutine read_problem(file, problem, error)
    type(hdf5_file_t), intent(in) :: file
    type(fclib_problem_t), intent(inout) :: problem
    type(error_t), allocatable, intent(inout) :: error
    character(:), allocatable :: group
    integer :: dimensions

    group = local_group
    problem%is_global = exists(file, global_group)
    if (problem%is_global) group = global_group
    if (.not. exists(file, group)) then
      if (exists(file, '/VTKHDF')) then
        call blame(error, file, 'this is a result, not a deck: scripts/show and ParaView show '// &
          'it; bipot DECK --continue goes on with a run')
      else
        call blame(error, file, 'neither /fclib_local nor /fclib_global is in it, so it is no '// &
          'FCLIB problem')
      end if
      return
    end if
    call read_count(file, group//'/spacedim', 2_i8, 3_i8, dimensions, error)
    if (allocated(error)) return
    if (dimensions /= 3) then
      call blame(error, file, 'the problem is two-dimensional (spacedim 2); bipot solves '// &
        'three-dimensional ones')
      return
    end if
    call refuse_equalities(file, group, error)
    call read_numbers(file, group//'/vectors/mu', problem%mu, error)
    if (problem%is_global) then
      call read_matrix(file, group//'/M', problem%m, error)
      call read_matrix(file, group//'/H', problem%h, error)
      call read_numbers(file, group//'/vectors/f', problem%f, error)
      call read_numbers(file, group//'/vectors/w', problem%q, error)
    else
      call read_matrix(file, group//'/W', problem%w, error)
      call read_numbers(file, group//'/vectors/q', problem%q, error)
    end if
    if (allocated(error)) return
    problem%n_points = size(problem%mu)
    call check_shapes(file, problem, error)
  end subroutine read_problem

  !> Equality constraints beside the contacts are a part of FCLIB that is not solved here.
  subroutine refuse_equalities(file, group, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: group
    type(error_t), allocatable, intent(inout) :: error

    character, parameter :: matrix(3) = ['G', 'V', 'R']
    integer :: i

    do i = 1, size(matrix)
      if (allocated(error)) return
      if (exists(file, group//'/'//matrix(i))) call blame(error, file, 'the problem has '// &
        "equality constraints beside the contacts (the matrix '"//matrix(i)// &
        "'), which bipot does not solve")
    end do
  end subroutine refuse_equalities

  subroutine check_shapes(file, problem, error)
    type(hdf5_file_t), intent(in) :: file
    type(fclib_problem_t), intent(in) :: problem
    type(error_t), allocatable, intent(inout) :: error
    integer :: n_rows

    if (problem%n_points < 1 .or. 3*int(problem%n_points, i8) > most_rows) then
      call blame(error, file, 'vectors/mu has no points, or too many')
      return
    end if
    n_rows = 3*problem%n_points
    if (any(problem%mu < 0.0_wp)) call blame(error, file, &
      'a friction coefficient in vectors/mu is negative')
    if (problem%is_global) then
      if (problem%m%m /= problem%m%n) call blame(error, file, 'the matrix M is not square')
      if (problem%h%m /= problem%m%m .or. problem%h%n /= n_rows) call blame(error, file, &
        'the matrix H has not as many rows as M and three columns a point of vectors/mu')
      if (size(problem%f) /= problem%m%m) call blame(error, file, &
        'vectors/f has not as many numbers as M has rows')
      if (size(problem%q) /= n_rows) call blame(error, file, &
        'vectors/w has not three numbers a point of vectors/mu')
    else
      if (problem%w%m /= n_rows .or. problem%w%n /= n_rows) call blame(error, file, &
        'the matrix W has not three rows and columns a point of vectors/mu')
      if (size(problem%q) /= n_rows) call blame(error, file, &
        'vectors/q has not three numbers a point of vectors/mu')
    end if
  end subroutine check_shapes

  ! ------------------------------------------------------------------ writing

  !> Write a problem with a solution.
  !>
  !> The file takes its place when it is complete: `path` may be where the problem was read from.
  subroutine write_fclib_solution(path, problem, labels, solution, overwrite, error)
    character(*), intent(in) :: path
    type(fclib_problem_t), intent(in) :: problem
    type(string_t), intent(in) :: labels(2)   !! title, description
    type(fclib_solution_t), intent(in) :: solution
    logical, intent(in) :: overwrite          !! replace whatever stands at `path`
    type(error_t), allocatable, intent(out) :: error !! in the way, or the machine failed
    type(hdf5_file_t) :: file

    call begin(path, overwrite, file, error)
    if (allocated(error)) return
    call put_problem(file, problem, labels, error)
    call put_solution(file, solution, error)
    call finish(path, file, error)
  end subroutine write_fclib_solution

  !> Write a condensed contact problem with its start and its solution, all points with three rows.
  !>
  !> A direction without a row (held by a support, or without friction) gets a diagonal entry of W
  !> alone and q = 0. Its u is W_aa r_a, and Coulomb's law wants r_a against u_a or u_a = 0: r_a = 0
  !> follows, so reactions are those of the smaller problem. u_a = 0 then says nothing of the slip.
  !> A tangent that supports drive has no entry of W, and its slip is q.
  subroutine export_fclib(path, problem, x_free, guess, r, labels, overwrite, error)
    character(*), intent(in) :: path
    type(contact_problem_t), intent(in) :: problem
    real(wp), intent(in) :: x_free(:)              !! (n_rows) [length]
    real(wp), intent(in) :: guess(:, :), r(:, :)   !! (3,n_points) [force]
    type(string_t), intent(in) :: labels(2)        !! title, description
    logical, intent(in) :: overwrite
    type(error_t), allocatable, intent(out) :: error
    type(fclib_problem_t) :: whole
    type(fclib_solution_t) :: start, solution
    type(hdf5_file_t) :: file

    call embed(problem, x_free, whole)
    start%r = reshape(guess, [size(guess)])
    start%u = times(whole%w, start%r) + whole%q
    solution%r = reshape(r, [size(r)])
    solution%u = times(whole%w, solution%r) + whole%q
    call begin(path, overwrite, file, error)
    if (allocated(error)) return
    call put_problem(file, whole, labels, error)
    call create_group(file, '/guesses', error)
    call write_dataset(file, '/guesses/number_of_guesses', [1], 'guesses', 'count', error)
    call create_group(file, '/guesses/1', error)
    call put_vectors(file, '/guesses/1', start, error)
    call create_group(file, '/solution', error)
    call write_attribute(file, '/solution', 'program', program_name, error)
    call put_vectors(file, '/solution', solution, error)
    call finish(path, file, error)
  end subroutine export_fclib

  subroutine put_problem(file, problem, labels, error)
    type(hdf5_file_t), intent(in) :: file
    type(fclib_problem_t), intent(in) :: problem
    type(string_t), intent(in) :: labels(2)
    type(error_t), allocatable, intent(inout) :: error
    character(:), allocatable :: group

    group = local_group
    if (problem%is_global) group = global_group
    call create_group(file, group, error)
    call write_dataset(file, group//'/spacedim', [3], 'dimension of space', 'count', error)
    call create_group(file, group//'/vectors', error)
    call write_dataset(file, group//'/vectors/mu', problem%mu, 'friction coefficient', 'ratio', &
      error)
    if (problem%is_global) then
      call write_matrix(file, group//'/M', problem%m, 'M of M v = H r + f', 'force/length', error)
      call write_matrix(file, group//'/H', problem%h, 'H of u = H^T v + w', 'ratio', error)
      call write_dataset(file, group//'/vectors/f', problem%f, 'forces on v', 'force', error)
      call write_dataset(file, group//'/vectors/w', problem%q, 'u where v = 0', 'length', error)
    else
      call write_matrix(file, group//'/W', problem%w, 'W of u = W r + q', 'length/force', error)
      call write_dataset(file, group//'/vectors/q', problem%q, &
        'gap and slip of each point without reactions: n, t1, t2', 'length', error)
    end if
    ! FCLIB's readers want texts with the NUL of C at their end.
    call create_group(file, group//'/info', error)
    call write_text(file, group//'/info/title', labels(1)%text//achar(0), 'title', error)
    call write_text(file, group//'/info/description', labels(2)%text//achar(0), &
      'where the problem comes from', error)
    call write_text(file, group//'/info/math_info', 'unknown'//achar(0), 'what is known of it', &
      error)
  end subroutine put_problem

  !> A condensed problem with three rows at every point.
  subroutine embed(problem, x_free, whole)
    type(contact_problem_t), intent(in) :: problem
    real(wp), intent(in) :: x_free(:)
    type(fclib_problem_t), intent(out) :: whole
    real(wp), allocatable :: w(:, :)
    real(wp) :: column(problem%n_rows)
    integer :: position(problem%n_rows), i, a, k, l, n

    n = 3*problem%n_points
    allocate (w(n, n), whole%q(n), source=0.0_wp)
    do i = 1, problem%n_points
      do a = 1, 3
        k = 3*(i - 1) + a
        if (problem%row(a, i) > 0) then
          position(problem%row(a, i)) = k
          whole%q(k) = x_free(problem%row(a, i))
        else
          w(k, k) = problem%block(a, a, i)
          if (a == 1) cycle
          whole%q(k) = problem%driven(a - 1, i)
          if (abs(whole%q(k)) > 0.0_wp) w(k, k) = 0.0_wp
        end if
      end do
    end do
    do l = 1, problem%n_rows
      ! The lower triangle is the one that the solvers read.
      call get_column(problem%compliance, l, column)
      w(position(l:), position(l)) = column(l:)
      w(position(l), position(l:)) = column(l:)
    end do
    whole%n_points = problem%n_points
    whole%mu = problem%mu
    whole%w = sparse_of(w)
  end subroutine embed

  subroutine put_solution(file, solution, error)
    type(hdf5_file_t), intent(in) :: file
    type(fclib_solution_t), intent(in) :: solution
    type(error_t), allocatable, intent(inout) :: error
    integer :: i

    call create_group(file, '/solution', error)
    call write_attribute(file, '/solution', 'program', program_name, error)
    call write_attribute(file, '/solution', 'solver', solution%solver, error)
    call write_attribute(file, '/solution', 'converged', merge(1_i8, 0_i8, solution%converged), &
      error)
    do i = 1, size(solution%fact)
      call write_attribute(file, '/solution', solution%fact_name(i)%text, solution%fact(i), error)
    end do
    call put_vectors(file, '/solution', solution, error)
  end subroutine put_solution

  subroutine put_vectors(file, group, solution, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: group
    type(fclib_solution_t), intent(in) :: solution
    type(error_t), allocatable, intent(inout) :: error

    call write_dataset(file, group//'/r', solution%r, 'reactions: n, t1, t2 of each point', &
      'force', error)
    call write_dataset(file, group//'/u', solution%u, 'gaps and slips: n, t1, t2 of each point', &
      'length', error)
    if (allocated(solution%v)) call write_dataset(file, group//'/v', solution%v, &
      'motion of all degrees of freedom', 'length', error)
  end subroutine put_vectors

  ! ------------------------------------------------------------------ the file's place

  !> Begin a file beside its position, unless something of another kind stands there.
  subroutine begin(path, overwrite, file, error)
    character(*), intent(in) :: path
    logical, intent(in) :: overwrite
    type(hdf5_file_t), intent(out) :: file
    type(error_t), allocatable, intent(out) :: error
    logical :: is_folder, replaceable

    inquire (file=path//'/.', exist=is_folder)
    replaceable = overwrite
    if (.not. (is_folder .or. replaceable)) replaceable = is_ours(path)
    if (is_folder) then
      call raise(error, exit_wrong_input, "'"//path//"' is a folder")
    else if (.not. replaceable) then
      call raise(error, exit_wrong_input, "'"//path//"' is there already and is not a solution "// &
        'of '//program_name//' (--overwrite replaces it)')
    end if
    if (allocated(error)) return
    ! What a killed run has left behind.
    call delete_file(beginning_of(path))
    call create_file(beginning_of(path), 0, file, error)
  end subroutine begin

  !> Close a file that was begun and move it to its place; after an error, take it away.
  subroutine finish(path, file, error)
    character(*), intent(in) :: path
    type(hdf5_file_t), intent(inout) :: file
    type(error_t), allocatable, intent(inout) :: error

    call close_file(file, error)
    if (allocated(error)) then
      call delete_file(beginning_of(path))
    else
      call take_place(path, error)
    end if
  end subroutine finish

  !> Say whether nothing stands at a path, or a solution that this program has written.
  logical function is_ours(path) result(ours)
    character(*), intent(in) :: path
    type(hdf5_file_t) :: file
    type(error_t), allocatable :: error
    character(:), allocatable :: program

    ours = .true.
    select case (look_at_file(path))
    case (file_absent)
      return
    case (file_readable)
      call open_file(path, .false., file, error)
      call read_attribute(file, '/solution', 'program', program, error)
      ours = .not. allocated(error)
      if (ours) ours = program == program_name
      call close_file(file, error)
    case default
      ours = .false.
    end select
  end function is_ours

end module fclib_mod
