!> The fields of the sets that *NODE PRINT and *EL PRINT name: entries, and how each is computed.
module print_fields_mod
  use kinds_mod, only: wp
  use dataset_kinds_mod, only: of_byte, of_long, of_real
  use controls_mod, only: print_t
  use mesh_mod, only: shown_nodes
  use scene_mod, only: scene_t
  use increments_mod, only: asked_number, ends_step
  use step_fields_mod, only: fields_due
  use gauss_types_mod, only: gauss_points_of
  use spring_fields_mod, only: add_spring_fields
  use tensor_fields_mod, only: add_tensor_fields, in_set
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
      if (asked%of_springs) then
        call add_spring_fields(size(asked%members), asked%stress, asked%strain, list)
      else if (asked%of_elements) then
        call add_field(list, field_t('element_id', of_long, [size(asked%members)], 'number', &
          'ids of the elements in the deck', at_start, compute=of_this_set))
      else
        call add_field(list, field_t('node_id', of_long, [size(asked%members)], 'number', &
          'ids of the nodes in the deck', at_start, everywhere, of_set, compute=node_id))
      end if
      call add_field(list, field_t('is_due', of_byte, one_number, 'code', &
        '1 where FREQUENCY asks for lines in the table of text, else 0', compute=of_this_set))
      if (.not. asked%of_elements) then
        call list_vectors(asked, list)
      else if (.not. asked%of_springs) then
        call list_tensors(asked, max(1, maxval(gauss_points_of(scene%mesh, asked%members))), list)
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
      of_real, [3], 'force', 'sum over the set, x, y, z', compute=of_this_set))
    if (asked%totals .and. asked%loads) call add_field(list, field_t('total_applied_force', &
      of_real, [3], 'force', 'sum over the set, x, y, z', compute=of_this_set))

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
    integer, allocatable :: extents(:)
    character(:), allocatable :: place

    if (asked%at_gauss_points) call add_field(list, field_t('n_points', of_long, &
      [size(asked%members)], 'number', 'Gauss points of the element; 0 stands behind them', &
      at_start, compute=of_this_set))
    extents = [size(asked%members)]
    place = '; mean of the element'
    if (asked%at_gauss_points) then
      extents = [n_points, extents]
      place = ' at each of the Gauss points'
    end if
    call add_tensor_fields(list, [asked%stress, asked%strain, .false., .false., asked%mises, &
      asked%principal_stress, asked%principal_strain], '', extents, in_set, [place, place], 0)
  end subroutine list_tensors

  !> A field of the set, by its name.
  subroutine of_this_set(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! a column a member; (1, 1), or (1, 3) of all

    associate (asked => source%scene%output%prints(source%print), mesh => source%scene%mesh)
      select case (source%name)
      case ('element_id')
        values(1, :) = mesh%element_id(asked%members)
      case ('n_points')
        values(1, :) = gauss_points_of(mesh, asked%members)
      case ('is_due')
        if (fields_due(asked%frequency, asked_number(source%state%position), &
          ends_step(source%scene%steps, source%state))) values = 1.0_wp
      case ('total_reaction_force')
        call add_up(source, reaction_force, values)
      case default ! total_applied_force
        call add_up(source, applied_force, values)
      end select
    end associate
  end subroutine of_this_set

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

end module print_fields_mod
