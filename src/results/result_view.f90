!> The group /VTKHDF of a result file: what ParaView and PyVista show.
!>
!> The mesh is stored once; every increment with fields adds a block to each of them. The tables in
!> Steps say where its blocks begin, which is known before: they are filled for many increments at
!> once, and cut at the end. A reader finds an increment only when it is counted (`count_steps`),
!> after all of it is on disk.
module result_view_mod
  use kinds_mod, only: wp, i1, i8
  use errors_mod, only: error_t
  use cells_mod, only: cells
  use mesh_mod, only: mesh_t, element_rows
  use scene_mod, only: scene_t
  use dataset_kinds_mod, only: of_long
  use output_field_mod, only: field_t, field_source_t, every_time, at_start
  use view_fields_mod, only: list_view_fields
  use hdf5_files_mod, only: hdf5_file_t, create_group, exists, flush_file
  use hdf5_attributes_mod, only: write_attribute, write_and_flush
  use hdf5_datasets_mod, only: write_dataset
  use hdf5_rows_mod, only: rows_t, create_rows, create_list, keep_rows, cut_rows, append_list, &
    append_and_flush, add_checksum
  use xdmf_mod, only: mixed_path, mixed_topology
  use result_fields_mod, only: open_field_t, open_blocks, append_fields, write_at_start
  implicit none
  private

  public :: view_t, create_view, append_step, count_steps, finish_view

  integer, parameter :: filled_at_once = 64 !! entries of each table in Steps

  !> A table in Steps: an entry an increment, each so much more than the one before.
  type :: table_t
    type(rows_t) :: rows
    integer(i8)  :: first = 0, step = 0
  end type table_t

  !> The open datasets of the group.
  type :: view_t
    integer :: n_steps = 0 !! increments with fields, appended
    real(wp), allocatable, private :: time(:) !! of those that are not counted
    type(rows_t), private :: values
    type(table_t), allocatable, private :: tables(:)
    integer, private :: n_filled = 0 !! entries that each of them has
    type(open_field_t), allocatable, private :: opened(:) !! fields that grow
    type(field_t), allocatable :: fields(:) !! all of them
  end type view_t

contains

  subroutine create_view(file, scene, has_contact, n_at_most, n_steps, view, error)
    type(hdf5_file_t), intent(in) :: file
    type(scene_t), intent(in), target :: scene
    logical, intent(in) :: has_contact !! the run has contact points
    integer, intent(in) :: n_at_most   !! increments that the file is to hold
    integer, intent(in) :: n_steps !! that the file has already, of a run that is continued
    type(view_t), intent(out) :: view
    type(error_t), allocatable, intent(out) :: error
    character(*), parameter :: group = '/VTKHDF', steps = group//'/Steps'
    type(field_source_t) :: source
    integer :: i, n_tables, n_fields

    view%n_steps = n_steps
    view%n_filled = n_steps
    allocate (view%time(0))
    call list_view_fields(scene, has_contact, view%fields)
    allocate (view%tables(5 + size(view%fields)))
    allocate (view%opened(count(view%fields%written /= at_start)))
    n_tables = 0
    n_fields = 0

    if (.not. exists(file, group)) then
      call create_group(file, group, error)
      call write_attribute(file, group, 'Version', [2_i8, 0_i8], error)
      call write_attribute(file, group, 'Type', 'UnstructuredGrid', error)
      call write_mesh(file, scene%mesh, error)
      call create_group(file, steps, error)
      call create_group(file, group//'/PointData', error)
      call create_group(file, steps//'/PointDataOffsets', error)
      call create_group(file, group//'/CellData', error)
      call create_group(file, steps//'/CellDataOffsets', error)
    end if
    call create_list(file, steps//'/Values', n_at_most, 'time from the start of the run', 'time', &
      view%values, error)
    ! Of a continued run: never more times than increments, nor more increments than fields.
    call keep_rows(view%values, n_steps, error)
    call flush_file(file, error)
    call write_attribute(file, steps, 'NSteps', int(n_steps, i8), error)
    call flush_file(file, error)
    call table('NumberOfParts', 'parts of the mesh', 1_i8, 0)
    call table('PartOffsets', 'first part', 0_i8, 0)
    call table('PointOffsets', 'first point', 0_i8, 0)
    call table('CellOffsets', 'first cell', 0_i8, 0)
    call table('ConnectivityIdOffsets', 'first entry of Connectivity', 0_i8, 0)

    source%scene => scene
    do i = 1, size(view%fields)
      associate (field => view%fields(i))
        if (field%written == at_start) then
          ! One block, where every increment's offset points to.
          call write_at_start(file, group, field, source, error)
          call table(name_of_offsets(field), 'where the block of an increment begins', 0_i8, 0)
        else
          n_fields = n_fields + 1
          call open_blocks(file, group, field, n_steps, view%opened(n_fields), error)
          call table(name_of_offsets(field), 'where the block of an increment begins', 0_i8, &
            merge(field%extents(size(field%extents)), 0, field%written == every_time))
        end if
      end associate
    end do

  contains

    subroutine table(name, description, first, step)
      character(*), intent(in) :: name, description
      integer(i8), intent(in) :: first
      integer, intent(in) :: step

      n_tables = n_tables + 1
      associate (new => view%tables(n_tables))
        new%first = first
        new%step = step
        call create_rows(file, steps//'/'//name, of_long, [integer ::], description, 'number', &
          new%rows, error)
        call keep_rows(new%rows, n_steps, error)
      end associate
    end subroutine table

  end subroutine create_view

  !> PointDataOffsets/stress for PointData/stress.
  pure function name_of_offsets(field) result(name)
    type(field_t), intent(in) :: field
    character(:), allocatable :: name
    integer :: slash

    slash = index(field%name, '/')
    name = field%name(:slash - 1)//'Offsets'//field%name(slash:)
  end function name_of_offsets

  subroutine write_mesh(file, mesh, error)
    type(hdf5_file_t), intent(in) :: file
    type(mesh_t), intent(in) :: mesh
    type(error_t), allocatable, intent(inout) :: error
    integer(i1), allocatable :: types(:)
    integer :: row(mesh%n_nodes)

    row = element_rows(mesh)
    allocate (types, source=int(cells(mesh%connectivity%cell)%vtk_type, i1))
    call write_dataset(file, '/VTKHDF/NumberOfPoints', [size(mesh%element_nodes, &
                       kind=i8)], 'nodes of the mesh', 'number', error)
    call write_dataset(file, '/VTKHDF/NumberOfCells', [int(mesh%n_elements, i8)], &
                       'elements of the mesh', 'number', error)
    call write_dataset(file, '/VTKHDF/NumberOfConnectivityIds', [size(mesh%connectivity%node, &
                       kind=i8)], &
                       'entries of Connectivity', 'number', error)
    call write_dataset(file, '/VTKHDF/Points', mesh%coordinates(:, mesh%element_nodes) + &
                       spread(mesh%origin, 2, size(mesh%element_nodes)), &
                       'nodes of the undeformed mesh, x, y, z', 'length', error)
    call write_dataset(file, '/VTKHDF/Connectivity', &
                       int(row(mesh%connectivity%node) - 1, i8), &
                       'nodes of each element: indices into Points, from 0', 'number', error)
    call write_dataset(file, '/VTKHDF/Offsets', int(mesh%connectivity%first - 1, i8), &
                       'where the nodes of each element begin in Connectivity', 'number', error)
    call write_dataset(file, '/VTKHDF/Types', types, 'cell types of VTK: 12 is a hexahedron', &
                       'code', error)
    if (any(mesh%connectivity%cell /= mesh%connectivity%cell(1))) call write_dataset(file, &
      mixed_path, int(mixed_topology(mesh%connectivity%cell, row(mesh%connectivity%node) - 1), &
      i8), 'number of the cell in XDMF and its nodes, element by element', 'number', error)
  end subroutine write_mesh

  !> Append the fields of an increment. It is seen by readers after `count_steps` only.
  subroutine append_step(view, source, checksum, error)
    type(view_t), intent(inout) :: view
    type(field_source_t), intent(inout) :: source
    integer(i8), intent(inout) :: checksum !! of the increment, to which that of every row is added
    type(error_t), allocatable, intent(inout) :: error
    integer :: i

    call append_fields(view%opened, source, checksum, error)
    if (allocated(error)) return
    ! What the tables say of it is there, and its time is written when it is counted.
    call add_checksum(view%values, source%state%time, checksum)
    do i = 1, size(view%tables)
      associate (table => view%tables(i))
        call add_checksum(table%rows, table%first + view%n_steps*table%step, checksum)
      end associate
    end do
    if (view%n_filled == view%n_steps) call fill_tables(view, error)
    view%n_steps = view%n_steps + 1
    view%time = [view%time, source%state%time]
  end subroutine append_step

  !> Give the tables the entries of the increments to come.
  subroutine fill_tables(view, error)
    type(view_t), intent(inout) :: view
    type(error_t), allocatable, intent(inout) :: error
    integer :: i, k

    do i = 1, size(view%tables)
      associate (table => view%tables(i))
        call append_list(table%rows, [(table%first + k*table%step, &
          k=view%n_filled, view%n_filled + filled_at_once - 1)], error)
      end associate
    end do
    view%n_filled = view%n_filled + filled_at_once
  end subroutine fill_tables

  !> Make the appended fields count: to be called when they are on disk.
  !>
  !> The number of increments comes before the time of the last: VTK fails on more times than
  !> increments, not on fewer.
  subroutine count_steps(file, view, error)
    type(hdf5_file_t), intent(in) :: file
    type(view_t), intent(inout) :: view
    type(error_t), allocatable, intent(inout) :: error

    if (size(view%time) == 0) return
    call write_and_flush(file, '/VTKHDF/Steps', 'NSteps', int(view%n_steps, i8), error)
    call append_and_flush(file, view%values, view%time, error)
    view%time = view%time(:0)
  end subroutine count_steps

  !> Cut what the tables have beyond the last increment.
  subroutine finish_view(view, error)
    type(view_t), intent(inout) :: view
    type(error_t), allocatable, intent(inout) :: error
    integer :: i

    do i = 1, size(view%tables)
      call cut_rows(view%tables(i)%rows, view%n_steps, error)
    end do
    view%n_filled = view%n_steps
  end subroutine finish_view

end module result_view_mod
