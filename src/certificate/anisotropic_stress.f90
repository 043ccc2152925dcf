!> The certificate's stresses where a material is not isotropic: by the tensor of its elasticity,
!> turned as a tensor of fourth order. docs/theory.md (8.50).
module anisotropic_stress_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: cross
  use connectivity_mod, only: nodes_of_element
  use mesh_mod, only: mesh_t
  use orientations_mod, only: orientation_t, rectangular, cylindrical
  use scene_mod, only: material_t
  implicit none
  private

  public :: elasticity_tensor, contract, middle_of, goes_around

  integer, parameter :: place(3, 3) = reshape([1, 4, 6, 4, 2, 5, 6, 5, 3], [3, 3])
  !! of a component, as stresses are ordered

contains

  !> C along x, y, z, of an element: of a point of it where axes go around.
  pure function elasticity_tensor(mesh, material, e, point) result(c)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: material
    integer, intent(in) :: e
    real(wp), intent(in) :: point(3) !! from the mesh's origin [length]
    real(wp) :: c(3, 3, 3, 3) !! [force/length^2]
    real(wp) :: axes(3, 3), last(27, 3), front(3, 27), at(3)
    integer :: j, k, l, time

    at = point
    if (.not. goes_around(mesh, material)) at = middle_of(mesh, e)
    axes = axes_of_place(mesh, material%orientation, mesh%origin + at)
    do l = 1, 3
      do k = 1, 3
        do j = 1, 3
          c(:, j, k, l) = material%law%elastic%c(place(:, j), place(k, l))
        end do
      end do
    end do
    ! The last index is turned and becomes the first, four times.
    do time = 1, 4
      last = reshape(c, [27, 3])
      front = matmul(axes, transpose(last))
      c = reshape(front, [3, 3, 3, 3])
    end do
  end function elasticity_tensor

  !> Whether axes are those of a place, not of an element.
  pure logical function goes_around(mesh, material)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: material

    goes_around = material%orientation%kind == cylindrical .or. mesh%sector_angle > 0.0_wp
  end function goes_around

  !> The middle of an element.
  pure function middle_of(mesh, e) result(middle)
    type(mesh_t), intent(in) :: mesh
    integer, intent(in) :: e
    real(wp) :: middle(3) !! from the mesh's origin [length]

    associate (nodes => nodes_of_element(mesh%connectivity, e))
      middle = sum(mesh%coordinates(:, nodes), dim=2)/real(size(nodes), wp)
    end associate
  end function middle_of

  !> The axes of a material, columns.
  pure function axes_of_place(mesh, orientation, middle) result(axes)
    type(mesh_t), intent(in) :: mesh
    type(orientation_t), intent(in) :: orientation
    real(wp), intent(in) :: middle(3) !! in the deck [length]
    real(wp) :: axes(3, 3) !! [-]
    real(wp) :: about(3), turn(3, 3), radius
    integer :: i

    axes = 0.0_wp
    associate (a => orientation%a, b => orientation%b, origin => orientation%origin)
      select case (orientation%kind)
      case (rectangular)
        axes(:, 1) = unit(a - origin)
        axes(:, 2) = unit(across(b - origin, axes(:, 1)))
        axes(:, 3) = cross(axes(:, 1), axes(:, 2))
      case (cylindrical)
        axes(:, 3) = unit(b - a)
        axes(:, 1) = unit(across(middle - a, axes(:, 3)))
        axes(:, 2) = cross(axes(:, 3), axes(:, 1))
      case default
        do i = 1, 3
          axes(i, i) = 1.0_wp
        end do
      end select
    end associate
    ! Rodrigues' rotation about one of the axes.
    about = 0.0_wp
    about(orientation%turned_about) = 1.0_wp
    do i = 1, 3
      turn(:, i) = (1.0_wp - cos(orientation%angle))*about(i)*about
      turn(i, i) = turn(i, i) + cos(orientation%angle)
    end do
    turn(:, 1) = turn(:, 1) + sin(orientation%angle)*cross(about, [1.0_wp, 0.0_wp, 0.0_wp])
    turn(:, 2) = turn(:, 2) + sin(orientation%angle)*cross(about, [0.0_wp, 1.0_wp, 0.0_wp])
    turn(:, 3) = turn(:, 3) + sin(orientation%angle)*cross(about, [0.0_wp, 0.0_wp, 1.0_wp])
    axes = matmul(axes, turn)
    if (.not. mesh%sector_angle > 0.0_wp) return
    ! Of a body of revolution they are given where z is 0.
    radius = hypot(middle(1), middle(3))
    axes([1, 3], :) = matmul(reshape([middle(1), middle(3), -middle(3), middle(1)]/radius, &
      [2, 2]), axes([1, 3], :))
  end function axes_of_place

  !> A vector without its part along a unit vector.
  pure function across(v, along)
    real(wp), intent(in) :: v(3), along(3)
    real(wp) :: across(3)

    across = v - dot_product(v, along)*along
  end function across

  !> The unit vector of a vector.
  pure function unit(v)
    real(wp), intent(in) :: v(3)
    real(wp) :: unit(3)

    unit = v/norm2(v)
  end function unit

  !> The stress of a strain, or of a displacement gradient.
  pure function contract(c, h) result(stress)
    real(wp), intent(in) :: c(3, 3, 3, 3) !! [force/length^2]
    real(wp), intent(in) :: h(3, 3)       !! [-]
    real(wp) :: stress(3, 3)              !! [force/length^2]

    stress = reshape(matmul(reshape(c, [9, 9]), reshape(h, [9])), [3, 3])
  end function contract

end module anisotropic_stress_mod
