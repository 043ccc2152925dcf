!> What a run will cost: memory, operations, time, file.
!>
!> Sizes come from the scene and from the symbolic analysis of the stiffness. Each cost is a sum
!> over the arrays and loops of the run, named where it is made: estimate_memory, estimate_file,
!> estimate_time. The few constants are measured once and documented in docs/plan.md.
module estimate_costs_mod
  use kinds_mod, only: wp, i8
  use errors_mod, only: error_t, raise, exit_wrong_input
  use text_mod, only: to_text
  use system_mod, only: cpu_seconds
  use resource_limits_mod, only: memory_left, disk_left
  use parallel_mod, only: n_ranks, usage_t, usage_of_others
  use scene_mod, only: scene_t
  use shadow_run_mod, only: has_no_shadow
  use controls_mod, only: solver_sweeps, compliance_dense, is_bounded
  use plan_mod, only: plan_t, add_figure, bound_fixed, bound_at_most, bound_about
  use sparse_factor_mod, only: sparse_factor_t
  use count_sizes_mod, only: sizes_t, count_sizes, products_of_increment, solutions, flops_of_run
  use estimate_file_mod, only: file_size_t, size_of_file
  use estimate_memory_mod, only: peak_memory, needed_memory, taken_already, room_within
  use estimate_time_mod, only: seconds_t, seconds_of_run, total_seconds
  use analyse_pattern_mod, only: look_at_later_steps
  use choose_body_mod, only: choose_body
  use amounts_mod, only: bytes_in_words, time_in_words
  use plan_table_mod, only: add_line, describe_choice
  implicit none
  private

  public :: estimate_costs

contains

  !> Foresee the costs of a planned run and add them to its table; choose, of what *PRECISION leaves
  !> open, what fits the machine.
  !>
  !> `factor` keeps the symbolic analysis for the first factorisation. Where even the analysis has
  !> no room the memory is a lower bound, and the plan has no time.
  subroutine estimate_costs(scene, path, needs_matrix, plan, factor, error)
    type(scene_t), intent(in) :: scene
    character(*), intent(in) :: path !! of the result file
    logical, intent(in) :: needs_matrix !! W itself is wanted, for a file say
    type(plan_t), intent(inout) :: plan !! gets precision and compliance
    type(sparse_factor_t), intent(inout) :: factor
    type(error_t), allocatable, intent(out) :: error !! METIS, LAPACK or MUMPS failed
    type(sizes_t) :: sizes
    type(file_size_t) :: file
    type(seconds_t) :: seconds
    type(usage_t) :: others
    real(wp) :: base, memory
    character(:), allocatable :: reasons
    integer :: bound

    others = usage_of_others()
    base = taken_already(plan%choices%runs_before)
    plan%memory_left = memory_left()
    if (scene%accuracy%memory > 0.0_wp) plan%memory_left = min(plan%memory_left, &
      room_within(scene%accuracy%memory, plan%choices%runs_before))
    plan%disk_left = disk_left(path)
    sizes%ranks = others%ranks_here
    sizes%fraction_here = sizes%ranks/real(n_ranks(), wp)
    call count_sizes(scene, plan, sizes)
    file = size_of_file(scene, plan, sizes)
    associate (precision => plan%choices%precision)
      precision%scratch = path(:index(path, '/', back=.true.))
      if (precision%scratch == '') precision%scratch = './'
      if (.not. precision%iterative .and. (needs_matrix .or. sizes%rows <= 0.0_wp .or. &
        scene%contact%solver == solver_sweeps)) plan%choices%compliance = compliance_dense
      if (needs_matrix .and. precision%iterative) then
        call raise(error, exit_wrong_input, 'bipot: error: *BODY SOLVER, TYPE=ITERATIVE does '// &
          'not cover --export-fclib, which writes the compliance of the contact; TYPE=FACTOR does')
        return
      end if
      if (needs_matrix) precision%body_is_given = .true.
    end associate
    call choose_body(scene, file, plan, factor, sizes, reasons, error)
    if (allocated(error)) return
    if (plan%is_analysed .and. .not. sizes%by_iteration) call look_at_later_steps(scene, plan, &
      sizes, error)
    if (allocated(error)) return
    plan%more_memory = needed_memory(sizes, file)
    plan%file_size = file%size
    plan%fields_size = file%fields
    plan%scratch_size = sizes%scratch
    memory = base + peak_memory(sizes, file)
    call add_figure(plan, 'peak_memory_bytes', memory, bound_about)
    call add_figure(plan, 'file_bytes', file%most, merge(bound_about, bound_at_most, any( &
      scene%steps%is_dynamic .and. .not. scene%steps%direct)))
    call add_figure(plan, 'likely_file_bytes', file%size, bound_about)
    if (plan%is_analysed) then
      seconds = seconds_of_run(scene, sizes, file)
      plan%seconds = total_seconds(seconds)
      plan%start_seconds = seconds%prepare + seconds%factorise + seconds%condense
      plan%may_follow_theory = is_shadow_cheap(scene, plan, seconds)
      if (.not. sizes%by_iteration) then
        bound = merge(bound_fixed, bound_at_most, plan%n_factorisations == 1 .and. &
          plan%choices%precision%block_low_rank <= 0.0_wp)
        if (are_pins_moved(scene, sizes)) bound = bound_about
        call add_figure(plan, 'factor_entries', sizes%factor, bound)
        call add_figure(plan, 'solutions', solutions(sizes), bound_about)
        call add_figure(plan, 'compliance_products', sizes%increments* &
          products_of_increment(sizes), bound_about)
        call add_figure(plan, 'operations', flops_of_run(sizes), bound_about)
      end if
      call add_figure(plan, 'cpu_seconds', cpu_seconds() + plan%seconds, bound_about)
    end if
    call describe_costs(scene, plan, sizes, file, memory, seconds)
    if (reasons /= '') call describe_choice(scene, reasons, plan)
  end subroutine estimate_costs

  !> Whether runs at finite strain beside this one, where none are asked for, have at most a fifth
  !> of its increments and take at most a fifth of its time, or next to none.
  logical function is_shadow_cheap(scene, plan, seconds) result(is_cheap)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    type(seconds_t), intent(in) :: seconds
    integer, parameter :: at_least = 5 !! times as many increments, as much time
    integer, parameter :: of_step = 2  !! increments of a shadow run
    real(wp), parameter :: slow = 5.0_wp
    !! times as long as is foreseen of one that soon settles: strains of tens of per cent [-]
    real(wp), parameter :: brief = 0.2_wp !! of no account, whatever the run takes [s]
    real(wp), parameter :: more = 2.0_wp !! memory, with the factor by which stability is seen [-]

    associate (accuracy => scene%accuracy)
      is_cheap = accuracy%estimates .and. .not. (scene%finite_strain .or. accuracy%follows_theory &
        .or. accuracy%chooses_theory .or. accuracy%wanted > 0.0_wp .or. is_bounded(accuracy))
    end associate
    is_cheap = is_cheap .and. .not. (plan%choices%precision%iterative .or. any( &
      scene%obstacles%turns)) .and. at_least*of_step*size(scene%steps) <= plan%n_increments .and. &
      slow*seconds%shadow <= max(brief, total_seconds(seconds)/at_least) .and. more* &
      plan%more_memory <= real(plan%memory_left, wp)
    if (is_cheap) is_cheap = has_no_shadow(scene) == ''
  end function is_shadow_cheap

  !> Whether the factor may be another than that of the plan, and larger: where free bodies are
  !> pinned depends on how they have turned.
  pure logical function are_pins_moved(scene, sizes)
    type(scene_t), intent(in) :: scene
    type(sizes_t), intent(in) :: sizes

    are_pins_moved = scene%finite_strain .and. sizes%motions > 0.0_wp
  end function are_pins_moved

  !> The costs in the table.
  subroutine describe_costs(scene, plan, sizes, file, memory, seconds)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(inout) :: plan
    type(sizes_t), intent(in) :: sizes
    type(file_size_t), intent(in) :: file
    real(wp), intent(in) :: memory           !! [bytes]
    type(seconds_t), intent(in) :: seconds   !! where the plan is analysed
    character(:), allocatable :: least, room, time

    least = 'more than '
    if (plan%is_analysed) least = ''
    if (plan%is_analysed .and. sizes%factor > 0.0_wp) call add_line(plan, 'factor', &
      merge(bound_about, bound_at_most, are_pins_moved(scene, sizes)), &
      to_text(sizes%factor/1.0e6_wp, 3)//' million entries, '// &
      to_text(sizes%flops/1.0e9_wp, 3)//' Gflop per factorisation')
    if (sizes%ranks > 1.0_wp .or. sizes%fraction_here < 1.0_wp) call add_line(plan, 'ranks', &
      bound_fixed, to_text(nint(sizes%ranks/sizes%fraction_here))//', '// &
      to_text(nint(sizes%ranks))//' of them on this machine, whose memory follows')
    room = least//bytes_in_words(memory)//left_in_words(plan%memory_left)
    call add_line(plan, 'memory', bound_about, room, 'about '//room)
    if (plan%is_analysed) then
      time = time_in_words(cpu_seconds() + total_seconds(seconds))//' of CPU time'
      call add_line(plan, 'time', bound_about, time//': factorise '// &
        time_in_words(seconds%prepare + seconds%factorise + seconds%condense)//', contact '// &
        time_in_words(seconds%contact)//', displacements '//time_in_words( &
        seconds%recover)//', write '//time_in_words(seconds%write), 'about '//time)
    end if
    call add_line(plan, 'file', bound_about, bytes_in_words(file%size)//', at most '// &
      bytes_in_words(file%most)//left_in_words(plan%disk_left))
  end subroutine describe_costs

  !> What the machine has left, where it says so.
  pure function left_in_words(left) result(words)
    integer(i8), intent(in) :: left !! [bytes]
    character(:), allocatable :: words

    words = ''
    if (left < huge(left)) words = ' ('//bytes_in_words(real(left, wp))//' free)'
  end function left_in_words

end module estimate_costs_mod
