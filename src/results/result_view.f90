!> The group /VTKHDF of a result file: what ParaView and PyVista show.
!>
!> The mesh is stored once; every increment with fields adds a block to each of them. The tables in
!> Steps say where its blocks begin, which is known before: they are filled for many increments at
!> once, and cut at the end. A reader finds an increment only when it is counted (`count_step`),
!> after all of it is on disk.
module result_view_mod
  use kinds_mod, only: wp, i1, i8
  use errors_mod, only: error_t, raise, exit_machine
  use hdf5_files_mod, only: hdf5_file_t, create_group, exists, flush_file
  use hdf5_attributes_mod, only: write_attribute, write_and_flush
  use hdf5_datasets_mod, only: write_dataset
  use hdf5_rows_mod, only: rows_t, create_rows, create_list, create_stack, create_dense_stack, &
    keep_rows, cut_rows, append_row, append_list, append_and_flush, add_checksum
  use hdf5_types_mod, only: of_real, of_byte, of_long
  use mesh_mod, only: mesh_t
  use controls_mod, only: output_controls_t
  use state_mod, only: state_t
  use step_fields_mod, only: step_fields_t, tensor_field_t
  use result_contact_mod, only: nodal_contact_t
  implicit none
  private

  public :: view_t, create_view, append_step, count_step, finish_view

  integer(i1), parameter :: vtk_hexahedron = 12_i1
  character(*), parameter :: tensor_order = 'XX, YY, ZZ, XY, YZ, XZ'

  integer, parameter :: most_tables = 40      !! in Steps
  integer, parameter :: filled_at_once = 64   !! entries of each of them

  !> A field: its blocks.
  type :: field_t
    logical      :: is_asked = .false.
    type(rows_t) :: blocks
  end type field_t

  !> A table in Steps: an entry an increment, each so much more than the one before.
  type :: table_t
    type(rows_t) :: rows
    integer(i8)  :: first = 0, step = 0
  end type table_t

  !> A stress or strain, by where the deck wants it.
  type :: tensor_rows_t
    type(field_t) :: at_centroids, at_gauss_points, at_nodes
  end type tensor_rows_t

  !> The open datasets of the group.
  type :: view_t
    integer :: n_steps = 0 !! increments with fields
    integer :: n_nodes = 0, n_elements = 0
    type(rows_t) :: values
    type(table_t) :: tables(most_tables)
    integer :: n_tables = 0
    integer :: n_filled = 0 !! entries that each of them has
    type(field_t) :: displacement, reaction_force, contact_force, contact_pressure, contact_status
    type(tensor_rows_t) :: stress, strain
    type(field_t) :: mesh_error
  end type view_t

contains

  subroutine create_view(file, mesh, output, has_contact, n_at_most, n_steps, view, error)
    type(hdf5_file_t), intent(in) :: file
    type(mesh_t), intent(in) :: mesh
    type(output_controls_t), intent(in) :: output
    logical, intent(in) :: has_contact !! the run has contact points
    integer, intent(in) :: n_at_most   !! increments that the file is to hold
    integer, intent(in) :: n_steps !! that the file has already, of a run that is continued
    type(view_t), intent(out) :: view
    type(error_t), allocatable, intent(out) :: error
    character(*), parameter :: steps = '/VTKHDF/Steps/'

    view%n_steps = n_steps
    view%n_filled = n_steps
    view%n_nodes = mesh%n_nodes
    view%n_elements = mesh%n_elements
    view%displacement%is_asked = output%displacement
    view%reaction_force%is_asked = output%reaction
    view%contact_force%is_asked = output%contact .and. has_contact
    view%contact_pressure%is_asked = view%contact_force%is_asked
    view%contact_status%is_asked = view%contact_force%is_asked
    call ask_tensor(output%stress, output, view%stress)
    call ask_tensor(output%strain, output, view%strain)
    view%mesh_error%is_asked = output%mesh_error

    if (.not. exists(file, '/VTKHDF')) then
      call create_group(file, '/VTKHDF', error)
      call write_attribute(file, '/VTKHDF', 'Version', [2_i8, 0_i8], error)
      call write_attribute(file, '/VTKHDF', 'Type', 'UnstructuredGrid', error)
      call write_mesh(file, mesh, error)
      call create_group(file, '/VTKHDF/Steps', error)
    end if
    call create_list(file, steps//'Values', n_at_most, 'time from the start of the run', 'time', &
      view%values, error)
    ! Of a continued run: never more times than increments, nor more increments than fields.
    call keep_rows(view%values, n_steps, error)
    call flush_file(file, error)
    call write_attribute(file, '/VTKHDF/Steps', 'NSteps', int(n_steps, i8), error)
    call flush_file(file, error)
    call table('NumberOfParts', 'parts of the mesh', 1_i8, 0)
    call table('PartOffsets', 'first part', 0_i8, 0)
    call table('PointOffsets', 'first point', 0_i8, 0)
    call table('CellOffsets', 'first cell', 0_i8, 0)
    call table('ConnectivityIdOffsets', 'first entry of Connectivity', 0_i8, 0)

    call group('PointData')
    call dense_field('PointData', 'displacement', [3, mesh%n_nodes], &
      'from the undeformed mesh, x, y, z', 'length', view%displacement)
    call sparse_field('reaction_force', of_real, [3, mesh%n_nodes], &
      'of the supports on the body, x, y, z', 'force', view%reaction_force)
    call sparse_field('contact_force', of_real, [3, mesh%n_nodes], &
      'of the obstacles on the slave body, x, y, z', 'force', view%contact_force)
    call sparse_field('contact_pressure', of_real, [mesh%n_nodes], &
      'normal reaction over the area of the node', 'pressure', view%contact_pressure)
    call sparse_field('contact_status', of_byte, [mesh%n_nodes], &
      '0: open, 1: stick, 2: slide, -1: can touch nothing', 'code', view%contact_status)
    call dense_field('PointData', 'stress', [6, mesh%n_nodes], tensor_order//'; extrapolated '// &
      'from the Gauss points, averaged over the bricks at the node', 'pressure', &
      view%stress%at_nodes)
    call dense_field('PointData', 'strain', [6, mesh%n_nodes], tensor_order//' as tensor '// &
      'components; extrapolated from the Gauss points, averaged over the bricks at the node', &
      'strain', view%strain%at_nodes)

    call group('CellData')
    call dense_field('CellData', 'stress', [6, mesh%n_elements], &
      tensor_order//'; mean of the brick', 'pressure', view%stress%at_centroids)
    call dense_field('CellData', 'strain', [6, mesh%n_elements], &
      tensor_order//' as tensor components; mean of the brick', 'strain', view%strain%at_centroids)
    call dense_field('CellData', 'stress_gauss_points', [48, mesh%n_elements], &
      tensor_order//' at each of the eight Gauss points, placed like the nodes', 'pressure', &
      view%stress%at_gauss_points)
    call dense_field('CellData', 'strain_gauss_points', [48, mesh%n_elements], &
      tensor_order//' as tensor components at each of the eight Gauss points, placed like the '// &
      'nodes', 'strain', view%strain%at_gauss_points)
    call dense_field('CellData', 'mesh_error', [mesh%n_elements], &
      'error of the stresses in the energy norm, squared, by recovery', 'energy', view%mesh_error)

    ! The ids never change: one block, where every increment's offset points to.
    if (.not. exists(file, '/VTKHDF/PointData/node_id')) call write_dataset(file, &
      '/VTKHDF/PointData/node_id', int(mesh%node_id, i8), &
                       'ids of the nodes in the deck', 'number', error)
    call table('PointDataOffsets/node_id', 'where the block of an increment begins', 0_i8, 0)
    if (.not. exists(file, '/VTKHDF/CellData/element_id')) call write_dataset(file, &
      '/VTKHDF/CellData/element_id', int(mesh%element_id, i8), &
                       'ids of the elements in the deck', 'number', error)
    call table('CellDataOffsets/element_id', 'where the block of an increment begins', 0_i8, 0)

  contains

    subroutine group(name)
      character(*), intent(in) :: name

      if (exists(file, '/VTKHDF/'//name)) return
      call create_group(file, '/VTKHDF/'//name, error)
      call create_group(file, steps//name//'Offsets', error)
    end subroutine group

    subroutine table(name, description, first, step)
      character(*), intent(in) :: name, description
      integer(i8), intent(in) :: first
      integer, intent(in) :: step

      view%n_tables = view%n_tables + 1
      associate (new => view%tables(view%n_tables))
        new%first = first
        new%step = step
        call create_rows(file, steps//name, of_long, [integer ::], description, 'number', &
          new%rows, error)
        call keep_rows(new%rows, n_steps, error)
      end associate
    end subroutine table

    !> A field of the nodes that is 0, or one code, at most of them.
    subroutine sparse_field(name, kind, extents, description, quantity, field)
      character(*), intent(in) :: name, description, quantity
      integer, intent(in) :: kind, extents(:)
      type(field_t), intent(inout) :: field

      if (.not. field%is_asked) return
      call create_stack(file, '/VTKHDF/PointData/'//name, kind, extents, description, quantity, &
                        field%blocks, error)
      call begin_field('PointData', name, field)
    end subroutine sparse_field

    !> A field that varies all over the mesh.
    subroutine dense_field(group, name, extents, description, quantity, field)
      character(*), intent(in) :: group, name, description, quantity
      integer, intent(in) :: extents(:)
      type(field_t), intent(inout) :: field

      if (.not. field%is_asked) return
      call create_dense_stack(file, '/VTKHDF/'//group//'/'//name, extents, description, quantity, &
                              field%blocks, error)
      call begin_field(group, name, field)
    end subroutine dense_field

    subroutine begin_field(group, name, field)
      character(*), intent(in) :: group, name
      type(field_t), intent(inout) :: field

      call keep_rows(field%blocks, n_steps, error)
      call table(group//'Offsets/'//name, 'where the block of an increment begins', 0_i8, &
        merge(mesh%n_nodes, mesh%n_elements, group == 'PointData'))
    end subroutine begin_field

  end subroutine create_view

  !> Say where a tensor is wanted.
  pure subroutine ask_tensor(is_asked, output, rows)
    logical, intent(in) :: is_asked
    type(output_controls_t), intent(in) :: output
    type(tensor_rows_t), intent(inout) :: rows

    rows%at_centroids%is_asked = is_asked .and. output%at_centroids
    rows%at_gauss_points%is_asked = is_asked .and. output%at_gauss_points
    rows%at_nodes%is_asked = is_asked .and. output%at_nodes
  end subroutine ask_tensor

  subroutine write_mesh(file, mesh, error)
    type(hdf5_file_t), intent(in) :: file
    type(mesh_t), intent(in) :: mesh
    type(error_t), allocatable, intent(inout) :: error
    integer(i8) :: e
    integer(i1), allocatable :: types(:)

    allocate (types(mesh%n_elements), source=vtk_hexahedron)
    call write_dataset(file, '/VTKHDF/NumberOfPoints', [int(mesh%n_nodes, i8)], &
                       'nodes of the mesh', 'number', error)
    call write_dataset(file, '/VTKHDF/NumberOfCells', [int(mesh%n_elements, i8)], &
                       'elements of the mesh', 'number', error)
    call write_dataset(file, '/VTKHDF/NumberOfConnectivityIds', [8_i8*mesh%n_elements], &
                       'entries of Connectivity', 'number', error)
    call write_dataset(file, '/VTKHDF/Points', mesh%coordinates, &
                       'nodes of the undeformed mesh, x, y, z', 'length', error)
    call write_dataset(file, '/VTKHDF/Connectivity', &
                       int(reshape(mesh%connectivity, [8*mesh%n_elements]) - 1, i8), &
                       'nodes of each element: indices into Points, from 0', 'number', error)
    call write_dataset(file, '/VTKHDF/Offsets', [(8*e, e = 0_i8, int(mesh%n_elements, i8))], &
                       'where the nodes of each element begin in Connectivity', 'number', error)
    call write_dataset(file, '/VTKHDF/Types', types, 'cell types of VTK: 12 is a hexahedron', &
                       'code', error)
  end subroutine write_mesh

  !> Append the fields of an increment. It is seen by readers after `count_step` only.
  subroutine append_step(view, state, fields, nodal, checksum, error)
    type(view_t), intent(inout) :: view
    type(state_t), intent(in) :: state
    type(step_fields_t), intent(in) :: fields
    type(nodal_contact_t), intent(in) :: nodal !! where asked for
    integer(i8), intent(inout) :: checksum !! of the increment, to which that of every row is added
    type(error_t), allocatable, intent(inout) :: error

    integer :: i

    if (allocated(error)) return
    if ((view%reaction_force%is_asked .and. .not. allocated(fields%reaction_force)) .or. &
        (view%mesh_error%is_asked .and. .not. allocated(fields%mesh_error)) .or. &
        is_missing(view%stress, fields%stress) .or. is_missing(view%strain, fields%strain)) then
      call raise(error, exit_machine, 'internal error: a field to be written was not computed')
      return
    end if
    if (view%displacement%is_asked) then
      call append_row(view%displacement%blocks, state%displacement, checksum, error)
    end if
    if (view%reaction_force%is_asked) then
      call append_row(view%reaction_force%blocks, fields%reaction_force, checksum, error)
    end if
    if (view%contact_force%is_asked) then
      call append_row(view%contact_force%blocks, nodal%force, checksum, error)
      call append_row(view%contact_pressure%blocks, nodal%pressure, checksum, error)
      call append_row(view%contact_status%blocks, nodal%status, checksum, error)
    end if
    call append_tensor(view%stress, fields%stress, checksum, error)
    call append_tensor(view%strain, fields%strain, checksum, error)
    if (view%mesh_error%is_asked) then
      call append_row(view%mesh_error%blocks, fields%mesh_error, checksum, error)
    end if
    ! What the tables say of it is there, and its time is written when it is counted.
    call add_checksum(view%values, state%time, checksum)
    do i = 1, view%n_tables
      associate (table => view%tables(i))
        call add_checksum(table%rows, table%first + view%n_steps*table%step, checksum)
      end associate
    end do
    if (view%n_filled == view%n_steps) call fill_tables(view, error)
  end subroutine append_step

  !> Give the tables the entries of the increments to come.
  subroutine fill_tables(view, error)
    type(view_t), intent(inout) :: view
    type(error_t), allocatable, intent(inout) :: error
    integer :: i, k

    do i = 1, view%n_tables
      associate (table => view%tables(i))
        call append_list(table%rows, [(table%first + k*table%step, &
          k=view%n_filled, view%n_filled + filled_at_once - 1)], error)
      end associate
    end do
    view%n_filled = view%n_filled + filled_at_once
  end subroutine fill_tables

  !> Something of a tensor is asked for and was not computed.
  pure function is_missing(rows, field) result(missing)
    type(tensor_rows_t), intent(in) :: rows
    type(tensor_field_t), intent(in) :: field
    logical :: missing

    missing = (rows%at_centroids%is_asked .and. .not. allocated(field%at_centroids)) .or. &
      (rows%at_gauss_points%is_asked .and. .not. allocated(field%at_gauss_points)) .or. &
      (rows%at_nodes%is_asked .and. .not. allocated(field%at_nodes))
  end function is_missing

  !> Append what is asked for of a tensor.
  subroutine append_tensor(rows, field, checksum, error)
    type(tensor_rows_t), intent(inout) :: rows
    type(tensor_field_t), intent(in) :: field
    integer(i8), intent(inout) :: checksum !! of the increment, to which that of every row is added
    type(error_t), allocatable, intent(inout) :: error

    if (rows%at_centroids%is_asked) then
      call append_row(rows%at_centroids%blocks, field%at_centroids, checksum, error)
    end if
    if (rows%at_gauss_points%is_asked) then
      call append_row(rows%at_gauss_points%blocks, &
        reshape(field%at_gauss_points, [48, size(field%at_gauss_points, 3)]), checksum, error)
    end if
    if (rows%at_nodes%is_asked) then
      call append_row(rows%at_nodes%blocks, field%at_nodes, checksum, error)
    end if
  end subroutine append_tensor

  !> Make the appended fields count: to be called when they are on disk.
  !>
  !> The number of increments comes before the time of the last: VTK fails on more times than
  !> increments, not on fewer.
  subroutine count_step(file, time, view, error)
    type(hdf5_file_t), intent(in) :: file
    real(wp), intent(in) :: time !! from the start of the run
    type(view_t), intent(inout) :: view
    type(error_t), allocatable, intent(inout) :: error

    view%n_steps = view%n_steps + 1
    call write_and_flush(file, '/VTKHDF/Steps', 'NSteps', int(view%n_steps, i8), error)
    call append_and_flush(file, view%values, time, error)
  end subroutine count_step

  !> Cut what the tables have beyond the last increment.
  subroutine finish_view(view, error)
    type(view_t), intent(inout) :: view
    type(error_t), allocatable, intent(inout) :: error
    integer :: i

    do i = 1, view%n_tables
      call cut_rows(view%tables(i)%rows, view%n_steps, error)
    end do
    view%n_filled = view%n_steps
  end subroutine finish_view

end module result_view_mod
