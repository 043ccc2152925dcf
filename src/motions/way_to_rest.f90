!> Where bodies stay that no contact sees. docs/theory.md (9.6a).
module way_to_rest_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: cross
  use dense_mod, only: solve_least_squares, singular_values
  use mesh_mod, only: mesh_t
  use rigid_modes_mod, only: free_motions_t, place_of, is_joined
  implicit none
  private

  public :: way_to_rest

  !> A body, a piece of one that equations join, or an obstacle, that free motions move.
  type :: moving_part_t
    integer,  allocatable :: node(:)        !! of it
    real(wp), allocatable :: motion(:, :)
    !! (6,n) translation of its centre, and rotation times its extent, by each motion [-]
    real(wp) :: centre(3) = 0.0_wp          !! mean of the nodes [length]
    real(wp) :: extent = 0.0_wp
    !! root of the mean square of distances from it, 0 of a single node [length]
  end type moving_part_t

contains

  !> How far the neutral motions go until bodies are, on the average of their nodes, where they
  !> were: deformed about one pin, a body that is pressed in its middle would no longer lie there,
  !> and where it lay would depend on the axes.
  !>
  !> Of the rigid motions that fit best first the rotations are taken back as far as neutral motions
  !> can, then the translations as far as is left open: what leads a body along is no neutral
  !> motion, even where a neutral motion would bring it nearer to where it was by turning it.
  !> docs/theory.md (9.6a).
  function way_to_rest(mesh, motions, list, neutral, moved) result(a)
    type(mesh_t), intent(in) :: mesh
    type(free_motions_t), intent(in) :: motions
    integer, intent(in) :: list(:)          !! the motions of a group of bodies
    real(wp), intent(in) :: neutral(:, :)   !! (n,k) of these, orthonormal [-]
    real(wp), intent(in) :: moved(:, :)     !! (3,n_nodes) since bodies were there [length]
    real(wp) :: a(size(list))               !! [length]
    real(wp), parameter :: nothing = 1.0e-5_wp !! of what moves most: does not turn [-]
    type(moving_part_t), allocatable :: parts(:)
    real(wp), allocatable :: turns(:, :), shifts(:, :), turned(:), shifted(:)
    real(wp), dimension(size(neutral, 2)) :: share, s
    real(wp) :: v(size(neutral, 2), size(neutral, 2)), six(6)
    integer :: i, n
    logical :: ok

    a = 0.0_wp
    allocate (parts, source=moving_parts(mesh, motions, list))
    n = size(parts)
    allocate (turns(3*n, size(s)), shifts(3*n, size(s)), turned(3*n), shifted(3*n))
    do i = 1, n
      shifts(3*i - 2:3*i, :) = matmul(parts(i)%motion(:3, :), neutral)
      turns(3*i - 2:3*i, :) = matmul(parts(i)%motion(4:, :), neutral)
      six = best_fit(mesh, motions, parts(i), moved)
      shifted(3*i - 2:3*i) = six(:3)
      turned(3*i - 2:3*i) = six(4:)
    end do
    call singular_values(turns, s, v, ok)
    if (.not. ok) return
    n = count(s > nothing*max(maxval(abs(turns)), maxval(abs(shifts))))
    share = matmul(v(:, :n), solve_least_squares(matmul(turns, v(:, :n)), turned))
    share = share + matmul(v(:, n + 1:), solve_least_squares(matmul(shifts, v(:, n + 1:)), &
      shifted - matmul(shifts, share)))
    a = -matmul(neutral, share)
  end function way_to_rest

  !> The bodies that motions move, of one that equations join its pieces, and the reference nodes of
  !> obstacles.
  function moving_parts(mesh, motions, list) result(parts)
    type(mesh_t), intent(in) :: mesh
    type(free_motions_t), intent(in) :: motions
    integer, intent(in) :: list(:)   !! the motions
    type(moving_part_t), allocatable :: parts(:)
    integer :: first, p, i
    logical :: together(size(list))

    allocate (parts(0))
    do first = 1, size(list)
      associate (body => motions%body(list(first)), node => motions%node(list(first)))
        together = motions%body(list) == body .and. (body > 0 .or. motions%node(list) == node)
        if (any(together(:first - 1))) cycle
        if (body == 0) then
          call add_part([node])
        else if (.not. is_joined(motions, body)) then
          call add_part(pack([(i, i=1, mesh%n_nodes)], mesh%body == body))
        else
          do p = 1, size(motions%piece_extent)
            call add_part(pack([(i, i=1, mesh%n_nodes)], mesh%body == body .and. &
              motions%piece(:mesh%n_nodes) == p))
          end do
        end if
      end associate
    end do

  contains

    !> One more part, if it moves: by what motions do to the mean of its nodes.
    subroutine add_part(nodes)
      integer, intent(in) :: nodes(:)
      type(moving_part_t) :: part
      real(wp) :: translation(3), rotation(3), about(3)
      integer :: j, k, piece

      if (size(nodes) == 0) return
      allocate (part%node, source=nodes)
      allocate (part%motion(6, size(list)), source=0.0_wp)
      do k = 1, size(nodes)
        part%centre = part%centre + place_of(motions, mesh, nodes(k))/real(size(nodes), wp)
      end do
      do k = 1, size(nodes)
        part%extent = part%extent + sum((place_of(motions, mesh, nodes(k)) - &
          part%centre)**2)/real(size(nodes), wp)
      end do
      part%extent = sqrt(part%extent)
      piece = 0
      if (allocated(motions%piece)) piece = motions%piece(nodes(1))
      do k = 1, size(list)
        if (.not. together(k)) cycle
        j = list(k)
        if (motions%body(j) == 0 .or. piece == 0) then
          translation = motions%translation(:, j)
          rotation = motions%rotation(:, j)
          about = motions%centre(:, j)
        else
          translation = motions%piece_translation(:, piece, j)
          rotation = motions%piece_rotation(:, piece, j)
          about = motions%piece_centre(:, piece)
        end if
        part%motion(:3, k) = translation + cross(rotation, part%centre - about)
        part%motion(4:, k) = part%extent*rotation
      end do
      if (any(abs(part%motion) > 0.0_wp)) parts = [parts, part]
    end subroutine add_part

  end function moving_parts

  !> Translation of a part's centre, and rotation times its extent, that fit displacements best.
  function best_fit(mesh, motions, part, moved) result(six)
    type(mesh_t), intent(in) :: mesh
    type(free_motions_t), intent(in) :: motions
    type(moving_part_t), intent(in) :: part
    real(wp), intent(in) :: moved(:, :)       !! (3,n_nodes) [length]
    real(wp) :: six(6)                        !! [length]
    real(wp) :: inertia(3, 3), moment(3), arm(3)
    integer :: k, i

    six = 0.0_wp
    inertia = 0.0_wp
    moment = 0.0_wp
    do k = 1, size(part%node)
      associate (u => moved(:, part%node(k)))
        arm = place_of(motions, mesh, part%node(k)) - part%centre
        six(:3) = six(:3) + u/real(size(part%node), wp)
        moment = moment + cross(arm, u)
        do i = 1, 3
          inertia(:, i) = inertia(:, i) - arm*arm(i)
          inertia(i, i) = inertia(i, i) + dot_product(arm, arm)
        end do
      end associate
    end do
    ! A line turns about itself by nothing that nodes would see.
    if (part%extent > 0.0_wp) six(4:) = part%extent*solve_least_squares(inertia, moment)
  end function best_fit

end module way_to_rest_mod
