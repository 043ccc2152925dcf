!> The compliance of a contact problem that is known by its products alone, formed as an array by
!> as many solutions as it has rows, for solvers that read it.
module formed_compliance_mod
  use kinds_mod, only: wp, i8
  use resource_limits_mod, only: has_memory
  use compliance_mod, only: compliance_t, take_matrix, get_matrix, is_map
  use problem_mod, only: contact_problem_t, make_problem, copy_laws
  use floating_mod, only: free_the_motions
  use condensed_contact_mod, only: contact_group_t
  implicit none
  private

  public :: form_compliance, form_floating, dense_bytes

contains

  !> The problem of a group whose W is known by its products, with W as an array: what sweeps and
  !> files need, as many solutions as it has rows.
  subroutine form_compliance(problem, dense, formed)
    type(contact_problem_t), intent(in) :: problem
    type(contact_problem_t), intent(out) :: dense
    logical, intent(out) :: formed !! false: there is no memory for it
    real(wp), allocatable :: w(:, :)
    integer :: i

    formed = has_memory(dense_bytes(problem%n_rows))
    if (.not. formed) return
    allocate (w(problem%n_rows, problem%n_rows))
    call get_matrix(problem%compliance, w)
    call make_problem(problem%row, problem%mu, w, dense)
    call copy_laws(problem, [(i, i=1, problem%n_points)], dense)
  end subroutine form_compliance

  !> The problem of a group that was solved together with the displacements, with its compliance as
  !> an array and without pins, as it would be with a factor.
  subroutine form_floating(group, formed)
    type(contact_group_t), intent(inout) :: group
    logical, intent(out) :: formed !! false: there is no memory for it
    type(contact_problem_t) :: dense
    type(compliance_t) :: compliance
    real(wp), allocatable :: w(:, :), g(:, :)
    integer :: i

    formed = .not. is_map(group%problem%compliance) ! by an increment before
    if (formed) return
    formed = has_memory(dense_bytes(group%problem%n_rows))
    if (.not. formed) return
    allocate (w(group%problem%n_rows, group%problem%n_rows))
    call get_matrix(group%problem%compliance, w)
    call take_matrix(w, compliance)
    g = group%floating%g
    call free_the_motions(g, group%undeformed_g, compliance, group%floating)
    call make_problem(group%problem%row, group%problem%mu, compliance, dense)
    call copy_laws(group%problem, [(i, i=1, dense%n_points)], dense)
    group%problem = dense
  end subroutine form_floating

  !> What W as an array takes, with its copy in single precision and its inverse.
  pure integer(i8) function dense_bytes(n_rows)
    integer, intent(in) :: n_rows

    dense_bytes = int(20.0_wp*real(n_rows, wp)**2, i8)
  end function dense_bytes

end module formed_compliance_mod
