!> The fields of the sets that *NODE PRINT and *EL PRINT name: entries, and how each is computed.
module print_fields_mod
  use kinds_mod, only: wp
  use dataset_kinds_mod, only: of_byte, of_long, of_real
  use controls_mod, only: print_t
  use cells_mod, only: cells, computed_as
  use connectivity_mod, only: some_elements
  use mesh_mod, only: mesh_t, shown_nodes
  use scene_mod, only: scene_t
  use increments_mod, only: asked_number, ends_step
  use step_fields_mod, only: fields_due, tensor_field_t
  use expansion_mod, only: find_free_strain
  use invariants_mod, only: von_mises, principal_values
  use mesh_fields_mod, only: fill_tensor_fields
  use output_field_mod, only: field_t, field_list_t, field_source_t, add_field, get_fields, &
    compute_field, every_time, at_start, everywhere, of_set
  use nodal_fields_mod, only: node_id, displacement, reaction_force, applied_force
  implicit none
  private

  public :: list_print_fields

contains

  !> The fields of a set, the k-th of `scene%output%prints`.
  subroutine list_print_fields(scene, k, fields)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: k
    type(field_t), allocatable, intent(out) :: fields(:)
    type(field_list_t) :: list
    integer :: one_number(0)

    associate (asked => scene%output%prints(k))
      if (asked%of_elements) then
        call add_field(list, field_t('element_id', of_long, [size(asked%members)], 'number', &
          'ids of the elements in the deck', at_start, compute=element_id))
      else
        call add_field(list, field_t('node_id', of_long, [size(asked%members)], 'number', &
          'ids of the nodes in the deck', at_start, everywhere, of_set, compute=node_id))
      end if
      call add_field(list, field_t('is_due', of_byte, one_number, 'code', &
        '1 where FREQUENCY asks for lines in the table of text, else 0', compute=is_due))
      if (asked%of_elements) then
        call list_tensors(asked, max(1, maxval(points_of(scene%mesh, asked%members))), list)
      else
        call list_vectors(asked, list)
      end if
    end associate
    call get_fields(list, fields)
  end subroutine list_print_fields

  !> What there is at nodes.
  subroutine list_vectors(asked, list)
    type(print_t), intent(in) :: asked
    type(field_list_t), intent(inout) :: list

    if (asked%each .and. asked%displacement) call add('displacement', 'length', &
      'from the undeformed mesh, x, y, z', displacement)
    if (asked%each .and. asked%reaction) call add('reaction_force', 'force', &
      'of the supports on the body, x, y, z', reaction_force)
    if (asked%each .and. asked%loads) call add('applied_force', 'force', &
      'of the loads on the bodies, thermal expansion included, x, y, z', applied_force)
    if (asked%totals .and. asked%reaction) call add_field(list, field_t('total_reaction_force', &
      of_real, [3], 'force', 'sum over the set, x, y, z', compute=total_reaction))
    if (asked%totals .and. asked%loads) call add_field(list, field_t('total_applied_force', &
      of_real, [3], 'force', 'sum over the set, x, y, z', compute=total_loads))

  contains

    subroutine add(name, quantity, description, compute)
      character(*), intent(in) :: name, quantity, description
      procedure(compute_field) :: compute

      call add_field(list, field_t(name, of_real, [3, size(asked%members)], quantity, &
        description, every_time, everywhere, of_set, compute=compute))
    end subroutine add

  end subroutine list_vectors

  !> What there is at elements: the mean of each, or at its Gauss points.
  subroutine list_tensors(asked, n_points, list)
    type(print_t), intent(in) :: asked
    integer, intent(in) :: n_points !! of an element, at most
    type(field_list_t), intent(inout) :: list

    if (asked%at_gauss_points) call add_field(list, field_t('n_points', of_long, &
      [size(asked%members)], 'number', 'Gauss points of the element; 0 stands behind them', &
      at_start, compute=n_points_of_set))
    if (asked%stress) call add('stress', 6, 'pressure', 'XX, YY, ZZ, XY, YZ, XZ', stress_of_set)
    if (asked%strain) call add('strain', 6, 'strain', &
      'XX, YY, ZZ, XY, YZ, XZ as tensor components', strain_of_set)
    if (asked%mises) call add('von_mises', 1, 'pressure', 'von Mises stress', mises_of_set)
    if (asked%principal_stress) call add('principal_stress', 3, 'pressure', 'the largest first', &
      principal_stress_of_set)
    if (asked%principal_strain) call add('principal_strain', 3, 'strain', 'the largest first', &
      principal_strain_of_set)

  contains

    subroutine add(name, n, quantity, description, compute)
      character(*), intent(in) :: name, quantity, description
      integer, intent(in) :: n !! numbers at each place
      procedure(compute_field) :: compute
      integer, allocatable :: extents(:)
      character(:), allocatable :: place

      extents = [size(asked%members)]
      place = '; mean of the element'
      if (asked%at_gauss_points) then
        extents = [n_points, extents]
        place = ' at each of the Gauss points'
      end if
      if (n > 1) extents = [n, extents]
      place = description//place ! by a name, for gfortran does not free one made in the list
      call add_field(list, field_t(name, of_real, extents, quantity, place, compute=compute))
    end subroutine add

  end subroutine list_tensors

  subroutine element_id(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (1, members)

    values(1, :) = source%scene%mesh%element_id(source%scene%output%prints(source%print)%members)
  end subroutine element_id

  subroutine n_points_of_set(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (1, members)

    values(1, :) = points_of(source%scene%mesh, source%scene%output%prints(source%print)%members)
  end subroutine n_points_of_set

  subroutine is_due(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (1, 1)

    associate (asked => source%scene%output%prints(source%print))
      if (fields_due(asked%frequency, asked_number(source%state%position), &
        ends_step(source%scene%steps, source%state))) then
        values = 1.0_wp
      end if
    end associate
  end subroutine is_due

  ! ------------------------------------------------------------------ nodes

  subroutine total_reaction(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (1, 3)

    call add_up(source, reaction_force, values)
  end subroutine total_reaction

  subroutine total_loads(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (1, 3)

    call add_up(source, applied_force, values)
  end subroutine total_loads

  !> The sum of what nodes have over the set.
  subroutine add_up(source, field, values)
    type(field_source_t), intent(inout) :: source
    procedure(compute_field) :: field
    real(wp), intent(inout) :: values(:, :) !! (1, 3)
    real(wp), allocatable :: of_all(:, :)

    allocate (of_all(3, shown_nodes(source%scene%mesh)), source=0.0_wp)
    call field(source, of_all)
    values(1, :) = sum(of_all(:, source%scene%output%prints(source%print)%summed), dim=2)
  end subroutine add_up

  ! ------------------------------------------------------------------ elements

  subroutine stress_of_set(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! of block_shape

    call make_tensors(source)
    values = reshape(source%set_stress, shape(values))
  end subroutine stress_of_set

  subroutine strain_of_set(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :)

    call make_tensors(source)
    values = reshape(source%set_strain, shape(values))
  end subroutine strain_of_set

  subroutine mises_of_set(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :)

    call make_tensors(source)
    values = reshape(von_mises(source%set_stress), shape(values))
  end subroutine mises_of_set

  subroutine principal_stress_of_set(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :)

    call make_tensors(source)
    call fill_principal(source%set_stress, values)
  end subroutine principal_stress_of_set

  subroutine principal_strain_of_set(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :)

    call make_tensors(source)
    call fill_principal(source%set_strain, values)
  end subroutine principal_strain_of_set

  subroutine fill_principal(tensor, values)
    real(wp), intent(in) :: tensor(:, :) !! (6, places)
    real(wp), intent(inout) :: values(:, :)
    real(wp) :: principal(3, size(tensor, 2))

    call principal_values(tensor, principal)
    values = reshape(principal, shape(values))
  end subroutine fill_principal

  !> Strain and stress of the set's elements alone, a column a place, with the first field that
  !> needs them.
  subroutine make_tensors(source)
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
      n_points = points_of(mesh, asked%members)
      part%connectivity = some_elements(mesh%connectivity, asked%members)
      nodes = part%connectivity%node
      part%n_nodes = size(nodes)
      part%n_elements = n
      allocate (part%coordinates(3, size(nodes)), part%element_kind(n), part%material(n))
      part%connectivity%node = [(i, i=1, size(nodes))]
      part%coordinates = mesh%coordinates(:, nodes)
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
  end subroutine make_tensors

  !> Gauss points of each of some elements.
  pure function points_of(mesh, elements) result(n)
    type(mesh_t), intent(in) :: mesh
    integer, intent(in) :: elements(:)
    integer :: n(size(elements))

    n = cells(computed_as(mesh%connectivity%cell(elements)))%n_points
  end function points_of

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

end module print_fields_mod
