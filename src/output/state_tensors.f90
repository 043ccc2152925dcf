!> Stresses and strains of a state wherever the deck asks for them, which several fields share.
module state_tensors_mod
  use kinds_mod, only: wp
  use connectivity_mod, only: first_points, some_elements
  use mesh_mod, only: mesh_t
  use scene_mod, only: scene_t
  use step_fields_mod, only: tensor_field_t
  use expansion_mod, only: find_free_strain
  use mesh_fields_mod, only: fill_tensors_of, fill_undeformed_tensors, fill_tensor_fields
  use gauss_types_mod, only: gauss_points_of
  use output_field_mod, only: field_source_t
  implicit none
  private

  public :: make_tensors, make_undeformed_tensors, make_set_tensors

contains

  !> Stress and strain wherever the deck asks for them, in one sweep over the elements.
  subroutine make_tensors(source)
    type(field_source_t), intent(inout) :: source

    if (is_made(source%stress) .or. is_made(source%strain)) return
    associate (scene => source%scene)
      associate (asked => scene%output)
        if (asked%stress .or. asked%mises .or. asked%principal_stress) then
          call allocate_tensors(scene, source%stress)
        end if
        if (asked%strain .or. asked%principal_strain) then
          call allocate_tensors(scene, source%strain)
        end if
      end associate
      call fill_tensors_of(scene, source%state, source%strain, source%stress)
    end associate
  end subroutine make_tensors

  !> The same of those that refer to the undeformed body.
  subroutine make_undeformed_tensors(source)
    type(field_source_t), intent(inout) :: source

    if (is_made(source%pk2) .or. is_made(source%green)) return
    if (source%scene%output%pk2_stress) call allocate_tensors(source%scene, source%pk2)
    if (source%scene%output%green_strain) call allocate_tensors(source%scene, source%green)
    call fill_undeformed_tensors(source%scene, source%state, source%green, source%pk2)
  end subroutine make_undeformed_tensors

  pure logical function is_made(field)
    type(tensor_field_t), intent(in) :: field

    is_made = allocated(field%at_centroids) .or. allocated(field%at_gauss_points) .or. &
      allocated(field%at_nodes)
  end function is_made

  !> Room for a tensor wherever the deck wants it.
  subroutine allocate_tensors(scene, field)
    type(scene_t), intent(in) :: scene
    type(tensor_field_t), intent(inout) :: field

    associate (mesh => scene%mesh, output => scene%output)
      if (output%at_centroids) allocate (field%at_centroids(6, mesh%n_elements))
      if (output%at_gauss_points) then
        associate (first => first_points(mesh%connectivity))
          allocate (field%at_gauss_points(6, first(size(first)) - 1))
        end associate
      end if
      if (output%at_nodes) allocate (field%at_nodes(6, mesh%n_nodes))
    end associate
  end subroutine allocate_tensors

  !> Strain and stress of the elements of a printed set alone, a column a place, with the first
  !> field that needs them.
  subroutine make_set_tensors(source)
    type(field_source_t), intent(inout) :: source
    type(mesh_t) :: part
    type(tensor_field_t) :: of_strain, of_stress
    real(wp) :: free(source%scene%mesh%n_elements)
    integer, allocatable :: nodes(:), n_points(:)
    integer :: n, i

    if (source%tensors_of == source%print) return
    source%tensors_of = source%print
    associate (asked => source%scene%output%prints(source%print), mesh => source%scene%mesh)
      n = size(asked%members)
      n_points = gauss_points_of(mesh, asked%members)
      part%connectivity = some_elements(mesh%connectivity, asked%members)
      nodes = part%connectivity%node
      part%n_nodes = size(nodes)
      part%n_elements = n
      allocate (part%coordinates(3, size(nodes)), part%element_kind(n), part%material(n))
      part%connectivity%node = [(i, i=1, size(nodes))]
      part%coordinates = mesh%coordinates(:, nodes)
      part%origin = mesh%origin
      part%sector_angle = mesh%sector_angle
      part%element_kind = mesh%element_kind(asked%members)
      part%material = mesh%material(asked%members)
      call find_free_strain(source%scene, source%state%step, source%state%position, free)
      if (asked%at_gauss_points) then
        allocate (of_strain%at_gauss_points(6, sum(n_points)))
        allocate (of_stress%at_gauss_points(6, sum(n_points)))
      else
        allocate (of_strain%at_centroids(6, n), of_stress%at_centroids(6, n))
      end if
      call fill_tensor_fields(part, source%scene%materials, source%state%displacement(:, nodes), &
        of_strain, of_stress, free(asked%members), source%scene%finite_strain)
      if (asked%at_gauss_points) then
        source%set_strain = with_room(of_strain%at_gauss_points, n_points)
        source%set_stress = with_room(of_stress%at_gauss_points, n_points)
      else
        source%set_strain = of_strain%at_centroids
        source%set_stress = of_stress%at_centroids
      end if
    end associate
  end subroutine make_set_tensors

  !> The same room for the points of each element, 0 behind those of one that has fewer.
  pure function with_room(values, n_points) result(spread_out)
    real(wp), intent(in) :: values(:, :)  !! (6, all points)
    integer, intent(in) :: n_points(:)    !! of each element
    real(wp) :: spread_out(6, maxval(n_points)*size(n_points))
    integer :: e, before

    spread_out = 0.0_wp
    before = 0
    do e = 1, size(n_points)
      associate (room => (e - 1)*maxval(n_points))
        spread_out(:, room + 1:room + n_points(e)) = values(:, before + 1:before + n_points(e))
      end associate
      before = before + n_points(e)
    end do
  end function with_room

end module state_tensors_mod
