!> The scales of the certificate: what its forces and lengths are measured by.
!>
!> Neither may come from what is judged: a reaction that is wrong must not make its own error small.
!> docs/theory.md section 6.
module certificate_scales_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: cross, inverse, determinant
  use mesh_mod, only: mesh_t, shown_nodes
  use contact_points_mod, only: contact_points_t
  use state_mod, only: state_t
  use increment_report_mod, only: contact_fields_t
  use increment_forces_mod, only: increment_forces_t
  use bodies_at_rest_mod, only: are_carried
  use error_measures_mod, only: largest_spread
  implicit none
  private

  public :: scales_t, find_scales

  real(wp), parameter :: let_go = 1.0e-3_wp
  !! of the forces before an increment: forces at its end are measured by no less, for where contact
  !! opens everywhere the rest is rounding; 370 random decks end alike with 1e-4 to 1e-2 [-]
  real(wp), parameter :: nothing = 1.0e-8_wp
  !! of the largest rounding of a force: forces are measured by no less, so that nothing is beside
  !! nothing; 370 random decks end alike with 1e-9 to 1e-7 [-]
  real(wp), parameter :: flat = 1.0e-14_wp
  !! of the cube of its trace: a determinant of moments of inertia about a line, or
  !! a rod that is longer than 5e6 times its thickness [-]

  type :: scales_t
    real(wp), allocatable :: of_body(:)  !! (0:n_bodies) of forces, without contact [force]
    real(wp), allocatable :: force(:)    !! (n_points) of the bodies in contact there [force]
    real(wp), allocatable :: length(:)   !! (n_points) likewise [length]
    real(wp), allocatable :: strained(:, :) !! (3,n_nodes) deformation [length]
    logical, allocatable :: is_carried(:) !! (0:n_bodies) as of are_carried
  end type scales_t

contains

  !> The scales of an increment.
  !>
  !> Force: the largest load or force of an element on a node of a body, a thousandth of those that
  !> the increment began with. Length: its deformation and what that changes by, how far contact
  !> has moved across it, and how far contact forces would move their node alone, no more of them
  !> than the scale of forces. Bodies that press on each other have one scale, and rigid ones no
  !> other for their balance: the forces of their elements are rounding.
  pure subroutine find_scales(mesh, points, contact, old, new, forces, pressed, scales)
    type(mesh_t), intent(in) :: mesh
    type(contact_points_t), intent(in) :: points
    type(contact_fields_t), intent(in) :: contact
    type(state_t), intent(in) :: old, new
    type(increment_forces_t), intent(in) :: forces
    real(wp), intent(in) :: pressed(:, :, :) !! (3,n_nodes,2) before and after it [force]
    type(scales_t), intent(out) :: scales
    real(wp), dimension(0:mesh%n_bodies) :: force, length
    real(wp) :: floor_of_forces, of_obstacles, u(3, mesh%n_nodes), motion(3)
    integer :: group(0:mesh%n_bodies), node, i, k, body

    ! What is smaller than its square can be said has no size that another is measured by.
    floor_of_forces = max(nothing*maxval(forces%rounding), sqrt(tiny(1.0_wp)))
    force = forces%of_elements%largest
    do node = 1, mesh%n_nodes
      associate (of_body => force(mesh%body(node)))
        of_body = max(of_body, norm2(forces%external(:, node)), let_go* &
          norm2(old%external_force(:, node)), let_go*norm2(merge(0.0_wp, pressed(:, node, 1), &
          forces%prescribed(:, node))))
        if (allocated(forces%applied)) of_body = max(of_body, norm2(forces%applied(:, node)))
      end associate
    end do
    call find_groups(mesh, points, contact, group)
    of_obstacles = force(0)
    force(0) = maxval(force(1:))
    ! Of obstacles' reference nodes the forces are resultants: a scale where there is no other.
    if (force(0) <= 0.0_wp) force(0) = of_obstacles
    allocate (scales%of_body(0:mesh%n_bodies), source=max(force, floor_of_forces))
    do body = 1, mesh%n_bodies
      force(group(body)) = max(force(group(body)), force(body))
    end do
    allocate (scales%is_carried(0:mesh%n_bodies), source=are_carried(mesh, forces, &
      pressed(:, :, 2)))
    do body = 1, mesh%n_bodies
      if (scales%is_carried(body)) scales%of_body(body) = max(scales%of_body(body), &
        force(group(body)))
    end do
    where (force <= 0.0_wp) force = of_obstacles
    length = 0.0_wp
    if (forces%is_finite) then
      scales%strained = turned_deformation(mesh, mesh%coordinates, mesh%coordinates + &
        new%displacement)
      u = turned_deformation(mesh, mesh%coordinates + old%displacement, mesh%coordinates + &
        new%displacement)
    else
      scales%strained = deformation(mesh, new%displacement)
      u = deformation(mesh, new%displacement - old%displacement)
    end if
    call add_spread(mesh, scales%strained, group, length)
    call add_spread(mesh, u, group, length)
    do node = 1, mesh%n_nodes
      ! Nodes of no body are not deformed: what counts is how far they go.
      if (mesh%body(node) == 0) length(0) = max(length(0), norm2(u(:, node)))
      associate (k_node => forces%stiffness(node), of_group => length(group(mesh%body(node))))
        if (k_node > 0.0_wp) of_group = max(of_group, min(norm2(pressed(:, node, 2)), &
          force(group(mesh%body(node))))/k_node)
      end associate
    end do
    do i = 1, points%n
      if (.not. any(abs(contact%reaction(:, i)) > 0.0_wp)) cycle
      motion = new%displacement(:, points%node(i)) - old%displacement(:, points%node(i))
      do k = contact%weights%first(i), contact%weights%first(i + 1) - 1
        associate (master => contact%weights%node(k), weight => contact%weights%weight(k))
          motion = motion - weight*(new%displacement(:, master) - old%displacement(:, master))
        end associate
      end do
      associate (of_group => length(group(mesh%body(points%node(i)))))
        of_group = max(of_group, norm2(motion))
      end associate
    end do
    scales%force = [(max(force(group(mesh%body(points%node(i)))), floor_of_forces), i=1, points%n)]
    scales%length = [(length(group(mesh%body(points%node(i)))), i=1, points%n)]
  end subroutine find_scales

  !> Bodies that press on each other, by the least of their numbers.
  pure subroutine find_groups(mesh, points, contact, group)
    type(mesh_t), intent(in) :: mesh
    type(contact_points_t), intent(in) :: points
    type(contact_fields_t), intent(in) :: contact
    integer, intent(out) :: group(0:)  !! (0:n_bodies)
    integer :: i, k, one, other

    group = [(i, i=0, mesh%n_bodies)]
    do i = 1, points%n
      if (.not. any(abs(contact%reaction(:, i)) > 0.0_wp)) cycle
      do k = contact%weights%first(i), contact%weights%first(i + 1) - 1
        one = group(mesh%body(points%node(i)))
        other = group(mesh%body(contact%weights%node(k)))
        if (min(one, other) == 0 .or. one == other) cycle
        where (group == max(one, other)) group = min(one, other)
      end do
    end do
  end subroutine find_groups

  !> The largest of each body's spread, as a length of its group.
  pure subroutine add_spread(mesh, u, group, length)
    type(mesh_t), intent(in) :: mesh
    real(wp), intent(in) :: u(:, :)            !! (3,n_nodes) [length]
    integer, intent(in) :: group(0:)           !! (0:n_bodies)
    real(wp), intent(inout) :: length(0:)      !! (0:n_bodies) [length]
    real(wp) :: spread(mesh%n_bodies)
    integer :: body

    spread = largest_spread(mesh, u)
    do body = 1, mesh%n_bodies
      length(group(body)) = max(length(group(body)), spread(body))
    end do
  end subroutine add_spread

  !> Displacements of bodies without the rigid motion that is closest to them; 0 of nodes that
  !> are no places.
  pure function deformation(mesh, u) result(rest)
    type(mesh_t), intent(in) :: mesh
    real(wp), intent(in) :: u(:, :)       !! (3,n_nodes) [length]
    real(wp) :: rest(3, size(u, 2))       !! [length]
    real(wp), dimension(3, 0:mesh%n_bodies) :: centre, mean, moment, turn
    real(wp) :: inertia(3, 3, 0:mesh%n_bodies), arm(3), trace
    real(wp) :: extent !! of all nodes: arms are measured by it, for their powers overflow [length]
    integer :: n(0:mesh%n_bodies), node, body, i

    centre = 0.0_wp
    mean = 0.0_wp
    moment = 0.0_wp
    turn = 0.0_wp
    inertia = 0.0_wp
    rest = 0.0_wp
    n = 0
    associate (x => mesh%coordinates(:, :shown_nodes(mesh)))
      extent = maxval(maxval(x, dim=2) - minval(x, dim=2))
    end associate
    if (.not. extent > 0.0_wp) extent = 1.0_wp
    do node = 1, shown_nodes(mesh)
      body = mesh%body(node)
      n(body) = n(body) + 1
      centre(:, body) = centre(:, body) + mesh%coordinates(:, node)
      mean(:, body) = mean(:, body) + u(:, node)
    end do
    do body = 0, mesh%n_bodies
      centre(:, body) = centre(:, body)/max(1, n(body))
      mean(:, body) = mean(:, body)/max(1, n(body))
    end do
    mean(:, 0) = 0.0_wp
    do node = 1, shown_nodes(mesh)
      body = mesh%body(node)
      arm = (mesh%coordinates(:, node) - centre(:, body))/extent
      moment(:, body) = moment(:, body) + cross(arm, u(:, node) - mean(:, body))
      do i = 1, 3
        inertia(i, i, body) = inertia(i, i, body) + dot_product(arm, arm)
        inertia(:, i, body) = inertia(:, i, body) - arm(i)*arm
      end do
    end do
    do body = 1, mesh%n_bodies
      trace = inertia(1, 1, body) + inertia(2, 2, body) + inertia(3, 3, body)
      if (determinant(inertia(:, :, body)) > flat*trace**3) turn(:, body) = &
        matmul(inverse(inertia(:, :, body)), moment(:, body))
    end do
    do node = 1, shown_nodes(mesh)
      body = mesh%body(node)
      arm = (mesh%coordinates(:, node) - centre(:, body))/extent
      rest(:, node) = u(:, node) - mean(:, body) - cross(turn(:, body), arm)
    end do
  end function deformation

  !> What bodies are deformed by between two places, beside the rigid motion, of any turn, that is
  !> closest to it; of nodes that are no places 0.
  pure function turned_deformation(mesh, before, after) result(rest)
    type(mesh_t), intent(in) :: mesh
    real(wp), intent(in) :: before(:, :), after(:, :) !! (3,n_nodes) [length]
    real(wp) :: rest(3, size(before, 2))              !! [length]
    real(wp), dimension(3, 0:mesh%n_bodies) :: from, to
    real(wp), dimension(3, 3, 0:mesh%n_bodies) :: product
    real(wp) :: extent(0:mesh%n_bodies)
    integer :: n(0:mesh%n_bodies), node, body

    rest = 0.0_wp
    from = 0.0_wp
    to = 0.0_wp
    product = 0.0_wp
    extent = 0.0_wp
    n = 0
    do node = 1, shown_nodes(mesh)
      body = mesh%body(node)
      n(body) = n(body) + 1
      from(:, body) = from(:, body) + before(:, node)
      to(:, body) = to(:, body) + after(:, node)
    end do
    do body = 0, mesh%n_bodies
      from(:, body) = from(:, body)/max(1, n(body))
      to(:, body) = to(:, body)/max(1, n(body))
    end do
    do node = 1, shown_nodes(mesh)
      body = mesh%body(node)
      extent(body) = max(extent(body), norm2(before(:, node) - from(:, body)))
    end do
    where (.not. extent > 0.0_wp) extent = 1.0_wp
    do node = 1, shown_nodes(mesh)
      body = mesh%body(node)
      product(:, :, body) = product(:, :, body) + spread((after(:, node) - to(:, body))/ &
        extent(body), 2, 3)*spread((before(:, node) - from(:, body))/extent(body), 1, 3)
    end do
    do body = 1, mesh%n_bodies
      product(:, :, body) = rotation_of(product(:, :, body))
    end do
    do node = 1, shown_nodes(mesh)
      body = mesh%body(node)
      if (body == 0) then
        rest(:, node) = after(:, node) - before(:, node)
      else
        rest(:, node) = after(:, node) - to(:, body) - matmul(product(:, :, body), &
          before(:, node) - from(:, body))
      end if
    end do
  end function turned_deformation

  !> The rotation of a polar decomposition, by Newton's iteration; none where the matrix has none.
  pure function rotation_of(matrix) result(r)
    real(wp), intent(in) :: matrix(3, 3)
    real(wp) :: r(3, 3), last(3, 3)
    integer :: i

    r = reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [3, 3])
    if (.not. determinant(matrix) > flat*norm2(matrix)**3) return
    r = matrix/norm2(matrix)
    do i = 1, 100
      last = r
      r = 0.5_wp*(r + transpose(inverse(r)))
      if (maxval(abs(r - last)) <= 4.0_wp*epsilon(1.0_wp)) exit
    end do
  end function rotation_of

end module certificate_scales_mod
