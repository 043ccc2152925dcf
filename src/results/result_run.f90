!> The group /run of a result file: what was run, by what, and how it ended.
!>
!> All of it is there from the beginning; what is known only later gets its value in place.
module result_run_mod
  use kinds_mod, only: wp, i8
  use errors_mod, only: error_t
  use text_mod, only: string_t
  use scene_mod, only: scene_t
  use controls_mod, only: precision_controls_t, compliance_products
  use mesh_mod, only: mesh_t, plane_strain, plane_stress
  use mesh_size_mod, only: mesh_size_t
  use plan_mod, only: plan_t, bound_in_words
  use hdf5_files_mod, only: hdf5_file_t, create_group, flush_file
  use hdf5_attributes_mod, only: write_attribute, read_attribute
  use hdf5_datasets_mod, only: write_dataset, rewrite_dataset, read_dataset, write_text
  implicit none
  private

  public :: provenance_t, read_arithmetic, read_mesh_size, write_run, resume_run, end_run, &
    program_name, text_of
  public :: run_finished, run_settled, run_not_solved, run_stopped, run_failed

  ! What /run@status says. It is `running` until `end_run`, and for ever if that never comes.
  character(*), parameter :: run_running = 'running'
  character(*), parameter :: run_finished = 'finished'     !! all increments are there
  character(*), parameter :: run_settled = 'settled'
  !! those that are left would repeat a load cycle that has settled
  character(*), parameter :: run_not_solved = 'not solved' !! an increment found no solution
  character(*), parameter :: run_stopped = 'stopped'       !! by a signal
  character(*), parameter :: run_failed = 'failed'         !! the machine: memory, a library
  integer, parameter :: longest_status = 16
  integer, parameter :: room_for_sessions = 1000 !! bytes, a line each time a run was continued

  ! What /run@compliance says where nothing is factorised; else compliance_dense or its kin.
  integer(i8), parameter :: by_iteration = 3

  character(*), parameter :: zone = '/run/refined_about'

  character(*), parameter :: program_name = 'bipot'

  !> Who made the file. What is not allocated is left empty.
  type :: provenance_t
    character(:), allocatable :: version   !! of the program
    character(:), allocatable :: build     !! compiler and its flags
    character(:), allocatable :: libraries !! names and versions
    character(:), allocatable :: command   !! the command line
    character(:), allocatable :: blas_core !! the kernels OpenBLAS runs
    character(:), allocatable :: started   !! date and time, ISO 8601
    integer :: ranks = 1                   !! processes that ran together
    type(string_t), allocatable :: counters(:) !! names of those that `end_run` gets
  end type provenance_t

contains

  !> Make the group of a run that begins.
  subroutine write_run(hdf5, scene, plan, provenance, error)
    type(hdf5_file_t), intent(in) :: hdf5
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    type(provenance_t), intent(in) :: provenance
    type(error_t), allocatable, intent(out) :: error

    call create_group(hdf5, '/run', error)
    call write_attribute(hdf5, '/run', 'description', 'what was run, by what, and how it ended', &
                         error)
    call write_attribute(hdf5, '/run', 'program', program_name, error)
    call write_attribute(hdf5, '/run', 'name', text_of(scene%name), error)
    call write_attribute(hdf5, '/run', 'units', text_of(scene%units), error)
    call write_attribute(hdf5, '/run', 'version', text_of(provenance%version), error)
    call write_attribute(hdf5, '/run', 'build', text_of(provenance%build), error)
    call write_attribute(hdf5, '/run', 'libraries', text_of(provenance%libraries), error)
    call write_attribute(hdf5, '/run', 'blas_core', text_of(provenance%blas_core), error)
    call write_attribute(hdf5, '/run', 'ranks', int(provenance%ranks, i8), error)
    call write_attribute(hdf5, '/run', 'command', text_of(provenance%command), error)
    call write_attribute(hdf5, '/run', 'started', text_of(provenance%started), error)
    call write_arithmetic(hdf5, plan%choices%precision, plan%choices%compliance, error)
    call write_mesh_size(hdf5, plan%choices%mesh_size, plan%choices%divisions, error)
    call write_attribute(hdf5, '/run', 'tangent', tangent_of(scene, plan), error)
    call write_attribute(hdf5, '/run', 'bodies', bodies_of(scene%mesh), error)
    call write_attribute(hdf5, '/run', 'status', padded(run_running), error)
    call write_attribute(hdf5, '/run', 'continued', repeat(achar(0), room_for_sessions), error)
    if (allocated(provenance%counters)) then
      ! Zeros: the end of the run knows them.
      call write_dataset(hdf5, '/run/counters', spread(0.0_wp, 1, size(provenance%counters)), &
        'sizes, times in seconds and memory of the run; their names are in the attribute "name"', &
        'number', error)
      call write_attribute(hdf5, '/run/counters', 'name', provenance%counters, error)
    end if

    call write_text(hdf5, '/run/deck', text_of(scene%deck), 'the deck as read, includes put in', &
                    error)
    call write_text(hdf5, '/run/overrides', text_of(scene%overrides), &
                    'parameters given on the command line, name=value a line', error)
    call write_text(hdf5, '/run/notes', joined([scene%notes, plan%notes]), &
                    'what the program noted of the deck before the run began, a note a line', error)
    call write_text(hdf5, '/run/plan', joined(plan%lines), &
                    'what the run was to do, decided before it began', error)
    if (allocated(plan%figures)) call write_estimates(hdf5, plan, error)
  end subroutine write_run

  !> Which stiffness the iterations solve with.
  pure function tangent_of(scene, plan) result(name)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    character(:), allocatable :: name

    name = 'small strain'
    if (scene%finite_strain) name = 'kept'
    if (scene%finite_strain .and. plan%choices%precision%renews_tangent) name = 'newton'
  end function tangent_of

  !> What the mesh is of the bodies: their solids, or a slice or a wedge that stands for them.
  pure function bodies_of(mesh) result(name)
    type(mesh_t), intent(in) :: mesh
    character(:), allocatable :: name

    name = 'solid'
    if (any(mesh%plane == [plane_strain, plane_stress])) name = 'slice'
    if (mesh%sector_angle > 0.0_wp) name = 'wedge'
  end function bodies_of

  !> Keep what was chosen by what the machine had left, so that a continued run, perhaps on another
  !> or at another time, computes in the same arithmetic.
  subroutine write_arithmetic(hdf5, precision, compliance, error)
    type(hdf5_file_t), intent(in) :: hdf5
    type(precision_controls_t), intent(in) :: precision
    integer, intent(in) :: compliance !! compliance_dense, ...
    type(error_t), allocatable, intent(inout) :: error

    call write_attribute(hdf5, '/run', 'single_factor', merge(1_i8, 0_i8, &
      precision%single_factor), error)
    call write_attribute(hdf5, '/run', 'single_factor_saves_time', merge(1_i8, 0_i8, &
      precision%saves_time), error)
    call write_attribute(hdf5, '/run', 'factor_threads', int(precision%threads, i8), error)
    call write_attribute(hdf5, '/run', 'block_low_rank', precision%block_low_rank, error)
    call write_attribute(hdf5, '/run', 'out_of_core', merge(1_i8, 0_i8, precision%out_of_core), &
      error)
    call write_attribute(hdf5, '/run', 'compliance', merge(by_iteration, int(compliance, i8), &
      precision%iterative), error)
  end subroutine write_arithmetic

  !> Keep what an accuracy chose, so that a continued run has the same mesh and increments.
  subroutine write_mesh_size(hdf5, mesh_size, divisions, error)
    type(hdf5_file_t), intent(in) :: hdf5
    type(mesh_size_t), intent(in) :: mesh_size
    integer, intent(in) :: divisions !! of the deck's increments
    type(error_t), allocatable, intent(inout) :: error

    call write_attribute(hdf5, '/run', 'blocks_times', int(mesh_size%blocks(1), i8), error)
    call write_attribute(hdf5, '/run', 'blocks_over', int(mesh_size%blocks(2), i8), error)
    call write_attribute(hdf5, '/run', 'parts', int(mesh_size%parts, i8), error)
    call write_attribute(hdf5, '/run', 'across', int(mesh_size%across, i8), error)
    call write_attribute(hdf5, '/run', 'divisions', int(divisions, i8), error)
    call write_attribute(hdf5, '/run', 'cuts', int(mesh_size%zone%times, i8), error)
    if (mesh_size%zone%times == 0) return
    call write_dataset(hdf5, zone, mesh_size%zone%balls, 'balls about which elements were cut '// &
      'again: centre and radius', 'length', error)
  end subroutine write_mesh_size

  !> The mesh and the divisions that a file names.
  subroutine read_mesh_size(hdf5, mesh_size, divisions, error)
    type(hdf5_file_t), intent(in) :: hdf5
    type(mesh_size_t), intent(inout) :: mesh_size
    integer, intent(inout) :: divisions
    type(error_t), allocatable, intent(inout) :: error
    integer(i8) :: numbers(6)
    real(wp), allocatable :: balls(:)

    call read_attribute(hdf5, '/run', 'blocks_times', numbers(1), error)
    call read_attribute(hdf5, '/run', 'blocks_over', numbers(2), error)
    call read_attribute(hdf5, '/run', 'parts', numbers(3), error)
    call read_attribute(hdf5, '/run', 'divisions', numbers(4), error)
    call read_attribute(hdf5, '/run', 'cuts', numbers(5), error)
    call read_attribute(hdf5, '/run', 'across', numbers(6), error)
    if (allocated(error)) return
    if (any(numbers(:4) < 1) .or. any(numbers > 1000000) .or. numbers(5) < 0 .or. &
      all(numbers(6) /= [0, 1, 2, 3])) return
    if (numbers(5) > 0) then
      call read_dataset(hdf5, zone, balls, error)
      if (allocated(error)) return
      mesh_size%zone%balls = reshape(balls, [4, size(balls)/4])
    end if
    mesh_size%zone%times = int(numbers(5))
    mesh_size%blocks = int(numbers(:2))
    mesh_size%parts = int(numbers(3))
    mesh_size%across = int(numbers(6))
    divisions = int(numbers(4))
  end subroutine read_mesh_size

  !> The arithmetic that a file names.
  subroutine read_arithmetic(hdf5, precision, compliance, error)
    type(hdf5_file_t), intent(in) :: hdf5
    type(precision_controls_t), intent(inout) :: precision
    integer, intent(inout) :: compliance !! compliance_dense, ...
    type(error_t), allocatable, intent(inout) :: error
    integer(i8) :: single, saves_time, threads, out_of_core, kind_of_compliance
    real(wp) :: block_low_rank

    call read_attribute(hdf5, '/run', 'single_factor', single, error)
    call read_attribute(hdf5, '/run', 'single_factor_saves_time', saves_time, error)
    call read_attribute(hdf5, '/run', 'factor_threads', threads, error)
    call read_attribute(hdf5, '/run', 'block_low_rank', block_low_rank, error)
    call read_attribute(hdf5, '/run', 'out_of_core', out_of_core, error)
    call read_attribute(hdf5, '/run', 'compliance', kind_of_compliance, error)
    if (allocated(error)) return
    precision%iterative = kind_of_compliance == by_iteration
    compliance = int(min(kind_of_compliance, int(compliance_products, i8)))
    precision%single_factor = single == 1
    precision%saves_time = saves_time == 1
    precision%threads = int(threads)
    precision%block_low_rank = block_low_rank
    precision%out_of_core = out_of_core == 1
  end subroutine read_arithmetic

  !> The numbers of the plan, under the names that the counters have.
  subroutine write_estimates(hdf5, plan, error)
    type(hdf5_file_t), intent(in) :: hdf5
    type(plan_t), intent(in) :: plan
    type(error_t), allocatable, intent(inout) :: error
    type(string_t) :: names(size(plan%figures)), bounds(size(plan%figures))
    integer :: i

    do i = 1, size(plan%figures)
      names(i)%text = plan%figures(i)%name
      bounds(i)%text = bound_in_words(plan%figures(i)%bound)
    end do
    call write_dataset(hdf5, '/run/estimates', plan%figures%value, &
                       'numbers of the plan; their names are in the attribute "name", how they '// &
                       'are meant (fixed, at most, about) in "bound"', 'number', error)
    call write_attribute(hdf5, '/run/estimates', 'name', names, error)
    call write_attribute(hdf5, '/run/estimates', 'bound', bounds, error)
  end subroutine write_estimates

  !> Say that the run goes on, with a line among the sessions that continued it; where there is no
  !> room the oldest go.
  subroutine resume_run(hdf5, provenance, error)
    type(hdf5_file_t), intent(in) :: hdf5
    type(provenance_t), intent(in) :: provenance !! of the program that goes on
    type(error_t), allocatable, intent(inout) :: error
    character(:), allocatable :: sessions
    character(room_for_sessions) :: text

    call write_attribute(hdf5, '/run', 'status', padded(run_running), error)
    call read_attribute(hdf5, '/run', 'continued', sessions, error)
    if (sessions /= '') sessions = sessions//new_line('a')
    sessions = sessions//text_of(provenance%started)//' '//text_of(provenance%command)
    do while (len(sessions) > room_for_sessions .and. index(sessions, new_line('a')) > 0)
      sessions = sessions(index(sessions, new_line('a')) + 1:)
    end do
    text = repeat(achar(0), room_for_sessions)
    text(:min(len(sessions), room_for_sessions)) = sessions
    call write_attribute(hdf5, '/run', 'continued', text, error)
  end subroutine resume_run

  !> Say how the run ended, and what it added up to.
  subroutine end_run(hdf5, status, counters, error)
    type(hdf5_file_t), intent(in) :: hdf5
    character(*), intent(in) :: status  !! run_finished, run_not_solved, ...
    real(wp), intent(in) :: counters(:) !! in the order of their names: sizes, times [s], memory
    !! [bytes]; empty where the run began without
    type(error_t), allocatable, intent(inout) :: error

    if (size(counters) > 0) call rewrite_dataset(hdf5, '/run/counters', counters, error)
    ! All else must be in the file before it calls itself finished.
    call flush_file(hdf5, error)
    call write_attribute(hdf5, '/run', 'status', padded(status), error)
  end subroutine end_run

  !> Lines as one text; nothing where there are none.
  pure function joined(lines) result(text)
    type(string_t), intent(in), optional :: lines(:) !! may be an allocatable that is not allocated
    character(:), allocatable :: text
    integer :: i

    text = ''
    if (.not. present(lines)) return
    do i = 1, size(lines)
      text = text//lines(i)%text//new_line('a')
    end do
  end function joined

  !> A status with room for the longest one: an attribute keeps the length it began with.
  pure function padded(status) result(text)
    character(*), intent(in) :: status
    character(longest_status) :: text

    text = repeat(achar(0), longest_status)
    text(:len(status)) = status
  end function padded

  !> The text, or nothing.
  pure function text_of(text) result(given)
    character(*), intent(in), optional :: text !! may be an allocatable that is not allocated
    character(:), allocatable :: given

    given = ''
    if (present(text)) given = text
  end function text_of

end module result_run_mod
