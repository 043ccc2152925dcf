!> The pairs of general contact: which bodies may touch each other and the obstacles, by which of
!> their outer faces, and which of two is the slave. docs/theory.md section 11.
module general_pairs_mod
  use cells_mod, only: face_corners
  use surfaces_mod, only: nodes_of
  use connectivity_mod, only: corners_in, nodes_of_element, nodes_of_face
  use faces_mod, only: face_area_vectors
  use face_directions_mod, only: may_touch_itself
  use kinds_mod, only: wp
  use find_faces_mod, only: size_of_face
  use matching_faces_mod, only: skin_faces
  use mesh_draft_mod, only: mesh_draft_t, solids
  use obstacle_shapes_mod, only: is_meshed, locate_point
  use obstacles_mod, only: obstacle_t
  use self_contact_mod, only: divide_surface
  use sets_mod, only: model_t
  use surface_list_mod, only: add_faces, surface_list_t
  use surface_reach_mod, only: against
  use text_mod, only: string_t, to_text
  implicit none
  private

  public :: touch_rule_t, general_contact_t, general_pair_t, find_general_pairs, &
    find_left_out
  public :: everything, may_touch, never_touch, touch_by, is_by_hand

  integer, parameter :: everything = 0 !! as a side: all outer faces, and the obstacles that count
  integer, parameter :: may_touch = 1, never_touch = 2, touch_by = 3
  integer, parameter :: is_by_hand = 4 !! a contact pair of the deck has these sides

  !> A line of the deck: what it says of two sides.
  type :: touch_rule_t
    integer :: says = may_touch
    integer :: side(2) = everything !! else a surface, or minus an obstacle
    integer :: interaction = 0      !! of touch_by
  end type touch_rule_t

  !> What the pairs follow from.
  type :: general_contact_t
    type(touch_rule_t), allocatable :: rules(:) !! in the order of the deck
    real(wp), allocatable :: young(:)    !! (n_elements) Young's modulus [force/length^2]
    logical, allocatable :: is_rigid(:)  !! (n_pieces)
    integer, allocatable :: tied(:)      !! surfaces whose faces touch nothing
    integer, allocatable :: may_overlap(:, :) !! as of scene_t
    logical :: may_turn = .false.        !! faces may: the deck asks for finite strain
  end type general_contact_t

  !> A pair that follows.
  type :: general_pair_t
    integer :: surface = 0          !! of the slave
    integer :: master = 0           !! obstacle; 0: a surface
    integer :: master_surface = 0
    integer :: interaction = 0      !! 0: none
  end type general_pair_t

  !> The outer faces of all bodies, by body, and behind them the obstacles.
  type :: sides_t
    integer, allocatable :: face(:, :)  !! (2,n) element, face 1..6
    integer, allocatable :: first(:)    !! (n_bodies+1) of each body
    integer, allocatable :: body(:)
    !! (n_pieces) of each piece of the mesh: what a section of a bolt cuts is one body
    integer, allocatable :: kind(:)     !! (n+n_obstacles) alike in all that the rules name
    logical, allocatable :: named(:, :) !! (n_kinds,2*n_rules) whether a side of a rule has them
  end type sides_t

  !> Bodies: what the choice of the slave takes.
  type :: bodies_t
    integer :: n = 0
    type(string_t), allocatable :: name(:)
    real(wp), allocatable :: low(:, :), high(:, :) !! (3,n) the box of each [length]
    real(wp), allocatable :: edge(:)       !! (n) mean edge of the deck's outer faces [length]
    real(wp), allocatable :: stiffness(:)          !! (n) mean Young's modulus [force/length^2]
    logical, allocatable :: is_rigid(:)            !! (n)
  end type bodies_t

  real(wp), parameter :: finer = 1.5_wp, softer = 2.0_wp !! that much makes the slave [-]

contains

  !> Find the pairs that follow; their surfaces are added.
  subroutine find_general_pairs(model, contact, obstacles, surfaces, pairs)
    type(model_t), intent(in) :: model          !! with skin and bodies
    type(general_contact_t), intent(in) :: contact
    type(obstacle_t), intent(in) :: obstacles(:)
    type(surface_list_t), intent(inout) :: surfaces
    type(general_pair_t), allocatable, intent(out) :: pairs(:)
    type(sides_t) :: sides
    type(bodies_t) :: bodies
    integer, allocatable :: group(:, :)
    !! (1+n_kinds,n_groups) body, and 1 for the kinds of faces that it has
    integer, allocatable :: group_surface(:)
    integer :: one, other

    allocate (pairs(0))
    call find_sides(model, contact, obstacles, surfaces, sides)
    call find_bodies(model, contact, sides, bodies)
    allocate (group(1 + size(sides%named, 1), 0), group_surface(0))
    do one = 1, bodies%n
      if (.not. bodies%is_rigid(one)) call pair_itself(one)
      do other = one + 1, bodies%n
        if (.not. can_meet(bodies, one, other)) cycle
        if (is_slave(bodies, one, other)) then
          call pair_bodies(one, other)
        else
          call pair_bodies(other, one)
        end if
      end do
      do other = 1, size(obstacles)
        call pair_obstacle(one, other)
      end do
    end do

  contains

    !> The pairs of two bodies: one, or more where parts of them touch by other rules than others.
    subroutine pair_bodies(slave, master)
      integer, intent(in) :: slave, master
      integer, allocatable :: of_slave(:), of_master(:), verdict(:, :)
      logical, allocatable :: is_done(:), rows(:), columns(:)
      integer :: i, k, v

      allocate (of_slave, source=kinds_of(sides, slave))
      allocate (of_master, source=kinds_of(sides, master))
      allocate (verdict, source=verdicts(sides, contact%rules, of_slave, of_master))
      do v = 0, maxval(verdict)
        is_done = .not. any(verdict == v, dim=2)
        do i = 1, size(of_slave)
          if (is_done(i)) cycle
          columns = verdict(i, :) == v
          rows = [(all((verdict(k, :) == v) .eqv. columns), k=1, size(of_slave))]
          is_done = is_done .or. rows
          pairs = [pairs, general_pair_t(surface_of(slave, pack(of_slave, rows)), 0, &
            surface_of(master, pack(of_master, columns)), v)]
        end do
      end do
    end subroutine pair_bodies

    !> The pairs of a body with itself. Where all faces may touch by one rule it is of one surface,
    !> whose sides are found where nodes are in the run; there is none where no two faces are turned
    !> towards each other. Else it is of the sides that it has in the mesh, and there is none where
    !> no face sees another there.
    subroutine pair_itself(body)
      integer, intent(in) :: body
      integer, allocatable :: kinds(:), verdict(:, :), side(:), faces(:, :), index(:)
      integer, allocatable :: number(:) ! of each kind among those of the body
      integer :: of(2), f, k, v

      allocate (kinds, source=kinds_of(sides, body))
      allocate (verdict, source=verdicts(sides, contact%rules, kinds, kinds))
      if (all(verdict < 0)) return
      allocate (number(size(sides%named, 1)), source=0)
      number(kinds) = [(k, k=1, size(kinds))]
      associate (first => sides%first(body), last => sides%first(body + 1) - 1)
        allocate (faces, source=sides%face(:, first:last))
        number = number(sides%kind(first:last))
      end associate
      if (all(verdict == verdict(1, 1))) then
        if (.not. may_touch_itself(nodes_of(faces, model%mesh%connectivity), &
          model%mesh%coordinates)) return
        of = surface_of(body, kinds)
        pairs = [pairs, general_pair_t(of(1), 0, of(2), verdict(1, 1))]
        return
      end if
      do v = 0, maxval(verdict)
        if (.not. any(verdict == v)) cycle
        if (allocated(side)) deallocate (side)
        call divide_surface(nodes_of(faces, model%mesh%connectivity), model%mesh%coordinates, &
          side, number, verdict == v)
        if (.not. any(side > 0)) cycle
        do k = 1, 2
          index = pack([(f, f=1, size(side))], side == k)
          call add_faces(model%mesh, free_name(surfaces, bodies%name(body)%text, group_surface), &
            faces(:, index), surfaces, of(k))
        end do
        pairs = [pairs, general_pair_t(of(1), 0, of(2), v)]
      end do
    end subroutine pair_itself

    !> The pairs of a body and an obstacle. Before one that is no mesh they are of the faces that
    !> are turned towards it, unless faces may turn.
    subroutine pair_obstacle(body, obstacle)
      integer, intent(in) :: body, obstacle
      integer, allocatable :: of_slave(:), verdict(:, :)
      integer :: v, index, its

      allocate (of_slave, source=kinds_of(sides, body))
      its = sides%kind(size(sides%face, 2) + obstacle)
      allocate (verdict, source=verdicts(sides, contact%rules, of_slave, [its]))
      do v = 0, maxval(verdict)
        if (.not. any(verdict == v)) cycle
        if (is_meshed(obstacles(obstacle)) .or. (contact%may_turn .and. .not. has_by_hand(sides, &
          contact%rules, of_slave, its))) then
          index = surface_of(body, pack(of_slave, verdict(:, 1) == v))
        else
          ! Nodes that two pairs have before a shape would divide their forces: a pair by hand is of
          ! the whole body.
          if (has_by_hand(sides, contact%rules, of_slave, its)) cycle
          index = surface_towards(body, pack(of_slave, verdict(:, 1) == v), obstacles(obstacle), &
            all(verdict < 0 .or. verdict == v))
        end if
        if (index > 0) pairs = [pairs, general_pair_t(index, obstacle, 0, v)]
      end do
    end subroutine pair_obstacle

    !> The surface of the faces of some kinds that a body has, made once.
    integer function surface_of(body, kinds) result(index)
      integer, intent(in) :: body, kinds(:)
      integer :: key(size(group, 1)), g

      key = 0
      key(1) = body
      key(1 + kinds) = 1
      do g = 1, size(group_surface)
        index = group_surface(g)
        if (all(group(:, g) == key)) return
      end do
      call add_faces(model%mesh, free_name(surfaces, bodies%name(body)%text, group_surface), &
        faces_of(sides, body, kinds), surfaces, index)
      group = reshape([group, key], [size(key), size(group, 2) + 1])
      group_surface = [group_surface, index]
    end function surface_of

    !> The surface of those faces of some kinds that look towards an obstacle; 0: none does.
    integer function surface_towards(body, kinds, obstacle, is_only) result(index)
      integer, intent(in) :: body, kinds(:)
      type(obstacle_t), intent(in) :: obstacle
      logical, intent(in) :: is_only !! of the body before this obstacle: the name may be another's
      character(:), allocatable :: name
      integer, allocatable :: faces(:, :)
      real(wp) :: normal(3), away(3), gap
      logical, allocatable :: looks(:)
      integer :: f, nodes(face_corners)

      allocate (faces, source=faces_of(sides, body, kinds))
      allocate (looks(size(faces, 2)))
      do f = 1, size(faces, 2)
        nodes = nodes_of_face(model%mesh%connectivity, faces(1, f), faces(2, f))
        associate (x => model%mesh%coordinates(:, nodes(:corners_in(nodes))))
          normal = sum(face_area_vectors(x), 2)
          call locate_point(obstacle, [0.0_wp, 0.0_wp, 0.0_wp], sum(x, 2)/size(x, 2), gap, away)
        end associate
        looks(f) = dot_product(normal, away) <= against*norm2(normal)
      end do
      index = 0
      if (.not. any(looks)) return
      name = bodies%name(body)%text
      if (.not. is_only) name = free_name(surfaces, name, group_surface)
      call add_faces(model%mesh, name, faces(:, pack([(f, f=1, size(looks))], looks)), surfaces, &
        index)
      ! Its name is taken; no pair of bodies looks for it.
      group = reshape([group, spread(0, 1, size(group, 1))], [size(group, 1), size(group, 2) + 1])
      group_surface = [group_surface, index]
    end function surface_towards

  end subroutine find_general_pairs

  !> The pieces of the mesh that exclusions let overlap, where everything else may touch everything.
  subroutine find_left_out(model, surfaces, contact)
    type(model_t), intent(in) :: model
    type(surface_list_t), intent(in) :: surfaces
    type(general_contact_t), intent(inout) :: contact
    logical :: has(maxval(model%mesh%piece), 2)
    logical, allocatable :: are_left_out(:, :)
    integer :: r, k, one, other

    if (.not. any(contact%rules%says == may_touch .and. contact%rules%side(1) == everything .and. &
      contact%rules%side(2) == everything)) return
    allocate (are_left_out(size(has, 1), size(has, 1)), source=.false.)
    do r = 1, size(contact%rules)
      if (contact%rules(r)%says /= never_touch) cycle
      do k = 1, 2
        has(:, k) = contact%rules(r)%side(k) == everything
        if (contact%rules(r)%side(k) > 0) has(model%mesh%piece(surfaces%list( &
          contact%rules(r)%side(k))%nodes), k) = .true.
      end do
      do other = 1, size(has, 1)
        if (has(other, 2)) are_left_out(:, other) = are_left_out(:, other) .or. has(:, 1)
        if (has(other, 1)) are_left_out(:, other) = are_left_out(:, other) .or. has(:, 2)
      end do
    end do
    contact%may_overlap = reshape([((pack([one, other], are_left_out(one, other)), one=1, &
      other), other=1, size(has, 1))], [2, count([((are_left_out(one, other), one=1, &
      other), other=1, size(has, 1))])])
  end subroutine find_left_out

  !> A name that neither a surface with a name nor another of the general pairs has.
  function free_name(surfaces, name, others) result(free)
    type(surface_list_t), intent(in) :: surfaces
    character(*), intent(in) :: name
    integer, intent(in) :: others(:)
    character(:), allocatable :: free
    integer :: k, n

    free = name
    n = 1
    do
      do k = 1, surfaces%n_named + size(others)
        if (k <= surfaces%n_named) then
          if (surfaces%list(k)%name == free) exit
        else
          if (surfaces%list(others(k - surfaces%n_named))%name == free) exit
        end if
      end do
      if (k > surfaces%n_named + size(others)) return
      n = n + 1
      free = name//'-'//to_text(n)
    end do
  end function free_name

  !> The outer faces by body, and which of them, and which obstacles, the rules tell apart.
  subroutine find_sides(model, contact, obstacles, surfaces, sides)
    type(model_t), intent(in) :: model
    type(general_contact_t), intent(in) :: contact
    type(obstacle_t), intent(in) :: obstacles(:)
    type(surface_list_t), intent(in) :: surfaces
    type(sides_t), intent(out) :: sides
    integer, allocatable :: face(:, :), number(:, :), body(:), next(:), renumbered(:)
    logical, allocatable :: has(:), touches(:), doubled(:)
    integer :: f, i, k, r, n, n_kinds

    associate (mesh => model%mesh)
      allocate (face, source=skin_faces(mesh))
      allocate (number(6, mesh%n_elements), source=0)
      do f = 1, size(face, 2)
        number(face(2, f), face(1, f)) = f
      end do
      ! Faces that a tie or a section of a bolt joins touch nothing.
      allocate (touches(size(face, 2)), source=.true.)
      do i = 1, size(contact%tied)
        associate (tied => surfaces%list(contact%tied(i))%faces)
          do f = 1, size(tied, 2)
            k = number(tied(2, f), tied(1, f))
            if (k > 0) touches(k) = .false.
          end do
        end associate
      end do
      if (allocated(model%twins)) then
        allocate (doubled(0:mesh%n_nodes), source=.false.)
        doubled(0) = .true.
        doubled([model%twins]) = .true.
        do f = 1, size(face, 2)
          associate (nodes => nodes_of_face(mesh%connectivity, face(1, f), face(2, f)))
            touches(f) = touches(f) .and. .not. all(doubled(nodes))
          end associate
        end do
      end if
      ! By body, in the order of the elements.
      call join_pieces(model, sides%body)
      allocate (body(size(face, 2)))
      do f = 1, size(face, 2)
        associate (nodes => nodes_of_face(mesh%connectivity, face(1, f), face(2, f)))
          body(f) = sides%body(mesh%piece(nodes(1)))
        end associate
      end do
      allocate (sides%first(maxval(sides%body) + 1), source=0)
      do f = 1, size(face, 2)
        if (touches(f)) sides%first(body(f) + 1) = sides%first(body(f) + 1) + 1
      end do
      sides%first(1) = 1
      do i = 2, size(sides%first)
        sides%first(i) = sides%first(i) + sides%first(i - 1)
      end do
      n = count(touches)
      allocate (sides%face(2, n))
      next = sides%first
      number = 0
      do f = 1, size(face, 2)
        if (.not. touches(f)) cycle
        sides%face(:, next(body(f))) = face(:, f)
        number(face(2, f), face(1, f)) = next(body(f))
        next(body(f)) = next(body(f)) + 1
      end do
    end associate
    allocate (sides%kind(n + size(obstacles)), source=1)
    n_kinds = 1
    do r = 1, size(contact%rules)
      do k = 1, 2
        has = members(contact%rules(r)%side(k))
        allocate (renumbered(2*n_kinds + 1), source=0)
        n_kinds = 0
        do i = 1, size(has)
          associate (now => renumbered(2*sides%kind(i) + merge(1, 0, has(i))))
            if (now == 0) then
              n_kinds = n_kinds + 1
              now = n_kinds
            end if
            sides%kind(i) = now
          end associate
        end do
        deallocate (renumbered)
      end do
    end do
    allocate (sides%named(n_kinds, 2*size(contact%rules)), source=.false.)
    do r = 1, size(contact%rules)
      do k = 1, 2
        has = members(contact%rules(r)%side(k))
        do i = 1, size(has)
          if (has(i)) sides%named(sides%kind(i), 2*(r - 1) + k) = .true.
        end do
      end do
    end do

  contains

    !> Which faces and obstacles a side has.
    function members(side) result(has)
      integer, intent(in) :: side
      logical :: has(n + size(obstacles))
      integer :: f

      has = .false.
      if (side == everything) then
        has(:n) = .true.
        has(n + 1:) = .not. obstacles%is_of_gap ! that stops one node
      else if (side < 0) then
        has(n - side) = .true.
      else
        associate (of => surfaces%list(side)%faces)
          do f = 1, size(of, 2)
            if (number(of(2, f), of(1, f)) > 0) has(number(of(2, f), of(1, f))) = .true.
          end do
        end associate
      end if
    end function members

  end subroutine find_sides

  !> Number the bodies: pieces of the mesh, those that sections of bolts cut taken together.
  subroutine join_pieces(model, body)
    type(model_t), intent(in) :: model
    integer, allocatable, intent(out) :: body(:) !! (n_pieces)
    integer :: k, n, old

    allocate (body(maxval(model%mesh%piece)))
    body = [(k, k=1, size(body))]
    if (.not. allocated(model%twins)) return
    associate (piece => model%mesh%piece)
      do k = 1, size(model%twins, 2)
        associate (one => body(piece(model%twins(1, k))), other => body(piece(model%twins(2, k))))
          old = max(one, other)
          n = min(one, other)
        end associate
        where (body == old) body = n
      end do
    end associate
    ! Without gaps.
    n = 0
    do k = 1, size(body)
      if (.not. any(body == k)) cycle
      n = n + 1
      where (body == k) body = n
    end do
  end subroutine join_pieces

  !> The kinds of faces that a body has, ascending.
  pure function kinds_of(sides, body) result(kinds)
    type(sides_t), intent(in) :: sides
    integer, intent(in) :: body
    integer, allocatable :: kinds(:)
    logical :: has(size(sides%named, 1))
    integer :: k

    has = .false.
    has(sides%kind(sides%first(body):sides%first(body + 1) - 1)) = .true.
    kinds = pack([(k, k=1, size(has))], has)
  end function kinds_of

  !> The faces of some kinds that a body has.
  pure function faces_of(sides, body, kinds) result(faces)
    type(sides_t), intent(in) :: sides
    integer, intent(in) :: body, kinds(:)
    integer, allocatable :: faces(:, :) !! (2,n) element, face
    logical :: is_one(size(sides%named, 1))
    integer :: f

    is_one = .false.
    is_one(kinds) = .true.
    faces = sides%face(:, pack([(f, f=sides%first(body), sides%first(body + 1) - 1)], &
      is_one(sides%kind(sides%first(body):sides%first(body + 1) - 1))))
  end function faces_of

  !> What rules say of each two kinds: the interaction, 0 where none is named; -1: they do not
  !> touch. Exclusions win; of interactions that fit the last does.
  pure function verdicts(sides, rules, one, other) result(verdict)
    type(sides_t), intent(in) :: sides
    type(touch_rule_t), intent(in) :: rules(:)
    integer, intent(in) :: one(:), other(:) !! kinds
    integer, allocatable :: verdict(:, :)
    logical :: fits, touch, never
    integer :: i, k, r

    allocate (verdict(size(one), size(other)), source=-1)
    do k = 1, size(other)
      do i = 1, size(one)
        touch = .false.
        never = .false.
        do r = 1, size(rules)
          associate (first => sides%named(:, 2*r - 1), second => sides%named(:, 2*r))
            fits = (first(one(i)) .and. second(other(k))) .or. (second(one(i)) .and. &
              first(other(k)))
          end associate
          if (.not. fits) cycle
          select case (rules(r)%says)
          case (may_touch)
            touch = .true.
          case (never_touch, is_by_hand)
            never = .true.
          case default ! touch_by
            verdict(i, k) = rules(r)%interaction
          end select
        end do
        verdict(i, k) = merge(max(0, verdict(i, k)), -1, touch .and. .not. never)
      end do
    end do
  end function verdicts

  !> Whether a contact pair of the deck has a face of some kinds before an obstacle.
  pure logical function has_by_hand(sides, rules, kinds, obstacle) result(has)
    type(sides_t), intent(in) :: sides
    type(touch_rule_t), intent(in) :: rules(:)
    integer, intent(in) :: kinds(:), obstacle !! its kind
    integer :: r

    has = .false.
    do r = 1, size(rules)
      if (rules(r)%says /= is_by_hand .or. .not. sides%named(obstacle, 2*r)) cycle
      has = has .or. any(sides%named(kinds, 2*r - 1))
    end do
  end function has_by_hand

  !> Names, boxes and what else tells bodies apart.
  subroutine find_bodies(model, contact, sides, bodies)
    type(model_t), intent(in) :: model
    type(general_contact_t), intent(in) :: contact
    type(sides_t), intent(in) :: sides
    type(bodies_t), intent(out) :: bodies
    integer, allocatable :: n_elements(:)
    integer :: b, e, node, body(model%mesh%n_elements)

    bodies%n = size(sides%first) - 1
    allocate (bodies%is_rigid(bodies%n), source=.false.)
    do b = 1, size(contact%is_rigid)
      if (contact%is_rigid(b)) bodies%is_rigid(sides%body(b)) = .true.
    end do
    allocate (bodies%low(3, bodies%n), source=huge(1.0_wp))
    allocate (bodies%high(3, bodies%n), source=-huge(1.0_wp))
    allocate (bodies%stiffness(bodies%n), source=0.0_wp)
    allocate (n_elements(bodies%n), source=0)
    associate (mesh => model%mesh)
      do node = 1, mesh%n_nodes
        if (mesh%piece(node) == 0) cycle
        b = sides%body(mesh%piece(node))
        bodies%low(:, b) = min(bodies%low(:, b), mesh%coordinates(:, node))
        bodies%high(:, b) = max(bodies%high(:, b), mesh%coordinates(:, node))
      end do
      do e = 1, mesh%n_elements
        associate (nodes => nodes_of_element(mesh%connectivity, e))
          body(e) = sides%body(mesh%piece(nodes(1)))
        end associate
        n_elements(body(e)) = n_elements(body(e)) + 1
        bodies%stiffness(body(e)) = bodies%stiffness(body(e)) + contact%young(e)
      end do
    end associate
    bodies%stiffness = bodies%stiffness/n_elements
    bodies%edge = mean_edges(model%mesh, sides)
    call name_bodies(model, body, n_elements, bodies%name)
  end subroutine find_bodies

  !> Bodies are called as the first set of elements that is the body, nothing else; one of an
  !> instance that has no second such as the instance; others BODY-n.
  subroutine name_bodies(model, body, n_elements, name)
    type(model_t), intent(in) :: model
    integer, intent(in) :: body(:)        !! (n_elements) of each
    integer, intent(in) :: n_elements(:)  !! (n_bodies) how many each has
    type(string_t), allocatable, intent(out) :: name(:)
    type(string_t) :: instance(size(n_elements))
    integer :: b, i, k, n

    allocate (name(size(n_elements)))
    do b = 1, size(name)
      name(b)%text = ''
    end do
    associate (sets => model%element_sets)
      do k = 1, sets%n
        if (.not. allocated(sets%list(k)%members) .or. sets%list(k)%n == 0) cycle
        associate (its => body(sets%list(k)%members(:sets%list(k)%n)))
          b = its(1)
          if (name(b)%text /= '' .or. size(its) /= n_elements(b) .or. any(its /= b)) cycle
        end associate
        name(b)%text = sets%names(k)%text
      end do
    end associate
    do b = 1, size(name)
      if (name(b)%text == '') name(b)%text = 'BODY-'//to_text(b)
      i = index(name(b)%text, '.')
      instance(b)%text = name(b)%text(:max(0, i - 1))
    end do
    do b = 1, size(name)
      if (instance(b)%text == '') cycle
      n = count([(instance(k)%text == instance(b)%text, k=1, size(name))])
      if (n == 1) name(b)%text = instance(b)%text
    end do
  end subroutine name_bodies

  !> The mean edge of the faces of each body as the deck has them: that of squares of their mean
  !> area, of slices the mean of their edges in the plane. Faces that were cut count as one.
  pure function mean_edges(mesh, sides) result(edge)
    type(mesh_draft_t), intent(in) :: mesh
    type(sides_t), intent(in) :: sides
    real(wp) :: edge(size(sides%first) - 1) !! [length]
    integer :: b, e, f
    integer, allocatable :: given(:)        ! (n_elements) the deck's element
    logical, allocatable :: is_counted(:, :)
    real(wp) :: n

    allocate (given(mesh%n_elements), source=[(e, e=1, mesh%n_elements)])
    if (allocated(mesh%first_piece)) then
      do e = 1, size(mesh%first_piece) - 1
        given(mesh%first_piece(e):mesh%first_piece(e + 1) - 1) = e
      end do
    end if
    allocate (is_counted(6, maxval(given)), source=.false.)
    do b = 1, size(edge)
      edge(b) = 0.0_wp
      n = 0.0_wp
      do f = sides%first(b), sides%first(b + 1) - 1
        associate (element => sides%face(1, f), face => sides%face(2, f))
          edge(b) = edge(b) + size_of_face(mesh, element, face)
          if (is_counted(face, given(element))) cycle
          is_counted(face, given(element)) = .true.
          n = n + merge(0.5_wp, 1.0_wp, mesh%plane == solids .and. corners_in(nodes_of_face( &
            mesh%connectivity, element, face)) == 3)
        end associate
      end do
      edge(b) = edge(b)/max(0.5_wp, n)
      if (mesh%plane == solids) edge(b) = sqrt(edge(b))
    end do
  end function mean_edges

  !> Whether two bodies may meet: not where they are farther apart than both are long together.
  pure logical function can_meet(bodies, one, other)
    type(bodies_t), intent(in) :: bodies
    integer, intent(in) :: one, other

    associate (low => bodies%low, high => bodies%high)
      can_meet = norm2(max(0.0_wp, low(:, one) - high(:, other), low(:, other) - high(:, one))) <= &
        norm2(high(:, one) - low(:, one)) + norm2(high(:, other) - low(:, other))
    end associate
  end function can_meet

  !> Whether the first of two bodies is the slave: what deforms before what is rigid, the finer
  !> mesh, the softer body, the first.
  pure logical function is_slave(bodies, one, other)
    type(bodies_t), intent(in) :: bodies
    integer, intent(in) :: one, other !! one < other

    if (bodies%is_rigid(one) .neqv. bodies%is_rigid(other)) then
      is_slave = bodies%is_rigid(other)
    else if (max(bodies%edge(one), bodies%edge(other)) > finer*min(bodies%edge(one), &
      bodies%edge(other))) then
      is_slave = bodies%edge(one) < bodies%edge(other)
    else if (max(bodies%stiffness(one), bodies%stiffness(other)) > softer*min( &
      bodies%stiffness(one), bodies%stiffness(other))) then
      is_slave = bodies%stiffness(one) < bodies%stiffness(other)
    else
      is_slave = .true.
    end if
  end function is_slave

end module general_pairs_mod
