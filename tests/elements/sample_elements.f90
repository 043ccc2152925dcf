!> Elements and small meshes for the tests of this folder.
module sample_elements
  use kinds_mod, only: wp
  use connectivity_mod, only: make_hexahedra
  use mesh_mod, only: mesh_t, kind_c3d8, kind_c3d8i, kind_c3d8b
  use sample_meshes, only: complete_mesh
  implicit none
  private

  public :: distorted_element, patch_mesh, tensor_of

  integer, parameter, public :: kinds(3) = [kind_c3d8, kind_c3d8i, kind_c3d8b]
  character(5), parameter, public :: kind_name(3) = ['c3d8 ', 'c3d8i', 'c3d8b']
  real(wp), parameter, public :: unit_cube(3, 8) = reshape([real(wp) :: 0, 0, 0, 1, 0, 0, &
    1, 1, 0, 0, 1, 0, 0, 0, 1, 1, 0, 1, 1, 1, 1, 0, 1, 1], [3, 8])

contains

  !> The cube with its nodes moved at random, at most by 0.2 along each axis.
  function distorted_element() result(x)
    real(wp) :: x(3, 8)

    call random_number(x)
    x = unit_cube + 0.4_wp*(x - 0.5_wp)
  end function distorted_element

  !> The patch of seven elements of R.H. MacNeal and R.L. Harder, Finite Elem. Anal. Des. 1 (1985)
  !> 3-20: the unit cube (nodes 1 to 8) around a distorted element (nodes 9 to 16).
  function patch_mesh() result(mesh)
    type(mesh_t) :: mesh
    real(wp), parameter :: inner(3, 8) = reshape([ &
      0.249_wp, 0.342_wp, 0.192_wp, 0.826_wp, 0.288_wp, 0.288_wp, &
      0.850_wp, 0.649_wp, 0.263_wp, 0.273_wp, 0.750_wp, 0.230_wp, &
      0.320_wp, 0.186_wp, 0.643_wp, 0.677_wp, 0.305_wp, 0.683_wp, &
      0.788_wp, 0.693_wp, 0.644_wp, 0.165_wp, 0.745_wp, 0.702_wp], [3, 8])

    mesh%coordinates = reshape([unit_cube, inner], [3, 16])
    mesh%connectivity = make_hexahedra(reshape([ &
      9, 10, 11, 12, 13, 14, 15, 16, &
      1, 2, 3, 4, 9, 10, 11, 12, &
      13, 14, 15, 16, 5, 6, 7, 8, &
      1, 2, 10, 9, 5, 6, 14, 13, &
      10, 2, 3, 11, 14, 6, 7, 15, &
      12, 11, 3, 4, 16, 15, 7, 8, &
      1, 9, 12, 4, 5, 13, 16, 8], [8, 7]))
    call complete_mesh(mesh)
  end function patch_mesh

  !> The symmetric part of a displacement gradient as XX YY ZZ XY YZ XZ.
  pure function tensor_of(h) result(strain)
    real(wp), intent(in) :: h(3, 3) !! du_i/dx_j
    real(wp) :: strain(6)

    strain = [h(1, 1), h(2, 2), h(3, 3), 0.5_wp*(h(1, 2) + h(2, 1)), 0.5_wp*(h(2, 3) + h(3, 2)), &
      0.5_wp*(h(1, 3) + h(3, 1))]
  end function tensor_of

end module sample_elements
