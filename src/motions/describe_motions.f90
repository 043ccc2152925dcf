!> Rigid motions in words: which nothing holds, which nothing balances.
module describe_motions_mod
  use kinds_mod, only: wp
  use text_mod, only: to_text
  use dense_mod, only: singular_values, null_space
  use mesh_mod, only: mesh_t, shown_nodes
  use rigid_modes_mod, only: free_motions_t, is_joined
  implicit none
  private

  public :: free_in_words, unresisted_part, motion_in_words, body_in_words, motions_together

  real(wp), parameter :: unresisted = 1.0e-8_wp !! of the largest singular value
  real(wp), parameter :: small = 1.0e-6_wp      !! rounding, of a space of motions
  real(wp), parameter :: minor = 0.1_wp         !! of one motion: not worth naming

contains

  !> The motions that nothing which resists sees, body by body.
  subroutine free_in_words(mesh, motions, stiff, n_free, words)
    type(mesh_t), intent(in) :: mesh
    type(free_motions_t), intent(in) :: motions
    real(wp), intent(in) :: stiff(:, :)  !! (m,n) what the motions do where there is resistance [-]
    integer, intent(out) :: n_free
    character(:), allocatable, intent(out) :: words

    associate (free => null_space(stiff, unresisted))
      n_free = size(free, 2)
      words = span_of_bodies(mesh, motions, free, small)
    end associate
  end subroutine free_in_words

  !> The part of a combination of motions that nothing resists; all of it where there is none.
  function unresisted_part(stiff, coefficient) result(part)
    real(wp), intent(in) :: stiff(:, :)  !! (m,n) what the motions do where there is resistance [-]
    real(wp), intent(in) :: coefficient(:)     !! (n) of each motion
    real(wp) :: part(size(coefficient))

    associate (free => null_space(stiff, unresisted))
      part = matmul(free, matmul(coefficient, free))
    end associate
    if (norm2(part) <= small*norm2(coefficient)) part = coefficient
  end function unresisted_part

  !> A combination of the motions, body by body: what matters of it.
  function motion_in_words(mesh, motions, coefficient) result(words)
    type(mesh_t), intent(in) :: mesh
    type(free_motions_t), intent(in) :: motions
    real(wp), intent(in) :: coefficient(:) !! (n) of each motion
    character(:), allocatable :: words

    words = span_of_bodies(mesh, motions, reshape(coefficient, [size(coefficient), 1]), minor)
  end function motion_in_words

  !> Combinations of motions of several bodies may be coupled; each body's part of them is named,
  !> and of a body that equations join that of each of its pieces.
  function span_of_bodies(mesh, motions, coefficients, least) result(words)
    type(mesh_t), intent(in) :: mesh
    type(free_motions_t), intent(in) :: motions
    real(wp), intent(in) :: coefficients(:, :) !! (n,k) of each motion in each combination
    real(wp), intent(in) :: least        !! part of the largest that is worth naming [-]
    character(:), allocatable :: words
    real(wp) :: six(6, size(coefficients, 2)), all_of_it(size(coefficients, 2))
    integer :: first, last, k, n, node
    logical, allocatable :: done(:) !! (n_pieces)

    words = ''
    all_of_it = norm2(coefficients, dim=1)
    first = 1
    do while (first <= motions%n)
      last = first + motions_together(motions, first) - 1
      if (is_joined(motions, motions%body(first))) then
        allocate (done(size(motions%piece_extent)), source=.false.)
        do node = 1, shown_nodes(mesh)
          if (mesh%body(node) /= motions%body(first)) cycle
          if (done(motions%piece(node))) cycle
          done(motions%piece(node)) = .true.
          call add_piece(node)
        end do
        deallocate (done)
        first = last + 1
        cycle
      end if
      n = 0
      do k = 1, size(coefficients, 2)
        if (norm2(coefficients(first:last, k)) <= least*all_of_it(k)) cycle
        n = n + 1
        six(:, n) = twist_of(motions, 0, first, last, coefficients(first:last, k))
        where (abs(six(:, n)) <= least*maxval(abs(six(:, n)))) six(:, n) = 0.0_wp
      end do
      if (n > 0) call append(words, body_in_words(mesh, motions, first)//': '// &
        span_in_words(six(:, :n)))
      first = last + 1
    end do

  contains

    !> What moves the piece that a node belongs to.
    subroutine add_piece(node)
      integer, intent(in) :: node
      real(wp) :: farthest

      n = 0
      do k = 1, size(coefficients, 2)
        farthest = norm2(coefficients(first:last, k))
        if (farthest <= least*all_of_it(k)) cycle
        six(:, n + 1) = twist_of(motions, motions%piece(node), first, last, &
          coefficients(first:last, k))
        if (norm2(six(:, n + 1)) <= least*farthest) cycle
        n = n + 1
        where (abs(six(:, n)) <= least*maxval(abs(six(:, n)))) six(:, n) = 0.0_wp
      end do
      if (n > 0) call append(words, 'piece of node '//to_text(mesh%node_id(node))//' of '// &
        body_in_words(mesh, motions, first)//': '//span_in_words(six(:, :n)))
    end subroutine add_piece

  end function span_of_bodies

  !> How many motions, from `first` on, are of one body or obstacle.
  pure integer function motions_together(motions, first) result(n)
    type(free_motions_t), intent(in) :: motions
    integer, intent(in) :: first

    n = 1
    do while (first + n <= motions%n)
      if (motions%body(first + n) /= motions%body(first)) exit
      if (motions%body(first) == 0 .and. motions%node(first + n) /= motions%node(first)) exit
      n = n + 1
    end do
  end function motions_together

  !> Translation of the centre and rotation times the body's size, of a combination of motions; of
  !> a piece where equations join it to its body.
  pure function twist_of(motions, piece, first, last, coefficient) result(six)
    type(free_motions_t), intent(in) :: motions
    integer, intent(in) :: piece !! 0: the body
    integer, intent(in) :: first, last
    real(wp), intent(in) :: coefficient(:)
    real(wp) :: six(6)
    integer :: j

    six = 0.0_wp
    do j = first, last
      associate (c => coefficient(j - first + 1))
        if (piece == 0) then
          six = six + c*[motions%translation(:, j), motions%extent(j)*motions%rotation(:, j)]
        else
          six = six + c*[motions%piece_translation(:, piece, j), motions%piece_extent(piece)* &
            motions%piece_rotation(:, piece, j)]
        end if
      end associate
    end do
  end function twist_of

  !> A space of motions: the axes that lie in it, else its vectors.
  function span_in_words(six) result(words)
    real(wp), intent(in) :: six(:, :) !! (6,k) translations and scaled rotations
    character(:), allocatable :: words
    character(*), parameter :: name(6) = ['translation along x', 'translation along y', &
      'translation along z', 'rotation about x   ', 'rotation about y   ', 'rotation about z   ']
    real(wp) :: v(6, 6), s(6), rest(6)
    integer :: i, k, rank, named
    logical :: axis(6), ok

    words = ''
    call singular_values(transpose(six), s, v, ok)
    rank = count(s(:min(6, size(six, 2))) > small*s(1))
    axis = 1.0_wp - norm2(v(:, :rank), dim=2) <= small
    named = 0
    do i = 1, 6
      if (.not. axis(i)) cycle
      named = named + 1
      call append(words, trim(name(i)))
    end do
    if (named == rank) return
    ! What the axes do not span, one direction after the other.
    do k = 1, rank
      rest = v(:, k)
      where (axis) rest = 0.0_wp
      if (norm2(rest) <= small) cycle
      call append(words, direction_in_words(rest))
    end do
  end function span_in_words

  pure function direction_in_words(six) result(words)
    real(wp), intent(in) :: six(6)
    character(:), allocatable :: words

    words = ''
    if (norm2(six(:3)) > small*norm2(six)) words = 'translation along '//vector(six(:3))
    if (norm2(six(4:)) <= small*norm2(six)) return
    if (len(words) > 0) words = words//' with '
    words = words//'rotation about '//vector(six(4:))
  end function direction_in_words

  pure function vector(v) result(words)
    real(wp), intent(in) :: v(3)
    character(:), allocatable :: words
    character, parameter :: axis(3) = ['x', 'y', 'z']
    real(wp) :: unit(3)
    integer :: i

    unit = v/norm2(v)
    i = maxloc(abs(unit), dim=1)
    if (count(abs(unit) > small) == 1) then
      words = axis(i)
      return
    end if
    if (unit(i) < 0.0_wp) unit = -unit
    words = '('
    do i = 1, 3
      if (i > 1) words = words//', '
      if (abs(unit(i)) <= small) then
        words = words//'0'
      else
        words = words//to_text(unit(i), 4)
      end if
    end do
    words = words//')'
  end function vector

  !> Which body or obstacle motion `j` moves.
  pure function body_in_words(mesh, motions, j) result(words)
    type(mesh_t), intent(in) :: mesh
    type(free_motions_t), intent(in) :: motions
    integer, intent(in) :: j
    character(:), allocatable :: words
    integer :: node

    if (motions%body(j) == 0) then
      words = 'obstacle of reference node '//to_text(mesh%node_id(motions%node(j)))
      return
    end if
    do node = 1, mesh%n_nodes
      if (mesh%body(node) /= motions%body(j)) cycle
      if (.not. allocated(mesh%piece)) exit
      if (mesh%piece(node) > 0) exit ! of an element, not one that equations join to it
    end do
    words = 'body '//to_text(motions%body(j))//' (of node '//to_text(mesh%node_id(node))//')'
  end function body_in_words

  pure subroutine append(words, more)
    character(:), allocatable, intent(inout) :: words
    character(*), intent(in) :: more

    if (len(words) > 0) words = words//', '
    words = words//more
  end subroutine append

end module describe_motions_mod
