!> What dual multipliers make of the overlaps of a slave face: the weights of the master's nodes in
!> the rows of the face's nodes. docs/theory.md (11.2) to (11.4), (11.21).
module dual_weights_mod
  use kinds_mod, only: wp
  use cells_mod, only: face_corners, face_nodes
  use small_matrix_mod, only: solve_small
  use face_overlap_mod, only: overlap_t, weigh
  use surface_reach_mod, only: share_of_sight, straightness
  use curved_overlap_mod, only: whole_face_t, whole_face, find_curved_overlap, patch_t, &
    make_patch, values_at_nodes
  use mortar_rows_mod, only: mortar_t, aslant, enough_of_second_order
  use weight_rows_mod, only: entries_t, append_entry
  use slave_face_mod, only: face_t, share_with_ends, take_from_ends, append_place, &
    whole_area_of
  use covering_parts_mod, only: part_t
  implicit none
  private

  public :: add_face

  real(wp), parameter :: half = 0.5_wp !! of a face: with less functions are hard to tell apart [-]
  real(wp), parameter :: in_part = 0.1_wp !! of a face: bare all the way [-]
  real(wp), parameter :: least_cover = 1.0e-9_wp !! of a face; less has lost its digits [-]

contains

  !> Add what covers a slave face to the rows of its nodes, not yet divided by their areas; of a
  !> master that moves as one what they are apart from it, and of its nodes no weights.
  pure subroutine add_face(face, x, parts, makes_rows, is_plain, mortar, entries)
    type(face_t), intent(in) :: face
    real(wp), intent(in) :: x(:, :)       !! (3,n_nodes) [length]
    type(part_t), intent(in) :: parts(:)
    logical, intent(in) :: makes_rows
    logical, intent(in) :: is_plain
    !! rows may stand for places of other nodes: where the master covers a part of the face
    type(mortar_t), intent(inout) :: mortar
    type(entries_t), intent(inout) :: entries
    type(overlap_t) :: overlap
    real(wp), dimension(face%n) :: lumped, unit
    real(wp), dimension(face%n, face%n) :: mass, dual, shared, identity
    real(wp) :: part_of(face%n, face_nodes), q(3, face%n)
    real(wp) :: straight(size(parts)), opposed, plain, whole
    integer :: a, b, i, k
    real(wp) :: values(face%n, face_nodes, size(parts))
    logical :: regular, is_extrapolated

    if (size(parts) == 0) return
    lumped = 0.0_wp
    mass = 0.0_wp
    opposed = 0.0_wp
    associate (n => face%n)
      do i = 1, size(parts)
        lumped = lumped + parts(i)%overlap%lumped(:n)
        mass = mass + parts(i)%overlap%mass(:n, :n)
        straight(i) = straightness(parts(i)%cosine)
        opposed = opposed + straight(i)*sum(parts(i)%overlap%lumped(:n))
      end do
      if (sum(lumped) < least_cover*face%area) return
      call share_with_ends(face, lumped)
      do a = 1, n
        call share_with_ends(face, mass(:, a))
      end do
      do a = 1, n
        call share_with_ends(face, mass(a, :))
      end do
      identity = 0.0_wp
      do a = 1, n
        identity(a, a) = 1.0_wp
      end do
      plain = 0.0_wp
      whole = face%breadth*whole_area_of(face)
      if (n == face_nodes) then
        ! Functions of eight nodes are below 0 over half of a face: a bare part counts as leaning.
        straight = min(straight, straight*sum(lumped)/whole)
      else if (is_plain) then
        plain = part_of_plain(opposed, sum(lumped), whole)
      end if
      ! Dual functions of a part have two signs, with mid-side nodes wildly so.
      if (n > face_corners .and. plain < 1.0_wp .and. sum(lumped) < (1.0_wp - in_part)*whole) then
        mortar%least(face%row(:n)) = enough_of_second_order
      end if
      is_extrapolated = n > face_corners .and. sum(lumped) < half*face%area .and. plain < 1.0_wp
      dual = identity
      if (is_extrapolated) then
        call extrapolate(face, x, parts, values, regular)
        if (.not. regular) return
      else if (plain < 1.0_wp) then
        do a = 1, n
          unit = identity(:, a)
          call solve_small(mass, unit, dual(:, a), regular) ! symmetric: columns are rows
          if (.not. regular) return
          dual(:, a) = plain*identity(:, a) + (1.0_wp - plain)*lumped(a)*dual(:, a)
        end do
      end if
    end associate
    q = face%x(:, :face%n)
    call take_from_ends(face, q)
    associate (n => face%n, row => face%row(:face%n))
      dual = matmul(dual, transpose(face%given(:n, :n)))
      shared = plain*mass
      do a = 1, n
        shared(a, a) = shared(a, a) + (1.0_wp - plain)*lumped(a)
      end do
      shared = matmul(face%given(:n, :n), shared)
      mortar%area(row) = mortar%area(row) + sum(shared, dim=2)
      do a = 1, n
        do b = 1, n
          if (a == b .or. .not. abs(shared(b, a)) > 0.0_wp) cycle
          ! The row of `b` stands for the place of `a`, too.
          call append_place(face, row(b), b, shared(b, a), entries)
          call append_place(face, row(b), a, -shared(b, a), entries)
        end do
        if (makes_rows) cycle
        mortar%apart(:, row(a)) = mortar%apart(:, row(a)) + matmul(q, shared(a, :))
      end do
      do i = 1, size(parts)
        overlap = parts(i)%overlap
        call share_with_ends(face, overlap%entered(:n))
        do k = 1, 3
          call share_with_ends(face, overlap%facing(k, :n))
        end do
        do k = 1, parts(i)%n
          call share_with_ends(face, overlap%mixed(:n, k))
        end do
        call share_with_ends(face, overlap%lumped(:n))
        mortar%opposed_area(row) = mortar%opposed_area(row) + straight(i)* &
          matmul(face%given(:n, :n), overlap%lumped(:n))
        if (is_extrapolated) then
          do k = 1, parts(i)%n
            part_of(:, k) = matmul(face%given(:n, :n), plain*overlap%mixed(:n, k) + (1.0_wp - &
              plain)*lumped*values(:, k, i))
          end do
        else
          part_of(:, :parts(i)%n) = matmul(transpose(dual), overlap%mixed(:n, :parts(i)%n))
        end if
        mortar%nearest(row) = min(mortar%nearest(row), overlap%nearest)
        mortar%least_gap(row) = min(mortar%least_gap(row), overlap%least_gap)
        mortar%entered(row) = mortar%entered(row) + overlap%entered(:n)
        mortar%normal(:, row) = mortar%normal(:, row) + matmul(overlap%facing(:, :n), &
          transpose(face%given(:n, :n)))
        do k = 1, parts(i)%n
          do a = 1, n
            if (makes_rows) then
              call append_entry(row(a), parts(i)%node(k), part_of(a, k), entries)
            else
              mortar%apart(:, row(a)) = mortar%apart(:, row(a)) - part_of(a, k)* &
                x(:, parts(i)%node(k))
            end if
          end do
        end do
      end do
    end associate
  end subroutine add_face

  !> How much of the functions of a face are its shape functions, the rest dual: none where the
  !> master covers all of it, all where a tenth is bare; none, too, where a twentieth of what is
  !> covered leans, for means of such faces are no gaps of their edges. docs/theory.md (11.32).
  pure real(wp) function part_of_plain(opposed, covered, whole) result(part)
    real(wp), intent(in) :: opposed, covered, whole !! of the face [length^2]
    real(wp), parameter :: missed = 0.02_wp
    !! coarse curved faces miss some 0.004 of what covers them [-]

    part = max(0.0_wp, min(1.0_wp, (1.0_wp - covered/whole - missed)/(in_part - missed)))
    ! What leans by rounding does not lean.
    part = part*max(0.0_wp, min(1.0_wp, (1.0_wp - (1.0_wp - opposed/covered)/aslant)/0.9_wp))
  end function part_of_plain

  !> M^-1 int N~ N_k of (11.21), where less than half of the face is covered: values at its points
  !> of the polynomial that comes closest to the master's function over what is covered.
  !>
  !> Shape functions of the whole face nearly depend on each other over a narrow strip; polynomials
  !> in the strip's own coordinates do not.
  pure subroutine extrapolate(face, x, parts, values, regular)
    type(face_t), intent(in) :: face
    real(wp), intent(in) :: x(:, :)             !! (3,n_nodes) [length]
    type(part_t), intent(in) :: parts(:)
    real(wp), intent(out) :: values(:, :, :)    !! (n,8,n_parts) [-]
    logical, intent(out) :: regular             !! false: the strip is too narrow even for these
    type(patch_t) :: patch
    type(overlap_t) :: overlap(size(parts))
    type(whole_face_t) :: slave
    real(wp), dimension(face%n, face%n) :: mass, at_points, fit
    real(wp) :: moments(6)
    integer :: i, a

    values = 0.0_wp
    moments = 0.0_wp
    do i = 1, size(parts)
      moments = moments + parts(i)%overlap%moments
    end do
    slave = whole_face(face%x(:, :face%n))
    patch = make_patch(face%n, moments)
    mass = 0.0_wp
    do i = 1, size(parts)
      associate (part => parts(i))
        overlap(i) = find_curved_overlap(part%plane, slave, whole_face(x(:, &
          part%node(:part%n))), part%seen, patch)
        call weigh(share_of_sight(part%cosine), overlap(i))
      end associate
      mass = mass + overlap(i)%mass(:face%n, :face%n)
    end do
    at_points = values_at_nodes(face%n, patch)
    call take_from_ends(face, at_points)
    do a = 1, face%n
      call solve_small(mass, at_points(:, a), fit(:, a), regular)
      if (.not. regular) return
    end do
    do i = 1, size(parts)
      values(:, :parts(i)%n, i) = matmul(transpose(fit), overlap(i)%mixed(:face%n, :parts(i)%n))
    end do
  end subroutine extrapolate

end module dual_weights_mod
