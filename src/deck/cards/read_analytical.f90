!> Analytical rigid surfaces: profiles of lines and arcs, swept along an axis or about it. One
!> plane, cylinder or sphere becomes that obstacle, without the ends of its profile; any other
!> profile one of facets, which ends where the profile does.
!>
!>     *SURFACE, TYPE=CYLINDER, NAME=DIE       swept along the local z axis
!>     *SURFACE, TYPE=REVOLUTION, NAME=BALL    turned about the local z axis: r, z
!>     *SURFACE, TYPE=SEGMENTS, NAME=FLOOR     of bodies in a plane: x, y; of revolution: r, y
!>     START, -5., 0.
!>     LINE, 5., 0.                            its end
!>     CIRCL, 1., 1., 0., 1.                   its end and its centre
!>
!> The body is to the left of the profile. Local axes are those of the part, or of the mesh; where
!> an instance moves them a first line has their origin, a point of the x axis and one of the y axis
!> (of a REVOLUTION, one of the z axis).
module read_analytical_mod
  use cards_mod, only: note, reader_t, report
  use diagnostics_mod, only: quoted
  use fields_mod, only: field_position, field_text, fields_t, next_data_line, real_field
  use kinds_mod, only: wp
  use numbers_mod, only: number_ok, read_real
  use mesh_draft_mod, only: axisymmetric, mesh_draft_t, solids
  use obstacles_mod, only: obstacle_cylinder, obstacle_of_facets, obstacle_plane, &
    obstacle_sphere, obstacle_t
  use options_mod, only: allow_options, card_t, has_option, open_card, text_option
  use plane_mesh_mod, only: facets_beside_plane
  use small_matrix_mod, only: cross
  use swept_profile_mod, only: add_arc, facets_t, sweep_along, turn_about_axis
  use text_mod, only: to_text, upper
  implicit none
  private

  public :: is_analytical, read_analytical, analytical_type, along_axis, about_axis, facets_about

  integer, parameter :: not_analytical = 0, along_axis = 1, about_axis = 2
  integer, parameter :: most_fields = 9
  real(wp), parameter :: same = 1.0e-9_wp !! of lengths and directions [-]
  integer, parameter :: facets_about = 180      !! about an axis, unless a deck says otherwise
  character(*), parameter :: instead = '*OBSTACLE, TYPE=STL has any shape'

  !> A profile in the two coordinates of its plane.
  type :: profile_t
    logical :: is_one = .true.             !! all its pieces are of one line or one circle
    real(wp), allocatable :: polygon(:, :) !! (2,n) with chords for its arcs [length]
  end type profile_t

  !> A piece of the profile, in the two coordinates of its plane.
  type :: piece_t
    logical  :: is_arc = .false.
    real(wp) :: centre(2) = 0.0_wp !! of an arc; of a line its beginning [length]
    real(wp) :: normal(2) = 0.0_wp !! of a line, to the left [-]
    real(wp) :: radius = 0.0_wp    !! of an arc [length]
    logical  :: inner = .false.    !! of an arc: its centre is to the left
  end type piece_t

contains

  !> Whether card `k` is the *SURFACE of an analytical one.
  logical function is_analytical(reader, k)
    type(reader_t), intent(inout) :: reader
    integer, intent(in) :: k
    type(card_t) :: card

    is_analytical = .false.
    if (reader%cards(k)%keyword /= 'SURFACE') return
    call open_card(reader, k, card)
    is_analytical = analytical_type(reader, card) /= not_analytical
  end function is_analytical

  !> How the profile of a *SURFACE is swept: along_axis, about_axis, or 0 of one that has none.
  integer function analytical_type(reader, card)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    character(:), allocatable :: word
    logical :: ok

    analytical_type = not_analytical
    if (.not. has_option(card, 'TYPE')) return
    call text_option(reader, card, 'TYPE', word, ok)
    if (.not. ok) return
    select case (upper(word))
    case ('CYLINDER', 'SEGMENTS')
      analytical_type = along_axis
    case ('REVOLUTION')
      analytical_type = about_axis
    case default
      continue
    end select
  end function analytical_type

  !> The obstacle of a card: its kind, place and side, in the coordinates of the deck; or its
  !> facets, in those of the mesh.
  subroutine read_analytical(reader, card, mesh, obstacle)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(mesh_draft_t), intent(in) :: mesh
    type(obstacle_t), intent(inout) :: obstacle !! has its name
    type(piece_t) :: piece
    type(profile_t) :: profile
    real(wp) :: origin(3), axes(3, 3)
    integer :: sweep
    logical :: ok

    call allow_options(reader, card)
    sweep = analytical_type(reader, card)
    obstacle%kind = obstacle_plane
    obstacle%normal = [0.0_wp, 0.0_wp, 1.0_wp]
    call read_profile(reader, card, origin, axes, piece, profile, ok)
    if (.not. ok) return
    if (mesh%plane == axisymmetric) then
      call put_about_y(origin, axes, piece, profile)
      sweep = about_axis
    end if
    if (.not. profile%is_one .or. (sweep == about_axis .and. .not. is_simple(piece))) then
      call make_facets(reader, card, mesh, sweep, profile, origin, axes, obstacle)
      return
    end if
    if (sweep == along_axis) then
      obstacle%point = origin + piece%centre(1)*axes(:, 1) + piece%centre(2)*axes(:, 2)
      if (piece%is_arc) then
        obstacle%kind = obstacle_cylinder
        obstacle%normal = axes(:, 3)
      else
        obstacle%normal = piece%normal(1)*axes(:, 1) + piece%normal(2)*axes(:, 2)
      end if
    else
      call turn_about(piece, origin, axes(:, 3), obstacle)
    end if
    obstacle%radius = piece%radius
    obstacle%inner = piece%inner
    if (obstacle%kind == obstacle_plane) then
      call note(reader, 'analytical surface '//quoted(obstacle%name)//' is a plane without ends')
    else if (obstacle%kind == obstacle_cylinder) then
      call note(reader, 'analytical surface '//quoted(obstacle%name)//' is a whole cylinder '// &
        'without ends')
    else
      call note(reader, 'analytical surface '//quoted(obstacle%name)//' is a whole sphere')
    end if
  end subroutine read_analytical

  !> Whether a piece in r and z is a plane, a cylinder or a sphere once it is turned about the z
  !> axis.
  pure logical function is_simple(piece)
    type(piece_t), intent(in) :: piece

    if (piece%is_arc) then
      is_simple = abs(piece%centre(1)) <= same*piece%radius
    else
      is_simple = abs(piece%normal(1)) <= same .or. (abs(piece%normal(2)) <= same .and. &
        piece%centre(1) > 0.0_wp)
    end if
  end function is_simple

  !> What such a piece is.
  pure subroutine turn_about(piece, origin, axis, obstacle)
    type(piece_t), intent(inout) :: piece       !! of a cylinder gets radius and side
    real(wp), intent(in) :: origin(3), axis(3)
    type(obstacle_t), intent(inout) :: obstacle !! gets kind, point and normal

    obstacle%point = origin + piece%centre(2)*axis
    obstacle%normal = axis
    if (piece%is_arc) then
      obstacle%kind = obstacle_sphere
    else if (abs(piece%normal(1)) <= same) then
      obstacle%normal = sign(1.0_wp, piece%normal(2))*axis
    else
      obstacle%kind = obstacle_cylinder
      piece%radius = piece%centre(1)
      piece%inner = piece%normal(1) < 0.0_wp
    end if
  end subroutine turn_about

  !> The facets of any other profile. Along an axis they go as far beyond the bodies, on both sides,
  !> as all of these are large.
  subroutine make_facets(reader, card, mesh, sweep, profile, origin, axes, obstacle)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(mesh_draft_t), intent(in) :: mesh
    integer, intent(in) :: sweep !! along_axis or about_axis
    type(profile_t), intent(inout) :: profile
    real(wp), intent(in) :: origin(3), axes(3, 3)
    type(obstacle_t), intent(inout) :: obstacle
    type(facets_t) :: made
    real(wp) :: place(mesh%n_nodes), beyond

    if (mesh%n_nodes == 0) return ! a deck without bodies
    if (sweep == about_axis) then
      associate (r => profile%polygon(1, :))
        where (abs(r) <= same*maxval(abs(profile%polygon))) r = 0.0_wp
        if (any(r < 0.0_wp)) then
          call report(reader, card%position, 'the profile of analytical surface '// &
            quoted(obstacle%name)//' has a negative distance from its axis')
          return
        end if
      end associate
    end if
    if (mesh%plane /= solids) then
      if (.not. allocated(mesh%copies)) return ! after a mistake
      made = facets_beside_plane(mesh, profile%polygon, origin - mesh%origin, axes)
    else if (sweep == about_axis) then
      made = turn_about_axis(profile%polygon, origin - mesh%origin, axes(:, 3), facets_about)
    else
      place = matmul(axes(:, 3), mesh%coordinates(:, :mesh%n_nodes))
      beyond = norm2(maxval(mesh%coordinates(:, :mesh%n_nodes), dim=2) - &
        minval(mesh%coordinates(:, :mesh%n_nodes), dim=2))
      place = place - dot_product(axes(:, 3), origin - mesh%origin)
      made = sweep_along(profile%polygon, origin - mesh%origin, axes, minval(place) - beyond, &
        maxval(place) + beyond)
    end if
    obstacle = obstacle_of_facets(obstacle%name, made%corner, made%facet, obstacle%ref_node)
    associate (n => size(obstacle%facet, 2))
      call note(reader, 'analytical surface '//quoted(obstacle%name)//' has '//to_text(n)// &
        ' facet'//trim(merge('s', ' ', n > 1))//', and ends where its profile does')
    end associate
  end subroutine make_facets

  !> A profile of bodies of revolution in their coordinates: distances from the y axis, places along
  !> it.
  pure subroutine put_about_y(origin, axes, piece, profile)
    real(wp), intent(inout) :: origin(3), axes(3, 3)
    type(piece_t), intent(inout) :: piece
    type(profile_t), intent(inout) :: profile

    piece%centre = origin(:2) + matmul(axes(:2, :2), piece%centre)
    piece%normal = matmul(axes(:2, :2), piece%normal)
    profile%polygon = matmul(axes(:2, :2), profile%polygon) + spread(origin(:2), 2, &
      size(profile%polygon, 2))
    origin = 0.0_wp
    axes = reshape([0.0_wp, 0.0_wp, 1.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp], [3, 3])
  end subroutine put_about_y

  !> The axes, the pieces of the profile, and the first of these.
  subroutine read_profile(reader, card, origin, axes, piece, profile, ok)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    real(wp), intent(out) :: origin(3), axes(3, 3) !! columns x, y, z
    type(piece_t), intent(out) :: piece
    type(profile_t), intent(out) :: profile
    logical, intent(out) :: ok
    real(wp), parameter :: widest = 2.0_wp*acos(-1.0_wp)/facets_about !! chord of an arc [rad]
    type(fields_t) :: fields
    type(piece_t) :: next
    real(wp) :: at(2), value(most_fields)
    logical :: found, has_start
    integer :: status, n_pieces

    origin = 0.0_wp
    axes = reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [3, 3])
    has_start = .false.
    n_pieces = 0
    do
      call next_data_line(reader, card, fields, found, most_fields, 'START, LINE or CIRCL, and '// &
        'coordinates')
      if (.not. found) exit
      call read_real(field_text(reader, fields, 1), value(1), status)
      if (status == number_ok .and. .not. has_start) then
        call read_axes(reader, card, fields, origin, axes, ok)
        if (.not. ok) return
        cycle
      end if
      select case (upper(field_text(reader, fields, 1)))
      case ('START')
        call read_numbers(reader, fields, 'START', 2, value, ok)
        if (.not. ok) return
        if (has_start) then
          call report(reader, fields%start, 'a profile has one START')
          ok = .false.
          return
        end if
        at = value(:2)
        profile%polygon = reshape(at, [2, 1])
        has_start = .true.
        cycle
      case ('LINE')
        call read_numbers(reader, fields, 'LINE', 2, value, ok)
      case ('CIRCL')
        call read_numbers(reader, fields, 'CIRCL', 4, value, ok)
      case default
        ok = .false.
        call report(reader, fields%start, quoted(field_text(reader, fields, 1))//' is not '// &
          'available in a profile: expected is START, LINE or CIRCL', instead)
      end select
      if (.not. ok) return
      if (.not. has_start) then
        call report(reader, fields%start, 'a profile begins with START and two coordinates')
        ok = .false.
        return
      end if
      call make_piece(fields%n > 3, at, value, next, ok)
      if (.not. ok) then
        call report(reader, fields%start, 'a piece of a profile needs a length, and an arc two '// &
          'ends as far from its centre')
        return
      end if
      at = value(:2)
      if (next%is_arc) then
        call add_arc(profile%polygon, next%centre, at, widest)
      else
        profile%polygon = reshape([profile%polygon, at], [2, size(profile%polygon, 2) + 1])
      end if
      n_pieces = n_pieces + 1
      if (n_pieces == 1) piece = next
      profile%is_one = profile%is_one .and. are_one(piece, next)
    end do
    ok = n_pieces > 0
    if (.not. ok) call report(reader, card%position, 'an analytical surface needs START and a '// &
      'LINE or CIRCL')
  end subroutine read_profile

  !> A piece from one place to the next.
  pure subroutine make_piece(is_arc, from, value, piece, ok)
    logical, intent(in) :: is_arc
    real(wp), intent(in) :: from(2), value(:) !! its end, and the centre of an arc [length]
    type(piece_t), intent(out) :: piece
    logical, intent(out) :: ok
    real(wp) :: way(2), first(2), last(2)

    way = value(:2) - from
    piece%is_arc = is_arc
    ok = norm2(way) > 0.0_wp
    if (.not. ok) return
    if (.not. is_arc) then
      piece%centre = from
      piece%normal = [-way(2), way(1)]/norm2(way)
      return
    end if
    piece%centre = value(3:4)
    first = from - piece%centre
    last = value(:2) - piece%centre
    piece%radius = norm2(first)
    piece%inner = first(1)*last(2) - first(2)*last(1) > 0.0_wp
    ok = piece%radius > 0.0_wp .and. abs(norm2(last) - piece%radius) <= 1.0e-4_wp*piece%radius
  end subroutine make_piece

  !> Whether two pieces are of one line or one circle.
  pure logical function are_one(a, b)
    type(piece_t), intent(in) :: a, b
    real(wp) :: size_of_both

    are_one = (a%is_arc .eqv. b%is_arc) .and. (a%inner .eqv. b%inner)
    if (.not. are_one) return
    size_of_both = maxval(abs([a%centre, b%centre, a%radius]))
    if (a%is_arc) then
      are_one = max(norm2(a%centre - b%centre), abs(a%radius - b%radius)) <= same*size_of_both
    else
      are_one = norm2(a%normal - b%normal) <= same .and. abs(dot_product(b%centre - a%centre, &
        a%normal)) <= same*size_of_both
    end if
  end function are_one

  !> The axes in front of a profile: nine numbers, the last three of them on this line or on the
  !> next; of a REVOLUTION six, the origin and a point of the z axis. A profile is swept against its
  !> z axis, as Abaqus does it.
  subroutine read_axes(reader, card, fields, origin, axes, ok)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(fields_t), intent(inout) :: fields !! the first line; the last one that was read
    real(wp), intent(inout) :: origin(3), axes(3, 3)
    logical, intent(out) :: ok
    real(wp) :: value(most_fields), x(3), y(3)
    integer :: wanted, status, n, i
    logical :: found

    wanted = merge(9, 6, analytical_type(reader, card) == along_axis)
    n = 0
    ok = .true.
    do
      do i = 1, min(fields%n, wanted - n)
        if (ok) call real_field(reader, fields, i, 'a coordinate', value(n + i), ok)
      end do
      n = n + fields%n
      if (n /= 6 .or. wanted == 6) exit
      call next_data_line(reader, card, fields, found, most_fields, 'a point along which it is '// &
        'swept')
      if (.not. found) exit
      call read_real(field_text(reader, fields, 1), value(7), status)
      if (status /= number_ok) exit
    end do
    if (n /= wanted) then
      if (ok .and. wanted == 9) call report(reader, fields%start, 'axes of a profile need nine '// &
        'numbers: the origin, a point of the local x axis, and one along which it is swept')
      if (ok .and. wanted == 6) call report(reader, fields%start, 'the axis of a profile needs '// &
        'six numbers: its origin, and a point of the axis')
      ok = .false.
    end if
    if (.not. ok) return
    origin = value(:3)
    x = value(4:6) - origin
    if (wanted == 6) then
      ok = norm2(x) > 0.0_wp
      if (ok) axes(:, 3) = x/norm2(x)
    else
      y = cross(x, value(7:9) - origin)
      ok = norm2(y) > 0.0_wp
      if (ok) then
        axes(:, 1) = x/norm2(x)
        axes(:, 2) = y/norm2(y)
        axes(:, 3) = cross(axes(:, 1), axes(:, 2))
      end if
    end if
    if (.not. ok) call report(reader, fields%start, 'the points of the axes are in one place, '// &
      'or on one line')
  end subroutine read_axes

  !> The numbers behind the word of a line.
  subroutine read_numbers(reader, fields, word, n, value, ok)
    type(reader_t), intent(inout) :: reader
    type(fields_t), intent(in) :: fields
    character(*), intent(in) :: word
    integer, intent(in) :: n
    real(wp), intent(out) :: value(:)
    logical, intent(out) :: ok !! false: a mistake was reported
    integer :: i

    value = 0.0_wp
    ok = fields%n == n + 1
    if (.not. ok) then
      call report(reader, field_position(reader, fields, min(fields%n, n + 2)), word// &
        ' of a profile needs '//trim(merge('two numbers ', 'four numbers', n == 2)))
      return
    end if
    do i = 1, n
      if (ok) call real_field(reader, fields, i + 1, 'a coordinate', value(i), ok)
    end do
  end subroutine read_numbers

end module read_analytical_mod
