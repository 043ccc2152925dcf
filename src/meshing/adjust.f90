!> ADJUST= of *CONTACT PAIR: slave nodes moved onto the master, without strain.
!>
!>     *CONTACT PAIR, INTERACTION=DRY, ADJUST=0.01    those whose gap is at most 0.01
!>     *CONTACT PAIR, INTERACTION=DRY, ADJUST=FOOT    those in the set FOOT
!>
!> Pair after pair in the order of the deck, each where the ones before it left the nodes.
module adjust_mod
  use anderson_mod, only: accelerate, anderson_t, new_anderson
  use cards_mod, only: keep_reading, note, reader_t, report
  use inverted_elements_mod, only: first_inverted
  use kinds_mod, only: i8, wp
  use numbers_mod, only: number_not_finite, number_ok, number_too_large, read_real
  use obstacles_mod, only: obstacle_t
  use obstacle_shapes_mod, only: is_before_faces, locate_point
  use mirror_planes_mod, only: keep_on_ends
  use local_refinement_mod, only: hanging_of
  use surface_reach_mod, only: reach_of_faces, reach_of_all, deep_in
  use mortar_rows_mod, only: lifted_gap, mortar_t, slave_t
  use mortar_mod, only: make_mortar
  use facet_mortar_mod, only: face_facets, facet_pair_t, join_facets, reach_of_all_facets, &
    reach_of_facets
  use options_mod, only: card_t, name_option, option_position
  use refine_locally_mod, only: place_hanging
  use scene_mod, only: contact_pair_t, region_t
  use sets_mod, only: find_set, model_t, report_unknown
  use surfaces_mod, only: surface_t, all_nodes_of, find_middles
  use text_mod, only: counted, to_text
  implicit none
  private

  public :: adjust_t, read_adjust, adjust_nodes

  !> Nodes looked at for all pairs together: more than any real deck needs.
  integer(i8), parameter :: max_work = 200000000
  real(wp), parameter :: at_rest(3) = 0.0_wp
  real(wp), parameter :: rounding = 1.0e-12_wp !! moves below it, relative to the place, are none
  real(wp), parameter :: off = 1.0e-9_wp       !! gaps above it, likewise, are gaps

  !> What one pair asks for.
  type :: adjust_t
    logical  :: wanted = .false.
    integer  :: set = 0             !! set of nodes; 0: by distance
    real(wp) :: distance = 0.0_wp   !! largest gap that is closed [length]
    integer  :: position = 0        !! in the deck
    integer  :: pair = 0            !! index of the pair
    logical  :: is_general = .false. !! no card asks for it: general contact removes overlaps
  end type adjust_t

contains

  !> Read ADJUST=, a distance or a set of nodes.
  subroutine read_adjust(reader, card, model, adjust)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    type(model_t), intent(in) :: model
    type(adjust_t), intent(out) :: adjust
    character(:), allocatable :: text
    integer :: status
    logical :: ok

    call name_option(reader, card, 'ADJUST', .false., text, ok)
    if (.not. ok) return
    adjust%position = option_position(card, 'ADJUST')
    call read_real(text, adjust%distance, status)
    select case (status)
    case (number_ok)
      adjust%wanted = adjust%distance >= 0.0_wp
      if (.not. adjust%wanted) call report(reader, adjust%position, &
        'ADJUST must not be negative: '//text)
    case (number_too_large, number_not_finite)
      call report(reader, adjust%position, 'ADJUST must be a finite number, not '//text)
    case default
      adjust%set = find_set(model%node_sets, text)
      adjust%wanted = adjust%set > 0
      if (.not. adjust%wanted) call report_unknown(reader, model%node_sets, adjust%position, text)
    end select
  end subroutine read_adjust

  !> Move the nodes of all pairs that ask for it, and say how many and how far.
  subroutine adjust_nodes(reader, model, surfaces, obstacles, pairs, adjusts)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(inout) :: model       !! its nodes are moved
    type(surface_t), intent(in) :: surfaces(:)
    type(obstacle_t), intent(in) :: obstacles(:)
    type(contact_pair_t), intent(in) :: pairs(:)
    type(adjust_t), intent(in) :: adjusts(:)    !! (n_pairs)
    type(region_t), allocatable :: placed(:)    ! nodes of each pair
    integer, allocatable :: mover(:)
    integer(i8) :: work
    integer :: p

    if (.not. any(adjusts%wanted)) return
    allocate (placed(size(pairs)), mover(model%mesh%n_nodes))
    mover = 0
    work = 0
    do p = 1, size(pairs)
      if (.not. adjusts(p)%wanted) cycle
      work = work + size(surfaces(pairs(p)%surface)%nodes)
      if (work > max_work) then
        call report(reader, adjusts(p)%position, 'the pairs with ADJUST have too many nodes')
        return
      end if
      if (is_before_faces(pairs(p), obstacles)) then
        call place_on_surface(reader, model, surfaces, obstacles, pairs, adjusts(p), &
          placed(p)%elements, mover)
        cycle
      end if
      call choose_nodes(model, surfaces(pairs(p)%surface)%nodes, obstacles(pairs(p)%master), &
        adjusts(p), placed(p)%elements)
      call place_nodes(reader, model, obstacles(pairs(p)%master), pairs(p)%name, adjusts(p), &
        placed(p)%elements, mover)
    end do
    call check_elements(reader, model, pairs, adjusts, mover)
    do p = 1, size(pairs)
      if (.not. adjusts(p)%wanted .or. .not. any(mover > p)) cycle
      if (is_before_faces(pairs(p), obstacles)) then
        call note_left(reader, model, gaps_to_surface(model, surfaces, obstacles, pairs(p), &
          placed(p)%elements), title(p), placed(p)%elements)
      else
        call note_left(reader, model, gaps_to_obstacle(model, obstacles(pairs(p)%master), &
          placed(p)%elements), title(p), placed(p)%elements)
      end if
    end do

  contains

    !> What moves the nodes of a pair, for notes.
    pure function title(p)
      integer, intent(in) :: p
      character(:), allocatable :: title

      title = 'ADJUST of '//pairs(p)%name
      if (adjusts(p)%is_general) title = 'general contact of '//pairs(p)%name
    end function title

  end subroutine adjust_nodes

  !> The slave nodes that are near enough, or in the set.
  subroutine choose_nodes(model, slaves, obstacle, adjust, nodes)
    type(model_t), intent(in) :: model
    integer, intent(in) :: slaves(:)
    type(obstacle_t), intent(in) :: obstacle
    type(adjust_t), intent(in) :: adjust
    integer, allocatable, intent(out) :: nodes(:)
    logical :: chosen(size(slaves))
    logical, allocatable :: in_set(:)
    real(wp) :: gap, normal(3)
    integer :: i

    if (adjust%set > 0) then
      allocate (in_set(model%mesh%n_nodes))
      in_set = .false.
      in_set(model%node_sets%list(adjust%set)%members) = .true.
      chosen = in_set(slaves)
    else
      do i = 1, size(slaves)
        call locate_point(obstacle, at_rest, model%mesh%coordinates(:, slaves(i)), gap, normal)
        chosen(i) = gap <= adjust%distance
      end do
    end if
    nodes = pack(slaves, chosen)
  end subroutine choose_nodes

  !> Move nodes onto the obstacle along its normal.
  subroutine place_nodes(reader, model, obstacle, pair, adjust, nodes, mover)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(inout) :: model
    type(obstacle_t), intent(in) :: obstacle
    character(*), intent(in) :: pair      !! its name
    type(adjust_t), intent(in) :: adjust  !! what it asks for
    integer, intent(in) :: nodes(:)
    integer, intent(inout) :: mover(:)    !! (n_nodes) the last pair that moved the node
    real(wp) :: x(3), gap, normal(3), move, farthest
    integer :: i, round, n

    n = 0
    farthest = 0.0_wp
    do i = 1, size(nodes)
      x = model%mesh%coordinates(:, nodes(i))
      ! Once would do but for rounding.
      do round = 1, 2
        call locate_point(obstacle, at_rest, x, gap, normal)
        x = x - gap*normal
      end do
      move = norm2(x - model%mesh%coordinates(:, nodes(i)))
      if (move <= rounding*size_of(obstacle, x)) cycle
      model%mesh%coordinates(:, nodes(i)) = x
      mover(nodes(i)) = adjust%pair
      n = n + 1
      farthest = max(farthest, move)
    end do
    call note_moves(reader, pair, adjust%is_general, n, farthest)
  end subroutine place_nodes

  !> Report an element that the moved nodes turned inside out, one of each pair.
  subroutine check_elements(reader, model, pairs, adjusts, mover)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(contact_pair_t), intent(in) :: pairs(:)
    type(adjust_t), intent(in) :: adjusts(:)
    integer, intent(in) :: mover(:)
    integer :: inverted(size(pairs)), p

    inverted = first_inverted(model%mesh%coordinates, model%mesh%connectivity, &
      model%mesh%n_elements, mover, size(pairs))
    do p = 1, size(pairs)
      if (inverted(p) == 0 .or. .not. keep_reading(reader)) cycle
      if (adjusts(p)%is_general) then
        call report(reader, adjusts(p)%position, 'the overlap of '//pairs(p)%name//' in the '// &
          'mesh cannot be removed without strain: element '//to_text(model%mesh%element_id( &
          inverted(p)))//' would be turned inside out', 'move the bodies apart, or name what '// &
          'may overlap by *CONTACT EXCLUSIONS')
      else
        call report(reader, adjusts(p)%position, 'ADJUST of '//pairs(p)%name//' turns '// &
          'element '//to_text(model%mesh%element_id(inverted(p)))//' inside out: move the body '// &
          'nearer to the master')
      end if
    end do
  end subroutine check_elements

  !> Move nodes onto a surface: along their normals by their gaps, several times over, since what
  !> they face changes as they move. Where both surfaces end at a plane its nodes stay on it.
  subroutine place_on_surface(reader, model, surfaces, obstacles, pairs, adjust, nodes, mover)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(inout) :: model
    type(surface_t), intent(in) :: surfaces(:)
    type(obstacle_t), intent(in) :: obstacles(:)
    type(contact_pair_t), intent(in) :: pairs(:)
    type(adjust_t), intent(in) :: adjust
    integer, allocatable, intent(out) :: nodes(:)     !! that it chose
    integer, intent(inout) :: mover(:)                !! (n_nodes) the last pair that moved the node
    integer, parameter :: most_rounds = 100, depth = 5 !! of rounds that are combined
    type(mortar_t) :: mortar
    type(anderson_t) :: memory
    logical :: in_set(model%mesh%n_nodes)
    logical, allocatable :: chosen(:)
    real(wp), allocatable :: gap(:), before(:, :), next(:)
    real(wp) :: farthest, move, way(3, model%mesh%n_nodes), alpha(model%mesh%n_nodes)
    integer :: ends(2, model%mesh%n_nodes), i, round, n

    ends = 0
    alpha = 0.0_wp
    call find_middles(all_nodes_of(surfaces(pairs(adjust%pair)%surface)%faces, &
      model%mesh%connectivity), ends, alpha)
    associate (p => adjust%pair, slaves => surfaces(pairs(adjust%pair)%surface)%nodes)
      in_set = .false.
      if (adjust%set > 0) in_set(model%node_sets%list(adjust%set)%members) = .true.
      allocate (before(3, size(slaves)), source=model%mesh%coordinates(:, slaves))
      memory = new_anderson(size(before), depth)
      allocate (next(size(before)))
      do round = 1, most_rounds
        call find_gaps(model, surfaces, obstacles, pairs(p), adjust%distance, adjust%set > 0, &
          mortar, gap)
        if (round == 1) chosen = merge(in_set(slaves), gap <= adjust%distance, adjust%set > 0) &
          .and. mortar%area > mortar%least*mortar%whole_area
        way = 0.0_wp
        do i = 1, size(slaves)
          if (chosen(i) .and. mortar%area(i) > 0.0_wp) way(:, slaves(i)) = -gap(i)* &
            mortar%normal(:, i)
        end do
        ! Points in the middles of edges move, their nodes with the ends of the edges.
        do i = 1, size(slaves)
          associate (node => slaves(i), a => alpha(slaves(i)))
            if (.not. a > 0.0_wp) cycle
            way(:, node) = (1.0_wp - 2.0_wp*a)*way(:, node) + a*(way(:, ends(1, node)) + &
              way(:, ends(2, node)))
          end associate
        end do
        ! A row of faces that are covered in part stands for places of other nodes, too.
        associate (x => model%mesh%coordinates(:, slaves))
          call accelerate(memory, reshape(x, shape(next)), reshape(x + way(:, slaves), &
            shape(next)), next)
        end associate
        model%mesh%coordinates(:, slaves) = reshape(next, shape(before))
        call place_hanging(model%mesh)
        if (maxval(abs(way(:, slaves))) <= rounding*maxval(abs(before))) exit
      end do
      nodes = pack(slaves, chosen)
      n = 0
      farthest = 0.0_wp
      do i = 1, size(slaves)
        move = norm2(model%mesh%coordinates(:, slaves(i)) - before(:, i))
        if (move <= rounding*maxval(abs(before))) then
          model%mesh%coordinates(:, slaves(i)) = before(:, i)
          cycle
        end if
        mover(slaves(i)) = p
        n = n + 1
        farthest = max(farthest, move)
      end do
    end associate
    call note_moves(reader, pairs(adjust%pair)%name, adjust%is_general, n, farthest)
  end subroutine place_on_surface

  !> The gaps of slave nodes before a surface, as far as it covers them.
  subroutine find_gaps(model, surfaces, obstacles, pair, distance, however_far, mortar, gap)
    type(model_t), intent(in) :: model
    type(surface_t), intent(in) :: surfaces(:)
    type(obstacle_t), intent(in) :: obstacles(:)
    type(contact_pair_t), intent(in) :: pair
    real(wp), intent(in) :: distance              !! up to which gaps matter [length]
    logical, intent(in) :: however_far
    type(mortar_t), intent(out) :: mortar
    real(wp), allocatable, intent(out) :: gap(:)  !! (n_slaves) huge where nothing is [length]
    type(slave_t) :: slave
    integer, allocatable :: master(:, :)
    type(facet_pair_t) :: now
    integer :: i
    real(wp) :: reach, behind

    associate (x => model%mesh%coordinates(:, :model%mesh%n_nodes), &
               s => surfaces(pair%surface)%nodes)
      slave = slave_t(all_nodes_of(surfaces(pair%surface)%faces, model%mesh%connectivity), s, &
        hanging_of(model%mesh%hangs, model%mesh%between, model%mesh%n_given, s))
      if (pair%master > 0) then
        now = join_facets(slave, x, obstacles(pair%master), at_rest)
        behind = reach_of_facets(now) + pair%overlap
        reach = behind + distance
        if (however_far) reach = reach + reach_of_all_facets(now)
        call face_facets(now, reach, mortar, behind)
        call keep_on_ends(slave%faces, s, x, mortar%normal, obstacle=obstacles(pair%master))
      else
        allocate (master, source=all_nodes_of(surfaces(pair%master_surface)%faces, &
          model%mesh%connectivity))
        reach = reach_of_faces(slave%faces, master, x) + pair%overlap + distance
        behind = deep_in(pair%overlap, reach)
        if (however_far) reach = reach + reach_of_all(s, surfaces(pair%master_surface)%nodes, x)
        slave%skin = model%mesh%skin
        slave%piece = model%mesh%piece
        call make_mortar(slave, master, x, reach, mortar, behind)
        call keep_on_ends(slave%faces, s, x, mortar%normal, surfaces(pair%master_surface)%nodes)
      end if
      allocate (gap(size(s)), source=huge(1.0_wp))
      do i = 1, size(s)
        if (allocated(pair%left_open)) then
          if (any(pair%left_open == s(i))) cycle
        end if
        if (mortar%area(i) > 0.0_wp) gap(i) = lifted_gap(mortar, i, dot_product(mortar%normal(:, &
          i), mortar%apart(:, i)))
      end do
    end associate
  end subroutine find_gaps

  !> The gaps of nodes that were moved onto a surface.
  function gaps_to_surface(model, surfaces, obstacles, pair, nodes) result(of_nodes)
    type(model_t), intent(in) :: model
    type(surface_t), intent(in) :: surfaces(:)
    type(obstacle_t), intent(in) :: obstacles(:)
    type(contact_pair_t), intent(in) :: pair
    integer, intent(in) :: nodes(:)    !! some of the slave nodes
    real(wp) :: of_nodes(size(nodes))  !! [length]
    real(wp), allocatable :: gap(:)
    type(mortar_t) :: mortar
    logical :: moved(model%mesh%n_nodes)

    call find_gaps(model, surfaces, obstacles, pair, 0.0_wp, .true., mortar, gap)
    moved = .false.
    moved(nodes) = .true.
    of_nodes = pack(gap, moved(surfaces(pair%surface)%nodes))
    where (of_nodes >= huge(1.0_wp)) of_nodes = 0.0_wp
  end function gaps_to_surface

  !> The same of nodes that were moved onto an obstacle.
  function gaps_to_obstacle(model, obstacle, nodes) result(gap)
    type(model_t), intent(in) :: model
    type(obstacle_t), intent(in) :: obstacle
    integer, intent(in) :: nodes(:)
    real(wp) :: gap(size(nodes))  !! 0 where it is rounding [length]
    real(wp) :: normal(3)
    integer :: i

    do i = 1, size(nodes)
      associate (x => model%mesh%coordinates(:, nodes(i)))
        call locate_point(obstacle, at_rest, x, gap(i), normal)
        if (abs(gap(i)) <= off*size_of(obstacle, x)) gap(i) = 0.0_wp
      end associate
    end do
  end function gaps_to_obstacle

  !> Note how many nodes a pair moved, and how far.
  subroutine note_moves(reader, pair, is_general, n, farthest)
    type(reader_t), intent(inout) :: reader
    character(*), intent(in) :: pair       !! its name
    logical, intent(in) :: is_general      !! no card asked for it
    integer, intent(in) :: n
    real(wp), intent(in) :: farthest       !! [length]

    if (is_general) then
      if (n > 0) call note(reader, 'general contact removes the overlap of '//pair//' in the '// &
        'mesh without strain: '//counted(n, 'node')//' moved, by '//to_text(farthest, 3)// &
        ' at most')
    else if (n == 0) then
      call note(reader, 'ADJUST of '//pair//' moved no node')
    else
      call note(reader, 'ADJUST of '//pair//' moved '//to_text(n)//' nodes, by '// &
        to_text(farthest, 3)//' at most')
    end if
  end subroutine note_moves

  !> Note the nodes that a later pair moved off this pair's master.
  subroutine note_left(reader, model, gap, title, nodes)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    real(wp), intent(in) :: gap(:)    !! (n) of the nodes [length]
    character(*), intent(in) :: title  !! what moved them
    integer, intent(in) :: nodes(:)
    real(wp) :: largest
    integer :: i, n

    n = 0
    largest = 0.0_wp
    do i = 1, size(nodes)
      if (abs(gap(i)) <= off*maxval(abs(model%mesh%coordinates(:, nodes)))) cycle
      n = n + 1
      largest = max(largest, abs(gap(i)))
    end do
    if (n > 0) call note(reader, title//': later pairs moved '//to_text(n)// &
      ' of its nodes off the master again, by '//to_text(largest, 3)//' at most')
  end subroutine note_left

  !> The size of the numbers that a place on the obstacle is computed from.
  pure real(wp) function size_of(obstacle, x) result(length)
    type(obstacle_t), intent(in) :: obstacle
    real(wp), intent(in) :: x(3)

    length = max(maxval(abs(x)), maxval(abs(obstacle%point)), obstacle%radius)
  end function size_of

end module adjust_mod
