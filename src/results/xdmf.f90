!> The XDMF sidecar: an XML text that shows a result file's increments to older readers.
!>
!> VTK before 9.3 reads the first increment of a temporal VTKHDF file only. Its XDMF readers take
!> the blocks of an increment out of the same datasets by hyperslabs. The reference to the result
!> file is relative: the two stay together.
module xdmf_mod
  use kinds_mod, only: wp, i8
  use cells_mod, only: cells, has_middles
  use errors_mod, only: error_t
  use text_mod, only: to_text, upper
  use dataset_kinds_mod, only: of_real, of_long, bytes_of
  use output_field_mod, only: field_t, block_shape, every_time
  use sidecar_mod, only: sidecar_t, sidecar_path, open_sidecar, write_line, close_sidecar
  implicit none
  private

  public :: write_xdmf, xdmf_path, mixed_topology, mixed_path

  character(*), parameter :: mixed_path = '/VTKHDF/MixedConnectivity'
  !! dataset with the nodes of elements of several cells, which VTKHDF does not know
  character, parameter :: mark = achar(1) !! in no text of a file of XML
  character(2), parameter :: component(6) = ['XX', 'YY', 'ZZ', 'XY', 'YZ', 'XZ'] !! of a tensor

  !> A part of an increment's XML that is the same in all, and what follows it.
  type :: piece_t
    character(:), allocatable :: text
    integer(i8) :: rows = -1 !! of a block, whose begin follows; -1: the time follows
  end type piece_t

contains

  !> The sidecar's path: NAME.xdmf for NAME.vtkhdf.
  pure function xdmf_path(result_path) result(path)
    character(*), intent(in) :: result_path
    character(:), allocatable :: path

    path = sidecar_path(result_path, '.xdmf')
  end function xdmf_path

  !> Write the sidecar of a result file.
  subroutine write_xdmf(result_path, time, fields, mesh_size, cell, error)
    character(*), intent(in) :: result_path
    real(wp), intent(in) :: time(:)        !! of each increment with fields
    type(field_t), intent(in) :: fields(:) !! in the file, over the nodes and the elements
    integer, intent(in) :: mesh_size(3)    !! nodes, elements, numbers of `mixed_topology`
    integer, intent(in) :: cell            !! of all elements, row of the table of cells; 0: several
    type(error_t), allocatable, intent(out) :: error
    character(:), allocatable :: source
    type(piece_t), allocatable :: pieces(:)
    type(sidecar_t) :: sidecar
    integer :: step

    source = escaped(result_path(index(result_path, '/', back=.true.) + 1:))
    call open_sidecar(xdmf_path(result_path), sidecar)
    call write_line(sidecar, '<?xml version="1.0" encoding="UTF-8"?>')
    call write_line(sidecar, '<Xdmf Version="2.0">')
    call write_line(sidecar, '<Domain>')
    call write_line(sidecar, '<Grid Name="'//source// &
      '" GridType="Collection" CollectionType="Temporal">')
    call split(increment(fields, size(time), source, mesh_size, cell), pieces)
    do step = 1, size(time)
      call write_line(sidecar, at_time(pieces, step, time(step)))
    end do
    call write_line(sidecar, '</Grid>')
    call write_line(sidecar, '</Domain>')
    call write_line(sidecar, '</Xdmf>')
    call close_sidecar(sidecar, error)
  end subroutine write_xdmf

  !> The XML of any increment, as of `split`.
  function increment(fields, n_steps, source, mesh_size, cell) result(xml)
    type(field_t), intent(in) :: fields(:)
    integer, intent(in) :: n_steps
    character(*), intent(in) :: source   !! name of the result file, escaped
    integer, intent(in) :: mesh_size(3)  !! as above
    integer, intent(in) :: cell
    character(:), allocatable :: xml
    character(:), allocatable :: list_of_nodes
    character(*), parameter :: end_of_line = new_line('a')
    integer :: i

    if (cell > 0) then
      list_of_nodes = item(to_text(mesh_size(2))//' '//to_text(cells(cell)%n_nodes), of_long, &
        source//':/VTKHDF/Connectivity')
    else
      list_of_nodes = item(to_text(mesh_size(3)), of_long, source//':'//mixed_path)
    end if
    xml = '<Grid Name="'//source//'" GridType="Uniform">'//end_of_line// &
      '<Time Value="'//mark//mark//'"/>'//end_of_line// &
      '<Topology TopologyType="'//topology(cell)//'" NumberOfElements="'// &
      to_text(mesh_size(2))//'">'//end_of_line//list_of_nodes//end_of_line// &
      '</Topology>'//end_of_line//'<Geometry GeometryType="XYZ">'//end_of_line// &
      item(to_text(mesh_size(1))//' 3', of_real, source//':/VTKHDF/Points')//end_of_line// &
      '</Geometry>'//end_of_line
    do i = 1, size(fields)
      xml = xml//attribute_element(fields(i), n_steps, source)//end_of_line
    end do
    xml = xml//'</Grid>'
  end function increment

  !> Tetrahedron, Pyramid, Wedge or Hexahedron: the last word of the cell's name; Tetrahedron_10 and
  !> the like where there are mid-side nodes; Mixed.
  pure function topology(cell) result(word)
    integer, intent(in) :: cell !! 0: there are several
    character(:), allocatable :: word

    word = 'Mixed'
    if (cell == 0) return
    word = trim(cells(cell)%name)
    word = word(index(word, ' ', back=.true.) + 1:)
    word(:1) = upper(word(:1))
    if (has_middles(cell)) word = word//'_'//to_text(cells(cell)%n_nodes)
  end function topology

  !> The nodes of all elements as XDMF counts them where cells differ: the number of each element's
  !> cell, its nodes, and so on.
  pure function mixed_topology(cell, nodes) result(numbers)
    integer, intent(in) :: cell(:)  !! (n_elements) row of the table of cells
    integer, intent(in) :: nodes(:) !! of all elements, element by element
    integer, allocatable :: numbers(:)
    integer :: e, n, first
    integer, parameter :: vtk(*) = [10, 14, 13, 12, 24, 27, 26, 25]
    integer, parameter :: xdmf(*) = [6, 7, 8, 9, 38, 39, 40, 48]

    allocate (numbers(size(cell) + size(nodes)))
    n = 0
    first = 1
    do e = 1, size(cell)
      associate (its => nodes(first:first + cells(cell(e))%n_nodes - 1))
        numbers(n + 1:n + 1 + size(its)) = [xdmf(findloc(vtk, cells(cell(e))%vtk_type, &
          dim=1)), its]
        n = n + 1 + size(its)
        first = first + size(its)
      end associate
    end do
  end function mixed_topology

  !> Cut an increment's XML where something follows that differs from one to the next. A mark, the
  !> rows of a block and a mark stand for where the block begins; two marks for the time.
  pure subroutine split(xml, pieces)
    character(*), intent(in) :: xml
    type(piece_t), allocatable, intent(out) :: pieces(:)
    type(piece_t) :: piece
    integer :: begin, first, last

    allocate (pieces(0))
    begin = 1
    do
      first = index(xml(begin:), mark)
      if (first == 0) exit
      first = begin + first - 1
      last = first + index(xml(first + 1:), mark)
      piece%text = xml(begin:first - 1)
      piece%rows = -1
      if (last > first + 1) read (xml(first + 1:last - 1), *) piece%rows
      pieces = [pieces, piece]
      begin = last + 1
    end do
    piece%text = xml(begin:)
    piece%rows = -1
    pieces = [pieces, piece]
  end subroutine split

  !> The XML of one increment.
  function at_time(pieces, step, time) result(xml)
    type(piece_t), intent(in) :: pieces(:)
    integer, intent(in) :: step
    real(wp), intent(in) :: time
    character(:), allocatable :: xml
    integer, parameter :: longest_number = 30
    character(:), allocatable :: room, number
    integer :: i, n, length

    length = longest_number*size(pieces)
    do i = 1, size(pieces)
      length = length + len(pieces(i)%text)
    end do
    allocate (character(length) :: room)
    n = 0
    do i = 1, size(pieces)
      call add(pieces(i)%text)
      if (i == size(pieces)) exit
      number = to_text((step - 1)*pieces(i)%rows)
      if (pieces(i)%rows < 0) number = to_text(time, 17)
      call add(number)
    end do
    xml = room(:n)

  contains

    subroutine add(text)
      character(*), intent(in) :: text

      room(n + 1:n + len(text)) = text
      n = n + len(text)
    end subroutine add

  end function at_time

  !> The XML of a field in an increment: its block of the dataset.
  !>
  !> Readers disagree about more than three components ("Tensor6" has an order of its own, "Matrix"
  !> is read in several ways), so a stress or strain becomes six scalars.
  function attribute_element(field, n_steps, source) result(xml)
    type(field_t), intent(in) :: field
    integer, intent(in) :: n_steps
    character(*), intent(in) :: source !! name of the result file, escaped
    character(:), allocatable :: xml, name
    integer :: i, n

    name = escaped(field%name(index(field%name, '/') + 1:))
    n = n_components(field)
    select case (n)
    case (1)
      xml = named_block(field, n_steps, source, name, 'Scalar', [0, n])
    case (3)
      xml = named_block(field, n_steps, source, name, 'Vector', [0, n])
    case default
      xml = ''
      do i = 1, n
        if (i > 1) xml = xml//new_line('a')
        xml = xml//named_block(field, n_steps, source, name//'_'//component(i), 'Scalar', &
          [i - 1, 1])
      end do
    end select
  end function attribute_element

  pure integer function n_components(field)
    type(field_t), intent(in) :: field
    integer :: n(2)

    n = block_shape(field)
    n_components = n(1)
  end function n_components

  !> One attribute of the XML: some components of a field's block. Blocks stand one behind the
  !> other; of what is not written every time there is one.
  function named_block(field, n_steps, source, name, shape_name, components) result(xml)
    type(field_t), intent(in) :: field
    integer, intent(in) :: n_steps
    character(*), intent(in) :: source, name, shape_name
    integer, intent(in) :: components(2) !! first, from 0, and how many
    character(:), allocatable :: xml, center, location, start, stride, count, all
    character(*), parameter :: end_of_line = new_line('a')
    integer :: rank, n(2)
    integer(i8) :: blocks

    rank = size(field%extents)
    n = block_shape(field)
    blocks = n_steps
    start = mark//to_text(n(2))//mark
    if (field%written /= every_time) then
      blocks = 1
      start = '0'
    end if
    stride = '1'
    count = to_text(n(2))
    all = to_text(blocks*n(2))
    if (rank > 1) then
      start = start//' '//to_text(components(1))
      stride = stride//' 1'
      count = count//' '//to_text(components(2))
      all = all//' '//to_text(n(1))
    end if
    center = 'Cell'
    if (index(field%name, 'PointData/') == 1) center = 'Node'
    location = source//':'//'/VTKHDF/'//escaped(field%name)
    xml = item(all, field%kind, location)
    if (all /= count) then
      ! Xdmf2 takes the two items within, and knows them by `Type`. Xdmf3 mixes up the order of
      ! extents in those, but not in the selection behind the location; it would go by `ItemType`.
      xml = '<DataItem Type="HyperSlab" Format="HDF" '//number_type(field%kind)// &
            ' Dimensions="'//count//'">'// &
            location//'|'//start//':'//stride//':'//count//':'//all//end_of_line// &
            '<DataItem Format="XML" NumberType="Int" Dimensions="3 '//to_text(rank)//'">'// &
            start//' '//stride//' '//count//'</DataItem>'//end_of_line// &
            xml//end_of_line//'</DataItem>'
    end if
    xml = '<Attribute Name="'//name//'" Center="'//center//'" AttributeType="'// &
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
    integer, intent(in) :: kind !! of_real, of_integer, of_long, of_byte, of_unsigned_byte
    character(:), allocatable :: xml
    character(*), parameter :: types(*) = [character(5) :: 'Float', 'Int', 'Int', 'Char', 'UChar']

    xml = 'NumberType="'//trim(types(kind))//'" Precision="'//to_text(bytes_of(kind))//'"'
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
