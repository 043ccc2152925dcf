!> The group /state of a result file: what it takes to go on with the run.
!>
!> Two slots are written in turn, each in its own place, so that a program killed while it writes
!> one leaves the other. A slot says how many of its numbers count and what their sum of bits is; of
!> the slots whose numbers agree with that, and whose increment is counted, the later one holds.
!> What the numbers mean is the writer's affair.
module result_state_mod
  use kinds_mod, only: wp, i8
  use errors_mod, only: error_t, raise, exit_wrong_input
  use text_mod, only: to_text
  use hdf5_files_mod, only: hdf5_file_t, exists
  use hdf5_attributes_mod, only: write_attributes, read_attribute, describe_group
  use hdf5_datasets_mod, only: dataset_extents, read_dataset
  use hdf5_store_mod, only: create_store, write_store
  implicit none
  private

  public :: slots_t, create_state, write_state, read_state

  integer, parameter :: n_slots = 2

  !> Which slot is the next to be written: never the one that holds.
  type :: slots_t
    private
    integer :: next = 1
  end type slots_t

contains

  !> Make the group, with nothing to go on from.
  subroutine create_state(file, room, error)
    type(hdf5_file_t), intent(in) :: file
    integer, intent(in) :: room !! numbers that a state has, about
    type(error_t), allocatable, intent(inout) :: error
    integer :: i

    call describe_group(file, '/state', 'what it takes to continue the run, in two slots of '// &
                        'which the later one holds', error)
    do i = 1, n_slots
      call create_store(file, slot(i), room, 'a state, for the program that wrote it', 'number', &
                        error)
      ! So that all that the slot is made of is there before anybody may need it.
      call write_store(file, slot(i), [0.0_wp], error)
      call label(file, i, 0, -1, 0_i8, error)
    end do
  end subroutine create_state

  !> Write the numbers of a state. They hold when the file is flushed; till then those before do.
  subroutine write_state(file, row, numbers, slots, error)
    type(hdf5_file_t), intent(in) :: file
    integer, intent(in) :: row          !! increment of the run that the state is the end of
    real(wp), intent(in) :: numbers(:)
    type(slots_t), intent(inout) :: slots
    type(error_t), allocatable, intent(inout) :: error

    call write_store(file, slot(slots%next), numbers, error)
    call label(file, slots%next, size(numbers), row, sum_of_bits(row, numbers), error)
    slots%next = 1 + mod(slots%next, n_slots)
  end subroutine write_state

  !> Read the latest state that is whole, of an increment that is counted.
  subroutine read_state(file, n_rows, slots, numbers, error, of_row)
    type(hdf5_file_t), intent(in) :: file
    integer(i8), intent(in) :: n_rows !! increments that are counted
    type(slots_t), intent(out) :: slots
    real(wp), allocatable, intent(out) :: numbers(:)
    type(error_t), allocatable, intent(inout) :: error !! there is none
    integer, intent(out), optional :: of_row !! the increment that it is the end of
    type(error_t), allocatable :: failure
    real(wp), allocatable :: found(:)
    integer(i8), allocatable :: extents(:)
    integer(i8) :: row, length, bits, latest, file_bytes
    integer :: i

    allocate (numbers(0))
    if (present(of_row)) of_row = -1
    if (allocated(error)) return
    latest = -1
    inquire (file=file%path, size=file_bytes)
    do i = 1, n_slots
      if (.not. exists(file, slot(i))) cycle
      if (allocated(failure)) deallocate (failure)
      call read_attribute(file, slot(i), 'row', row, failure)
      call read_attribute(file, slot(i), 'length', length, failure)
      call read_attribute(file, slot(i), 'bits', bits, failure)
      call dataset_extents(file, slot(i), extents, failure)
      if (.not. allocated(failure)) then
        ! Never to be written to again.
        if (any(extents < 0 .or. extents > file_bytes/8)) call raise(error, exit_wrong_input, &
          "'"//file%path//"' is damaged: /state has more numbers than the file has room for")
        if (allocated(error)) return
      end if
      call read_dataset(file, slot(i), found, failure)
      if (allocated(failure)) cycle
      if (length < 1 .or. length > size(found) .or. row <= latest .or. row > n_rows) cycle
      if (row > huge(1)) cycle
      if (sum_of_bits(int(row), found(:length)) /= bits) cycle
      latest = row
      numbers = found(:length)
      slots%next = 1 + mod(i, n_slots)
    end do
    if (present(of_row)) of_row = int(latest)
    if (latest < 0) call raise(error, exit_wrong_input, "'"//file%path// &
      "' holds no state to continue from: /state is missing or damaged")
  end subroutine read_state

  pure function slot(i) result(path)
    integer, intent(in) :: i
    character(:), allocatable :: path

    path = '/state/slot_'//to_text(i)
  end function slot

  !> Say what a slot holds.
  subroutine label(file, i, length, row, bits, error)
    type(hdf5_file_t), intent(in) :: file
    integer, intent(in) :: i, length, row
    integer(i8), intent(in) :: bits
    type(error_t), allocatable, intent(inout) :: error

    call write_attributes(file, slot(i), [character(6) :: 'row', 'length', 'bits'], &
      [int(row, i8), int(length, i8), bits], error)
  end subroutine label

  !> A number that changes with every bit of the numbers, with their order and with the increment.
  pure integer(i8) function sum_of_bits(row, numbers) result(bits)
    integer, intent(in) :: row
    real(wp), intent(in) :: numbers(:)
    integer :: i

    bits = ieor(ishft(int(row, i8), 32), size(numbers, kind=i8))
    do i = 1, size(numbers)
      bits = ieor(ishftc(bits, 5), transfer(numbers(i), bits))
    end do
  end function sum_of_bits

end module result_state_mod
