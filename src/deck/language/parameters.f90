!> The table of a deck's parameters, with what the command line says in their place.
module parameters_mod
  use kinds_mod, only: wp
  use text_mod, only: upper
  implicit none
  private

  public :: parameter_t, parameter_table_t, add_parameter, find_parameter, find_override
  public :: add_override, is_name_start, is_name_part, max_parameters

  integer, parameter :: max_parameters = 1000 !! lists are searched from end to end

  !> One `name = value`.
  type :: parameter_t
    character(:), allocatable :: name  !! upper case
    character(:), allocatable :: text  !! what `<name>` puts in
    logical  :: is_number = .false.
    real(wp) :: number = 0.0_wp
    integer  :: position = 0           !! place of its definition
    logical  :: used = .false.
  end type parameter_t

  !> One `name=value` of the command line.
  type :: override_t
    character(:), allocatable :: name  !! upper case
    character(:), allocatable :: value
  end type override_t

  type :: parameter_table_t
    type(parameter_t), allocatable :: list(:)
    integer :: n = 0
    type(override_t), allocatable :: overrides(:)
    integer :: n_overrides = 0
  end type parameter_table_t

contains

  !> Add a parameter with its value; the table must hold fewer than max_parameters.
  subroutine add_parameter(table, name, position, text)
    type(parameter_table_t), intent(inout) :: table
    character(*), intent(in) :: name     !! upper case
    integer, intent(in) :: position
    character(*), intent(in) :: text

    if (.not. allocated(table%list)) allocate (table%list(max_parameters))
    table%n = table%n + 1
    table%list(table%n)%name = name
    table%list(table%n)%position = position
    table%list(table%n)%text = text
  end subroutine add_parameter

  !> The parameter `name`: its index, 0 when there is none.
  pure integer function find_parameter(table, name) result(found)
    type(parameter_table_t), intent(in) :: table
    character(*), intent(in) :: name !! upper case

    do found = table%n, 1, -1
      if (table%list(found)%name == name) return
    end do
  end function find_parameter

  !> Take `name=value` from the command line; of one name the last counts.
  subroutine add_override(table, text, ok)
    type(parameter_table_t), intent(inout) :: table
    character(*), intent(in) :: text
    logical, intent(out) :: ok !! false: not of the form name=value, or too many
    character(:), allocatable :: name
    integer :: equal, i, found

    equal = index(text, '=')
    ok = equal > 1 .and. table%n_overrides < max_parameters
    if (.not. ok) return
    name = trim(adjustl(upper(text(:equal - 1))))
    ok = len_trim(text(equal + 1:)) > 0 .and. len(name) > 0
    if (ok) ok = is_name_start(name(1:1))
    do i = 1, len(name)
      ok = ok .and. is_name_part(name(i:i))
    end do
    if (.not. ok) return
    if (.not. allocated(table%overrides)) allocate (table%overrides(max_parameters))
    found = find_override(table, name)
    if (found == 0) then
      table%n_overrides = table%n_overrides + 1
      found = table%n_overrides
    end if
    table%overrides(found)%name = name
    table%overrides(found)%value = trim(adjustl(text(equal + 1:)))
  end subroutine add_override

  !> The override of `name`: its index, 0 when there is none.
  pure integer function find_override(table, name) result(found)
    type(parameter_table_t), intent(in) :: table
    character(*), intent(in) :: name !! upper case

    do found = table%n_overrides, 1, -1
      if (table%overrides(found)%name == name) return
    end do
  end function find_override

  !> Whether a name may begin with this letter.
  pure logical function is_name_start(letter) result(may)
    character, intent(in) :: letter

    may = (letter >= 'A' .and. letter <= 'Z') .or. (letter >= 'a' .and. letter <= 'z') &
      .or. letter == '_'
  end function is_name_start

  !> Whether a name may go on with this letter.
  pure logical function is_name_part(letter) result(may)
    character, intent(in) :: letter

    may = is_name_start(letter) .or. (letter >= '0' .and. letter <= '9')
  end function is_name_part

end module parameters_mod
