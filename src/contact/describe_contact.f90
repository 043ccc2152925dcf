!> The contact results of an increment: gaps, slips, reactions and status of every point, from its
!> final displacements and reactions.
module describe_contact_mod
  use kinds_mod, only: wp
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t, is_covered
  use state_mod, only: state_t
  use increment_report_mod, only: contact_fields_t, status_open, status_stick, &
    status_slide
  use friction_laws_mod, only: largest_friction
  use problem_mod, only: natural_map
  use placement_mod, only: placement_t, no_gap, place, find_partly_covered
  use transfer_mod, only: relative_motion, gap_at
  use condensed_contact_mod, only: condensed_contact_t, contact_group_t
  use dependent_rows_mod, only: redundant_points
  implicit none
  private

  public :: describe_contact, find_redundant

contains

  !> Gaps, slips, reactions and status from the final displacements.
  pure subroutine describe_contact(scene, points, condensed, undeformed, placement, old, new, &
    contact)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(condensed_contact_t), intent(in) :: condensed
    type(placement_t), intent(in) :: undeformed, placement
    type(state_t), intent(in) :: old, new
    type(contact_fields_t), intent(out) :: contact
    logical :: has_rows(points%n)
    integer :: i

    contact%frame = placement%frame
    contact%weights = placement%weights
    contact%covered_area = placement%covered_area
    contact%is_partly_covered = find_partly_covered(points, placement)
    contact%least_gap = placement%least_gap
    contact%unplaced_gap = placement%unplaced_gap
    contact%entered = placement%entered
    contact%apart = placement%apart
    allocate (contact%reaction(3, points%n), contact%gap(points%n), contact%slip_increment(2, &
      points%n))
    allocate (contact%status(points%n), source=status_open)
    allocate (contact%stays(points%n), source=.false.)
    do i = 1, points%n
      contact%slip_increment(:, i) = matmul( &
        relative_motion(points, placement%weights, i, new%displacement) - &
        relative_motion(points, placement%weights, i, old%displacement) + placement%drag(:, i), &
        contact%frame(:, 2:, i))
      contact%gap(i) = gap_at(placement, points, i, new%displacement)
      if (.not. is_covered(points, placement%weights, i)) then
        contact%gap(i) = no_gap
        if (placement%driven_in(i) > 0.0_wp) contact%gap(i) = -placement%driven_in(i)
        contact%slip_increment(:, i) = 0.0_wp
      end if
      if (.not. points%on_surface(i)) then
        contact%least_gap(i) = contact%gap(i)
      else if (is_covered(points, placement%weights, i)) then
        contact%least_gap(i) = contact%least_gap(i) + (contact%gap(i) - placement%gap(i))
      end if
      contact%reaction(:, i) = matmul(new%reaction(:, i), contact%frame(:, :, i))
    end do
    call find_gaps_of_small_sliding(scene, points, placement, new%displacement, contact)
    has_rows = .not. points%in_reach
    do i = 1, size(condensed%group)
      call find_status(condensed%group(i), contact)
      has_rows(condensed%group(i)%active) = .true.
      has_rows(condensed%group(i)%far) = .true.
    end do
    contact%kept_overlap = merge(0.0_wp, max(0.0_wp, -undeformed%gap), has_rows)
  end subroutine describe_contact

  !> Least gaps with small sliding: each place of a face keeps the one that it faces in the
  !> undeformed mesh, and parts from it by the relative displacement there.
  pure subroutine find_gaps_of_small_sliding(scene, points, placement, u, contact)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(placement_t), intent(in) :: placement
    real(wp), intent(in) :: u(:, :) !! (3,n_nodes) [length]
    type(contact_fields_t), intent(inout) :: contact
    type(placement_t) :: there
    integer :: pair

    if (.not. any(scene%pairs%small_sliding .and. scene%pairs%master == 0)) return
    there = placement
    do pair = 1, size(scene%pairs)
      associate (of => scene%pairs(pair), first => points%first(pair), &
                 last => points%first(pair + 1) - 1)
        if (of%master > 0 .or. .not. of%small_sliding) cycle
        call place(scene, points, pair, u, there)
        contact%least_gap(first:last) = there%least_gap(first:last)
        contact%unplaced_gap(first:last) = there%unplaced_gap(first:last)
      end associate
    end do
  end subroutine find_gaps_of_small_sliding

  !> The points whose reactions are not determined: what touches nearly is taken to touch.
  subroutine find_redundant(condensed, slack, contact)
    type(condensed_contact_t), intent(in) :: condensed
    real(wp), intent(in) :: slack  !! gap that counts as none [length]
    type(contact_fields_t), intent(inout) :: contact
    integer :: i

    do i = 1, size(condensed%group)
      associate (group => condensed%group(i))
        if (.not. allocated(group%null)) cycle
        if (size(group%null, 2) == 0) cycle
        if (.not. allocated(contact%is_redundant)) allocate (contact%is_redundant(size( &
          contact%gap)), source=.false.)
        contact%is_redundant(group%active) = redundant_points(group%problem%row, group%null, &
          contact%gap(group%active) <= slack .or. contact%reaction(1, group%active) > 0.0_wp)
      end associate
    end do
  end subroutine find_redundant

  !> The status of the points of a group: the branch of Coulomb's law that each is on. A point with
  !> a reaction is not open, even where rounding of the gap puts it there; nor is one that stays
  !> closed, which slides where it pulls.
  pure subroutine find_status(group, contact)
    type(contact_group_t), intent(in) :: group
    type(contact_fields_t), intent(inout) :: contact
    real(wp) :: z(3, size(group%active)), x(3, size(group%active))
    real(wp) :: radius, slope
    integer :: status(size(group%active)), i

    x(1, :) = contact%gap(group%active)
    x(2:, :) = contact%slip_increment(:, group%active)
    associate (r => contact%reaction(:, group%active))
      call natural_map(group%problem, x, r, z, status)
      do i = 1, size(status)
        if (status(i) /= status_open .or. .not. r(1, i) > 0.0_wp) cycle
        call largest_friction(group%problem%mu(i), group%problem%law, i, r(1, i), radius, slope)
        status(i) = merge(status_stick, status_slide, norm2(r(2:, i)) < radius)
      end do
    end associate
    where (status == status_open .and. group%problem%stays) status = status_slide
    where (status /= status_open .and. group%problem%mu <= 0.0_wp) status = status_slide
    contact%status(group%active) = status
    contact%stays(group%active) = group%problem%stays
  end subroutine find_status

end module describe_contact_mod
