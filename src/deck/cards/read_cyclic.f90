!> Sectors of bodies that look the same after a part of a turn, loads and contact included.
!>
!>     *TIE, NAME=SIDES, CYCLIC SYMMETRY
!>     LEFT, RIGHT                    sides of the sector: what depends, and its masters
!>     *CYCLIC SYMMETRY MODEL, N=12, TIE=SIDES
!>     0., 0., 0.,  0., 0., 1.        two points of the axis
!>
!> A node of the first side moves as its partner on the other does, turned by 360/N degrees:
!> u = Q u_partner, as equations. docs/theory.md section 11.
module read_cyclic_mod
  use cards_mod, only: note, reader_t, report
  use diagnostics_mod, only: any_mistakes, quoted
  use equation_list_mod, only: add_equation, equation_list_t
  use fields_mod, only: end_data, field_position, fields_t, name_field, next_data_line, real_field
  use kinds_mod, only: wp
  use mesh_draft_mod, only: solids
  use options_mod, only: allow_options, card_t, has_option, integer_option, name_option, &
    open_card, real_option
  use rotations_mod, only: rotation_matrix
  use sets_mod, only: model_t
  use surface_list_mod, only: find_surface_or_set, surface_list_t
  use text_mod, only: to_text
  implicit none
  private

  public :: read_cyclic

  real(wp), parameter :: nothing = 1.0e-14_wp !! of a rotation matrix: rounding [-]
  real(wp), parameter :: closest = 1.0e-4_wp
  !! of the extent of a side: partners that no POSITION TOLERANCE allows to be further apart [-]

  !> The sides of a sector, and the axis.
  type :: sector_t
    integer, allocatable :: slave(:), master(:)   !! nodes
    character(:), allocatable :: slave_name, master_name
    integer :: n = 0                              !! sectors of a turn
    integer :: position = 0                       !! of the sides in the deck
    real(wp) :: tolerance = -1.0_wp               !! below 0: the deck gives none [length]
    real(wp) :: origin(3) = 0.0_wp, axis(3) = 0.0_wp !! [length], unit vector [-]
  end type sector_t

contains

  !> The equations of all *CYCLIC SYMMETRY MODEL cards.
  subroutine read_cyclic(reader, model, surfaces, equations)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(surface_list_t), intent(inout) :: surfaces
    type(equation_list_t), intent(inout) :: equations
    logical :: is_used(reader%n_cards)
    type(card_t) :: card
    type(sector_t) :: sector
    integer :: k
    logical :: ok

    is_used = .false.
    do k = 1, reader%n_cards
      if (reader%cards(k)%keyword /= 'CYCLIC SYMMETRY MODEL') cycle
      call open_card(reader, k, card)
      sector = sector_t()
      call read_model(reader, card, sector, ok)
      call read_sides(reader, model, card, surfaces, sector, is_used, ok)
      if (.not. ok) cycle
      if (model%mesh%plane /= solids) then
        call report(reader, card%position, '*CYCLIC SYMMETRY MODEL needs solid elements')
        cycle
      end if
      call join_sides(reader, model, sector, equations)
    end do
    if (any_mistakes(reader%diagnostics)) return
    do k = 1, reader%n_cards
      if (reader%cards(k)%keyword /= 'TIE' .or. is_used(k)) cycle
      call open_card(reader, k, card)
      if (has_option(card, 'CYCLIC SYMMETRY')) call report(reader, card%position, &
        'a *TIE with CYCLIC SYMMETRY needs a *CYCLIC SYMMETRY MODEL that names it')
    end do
  end subroutine read_cyclic

  !> Number of sectors, and the axis.
  subroutine read_model(reader, card, sector, ok)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(inout) :: card
    type(sector_t), intent(inout) :: sector
    logical, intent(out) :: ok     !! false: a mistake was reported
    type(fields_t) :: fields
    real(wp) :: x(6)
    integer :: i
    logical :: found, is_number(6)

    call allow_options(reader, card)
    call integer_option(reader, card, 'N', 2, huge(1), sector%n, ok)
    if (.not. has_option(card, 'N')) call report(reader, card%position, &
      '*CYCLIC SYMMETRY MODEL needs N=, the number of sectors of a whole turn')
    call next_data_line(reader, card, fields, found, 6, 'two points of the axis')
    if (.not. found) then
      call report(reader, card%position, &
        '*CYCLIC SYMMETRY MODEL needs a data line: two points of the axis')
      ok = .false.
      return
    end if
    x = 0.0_wp
    do i = 1, 6
      call real_field(reader, fields, i, 'a coordinate of the axis', x(i), is_number(i))
    end do
    ok = ok .and. all(is_number)
    sector%origin = x(:3)
    sector%axis = x(4:) - x(:3)
    if (all(is_number) .and. .not. norm2(sector%axis) > 0.0_wp) then
      call report(reader, fields%start, 'two points of the axis are the same')
      ok = .false.
    end if
    if (ok) sector%axis = sector%axis/norm2(sector%axis)
    call end_data(reader, card, fields, '*CYCLIC SYMMETRY MODEL has one data line')
  end subroutine read_model

  !> The nodes of both sides, from the *TIE of the model.
  subroutine read_sides(reader, model, card, surfaces, sector, is_used, ok)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(card_t), intent(in) :: card            !! of the model
    type(surface_list_t), intent(inout) :: surfaces
    type(sector_t), intent(inout) :: sector
    logical, intent(inout) :: is_used(:)        !! (n_cards) which ties have a model
    logical, intent(inout) :: ok                !! false: a mistake was reported
    type(card_t) :: tie
    type(fields_t) :: fields
    character(:), allocatable :: wanted, name, words(:)
    integer :: k, i, surface(2)
    logical :: has_name, found, is_there

    call name_option(reader, card, 'TIE', .false., wanted, has_name)
    is_there = .false.
    do k = 1, reader%n_cards
      if (reader%cards(k)%keyword /= 'TIE') cycle
      call open_card(reader, k, tie)
      if (.not. has_option(tie, 'CYCLIC SYMMETRY')) cycle
      call name_option(reader, tie, 'NAME', .false., name, found)
      if (has_name .and. name /= wanted) cycle
      if (is_there) then
        if (has_name) then
          call report(reader, tie%position, 'two *TIE with CYCLIC SYMMETRY have the name '// &
            quoted(wanted))
        else
          call report(reader, card%position, &
            '*CYCLIC SYMMETRY MODEL needs TIE=, for there are several with CYCLIC SYMMETRY')
        end if
        ok = .false.
        return
      end if
      is_there = .true.
      is_used(k) = .true.
      call real_option(reader, tie, 'POSITION TOLERANCE', huge(1.0_wp), sector%tolerance, found)
      call next_data_line(reader, tie, fields, found, 2, 'the two sides of a sector')
      sector%position = tie%position
      if (.not. found) then
        call report(reader, tie%position, '*TIE needs a data line: the two sides of a sector')
        ok = .false.
        return
      end if
      allocate (character(80) :: words(2))
      surface = 0
      do i = 1, 2
        call name_field(reader, fields, i, 'a side of a sector', name, found)
        if (.not. found) cycle
        words(i) = name
        call find_surface_or_set(reader, model, field_position(reader, fields, i), name, surfaces, &
          surface(i))
      end do
      ok = ok .and. all(surface > 0)
      call end_data(reader, tie, fields, 'a *TIE with CYCLIC SYMMETRY has one data line')
      if (.not. ok) return
      sector%slave_name = trim(words(1))
      sector%master_name = trim(words(2))
      sector%slave = surfaces%list(surface(1))%nodes
      sector%master = surfaces%list(surface(2))%nodes
      deallocate (words)
    end do
    if (is_there) return
    call report(reader, card%position, '*CYCLIC SYMMETRY MODEL needs a *TIE with CYCLIC '// &
      'SYMMETRY, whose NAME it gives by TIE=: the sides of the sector')
    ok = .false.
  end subroutine read_sides

  !> Find partners, and join them.
  subroutine join_sides(reader, model, sector, equations)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(sector_t), intent(in) :: sector
    type(equation_list_t), intent(inout) :: equations
    real(wp), parameter :: full_turn = 8.0_wp*atan(1.0_wp) !! [rad]
    integer :: partner(size(sector%slave), 2), worst(2), i, sense
    real(wp) :: far(2), turn(3, 3, 2), least, tolerance
    logical :: is_taken(model%mesh%n_nodes)

    associate (x => model%mesh%coordinates(:, sector%master))
      least = closest*norm2(maxval(x, dim=2) - minval(x, dim=2))
    end associate
    tolerance = least
    if (sector%tolerance >= 0.0_wp) tolerance = sector%tolerance
    do sense = 1, 2
      ! From the side of the masters to the other.
      turn(:, :, sense) = rotation_matrix(real(2*sense - 3, wp)*full_turn/real(sector%n, wp)* &
        sector%axis)
      call find_partners(model, sector, turn(:, :, sense), least, partner(:, sense), far(sense), &
        worst(sense))
    end do
    sense = minloc(far, dim=1)
    if (far(sense) > tolerance) then
      call report(reader, sector%position, 'node '//to_text(model%mesh%node_id(worst(sense)))// &
        ' of '//quoted(sector%slave_name)//', turned by '//to_text(360.0_wp/real(sector%n, wp))// &
        ' degrees about the axis, is '//to_text(far(sense))//' away from the nearest node of '// &
        quoted(sector%master_name)//': the meshes of both sides must match within POSITION '// &
        'TOLERANCE')
      return
    end if
    is_taken = .false.
    do i = 1, size(sector%slave)
      if (is_taken(partner(i, sense)) .or. size(sector%slave) /= size(sector%master)) then
        call report(reader, sector%position, 'sides of a sector must have as many nodes each, '// &
          'here '//to_text(size(sector%slave))//' and '//to_text(size(sector%master))// &
          ', which are partners one by one')
        return
      end if
      is_taken(partner(i, sense)) = .true.
    end do
    if (.not. allocated(equations%cyclic)) allocate (equations%cyclic(0))
    equations%cyclic = [equations%cyclic, sector%position]
    where (abs(turn) <= nothing) turn = 0.0_wp
    do i = 1, size(sector%slave)
      call join_partners(sector, sector%slave(i), partner(i, sense), turn(:, :, sense), equations)
    end do
    call note(reader, '*CYCLIC SYMMETRY MODEL: the model is one of '//to_text(sector%n)// &
      ' sectors, and so are forces and results')
  end subroutine join_sides

  !> The master that is nearest to each slave once it is turned, and how far the farthest is. Of
  !> those that are in one place, as where bodies touch, it is the one of the slave's body.
  pure subroutine find_partners(model, sector, turn, least, partner, far, worst)
    type(model_t), intent(in) :: model
    type(sector_t), intent(in) :: sector
    real(wp), intent(in) :: turn(3, 3)       !! from masters to slaves [-]
    real(wp), intent(in) :: least            !! nodes that are nearer are in one place [length]
    integer, intent(out) :: partner(:)       !! (n_slaves)
    real(wp), intent(out) :: far             !! [length]
    integer, intent(out) :: worst            !! the slave that is so far
    real(wp) :: place(3), distance, nearest
    integer :: i, j

    far = -1.0_wp
    worst = 0
    partner = 0
    associate (x => model%mesh%coordinates, slave => sector%slave, master => sector%master, &
               piece => model%mesh%piece)
      do i = 1, size(slave)
        place = sector%origin + matmul(x(:, slave(i)) - sector%origin, turn)
        nearest = huge(1.0_wp)
        do j = 1, size(master)
          distance = norm2(x(:, master(j)) - place)
          if (distance > nearest + least) cycle
          if (distance >= nearest - least .and. piece(master(j)) /= piece(slave(i))) cycle
          nearest = distance
          partner(i) = master(j)
        end do
        if (nearest <= far) cycle
        far = nearest
        worst = slave(i)
      end do
    end associate
  end subroutine find_partners

  !> u = Q u_partner; on the axis, where both are one node, no motion across it.
  pure subroutine join_partners(sector, node, partner, turn, equations)
    type(sector_t), intent(in) :: sector
    integer, intent(in) :: node, partner
    real(wp), intent(in) :: turn(3, 3) !! Q [-]
    type(equation_list_t), intent(inout) :: equations
    integer :: a, along

    along = maxloc(abs(sector%axis), dim=1)
    do a = 1, 3
      if (node /= partner) then
        call add_equation(equations, sector%position, [node, partner, partner, partner], &
          [a, 1, 2, 3], turn(a, :))
      else if (a /= along) then
        call add_equation(equations, sector%position, [node, node], [a, along], &
          [sector%axis(a)/sector%axis(along)])
      end if
    end do
  end subroutine join_partners

end module read_cyclic_mod
