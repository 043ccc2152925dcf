!> The law of each element: that of its material, along the axes that this has there.
module element_laws_mod
  use kinds_mod, only: wp
  use cells_mod, only: cells, has_middles, hexahedron_8, hexahedron_points
  use cell_shapes_mod, only: shape_functions
  use connectivity_mod, only: nodes_of_element, nodes_of_hexahedron
  use elasticity_mod, only: elasticity_t, turned
  use material_law_mod, only: law_t
  use new_law_mod, only: turned_law
  use mesh_mod, only: mesh_t
  use orientations_mod, only: cylindrical, directions_at
  use scene_mod, only: material_t
  implicit none
  private

  public :: elasticity_at, elasticity_at_points, law_at, varies

contains

  !> The elasticity of an element along x, y, z: one, or that of each of its points where the axes
  !> of its material vary. docs/theory.md (8.50).
  pure function elasticity_at(mesh, materials, e) result(elastic)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    integer, intent(in) :: e
    type(elasticity_t) :: elastic(merge(n_points_of(mesh, e), 1, varies(mesh, &
      materials(mesh%material(e)))))
    integer :: g

    associate (material => materials(mesh%material(e)))
      if (.not. varies(mesh, material)) then
        elastic = material%law%elastic
        if (.not. material%law%elastic%is_isotropic) elastic = turned(material%law%elastic, &
          axes_at(mesh, material, middle_of(mesh, e)))
      else if (has_middles(mesh%connectivity%cell(e))) then
        associate (points => cells(mesh%connectivity%cell(e))%point(:, :size(elastic)))
          elastic = elasticity_at_points(mesh, materials, e, points)
        end associate
      else
        associate (nodes => nodes_of_hexahedron(mesh%connectivity, e), cube => cells(hexahedron_8))
          do g = 1, size(elastic)
            elastic(g) = turned(material%law%elastic, axes_at(mesh, material, &
              matmul(mesh%coordinates(:, nodes), shape_functions(cube, cube%place(:, g)/ &
              sqrt(3.0_wp)))))
          end do
        end associate
      end if
    end associate
  end function elasticity_at

  !> The same at points of an element of second order.
  pure function elasticity_at_points(mesh, materials, e, point) result(elastic)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    integer, intent(in) :: e
    real(wp), intent(in) :: point(:, :) !! (3,n) natural coordinates [-]
    type(elasticity_t) :: elastic(merge(size(point, 2), 1, varies(mesh, &
      materials(mesh%material(e)))))
    integer :: g

    associate (material => materials(mesh%material(e)))
      if (varies(mesh, material)) then
        associate (nodes => nodes_of_element(mesh%connectivity, e), &
                   cell => cells(mesh%connectivity%cell(e)))
          do g = 1, size(point, 2)
            elastic(g) = turned(material%law%elastic, axes_at(mesh, material, &
              matmul(mesh%coordinates(:, nodes), shape_functions(cell, point(:, g)))))
          end do
        end associate
      else
        elastic = elasticity_at(mesh, materials, e)
      end if
    end associate
  end function elasticity_at_points

  !> The law of an element along x, y, z, in its middle.
  pure type(law_t) function law_at(mesh, materials, e) result(law)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: materials(:)
    integer, intent(in) :: e

    associate (material => materials(mesh%material(e)))
      law = material%law
      if (.not. law%elastic%is_isotropic) law = turned_law(law, axes_at(mesh, material, &
        middle_of(mesh, e)))
    end associate
  end function law_at

  !> Whether the axes of a material vary over an element: cylindrical ones, and those of wedges that
  !> stand for bodies of revolution.
  pure logical function varies(mesh, material)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: material

    varies = .not. material%law%elastic%is_isotropic .and. (mesh%sector_angle > 0.0_wp .or. &
      material%orientation%kind == cylindrical)
  end function varies

  !> How many points the quadrature of an element has.
  pure integer function n_points_of(mesh, e)
    type(mesh_t), intent(in) :: mesh
    integer, intent(in) :: e

    n_points_of = hexahedron_points
    if (has_middles(mesh%connectivity%cell(e))) n_points_of = &
      cells(mesh%connectivity%cell(e))%n_points
  end function n_points_of

  !> The middle of an element.
  pure function middle_of(mesh, e) result(middle)
    type(mesh_t), intent(in) :: mesh
    integer, intent(in) :: e
    real(wp) :: middle(3) !! [length]

    associate (nodes => nodes_of_element(mesh%connectivity, e))
      middle = sum(mesh%coordinates(:, nodes), dim=2)/real(size(nodes), wp)
    end associate
  end function middle_of

  !> The axes of a material at a place, columns. In a wedge of a body of revolution they go around.
  pure function axes_at(mesh, material, place) result(axes)
    type(mesh_t), intent(in) :: mesh
    type(material_t), intent(in) :: material
    real(wp), intent(in) :: place(3) !! from the mesh's origin [length]
    real(wp) :: axes(3, 3)           !! [-]
    real(wp) :: around(3, 3), radius

    axes = directions_at(material%orientation, mesh%origin + place)
    if (.not. mesh%sector_angle > 0.0_wp) return
    associate (x => mesh%origin + place)
      radius = hypot(x(1), x(3))
      around = 0.0_wp
      around(2, 2) = 1.0_wp
      around([1, 3], 1) = x([1, 3])/radius
      around([1, 3], 3) = [-x(3), x(1)]/radius
    end associate
    axes = matmul(around, axes)
  end function axes_at

end module element_laws_mod
