!> A line on the terminal that is written over while an increment is under way.
module progress_line_mod
  use kinds_mod, only: wp
  use text_mod, only: to_text
  use standard_streams_mod, only: write_to, standard_output
  implicit none
  private

  public :: show_progress, wipe_line

  character(*), parameter :: wipe_line = achar(13)//achar(27)//'[K'

contains

  !> Write over the last line of the terminal, as
  !> 'first increment: contact iteration 7, residual 1.2E-04'.
  subroutine show_progress(what, iteration, residual)
    character(*), intent(in) :: what      !! that iterates
    integer, intent(in) :: iteration
    real(wp), intent(in) :: residual      !! [-]
    character(8) :: digits

    write (digits, '(es8.1)') residual
    call write_to(standard_output, wipe_line//'first increment: '//what//' '//to_text(iteration)// &
      ', residual '//trim(adjustl(digits)))
  end subroutine show_progress

end module progress_line_mod
