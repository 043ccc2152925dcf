!> Blocks of elements for the tests of several folders.
module sample_meshes
  use kinds_mod, only: wp
  use connectivity_mod, only: connectivity_t, make_hexahedra, nodes_of_face
  use mesh_mod, only: mesh_t, find_bodies, kind_c3d8
  use block_mesh_mod, only: block_coordinates, block_connectivity, graded_positions
  implicit none
  private

  public :: sample_mesh, complete_mesh, nodes_of_faces

contains

  !> A block; with `distortion` its nodes are moved at random by at most half of that of an element.
  function sample_mesh(n, edge, distortion) result(mesh)
    integer, intent(in) :: n(3)          !! elements along each axis
    real(wp), intent(in) :: edge(3)      !! of the block
    real(wp), intent(in) :: distortion
    type(mesh_t) :: mesh
    real(wp), allocatable :: shift(:, :)
    integer :: i

    mesh%coordinates = block_coordinates([0.0_wp, 0.0_wp, 0.0_wp], edge, &
      graded_positions(n(1), 1.0_wp), graded_positions(n(2), 1.0_wp), &
      graded_positions(n(3), 1.0_wp))
    mesh%connectivity = make_hexahedra(block_connectivity(n))
    allocate (shift, mold=mesh%coordinates)
    call random_number(shift)
    do i = 1, 3
      mesh%coordinates(i, :) = mesh%coordinates(i, :) + &
        distortion*(shift(i, :) - 0.5_wp)*edge(i)/n(i)
    end do
    call complete_mesh(mesh)
  end function sample_mesh

  !> What follows from coordinates and connectivity: one material, C3D8.
  subroutine complete_mesh(mesh)
    type(mesh_t), intent(inout) :: mesh

    mesh%n_nodes = size(mesh%coordinates, 2)
    mesh%n_elements = size(mesh%connectivity%cell)
    mesh%material = spread(1, 1, mesh%n_elements)
    mesh%element_kind = spread(kind_c3d8, 1, mesh%n_elements)
    call find_bodies(mesh)
  end subroutine complete_mesh

  !> The nodes on `faces`, ascending, each once.
  pure function nodes_of_faces(connectivity, n_nodes, faces) result(nodes)
    type(connectivity_t), intent(in) :: connectivity
    integer, intent(in) :: n_nodes            !! nodes in the mesh
    integer, intent(in) :: faces(:, :)        !! (2, n_faces)
    integer, allocatable :: nodes(:)
    logical :: on_surface(n_nodes)
    integer :: i

    on_surface = .false.
    do i = 1, size(faces, 2)
      on_surface(nodes_of_face(connectivity, faces(1, i), faces(2, i))) = .true.
    end do
    nodes = pack([(i, i = 1, n_nodes)], on_surface)
  end function nodes_of_faces

end module sample_meshes
