!> The table at the end of a run: what came of its contact pairs.
module print_summary_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t
  use text_mod, only: string_t
  use scene_mod, only: scene_t
  use measured_quantities_mod, only: error_scales
  use mesh_sequence_mod, only: mesh_sequence_t
  use sequence_error_mod, only: sequence_error_t, estimate_sequence, total_error
  use result_contact_mod, only: groups_of_pairs
  use pair_summary_mod, only: summarize_pairs, of_normal, of_friction, of_pressure, of_slip, &
    n_errors
  use console_mod, only: console_t, print_lines
  implicit none
  private

  public :: print_summary

contains

  !> Print the table of a result, unless quiet; nothing where the file cannot be read, as the run
  !> itself is done.
  subroutine print_summary(path, scene, console, sequence)
    character(*), intent(in) :: path
    type(scene_t), intent(in) :: scene
    type(console_t), intent(in) :: console
    type(mesh_sequence_t), intent(in), optional :: sequence !! of runs, the last of which it is
    real(wp), allocatable :: errors(:, :)
    type(string_t), allocatable :: groups(:), lines(:)
    type(error_t), allocatable :: ignored

    if (console%quiet) return
    groups = groups_of_pairs(scene)
    allocate (errors(n_errors, size(groups)), source=-1.0_wp)
    ! Of means in time nothing follows for the end of a dynamic *STEP.
    if (present(sequence) .and. .not. any(scene%steps%is_dynamic)) call find_errors(sequence, &
      errors)
    call summarize_pairs(path, groups, errors, lines, ignored)
    if (.not. allocated(ignored)) call print_lines(console, lines)
  end subroutine print_summary

  !> What the runs of a sequence say of the errors of the last one: of each quantity that is
  !> compared what they say of the worst, so that there is one answer.
  subroutine find_errors(sequence, errors)
    type(mesh_sequence_t), intent(in) :: sequence
    real(wp), intent(inout) :: errors(:, :) !! (n_errors,n_pairs) untouched where not known
    type(sequence_error_t) :: of_run
    real(wp) :: scales(size(sequence%list)), total
    integer :: k

    if (size(sequence%runs) == 0) return
    call estimate_sequence(sequence, of_run)
    if (.not. allocated(of_run%of_mesh) .or. of_run%mesh < 0.0_wp) return
    if (sequence%remembers .and. of_run%load_steps < 0.0_wp) return
    ! What is said of extrapolated values is not said of the result.
    if (sequence%extrapolates) return
    total = total_error(of_run)
    scales = error_scales(sequence%list, sequence%runs(size(sequence%runs))%values)
    do k = 1, size(sequence%list)
      associate (quantity => sequence%list(k))
        if (quantity%pair == 0 .or. .not. quantity%is_compared) cycle
        select case (quantity%name(index(quantity%name, '/', back=.true.) + 1:))
        case ('normal_force')
          errors(of_normal, quantity%pair) = total*scales(k)
        case ('friction_force')
          errors(of_friction, quantity%pair) = total*scales(k)
        case ('largest_pressure')
          errors(of_pressure, quantity%pair) = total*scales(k)
        case ('largest_slip')
          errors(of_slip, quantity%pair) = total*scales(k)
        case default
          continue
        end select
      end associate
    end do
  end subroutine find_errors

end module print_summary_mod
