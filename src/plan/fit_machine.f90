!> Whether a planned run fits the machine, and what would fit if it does not.
module fit_machine_mod
  use kinds_mod, only: wp
  use text_mod, only: to_text
  use controls_mod, only: accuracy_controls_t
  use scene_mod, only: scene_t
  use plan_mod, only: plan_t, figure_of
  use alternatives_mod, only: where_in_words
  use amounts_mod, only: bytes_in_words, time_in_words
  implicit none
  private

  public :: exceeds_machine, exceeds_time

contains

  !> Why the run does not fit, a sentence a line; empty where it does.
  function exceeds_machine(scene, plan) result(text)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan !! with its costs
    character(:), allocatable :: text

    text = ''
    if (plan%more_memory > real(plan%memory_left, wp)) text = memory_misfit(scene%accuracy, plan)
    if (plan%file_size + plan%scratch_size > real(plan%disk_left, wp)) then
      if (text /= '') text = text//new_line('a')
      text = text//disk_misfit(scene, plan)
    end if
  end function exceeds_machine

  !> Why the run takes more than the time allowed; empty where it does not, or none is.
  function exceeds_time(accuracy, plan) result(text)
    type(accuracy_controls_t), intent(in) :: accuracy
    type(plan_t), intent(in) :: plan !! with its costs
    character(:), allocatable :: text
    real(wp), parameter :: growth = 4.0_wp !! of the time, as elements get smaller
    real(wp) :: seconds

    text = ''
    if (accuracy%time <= 0.0_wp) return
    seconds = figure_of(plan, 'cpu_seconds')
    if (seconds <= accuracy%time) return
    text = 'the run takes about '//time_in_words(seconds)//' of CPU time, and --time '// &
      'allows '//time_in_words(accuracy%time)
    if (accuracy%keeps_mesh) then
      text = text//'; elements '//to_text((seconds/accuracy%time)**(1.0_wp/growth), 3)// &
        ' times as large would do'
    else
      text = text//'; there is no coarser mesh'
    end if
  end function exceeds_time

  !> Memory. Of a mesh refined s times in every direction the factor grows as s^4, as the square of
  !> the contact nodes does; the equations as s^3.
  function memory_misfit(accuracy, plan) result(text)
    type(accuracy_controls_t), intent(in) :: accuracy
    type(plan_t), intent(in) :: plan
    character(:), allocatable :: text
    real(wp), parameter :: fixed = 47.0e6_wp !! of the libraries, whatever the mesh [bytes]
    real(wp) :: coarser, left, peak

    text = 'the run needs about '
    if (.not. plan%is_analysed) text = 'the run needs more than '
    peak = figure_of(plan, 'peak_memory_bytes')
    if (accuracy%memory > 0.0_wp .and. peak > accuracy%memory) then
      text = text//bytes_in_words(peak)//' of memory, and --memory allows '// &
        bytes_in_words(accuracy%memory)
    else
      text = text//bytes_in_words(plan%more_memory)//' of memory, and '// &
        bytes_in_words(real(plan%memory_left, wp))//' are free'
    end if
    if (plan%choices%precision%single_factor .or. plan%choices%precision%out_of_core) text = &
      text//' (with the factor in '//where_in_words(plan%choices%precision)//')'
    left = real(plan%memory_left, wp) - fixed
    if (left < 1.0_wp .or. .not. plan%is_analysed) return
    coarser = max(1.0_wp, ((plan%more_memory - fixed)/left)**0.25_wp)
    text = text//'; elements '//to_text(1.05_wp*coarser, 3)//' times as large would fit (about '// &
      to_text(nint(real(plan%n_equations, wp)/(1.05_wp*coarser)**3))//' equations instead of '// &
      to_text(plan%n_equations)//')'
  end function memory_misfit

  !> Disk: fewer increments with fields, where that is enough.
  pure function disk_misfit(scene, plan) result(text)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    character(:), allocatable :: text
    real(wp) :: left, fraction

    text = 'the result file takes about '//bytes_in_words(plan%file_size)
    if (plan%scratch_size > 0.0_wp) text = text//', the factor out of core '// &
      bytes_in_words(plan%scratch_size)//','
    text = text//' and '//bytes_in_words(real(plan%disk_left, wp))//' are free on that disk'
    left = real(plan%disk_left, wp) - (plan%file_size - plan%fields_size) - plan%scratch_size
    if (plan%fields_size <= 0.0_wp .or. plan%n_outputs <= size(scene%steps)) return
    ! The last increment of every step has its fields whatever the frequency.
    fraction = left/plan%fields_size - real(size(scene%steps), wp)/real(plan%n_outputs, wp)
    if (fraction <= 0.0_wp) return
    text = text//'; with *NODE FILE, FREQUENCY='//to_text(ceiling( &
      real(scene%output%frequency, wp)/fraction))//' it would fit'
  end function disk_misfit

end module fit_machine_mod
