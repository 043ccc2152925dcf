!> The springs of a deck: an elongation q of some displacements, and the force that goes with it.
!>
!>     q = sum over the ends of b . u        along fixed directions: SPRING1, SPRING2; SPRINGA at
!>                                           small strain, b its line
!>     q = |x_2 - x_1| - |X_2 - X_1|         SPRINGA at finite strain
!>
!> The force is k q, or with NLGEOM what a table gives over q.
module spring_elements_mod
  use kinds_mod, only: wp
  use growing_lists_mod, only: append
  implicit none
  private

  public :: foundation_t, listed_springs
  public :: spring_elements_t, spring_state_t, force_table_t, add_spring_element, some_springs, &
    spring_ends, spring_direction, spring_state, past_table

  !> Forces over elongations: straight between two rows, constant outside of them; 0 at 0.
  type :: force_table_t
    real(wp), allocatable :: elongation(:) !! (m) ascending [length]
    real(wp), allocatable :: force(:)      !! (m) [force]
  end type force_table_t

  !> All springs of a mesh; arrays may be longer than what counts.
  type :: spring_elements_t
    integer :: n = 0
    integer,  allocatable :: id(:)             !! (n) in the deck
    integer,  allocatable :: first(:)          !! (n+1) where the ends of each begin
    integer,  allocatable :: node(:)           !! (n_ends) distinct in each
    real(wp), allocatable :: direction(:, :)
    !! (3,n_ends) b; of axial ones 0 [-, of rotations 1/length]
    logical,  allocatable :: is_axial(:)       !! (n) along the line between its two ends
    real(wp), allocatable :: stiffness(:)      !! (n) k > 0; of a table the largest [force/length]
    integer,  allocatable :: table(:)          !! (n) its table; 0: none
    type(force_table_t), allocatable :: tables(:) !! not allocated: none
  end type spring_elements_t

  !> A *FOUNDATION: faces that resist displacements along their normals. Each point of their
  !> quadrature is a spring, whose id is 0, behind those of the deck.
  type :: foundation_t
    integer :: surface = 0            !! index into the scene's surfaces
    real(wp) :: stiffness = 0.0_wp    !! > 0 [force/length^3]
  end type foundation_t

  !> A spring where displacements take it.
  type :: spring_state_t
    real(wp) :: elongation = 0.0_wp  !! q [length]
    real(wp) :: pull = 0.0_wp        !! force; > 0 where it draws its ends together [force]
    real(wp) :: stiffness = 0.0_wp   !! what the force changes by with q [force/length]
    real(wp) :: energy = 0.0_wp      !! [energy]
    real(wp), allocatable :: direction(:, :)
    !! (3,m) what q changes by with the displacements of the ends
    real(wp) :: length = 0.0_wp      !! of an axial one that turns, else 0 [length]
  end type spring_state_t

contains

  !> One more spring.
  pure subroutine add_spring_element(springs, id, nodes, direction, stiffness, table)
    type(spring_elements_t), intent(inout) :: springs
    integer, intent(in) :: id
    integer, intent(in) :: nodes(:)           !! (m) its ends, distinct
    real(wp), intent(in) :: direction(:, :)   !! (3,m) b; all 0: axial, of two ends
    real(wp), intent(in) :: stiffness         !! [force/length]
    integer, intent(in), optional :: table    !! index into the tables; 0, or left out: none
    integer :: n, n_ends, want

    n = springs%n
    if (n == 0) allocate (springs%id(8), springs%is_axial(8), springs%stiffness(8), &
      springs%table(8), springs%direction(3, 16))
    if (n == 0) springs%first = [1]
    if (n == size(springs%id)) then
      springs%id = [springs%id, springs%id]
      springs%is_axial = [springs%is_axial, springs%is_axial]
      springs%stiffness = [springs%stiffness, springs%stiffness]
      springs%table = [springs%table, springs%table]
    end if
    n_ends = springs%first(n + 1) - 1
    want = n_ends + size(nodes)
    if (want > size(springs%direction, 2)) springs%direction = reshape(springs%direction, &
      [3, 2*want], pad=[0.0_wp])
    springs%direction(:, n_ends + 1:want) = direction
    call append(springs%node, n_ends, nodes)
    springs%n = n + 1
    springs%id(n + 1) = id
    springs%is_axial(n + 1) = .not. any(abs(direction) > 0.0_wp)
    springs%stiffness(n + 1) = stiffness
    springs%table(n + 1) = 0
    if (present(table)) springs%table(n + 1) = table
    n = n + 1
    call append(springs%first, n, want + 1)
  end subroutine add_spring_element

  !> How many springs are elements of the deck: the first ones.
  pure integer function listed_springs(springs) result(n)
    type(spring_elements_t), intent(in) :: springs

    n = 0
    if (springs%n > 0) n = count(springs%id(:springs%n) > 0)
  end function listed_springs

  !> Some springs of a part of a mesh. Parts are linear: tables stay behind.
  pure type(spring_elements_t) function some_springs(springs, list, number) result(some)
    type(spring_elements_t), intent(in) :: springs
    integer, intent(in) :: list(:)   !! of springs
    integer, intent(in) :: number(:) !! of the nodes in the part
    integer :: i

    do i = 1, size(list)
      associate (first => springs%first(list(i)), last => springs%first(list(i) + 1) - 1)
        call add_spring_element(some, springs%id(list(i)), number(springs%node(first:last)), &
          springs%direction(:, first:last), springs%stiffness(list(i)))
      end associate
    end do
  end function some_springs

  !> The nodes of a spring.
  pure function spring_ends(springs, s) result(ends)
    type(spring_elements_t), intent(in) :: springs
    integer, intent(in) :: s
    integer, allocatable :: ends(:)

    ends = springs%node(springs%first(s):springs%first(s + 1) - 1)
  end function spring_ends

  !> What the elongation of a spring of places changes by with the displacements of its ends.
  pure function spring_direction(springs, s, x) result(direction)
    type(spring_elements_t), intent(in) :: springs
    integer, intent(in) :: s
    real(wp), intent(in) :: x(:, :)           !! (3,n_nodes) [length]
    real(wp), allocatable :: direction(:, :)  !! (3,m) b

    associate (first => springs%first(s), last => springs%first(s + 1) - 1)
      direction = springs%direction(:, first:last)
      if (.not. springs%is_axial(s)) return
      direction(:, 2) = x(:, springs%node(last)) - x(:, springs%node(first))
      direction(:, 2) = direction(:, 2)/norm2(direction(:, 2))
      direction(:, 1) = -direction(:, 2)
    end associate
  end function spring_direction

  !> A spring where displacements take it.
  pure type(spring_state_t) function spring_state(springs, s, x, u, is_finite) result(state)
    type(spring_elements_t), intent(in) :: springs
    integer, intent(in) :: s
    real(wp), intent(in) :: x(:, :)   !! (3,n_nodes) places of the undeformed mesh [length]
    real(wp), intent(in) :: u(:, :)   !! (3,n_nodes) [length]
    logical, intent(in) :: is_finite  !! strain: axial springs turn
    real(wp) :: line(3), way(3), before

    allocate (state%direction, source=spring_direction(springs, s, x))
    associate (first => springs%first(s), last => springs%first(s + 1) - 1)
      if (springs%is_axial(s) .and. is_finite) then
        line = x(:, springs%node(last)) - x(:, springs%node(first))
        way = u(:, springs%node(last)) - u(:, springs%node(first))
        before = norm2(line)
        state%length = max(norm2(line + way), epsilon(1.0_wp)*before)
        ! Of squares: so that small elongations lose no digits.
        state%elongation = dot_product(way, 2.0_wp*line + way)/(state%length + before)
        state%direction(:, 2) = (line + way)/state%length
        state%direction(:, 1) = -state%direction(:, 2)
      else if (springs%is_axial(s)) then
        ! Of the difference: displacements as a whole cancel.
        state%elongation = dot_product(state%direction(:, 2), u(:, springs%node(last)) - &
          u(:, springs%node(first)))
      else
        state%elongation = sum(state%direction*u(:, springs%node(first:last)))
      end if
    end associate
    state%stiffness = springs%stiffness(s)
    state%pull = state%stiffness*state%elongation
    state%energy = 0.5_wp*state%pull*state%elongation
    if (.not. is_finite .or. springs%table(s) == 0) return
    call read_table(springs%tables(springs%table(s)), state)
  end function spring_state

  !> How far a spring is past the ends of its table; 0 within it, and of springs without one.
  pure real(wp) function past_table(springs, s, elongation) result(past)
    type(spring_elements_t), intent(in) :: springs
    integer, intent(in) :: s
    real(wp), intent(in) :: elongation !! [length]

    past = 0.0_wp
    if (springs%table(s) == 0) return
    associate (q => springs%tables(springs%table(s))%elongation)
      past = max(0.0_wp, elongation - q(size(q)), q(1) - elongation)
    end associate
  end function past_table

  !> Force, stiffness and energy of an elongation by a table.
  pure subroutine read_table(table, state)
    type(force_table_t), intent(in) :: table
    type(spring_state_t), intent(inout) :: state !! its elongation is there
    real(wp) :: from, to, a, b, low, high
    integer :: i

    ! The energy is that of the pieces between 0 and the elongation.
    from = min(0.0_wp, state%elongation)
    to = max(0.0_wp, state%elongation)
    state%energy = 0.0_wp
    associate (q => table%elongation, f => table%force, n => size(table%force))
      do i = 0, n
        low = from
        high = to
        if (i > 0) low = max(from, q(i))
        if (i < n) high = min(to, q(i + 1))
        if (.not. high > low) cycle
        a = force_at(table, low)
        b = force_at(table, high)
        state%energy = state%energy + 0.5_wp*(a + b)*(high - low)
      end do
      if (state%elongation < 0.0_wp) state%energy = -state%energy
      state%pull = force_at(table, state%elongation)
      i = count(q <= state%elongation)
      state%stiffness = 0.0_wp
      if (i > 0 .and. i < n) state%stiffness = (f(i + 1) - f(i))/(q(i + 1) - q(i))
    end associate
  end subroutine read_table

  !> The force of an elongation.
  pure real(wp) function force_at(table, elongation) result(force)
    type(force_table_t), intent(in) :: table
    real(wp), intent(in) :: elongation !! [length]
    integer :: i

    associate (q => table%elongation, f => table%force, n => size(table%force))
      i = count(q <= elongation)
      force = f(max(1, i))
      if (i > 0 .and. i < n) force = force + (f(i + 1) - f(i))*((elongation - q(i))/(q(i + 1) - &
        q(i)))
    end associate
  end function force_at

end module spring_elements_mod
