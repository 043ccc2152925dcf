!> Linear constraints: degrees of freedom that depend on others,
!>
!>     u_dependent = sum over its masters of weight times u_master,
!>
!> homogeneous, one line a degree of freedom. Forces go the other way: what acts on a dependent one
!> acts on its masters, times the weights. With T from the others to all, u = T q and q's forces are
!> T^T f. docs/theory.md (11.10).
module constraints_mod
  use kinds_mod, only: wp
  use growing_lists_mod, only: append, enlarge
  implicit none
  private

  public :: constraints_t, add_constraint, active_constraints, constraint_on_cycle, &
    constraint_of, follow_masters, give_to_masters, some_constraints

  !> The constraints of a scene, in which masters may depend on others in their turn, or the active
  !> ones of a *STEP, in which none does.
  type :: constraints_t
    integer :: n = 0
    integer :: n_equations = 0
    !! of the scene's: the last so many are equations, which rigid motions need not satisfy; those
    !! before them are of ties, which rigid motions of both surfaces satisfy
    integer, allocatable :: node(:), dof(:)     !! (n) that depends; dof 1, 2, 3
    integer, allocatable :: first(:)            !! (n+1) where the masters of each begin
    integer, allocatable :: master(:)           !! (n_entries) node; there may be more room
    integer, allocatable :: master_dof(:)       !! (n_entries) 1, 2, 3
    real(wp), allocatable :: weight(:)          !! (n_entries) [-]
  end type constraints_t

  !> A constraint while masters are put in: each once, `index` says where.
  type :: line_t
    integer :: n = 0
    integer, allocatable :: master(:), master_dof(:) !! (n) there may be more room
    real(wp), allocatable :: weight(:)               !! (n) [-]
    integer, allocatable :: index(:, :)              !! (3,n_nodes) 0 of what is no master
  end type line_t

contains

  !> One more constraint.
  pure subroutine add_constraint(constraints, node, dof, master, master_dof, weight)
    type(constraints_t), intent(inout) :: constraints
    integer, intent(in) :: node, dof
    integer, intent(in) :: master(:), master_dof(:) !! (m)
    real(wp), intent(in) :: weight(:)               !! (m) [-]
    integer :: n, used

    n = constraints%n
    if (.not. allocated(constraints%first)) then
      allocate (constraints%node(0), constraints%dof(0), constraints%first(1), &
        constraints%master(0), constraints%master_dof(0), constraints%weight(0))
      constraints%first = 1
    end if
    call append(constraints%node, constraints%n, node)
    constraints%n = n
    call append(constraints%dof, constraints%n, dof)
    used = constraints%first(n + 1) - 1
    if (used + size(weight) > size(constraints%weight)) call enlarge(constraints%weight, used, &
      2*(used + size(weight)))
    constraints%weight(used + 1:used + size(weight)) = weight
    call append(constraints%master_dof, used, master_dof)
    used = constraints%first(n + 1) - 1
    call append(constraints%master, used, master)
    n = n + 1
    call append(constraints%first, n, used + 1)
  end subroutine add_constraint

  !> The number of the constraint of every degree of freedom, 0 where it has none.
  pure function constraint_of(constraints, n_nodes) result(number)
    type(constraints_t), intent(in) :: constraints
    integer, intent(in) :: n_nodes
    integer :: number(3, n_nodes)
    integer :: c

    number = 0
    do c = 1, constraints%n
      number(constraints%dof(c), constraints%node(c)) = c
    end do
  end function constraint_of

  !> A constraint whose degree of freedom depends on itself, through others perhaps; 0: none.
  pure integer function constraint_on_cycle(constraints, n_nodes) result(on_cycle)
    type(constraints_t), intent(in) :: constraints
    integer, intent(in) :: n_nodes
    integer :: number(3, n_nodes), next(constraints%n), path(constraints%n), c, depth, k, other

    number = constraint_of(constraints, n_nodes)
    on_cycle = 0
    next = 0 ! not yet seen; < 0: done; else the entry to look at next
    do c = 1, constraints%n
      if (next(c) /= 0) cycle
      depth = 1
      path(1) = c
      next(c) = constraints%first(c)
      do while (depth > 0)
        k = next(path(depth))
        if (k >= constraints%first(path(depth) + 1)) then
          next(path(depth)) = -1
          depth = depth - 1
          cycle
        end if
        next(path(depth)) = k + 1
        other = number(constraints%master_dof(k), constraints%master(k))
        if (other == 0) cycle
        if (next(other) < 0) cycle
        if (next(other) > 0) then
          on_cycle = other
          return
        end if
        depth = depth + 1
        path(depth) = other
        next(other) = constraints%first(other)
      end do
    end do
  end function constraint_on_cycle

  !> The constraints that hold with some supports, chains substituted: masters are no longer
  !> dependent. Where a support holds a degree of freedom its constraint is dropped.
  pure type(constraints_t) function active_constraints(constraints, prescribed) result(active)
    type(constraints_t), intent(in) :: constraints !! without cycles
    logical, intent(in) :: prescribed(:, :)        !! (3,n_nodes)
    integer, allocatable :: number(:, :)
    type(line_t) :: line
    integer :: c, k, l, other
    real(wp) :: factor

    if (constraints%n == 0) return
    allocate (number(3, size(prescribed, 2)), source=constraint_of(constraints, &
      size(prescribed, 2)))
    where (prescribed) number = 0
    allocate (line%index(3, size(prescribed, 2)), source=0)
    allocate (line%master(64), line%master_dof(64), line%weight(64))
    do c = 1, constraints%n
      if (number(constraints%dof(c), constraints%node(c)) /= c) cycle
      line%n = 0
      do k = constraints%first(c), constraints%first(c + 1) - 1
        call take(line, constraints%master(k), constraints%master_dof(k), constraints%weight(k))
      end do
      ! What is put in for a master stands behind it and is looked at in its turn.
      k = 0
      do while (k < line%n)
        k = k + 1
        other = number(line%master_dof(k), line%master(k))
        if (other == 0) cycle
        factor = line%weight(k)
        line%weight(k) = 0.0_wp
        line%index(line%master_dof(k), line%master(k)) = 0
        do l = constraints%first(other), constraints%first(other + 1) - 1
          call take(line, constraints%master(l), constraints%master_dof(l), &
            factor*constraints%weight(l))
        end do
      end do
      do k = 1, line%n
        line%index(line%master_dof(k), line%master(k)) = 0
      end do
      associate (kept => pack([(k, k=1, line%n)], abs(line%weight(:line%n)) > 0.0_wp))
        call add_constraint(active, constraints%node(c), constraints%dof(c), line%master(kept), &
          line%master_dof(kept), line%weight(kept))
      end associate
    end do
  end function active_constraints

  !> Add to the weight of a master, or begin it.
  pure subroutine take(line, node, dof, factor)
    type(line_t), intent(inout) :: line
    integer, intent(in) :: node, dof
    real(wp), intent(in) :: factor !! [-]
    integer :: n

    n = line%n
    if (line%index(dof, node) == 0) then
      if (n == size(line%master)) then
        call enlarge(line%master, n, 2*n)
        call enlarge(line%master_dof, n, 2*n)
        call enlarge(line%weight, n, 2*n)
      end if
      n = n + 1
      line%n = n
      line%master(n) = node
      line%master_dof(n) = dof
      line%weight(n) = 0.0_wp
      line%index(dof, node) = n
    end if
    associate (at => line%index(dof, node))
      line%weight(at) = line%weight(at) + factor
    end associate
  end subroutine take

  !> Displacements of what depends, from those of its masters.
  pure subroutine follow_masters(active, u)
    type(constraints_t), intent(in) :: active    !! chains substituted
    real(wp), intent(inout) :: u(:, :)           !! (3,n_nodes)
    real(wp) :: total
    integer :: c, k

    do c = 1, active%n
      total = 0.0_wp
      do k = active%first(c), active%first(c + 1) - 1
        total = total + active%weight(k)*u(active%master_dof(k), active%master(k))
      end do
      u(active%dof(c), active%node(c)) = total
    end do
  end subroutine follow_masters

  !> Forces on what depends, given to its masters: nothing is left there.
  pure subroutine give_to_masters(active, f)
    type(constraints_t), intent(in) :: active    !! chains substituted
    real(wp), intent(inout) :: f(:, :)           !! (3,n_nodes)
    integer :: c, k

    do c = 1, active%n
      associate (force => f(active%dof(c), active%node(c)))
        do k = active%first(c), active%first(c + 1) - 1
          associate (at => f(active%master_dof(k), active%master(k)))
            at = at + active%weight(k)*force
          end associate
        end do
        force = 0.0_wp
      end associate
    end do
  end subroutine give_to_masters

  !> The constraints of some of the nodes, numbered anew; their masters must be among them.
  pure type(constraints_t) function some_constraints(constraints, number) result(some)
    type(constraints_t), intent(in) :: constraints
    integer, intent(in) :: number(:) !! (n_nodes) new numbers, 0 of nodes that are left out
    integer :: c

    do c = 1, constraints%n
      if (number(constraints%node(c)) == 0) cycle
      associate (first => constraints%first(c), last => constraints%first(c + 1) - 1)
        call add_constraint(some, number(constraints%node(c)), constraints%dof(c), &
          number(constraints%master(first:last)), constraints%master_dof(first:last), &
          constraints%weight(first:last))
      end associate
    end do
  end function some_constraints

end module constraints_mod
