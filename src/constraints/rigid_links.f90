!> Rigid links: two nodes keep their distance, to first order,
!>
!>     n . (u_1 - u_2) = 0,      n = (x_1 - x_2)/|x_1 - x_2|
!>
!> docs/theory.md section 11.
module rigid_links_mod
  use cards_mod, only: keep_reading, reader_t, report
  use constraints_mod, only: constraint_of, constraints_t
  use equation_list_mod, only: add_equation, equation_list_t
  use kinds_mod, only: wp
  use loads_mod, only: load_step_t
  use mesh_draft_mod, only: solids
  use sets_mod, only: model_t
  use text_mod, only: to_text
  implicit none
  private

  public :: add_links

  real(wp), parameter :: nothing = 1.0e-12_wp !! of a unit vector: rounding [-]

  !> A sum of displacements that is 0.
  type :: sum_t
    integer, allocatable :: node(:), dof(:)
    real(wp), allocatable :: weight(:) !! [-]
  end type sum_t

contains

  !> Append the equations of the links. Each is solved for a displacement that no other equation,
  !> tie or support gives: links may meet in a node, and make a truss.
  subroutine add_links(reader, model, ties, steps, equations)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(constraints_t), intent(in) :: ties
    type(load_step_t), intent(in) :: steps(:)
    type(equation_list_t), intent(inout) :: equations
    type(sum_t) :: sum_of_link
    integer :: tied(3, model%mesh%n_nodes), given(3, model%mesh%n_nodes), i, pivot
    logical :: held(3, model%mesh%n_nodes)

    if (.not. allocated(equations%links)) return
    tied = constraint_of(ties, model%mesh%n_nodes)
    held = ever_prescribed(steps, model%mesh%n_nodes)
    do i = 1, size(equations%links, 2)
      associate (a => equations%links(1, i), b => equations%links(2, i))
        call say_link(model, a, b, sum_of_link)
        if (size(sum_of_link%weight) == 0) then
          if (.not. keep_reading(reader)) return
          call report(reader, equations%link_position(i), 'nodes '// &
            to_text(model%mesh%node_id(a))//' and '//to_text(model%mesh%node_id(b))// &
            ' of a LINK are in one place: there is no distance to keep', 'PIN, the same nodes')
          cycle
        end if
        given = constraint_of(equations%list, model%mesh%n_nodes)
        call put_in(equations%list, given, sum_of_link)
        if (size(sum_of_link%weight) == 0) cycle ! others say the same
        pivot = best_pivot(sum_of_link, tied > 0 .or. held)
        if (pivot == 0) then
          if (.not. keep_reading(reader)) return
          call report(reader, equations%link_position(i), 'supports, ties or other equations '// &
            'give all displacements of nodes '//to_text(model%mesh%node_id(a))//' and '// &
            to_text(model%mesh%node_id(b))//' along their LINK')
          cycle
        end if
        call solve_for(sum_of_link, pivot, equations%link_position(i), equations)
      end associate
    end do
  end subroutine add_links

  !> Which degrees of freedom any step prescribes.
  pure function ever_prescribed(steps, n_nodes) result(held)
    type(load_step_t), intent(in) :: steps(:)
    integer, intent(in) :: n_nodes
    logical :: held(3, n_nodes)
    integer :: step, i

    held = .false.
    do step = 1, size(steps)
      if (.not. allocated(steps(step)%boundary)) cycle
      do i = 1, size(steps(step)%boundary)
        associate (b => steps(step)%boundary(i))
          held(b%dof, b%node) = .true.
        end associate
      end do
    end do
  end function ever_prescribed

  !> What a link says; nothing of nodes in one place.
  pure subroutine say_link(model, a, b, link)
    type(model_t), intent(in) :: model
    integer, intent(in) :: a, b !! nodes
    type(sum_t), intent(out) :: link
    real(wp) :: direction(3)
    integer, allocatable :: along(:)
    integer :: k

    direction = model%mesh%coordinates(:, a) - model%mesh%coordinates(:, b)
    if (model%mesh%plane /= solids) direction(3) = 0.0_wp
    if (norm2(direction) > 0.0_wp) direction = direction/norm2(direction)
    along = pack([(k, k=1, 3)], abs(direction) > nothing)
    link%node = [spread(a, 1, size(along)), spread(b, 1, size(along))]
    link%dof = [along, along]
    link%weight = [direction(along), -direction(along)]
  end subroutine say_link

  !> Put in what equations say of its terms, until none of these depends on others.
  pure subroutine put_in(list, given, link)
    type(constraints_t), intent(in) :: list
    integer, intent(in) :: given(:, :) !! (3,n_nodes) which of the list gives a displacement; 0
    type(sum_t), intent(inout) :: link
    integer :: k, c, m
    real(wp) :: weight

    k = 1
    do while (k <= size(link%weight))
      c = given(link%dof(k), link%node(k))
      if (c == 0) then
        k = k + 1
        cycle
      end if
      weight = link%weight(k)
      link%weight(k) = 0.0_wp
      do m = list%first(c), list%first(c + 1) - 1
        call add_term(list%master(m), list%master_dof(m), weight*list%weight(m), link)
      end do
      call leave_out_nothing(link)
      k = 1
    end do
  end subroutine put_in

  pure subroutine add_term(node, dof, weight, link)
    integer, intent(in) :: node, dof
    real(wp), intent(in) :: weight !! [-]
    type(sum_t), intent(inout) :: link
    integer :: k

    k = findloc(link%node == node .and. link%dof == dof, .true., dim=1)
    if (k > 0) then
      link%weight(k) = link%weight(k) + weight
    else
      link%node = [link%node, node]
      link%dof = [link%dof, dof]
      link%weight = [link%weight, weight]
    end if
  end subroutine add_term

  !> Terms of rounding are none.
  pure subroutine leave_out_nothing(link)
    type(sum_t), intent(inout) :: link
    logical :: stays(size(link%weight))

    stays = abs(link%weight) > nothing
    link%node = pack(link%node, stays)
    link%dof = pack(link%dof, stays)
    link%weight = pack(link%weight, stays)
  end subroutine leave_out_nothing

  !> The largest term that nothing else gives; 0: there is none.
  pure integer function best_pivot(link, is_given)
    type(sum_t), intent(in) :: link
    logical, intent(in) :: is_given(:, :) !! (3,n_nodes)
    integer :: k

    best_pivot = maxloc(abs(link%weight), dim=1, mask=[(.not. is_given(link%dof(k), &
      link%node(k)), k=1, size(link%weight))])
  end function best_pivot

  !> The equation that says so.
  pure subroutine solve_for(link, pivot, position, equations)
    type(sum_t), intent(in) :: link
    integer, intent(in) :: pivot, position
    type(equation_list_t), intent(inout) :: equations
    integer :: order(size(link%weight)), k

    order = [pivot, pack([(k, k=1, size(order))], [(k /= pivot, k=1, size(order))])]
    call add_equation(equations, position, link%node(order), link%dof(order), &
      -link%weight(order(2:))/link%weight(pivot))
  end subroutine solve_for

end module rigid_links_mod
