!> Rows of slave nodes that hang: they go to the nodes that these lie between.
module hanging_rows_mod
  use kinds_mod, only: wp
  use cells_mod, only: face_corners
  use mortar_rows_mod, only: mortar_t, slave_t
  use weight_rows_mod, only: entries_t, append_entry
  implicit none
  private

  public :: fold_rows

contains

  !> Share the contributions of each hanging node equally among the nodes between which it lies.
  !> These then stand for their own place and for those of hanging nodes, by what they have of each.
  pure subroutine fold_rows(slave, number, mortar, entries)
    type(slave_t), intent(in) :: slave   !! with nodes that hang
    integer, intent(in) :: number(:)     !! (n_nodes) rows of the surface's
    type(mortar_t), intent(inout) :: mortar
    type(entries_t), intent(inout) :: entries
    integer, dimension(face_corners, size(mortar%area)) :: rows, between
    !! those nodes, and their numbers
    integer :: n(size(mortar%area)), n_entries, own, node, h, i, k
    logical :: takes(face_corners)
    real(wp) :: part

    n = 0
    do h = 1, size(slave%hanging, 2)
      associate (nodes => slave%hanging(2:, h))
        own = number(slave%hanging(1, h))
        takes = nodes > 0
        if (allocated(slave%is_fixed)) takes = takes .and. .not. slave%is_fixed(number(max(1, &
          nodes)))
        ! Where none has a multiplier what the node has is left out with theirs.
        if (.not. any(takes)) takes = nodes > 0
        n(own) = count(takes)
        between(:n(own), own) = pack(nodes, takes)
        rows(:n(own), own) = number(between(:n(own), own))
      end associate
    end do
    n_entries = entries%n
    do i = 1, n_entries
      own = entries%list(i)%row
      if (n(own) == 0) cycle
      node = entries%list(i)%node
      part = entries%list(i)%weight/real(n(own), wp)
      entries%list(i)%weight = part
      entries%list(i)%row = rows(1, own)
      do k = 2, n(own)
        call append_entry(rows(k, own), node, part, entries)
      end do
    end do
    do h = 1, size(slave%hanging, 2)
      own = number(slave%hanging(1, h))
      part = 1.0_wp/real(n(own), wp)
      do k = 1, n(own)
        associate (row => rows(k, own))
          mortar%outward(:, row) = mortar%outward(:, row) + part*mortar%outward(:, own)
          mortar%whole_area(row) = mortar%whole_area(row) + part*mortar%whole_area(own)
          mortar%area(row) = mortar%area(row) + part*mortar%area(own)
          mortar%opposed_area(row) = mortar%opposed_area(row) + part*mortar%opposed_area(own)
          mortar%nearest(row) = min(mortar%nearest(row), mortar%nearest(own))
          mortar%normal(:, row) = mortar%normal(:, row) + part*mortar%normal(:, own)
          mortar%apart(:, row) = mortar%apart(:, row) + part*mortar%apart(:, own)
          mortar%least_gap(row) = min(mortar%least_gap(row), mortar%least_gap(own))
          mortar%entered(row) = mortar%entered(row) + part*mortar%entered(own)
          if (.not. mortar%area(own) > 0.0_wp) cycle
          call append_entry(row, between(k, own), part*mortar%area(own), entries)
          call append_entry(row, slave%hanging(1, h), -part*mortar%area(own), entries)
        end associate
      end do
      mortar%area(own) = 0.0_wp
      mortar%whole_area(own) = 0.0_wp
      mortar%normal(:, own) = 0.0_wp
      mortar%apart(:, own) = 0.0_wp
      mortar%least_gap(own) = huge(1.0_wp)
      mortar%entered(own) = 0.0_wp
    end do
  end subroutine fold_rows

end module hanging_rows_mod
