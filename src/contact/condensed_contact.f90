!> The condensed contact problem x = W r + x_free of a placement, in groups that nothing couples.
!>
!> Bodies act on each other through contact alone, and through the obstacles that they may push. So
!> points of bodies that nothing of this kind joins have a contact problem of their own: W has no
!> blocks between groups, and each is solved to a tolerance measured by its own forces, however
!> stiff or heavily loaded the others are. docs/theory.md section 2.
module condensed_contact_mod
  use kinds_mod, only: wp
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t, master_nodes
  use rigid_modes_mod, only: free_motions_t
  use body_map_mod, only: body_map_t
  use compliance_mod, only: take_matrix, get_matrix, is_map
  use problem_mod, only: contact_problem_t
  use dense_mod, only: null_space
  use floating_mod, only: floating_t
  implicit none
  private

  public :: condensed_contact_t, contact_group_t, find_groups, count_points, count_rows, &
    count_matrix_entries, is_on_bodies, neutral_motions, unpressed_motions, whole_problem, &
    are_left_out

  !> Points that contact couples, and the rigid motions that it sees there.
  type :: contact_group_t
    integer, allocatable :: point(:)   !! of the run, in reach
    integer, allocatable :: motion(:)  !! of the bodies' free ones
    integer, allocatable :: active(:)  !! points of the run that have rows, in the problem's order
    integer, allocatable :: node(:)    !! of each of these
    integer, allocatable :: far(:)     !! points in reach that have none, though they can move: open
    type(contact_problem_t) :: problem !! over the active points
    type(floating_t) :: floating       !! what the motions do to it
    real(wp), allocatable :: null(:, :)
    !! (n_rows,k) orthonormal reactions that constraints take and no body feels [-]
    real(wp) :: flexibility = 0.0_wp   !! then: the largest of W_ii [length/force]
    real(wp) :: softness = 0.0_wp      !! of these in the problem's W [length/force]
    class(body_map_t), allocatable :: body
    !! where it is solved together with the displacements, by iteration
    real(wp), allocatable :: undeformed_g(:, :)
    !! (n_rows,n) then: what the motions did at the rows before anything moved [-]
  end type contact_group_t

  !> All of it. Before flat obstacles it holds as long as the supports do; what has curved ones is
  !> made anew for every placement, in the same memory.
  type :: condensed_contact_t
    type(contact_group_t), allocatable :: group(:)
    integer, allocatable :: motion_body(:) !! (n_motions) body of each motion of the groups
    logical, allocatable :: presses(:)
    !! (n_points) where that is known: in the iteration before
    real(wp), allocatable :: load(:) !! (n_motions) then: work of the loads on each motion [force]
  end type condensed_contact_t

contains

  !> Find the groups: bodies with points in reach, and bodies and obstacles that move freely, joined
  !> where a body faces another, or an obstacle that moves freely; one of all where bodies are
  !> solved for by iteration.
  subroutine find_groups(scene, points, motions, by_iteration, contact)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(free_motions_t), intent(in) :: motions
    logical, intent(in) :: by_iteration
    type(condensed_contact_t), intent(out) :: contact
    integer :: root(scene%mesh%n_bodies + scene%mesh%n_nodes) !! of bodies, then of reference nodes
    integer :: mover(motions%n), group_of(size(root)), i, k, n, pair
    integer, allocatable :: masters(:) !! of a pair, as of `root`
    logical :: is_free(scene%mesh%n_nodes)

    is_free = .false.
    do i = 1, motions%n
      mover(i) = motions%body(i)
      if (mover(i) > 0) cycle
      mover(i) = scene%mesh%n_bodies + motions%node(i)
      is_free(motions%node(i)) = .true.
    end do

    ! What is joined has one root, the lowest number among it.
    root = [(i, i=1, size(root))]
    do pair = 1, size(scene%pairs)
      if (.not. any(points%in_reach(points%first(pair):points%first(pair + 1) - 1))) cycle
      masters = master_nodes(points, pair)
      masters = pack(masters, is_free(masters) .or. scene%mesh%body(masters) > 0)
      masters = merge(scene%mesh%body(masters), scene%mesh%n_bodies + masters, &
        scene%mesh%body(masters) > 0)
      if (size(masters) == 0) cycle
      do k = 2, size(masters)
        call join(masters(1), masters(k))
      end do
      do i = points%first(pair), points%first(pair + 1) - 1
        if (points%in_reach(i)) call join(masters(1), scene%mesh%body(points%node(i)))
      end do
    end do

    ! Solved together with all displacements they have one problem.
    if (by_iteration) root = 1

    n = 0
    group_of = 0
    do i = 1, points%n
      if (.not. points%in_reach(i)) cycle
      k = root(scene%mesh%body(points%node(i)))
      if (group_of(k) == 0) n = n + 1
      if (group_of(k) == 0) group_of(k) = n
    end do
    do i = 1, motions%n
      k = root(mover(i))
      if (group_of(k) == 0) n = n + 1
      if (group_of(k) == 0) group_of(k) = n
    end do
    contact%motion_body = motions%body
    allocate (contact%group(n))
    do k = 1, n
      contact%group(k)%point = pack([(i, i=1, points%n)], points%in_reach .and. &
        group_of(root(scene%mesh%body(points%node))) == k)
      contact%group(k)%motion = pack([(i, i=1, motions%n)], group_of(root(mover)) == k)
    end do

  contains

    subroutine join(one, other)
      integer, intent(in) :: one, other
      integer :: lower, upper

      lower = min(root(one), root(other))
      upper = max(root(one), root(other))
      if (lower == upper) return
      where (root == upper) root = lower
    end subroutine join

  end subroutine find_groups

  !> Whether contact is solved together with the displacements.
  pure logical function is_on_bodies(contact)
    type(condensed_contact_t), intent(in) :: contact

    is_on_bodies = .false.
    if (size(contact%group) == 1) is_on_bodies = allocated(contact%group(1)%body)
  end function is_on_bodies

  !> Which points in reach are taken to be open.
  pure function are_left_out(contact, n_points) result(left_out)
    type(condensed_contact_t), intent(in) :: contact
    integer, intent(in) :: n_points  !! of the run
    logical :: left_out(n_points)
    integer :: i

    left_out = .false.
    do i = 1, size(contact%group)
      left_out(contact%group(i)%far) = .true.
    end do
  end function are_left_out

  !> Points with rows, of all groups.
  pure integer function count_points(contact)
    type(condensed_contact_t), intent(in) :: contact
    integer :: i

    count_points = sum([(contact%group(i)%problem%n_points, i=1, size(contact%group))])
  end function count_points

  !> Rows of all groups.
  pure integer function count_rows(contact)
    type(condensed_contact_t), intent(in) :: contact
    integer :: i

    count_rows = sum([(contact%group(i)%problem%n_rows, i=1, size(contact%group))])
  end function count_rows

  !> Entries of W that are kept: the blocks of the groups.
  pure real(wp) function count_matrix_entries(contact) result(n)
    type(condensed_contact_t), intent(in) :: contact
    integer :: i

    n = 0.0_wp
    do i = 1, size(contact%group)
      if (is_map(contact%group(i)%problem%compliance)) cycle
      if (allocated(contact%group(i)%body)) cycle ! formed for once, where nothing else helps
      n = n + real(contact%group(i)%problem%n_rows, wp)**2
    end do
  end function count_matrix_entries

  !> The motions that contact does not see where the undeformed bodies are, orthonormal, those of
  !> one group after those of another.
  pure function neutral_motions(contact, n_motions) result(neutral)
    type(condensed_contact_t), intent(in) :: contact
    integer, intent(in) :: n_motions          !! free ones of all bodies
    real(wp), allocatable :: neutral(:, :)    !! (n_motions,k) [-]
    integer :: i, k, n

    n = 0
    do i = 1, size(contact%group)
      if (allocated(contact%group(i)%floating%neutral)) n = n + &
        size(contact%group(i)%floating%neutral, 2)
    end do
    allocate (neutral(n_motions, n), source=0.0_wp)
    k = 0
    do i = 1, size(contact%group)
      associate (group => contact%group(i))
        if (.not. allocated(group%floating%neutral)) cycle
        n = size(group%floating%neutral, 2)
        neutral(group%motion, k + 1:k + n) = group%floating%neutral
        k = k + n
      end associate
    end do
  end function neutral_motions

  !> The motions of a group that points which press do not see, orthonormal; neutral ones are among
  !> them.
  function unpressed_motions(group, reaction) result(unpressed)
    type(contact_group_t), intent(in) :: group
    real(wp), intent(in) :: reaction(:, :)     !! (3,n_points) [force]
    real(wp), allocatable :: unpressed(:, :)   !! (n,k) n motions of the group [-]
    real(wp), parameter :: unseen = 1.0e-10_wp !! as of see_motions [-]
    real(wp), allocatable :: g(:, :)
    logical :: presses(3, size(group%active))

    presses = group%problem%row > 0 .and. spread(any(abs(reaction(:, group%active)) > 0.0_wp, &
      dim=1) .or. group%problem%stays, 1, 3)
    g = group%floating%g(pack(group%problem%row, presses), :)
    associate (neutral => group%floating%neutral)
      g = g - matmul(matmul(g, neutral), transpose(neutral))
    end associate
    unpressed = null_space(g, unseen)
  end function unpressed_motions

  !> All groups as one problem with one W, as far as it is written to a file: no solver's scales.
  type(contact_problem_t) function whole_problem(contact) result(whole)
    type(condensed_contact_t), intent(in) :: contact
    real(wp), allocatable :: w(:, :)
    integer :: i, a, k, n

    whole%n_points = count_points(contact)
    whole%n_rows = count_rows(contact)
    allocate (whole%row(3, whole%n_points), whole%mu(whole%n_points))
    allocate (whole%driven(2, whole%n_points), whole%block(3, 3, whole%n_points))
    allocate (w(whole%n_rows, whole%n_rows), source=0.0_wp)
    k = 0
    n = 0
    do i = 1, size(contact%group)
      associate (problem => contact%group(i)%problem)
        do a = 1, 3
          whole%row(a, k + 1:k + problem%n_points) = merge(problem%row(a, :) + n, 0, &
            problem%row(a, :) > 0)
        end do
        whole%mu(k + 1:k + problem%n_points) = problem%mu
        whole%driven(:, k + 1:k + problem%n_points) = problem%driven
        whole%block(:, :, k + 1:k + problem%n_points) = problem%block
        call get_matrix(problem%compliance, w(n + 1:n + problem%n_rows, n + 1:n + problem%n_rows))
        k = k + problem%n_points
        n = n + problem%n_rows
      end associate
    end do
    call take_matrix(w, whole%compliance)
  end function whole_problem

end module condensed_contact_mod
