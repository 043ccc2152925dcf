!> K^-1 by the factor of the stiffness and the compliance of the interface it is condensed to.
!>
!> A solution goes down to the interface, through its compliance, and back to all unknowns; the two
!> halves can be had apart, for what the interface gets may be needed before its answer is known.
!>
!> Or nothing is condensed: where the compliance of the interface would be too large the factor is
!> that of all unknowns, every product with the compliance is a solution with it, and a solution has
!> no halves. An inexact factor is refined then, until its solutions are those of the stiffness. So
!> are solutions by iteration, which stand in for those with a factor where there is none.
module stiffness_inverse_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t, raise, exit_machine, exit_not_solved
  use block_diagonal_mod, only: block_diagonal_t, subtract_products, times_blocks
  use dense_mod, only: invert_general
  use controls_mod, only: is_exact
  use mesh_mod, only: mesh_t
  use scene_mod, only: material_t
  use mesh_forces_mod, only: internal_force
  use dof_map_mod, only: dof_map_t, to_equations, to_nodes, unknowns_of
  use sparse_factor_mod, only: sparse_factor_t
  use iterative_body_mod, only: iterative_body_t
  implicit none
  private

  public :: stiffness_inverse_t, apply_inverse, begin_inverse, finish_inverse, abandon_inverse
  public :: answer_of_interface, at_interface, moved_by, recover_columns, at_nodes
  public :: solve_equations, add_rank

  ! Of solutions by iteration, beside the load [-].
  real(wp), parameter :: closely = 1.0e-8_wp !! of those that are refined, or correct others
  real(wp), parameter :: loosely = 1.0e-4_wp !! of those that some digits are enough for

  !> A part S D S^T of the stiffness that its factor is without, body by body: with Z what that
  !> answers to S, K^-1 = K_0^-1 - Z C Z^T, C = (I + D S^T Z)^-1 D.
  type :: added_rank_t
    integer,  allocatable :: body(:)       !! (n_free) of each equation
    real(wp), allocatable :: answer(:, :)  !! (n_free,m) Z [length/force]
    real(wp), allocatable :: core(:, :, :) !! (m,m,n_bodies) C [force/length]
  end type added_rank_t

  !> The stiffness of the free degrees of freedom, factorised and condensed.
  type :: stiffness_inverse_t
    type(dof_map_t) :: map
    type(sparse_factor_t) :: factor
    class(iterative_body_t), allocatable :: iterative !! in the place of a factor
    type(block_diagonal_t) :: compliance       !! of the interface, a block a body [length/force]
    real(wp) :: condition = 1.0_wp             !! of the stiffness, at least [-]
    logical :: is_condensed = .true.           !! there is such a compliance
    type(error_t), allocatable :: failure
    !! what made a product with the compliance fail, where that is a solution; it holds for good
    type(mesh_t), allocatable :: mesh          !! of the stiffness, where solutions are refined
    type(material_t), allocatable :: materials(:)
    type(added_rank_t), allocatable :: added   !! not allocated: the factor is without nothing
    real(wp), allocatable, private :: along(:, :) !! (m,n_bodies) Z^T f of a solution that is begun
    logical, private :: is_begun = .false.
    !! the factor holds the first half of a solution, whose second half must come next
  end type stiffness_inverse_t

contains

  !> K^-1 f for nodal forces f, several at once; prescribed degrees of freedom stay 0.
  subroutine apply_inverse(inverse, force, displacement, error)
    type(stiffness_inverse_t), intent(inout) :: inverse
    real(wp), intent(in) :: force(:, :, :)                    !! (3,n_nodes,m) [force]
    real(wp), allocatable, intent(out) :: displacement(:, :, :) !! (3,n_nodes,m) [length]
    type(error_t), allocatable, intent(out) :: error          !! MUMPS failed
    real(wp), allocatable :: b(:, :), reduced(:, :)
    real(wp) :: along(columns_added(inverse), bodies_added(inverse), size(force, 3))
    integer :: g

    call refuse_begun(inverse, error)
    if (allocated(error)) return
    associate (map => inverse%map)
      allocate (b(map%n_free, size(force, 3)), reduced(map%n_interface, size(force, 3)))
      do g = 1, size(force, 3)
        call to_equations(map, force(:, :, g), b(:, g))
      end do
      if (map%n_interface == 0 .or. .not. inverse%is_condensed) then
        call solve_once(inverse, b, closely, error)
      else
        if (allocated(inverse%added)) then
          do g = 1, size(b, 2)
            along(:, :, g) = times_answers(inverse, b(:, g), 0)
          end do
        end if
        call inverse%factor%condense(b, reduced, error)
        if (allocated(error)) return
        do g = 1, size(reduced, 2)
          reduced(:, g) = of_factor(inverse, reduced(:, g))
        end do
        call inverse%factor%expand(reduced, b, error)
        if (allocated(inverse%added) .and. .not. allocated(error)) then
          do g = 1, size(b, 2)
            call take_away(inverse, along(:, :, g), 0, b(:, g))
          end do
        end if
      end if
      if (allocated(error)) return
      allocate (displacement(3, size(force, 2), size(force, 3)))
      do g = 1, size(force, 3)
        call to_nodes(map, b(:, g), displacement(:, :, g))
      end do
    end associate
  end subroutine apply_inverse

  !> First half of K^-1 f: what f does to the interface; where nothing is condensed all of it.
  !>
  !> The rest is kept in the factor until `finish_inverse`, the next use of the factor unless
  !> `abandon_inverse` comes first.
  subroutine begin_inverse(inverse, force, begun, shift, error)
    type(stiffness_inverse_t), intent(inout) :: inverse
    real(wp), intent(in) :: force(:, :)              !! (3,n_nodes) [force]
    real(wp), allocatable, intent(out) :: begun(:)   !! (n_interface) of the interface [length]
    real(wp), intent(out) :: shift(:, :)             !! (3,n_nodes) the same at its nodes [length]
    type(error_t), allocatable, intent(out) :: error
    !! MUMPS failed; another solution is begun and not finished
    real(wp) :: b(inverse%map%n_free, 1), reduced(inverse%map%n_interface, 1)

    call refuse_begun(inverse, error)
    if (allocated(error)) return
    allocate (begun(merge(inverse%map%n_interface, 0, inverse%is_condensed)))
    call to_equations(inverse%map, force, b(:, 1))
    if (inverse%map%n_interface == 0 .or. .not. inverse%is_condensed) then
      call solve_once(inverse, b, closely, error)
    else
      if (allocated(inverse%added)) inverse%along = times_answers(inverse, b(:, 1), 0)
      call inverse%factor%condense(b, reduced, error)
      if (allocated(error)) return
      inverse%is_begun = .true.
      begun(:) = of_factor(inverse, reduced(:, 1))
      if (allocated(inverse%added)) call take_away(inverse, inverse%along, inverse%map%n_free - &
        inverse%map%n_interface, begun)
      b = 0.0_wp
      b(inverse%map%n_free - inverse%map%n_interface + 1:, 1) = begun
    end if
    if (allocated(error)) return
    call to_nodes(inverse%map, b(:, 1), shift)
  end subroutine begin_inverse

  !> Second half, with forces that act on the interface alone: what they do to it, and what both do
  !> to the interior.
  subroutine finish_inverse(inverse, force, begun, displacement, error)
    type(stiffness_inverse_t), intent(inout) :: inverse
    real(wp), intent(in) :: force(:, :)              !! (3,n_nodes) on the interface [force]
    real(wp), allocatable, intent(inout) :: begun(:)
    !! of begin_inverse, spent by this; not allocated where nothing was begun
    real(wp), intent(out) :: displacement(:, :)      !! (3,n_nodes) [length]
    type(error_t), allocatable, intent(out) :: error !! MUMPS failed
    real(wp) :: b(inverse%map%n_free, 1)
    real(wp), dimension(inverse%map%n_interface, 1) :: answer, reduced
    real(wp) :: along(columns_added(inverse), bodies_added(inverse))
    logical :: is_begun

    displacement = 0.0_wp
    if (inverse%map%n_interface == 0) then
      if (allocated(begun)) deallocate (begun)
      return
    end if
    if (.not. inverse%is_condensed) then
      if (allocated(begun)) deallocate (begun)
      call to_equations(inverse%map, force, b(:, 1))
      call solve_equations(inverse, b, .false., error)
      if (allocated(error)) return
      call to_nodes(inverse%map, b(:, 1), displacement)
      return
    end if
    answer(:, 1) = answer_of_interface(inverse, force)
    is_begun = allocated(begun)
    if (.not. is_begun) call refuse_begun(inverse, error)
    if (allocated(error)) return
    reduced = answer
    if (is_begun) then
      reduced(:, 1) = reduced(:, 1) + begun
      deallocate (begun)
      inverse%is_begun = .false.
    end if
    if (allocated(inverse%added)) then
      call to_equations(inverse%map, force, b(:, 1))
      along = times_answers(inverse, b(:, 1), 0)
      if (is_begun) along = along + inverse%along
      call take_away(inverse, -along, inverse%map%n_free - inverse%map%n_interface, reduced(:, 1))
    end if
    if (is_begun) then
      call inverse%factor%expand(reduced, b, error)
    else
      call inverse%factor%extend(reduced, b, error)
    end if
    if (allocated(error)) return
    if (allocated(inverse%added)) call take_away(inverse, along, 0, b(:, 1))
    b(inverse%map%n_free - inverse%map%n_interface + 1:, 1) = answer(:, 1)
    call to_nodes(inverse%map, b(:, 1), displacement)
  end subroutine finish_inverse

  !> K^-1 b where nothing is condensed, several at once. Unless some digits are enough, solutions
  !> with an inexact factor are refined by the internal forces of what they leave, until that gains
  !> nothing: what contact sees is linear then, and reactions do what the bodies do. Not at finite
  !> strain, where a factor of another place is refined with its iterations.
  subroutine solve_equations(inverse, b, roughly, error)
    type(stiffness_inverse_t), intent(inout) :: inverse
    real(wp), contiguous, intent(inout) :: b(:, :)   !! (n_free,m) [force] in, [length] out
    logical, intent(in) :: roughly
    type(error_t), allocatable, intent(out) :: error !! MUMPS failed
    integer, parameter :: most = 20
    real(wp), parameter :: enough = 1.0e-14_wp !! of the forces
    real(wp), allocatable :: x(:, :), left(:, :), last(:)
    logical, allocatable :: goes_on(:)
    integer :: i, g

    if (roughly .or. is_exact(inverse%factor%precision) .or. .not. allocated(inverse%mesh)) then
      call solve_once(inverse, b, loosely, error)
      return
    end if
    allocate (left, source=b)
    allocate (x(size(b, 1), size(b, 2)), source=0.0_wp)
    allocate (last(size(b, 2)), source=huge(1.0_wp))
    allocate (goes_on(size(b, 2)), source=.true.)
    do i = 1, most
      call solve_once(inverse, left, closely, error)
      if (allocated(error)) return
      do g = 1, size(b, 2)
        if (goes_on(g)) x(:, g) = x(:, g) + left(:, g)
        left(:, g) = b(:, g) - forces_of(x(:, g))
        goes_on(g) = goes_on(g) .and. norm2(left(:, g)) > enough*norm2(b(:, g)) .and. &
          norm2(left(:, g)) < 0.5_wp*last(g)
        last(g) = norm2(left(:, g))
        if (.not. goes_on(g)) left(:, g) = 0.0_wp
      end do
      if (.not. any(goes_on)) exit
    end do
    b = x

  contains

    !> K x.
    function forces_of(x) result(forces)
      real(wp), intent(in) :: x(:)
      real(wp) :: forces(size(x))
      real(wp), allocatable :: u(:, :), f(:, :)

      allocate (u(3, inverse%mesh%n_nodes), f(3, inverse%mesh%n_nodes))
      call to_nodes(inverse%map, x, u)
      call internal_force(inverse%mesh, inverse%materials, u, f)
      call to_equations(inverse%map, f, forces)
    end function forces_of

  end subroutine solve_equations

  !> K^-1 b as it comes, several at once: with the factor, or by iteration.
  subroutine solve_once(inverse, b, tolerance, error)
    type(stiffness_inverse_t), intent(inout) :: inverse
    real(wp), contiguous, intent(inout) :: b(:, :)   !! (n_free,m) [force] in, [length] out
    real(wp), intent(in) :: tolerance                !! of iterations, beside b [-]
    type(error_t), allocatable, intent(out) :: error !! MUMPS failed; no convergence
    real(wp) :: along(columns_added(inverse), bodies_added(inverse), size(b, 2))
    integer :: g

    if (.not. allocated(inverse%iterative)) then
      if (allocated(inverse%added)) then
        do g = 1, size(b, 2)
          along(:, :, g) = times_answers(inverse, b(:, g), 0)
        end do
      end if
      call inverse%factor%solve(b, error)
      if (allocated(error) .or. .not. allocated(inverse%added)) return
      do g = 1, size(b, 2)
        call take_away(inverse, along(:, :, g), 0, b(:, g))
      end do
      return
    end if
    do g = 1, size(b, 2)
      call inverse%iterative%solve(b(:, g), tolerance, error)
      if (allocated(error)) return
    end do
  end subroutine solve_once

  !> Take S D S^T into the inverse, each column of S once for all bodies: these share no rows.
  subroutine add_rank(inverse, pattern, strength, body, error)
    type(stiffness_inverse_t), intent(inout) :: inverse
    real(wp), intent(in) :: pattern(:, :, :)  !! (3,n_nodes,m) S [-]
    real(wp), intent(in) :: strength(:, :, :) !! (m,m,n_bodies) D, symmetric [force/length]
    integer, intent(in) :: body(:)            !! (n_nodes)
    type(error_t), allocatable, intent(out) :: error !! MUMPS failed; the sum is singular
    type(added_rank_t) :: added
    real(wp), allocatable :: answer(:, :, :)
    real(wp) :: s(inverse%map%n_free, size(pattern, 3)), core(size(pattern, 3), size(pattern, 3))
    real(wp) :: product(size(pattern, 3), size(pattern, 3))
    integer :: k, j, n
    logical :: is_regular

    call apply_inverse(inverse, pattern, answer, error)
    if (allocated(error)) return
    added%body = body(inverse%map%node)
    allocate (added%answer, mold=s)
    allocate (added%core, mold=strength)
    do k = 1, size(pattern, 3)
      call to_equations(inverse%map, pattern(:, :, k), s(:, k))
      added%answer(:, k) = unknowns_of(inverse%map, answer(:, :, k))
    end do
    do k = 1, size(strength, 3)
      product = 0.0_wp
      do j = 1, size(s, 1)
        if (added%body(j) == k) product = product + spread(s(j, :), 2, size(s, 2))* &
          spread(added%answer(j, :), 1, size(s, 2))
      end do
      core = matmul(strength(:, :, k), product)
      do j = 1, size(core, 1)
        core(j, j) = core(j, j) + 1.0_wp
      end do
      call invert_general(core, is_regular)
      if (.not. is_regular) then
        call raise(error, exit_not_solved, 'the mass of a body is singular')
        return
      end if
      core = matmul(core, strength(:, :, k))
      added%core(:, :, k) = 0.5_wp*(core + transpose(core))
    end do
    n = inverse%map%n_free - inverse%map%n_interface
    if (inverse%is_condensed .and. inverse%map%n_interface > 0) call subtract_products( &
      inverse%compliance, added%answer(n + 1:, :), added%core(:, :, added%body(n + &
      inverse%map%body_first(:size(inverse%map%body_first) - 1))))
    allocate (inverse%added, source=added)
  end subroutine add_rank

  !> The columns of Z, none where nothing is added.
  pure integer function columns_added(inverse) result(n)
    type(stiffness_inverse_t), intent(in) :: inverse

    n = 0
    if (allocated(inverse%added)) n = size(inverse%added%core, 1)
  end function columns_added

  !> The bodies that something is added to, likewise.
  pure integer function bodies_added(inverse) result(n)
    type(stiffness_inverse_t), intent(in) :: inverse

    n = 0
    if (allocated(inverse%added)) n = size(inverse%added%core, 3)
  end function bodies_added

  !> Z^T f, of forces on the equations behind the first `before`.
  pure function times_answers(inverse, f, before) result(along)
    type(stiffness_inverse_t), intent(in) :: inverse
    real(wp), intent(in) :: f(:)     !! [force]
    integer, intent(in) :: before
    real(wp) :: along(columns_added(inverse), bodies_added(inverse)) !! (m,n_bodies)
    integer :: i

    along = 0.0_wp
    associate (added => inverse%added)
      do i = 1, size(f)
        associate (of_body => along(:, added%body(before + i)))
          of_body = of_body + f(i)*added%answer(before + i, :)
        end associate
      end do
    end associate
  end function times_answers

  !> Subtract Z C times Z^T f from displacements of the equations behind the first `before`.
  pure subroutine take_away(inverse, along, before, x)
    type(stiffness_inverse_t), intent(in) :: inverse
    real(wp), intent(in) :: along(:, :) !! (m,n_bodies) of times_answers
    integer, intent(in) :: before
    real(wp), intent(inout) :: x(:)     !! [length]
    real(wp) :: part(size(along, 1), size(along, 2))
    integer :: i, k

    associate (added => inverse%added)
      do k = 1, size(along, 2)
        part(:, k) = matmul(added%core(:, :, k), along(:, k))
      end do
      do i = 1, size(x)
        x(i) = x(i) - dot_product(added%answer(before + i, :), part(:, added%body(before + i)))
      end do
    end associate
  end subroutine take_away

  !> What the factor answers on the interface, with nothing added to the stiffness.
  function of_factor(inverse, reduced) result(answer)
    type(stiffness_inverse_t), intent(in) :: inverse
    real(wp), contiguous, intent(in) :: reduced(:) !! (n_interface) [force]
    real(wp) :: answer(size(reduced))              !! [length]

    answer = times_blocks(inverse%compliance, reduced)
    if (.not. allocated(inverse%added)) return
    associate (before => inverse%map%n_free - inverse%map%n_interface)
      call take_away(inverse, -times_answers(inverse, reduced, before), before, answer)
    end associate
  end function of_factor

  !> Forget a solution that was begun.
  pure subroutine abandon_inverse(inverse)
    type(stiffness_inverse_t), intent(inout) :: inverse

    inverse%is_begun = .false.
  end subroutine abandon_inverse

  !> Another solution would overwrite the one that the factor holds half of.
  subroutine refuse_begun(inverse, error)
    type(stiffness_inverse_t), intent(in) :: inverse
    type(error_t), allocatable, intent(out) :: error

    if (inverse%is_begun) call raise(error, exit_machine, &
      'bipot: error: a solution with the factor was begun, and another asked for before its end')
  end subroutine refuse_begun

  !> What forces on the interface do to it.
  function answer_of_interface(inverse, force) result(answer)
    type(stiffness_inverse_t), intent(in) :: inverse
    real(wp), intent(in) :: force(:, :)           !! (3,n_nodes) on the interface [force]
    real(wp) :: answer(inverse%map%n_interface)   !! [length]
    real(wp) :: b(inverse%map%n_free)

    call to_equations(inverse%map, force, b)
    answer = times_blocks(inverse%compliance, &
      b(inverse%map%n_free - inverse%map%n_interface + 1:))
  end function answer_of_interface

  !> Displacements of the interface as those of its nodes.
  pure function at_interface(inverse, answer, n_nodes) result(displacement)
    type(stiffness_inverse_t), intent(in) :: inverse
    real(wp), intent(in) :: answer(:)             !! (n_interface) [length]
    integer, intent(in) :: n_nodes
    real(wp) :: displacement(3, n_nodes)          !! 0 elsewhere [length]
    real(wp) :: b(inverse%map%n_free)

    b = 0.0_wp
    b(inverse%map%n_free - inverse%map%n_interface + 1:) = answer
    call to_nodes(inverse%map, b, displacement)
  end function at_interface

  !> What forces on the interface do to it; where nothing is condensed, to all nodes. A solution
  !> that fails for that is the failure of `inverse`.
  function moved_by(inverse, force) result(displacement)
    type(stiffness_inverse_t), intent(inout) :: inverse
    real(wp), intent(in) :: force(:, :)                  !! (3,n_nodes) on the interface [force]
    real(wp) :: displacement(3, size(force, 2))          !! [length]
    type(error_t), allocatable :: error
    real(wp) :: b(inverse%map%n_free, 1)

    if (inverse%is_condensed) then
      displacement = at_interface(inverse, answer_of_interface(inverse, force), size(force, 2))
      return
    end if
    displacement = 0.0_wp
    call to_equations(inverse%map, force, b(:, 1))
    call solve_equations(inverse, b, .false., error)
    if (allocated(error)) then
      call move_alloc(error, inverse%failure)
      return
    end if
    call to_nodes(inverse%map, b(:, 1), displacement)
  end function moved_by

  !> What the body does when its interface moves as told and nothing else acts, several at once.
  subroutine recover_columns(inverse, answers, columns, error)
    type(stiffness_inverse_t), intent(inout) :: inverse
    real(wp), contiguous, intent(inout) :: answers(:, :) !! (n_interface,m) unchanged [length]
    real(wp), contiguous, intent(inout) :: columns(:, :) !! (n_free,m) out, for `at_nodes` [length]
    type(error_t), allocatable, intent(out) :: error     !! MUMPS failed

    call refuse_begun(inverse, error)
    if (allocated(error)) return
    call inverse%factor%extend(answers, columns, error)
    if (allocated(error)) return
    columns(inverse%map%n_free - inverse%map%n_interface + 1:, :) = answers
  end subroutine recover_columns

  !> One of these columns as displacements of the nodes.
  pure function at_nodes(inverse, column, n_nodes) result(displacement)
    type(stiffness_inverse_t), intent(in) :: inverse
    real(wp), intent(in) :: column(:)       !! (n_free) [length]
    integer, intent(in) :: n_nodes
    real(wp) :: displacement(3, n_nodes)    !! [length]

    call to_nodes(inverse%map, column, displacement)
  end function at_nodes

end module stiffness_inverse_mod
