!> Linear equations between degrees of freedom, as cards give them, and the constraints that they
!> become.
!>
!>     a_1 u_1 + a_2 u_2 + ... = 0     the first depends on the others
!>
!> docs/theory.md section 11.
module equation_list_mod
  use cards_mod, only: keep_reading, reader_t, report
  use constraints_mod, only: constraints_t, add_constraint, constraint_of, constraint_on_cycle
  use growing_lists_mod, only: append
  use kinds_mod, only: wp
  use loads_mod, only: load_step_t
  use mesh_mod, only: mesh_t
  use sets_mod, only: model_t
  use text_mod, only: to_text
  implicit none
  private

  public :: equation_list_t, add_equation, join_equations, refuse_held, refuse_loose, &
    mark_named, dof_in_words, held_though_dependent

  !> Of a degree of freedom that stands before it.
  character(*), parameter :: held_though_dependent = ' depends on others here, and a *BOUNDARY '// &
    'prescribes it: prescribe the others, or name another term first'

  !> All of a deck, one after the other; constraints without order.
  type :: equation_list_t
    type(constraints_t) :: list = constraints_t()
    integer, allocatable :: position(:) !! (n) in the deck; there may be more room
    integer, allocatable :: links(:, :) !! (2,n_links) nodes that keep their distance
    integer, allocatable :: link_position(:) !! (n_links) in the deck
    integer, allocatable :: cyclic(:) !! positions of cards of cyclic symmetry
  end type equation_list_t

contains

  !> One more equation, solved for its first term. What is multiplied by 0 is no master.
  pure subroutine add_equation(equations, position, node, dof, weight)
    type(equation_list_t), intent(inout) :: equations
    integer, intent(in) :: position
    integer, intent(in) :: node(:), dof(:) !! (m) of its terms, the dependent one first
    real(wp), intent(in) :: weight(:)      !! (m-1) of the others [-]
    integer, allocatable :: kept(:)
    integer :: k, n

    kept = pack([(k, k=1, size(weight))], abs(weight) > 0.0_wp)
    n = equations%list%n
    call append(equations%position, n, position)
    call add_constraint(equations%list, node(1), dof(1), node(kept + 1), dof(kept + 1), &
      weight(kept))
  end subroutine add_equation

  !> Put equations behind the constraints of ties; report what depends twice, or on itself.
  subroutine join_equations(reader, model, equations, constraints)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(equation_list_t), intent(in) :: equations
    type(constraints_t), intent(inout) :: constraints !! of ties in, all out
    integer :: number(3, model%mesh%n_nodes), c, n_ties, reported

    reported = 0
    if (equations%list%n == 0) return
    n_ties = constraints%n
    number = constraint_of(constraints, model%mesh%n_nodes)
    do c = 1, equations%list%n
      associate (all => equations%list)
        associate (node => all%node(c), dof => all%dof(c), first => all%first(c), &
                   last => all%first(c + 1) - 1)
          if (number(dof, node) > 0) then
            if (.not. keep_reading(reader)) return
            if (reported == equations%position(c)) cycle ! of a set the first is enough
            reported = equations%position(c)
            call report(reader, reported, dof_in_words(model, node, dof)// &
              ' depends on others already, by '//trim(merge('a tie      ', 'an equation', &
              number(dof, node) <= n_ties))//': it can be the first term of one equation only')
            cycle
          end if
          call add_constraint(constraints, node, dof, all%master(first:last), &
            all%master_dof(first:last), all%weight(first:last))
          number(dof, node) = constraints%n
          constraints%n_equations = constraints%n_equations + 1
        end associate
      end associate
    end do
    c = constraint_on_cycle(constraints, model%mesh%n_nodes)
    if (c == 0) return
    ! Ties alone have none: an equation is on it.
    do while (c <= n_ties)
      c = next_on_cycle(constraints, number, c)
    end do
    associate (node => constraints%node(c), dof => constraints%dof(c))
      call report(reader, position_of(equations, node, dof), dof_in_words(model, node, dof)// &
        ' depends on itself, through other equations or ties: name another term first')
    end associate
  end subroutine join_equations

  !> The constraint of a master that is on the same cycle.
  pure integer function next_on_cycle(constraints, number, c) result(next)
    type(constraints_t), intent(in) :: constraints
    integer, intent(in) :: number(:, :) !! (3,n_nodes) of `constraint_of`
    integer, intent(in) :: c            !! on a cycle
    logical :: reaches(constraints%n)
    integer :: k, other, before

    ! Which constraints lead to this one.
    reaches = .false.
    reaches(c) = .true.
    before = 0
    do while (count(reaches) /= before)
      before = count(reaches)
      do next = 1, constraints%n
        do k = constraints%first(next), constraints%first(next + 1) - 1
          other = number(constraints%master_dof(k), constraints%master(k))
          if (other == 0) cycle
          if (reaches(other)) reaches(next) = .true.
        end do
      end do
    end do
    next = c
    do k = constraints%first(c), constraints%first(c + 1) - 1
      other = number(constraints%master_dof(k), constraints%master(k))
      if (other == 0) cycle
      if (reaches(other)) next = other
    end do
  end function next_on_cycle

  !> Mark the degrees of freedom that equations name.
  pure subroutine mark_named(model, equations)
    type(model_t), intent(inout) :: model
    type(equation_list_t), intent(in) :: equations
    integer :: c, k

    allocate (model%named(3, model%mesh%n_nodes), source=.false.)
    if (allocated(equations%links)) model%named(:, [equations%links]) = .true.
    associate (all => equations%list)
      do c = 1, all%n
        model%named(all%dof(c), all%node(c)) = .true.
        do k = all%first(c), all%first(c + 1) - 1
          model%named(all%master_dof(k), all%master(k)) = .true.
        end do
      end do
    end associate
  end subroutine mark_named

  !> Report supports of what depends on others.
  subroutine refuse_held(reader, model, equations, distributing, steps)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(equation_list_t), intent(in) :: equations
    integer, intent(in) :: distributing(:)
    !! reference nodes of *DISTRIBUTING, and those that stand for their rotations
    type(load_step_t), intent(in) :: steps(:)
    integer :: number(3, model%mesh%n_nodes), step, i, c
    logical :: reported(equations%list%n), agrees(equations%list%n)

    if (equations%list%n == 0) return
    number = constraint_of(equations%list, model%mesh%n_nodes)
    reported = .false.
    agrees = supports_agree(equations, steps, model%mesh%n_nodes)
    do step = 1, size(steps)
      if (.not. allocated(steps(step)%boundary)) cycle
      do i = 1, size(steps(step)%boundary)
        associate (b => steps(step)%boundary(i))
          c = number(b%dof, b%node)
          if (c == 0) cycle
          if (reported(c) .or. agrees(c)) cycle
          if (.not. keep_reading(reader)) return
          call report(reader, equations%position(c), dof_in_words(model, b%node, b%dof)// &
            carried_in_words(c, b%node))
          ! Of a set the first is enough.
          reported = reported .or. equations%position(:equations%list%n) == equations%position(c)
        end associate
      end do
    end do

  contains

    !> What a prescribed degree of freedom depends on, and what to do.
    function carried_in_words(c, node) result(words)
      integer, intent(in) :: c, node
      character(:), allocatable :: words, reference

      if (any(distributing == node)) then
        words = ' is the mean over a surface by *DISTRIBUTING, and a *BOUNDARY prescribes it: '// &
          'prescribe it with *KINEMATIC in its place, which keeps the surface rigid, or give '// &
          'the node a force or a moment (*CLOAD)'
        return
      end if
      associate (all => equations%list)
        if (all%first(c + 1) > all%first(c)) then
          if (model%rotation_node(all%master(all%first(c))) > 0) then
            reference = to_text(model%mesh%node_id(all%master(all%first(c))))
            words = ' goes with node '//reference//' here, and a *BOUNDARY prescribes it: '// &
              'prescribe dofs of node '//reference//' in its place'
            return
          end if
        end if
      end associate
      words = held_though_dependent
    end function carried_in_words

  end subroutine refuse_held

  !> Which equations of cyclic symmetry supports say again: in each *STEP they prescribe all that
  !> one names, so that it is satisfied, or none of it.
  pure function supports_agree(equations, steps, n_nodes) result(agree)
    type(equation_list_t), intent(in) :: equations
    type(load_step_t), intent(in) :: steps(:)
    integer, intent(in) :: n_nodes
    logical :: agree(equations%list%n), is_held(equations%list%n)
    real(wp), parameter :: rounding = 1.0e-9_wp !! of the largest part of an equation [-]
    integer, allocatable :: entry(:, :)         !! (3,n_nodes) the last of a step; 0: none
    real(wp) :: left, largest
    integer :: step, i, c, k, n_given

    agree = .false.
    if (.not. allocated(equations%cyclic)) return
    agree = [(any(equations%cyclic == equations%position(c)), c=1, size(agree))]
    allocate (entry(3, n_nodes))
    is_held = .false.
    do step = 1, size(steps)
      if (.not. allocated(steps(step)%boundary)) cycle
      entry = 0
      do i = 1, size(steps(step)%boundary)
        entry(steps(step)%boundary(i)%dof, steps(step)%boundary(i)%node) = i
      end do
      associate (all => equations%list, b => steps(step)%boundary)
        do c = 1, size(agree)
          if (.not. agree(c)) cycle
          i = entry(all%dof(c), all%node(c))
          n_given = 0
          left = 0.0_wp
          if (i > 0) left = b(i)%value
          largest = abs(left)
          do k = all%first(c), all%first(c + 1) - 1
            associate (other => entry(all%master_dof(k), all%master(k)))
              if (other == 0) cycle
              n_given = n_given + 1
              left = left - all%weight(k)*b(other)%value
              largest = max(largest, abs(all%weight(k)*b(other)%value))
              if (i == 0) cycle
              agree(c) = agree(c) .and. b(i)%amplitude == b(other)%amplitude .and. (b(i)%fixed &
                .eqv. b(other)%fixed)
            end associate
          end do
          if (steps(step)%replace_boundary) is_held(c) = .false.
          if (i == 0) then
            agree(c) = n_given == 0 .or. .not. is_held(c)
            cycle
          end if
          is_held(c) = .true.
          agree(c) = agree(c) .and. n_given == all%first(c + 1) - all%first(c) .and. &
            abs(left) <= rounding*largest
        end do
      end associate
    end do
  end function supports_agree

  !> Report equations all of whose nodes belong to no element: there is nothing that resists.
  subroutine refuse_loose(reader, equations, mesh)
    type(reader_t), intent(inout) :: reader
    type(equation_list_t), intent(in) :: equations
    type(mesh_t), intent(in) :: mesh
    integer :: c

    do c = 1, equations%list%n
      if (mesh%body(equations%list%node(c)) > 0) cycle
      if (.not. keep_reading(reader)) return
      call report(reader, equations%position(c), 'node '//to_text(mesh%node_id( &
        equations%list%node(c)))//' belongs to no element, and equations join it to none')
    end do
  end subroutine refuse_loose

  !> Where the equation of a degree of freedom stands.
  pure integer function position_of(equations, node, dof) result(position)
    type(equation_list_t), intent(in) :: equations
    integer, intent(in) :: node, dof
    integer :: c

    position = 0
    do c = 1, equations%list%n
      if (equations%list%node(c) == node .and. equations%list%dof(c) == dof) then
        position = equations%position(c)
        return
      end if
    end do
  end function position_of

  !> A degree of freedom as the deck calls it.
  function dof_in_words(model, node, dof) result(words)
    type(model_t), intent(in) :: model
    integer, intent(in) :: node, dof !! 1, 2, 3; of a rotation node: about x, y, z
    character(:), allocatable :: words
    integer :: of_rotation

    of_rotation = findloc(model%rotation_node, node, dim=1)
    if (of_rotation > 0) then
      words = 'dof '//to_text(3 + dof)//' of node '//to_text(model%mesh%node_id(of_rotation))
    else
      words = 'dof '//to_text(dof)//' of node '//to_text(model%mesh%node_id(node))
    end if
  end function dof_in_words

end module equation_list_mod
