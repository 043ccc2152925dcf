!> The fields of a contact pair, at its points: entries, and how each is computed.
module pair_fields_mod
  use kinds_mod, only: wp
  use errors_mod, only: raise, exit_machine
  use dataset_kinds_mod, only: of_real, of_byte, of_long
  use mesh_mod, only: element_rows, axisymmetric
  use small_matrix_mod, only: cross
  use obstacles_mod, only: on_axis
  use obstacle_shapes_mod, only: has_fixed_normals, is_before_faces
  use pair_faces_mod, only: is_of_slave
  use scene_mod, only: scene_t
  use step_contact_mod, only: changes_friction, changes_pairs, friction_in
  use sectors_mod, only: turn_sum_into_plane
  use contact_points_mod, only: is_pair_removed, n_sides, find_side_points, of_row
  use interference_mod, only: has_interference, allowed_interference
  use increment_report_mod, only: status_open, force_sums, largest_pressure, &
    is_redundant_at
  use state_mod, only: largest_slip
  use output_field_mod, only: field_t, field_list_t, field_source_t, add_field, get_fields, &
    every_time, first_time, at_start
  use master_fields_mod, only: add_master_fields
  implicit none
  private

  public :: list_pair_fields

contains

  !> The fields of pair i, which has n points.
  subroutine list_pair_fields(scene, i, n, fields)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: i, n
    type(field_t), allocatable, intent(out) :: fields(:)
    type(field_list_t) :: list
    integer :: one_number(0)
    integer :: of_frame

    of_frame = every_time
    if (has_fixed_normals(scene, i)) of_frame = first_time
    call add_field(list, field_t('node', of_long, [n], 'number', &
      'slave node of each point: index into Points, from 0', at_start, compute=of_points))
    call add_field(list, field_t('coordinates', of_real, [3, n], 'length', &
      'where each point is in the undeformed mesh', at_start, compute=of_points))
    call add_field(list, field_t('area', of_real, [n], 'area', &
      'share of the slave surface; 0 where no face of it is', at_start, compute=of_points))
    call add_field(list, field_t('extra_gap', of_real, [n], 'length', &
      'what *CONTACT GAP and *CLEARANCE add to the distance that the mesh says, and an overlap '// &
      'that constraints keep as it is', at_start, compute=of_points))
    call add_field(list, field_t('middle', of_real, [3], 'length', &
      'what the table at the end of a run has moments about: the middle of the slave surface, '// &
      'or the point of the axis beside it where the pair has one', at_start, compute=middle))
    if (has_interference(scene)) then
      call add_field(list, field_t('allowed_interference', of_real, [n], 'length', &
        'what *CONTACT INTERFERENCE lets each point overlap by; the gap has it added', &
        compute=of_pair))
    end if
    if (changes_friction(scene)) call add_field(list, field_t('friction', of_real, one_number, &
      'ratio', 'coefficient of friction', compute=of_pair))
    if (changes_pairs(scene)) call add_field(list, field_t('is_removed', of_byte, one_number, &
      'code', '1: *MODEL CHANGE has removed the pair, whose points face nothing; else 0', &
      compute=of_pair))
    call add_field(list, field_t('frame', of_real, [3, 3, n], 'ratio', &
      'local frame: rows n (from the master to the slave body), t1, t2; one for the whole run '// &
      'where it is fixed', of_frame, compute=of_pair))
    call add_field(list, field_t('reaction', of_real, [3, n], 'force', &
      'on the slave body, local', compute=of_pair))
    call add_field(list, field_t('gap', of_real, [n], 'length', &
      'distance along n; 1e30 where no master is', compute=of_pair))
    call add_field(list, field_t('slip_increment', of_real, [2, n], 'length', &
      'slip in the increment, along t1, t2', compute=of_pair))
    call add_field(list, field_t('slip', of_real, [2, n], 'length', &
      'sum of the slip increments', compute=of_pair))
    call add_field(list, field_t('status', of_byte, [n], 'code', &
      '0: open, 1: stick, 2: slide', compute=of_pair))
    if (scene%constraints%n > 0) then
      call add_field(list, field_t('redundant', of_byte, [n], 'code', &
        '1: constraints can carry the reaction; the least is given', compute=of_pair))
    end if
    call add_field(list, field_t('resultant', of_real, [3], 'force', &
      'sum of the reactions on the slave body, x, y, z', compute=of_pair))
    call add_field(list, field_t('moment', of_real, [3], 'moment', &
      'moment of the reactions on the slave body about the origin, undeformed arms', &
      compute=moment))
    call add_field(list, field_t('forces', of_real, [3, 2], 'force', &
      'sum of the normal reactions and sum of the friction on the slave body, each x, y, z', &
      compute=forces))
    call add_field(list, field_t('largest_pressure', of_real, one_number, 'pressure', &
      'normal reaction over the area of its point, the largest', compute=of_pair))
    call add_field(list, field_t('largest_slip', of_real, one_number, 'length', &
      'sum of the slip increments of a point, the longest', compute=of_pair))
    call add_master_fields(scene, i, list)
    if (scene%finite_strain .or. is_before_faces(scene%pairs(i), scene%obstacles)) call add_field( &
      list, field_t('covered_area', of_real, [n], 'area', &
      'of the node''s share what the master covers; 0: no gap, no reaction', &
      compute=of_pair))
    if (is_before_faces(scene%pairs(i), scene%obstacles)) then
      call add_field(list, field_t('is_partly_covered', of_byte, [n], 'code', &
        '1: the master covers less than half of what of the node''s share is turned towards '// &
        'it; the pressure there is left out of largest_pressure, else 0', &
        compute=of_pair))
      call add_field(list, field_t('master_side', of_long, [n], 'number', &
        'side of the master that the point is before, from 1: concave edges of more than 30 '// &
        'degrees divide it into sides, and a slave node has a point before each', at_start, &
        compute=master_side))
      call add_field(list, field_t('least_gap', of_real, [n], 'length', &
        'least distance along the master''s normals in the faces about the node, at '// &
        'points of the quadrature and corners of what two faces share', compute=of_pair))
      call add_field(list, field_t('moment_left', of_real, [3], 'moment', &
        'moment about the origin of all forces of the pair, on both sides, deformed arms', &
        compute=moment_left))
    end if
    if (scene%pairs(i)%master > 0) then
      call add_field(list, field_t('torque', of_real, [3], 'moment', &
        'moment of the contact forces on the obstacle about its reference node, where both are '// &
        '(the origin where it has none), x, y, z', compute=torque))
    end if
    if (scene%output%contact_table) then
      call add_field(list, field_t('contact_area', of_real, one_number, 'area', &
        'of the points that do not stand open, as far as the master covers it', &
        compute=of_pair))
    end if
    call get_fields(list, fields)
  end subroutine list_pair_fields

  !> A field of the points that is written before there is an increment, by its name.
  subroutine of_points(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! a column a point
    integer :: row(source%scene%mesh%n_nodes)

    associate (mesh => source%scene%mesh, points => source%points, first => source%first, &
               last => source%last)
      select case (source%name)
      case ('node')
        row = element_rows(mesh)
        values(1, :) = row(points%node(first:last)) - 1
      case ('coordinates')
        values = mesh%coordinates(:, points%node(first:last)) + spread(mesh%origin, 2, &
          last - first + 1)
      case ('area')
        values(1, :) = points%area(first:last)
      case default ! extra_gap
        if (.not. allocated(points%extra_gap)) return
        values(1, :) = points%extra_gap(first:last)
        if (allocated(points%constant_gap)) values(1, :) = points%constant_gap(first:last)
      end select
    end associate
  end subroutine of_points

  !> A field of the points or of the pair at the end of an increment, by its name.
  subroutine of_pair(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! a column a point, or (1, 1) or (1, 3) of the pair
    real(wp) :: mu(size(source%scene%pairs)), overlap(source%points%n)
    integer :: i

    associate (scene => source%scene, points => source%points, state => source%state, &
               contact => source%report%contact, first => source%first, last => source%last)
      select case (source%name)
      case ('allowed_interference')
        overlap = allowed_interference(scene, points, state%step, state%position)
        values(1, :) = overlap(first:last)
      case ('friction')
        mu = friction_in(scene, state%step)
        values = mu(source%pair)
      case ('is_removed')
        values = merge(1.0_wp, 0.0_wp, is_pair_removed(points, source%pair))
      case ('frame')
        values = reshape(contact%frame(:, :, first:last), shape(values))
      case ('reaction')
        values = contact%reaction(:, first:last)
      case ('gap')
        values(1, :) = contact%gap(first:last)
      case ('slip_increment')
        values = contact%slip_increment(:, first:last)
      case ('slip')
        values = state%slip(:, first:last)
      case ('status')
        values(1, :) = contact%status(first:last)
      case ('redundant')
        values(1, :) = [(merge(1, 0, is_redundant_at(contact, i)), i=first, last)]
      case ('resultant')
        values(1, :) = turn_sum_into_plane(scene%mesh, sum(state%reaction(:, first:last), &
          dim=2))
      case ('largest_pressure')
        values = largest_pressure(contact, first, last)
      case ('largest_slip')
        values = largest_slip(state, first, last)
      case ('covered_area')
        values(1, :) = contact%covered_area(first:last)
      case ('is_partly_covered')
        values(1, :) = merge(1.0_wp, 0.0_wp, contact%is_partly_covered(first:last))
      case ('least_gap')
        values(1, :) = contact%least_gap(first:last)
      case ('contact_area')
        values = sum(contact%covered_area(first:last), mask=contact%status(first:last) /= &
          status_open)
      case default
        call raise(source%error, exit_machine, 'internal error: '//source%name//' of a pair')
      end select
    end associate
  end subroutine of_pair

  !> The middle of the slave surface; before a cylinder the point of its axis that is nearest to it,
  !> and of bodies of revolution the origin: all forces together have a moment about the axis alone.
  subroutine middle(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (1, 3)
    real(wp) :: x(3), area(source%last - source%first + 1)

    if (source%last < source%first) return
    associate (mesh => source%scene%mesh, points => source%points, first => source%first, &
               last => source%last, master => source%scene%pairs(source%pair)%master)
      area = points%area(first:last)
      if (.not. any(area > 0.0_wp)) area = 1.0_wp
      x = matmul(mesh%coordinates(:, points%node(first:last)), area)/sum(area)
      if (master > 0) then
        x = on_axis(source%scene%obstacles(master), x)
      end if
      x = x + mesh%origin
      if (mesh%plane == axisymmetric) x = 0.0_wp
      values(1, :) = x
    end associate
  end subroutine middle

  subroutine forces(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (3, 2)

    associate (sums => force_sums(source%report%contact, source%first, source%last))
      values(:, 1) = turn_sum_into_plane(source%scene%mesh, sums(:, 1))
      values(:, 2) = turn_sum_into_plane(source%scene%mesh, sums(:, 2))
    end associate
  end subroutine forces

  subroutine moment(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (1, 3)
    logical :: is_own(source%scene%mesh%n_nodes)
    integer :: i

    if (source%last < source%first) return
    is_own = is_of_slave(source%scene, source%points, source%points%pair(source%first))
    do i = source%first, source%last
      values(1, :) = values(1, :) + cross(of_row(source%points, source%report%contact%weights, i, &
        is_own, source%scene%mesh%coordinates), source%state%reaction(:, i))
    end do
    values(1, :) = values(1, :) + cross(source%scene%mesh%origin, sum(source%state%reaction(:, &
      source%first:source%last), dim=2))
  end subroutine moment

  subroutine master_side(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (1, its points)
    integer :: side, first, last

    do side = 1, n_sides(source%points, source%pair)
      call find_side_points(source%points, source%pair, side, first, last)
      values(1, first - source%first + 1:last - source%first + 1) = side
    end do
  end subroutine master_side

  !> What the arms of slave nodes and of what they face differ by: (11.9) of docs/theory.md.
  subroutine moment_left(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (1, 3)
    real(wp) :: between(3)
    integer :: i, k

    associate (x => source%scene%mesh%coordinates, u => source%state%displacement, &
               weights => source%report%contact%weights)
      do i = source%first, source%last
        associate (node => source%points%node(i))
          between = x(:, node) + u(:, node)
        end associate
        if (source%scene%pairs(source%points%pair(i))%master > 0) then
          values(1, :) = values(1, :) + cross(source%report%contact%apart(:, i), &
            source%state%reaction(:, i))
          cycle
        end if
        do k = weights%first(i), weights%first(i + 1) - 1
          associate (node => weights%node(k))
            between = between - weights%weight(k)*(x(:, node) + u(:, node))
          end associate
        end do
        values(1, :) = values(1, :) + cross(between, source%state%reaction(:, i))
      end do
    end associate
  end subroutine moment_left

  !> Of the forces on the obstacle, at the places of the slave nodes. docs/theory.md (9.9).
  subroutine torque(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (1, 3)
    logical :: is_own(source%scene%mesh%n_nodes)
    real(wp) :: centre(3), place(3)
    integer :: i, ref_node

    if (source%last < source%first) return
    ref_node = source%scene%obstacles(source%scene%pairs(source%points%pair(source%first))% &
      master)%ref_node
    centre = -source%scene%mesh%origin
    associate (x => source%scene%mesh%coordinates, u => source%state%displacement, &
               weights => source%report%contact%weights)
      if (ref_node > 0) centre = x(:, ref_node) + u(:, ref_node)
      is_own = is_of_slave(source%scene, source%points, source%points%pair(source%first))
      do i = source%first, source%last
        place = of_row(source%points, weights, i, is_own, x + u)
        values(1, :) = values(1, :) - cross(place - centre, source%state%reaction(:, i))
      end do
    end associate
  end subroutine torque

end module pair_fields_mod
