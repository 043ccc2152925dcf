!> A body of elements as an obstacle of its faces (--as-rigid): where supports alone say how it
!> moves, and it moves as a whole.
module take_as_rigid_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t, raise, exit_wrong_input
  use text_mod, only: string_t, to_text, upper
  use connectivity_mod, only: nodes_of_element
  use surfaces_mod, only: split_faces
  use obstacles_mod, only: obstacle_t, obstacle_of_facets, ref_nodes
  use loads_mod, only: nodal_value_t, pressure_t
  use scene_mod, only: scene_t
  use part_of_scene_mod, only: leave_out_elements
  use step_loads_mod, only: prescribed_dofs
  use rigid_modes_mod, only: free_motions_t, find_free_motions
  implicit none
  private

  public :: take_as_rigid, why_not_rigid

contains

  !> Make the body of an element set an obstacle: its surfaces that are in contact become facets,
  !> which move as its supports do. Surfaces of other bodies that are masters of its become slaves.
  subroutine take_as_rigid(scene, name, error)
    type(scene_t), intent(inout) :: scene
    character(*), intent(in) :: name !! of the set
    type(error_t), allocatable, intent(out) :: error !! no such set, or `why_not_rigid`
    logical, allocatable :: is_rigid(:) !! (n_elements)
    character(:), allocatable :: why
    type(string_t) :: note
    integer :: set, k, ref_node

    set = 0
    do k = 1, size(scene%element_sets)
      if (scene%element_sets(k)%name == upper(trim(adjustl(name)))) set = k
    end do
    if (set == 0) then
      call raise(error, exit_wrong_input, "bipot: error: --as-rigid '"//name//"': the deck has "// &
        'no element set of this name'//names_of_sets(scene))
      return
    end if
    allocate (is_rigid(scene%mesh%n_elements), source=.false.)
    is_rigid(scene%element_sets(set)%members) = .true.
    why = why_not_rigid(scene, is_rigid)
    if (why /= '') then
      call raise(error, exit_wrong_input, "bipot: error: --as-rigid '"//name//"': "//why)
      return
    end if
    call take_motion(scene, nodes_of(scene, is_rigid), ref_node)
    do k = 1, size(scene%pairs)
      call face_obstacle(scene, is_rigid, k, ref_node)
    end do
    note%text = trim(adjustl(name))//' is rigid: an obstacle of its faces, '// &
      to_text(count(is_rigid))//' elements left out'
    if (ref_node > 0) note%text = note%text//'; node '//to_text(scene%mesh%node_id(ref_node))// &
      ' moves it'
    scene%notes = [scene%notes, note]
    call leave_out_elements(scene, .not. is_rigid)
  end subroutine take_as_rigid

  !> Why elements cannot be an obstacle, in words; '' where they can.
  function why_not_rigid(scene, is_rigid) result(why)
    type(scene_t), intent(in) :: scene
    logical, intent(in) :: is_rigid(:) !! (n_elements)
    character(:), allocatable :: why
    logical :: is_of(scene%mesh%n_nodes)

    why = ''
    if (all(is_rigid)) why = 'nothing else is left to be deformed'
    if (.not. any(is_rigid)) why = 'it has no elements'
    if (why /= '') return
    is_of = nodes_of(scene, is_rigid)
    why = why_not_apart(scene, is_rigid, is_of)
    if (why == '') why = why_no_pair(scene, is_rigid)
    if (why == '') why = why_loaded(scene, is_rigid, is_of)
    if (why == '') why = why_free(scene, is_of)
    if (why == '') why = why_bent(scene, is_of)
  end function why_not_rigid

  !> It shares nodes, or is joined.
  function why_not_apart(scene, is_rigid, is_of) result(why)
    type(scene_t), intent(in) :: scene
    logical, intent(in) :: is_rigid(:), is_of(:)
    character(:), allocatable :: why
    integer :: e, c, k

    why = ''
    do e = 1, scene%mesh%n_elements
      if (is_rigid(e)) cycle
      associate (nodes => nodes_of_element(scene%mesh%connectivity, e))
        if (.not. any(is_of(nodes))) cycle
        k = nodes(findloc(is_of(nodes), .true., dim=1))
      end associate
      why = 'it is no body of its own: node '//to_text(scene%mesh%node_id(k))// &
        ' belongs to element '//to_text(scene%mesh%element_id(e))//' as well'
      return
    end do
    do c = 1, scene%constraints%n
      associate (masters => scene%constraints%master(scene%constraints%first(c): &
        scene%constraints%first(c + 1) - 1))
        if (.not. (is_of(scene%constraints%node(c)) .or. any(is_of(masters)))) cycle
      end associate
      why = 'ties, equations, couplings or *TRANSFORM join or turn its nodes'
      return
    end do
    if (scene%mesh%springs%n > 0) then
      associate (springs => scene%mesh%springs)
        if (any(is_of(springs%node(:springs%first(springs%n + 1) - 1)))) why = &
          'springs join its nodes'
      end associate
    end if
    if (any(is_of(max(1, scene%obstacles%ref_node)) .and. scene%obstacles%is_on_body)) why = &
      'gaps press its nodes'
    if (allocated(scene%local_axes)) then
      if (any(is_of(scene%local_axes%node))) why = '*TRANSFORM turns its nodes'
    end if
  end function why_not_apart

  !> It touches nothing, or an obstacle, or pairs say more than obstacles take.
  function why_no_pair(scene, is_rigid) result(why)
    type(scene_t), intent(in) :: scene
    logical, intent(in) :: is_rigid(:)
    character(:), allocatable :: why
    logical :: slave, master, is_touched
    integer :: k

    why = ''
    is_touched = .false.
    do k = 1, size(scene%pairs)
      associate (pair => scene%pairs(k))
        slave = is_on(pair%surface)
        master = .false.
        if (pair%master == 0) master = is_on(pair%master_surface)
        if (.not. (slave .or. master)) cycle
        is_touched = .true.
        if (slave .and. (master .or. pair%master > 0)) then
          why = 'of pair '//pair%name//' both sides would be rigid'
        else if (slave .and. allocated(pair%left_open)) then
          why = 'the slave of pair '//pair%name//' has nodes and no faces'
        else if (pair%has_clearance) then
          why = 'obstacles have no *CLEARANCE, as pair '//pair%name//' has'
        else if (is_part(pair%surface)) then
          why = 'surface '//scene%surfaces(pair%surface)%name//' is of other bodies as well'
        else if (pair%master == 0) then
          if (is_part(pair%master_surface)) why = 'surface '// &
            scene%surfaces(pair%master_surface)%name//' is of other bodies as well'
        end if
        if (why == '' .and. slave .and. has_gap(pair%surface)) why = 'pair '//pair%name// &
          ' has a *CONTACT GAP on it, which would be the master'
      end associate
      if (why /= '') return
    end do
    if (.not. is_touched) why = 'no *CONTACT PAIR has a surface of it'

  contains

    logical function is_on(surface)
      integer, intent(in) :: surface

      is_on = any(is_rigid(scene%surfaces(surface)%faces(1, :)))
    end function is_on

    logical function is_part(surface)
      integer, intent(in) :: surface

      is_part = is_on(surface) .and. .not. all(is_rigid(scene%surfaces(surface)%faces(1, :)))
    end function is_part

    logical function has_gap(surface)
      integer, intent(in) :: surface
      logical :: has_node(scene%mesh%n_nodes)
      integer :: g

      has_node = .false.
      has_node(scene%surfaces(surface)%nodes) = .true.
      has_gap = any([(any(has_node(scene%gaps(g)%nodes)), g=1, size(scene%gaps))])
    end function has_gap

  end function why_no_pair

  !> Forces or pressures act on it, or it expands. Its weight goes into its supports.
  function why_loaded(scene, is_rigid, is_of) result(why)
    type(scene_t), intent(in) :: scene
    logical, intent(in) :: is_rigid(:), is_of(:)
    character(:), allocatable :: why
    integer :: step, i, e

    why = ''
    do step = 1, size(scene%steps)
      associate (this => scene%steps(step))
        if (any(is_of(this%forces%node) .and. abs(this%forces%value) > 0.0_wp)) why = 'forces'
        do i = 1, size(this%pressures)
          if (is_pressed(this%pressures(i))) why = 'pressures'
        end do
        do i = 1, size(this%face_pressures)
          if (is_pressed(this%face_pressures(i))) why = 'pressures'
        end do
        if (why /= '') then
          why = 'in step '//to_text(step)//' '//why//' act on it, which an obstacle does not take'
          return
        end if
        if (.not. allocated(this%temperatures)) cycle
        do e = 1, scene%mesh%n_elements
          if (.not. is_rigid(e)) cycle
          if (.not. abs(scene%materials(scene%mesh%material(e))%expansion) > 0.0_wp) cycle
          if (any(is_of(this%temperatures%node))) then
            why = 'in step '//to_text(step)//' it expands, which an obstacle does not'
            return
          end if
        end do
      end associate
    end do

  contains

    logical function is_pressed(pressure)
      type(pressure_t), intent(in) :: pressure

      is_pressed = abs(pressure%value) > 0.0_wp .and. any(is_rigid(scene%surfaces( &
        pressure%surface)%faces(1, :)))
    end function is_pressed

  end function why_loaded

  !> Supports leave rigid motions of it free, or do not hold the same in all steps.
  function why_free(scene, is_of) result(why)
    type(scene_t), intent(in) :: scene
    logical, intent(in) :: is_of(:)
    character(:), allocatable :: why
    type(free_motions_t) :: motions
    type(error_t), allocatable :: error
    logical, dimension(3, scene%mesh%n_nodes) :: first, now
    integer :: step

    why = ''
    first = prescribed_dofs(scene, 1)
    call find_free_motions(scene%mesh, first, ref_nodes(scene%obstacles), [integer ::], motions, &
      error, scene%constraints)
    if (allocated(error)) then
      why = 'its rigid motions are not known: '//error%message
    else if (any(motions%body == scene%mesh%body(findloc(is_of, .true., dim=1)))) then
      why = 'its supports leave it free to move as a whole'
    end if
    do step = 2, size(scene%steps)
      if (why /= '') return
      now = prescribed_dofs(scene, step)
      if (any((now .neqv. first) .and. spread(is_of, 1, 3))) why = 'its supports are others in '// &
        'step '//to_text(step)//' than before'
    end do
  end function why_free

  !> Supports do not move all of it by the same.
  function why_bent(scene, is_of) result(why)
    type(scene_t), intent(in) :: scene
    logical, intent(in) :: is_of(:)
    character(:), allocatable :: why
    type(nodal_value_t) :: motion(3, size(scene%steps))
    integer :: dof, step

    why = ''
    call find_motion(scene, is_of, motion, dof, step)
    if (dof > 0) why = 'in step '//to_text(step)//' its supports do not move by the same along '// &
      'dof '//to_text(dof)//': they bend or turn it'
  end function why_bent

  !> How supports move a body along each axis in each *STEP.
  pure subroutine find_motion(scene, is_of, motion, bent_dof, bent_step)
    type(scene_t), intent(in) :: scene
    logical, intent(in) :: is_of(:)
    type(nodal_value_t), intent(out) :: motion(:, :)
    !! (3,n_steps) of any of its nodes; of node 0: the *STEP says nothing
    integer, intent(out) :: bent_dof, bent_step !! where they do not move it as a whole; else 0
    logical :: held(3, scene%mesh%n_nodes), named(scene%mesh%n_nodes)
    logical :: moves !! it has been moved along the axis
    integer :: dof, step, i

    bent_dof = 0
    bent_step = 0
    held = prescribed_dofs(scene, 1)
    do dof = 1, 3
      moves = .false.
      do step = 1, size(scene%steps)
        named = .false.
        associate (cards => scene%steps(step)%boundary, of => motion(dof, step))
          do i = 1, size(cards)
            if (cards(i)%dof /= dof .or. .not. is_of(cards(i)%node)) cycle
            named(cards(i)%node) = .true.
            if (of%node == 0) of = cards(i)
            if (.not. goes_along(cards(i), of)) bent_dof = dof
          end do
          if (of%node > 0 .and. any(is_of .and. held(dof, :) .and. .not. named)) then
            ! What it does not name stays where it is.
            if (moves .or. abs(of%value) > 0.0_wp) bent_dof = dof
          end if
          moves = moves .or. abs(of%value) > 0.0_wp
        end associate
        bent_step = step
        if (bent_dof > 0) return
      end do
    end do
    bent_step = 0

  contains

    !> Whether two supports move by the same.
    pure logical function goes_along(one, other)
      type(nodal_value_t), intent(in) :: one, other

      goes_along = .not. abs(one%value - other%value) > 0.0_wp .and. (one%fixed .eqv. other%fixed)
      if (abs(other%value) > 0.0_wp) goes_along = goes_along .and. one%amplitude == other%amplitude
    end function goes_along

  end subroutine find_motion

  !> Give the motion of a body to one of its nodes; none where it is at rest.
  subroutine take_motion(scene, is_of, ref_node)
    type(scene_t), intent(inout) :: scene
    logical, intent(in) :: is_of(:)
    integer, intent(out) :: ref_node !! 0: at rest
    type(nodal_value_t) :: motion(3, size(scene%steps))
    integer :: dof, step, bent_dof, bent_step

    ref_node = 0
    call find_motion(scene, is_of, motion, bent_dof, bent_step)
    if (any(abs(motion%value) > 0.0_wp)) ref_node = findloc(is_of, .true., dim=1)
    motion%node = merge(ref_node, 0, motion%node > 0)
    do step = 1, size(scene%steps)
      associate (this => scene%steps(step))
        this%boundary = pack(this%boundary, .not. is_of(this%boundary%node))
        if (ref_node == 0) cycle
        do dof = 1, 3
          if (motion(dof, step)%node > 0) this%boundary = [this%boundary, motion(dof, step)]
        end do
      end associate
    end do
  end subroutine take_motion

  !> Let a pair face an obstacle where it faces, or has, a surface of the body.
  subroutine face_obstacle(scene, is_rigid, k, ref_node)
    type(scene_t), intent(inout) :: scene
    logical, intent(in) :: is_rigid(:)
    integer, intent(in) :: k
    integer, intent(in) :: ref_node
    type(obstacle_t), allocatable :: all(:)
    integer, allocatable :: nodes(:, :), whole(:), corners(:)
    logical :: is_corner(scene%mesh%n_nodes)
    integer :: corner_of(0:scene%mesh%n_nodes)
    integer :: surface, i

    associate (pair => scene%pairs(k))
      if (pair%master > 0) return
      surface = pair%master_surface
      if (any(is_rigid(scene%surfaces(pair%surface)%faces(1, :)))) then
        surface = pair%surface
        pair%surface = pair%master_surface
      else if (.not. any(is_rigid(scene%surfaces(surface)%faces(1, :)))) then
        return
      end if
      pair%master_surface = 0
      pair%small_sliding = .false.
      pair%name = scene%surfaces(pair%surface)%name//':'//scene%surfaces(surface)%name
      do i = 1, size(scene%obstacles)
        if (scene%obstacles(i)%name == scene%surfaces(surface)%name) pair%master = i
      end do
      if (pair%master > 0) return ! of another pair
      call split_faces(scene%surfaces(surface)%faces, scene%mesh%connectivity, nodes, whole)
      is_corner = .false.
      is_corner(pack(nodes, nodes > 0)) = .true.
      corners = pack([(i, i=1, size(is_corner))], is_corner)
      corner_of = 0
      corner_of(corners) = [(i, i=1, size(corners))]
      allocate (all(size(scene%obstacles) + 1))
      do i = 1, size(scene%obstacles)
        all(i) = scene%obstacles(i)
      end do
      pair%master = size(all)
      all(size(all)) = obstacle_of_facets(scene%surfaces(surface)%name, &
        scene%mesh%coordinates(:, corners), reshape(corner_of(reshape(nodes, [size(nodes)])), &
        shape(nodes)), ref_node)
      call move_alloc(all, scene%obstacles)
    end associate
  end subroutine face_obstacle

  !> The nodes that some elements have.
  pure function nodes_of(scene, elements) result(has)
    type(scene_t), intent(in) :: scene
    logical, intent(in) :: elements(:) !! (n_elements)
    logical :: has(scene%mesh%n_nodes)
    integer :: e

    has = .false.
    do e = 1, scene%mesh%n_elements
      if (elements(e)) has(nodes_of_element(scene%mesh%connectivity, e)) = .true.
    end do
  end function nodes_of

  !> "; it has A, B and 3 more".
  pure function names_of_sets(scene) result(words)
    type(scene_t), intent(in) :: scene
    character(:), allocatable :: words
    integer, parameter :: most = 6
    integer :: i

    words = ''
    do i = 1, min(most, size(scene%element_sets))
      if (i == 1) words = '; it has'
      if (i > 1) words = words//','
      words = words//' '//scene%element_sets(i)%name
    end do
    if (size(scene%element_sets) > most) words = words//' and '// &
      to_text(size(scene%element_sets) - most)//' more'
  end function names_of_sets

end module take_as_rigid_mod
