!> The plan: what exists in this run, decided from the scene before any number is computed.
module plan_mod
  use kinds_mod, only: wp, i8
  use contact_points_mod, only: contact_points_t
  use choices_mod, only: choices_t
  use text_mod, only: string_t, to_text
  implicit none
  private

  public :: plan_t, figure_t, bound_fixed, bound_at_most, bound_about, bound_in_words, &
    add_figure, change_figure, figure_of, find_breaches

  integer, parameter :: bound_fixed = 1   !! the run does exactly this
  integer, parameter :: bound_at_most = 2 !! the run stays below
  integer, parameter :: bound_about = 3   !! an estimate that binds nothing

  !> A number of the plan, under the name by which the run counts what it did.
  type :: figure_t
    character(:), allocatable :: name
    real(wp) :: value = 0.0_wp
    integer :: bound = bound_about
  end type figure_t

  !> What a run will do. Lower layers never see it: they get arguments.
  type :: plan_t
    type(choices_t) :: choices                !! with which the run begins
    type(contact_points_t) :: points          !! candidate contact points
    integer, allocatable :: rows(:)           !! (n_points) contact rows of each point, at most
    integer :: n_increments = 0               !! increments of the whole run
    integer :: n_fewest = 0                   !! those that it has if they grow as fast as they may
    integer :: n_events = 0
    !! increments at most that end at events of the load path, beside the deck's
    integer :: n_cuts = 0
    !! and more by cutting those in which an obstacle would turn too far, or as an accuracy wants it
    integer :: n_outputs = 0                  !! of them, those whose fields are written
    integer :: n_equations = 0                !! free degrees of freedom, of all steps the most
    integer :: n_interface = 0                !! of them, on contact nodes
    integer, allocatable :: blocks(:)
    !! orders of the blocks of the compliance, one a body, of the step where they have most entries
    integer :: n_factorisations = 0 !! one, and one more whenever other dofs are prescribed
    integer :: n_tangents = 0       !! beside them, where each iteration has its own
    logical :: is_constant = .true. !! every step has the same degrees of freedom
    logical :: is_analysed = .false.     !! its costs are known, not only the least they can be
    real(wp) :: more_memory = 0.0_wp     !! beside what the process has already [bytes]
    integer(i8) :: memory_left = huge(1_i8) !! on this machine, before the run [bytes]
    real(wp) :: seconds = 0.0_wp         !! of the processor, from the plan on [s]
    real(wp) :: start_seconds = 0.0_wp   !! of it, however many increments there are [s]
    logical :: may_follow_theory = .false.
    !! a run at finite strain beside this one is cheap, should small strain be far off
    real(wp) :: file_size = 0.0_wp       !! of the result, at its end [bytes]
    real(wp) :: fields_size = 0.0_wp     !! of it, the fields of all increments [bytes]
    real(wp) :: scratch_size = 0.0_wp    !! of a factor out of core, beside it [bytes]
    integer(i8) :: disk_left = huge(1_i8) !! where the result goes [bytes]
    type(figure_t), allocatable :: figures(:) !! what the run is held against
    type(string_t), allocatable :: lines(:)   !! the table, as stored and as --plan prints it
    type(string_t), allocatable :: brief(:)   !! of it what every run prints
    type(string_t), allocatable :: notes(:)   !! of the contact, one sentence each
  end type plan_t

contains

  !> Add a number to the plan.
  subroutine add_figure(plan, name, value, bound)
    type(plan_t), intent(inout) :: plan
    character(*), intent(in) :: name
    real(wp), intent(in) :: value
    integer, intent(in) :: bound !! bound_fixed, bound_at_most or bound_about
    type(figure_t) :: figure

    if (.not. allocated(plan%figures)) allocate (plan%figures(0))
    figure%name = name
    figure%value = value
    figure%bound = bound
    plan%figures = [plan%figures, figure]
  end subroutine add_figure

  !> Give a number of the plan another value.
  pure subroutine change_figure(plan, name, value)
    type(plan_t), intent(inout) :: plan
    character(*), intent(in) :: name  !! one that was added
    real(wp), intent(in) :: value
    integer :: i

    do i = 1, size(plan%figures)
      if (plan%figures(i)%name == name) plan%figures(i)%value = value
    end do
  end subroutine change_figure

  !> The number of the plan of that name; 0 where there is none.
  pure real(wp) function figure_of(plan, name) result(value)
    type(plan_t), intent(in) :: plan
    character(*), intent(in) :: name
    integer :: i

    value = 0.0_wp
    if (.not. allocated(plan%figures)) return
    do i = 1, size(plan%figures)
      if (plan%figures(i)%name == name) value = plan%figures(i)%value
    end do
  end function figure_of

  !> How a number of the plan is meant.
  pure function bound_in_words(bound) result(words)
    integer, intent(in) :: bound
    character(:), allocatable :: words

    select case (bound)
    case (bound_fixed)
      words = 'fixed'
    case (bound_at_most)
      words = 'at most'
    case default
      words = 'about'
    end select
  end function bound_in_words

  !> What a run did otherwise than planned, a sentence each.
  function find_breaches(plan, names, counters) result(breaches)
    type(plan_t), intent(in) :: plan
    type(string_t), intent(in) :: names(:) !! (n) of the counters
    real(wp), intent(in) :: counters(:)    !! (n)
    type(string_t), allocatable :: breaches(:)
    type(string_t) :: breach ! by a name: gfortran does not free one made in the list
    integer :: i, j

    allocate (breaches(0))
    if (.not. allocated(plan%figures)) return
    do j = 1, size(names)
      do i = 1, size(plan%figures)
        associate (figure => plan%figures(i))
          if (figure%name /= names(j)%text) cycle
          if (figure%bound == bound_about .or. counters(j) <= figure%value) then
            if (figure%bound /= bound_fixed .or. counters(j) >= figure%value) cycle
          end if
          breach%text = 'the plan said '//figure%name//' '//bound_in_words(figure%bound)//' '// &
            to_text(figure%value, 12)//', it was '//to_text(counters(j), 12)
          breaches = [breaches, breach]
        end associate
      end do
    end do
  end function find_breaches

end module plan_mod
