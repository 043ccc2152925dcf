!> Rigid obstacles.
!>
!>     *OBSTACLE, NAME=GROUND, TYPE=PLANE
!>     0., 0., 0.,  0., 0., 1.        a point of the plane, its normal towards the body
!>     *OBSTACLE, NAME=BALL, TYPE=SPHERE, REF NODE=1000
!>     0., 0., 5.,  5.                centre, radius
!>     *OBSTACLE, NAME=BORE, TYPE=CYLINDER, INNER
!>     0., 0., 0.,  0., 0., 1.,  2.   a point of the axis, its direction, radius
!>     *OBSTACLE, NAME=PUNCH, TYPE=CONE
!>     0., 0., 9.,  0., 0., -1.,  4., 3., 5.     centre of an end, direction of the axis, radius
!>                                    there and at the other end, height
!>     *OBSTACLE, NAME=DIE, TYPE=STL, INPUT=die.stl, REF NODE=1001
!>
!> and analytical surfaces that are one of these (read_analytical_mod).
module read_obstacles_mod
  use cards_mod, only: note, reader_t, report
  use diagnostics_mod, only: quoted
  use name_table_mod, only: add_named, close_directory, name_table_t, open_directory
  use fields_mod, only: field_position, fields_t, next_data_line, node_option, real_field
  use kinds_mod, only: wp
  use lookup_mod, only: find_id
  use mesh_draft_mod, only: mesh_draft_t
  use obstacles_mod, only: obstacle_cylinder, obstacle_facets, obstacle_of_facets, obstacle_plane, &
    obstacle_sphere, obstacle_t
  use options_mod, only: allow_no_data, allow_options, card_t, choice_option, flag_option, &
    has_option, integer_option, name_option, open_card, option_position, text_option
  use deck_source_mod, only: place_of, place_t
  use read_analytical_mod, only: facets_about, is_analytical, read_analytical
  use sets_mod, only: model_t
  use stl_file_mod, only: read_stl, triangles_t
  use swept_profile_mod, only: facets_t, frustum, turn_about_axis
  use text_mod, only: to_text
  implicit none
  private

  public :: read_obstacles, analytical_surface

  character(*), parameter :: analytical_surface = 'ANALYTICAL SURFACE' !! option of *RIGID BODY

  integer, parameter :: cone = 4, stl = 5 !! place among the words of TYPE=
  integer, parameter :: kinds(5) = [obstacle_plane, obstacle_sphere, obstacle_cylinder, &
    obstacle_facets, obstacle_facets]
  integer, parameter :: max_numbers = 9 !! of any kind

contains

  !> *OBSTACLE, NAME=name, TYPE=PLANE|SPHERE|CYLINDER[, REF NODE=id][, INNER]
  !> *OBSTACLE, NAME=name, TYPE=CONE[, FACETS=count][, REF NODE=id][, INNER]
  !> *OBSTACLE, NAME=name, TYPE=STL, INPUT=path[, REF NODE=id]
  subroutine read_obstacles(reader, model, obstacles, names)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(inout) :: model     !! its reference nodes are marked
    type(obstacle_t), allocatable, intent(out) :: obstacles(:)
    type(name_table_t), intent(out) :: names
    type(card_t) :: card
    character(:), allocatable :: name
    integer :: k, n, kind
    logical :: ok

    call open_directory(reader, 'OBSTACLE', 'obstacle', names, n, &
      others=count([(is_analytical(reader, k), k=1, reader%n_cards)]))
    allocate (obstacles(n))
    do k = 1, reader%n_cards
      if (is_analytical(reader, k)) call read_analytical_one()
      if (reader%cards(k)%keyword /= 'OBSTACLE') cycle
      call open_card(reader, k, card)
      call allow_options(reader, card)
      call add_named(reader, card, names, name)
      obstacles(names%n)%name = name
      call read_reference_node(reader, card, 'an obstacle', model, obstacles(names%n)%ref_node)
      call flag_option(reader, card, 'INNER', obstacles(names%n)%inner)
      kind = 0
      call choice_option(reader, card, 'TYPE', kind, ok)
      if (.not. has_option(card, 'TYPE')) call report(reader, card%position, &
        '*OBSTACLE needs TYPE=')
      if (kind == 0) cycle
      obstacles(names%n)%kind = kinds(kind)
      if (kind /= cone .and. has_option(card, 'FACETS')) call report(reader, &
        option_position(card, 'FACETS'), 'FACETS is of TYPE=CONE alone')
      if (kind == stl) then
        call read_facets(reader, card, model%mesh%origin, obstacles(names%n))
        cycle
      end if
      if (has_option(card, 'INPUT')) call report(reader, option_position(card, 'INPUT'), &
        'INPUT is of TYPE=STL alone')
      if (kind == cone) then
        call read_cone(reader, card, model%mesh, obstacles(names%n))
      else
        call read_shape(reader, card, model%mesh%origin, obstacles(names%n))
      end if
    end do
    call close_directory(reader, names)

  contains

    !> An analytical *SURFACE, with the reference node of its *RIGID BODY.
    subroutine read_analytical_one()
      type(card_t) :: body
      character(:), allocatable :: of_body
      integer :: i

      call open_card(reader, k, card)
      call add_named(reader, card, names, name)
      associate (obstacle => obstacles(names%n))
        obstacle%name = name
        call read_analytical(reader, card, model%mesh, obstacle)
        if (obstacle%kind /= obstacle_facets) obstacle%point = from_origin(obstacle, &
          obstacle%point, model%mesh%origin)
        do i = 1, reader%n_cards
          if (reader%cards(i)%keyword /= 'RIGID BODY') cycle
          call open_card(reader, i, body)
          if (.not. has_option(body, analytical_surface)) cycle
          call name_option(reader, body, analytical_surface, .true., of_body, ok)
          if (ok .and. of_body == name) call read_reference_node(reader, body, 'an obstacle', &
            model, obstacle%ref_node)
        end do
      end associate
    end subroutine read_analytical_one

  end subroutine read_obstacles

  !> REF NODE=id: a node that no element has.
  subroutine read_reference_node(reader, card, what, model, node)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    character(*), intent(in) :: what !! moves with it, for the message
    type(model_t), intent(inout) :: model
    integer, intent(inout) :: node !! its number; unchanged where the option is absent or wrong
    integer :: id, found
    logical :: ok

    id = 0
    call node_option(reader, card, 'REF NODE', id, ok)
    if (.not. ok) return
    found = find_id(model%mesh%nodes, model%mesh%node_id, id)
    if (found == 0) then
      call report(reader, option_position(card, 'REF NODE'), 'node '//to_text(id)// &
        ' is not defined')
    else if (model%used(found)) then
      call report(reader, option_position(card, 'REF NODE'), 'node '//to_text(id)// &
        ' belongs to an element: the reference node of '//what//' must be a node by itself')
    else
      node = found
      model%reference(found) = .true.
    end if
  end subroutine read_reference_node

  !> TYPE=STL, INPUT=path: looked for in the folder of the file that names it, then in the working
  !> directory.
  subroutine read_facets(reader, card, origin, obstacle)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    real(wp), intent(in) :: origin(3) !! of the mesh [length]
    type(obstacle_t), intent(inout) :: obstacle
    type(obstacle_t) :: made
    type(triangles_t) :: triangles
    type(place_t) :: place
    character(:), allocatable :: path, near, problem
    integer :: i
    integer, allocatable :: facet(:, :)
    logical :: ok, exists

    ! Until its file is read: an obstacle of nothing.
    made = obstacle_of_facets(obstacle%name, reshape([real(wp) ::], [3, 0]), &
      reshape([integer ::], [4, 0]), obstacle%ref_node)
    if (obstacle%inner) call report(reader, option_position(card, 'INNER'), &
      'an STL file has no INNER side: its triangles say where the body is')
    obstacle = made
    call allow_no_data(reader, card)
    call text_option(reader, card, 'INPUT', path, ok)
    if (.not. has_option(card, 'INPUT')) call report(reader, card%position, &
      '*OBSTACLE, TYPE=STL needs INPUT=')
    if (.not. ok) return
    if (path(1:1) /= '/') then
      place = place_of(reader%source, option_position(card, 'INPUT'))
      near = place%file(:index(place%file, '/', back=.true.))//path
      inquire (file=near, exist=exists)
      if (exists) path = near
    end if
    call read_stl(path, triangles, problem)
    if (allocated(problem)) then
      call report(reader, option_position(card, 'INPUT'), 'cannot read '//quoted(path)//': '// &
        problem)
      return
    end if
    if (triangles%n_flat > 0) call note(reader, to_text(triangles%n_flat)//' triangles of '// &
      path//' have no area and are left out')
    allocate (facet(4, triangles%n))
    do i = 1, triangles%n
      facet(:, i) = [3*i - 2, 3*i - 1, 3*i, 0]
    end do
    obstacle = obstacle_of_facets(obstacle%name, triangles%corner(:, :3*triangles%n) - spread( &
      origin, 2, 3*triangles%n), facet, obstacle%ref_node)
    if (size(obstacle%facet, 2) < triangles%n) call note(reader, to_text(triangles%n - &
      size(obstacle%facet, 2))//' triangles of '//path//' repeat others and count once')
    obstacle%file = path
    obstacle%checksum = triangles%checksum
  end subroutine read_facets

  !> The numbers of an obstacle, over one line or more.
  subroutine read_shape(reader, card, origin, obstacle)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    real(wp), intent(in) :: origin(3) !! of the mesh [length]
    type(obstacle_t), intent(inout) :: obstacle
    real(wp) :: value(max_numbers)
    integer :: position(max_numbers)
    logical :: ok

    select case (obstacle%kind)
    case (obstacle_plane)
      if (obstacle%inner) call report(reader, option_position(card, 'INNER'), &
        'a plane has no INNER side')
      call read_numbers(reader, card, 'a plane', 'six numbers: x, y, z of a point, then of the '// &
        'normal', value(:6), position(:6), ok)
      if (ok) call read_direction(reader, 'the normal of a plane', position(4), value(4:6), &
        obstacle%normal)
    case (obstacle_sphere)
      call read_numbers(reader, card, 'a sphere', 'four numbers: x, y, z of its centre, then '// &
        'its radius', value(:4), position(:4), ok)
      if (ok) call read_radius(reader, position(4), value(4), obstacle)
    case (obstacle_cylinder)
      call read_numbers(reader, card, 'a cylinder', 'seven numbers: x, y, z of a point of its '// &
        'axis, then of the direction of the axis, then its radius', value(:7), position(:7), ok)
      if (ok) call read_direction(reader, 'the axis of a cylinder', position(4), value(4:6), &
        obstacle%normal)
      if (ok) call read_radius(reader, position(7), value(7), obstacle)
    case default
      call report(reader, option_position(card, 'TYPE'), 'internal error: no numbers '// &
        'are known of this TYPE')
      ok = .false.
    end select
    if (ok) obstacle%point = from_origin(obstacle, value(:3), origin)
  end subroutine read_shape

  !> A truncated cone with its ends, or the hollow one without: its facets.
  subroutine read_cone(reader, card, mesh, obstacle)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(mesh_draft_t), intent(in) :: mesh
    type(obstacle_t), intent(inout) :: obstacle
    type(facets_t) :: made
    real(wp) :: value(max_numbers)
    integer :: position(max_numbers), n
    logical :: ok

    made = facets_t(reshape([real(wp) ::], [3, 0]), reshape([integer ::], [4, 0]))
    n = facets_about
    call integer_option(reader, card, 'FACETS', 12, 3600, n, ok)
    call read_numbers(reader, card, 'a cone', 'nine numbers: x, y, z of the centre of an end, '// &
      'then of the direction of the axis from there, the radius there, the radius of the other '// &
      'end, and the height', value, position, ok)
    if (ok) call read_direction(reader, 'the axis of a cone', position(4), value(4:6), &
      obstacle%normal)
    if (ok .and. (any(value(7:8) < 0.0_wp) .or. .not. any(value(7:8) > 0.0_wp))) then
      ok = .false.
      call report(reader, position(7), 'the radii of obstacle '//quoted(obstacle%name)// &
        ' must not be negative, and one of them positive')
    else if (ok .and. .not. value(9) > 0.0_wp) then
      ok = .false.
      call report(reader, position(9), 'the height of obstacle '//quoted(obstacle%name)// &
        ' must be positive')
    end if
    if (ok) made = turn_about_axis(frustum(value(7:8), value(9), obstacle%inner), value(:3) - &
      mesh%origin, obstacle%normal, n)
    obstacle = obstacle_of_facets(obstacle%name, made%corner, made%facet, obstacle%ref_node)
    if (ok) call note(reader, 'the round sides of obstacle '//quoted(obstacle%name)//' are '// &
      to_text(n)//' facets, off by at most '//to_text((acos(-1.0_wp)/n)**2/3* &
      maxval(value(7:8)), 2))
  end subroutine read_cone

  !> Where an obstacle is from the origin of the mesh. Of a plane or an axis the nearest point is as
  !> good as any: from one far away the distance of each node is rounded by more.
  pure function from_origin(obstacle, point, origin) result(x)
    type(obstacle_t), intent(in) :: obstacle !! its kind and normal
    real(wp), intent(in) :: point(3), origin(3) !! in the deck [length]
    real(wp) :: x(3)                            !! [length]

    x = point - origin
    if (.not. any(abs(origin) > 0.0_wp)) return
    associate (n => obstacle%normal)
      if (obstacle%kind == obstacle_plane) x = dot_product(x, n)*n
      if (obstacle%kind == obstacle_cylinder) x = x - dot_product(x, n)*n
    end associate
  end function from_origin

  !> Read as many numbers as `value` has.
  subroutine read_numbers(reader, card, what, form, value, position, ok)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    character(*), intent(in) :: what, form !! what needs which numbers, for the messages
    real(wp), intent(out) :: value(:)
    integer, intent(out) :: position(:)
    logical, intent(out) :: ok             !! false: a mistake was reported
    type(fields_t) :: fields
    integer :: have, i
    logical :: found, field_ok

    have = 0
    ok = .true.
    value = 0.0_wp
    position = card%position
    do
      call next_data_line(reader, card, fields, found, size(value) - have, form)
      if (.not. found) exit
      if (have == size(value)) exit
      do i = 1, min(fields%n, size(value) - have)
        have = have + 1
        position(have) = field_position(reader, fields, i)
        call real_field(reader, fields, i, 'a number', value(have), field_ok)
        ok = ok .and. field_ok
      end do
    end do
    if (have == size(value)) return
    ok = .false.
    call report(reader, card%position, what//' needs '//form)
  end subroutine read_numbers

  !> A vector of any length but zero, made a unit vector.
  subroutine read_direction(reader, what, position, vector, direction)
    type(reader_t), intent(inout) :: reader
    character(*), intent(in) :: what
    integer, intent(in) :: position
    real(wp), intent(in) :: vector(3)
    real(wp), intent(inout) :: direction(3) !! unchanged after a mistake
    real(wp) :: largest

    largest = maxval(abs(vector))
    if (largest <= 0.0_wp) then
      call report(reader, position, what//' must not be zero')
      return
    end if
    ! Scaled first, so that no square leaves the range of numbers.
    direction = vector/largest
    direction = direction/norm2(direction)
  end subroutine read_direction

  subroutine read_radius(reader, position, radius, obstacle)
    type(reader_t), intent(inout) :: reader
    integer, intent(in) :: position
    real(wp), intent(in) :: radius
    type(obstacle_t), intent(inout) :: obstacle

    if (radius > 0.0_wp) then
      obstacle%radius = radius
    else
      call report(reader, position, 'the radius of obstacle '//quoted(obstacle%name)// &
        ' must be positive')
    end if
  end subroutine read_radius

end module read_obstacles_mod
