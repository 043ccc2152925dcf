!> The tables of *NODE PRINT and *EL PRINT beside a result, as text: NAME.node.csv and
!> NAME.element.csv.
!>
!> They are made from the result file when the run ends, so that a continued run has all of them.
module print_table_mod
  use kinds_mod, only: wp, i4, i8
  use errors_mod, only: error_t
  use text_mod, only: to_text
  use hdf5_files_mod, only: hdf5_file_t, exists
  use hdf5_datasets_mod, only: read_dataset
  use result_print_mod, only: print_rows_t
  use sidecar_mod, only: sidecar_t, sidecar_path, open_sidecar, write_line, close_sidecar
  implicit none
  private

  public :: node_table_path, element_table_path, write_print_tables

  !> A dataset as columns of a table.
  type :: column_t
    character(16) :: dataset
    character(30) :: title
    character(8)  :: quantity
    integer :: n = 1                   !! columns
    character(2) :: component(6) = ''
  end type column_t

  character(2), parameter :: xyz(6) = ['x ', 'y ', 'z ', '  ', '  ', '  ']
  character(2), parameter :: tensor(6) = ['XX', 'YY', 'ZZ', 'XY', 'YZ', 'XZ']
  character(2), parameter :: by_size(6) = ['1 ', '2 ', '3 ', '  ', '  ', '  ']
  character(2), parameter :: no_part(6) = ''

  type(column_t), parameter :: of_nodes(*) = [ &
    column_t('displacement', 'displacement', 'length', 3, xyz), &
    column_t('reaction_force', 'reaction force', 'force', 3, xyz), &
    column_t('applied_force', 'applied force', 'force', 3, xyz)]
  type(column_t), parameter :: of_elements(*) = [ &
    column_t('stress', 'stress', 'pressure', 6, tensor), &
    column_t('strain', 'strain', 'strain', 6, tensor), &
    column_t('von_mises', 'von Mises', 'pressure', 1, no_part), &
    column_t('principal_stress', 'principal stress', 'pressure', 3, by_size), &
    column_t('principal_strain', 'principal strain', 'strain', 3, by_size), &
    column_t('spring_force', 'spring force', 'force', 1, no_part), &
    column_t('elongation', 'elongation', 'length', 1, no_part)]

  !> The numbers of a dataset, row after row.
  type :: numbers_t
    real(wp), allocatable :: value(:) !! not allocated: there is none
  end type numbers_t

contains

  !> NAME.node.csv for NAME.vtkhdf.
  pure function node_table_path(result_path) result(path)
    character(*), intent(in) :: result_path
    character(:), allocatable :: path

    path = sidecar_path(result_path, '.node.csv')
  end function node_table_path

  !> NAME.element.csv for NAME.vtkhdf.
  pure function element_table_path(result_path) result(path)
    character(*), intent(in) :: result_path
    character(:), allocatable :: path

    path = sidecar_path(result_path, '.element.csv')
  end function element_table_path

  !> Write the tables that the deck asks for.
  subroutine write_print_tables(file, result_path, prints, n_rows, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: result_path
    type(print_rows_t), intent(in) :: prints(:)
    integer, intent(in) :: n_rows !! increments that are complete
    type(error_t), allocatable, intent(inout) :: error
    integer :: k

    if (allocated(error)) return
    associate (nodes => pack([(k, k=1, size(prints))], .not. prints%asked%of_elements), &
               elements => pack([(k, k=1, size(prints))], prints%asked%of_elements))
      if (size(nodes) > 0) call write_table(file, node_table_path(result_path), prints, nodes, &
        of_nodes, n_rows, error)
      if (size(elements) > 0) call write_table(file, element_table_path(result_path), prints, &
        elements, of_elements, n_rows, error)
    end associate
  end subroutine write_print_tables

  !> A table of one kind: one set after the other, in each one increment after the other.
  !>
  !> The sets by their numbers: gfortran 12 does not free the copies that it makes of a chosen few.
  subroutine write_table(file, path, prints, chosen, columns, n_rows, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: path
    type(print_rows_t), intent(in) :: prints(:)
    integer, intent(in) :: chosen(:) !! of `prints`, at least one
    type(column_t), intent(in) :: columns(:)
    integer, intent(in) :: n_rows
    type(error_t), allocatable, intent(inout) :: error
    type(sidecar_t) :: table
    logical :: is_there(size(columns))
    integer :: k, c

    if (allocated(error)) return
    is_there = .false.
    do k = 1, size(chosen)
      do c = 1, size(columns)
        associate (of => prints(chosen(k))%path, to => columns(c)%dataset)
          if (exists(file, of//'/'//trim(to))) is_there(c) = .true.
          if (exists(file, of//'/total_'//trim(to))) is_there(c) = .true.
        end associate
      end do
    end do
    call open_sidecar(path, table)
    call write_line(table, head_of(pack(columns, is_there), prints(chosen(1))%asked%of_elements))
    do k = 1, size(chosen)
      call write_set(file, prints(chosen(k)), pack(columns, is_there), n_rows, table, error)
    end do
    call close_sidecar(table, error)
  end subroutine write_table

  !> Names of the columns and what their numbers are.
  pure function head_of(columns, of_elements) result(head)
    type(column_t), intent(in) :: columns(:)
    logical, intent(in) :: of_elements
    character(:), allocatable :: head
    integer :: c, i

    head = 'step,increment,time [time],set,node'
    if (of_elements) head = 'step,increment,time [time],set,element,point'
    do c = 1, size(columns)
      do i = 1, columns(c)%n
        head = head//','//trim(trim(columns(c)%title)//' '//columns(c)%component(i))//' ['// &
          trim(columns(c)%quantity)//']'
      end do
    end do
  end function head_of

  !> The lines of a set: a place each, then all of it.
  subroutine write_set(file, of, columns, n_rows, table, error)
    type(hdf5_file_t), intent(in) :: file
    type(print_rows_t), intent(in) :: of
    type(column_t), intent(in) :: columns(:)
    integer, intent(in) :: n_rows
    type(sidecar_t), intent(inout) :: table
    type(error_t), allocatable, intent(inout) :: error
    type(numbers_t) :: each(size(columns)), total(size(columns))
    integer(i4), allocatable :: step(:), increment(:), is_due(:)
    integer(i8), allocatable :: id(:), of_element(:)
    real(wp), allocatable :: time(:)
    character(:), allocatable :: start
    integer :: row, place, n_points
    logical :: has_points

    call read_dataset(file, '/history/step', step, error)
    call read_dataset(file, '/history/increment', increment, error)
    call read_dataset(file, '/history/time', time, error)
    call read_dataset(file, of%path//'/is_due', is_due, error)
    call read_dataset(file, of%path//trim(merge('/element_id', '/node_id   ', &
      of%asked%of_elements)), id, error)
    call read_columns(file, of%path//'/', columns, each, error)
    call read_columns(file, of%path//'/total_', columns, total, error)
    has_points = of%asked%of_elements .and. of%asked%at_gauss_points
    allocate (of_element(0))
    if (has_points) call read_dataset(file, of%path//'/n_points', of_element, error)
    if (allocated(error)) return
    n_points = 1
    if (has_points) n_points = int(maxval(of_element))
    start = ''
    do row = 1, n_rows
      if (is_due(row) == 0) cycle
      start = start_of_line(step(row), increment(row), time(row), of%asked%set)
      do place = 1, merge(size(id)*n_points, 0, of%asked%each)
        if (has_points) then
          if (1 + modulo(place - 1, n_points) > of_element(1 + (place - 1)/n_points)) cycle
        end if
        call write_line(table, start//words_of_place(place)//numbers_of(each, (row - 1)* &
          size(id)*n_points + place))
      end do
      if (of%asked%totals) call write_line(table, start//'total'//numbers_of(total, row))
    end do

  contains

    !> The id of a node or element, and the number of the Gauss point.
    pure function words_of_place(place) result(words)
      integer, intent(in) :: place
      character(:), allocatable :: words

      words = to_text(int(id(1 + (place - 1)/n_points)))
      if (.not. of%asked%of_elements) return
      words = words//','
      if (has_points) words = words//to_text(1 + modulo(place - 1, n_points))
    end function words_of_place

    !> What stands at a place of the datasets; nothing where a set has none.
    pure function numbers_of(from, place) result(words)
      type(numbers_t), intent(in) :: from(:)
      integer, intent(in) :: place
      character(:), allocatable :: words
      character(200) :: buffer
      integer :: c

      words = ''
      do c = 1, size(columns)
        if (allocated(from(c)%value)) then
          write (buffer, '(*(:,",",g0))') from(c)%value((place - 1)*columns(c)%n + 1: &
            place*columns(c)%n)
          words = words//trim(buffer)
        else
          words = words//repeat(',', columns(c)%n)
        end if
      end do
    end function numbers_of

  end subroutine write_set

  !> The datasets of a set that are there.
  subroutine read_columns(file, prefix, columns, numbers, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: prefix !! of their paths
    type(column_t), intent(in) :: columns(:)
    type(numbers_t), intent(out) :: numbers(:)
    type(error_t), allocatable, intent(inout) :: error
    integer :: c

    do c = 1, size(columns)
      if (exists(file, prefix//trim(columns(c)%dataset))) call read_dataset(file, &
        prefix//trim(columns(c)%dataset), numbers(c)%value, error)
    end do
  end subroutine read_columns

  !> What the lines of an increment begin with.
  pure function start_of_line(step, increment, time, set) result(start)
    integer(i4), intent(in) :: step, increment
    real(wp), intent(in) :: time
    character(*), intent(in) :: set
    character(:), allocatable :: start
    character(100) :: buffer

    write (buffer, '(2(i0,","),g0)') step, increment, time
    start = trim(buffer)//',"'//set//'",'
  end function start_of_line

end module print_table_mod
