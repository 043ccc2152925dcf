!> A face of a slave surface: where its points are, and what of its shape functions they have. A
!> node in the middle of an edge shares with the ends of the edge, docs/theory.md (9.11), (9.12).
module slave_face_mod
  use kinds_mod, only: wp
  use cells_mod, only: face_corners, face_nodes
  use face_shapes_mod, only: face_rule_t, rule_of, face_functions, face_gradients
  use small_matrix_mod, only: cross
  use face_overlap_mod, only: plane_t, areas_of_nodes, plane_of_face
  use mortar_rows_mod, only: mortar_t, slave_t
  use weight_rows_mod, only: entries_t, append_entry
  implicit none
  private

  public :: face_t, what_neighbours_get, add_whole, whole_area_of, share_with_ends, &
    take_from_ends, append_place

  !> A slave face.
  type :: face_t
    integer :: n = 0                               !! nodes
    integer :: node(face_nodes) = 0
    integer :: row(face_nodes) = 0                 !! of the nodes
    integer :: part(face_corners) = 0              !! corners of the part that is looked at
    real(wp) :: x(3, face_nodes) = 0.0_wp          !! where they are [length]
    real(wp) :: alpha(face_nodes) = 0.0_wp
    !! of a node in the middle of an edge the part of the ends in its point, (9.11); else 0 [-]
    real(wp) :: area = 0.0_wp                      !! [length^2]
    real(wp) :: breadth = 1.0_wp                   !! as of slave_t [-]
    real(wp) :: given(face_nodes, face_nodes) = 0.0_wp !! as of `what_neighbours_get` [-]
  end type face_t

contains

  !> What each node of a face gets of the multipliers: its own, and those of neighbours that have
  !> none. All then still add up to 1 all over the face, so that a uniform pressure reaches its
  !> edge. docs/theory.md (11.17).
  pure function what_neighbours_get(slave, row) result(given)
    type(slave_t), intent(in) :: slave
    integer, intent(in) :: row(:)         !! of the face's nodes
    real(wp) :: given(face_nodes, face_nodes)
    !! (by, of); columns add up to 1, or 0: there is nobody
    logical :: has_none(size(row)), is_taker(size(row))
    integer :: around(size(row)), a, k, n

    n = size(row)
    around = [(a, a=1, n)]
    ! Along the edges from corner to corner.
    if (n > face_corners) around = [((a + n/2*(k - 1), k=1, 2), a=1, n/2)]
    has_none = .false.
    if (allocated(slave%is_fixed)) has_none = slave%is_fixed(row(around))
    given = 0.0_wp
    do a = 1, n
      is_taker = .false.
      is_taker(a) = .true.
      if (has_none(a)) then
        is_taker = cshift(is_taker, 1) .or. cshift(is_taker, -1)
        if (all(has_none .or. .not. is_taker)) is_taker = .true.
        is_taker = is_taker .and. .not. has_none
      end if
      given(around, around(a)) = merge(1.0_wp/real(max(1, count(is_taker)), wp), 0.0_wp, is_taker)
    end do
  end function what_neighbours_get

  !> Add a slave face to the whole areas and the normals of its nodes.
  pure subroutine add_whole(face, plane, mortar)
    type(face_t), intent(in) :: face
    type(plane_t), intent(in) :: plane    !! of a face without mid-side nodes
    type(mortar_t), intent(inout) :: mortar
    type(face_rule_t) :: rule
    real(wp) :: outward(3, face%n), area(face%n), tangent(3, 2), normal(3)
    integer :: i, a

    associate (n => face%n, row => face%row(:face%n))
      if (n <= face_corners) then
        area = areas_of_nodes(plane)
        outward = spread(plane%axis(:, 3), 2, n)*spread(area, 1, 3)
        call add_to_rows(face, area, outward, mortar)
        return
      end if
      outward = 0.0_wp
      area = 0.0_wp
      rule = rule_of(n)
      do i = 1, rule%n
        tangent = matmul(face%x(:, :n), transpose(face_gradients(n, rule%point(:, i))))
        normal = rule%weight(i)*cross(tangent(:, 1), tangent(:, 2))
        associate (functions => face_functions(n, rule%point(:, i)))
          area = area + norm2(normal)*functions
          do a = 1, n
            outward(:, a) = outward(:, a) + functions(a)*normal
          end do
        end associate
      end do
      call share_with_ends(face, area)
      do i = 1, 3
        call share_with_ends(face, outward(i, :))
      end do
      call add_to_rows(face, area, outward, mortar)
    end associate
  end subroutine add_whole

  !> The area of a face, of one without mid-side nodes in its plane.
  pure real(wp) function whole_area_of(face) result(area)
    type(face_t), intent(in) :: face
    type(face_rule_t) :: rule
    real(wp) :: tangent(3, 2)
    integer :: i

    associate (x => face%x(:, :face%n))
      if (face%n <= face_corners) then
        area = sum(areas_of_nodes(plane_of_face(x)))
        return
      end if
      area = 0.0_wp
      rule = rule_of(face%n)
      do i = 1, rule%n
        tangent = matmul(x, transpose(face_gradients(face%n, rule%point(:, i))))
        area = area + rule%weight(i)*norm2(cross(tangent(:, 1), tangent(:, 2)))
      end do
    end associate
  end function whole_area_of

  !> Neighbours of nodes without a multiplier have what these have; such nodes keep their normals.
  pure subroutine add_to_rows(face, area, outward, mortar)
    type(face_t), intent(in) :: face
    real(wp), intent(in) :: area(:)       !! (n) of the nodes of the face [length^2]
    real(wp), intent(in) :: outward(:, :) !! (3,n) [length^2]
    type(mortar_t), intent(inout) :: mortar
    real(wp) :: given(face%n, face%n)
    integer :: a

    associate (row => face%row(:face%n))
      given = face%given(:face%n, :face%n)
      mortar%whole_area(row) = mortar%whole_area(row) + matmul(given, area)
      do a = 1, face%n
        if (.not. any(given(a, :) > 0.0_wp)) given(a, a) = 1.0_wp
      end do
      mortar%outward(:, row) = mortar%outward(:, row) + matmul(outward, transpose(given))
    end associate
  end subroutine add_to_rows

  !> What shape functions have becomes what those of the points have: a node in the middle of an
  !> edge gives alpha of its own to each end. docs/theory.md (9.12).
  pure subroutine share_with_ends(face, of_functions)
    type(face_t), intent(in) :: face
    real(wp), intent(inout) :: of_functions(:) !! (n) of the nodes of the face
    integer :: k, corners

    corners = face%n/2
    if (face%n <= face_corners) return
    do k = 1, corners
      associate (middle => of_functions(corners + k), ends => [k, 1 + modulo(k, corners)], &
                 alpha => face%alpha(corners + k))
        of_functions(ends) = of_functions(ends) + alpha*middle
        middle = (1.0_wp - 2.0_wp*alpha)*middle
      end associate
    end do
  end subroutine share_with_ends

  !> What nodes have becomes what the points have. docs/theory.md (9.11).
  pure subroutine take_from_ends(face, values)
    type(face_t), intent(in) :: face
    real(wp), intent(inout) :: values(:, :) !! (m,n) of the nodes of the face
    integer :: k, corners

    if (face%n <= face_corners) return
    corners = face%n/2
    do k = 1, corners
      associate (alpha => face%alpha(corners + k), of_middle => values(:, corners + k))
        of_middle = (of_middle - alpha*(values(:, k) + values(:, 1 + modulo(k, corners))))/ &
          (1.0_wp - 2.0_wp*alpha)
      end associate
    end do
  end subroutine take_from_ends

  !> Append the place of a point of a face: of one in the middle of an edge that of three nodes.
  pure subroutine append_place(face, row, a, weight, entries)
    type(face_t), intent(in) :: face
    integer, intent(in) :: row
    integer, intent(in) :: a         !! number of its node in the face
    real(wp), intent(in) :: weight   !! [length^2]
    type(entries_t), intent(inout) :: entries
    real(wp) :: own
    integer :: corners

    own = weight/(1.0_wp - 2.0_wp*face%alpha(a))
    call append_entry(row, face%node(a), own, entries)
    if (.not. face%alpha(a) > 0.0_wp) return
    corners = face%n/2
    call append_entry(row, face%node(a - corners), -face%alpha(a)*own, entries)
    call append_entry(row, face%node(1 + modulo(a - corners, corners)), -face%alpha(a)*own, entries)
  end subroutine append_place

end module slave_face_mod
