!> Meshes of a sequence: the finest that was run, the finest that the bounds allow.
module finest_mesh_mod
  use kinds_mod, only: wp
  use mesh_size_mod, only: mesh_size_t, relative_size
  use mesh_sequence_mod, only: mesh_sequence_t
  use foreseen_costs_mod, only: fits
  use finer_meshes_mod, only: next_finer, odd_finer
  implicit none
  private

  public :: find_run, find_finest, go_back

contains

  !> The finest mesh with a run of so many divisions, and how many such meshes there are.
  subroutine find_run(sequence, divisions, finest, n)
    type(mesh_sequence_t), intent(in) :: sequence
    integer, intent(in) :: divisions
    type(mesh_size_t), intent(out) :: finest
    integer, intent(out) :: n
    integer :: i

    n = 0
    finest = sequence%first
    do i = 1, size(sequence%runs)
      if (sequence%runs(i)%divisions /= divisions) cycle
      n = n + 1
      if (n == 1 .or. relative_size(sequence%runs(i)%mesh_size) < relative_size(finest)) then
        finest = sequence%runs(i)%mesh_size
      end if
    end do
  end subroutine find_run

  !> The finest mesh within the bounds that is finer than a given one.
  subroutine find_finest(sequence, from, divisions, room, part, finest, found)
    type(mesh_sequence_t), intent(in) :: sequence
    type(mesh_size_t), intent(in) :: from
    integer, intent(in) :: divisions
    real(wp), intent(in) :: room !! memory that it may take beside what the process has [bytes]
    real(wp), intent(in) :: part !! of the time that is left, that it may take [-]
    type(mesh_size_t), intent(out) :: finest
    logical, intent(out) :: found
    type(mesh_size_t) :: next
    integer, parameter :: farthest = 1000
    integer :: i

    found = .false.
    finest = from
    next = from
    do i = 1, farthest
      next = next_finer(sequence, next)
      if (.not. fits(sequence, next, divisions, room, part)) exit
      finest = next
      found = .true.
    end do
    if (found) return
    ! An odd number of elements is better than none more.
    next = odd_finer(sequence, from)
    found = fits(sequence, next, divisions, room, part)
    if (found) finest = next
  end subroutine find_finest

  !> The mesh before one, from a coarser one on; that one where there is none between.
  subroutine go_back(sequence, from, mesh_size)
    type(mesh_sequence_t), intent(in) :: sequence
    type(mesh_size_t), intent(in) :: from
    type(mesh_size_t), intent(inout) :: mesh_size
    type(mesh_size_t) :: next, found

    found = from
    next = next_finer(sequence, from)
    do while (relative_size(next) > relative_size(mesh_size))
      found = next
      next = next_finer(sequence, next)
    end do
    mesh_size = found
  end subroutine go_back

end module finest_mesh_mod
