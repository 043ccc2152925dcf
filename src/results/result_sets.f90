!> The group /sets of a result file: the named sets of the deck, as rows of the file's mesh.
!>
!> Of nodes and faces, only what elements have is a row of the mesh; nodes of a set that are
!> reference nodes are kept as rows of /reference_nodes. A set that has no row is left out.
module result_sets_mod
  use errors_mod, only: error_t
  use text_mod, only: string_t
  use mesh_mod, only: element_rows
  use scene_mod, only: scene_t, named_set_t, reference_nodes
  use hdf5_files_mod, only: hdf5_file_t, exists
  use hdf5_attributes_mod, only: describe_group
  use hdf5_datasets_mod, only: write_squeezed
  use result_fields_mod, only: free_path
  implicit none
  private

  public :: write_sets

  character(*), parameter :: group = '/sets'

contains

  !> Write all sets, unless the file has them.
  subroutine write_sets(file, scene, error)
    type(hdf5_file_t), intent(in) :: file
    type(scene_t), intent(in) :: scene
    type(error_t), allocatable, intent(inout) :: error
    integer :: i

    if (allocated(error)) return
    if (exists(file, group)) return
    call describe_group(file, group, 'named sets of the deck, as rows of the mesh, from 0', error)
    if (allocated(scene%node_sets)) then
      call write_rows(file, 'nodes', scene%node_sets, element_rows(scene%mesh), 'rows of Points', &
        error)
      call write_rows(file, 'reference_nodes', scene%node_sets, rows_of_references(scene), &
        'rows of /reference_nodes', error)
    end if
    if (allocated(scene%element_sets)) call write_rows(file, 'elements', scene%element_sets, &
      [(i, i=1, scene%mesh%n_elements)], 'rows of the cells', error)
    call write_faces(file, scene, error)
  end subroutine write_sets

  !> The row of each node that is a reference node, and no point of the mesh, in /reference_nodes;
  !> 0 of others.
  pure function rows_of_references(scene) result(row)
    type(scene_t), intent(in) :: scene
    integer, allocatable :: row(:), nodes(:)
    integer :: i

    allocate (nodes(0))
    nodes = reference_nodes(scene)
    allocate (row(scene%mesh%n_nodes), source=0)
    row(nodes) = [(i, i=1, size(nodes))]
    row(scene%mesh%element_nodes) = 0
  end function rows_of_references

  !> Write the members of sets that have a row.
  subroutine write_rows(file, kind, sets, row, description, error)
    type(hdf5_file_t), intent(in) :: file
    character(*), intent(in) :: kind          !! name of the group
    type(named_set_t), intent(in) :: sets(:)
    integer, intent(in) :: row(:)             !! of each member, from 1; 0: none
    character(*), intent(in) :: description
    type(error_t), allocatable, intent(inout) :: error
    type(string_t) :: paths(size(sets))
    integer, allocatable :: rows(:)
    integer :: i, n

    allocate (rows(0))
    n = 0
    do i = 1, size(sets)
      rows = pack(row(sets(i)%members), row(sets(i)%members) > 0) - 1
      if (size(rows) == 0) cycle
      n = n + 1
      paths(n)%text = free_path(group//'/'//kind//'/', sets(i)%name, paths(:n - 1))
      call describe_group(file, group//'/'//kind, 'a dataset a set', error)
      call write_squeezed(file, paths(n)%text, rows, [size(rows)], description, 'index', error)
    end do
  end subroutine write_rows

  !> Write the faces of the surfaces that have a name and faces of elements.
  subroutine write_faces(file, scene, error)
    type(hdf5_file_t), intent(in) :: file
    type(scene_t), intent(in) :: scene
    type(error_t), allocatable, intent(inout) :: error
    type(string_t) :: paths(scene%n_named_surfaces)
    integer :: i, n

    n = 0
    do i = 1, scene%n_named_surfaces
      associate (faces => scene%surfaces(i)%faces)
        if (size(faces) == 0) cycle
        n = n + 1
        paths(n)%text = free_path(group//'/faces/', scene%surfaces(i)%name, paths(:n - 1))
        call describe_group(file, group//'/faces', 'a dataset a surface', error)
        call write_squeezed(file, paths(n)%text, reshape(faces - 1, [size(faces)]), shape(faces), &
          'row of the cell; face 0 to 5: S1 to S6', 'index', error)
      end associate
    end do
  end subroutine write_faces

end module result_sets_mod
