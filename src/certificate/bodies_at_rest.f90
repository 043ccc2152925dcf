!> Bodies whose forces are all rounding, and how far rounding goes in gaps.
module bodies_at_rest_mod
  use kinds_mod, only: wp
  use mesh_mod, only: mesh_t
  use contact_points_mod, only: contact_points_t
  use increment_report_mod, only: contact_fields_t
  use increment_forces_mod, only: increment_forces_t
  use error_measures_mod, only: rounded
  use edge_middles_mod, only: edge_middles_t
  implicit none
  private

  public :: are_at_rest, are_carried, spread_of_row

contains

  !> Whether nothing acts on a body, and it has moved as a whole: all its forces are rounding, of
  !> displacements or, where it touches something, of places.
  !>
  !> By places no force of contact is moved further than they are rounded, so that forces have no
  !> more work than that in them: strain energy that is more comes from supports.
  pure function are_at_rest(mesh, points, contact, u, forces, pressed) result(at_rest)
    type(mesh_t), intent(in) :: mesh
    type(contact_points_t), intent(in) :: points
    type(contact_fields_t), intent(in) :: contact
    real(wp), intent(in) :: u(:, :)           !! (3,n_nodes) displacement [length]
    type(increment_forces_t), intent(in) :: forces
    real(wp), intent(in) :: pressed(:, :)     !! (3,n_nodes) [force]
    logical :: at_rest(0:mesh%n_bodies)       !! 0: nodes without a body, never
    real(wp) :: work(0:mesh%n_bodies)         !! of internal forces, less what rounding makes of it
    real(wp) :: largest_here
    logical :: by_places(0:mesh%n_bodies)     !! forces are more than displacements' rounding
    integer :: node

    at_rest = .true.
    at_rest(0) = .false.
    by_places = .false.
    work = -work_of_places(mesh, points, contact, forces)
    do node = 1, mesh%n_nodes
      associate (body => mesh%body(node), k => forces%stiffness(node))
        largest_here = max(norm2(forces%internal(:, node)), norm2(pressed(:, node)))
        if (any(abs(forces%external(:, node)) > 0.0_wp) .or. largest_here > &
          forces%rounding(node) + k*forces%rounding_of_gaps) at_rest(body) = .false.
        if (largest_here > forces%rounding(node)) by_places(body) = .true.
        work(body) = work(body) + dot_product(u(:, node), forces%internal(:, node)) - rounded* &
          norm2(u(:, node))*norm2(forces%internal(:, node))
        if (k > 0.0_wp) work(body) = work(body) - forces%rounding(node)*(forces%rounding(node)/k)
      end associate
    end do
    where (by_places .and. work > 0.0_wp) at_rest = .false.
  end function are_at_rest

  !> Bodies that are rigid as far as their forces show: those of elements are all rounding, and
  !> nothing else acts but on nodes that supports or constraints carry. Forces on these are no
  !> smaller for it.
  pure function are_carried(mesh, forces, pressed) result(are)
    type(mesh_t), intent(in) :: mesh
    type(increment_forces_t), intent(in) :: forces
    real(wp), intent(in) :: pressed(:, :)     !! (3,n_nodes) [force]
    logical :: are(0:mesh%n_bodies)           !! 0: nodes without a body, never
    logical :: is_carried(3, mesh%n_nodes)
    integer :: node, c

    are = .true.
    are(0) = .false.
    is_carried = forces%prescribed
    associate (all => forces%constraints)
      do c = 1, all%n
        is_carried(all%dof(c), all%node(c)) = .true.
      end do
    end associate
    do node = 1, mesh%n_nodes
      ! Nodes without elements have loads alone, which constraints hand on.
      if (.not. forces%stiffness(node) > 0.0_wp) cycle
      associate (body => mesh%body(node), acting => merge(0.0_wp, abs(pressed(:, node)) + &
                 abs(forces%external(:, node)), is_carried(:, node)))
        are(body) = are(body) .and. norm2(forces%internal(:, node)) <= forces%rounding(node) .and. &
          maxval(acting) <= rounded*(norm2(pressed(:, node)) + norm2(forces%external(:, node)))
      end associate
    end do
  end function are_carried

  !> The work of the forces of contact along what places are rounded by, on each body.
  pure function work_of_places(mesh, points, contact, forces) result(work)
    type(mesh_t), intent(in) :: mesh
    type(contact_points_t), intent(in) :: points
    type(contact_fields_t), intent(in) :: contact
    type(increment_forces_t), intent(in) :: forces
    real(wp) :: work(0:mesh%n_bodies) !! 0: on nodes without a body [energy]
    real(wp) :: of_point
    integer :: i, k

    work = 0.0_wp
    do i = 1, points%n
      of_point = norm2(contact%reaction(:, i))*forces%rounding_of_gaps*spread_of_row(contact, &
        forces%middles, i)
      associate (slave => work(mesh%body(points%node(i))))
        slave = slave + of_point
      end associate
      do k = contact%weights%first(i), contact%weights%first(i + 1) - 1
        associate (master => work(mesh%body(contact%weights%node(k))))
          master = master + abs(contact%weights%weight(k))*of_point
        end associate
      end do
    end do
  end function work_of_places

  !> By what rounding of places grows in the gap of a point: before an obstacle by nothing, or by
  !> what the ends of its edge have part in it, before a
  !> surface by what its weights add up to, and by the integrals that they are made of.
  pure real(wp) function spread_of_row(contact, middles, i) result(factor)
    type(contact_fields_t), intent(in) :: contact
    type(edge_middles_t), intent(in) :: middles
    integer, intent(in) :: i !! point

    factor = 1.0_wp
    if (middles%is_any) factor = (1.0_wp + 2.0_wp*middles%a(i))/(1.0_wp - 2.0_wp*middles%a(i))
    associate (first => contact%weights%first(i), last => contact%weights%first(i + 1) - 1)
      if (last > first) factor = 4.0_wp*(1.0_wp + sum(abs(contact%weights%weight(first:last))))
    end associate
  end function spread_of_row

end module bodies_at_rest_mod
