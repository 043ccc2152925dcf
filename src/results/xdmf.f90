!> The XDMF sidecar: an XML text that shows a result file's increments to older readers.
!>
!> VTK before 9.3 reads the first increment of a temporal VTKHDF file only. Its XDMF readers take
!> the blocks of an increment out of the same datasets by hyperslabs. The reference to the result
!> file is relative: the two stay together.
module xdmf_mod
  use kinds_mod, only: wp, i8
  use dataset_kinds_mod, only: of_real, of_integer, of_long, of_byte
  use errors_mod, only: error_t, raise, exit_machine
  use text_mod, only: string_t, to_text
  use hdf5_files_mod, only: hdf5_file_t, open_file, close_file, exists, list_members
  use hdf5_attributes_mod, only: read_attribute
  use hdf5_datasets_mod, only: dataset_extents, dataset_kind, read_dataset
  use fresh_file_mod, only: delete_file
  implicit none
  private

  public :: write_xdmf, xdmf_path

  character(2), parameter :: component(6) = ['XX', 'YY', 'ZZ', 'XY', 'YZ', 'XZ'] !! of a tensor

  !> A field as the XML has to know it.
  type :: attribute_t
    character(:), allocatable :: name, center, path
    integer :: kind = 0                     !! of_real, ...
    integer(i8) :: n = 0                    !! entries of a block: nodes or elements
    integer(i8) :: n_components = 1
    integer(i8), allocatable :: extents(:)  !! of the whole dataset, Fortran's way round
    integer(i8), allocatable :: offset(:)   !! (n_steps) where each block begins
  end type attribute_t

contains

  !> The sidecar's path: NAME.xdmf for NAME.vtkhdf.
  pure function xdmf_path(result_path) result(path)
    character(*), intent(in) :: result_path
    character(:), allocatable :: path
    character(*), parameter :: ending = '.vtkhdf'
    integer :: n

    n = len(result_path)
    if (n > len(ending)) then
      if (result_path(n - len(ending) + 1:) == ending) n = n - len(ending)
    end if
    path = result_path(:n)//'.xdmf'
  end function xdmf_path

  !> Write the sidecar of a result file that is complete and closed.
  subroutine write_xdmf(result_path, error)
    character(*), intent(in) :: result_path
    type(error_t), allocatable, intent(out) :: error
    type(hdf5_file_t) :: file
    type(attribute_t), allocatable :: attributes(:)
    real(wp), allocatable :: time(:)
    integer(i8), allocatable :: n_points(:), n_cells(:)
    integer(i8) :: n_steps

    call open_file(result_path, .false., file, error)
    if (allocated(error)) return
    call read_attribute(file, '/VTKHDF/Steps', 'NSteps', n_steps, error)
    call read_dataset(file, '/VTKHDF/Steps/Values', time, error)
    call read_dataset(file, '/VTKHDF/NumberOfPoints', n_points, error)
    call read_dataset(file, '/VTKHDF/NumberOfCells', n_cells, error)
    allocate (attributes(0))
    if (.not. allocated(error)) then
      call add_attributes(file, 'PointData', 'Node', n_points(1), attributes, error)
      call add_attributes(file, 'CellData', 'Cell', n_cells(1), attributes, error)
    end if
    call close_file(file, error)
    if (allocated(error)) return
    call write_xml(result_path, time(:n_steps), [n_points(1), n_cells(1)], attributes, error)
  end subroutine write_xdmf

  !> Add the fields of a group that have a place in time.
  !>
  !> Tensors at Gauss points stay out: no XDMF reader knows them, and as scalars they would be 48.
  subroutine add_attributes(file, group, center, n, attributes, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: group, center
    integer(i8), intent(in) :: n
    type(attribute_t), allocatable, intent(inout) :: attributes(:)
    type(error_t), allocatable, intent(inout) :: error
    type(string_t), allocatable :: names(:)
    type(attribute_t) :: attribute
    character(:), allocatable :: offsets
    integer :: i

    call list_members(file, '/VTKHDF/'//group, names, error)
    do i = 1, size(names)
      offsets = '/VTKHDF/Steps/'//group//'Offsets/'//names(i)%text
      if (.not. exists(file, offsets)) cycle
      attribute%name = names(i)%text
      attribute%center = center
      attribute%path = '/VTKHDF/'//group//'/'//names(i)%text
      attribute%kind = dataset_kind(file, attribute%path)
      attribute%n = n
      call dataset_extents(file, attribute%path, attribute%extents, error)
      call read_dataset(file, offsets, attribute%offset, error)
      if (allocated(error)) return
      attribute%n_components = 1
      if (size(attribute%extents) == 2) attribute%n_components = attribute%extents(1)
      if (attribute%n_components > size(component)) cycle
      attributes = [attributes, attribute]
    end do
  end subroutine add_attributes

  subroutine write_xml(result_path, time, mesh_size, attributes, error)
    character(*), intent(in) :: result_path
    real(wp), intent(in) :: time(:)
    integer(i8), intent(in) :: mesh_size(2) !! points, cells
    type(attribute_t), intent(in) :: attributes(:)
    type(error_t), allocatable, intent(out) :: error
    character(:), allocatable :: path, source
    character(200) :: reason
    integer :: unit, status, step, i, closed
    integer(i8) :: given, written

    path = xdmf_path(result_path)
    source = escaped(result_path(index(result_path, '/', back=.true.) + 1:))
    reason = ''
    given = 0
    open (newunit=unit, file=path, access='stream', form='formatted', action='write', &
          status='replace', iostat=status, iomsg=reason)
    if (status == 0) then
      call line('<?xml version="1.0" encoding="UTF-8"?>')
      call line('<Xdmf Version="2.0">')
      call line('<Domain>')
      call line('<Grid Name="'//source//'" GridType="Collection" CollectionType="Temporal">')
      do step = 1, size(time)
        call line('<Grid Name="'//source//'" GridType="Uniform">')
        call line('<Time Value="'//to_text(time(step), 17)//'"/>')
        call line('<Topology TopologyType="Hexahedron" NumberOfElements="'// &
                  to_text(mesh_size(2))//'">')
        call line(item(to_text(mesh_size(2))//' 8', of_long, source//':/VTKHDF/Connectivity'))
        call line('</Topology>')
        call line('<Geometry GeometryType="XYZ">')
        call line(item(to_text(mesh_size(1))//' 3', of_real, source//':/VTKHDF/Points'))
        call line('</Geometry>')
        do i = 1, size(attributes)
          call line(attribute_element(attributes(i), step, source))
        end do
        call line('</Grid>')
      end do
      call line('</Grid>')
      call line('</Domain>')
      call line('</Xdmf>')
      close (unit, iostat=closed)
      if (status == 0) status = closed
      ! The run-time library does not tell of a disk that is full at the end.
      inquire (file=path, size=written)
      if (status == 0 .and. written /= given) then
        status = 1
        reason = to_text(written)//' of '//to_text(given)//' bytes reached the disk'
      end if
      if (status /= 0) call delete_file(path)
    end if
    if (status /= 0) call raise(error, exit_machine, "cannot write '"//path//"': "//trim(reason))

  contains

    subroutine line(text)
      character(*), intent(in) :: text
      integer :: failure

      if (status /= 0) return
      write (unit, '(a)', iostat=failure, iomsg=reason) text
      if (failure /= 0) status = failure
      given = given + len(text) + 1
    end subroutine line

  end subroutine write_xml

  !> The XML of a field in an increment: its block of the dataset.
  !>
  !> Readers disagree about more than three components ("Tensor6" has an order of its own, "Matrix"
  !> is read in several ways), so a stress or strain becomes six scalars.
  function attribute_element(attribute, step, source) result(xml)
    type(attribute_t), intent(in) :: attribute
    integer, intent(in) :: step
    character(*), intent(in) :: source !! name of the result file, escaped
    character(:), allocatable :: xml, name
    integer :: i, n

    name = escaped(attribute%name)
    n = int(attribute%n_components)
    select case (n)
    case (1)
      xml = named_block(attribute, step, source, name, 'Scalar', [0, n])
    case (3)
      xml = named_block(attribute, step, source, name, 'Vector', [0, n])
    case default
      xml = ''
      do i = 1, n
        if (i > 1) xml = xml//new_line('a')
        xml = xml//named_block(attribute, step, source, &
                               name//'_'//component(i), 'Scalar', [i - 1, 1])
      end do
    end select
  end function attribute_element

  !> One attribute of the XML: some components of a field's block.
  function named_block(attribute, step, source, name, shape_name, components) result(xml)
    type(attribute_t), intent(in) :: attribute
    integer, intent(in) :: step
    character(*), intent(in) :: source, name, shape_name
    integer, intent(in) :: components(2) !! first, from 0, and how many
    character(:), allocatable :: xml, location, start, stride, count, all
    character(*), parameter :: end_of_line = new_line('a')
    integer :: rank

    rank = size(attribute%extents)
    start = to_text(attribute%offset(step))
    stride = '1'
    count = to_text(attribute%n)
    all = to_text(attribute%extents(rank))
    if (rank > 1) then
      start = start//' '//to_text(components(1))
      stride = stride//' 1'
      count = count//' '//to_text(components(2))
      all = all//' '//to_text(attribute%n_components)
    end if
    location = source//':'//escaped(attribute%path)
    xml = item(all, attribute%kind, location)
    if (all /= count) then
      ! Xdmf2 takes the two items within, and knows them by `Type`. Xdmf3 mixes up the order of
      ! extents in those, but not in the selection behind the location; it would go by `ItemType`.
      xml = '<DataItem Type="HyperSlab" Format="HDF" '//number_type(attribute%kind)// &
            ' Dimensions="'//count//'">'// &
            location//'|'//start//':'//stride//':'//count//':'//all//end_of_line// &
            '<DataItem Format="XML" NumberType="Int" Dimensions="3 '//to_text(rank)//'">'// &
            start//' '//stride//' '//count//'</DataItem>'//end_of_line// &
            xml//end_of_line//'</DataItem>'
    end if
    xml = '<Attribute Name="'//name//'" Center="'//attribute%center//'" AttributeType="'// &
          shape_name//'">'//end_of_line//xml//end_of_line//'</Attribute>'
  end function named_block

  !> A reference to a whole dataset.
  pure function item(extents, kind, location) result(xml)
    character(*), intent(in) :: extents  !! slowest first
    integer, intent(in) :: kind          !! of_real, ...
    character(*), intent(in) :: location !! file:path, escaped
    character(:), allocatable :: xml

    xml = '<DataItem Format="HDF" '//number_type(kind)//' Dimensions="'//extents//'">'// &
          location//'</DataItem>'
  end function item

  pure function number_type(kind) result(xml)
    integer, intent(in) :: kind !! of_real, ...
    character(:), allocatable :: xml

    select case (kind)
    case (of_real)
      xml = 'NumberType="Float" Precision="8"'
    case (of_long)
      xml = 'NumberType="Int" Precision="8"'
    case (of_integer)
      xml = 'NumberType="Int" Precision="4"'
    case (of_byte)
      xml = 'NumberType="Char" Precision="1"'
    case default
      xml = 'NumberType="UChar" Precision="1"'
    end select
  end function number_type

  !> `text` with the characters that mean something to XML written as entities.
  pure function escaped(text) result(xml)
    character(*), intent(in) :: text
    character(:), allocatable :: xml
    integer :: i

    xml = ''
    do i = 1, len(text)
      select case (text(i:i))
      case ('&')
        xml = xml//'&amp;'
      case ('<')
        xml = xml//'&lt;'
      case ('>')
        xml = xml//'&gt;'
      case ('"')
        xml = xml//'&quot;'
      case default
        xml = xml//text(i:i)
      end select
    end do
  end function escaped

end module xdmf_mod
