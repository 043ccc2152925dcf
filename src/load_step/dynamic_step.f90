!> The scheme and the mass of a dynamic *STEP. docs/theory.md, section 13.
module dynamic_step_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t, raise, exit_wrong_input
  use text_mod, only: to_text
  use constraints_mod, only: constraints_t
  use mesh_mod, only: mesh_t, deck_rounding, solids, axisymmetric
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use mass_matrix_mod, only: mass_t, make_mass
  use inertia_mod, only: inertia_t, new_inertia
  use damping_mod, only: new_damping
  use elasticity_mod, only: young_modulus
  use cells_mod, only: cells
  use connectivity_mod, only: nodes_of_element
  use increments_mod, only: duration_of, whole_increment
  use step_loads_mod, only: prescribed_dofs
  implicit none
  private

  public :: make_inertia, are_alike, goes_on, crossing_time

  real(wp), parameter :: rounding = 1.0e-9_wp !! of the size of the mesh: nodes on one plane [-]

contains

  !> The length of the increments of a *STEP, as its deck has them.
  pure real(wp) function length_of_increments(scene, step) result(dt)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step

    dt = duration_of(scene%steps(step), whole_increment)
  end function length_of_increments

  !> Whether a dynamic *STEP goes on as the one before it, but for its loads: with the same scheme,
  !> supports and contact.
  pure logical function goes_on(scene, step, prescribed)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step
    logical, intent(in) :: prescribed(:, :) !! (3,n_nodes) of the *STEP

    goes_on = .false.
    if (step == 1) return
    associate (now => scene%steps(step), before => scene%steps(step - 1))
      if (.not. (now%is_dynamic .and. before%is_dynamic)) return
      if (abs(now%alpha - before%alpha) > 0.0_wp) return
      if (allocated(now%frictions) .or. allocated(now%pair_changes) .or. &
        allocated(now%interferences)) return
    end associate
    goes_on = all(prescribed .eqv. prescribed_dofs(scene, step - 1)) .and. all(are_driven(scene, &
      step) .eqv. are_driven(scene, step - 1))
  end function goes_on

  !> The least time that sound takes across an element with contact nodes, by the shortest of its
  !> edges: of all elements where there are no such nodes.
  pure real(wp) function crossing_time(scene, points) result(time)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    logical :: touches(scene%mesh%n_nodes)
    integer :: e, i, n

    touches = points%n == 0
    touches(points%node) = .true.
    n = merge(3, 2, scene%mesh%plane == solids)
    time = huge(1.0_wp)
    do e = 1, scene%mesh%n_elements
      associate (nodes => nodes_of_element(scene%mesh%connectivity, e), &
          cell => cells(scene%mesh%connectivity%cell(e)), &
          material => scene%materials(scene%mesh%material(e)))
        if (.not. any(touches(nodes))) cycle
        do i = 1, cell%n_edges
          associate (length => norm2(scene%mesh%coordinates(:n, nodes(cell%edge(1, i))) - &
              scene%mesh%coordinates(:n, nodes(cell%edge(2, i)))))
            ! Slices of plane models have edges across them, and collapsed cells such as are points.
            if (length > 0.0_wp) time = min(time, length/sqrt(young_modulus( &
              material%law%elastic)/material%density))
          end associate
        end do
      end associate
    end do
  end function crossing_time

  !> Whether two *STEPs have one scheme, or none has any.
  pure logical function are_alike(scene, one, other)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: one, other

    are_alike = scene%steps(one)%is_dynamic .eqv. scene%steps(other)%is_dynamic
    if (.not. (are_alike .and. scene%steps(one)%is_dynamic)) return
    are_alike = .not. (abs(scene%steps(one)%alpha - scene%steps(other)%alpha) > 0.0_wp .or. &
      abs(length_of_increments(scene, one) - length_of_increments(scene, other)) > 0.0_wp)
  end function are_alike

  !> The scheme of a *STEP, with the mass of its bodies; of a static one the mass means something.
  subroutine make_inertia(scene, points, step, divisions, prescribed, inertia, error)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: step
    integer, intent(in) :: divisions         !! as of choices_t
    logical, intent(in) :: prescribed(:, :)  !! (3,n_nodes)
    type(inertia_t), intent(out) :: inertia
    type(error_t), allocatable, intent(out) :: error
    !! contact nodes without others that could take their mass
    type(mass_t) :: mass
    logical :: touches(scene%mesh%n_nodes)
    integer :: element, piece, c
    character(*), parameter :: bare = '*DYNAMIC: nodes of slave surfaces carry no mass, and '
    character(*), parameter :: cure = ': --refine 1 divides its elements, or take a side out '// &
      'of the pair'

    touches = .false.
    touches(points%node) = .true.
    c = mixed_constraint(scene%mesh, scene%constraints, prescribed, touches)
    if (c > 0) then
      call raise(error, exit_wrong_input, '*DYNAMIC: a constraint joins node '// &
        to_text(scene%mesh%node_id(scene%constraints%node(c)))//' to nodes of a slave surface '// &
        'of contact, or a node of that to others: nodes that may touch have no mass, and must '// &
        'not be joined to such as have')
      return
    end if
    call make_mass(scene%mesh, scene%materials, touches, motions_kept(scene, step, prescribed), &
      .not. scene%finite_strain, mass, element, piece)
    if (element > 0) then
      call raise(error, exit_wrong_input, bare//'the body of element '// &
        to_text(scene%mesh%element_id(element))//' has no others'//cure)
    else if (piece > 0) then
      call raise(error, exit_wrong_input, bare//'the others of the body of node '// &
        to_text(scene%mesh%node_id(findloc(scene%mesh%piece, piece, dim=1)))//' are on a line'// &
        cure)
    else
      inertia = new_inertia(mass, new_damping(scene%mesh, scene%materials), &
        scene%steps(step)%alpha, length_of_increments(scene, step)/divisions)
    end if
    if (allocated(error)) error%is_of_mesh = .true.
  end subroutine make_inertia

  !> A constraint between nodes that may touch and such as may not; 0: none.
  pure integer function mixed_constraint(mesh, constraints, prescribed, touches) result(mixed)
    type(mesh_t), intent(in) :: mesh
    type(constraints_t), intent(in) :: constraints
    logical, intent(in) :: prescribed(:, :)  !! (3,n_nodes)
    logical, intent(in) :: touches(:)        !! (n_nodes)
    integer :: c, k

    do mixed = 1, constraints%n
      c = mixed
      if (prescribed(constraints%dof(c), constraints%node(c))) cycle
      do k = constraints%first(c), constraints%first(c + 1) - 1
        associate (master => constraints%master(k))
          if (prescribed(constraints%master_dof(k), master)) cycle
          if (mesh%piece(master) == 0 .or. mesh%piece(constraints%node(c)) == 0) cycle
          if (touches(master) .neqv. touches(constraints%node(c))) return
        end associate
      end do
    end do
    mixed = 0
  end function mixed_constraint

  !> The rigid motions of each piece whose inertia counts: those that planes of symmetry leave it.
  !> In the others a body and its half would differ.
  pure function motions_kept(scene, step, prescribed) result(keeps)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step
    logical, intent(in) :: prescribed(:, :)     !! (3,n_nodes)
    logical :: keeps(6, scene%mesh%n_pieces)
    logical :: is_plane(3), at_rest(3, scene%mesh%n_nodes)
    real(wp) :: close_by, side
    integer :: piece, axis, k, i

    keeps = .true.
    associate (mesh => scene%mesh)
      if (mesh%plane /= solids) then
        keeps(3:5, :) = .false.
        if (mesh%plane == axisymmetric) keeps([1, 6], :) = .false.
        return
      end if
      at_rest = prescribed .and. .not. are_driven(scene, step)
      close_by = max(rounding*maxval(maxval(mesh%coordinates, dim=2) - minval(mesh%coordinates, &
        dim=2)), 16.0_wp*deck_rounding(mesh%coordinates, mesh%origin))
      do piece = 1, mesh%n_pieces
        is_plane = .false.
        do axis = 1, 3
          associate (x => mesh%coordinates(axis, :), mine => mesh%piece == piece)
            do k = 1, 2
              side = minval(x, mask=mine)
              if (k == 2) side = maxval(x, mask=mine)
              associate (on => mine .and. abs(x - side) <= close_by)
                if (count(on) < 3 .or. .not. all(at_rest(axis, :) .or. .not. on)) cycle
                ! What is clamped has no mirror image.
                if (any([(i /= axis .and. all(prescribed(i, :) .or. .not. on), i=1, 3)])) cycle
                is_plane(axis) = .true.
              end associate
            end do
          end associate
        end do
        do axis = 1, 3
          if (is_plane(axis)) keeps(axis, piece) = .false.
          keeps(3 + axis, piece) = .not. any(is_plane .and. [(i /= axis, i=1, 3)])
        end do
      end do
    end associate
  end function motions_kept

  !> What supports move in the *STEP.
  pure function are_driven(scene, step) result(driven)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step
    logical :: driven(3, scene%mesh%n_nodes)
    integer :: k, i

    driven = .false.
    do k = 1, step
      do i = 1, size(scene%steps(k)%boundary)
        associate (b => scene%steps(k)%boundary(i))
          driven(b%dof, b%node) = abs(b%value) > 0.0_wp
        end associate
      end do
    end do
  end function are_driven

end module dynamic_step_mod
