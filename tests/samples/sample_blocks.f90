!> Small blocks of elements for the units of several folders.
module sample_blocks
  use kinds_mod, only: wp
  use new_law_mod, only: new_law
  use connectivity_mod, only: make_connectivity
  use mesh_mod, only: mesh_t
  use sample_meshes, only: sample_mesh, complete_mesh
  use scene_mod, only: material_t
  use assembly_mod, only: triplets_t
  implicit none
  private

  public :: sample_block, two_blocks, steel, dense_of

contains

  !> n(1) x n(2) x n(3) elements filling 2 x 1 x 1.5, their nodes moved at random by at most a fifth
  !> of an element.
  function sample_block(n) result(mesh)
    integer, intent(in) :: n(3)
    type(mesh_t) :: mesh

    mesh = sample_mesh(n, [2.0_wp, 1.0_wp, 1.5_wp], 0.4_wp)
  end function sample_block

  !> Two such blocks side by side that share nothing.
  function two_blocks(n) result(mesh)
    integer, intent(in) :: n(3)
    type(mesh_t) :: mesh, other

    mesh = sample_block(n)
    other = sample_block(n)
    other%coordinates(1, :) = other%coordinates(1, :) + 10.0_wp
    mesh%connectivity = make_connectivity([mesh%connectivity%cell, other%connectivity%cell], &
      [mesh%connectivity%node, other%connectivity%node + mesh%n_nodes])
    mesh%coordinates = reshape([mesh%coordinates, other%coordinates], [3, 2*mesh%n_nodes])
    call complete_mesh(mesh)
  end function two_blocks

  !> E = 210000, nu = 0.3.
  function steel() result(materials)
    type(material_t) :: materials(1)

    materials%law = new_law('ELASTIC', [210000.0_wp, 0.3_wp])
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
