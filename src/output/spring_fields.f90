!> The fields of springs: what each draws its ends together with, and how much longer it is.
module spring_fields_mod
  use kinds_mod, only: wp
  use dataset_kinds_mod, only: of_long, of_real
  use scene_mod, only: scene_t
  use spring_elements_mod, only: listed_springs, spring_state, spring_state_t
  use output_field_mod, only: field_t, field_list_t, field_source_t, add_field, get_fields, at_start
  implicit none
  private

  public :: list_spring_fields, add_spring_fields

contains

  !> The fields of all springs; none where the scene has no springs.
  subroutine list_spring_fields(scene, fields)
    type(scene_t), intent(in) :: scene
    type(field_t), allocatable, intent(out) :: fields(:)
    type(field_list_t) :: list
    integer :: n

    n = listed_springs(scene%mesh%springs)
    if (n > 0) call add_spring_fields(n, .true., .true., list)
    call get_fields(list, fields)
  end subroutine list_spring_fields

  !> The fields of some springs: of a set that the deck prints, or of all.
  subroutine add_spring_fields(n, with_force, with_elongation, list)
    integer, intent(in) :: n
    logical, intent(in) :: with_force, with_elongation
    type(field_list_t), intent(inout) :: list

    call add_field(list, field_t('element_id', of_long, [n], 'number', &
      'ids of the springs in the deck', at_start, compute=of_springs))
    if (with_force) call add_field(list, field_t('spring_force', of_real, [n], 'force', &
      'stiffness times elongation, or by its table; of SPRINGA positive where it draws its '// &
      'nodes together', &
      compute=of_springs))
    if (with_elongation) call add_field(list, field_t('elongation', of_real, [n], 'length', &
      'of SPRINGA change of length; of SPRING1 displacement along its dof, of SPRING2 that of '// &
      'the first node less that of the second', compute=of_springs))
  end subroutine add_spring_fields

  !> A field of springs, by its name.
  subroutine of_springs(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (1, springs)
    type(spring_state_t) :: state
    integer, allocatable :: chosen(:)
    integer :: i

    associate (mesh => source%scene%mesh)
      chosen = [(i, i=1, listed_springs(mesh%springs))]
      if (source%print > 0) chosen = source%scene%output%prints(source%print)%members
      if (source%name == 'element_id') then
        values(1, :) = mesh%springs%id(chosen)
        return
      end if
      do i = 1, size(chosen)
        state = spring_state(mesh%springs, chosen(i), mesh%coordinates, &
          source%state%displacement, source%scene%finite_strain)
        values(1, i) = merge(state%pull, state%elongation, source%name == 'spring_force')
      end do
    end associate
  end subroutine of_springs

end module spring_fields_mod
