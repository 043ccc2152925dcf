!> Small blocks of bricks for the tests of this folder.
module sample_blocks
  use kinds_mod, only: wp
  use mesh_mod, only: mesh_t, find_bodies, kind_c3d8
  use block_mesh_mod, only: block_coordinates, block_connectivity, graded_positions
  use scene_mod, only: material_t
  use assembly_mod, only: triplets_t
  implicit none
  private

  public :: sample_block, two_blocks, steel, dense_of

contains

  !> n(1) x n(2) x n(3) bricks filling 2 x 1 x 1.5, their nodes moved at random by at most a fifth
  !> of a brick.
  function sample_block(n) result(mesh)
    integer, intent(in) :: n(3)
    type(mesh_t) :: mesh
    real(wp), parameter :: edge(3) = [2.0_wp, 1.0_wp, 1.5_wp]
    real(wp), allocatable :: shift(:, :)
    integer :: i

    mesh%coordinates = block_coordinates([0.0_wp, 0.0_wp, 0.0_wp], edge, &
                                         graded_positions(n(1), 1.0_wp), &
                                         graded_positions(n(2), 1.0_wp), &
                                         graded_positions(n(3), 1.0_wp))
    mesh%connectivity = block_connectivity(n)
    allocate (shift, mold=mesh%coordinates)
    call random_number(shift)
    do i = 1, 3
      mesh%coordinates(i, :) = mesh%coordinates(i, :) + 0.4_wp*(shift(i, :) - 0.5_wp)*edge(i)/n(i)
    end do
    call complete(mesh)
  end function sample_block

  !> Two such blocks side by side that share nothing.
  function two_blocks(n) result(mesh)
    integer, intent(in) :: n(3)
    type(mesh_t) :: mesh, other

    mesh = sample_block(n)
    other = sample_block(n)
    other%coordinates(1, :) = other%coordinates(1, :) + 10.0_wp
    mesh%connectivity = reshape([mesh%connectivity, other%connectivity + mesh%n_nodes], &
                                [8, 2*mesh%n_elements])
    mesh%coordinates = reshape([mesh%coordinates, other%coordinates], [3, 2*mesh%n_nodes])
    call complete(mesh)
  end function two_blocks

  !> What follows from coordinates and connectivity.
  subroutine complete(mesh)
    type(mesh_t), intent(inout) :: mesh

    mesh%n_nodes = size(mesh%coordinates, 2)
    mesh%n_elements = size(mesh%connectivity, 2)
    mesh%material = spread(1, 1, mesh%n_elements)
    mesh%element_kind = spread(kind_c3d8, 1, mesh%n_elements)
    call find_bodies(mesh)
  end subroutine complete

  !> E = 210000, nu = 0.3.
  function steel() result(materials)
    type(material_t) :: materials(1)

    materials%young = 210000.0_wp
    materials%poisson = 0.3_wp
  end function steel

  !> The whole matrix, from its triplets.
  function dense_of(k) result(a)
    type(triplets_t), intent(in) :: k
    real(wp) :: a(k%n, k%n)
    integer :: i

    a = 0.0_wp
    do i = 1, size(k%value)
      a(k%row(i), k%column(i)) = k%value(i)
      a(k%column(i), k%row(i)) = k%value(i)
    end do
  end function dense_of

end module sample_blocks
