!> How many threads of the linear algebra library factorise the stiffness.
!>
!> One is the default: on a busy machine more take up to twice as long. Where the factorisation is
!> worth it, processors that stand idle take part; in nothing else, so that no more than seconds
!> depend on their staying idle.
module choose_threads_mod
  use kinds_mod, only: wp
  use text_mod, only: to_text
  use resource_limits_mod, only: address_space_left, data_left, no_limit
  use idle_processors_mod, only: processor_time_t, processor_time, idle_processors
  use blas_core_mod, only: threads_are_given
  use parallel_mod, only: n_ranks
  use plan_mod, only: plan_t, figure_of, bound_fixed
  use plan_table_mod, only: add_line
  implicit none
  private

  public :: choose_threads

  real(wp), parameter :: long_enough = 3.0_wp !! of a processor, the whole run [s]
  integer, parameter :: most_threads = 8
  real(wp), parameter :: of_thread = 50.0e6_wp !! memory of one more [bytes]

contains

  !> Choose the threads of a run that begins, and say so in its table.
  !>
  !> Not where the environment says how many, several ranks share the machine, or a limit on
  !> addresses could keep the library from its buffers, for which it would wait for ever.
  subroutine choose_threads(began, plan)
    type(processor_time_t), intent(in) :: began !! when the program did
    type(plan_t), intent(inout) :: plan         !! with its costs; chooses
    integer :: idle

    plan%choices%precision%threads = 1
    if (figure_of(plan, 'cpu_seconds') < long_enough) return
    if (threads_are_given()) return
    if (n_ranks() > 1) return
    if (min(address_space_left(''), data_left('')) < no_limit) return
    idle = min(idle_processors(began, processor_time()), most_threads - 1)
    if (idle < 1) return
    if (plan%more_memory + idle*of_thread > real(plan%memory_left, wp)) return
    plan%choices%precision%threads = 1 + idle
    call add_line(plan, 'threads', bound_fixed, to_text(1 + idle)// &
      ' while the stiffness is factorised: so many processors are idle')
  end subroutine choose_threads

end module choose_threads_mod
