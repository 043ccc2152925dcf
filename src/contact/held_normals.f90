!> Contact points whose two sides cannot move apart along the normal: nothing presses there.
module held_normals_mod
  use kinds_mod, only: wp
  use text_mod, only: string_t, to_text
  use scene_mod, only: scene_t, pair_turns
  use contact_points_mod, only: contact_points_t
  use placement_mod, only: placement_t, place_undeformed
  use transfer_mod, only: movable, note_freedom, rows_of_points
  use step_loads_mod, only: prescribed_dofs
  implicit none
  private

  public :: held_normals, kept_overlaps

contains

  !> A line a pair that has such points: in which *STEP first, how many, and what that means.
  pure function held_normals(scene, points) result(lines)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(string_t), allocatable :: lines(:)
    type(string_t) :: line
    type(contact_points_t) :: points_of_step
    type(placement_t) :: free, placement !! with the freedom of all nodes, and that of a *STEP
    real(wp), parameter :: rounding = 1.0e-12_wp !! of the size of the coordinates: no overlap
    real(wp) :: overlap
    logical :: held(points%n)
    logical :: is_told(size(scene%pairs))
    integer :: row(3, points%n), step, pair, n

    allocate (lines(0))
    points_of_step = points
    if (allocated(points_of_step%freedom)) deallocate (points_of_step%freedom)
    call place_undeformed(scene, points_of_step, free)
    is_told = .false.
    do step = 1, size(scene%steps)
      call note_freedom(scene, prescribed_dofs(scene, step), points_of_step)
      placement = free
      if (allocated(points_of_step%freedom)) call place_undeformed(scene, points_of_step, placement)
      call rows_of_points(movable(scene, prescribed_dofs(scene, step)), points_of_step, &
        placement%weights, placement%frame, row)
      held = points%in_reach .and. (placement%is_fixed .or. placement%weights%covers .and. &
        row(1, :) == 0)
      ! The normals of an obstacle that turns do not stay what they are.
      do pair = 1, size(scene%pairs)
        if (pair_turns(scene, pair)) held(points%first(pair):points%first(pair + 1) - 1) = .false.
      end do
      do pair = 1, size(scene%pairs)
        associate (held_here => held(points%first(pair):points%first(pair + 1) - 1), &
                   gap => free%gap(points%first(pair):points%first(pair + 1) - 1))
          n = count(held_here)
          overlap = maxval(-gap, mask=held_here)
        end associate
        if (n == 0 .or. is_told(pair)) cycle
        is_told(pair) = .true.
        if (any(placement%is_fixed(points%first(pair):points%first(pair + 1) - 1))) then
          line%text = 'supports, constraints or common nodes keep both sides of '//to_text(n)// &
            ' points of '//scene%pairs(pair)%name//' from moving apart'
        else
          line%text = 'supports hold the normal of '//to_text(n)//' points of '// &
            scene%pairs(pair)%name
        end if
        line%text = 'step '//to_text(step)//': '//line%text
        line%text = line%text//': there is no reaction and no friction there'
        if (overlap > rounding*maxval(abs(scene%mesh%coordinates))) line%text = line%text// &
          '; their overlap of up to '//to_text(overlap, 4)//' is not carried'
        lines = [lines, line]
      end do
    end do
  end function held_normals

  !> A line a pair whose surfaces overlap where constraints keep them so.
  pure function kept_overlaps(scene, points) result(lines)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(string_t), allocatable :: lines(:)
    type(string_t) :: line
    real(wp), parameter :: rounding = 1.0e-12_wp !! of the size of the coordinates: no overlap
    real(wp) :: least
    integer :: pair, deepest

    allocate (lines(0))
    if (.not. allocated(points%uncarried)) return
    least = rounding*maxval(abs(scene%mesh%coordinates))
    do pair = 1, size(scene%pairs)
      associate (first => points%first(pair), last => points%first(pair + 1) - 1)
        if (.not. any(points%uncarried(first:last) > least)) cycle
        deepest = first - 1 + maxloc(points%uncarried(first:last), dim=1)
        line%text = 'constraints keep '//to_text(count(points%uncarried(first:last) > &
          least))//' points of '//scene%pairs(pair)%name//' in their master, by up to '// &
          to_text(points%uncarried(deepest), 3)//' (node '// &
          to_text(scene%mesh%node_id(points%node(deepest)))//'): this overlap is not carried'
        lines = [lines, line]
      end associate
    end do
  end function kept_overlaps

end module held_normals_mod
