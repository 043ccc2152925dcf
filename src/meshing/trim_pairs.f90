!> What of the pairs of general contact can touch nothing, by what the steps hold and move: it is
!> left out, and costs nothing. docs/theory.md section 11.
module trim_pairs_mod
  use cells_mod, only: face_corners
  use connectivity_mod, only: corners_in, nodes_of_face
  use faces_mod, only: face_area_vectors
  use face_directions_mod, only: directions_of, directions_t, looks_at
  use kinds_mod, only: wp
  use loads_mod, only: amplitude_range, amplitude_t, load_step_t, nodal_value_t
  use matching_faces_mod, only: held_throughout
  use mesh_mod, only: deck_rounding
  use obstacle_shapes_mod, only: is_meshed
  use obstacles_mod, only: obstacle_t
  use scene_mod, only: contact_pair_t
  use sets_mod, only: model_t
  use surface_list_mod, only: add_faces, surface_list_t
  use surfaces_mod, only: nodes_of
  implicit none
  private

  public :: trim_pairs

contains

  !> Leave faces out of the pairs of general contact, and pairs that have none left.
  !>
  !> - Faces on planes of symmetry: those that supports hold at rest across an axis at right angles
  !>   to them, and beyond which nothing of the other side lies. They would see the far end of a
  !>   slice through where bodies overlap between their nodes.
  !> - At small strain, where normals do not turn, faces before which nothing of the other body is
  !>   turned towards them, even where it moves by twice the largest prescribed displacement.
  subroutine trim_pairs(model, is_finite, amplitudes, obstacles, surfaces, pairs, steps)
    type(model_t), intent(in) :: model
    logical, intent(in) :: is_finite            !! strains are
    type(amplitude_t), intent(in) :: amplitudes(:)
    type(obstacle_t), intent(in) :: obstacles(:)
    type(surface_list_t), intent(inout) :: surfaces
    type(contact_pair_t), allocatable, intent(inout) :: pairs(:)
    type(load_step_t), intent(inout) :: steps(:)
    logical :: has_faces(size(pairs))
    logical, allocatable :: held(:, :)
    type(directions_t) :: of_slave, of_master
    real(wp) :: close_by, way
    integer :: p

    if (.not. any(pairs%is_general)) return
    allocate (held, source=held_throughout(steps, model%mesh%n_nodes))
    associate (x => model%mesh%coordinates(:, :model%mesh%n_nodes))
      close_by = max(1.0e-9_wp*maxval(maxval(x, 2) - minval(x, 2)), 16.0_wp*deck_rounding(x, &
        model%mesh%origin))
      way = 2.0_wp*largest_motion(steps, amplitudes, norm2(maxval(x, 2) - minval(x, 2)))
    end associate
    has_faces = .true.
    do p = 1, size(pairs)
      if (.not. pairs(p)%is_general) cycle
      associate (slave => pairs(p)%surface, master => pairs(p)%master_surface)
        if (master == 0) then
          associate (obstacle => obstacles(pairs(p)%master))
            if (is_meshed(obstacle)) call leave_out(slave, stays_off_planes(slave, minval( &
              obstacle%corner, 2), maxval(obstacle%corner, 2)), has_faces(p))
          end associate
          cycle
        end if
        if (slave == master) then
          associate (box => box_of(slave))
            call leave_out(slave, stays_off_planes(slave, box(:, 1), box(:, 2)), has_faces(p))
          end associate
          if (.not. is_finite .and. has_faces(p)) then
            of_slave = its_directions(slave)
            call leave_out(slave, looking(slave, of_slave, way + pairs(p)%overlap), has_faces(p))
          end if
          master = slave
          cycle
        end if
        associate (s => box_of(slave), m => box_of(master))
          call leave_out(slave, stays_off_planes(slave, m(:, 1), m(:, 2)), has_faces(p))
          call leave_out(master, stays_off_planes(master, s(:, 1), s(:, 2)), has_faces(p))
        end associate
        if (is_finite .or. .not. has_faces(p)) cycle
        of_slave = its_directions(slave)
        of_master = its_directions(master)
        call leave_out(slave, looking(slave, of_master, way + pairs(p)%overlap), has_faces(p))
        call leave_out(master, looking(master, of_slave, way + pairs(p)%overlap), has_faces(p))
      end associate
    end do
    call drop_pairs(has_faces, pairs, steps)

  contains

    pure function box_of(surface) result(box)
      integer, intent(in) :: surface
      real(wp) :: box(3, 2)

      associate (x => model%mesh%coordinates(:, surfaces%list(surface)%nodes))
        box(:, 1) = minval(x, 2)
        box(:, 2) = maxval(x, 2)
      end associate
    end function box_of

    !> Give a pair a surface of some of the faces of its own; others keep theirs.
    subroutine leave_out(surface, stays, has_any)
      integer, intent(inout) :: surface
      logical, intent(in) :: stays(:)  !! (n_faces)
      logical, intent(inout) :: has_any !! false where none does
      integer, allocatable :: faces(:, :)
      character(:), allocatable :: name
      integer :: f

      has_any = has_any .and. any(stays)
      if (all(stays) .or. .not. has_any) return
      allocate (faces, source=surfaces%list(surface)%faces(:, pack([(f, f=1, size(stays))], stays)))
      name = surfaces%list(surface)%name
      call add_faces(model%mesh, name, faces, surfaces, surface)
    end subroutine leave_out

    !> Which faces of a surface do not lie on planes of symmetry.
    pure function stays_off_planes(surface, low, high) result(stays)
      integer, intent(in) :: surface
      real(wp), intent(in) :: low(3), high(3) !! the box of the other side [length]
      logical :: stays(size(surfaces%list(surface)%faces, 2))
      integer :: f

      associate (faces => surfaces%list(surface)%faces)
        do f = 1, size(stays)
          stays(f) = .not. is_on_plane(nodes_of_face(model%mesh%connectivity, faces(1, f), &
            faces(2, f)), low, high)
        end do
      end associate
    end function stays_off_planes

    pure logical function is_on_plane(face, low, high)
      integer, intent(in) :: face(:)
      real(wp), intent(in) :: low(3), high(3)
      real(wp) :: outwards(3)
      integer :: axis

      is_on_plane = .false.
      associate (node => face(:corners_in(face)))
        associate (x => model%mesh%coordinates(:, node))
          outwards = sum(face_area_vectors(x), 2)
          do axis = 1, 3
            if (.not. all(held(axis, node))) cycle
            if (maxval(x(axis, :)) - minval(x(axis, :)) > close_by) cycle
            if (outwards(axis) > 0.0_wp) then
              is_on_plane = is_on_plane .or. (low(axis) < maxval(x(axis, :)) - close_by .and. &
                high(axis) <= maxval(x(axis, :)) + close_by)
            else
              is_on_plane = is_on_plane .or. (high(axis) > minval(x(axis, :)) + close_by .and. &
                low(axis) >= minval(x(axis, :)) - close_by)
            end if
          end do
        end associate
      end associate
    end function is_on_plane

    !> The faces of a surface by their directions.
    pure type(directions_t) function its_directions(surface) result(of)
      integer, intent(in) :: surface

      of = directions_of(nodes_of(surfaces%list(surface)%faces, model%mesh%connectivity), &
        model%mesh%coordinates)
    end function its_directions

    !> Which faces of a surface have something before them that may be turned towards them.
    pure function looking(surface, other, depth) result(looks)
      integer, intent(in) :: surface
      type(directions_t), intent(in) :: other
      real(wp), intent(in) :: depth !! that counts as before a face, too [length]
      logical :: looks(size(surfaces%list(surface)%faces, 2))
      integer :: f, node(face_corners)

      associate (faces => surfaces%list(surface)%faces)
        do f = 1, size(looks)
          node = nodes_of_face(model%mesh%connectivity, faces(1, f), faces(2, f))
          looks(f) = looks_at(model%mesh%coordinates(:, node(:corners_in(node))), other, depth + &
            close_by)
        end do
      end associate
    end function looking

  end subroutine trim_pairs

  !> How far supports move anything at most: by displacements, and by rotations across the mesh.
  pure real(wp) function largest_motion(steps, amplitudes, length) result(largest)
    type(load_step_t), intent(in) :: steps(:)
    type(amplitude_t), intent(in) :: amplitudes(:)
    real(wp), intent(in) :: length   !! of the mesh [length]
    integer :: s, i

    largest = 0.0_wp
    do s = 1, size(steps)
      do i = 1, size(steps(s)%boundary)
        largest = max(largest, farthest(steps(s)%boundary(i)))
      end do
      if (.not. allocated(steps(s)%rotations)) cycle
      do i = 1, size(steps(s)%rotations)
        largest = max(largest, length*farthest(steps(s)%rotations(i)))
      end do
    end do
    largest = sqrt(3.0_wp)*largest

  contains

    pure real(wp) function farthest(of)
      type(nodal_value_t), intent(in) :: of

      farthest = abs(of%value)
      if (of%amplitude > 0) farthest = maxval(abs(of%from + of%value*amplitude_range( &
        amplitudes(of%amplitude))))
    end function farthest

  end function largest_motion

  !> Leave out pairs; those that steps name stay. What steps say of others keeps its pairs.
  subroutine drop_pairs(keeps, pairs, steps)
    logical, intent(in) :: keeps(:)     !! (n_pairs)
    type(contact_pair_t), allocatable, intent(inout) :: pairs(:)
    type(load_step_t), intent(inout) :: steps(:)
    type(contact_pair_t), allocatable :: left(:)
    logical :: stays(size(pairs))
    integer :: number(size(pairs)), p, s, n

    stays = keeps .or. pairs%has_clearance
    do s = 1, size(steps)
      if (allocated(steps(s)%interferences)) stays(steps(s)%interferences%pair) = .true.
      if (allocated(steps(s)%pair_changes)) stays(steps(s)%pair_changes%pair) = .true.
    end do
    if (all(stays)) return
    allocate (left(count(stays)))
    number = 0
    n = 0
    do p = 1, size(pairs)
      if (.not. stays(p)) cycle
      n = n + 1
      number(p) = n
      left(n) = pairs(p)
    end do
    call move_alloc(left, pairs)
    do s = 1, size(steps)
      if (allocated(steps(s)%interferences)) steps(s)%interferences%pair = &
        number(steps(s)%interferences%pair)
      if (allocated(steps(s)%pair_changes)) steps(s)%pair_changes%pair = &
        number(steps(s)%pair_changes%pair)
      if (.not. allocated(steps(s)%frictions)) cycle
      steps(s)%frictions%pair = number(steps(s)%frictions%pair)
      steps(s)%frictions = pack(steps(s)%frictions, steps(s)%frictions%pair > 0)
    end do
  end subroutine drop_pairs

end module trim_pairs_mod
