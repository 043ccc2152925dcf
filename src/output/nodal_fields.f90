!> What the nodes of the deck have, a column a node: fields of the mesh, of reference nodes and of
!> the sets that the deck prints are made of these.
module nodal_fields_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: cross
  use contact_points_mod, only: of_row
  use sectors_mod, only: turn_into_plane
  use pair_faces_mod, only: is_of_slave
  use scene_mod, only: scene_t, pair_turns, turn_local
  use grip_motion_mod, only: held_by_references
  use output_field_mod, only: field_source_t
  implicit none
  private

  public :: node_id, coordinates, displacement, velocity, acceleration, reaction_force, &
    applied_force, rotation, reaction_moment, applied_moment

contains

  subroutine node_id(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (1, n_nodes)

    values(1, :) = source%scene%mesh%node_id(:size(values, 2))
  end subroutine node_id

  subroutine coordinates(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (3, n_nodes)

    associate (mesh => source%scene%mesh)
      values = mesh%coordinates(:, :size(values, 2)) + spread(mesh%origin, 2, size(values, 2))
    end associate
  end subroutine coordinates

  subroutine displacement(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (3, n_nodes)

    values = source%state%displacement(:, :size(values, 2))
    call turn_local(source%scene, source%state%displacement, .true., values)
  end subroutine displacement

  !> At the end of a static *STEP 0.
  subroutine velocity(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (3, n_nodes)

    if (.not. allocated(source%state%velocity)) return
    values = source%state%velocity(:, :size(values, 2))
    call turn_local(source%scene, source%state%velocity, .true., values)
  end subroutine velocity

  !> Of nodes without mass, and at the end of a static *STEP, 0.
  subroutine acceleration(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (3, n_nodes)

    if (.not. allocated(source%state%acceleration)) return
    values = source%state%acceleration(:, :size(values, 2))
    call turn_local(source%scene, source%state%acceleration, .true., values)
  end subroutine acceleration

  subroutine reaction_force(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (3, n_nodes)

    associate (held => held_by_references(source%scene, source%state%displacement, &
               source%state%support_force))
      values = held(:, :size(values, 2))
      call turn_local(source%scene, held, .false., values)
    end associate
    call turn_into_plane(source%scene%mesh, values)
  end subroutine reaction_force

  subroutine applied_force(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (3, n_nodes)

    values = source%state%external_force(:, :size(values, 2))
    call turn_local(source%scene, source%state%external_force, .true., values)
    call turn_into_plane(source%scene%mesh, values)
  end subroutine applied_force

  !> Rotation vectors of reference nodes.
  subroutine rotation(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (3, n_nodes)
    integer :: i

    do i = 1, size(source%scene%obstacles)
      associate (obstacle => source%scene%obstacles(i))
        if (obstacle%turns) values(:, obstacle%ref_node) = source%state%rotation(:, i)
      end associate
    end do
    if (.not. allocated(source%scene%rotations)) return
    associate (of => source%scene%rotations)
      values(:, of%node) = of_rotations(source%scene, source%state%displacement, .true.)/ &
        spread(of%length, 1, 3)
    end associate
  end subroutine rotation

  !> What holds the torques of the contact forces; obstacles that share a node add up.
  subroutine reaction_moment(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (3, n_nodes)
    real(wp) :: place(3)
    integer :: i

    do i = 1, source%points%n
      if (.not. pair_turns(source%scene, source%points%pair(i))) cycle
      associate (obstacle => source%scene%obstacles(source%scene%pairs(source%points%pair( &
                   i))%master), u => source%state%displacement, &
                 x => source%scene%mesh%coordinates)
        associate (ref_node => obstacle%ref_node, weights => source%report%contact%weights)
          place = of_row(source%points, weights, i, is_of_slave(source%scene, &
            source%points, source%points%pair(i)), x + u)
          values(:, ref_node) = values(:, ref_node) + cross(place - x(:, ref_node) - &
            u(:, ref_node), source%state%reaction(:, i))
        end associate
      end associate
    end do
    if (.not. allocated(source%scene%rotations)) return
    associate (of => source%scene%rotations)
      values(:, of%node) = of_rotations(source%scene, held_by_references(source%scene, &
        source%state%displacement, source%state%support_force), .false.)*spread(of%length, 1, 3)
    end associate
  end subroutine reaction_moment

  !> Moments on reference nodes of couplings; obstacles take none.
  subroutine applied_moment(source, values)
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! (3, n_nodes)

    associate (of => source%scene%rotations)
      values(:, of%node) = of_rotations(source%scene, source%state%external_force, .true.)* &
        spread(of%length, 1, 3)
    end associate
  end subroutine applied_moment

  !> What the nodes have that stand for rotations, along x, y, z.
  pure function of_rotations(scene, of_nodes, in_place) result(values)
    type(scene_t), intent(in) :: scene
    real(wp), intent(in) :: of_nodes(:, :) !! (3,n_nodes) of the state
    logical, intent(in) :: in_place        !! as of `turn_local`
    real(wp) :: values(3, size(scene%rotations))
    real(wp), allocatable :: turned(:, :)

    allocate (turned, source=of_nodes)
    call turn_local(scene, of_nodes, in_place, turned)
    values = turned(:, scene%rotations%rotation_node)
  end function of_rotations

end module nodal_fields_mod
