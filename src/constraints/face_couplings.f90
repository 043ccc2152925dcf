!> Couplings of faces, and of rigid bodies of solid elements, to a reference node, as equations.
!>
!> The rotation of a reference node is that of a node of its own, at the same place: its
!> displacement is rotation vector times a length, the farthest that a coupled node is away, so that
!> all unknowns are lengths and all forces forces. docs/theory.md section 11.
module face_couplings_mod
  use cards_mod, only: reader_t, report
  use cells_mod, only: face_nodes
  use dense_mod, only: invert_general
  use diagnostics_mod, only: quoted
  use equation_list_mod, only: add_equation, equation_list_t
  use faces_mod, only: face_node_areas, face_node_moments
  use kinds_mod, only: wp
  use mesh_draft_mod, only: add_node_beside, solids
  use scene_mod, only: coupled_rotation_t
  use sets_mod, only: extend_marks, model_t
  use surfaces_mod, only: all_nodes_of, surface_t
  use text_mod, only: to_text
  implicit none
  private

  public :: coupling_t, add_rotation_node, keep_in_plane, mark_coupled, couple, rotations_of

  real(wp), parameter :: nothing = 1.0e-14_wp !! of the length: an arm of rounding [-]

  !> A *COUPLING with what stands below it, or a *RIGID BODY of solid elements: kinematic.
  type :: coupling_t
    character(:), allocatable :: name, surface_name !! not allocated: a *RIGID BODY
    integer :: node = 0                    !! reference node
    integer :: rotation_node = 0
    integer :: surface = 0
    integer, allocatable :: nodes(:)       !! that go with the reference node; none after a mistake
    logical :: distributes = .false.       !! else kinematic
    logical :: dofs(6) = .true.            !! that are coupled
    integer :: position = 0, node_position = 0, surface_position = 0 !! in the deck
  end type coupling_t

contains

  !> Add the node that stands for the rotation of a reference node; several couplings of one share
  !> it.
  subroutine add_rotation_node(reader, model, coupling)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(inout) :: model
    type(coupling_t), intent(inout) :: coupling
    integer :: i
    logical :: ok

    if (.not. allocated(model%rotation_of)) allocate (model%rotation_of(2, 0))
    coupling%rotation_node = 0
    do i = 1, size(model%rotation_of, 2)
      if (model%rotation_of(1, i) == coupling%node) coupling%rotation_node = model%rotation_of(2, i)
    end do
    if (coupling%rotation_node > 0) return
    call add_node_beside(model%mesh, coupling%node, coupling%position, ok)
    if (.not. ok) then
      call report(reader, coupling%position, 'there is no room for another node')
      return
    end if
    coupling%rotation_node = model%mesh%n_nodes
    model%n_added = model%n_added + 1
    model%rotation_of = reshape([model%rotation_of, coupling%node, coupling%rotation_node], &
      [2, size(model%rotation_of, 2) + 1])
    if (.not. allocated(model%rotation_node)) return
    call extend_marks(model, 1, .false.)
    call mark_rotation(model, coupling%node, coupling%rotation_node)
  end subroutine add_rotation_node

  !> With elements of a plane, couple what moves in the plane, and have reference nodes without
  !> elements halfway through the thickness: a force there has no moment about the plane's axes.
  subroutine keep_in_plane(model, couplings)
    type(model_t), intent(inout) :: model
    type(coupling_t), intent(inout) :: couplings(:)
    integer :: k

    if (model%mesh%plane == solids) return
    do k = 1, size(couplings)
      couplings(k)%dofs(3:5) = .false.
      associate (node => couplings(k)%node, rotation => couplings(k)%rotation_node, &
                 z => model%mesh%coordinates(3, :model%mesh%n_nodes))
        if (model%used(node)) cycle
        z([node, rotation]) = 0.5_wp*(minval(z, mask=model%used) + maxval(z, mask=model%used))
      end associate
    end do
  end subroutine keep_in_plane

  !> Mark the nodes that couplings join to their faces.
  subroutine mark_coupled(model)
    type(model_t), intent(inout) :: model
    integer :: i

    allocate (model%rotation_node(model%mesh%n_nodes), source=0)
    allocate (model%rotation_arm(model%mesh%n_nodes), source=1.0_wp)
    allocate (model%joined(model%mesh%n_nodes), source=.false.)
    if (.not. allocated(model%rotation_of)) return
    do i = 1, size(model%rotation_of, 2)
      call mark_rotation(model, model%rotation_of(1, i), model%rotation_of(2, i))
    end do
  end subroutine mark_coupled

  subroutine mark_rotation(model, node, rotation)
    type(model_t), intent(inout) :: model
    integer, intent(in) :: node     !! reference node
    integer, intent(in) :: rotation !! that stands for its rotation

    model%rotation_node(node) = rotation
    model%joined([node, rotation]) = .not. model%used([node, rotation])
  end subroutine mark_rotation

  !> The equations of all couplings, where all nodes are at last, behind those of the deck, whose
  !> rotations get their lengths.
  subroutine couple(reader, model, surfaces, couplings, equations)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(inout) :: model
    type(surface_t), intent(in) :: surfaces(:)
    type(coupling_t), intent(in) :: couplings(:)
    type(equation_list_t), intent(inout) :: equations
    integer :: k

    if (size(couplings) == 0) return
    call measure_arms(model, couplings)
    call scale_rotations(model, equations)
    do k = 1, size(couplings)
      associate (of => couplings(k))
        if (of%distributes .and. any(of%nodes == of%node)) then
          call report(reader, of%node_position, 'node '//to_text(model%mesh%node_id(of%node))// &
            ' is one of the nodes that it is the mean of: *DISTRIBUTING needs another')
        else if (of%distributes) then
          call distribute(reader, model, surfaces(of%surface), of, equations)
        else
          call carry(model, of, equations)
        end if
      end associate
    end do
  end subroutine couple

  !> The reference nodes of couplings with the nodes of their rotations, and what they are the means
  !> of.
  function rotations_of(model, surfaces, couplings) result(rotations)
    type(model_t), intent(in) :: model
    type(surface_t), intent(in) :: surfaces(:)
    type(coupling_t), intent(in) :: couplings(:)
    type(coupled_rotation_t) :: rotations(size(model%rotation_of, 2))
    real(wp) :: middle(3)
    integer :: i, k

    rotations%node = model%rotation_of(1, :)
    rotations%rotation_node = model%rotation_of(2, :)
    rotations%length = model%rotation_arm(model%rotation_of(1, :))
    do i = 1, size(rotations)
      do k = 1, size(couplings)
        if (.not. couplings(k)%distributes .or. couplings(k)%node /= rotations(i)%node) cycle
        associate (of => rotations(i), surface => surfaces(couplings(k)%surface))
          of%surface_nodes = surface%nodes
          of%is_mean = couplings(k)%dofs
          call find_shares(model, surface, of%share, of%moment, middle)
        end associate
      end do
    end do
  end function rotations_of

  !> How far coupled nodes are from their reference nodes, at most.
  subroutine measure_arms(model, couplings)
    type(model_t), intent(inout) :: model
    type(coupling_t), intent(in) :: couplings(:)
    integer :: k, i

    do k = 1, size(couplings)
      model%rotation_arm(couplings(k)%node) = 0.0_wp
    end do
    do k = 1, size(couplings)
      associate (node => couplings(k)%node, nodes => couplings(k)%nodes, &
                 x => model%mesh%coordinates)
        do i = 1, size(nodes)
          model%rotation_arm(node) = max(model%rotation_arm(node), norm2(x(:, nodes(i)) - &
            x(:, node)))
        end do
      end associate
    end do
    where (.not. model%rotation_arm > 0.0_wp) model%rotation_arm = 1.0_wp
  end subroutine measure_arms

  !> Equations of the deck speak of rotations, their nodes of rotations times lengths.
  subroutine scale_rotations(model, equations)
    type(model_t), intent(in) :: model
    type(equation_list_t), intent(inout) :: equations
    real(wp) :: length(model%mesh%n_nodes)
    integer :: i, c

    length = 1.0_wp
    do i = 1, size(model%rotation_of, 2)
      length(model%rotation_of(2, i)) = model%rotation_arm(model%rotation_of(1, i))
    end do
    associate (all => equations%list)
      do c = 1, all%n
        associate (first => all%first(c), last => all%first(c + 1) - 1)
          all%weight(first:last) = all%weight(first:last)*length(all%node(c))/ &
            length(all%master(first:last))
        end associate
      end do
    end associate
  end subroutine scale_rotations

  !> Kinematic: nodes move as the reference node and its rotation carry them,
  !> u = u_ref + rotation x arm.
  subroutine carry(model, coupling, equations)
    type(model_t), intent(in) :: model
    type(coupling_t), intent(in) :: coupling
    type(equation_list_t), intent(inout) :: equations
    real(wp) :: turn(3, 3)
    logical :: hangs(model%mesh%n_nodes) !! these go with others
    integer :: i, a

    hangs = .false.
    if (allocated(model%mesh%hangs)) hangs(:size(model%mesh%hangs)) = model%mesh%hangs
    do i = 1, size(coupling%nodes)
      associate (node => coupling%nodes(i), ref => coupling%node)
        if (node == ref .or. hangs(node)) cycle
        turn = -cross_matrix((model%mesh%coordinates(:, node) - model%mesh%coordinates(:, ref))/ &
          model%rotation_arm(ref))
        where (abs(turn) <= nothing) turn = 0.0_wp
        do a = 1, 3
          if (coupling%dofs(a)) call add_equation(equations, coupling%position, [node, ref, &
            spread(coupling%rotation_node, 1, 3)], [a, a, 1, 2, 3], [1.0_wp, turn(a, :)])
        end do
      end associate
    end do
  end subroutine carry

  !> Distributing: the reference node moves as the surface does in the mean, and turns as it does in
  !> the mean of least squares: a force on it is a uniform traction, a moment a linear one.
  !> docs/theory.md (11.13).
  subroutine distribute(reader, model, surface, coupling, equations)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(surface_t), intent(in) :: surface
    type(coupling_t), intent(in) :: coupling
    type(equation_list_t), intent(inout) :: equations
    real(wp), allocatable :: weight(:), moment(:, :), moved(:, :, :), turned(:, :, :)
    real(wp) :: middle(3), inertia(3, 3), arm(3)
    integer :: i, a, m
    logical :: ok

    m = size(surface%nodes)
    allocate (moved(3, 3, m), turned(3, 3, m))
    call find_shares(model, surface, weight, moment, middle)
    associate (x => model%mesh%coordinates(:, surface%nodes), ref => coupling%node)
      inertia = 0.0_wp
      do i = 1, m
        inertia = inertia - matmul(cross_matrix(moment(:, i)), cross_matrix(x(:, i) - middle))
      end do
      call invert_general(inertia, ok)
      if (.not. ok) then
        call report(reader, coupling%surface_position, 'the nodes of '// &
          quoted(coupling%surface_name)//' lie on a line: how they turn about it is not known')
        return
      end if
      arm = model%mesh%coordinates(:, ref) - middle
      do i = 1, m
        turned(:, :, i) = matmul(inertia, cross_matrix(moment(:, i)))
        moved(:, :, i) = -matmul(cross_matrix(arm), turned(:, :, i))
        do a = 1, 3
          moved(a, a, i) = moved(a, a, i) + weight(i)
        end do
      end do
      turned = turned*model%rotation_arm(ref)
    end associate
    do a = 1, 3
      if (coupling%dofs(a)) call add_equation(equations, coupling%position, [coupling%node, &
        all_nodes()], [a, all_dofs()], reshape(moved(a, :, :), [3*m]))
    end do
    do a = 1, 3
      if (coupling%dofs(3 + a)) call add_equation(equations, coupling%position, &
        [coupling%rotation_node, all_nodes()], [a, all_dofs()], reshape(turned(a, :, :), [3*m]))
    end do

  contains

    function all_nodes() result(nodes)
      integer :: nodes(3*m)

      nodes = reshape(spread(surface%nodes, 1, 3), [3*m])
    end function all_nodes

    function all_dofs() result(dofs)
      integer :: dofs(3*m)
      integer :: l

      dofs = [(modulo(l, 3) + 1, l=0, 3*m - 1)]
    end function all_dofs

  end subroutine distribute

  !> The part of a surface that belongs to each of its nodes, the moment of this part about the
  !> middle of the surface, and where that is.
  subroutine find_shares(model, surface, share, moment, middle)
    type(model_t), intent(in) :: model
    type(surface_t), intent(in) :: surface
    real(wp), allocatable, intent(out) :: share(:)     !! (n) int N_a dA of the area [-]
    real(wp), allocatable, intent(out) :: moment(:, :) !! (3,n) int N_a (x - x_m) dA of it [length]
    real(wp), intent(out) :: middle(3)                 !! x_m [length]
    real(wp) :: from_first(3)
    real(wp) :: area(model%mesh%n_nodes), of_nodes(3, model%mesh%n_nodes)
    integer :: faces(face_nodes, size(surface%faces, 2)), f, i

    faces = all_nodes_of(surface%faces, model%mesh%connectivity)
    area = 0.0_wp
    of_nodes = 0.0_wp
    do f = 1, size(faces, 2)
      associate (nodes => faces(:count(faces(:, f) > 0), f), x => model%mesh%coordinates)
        area(nodes) = area(nodes) + face_node_areas(x(:, nodes))
        of_nodes(:, nodes) = of_nodes(:, nodes) + face_node_moments(x(:, nodes) - &
          spread(x(:, surface%nodes(1)), 2, size(nodes)))
      end associate
    end do
    share = area(surface%nodes)/sum(area(surface%nodes))
    moment = of_nodes(:, surface%nodes)/sum(area(surface%nodes))
    from_first = sum(moment, dim=2)
    do i = 1, size(share)
      moment(:, i) = moment(:, i) - share(i)*from_first
    end do
    middle = model%mesh%coordinates(:, surface%nodes(1)) + from_first
  end subroutine find_shares

  !> What takes a vector to `v` x the vector.
  pure function cross_matrix(v) result(matrix)
    real(wp), intent(in) :: v(3)
    real(wp) :: matrix(3, 3)

    matrix = reshape([0.0_wp, v(3), -v(2), -v(3), 0.0_wp, v(1), v(2), -v(1), 0.0_wp], [3, 3])
  end function cross_matrix

end module face_couplings_mod
