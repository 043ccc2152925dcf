!> Motions that contact does not see until normals have turned. docs/theory.md section 9.
module neutral_motions_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: cross
  use dense_mod, only: solve_least_squares
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use rigid_modes_mod, only: free_motions_t, add_motions, place_of
  use state_mod, only: state_t
  use placement_mod, only: placement_t, place_curved
  use transfer_mod, only: motion_of_point
  implicit none
  private

  public :: led_t, neutral_step, way_to_rest

  real(wp), parameter :: difference = 1.0e-4_wp !! of the size of the mesh
  real(wp), parameter :: too_much = 0.5_wp      !! of what was left before a step [-]

  !> The last step along neutral motions, from which the next one learns.
  type :: led_t
    real(wp), allocatable :: step(:) !! (n_motions) not allocated before the first [length]
    real(wp), allocatable :: from(:) !! (n_motions) what was left on them before it [force]
  end type led_t

  !> A body, or a piece of one that equations join, that free motions move.
  type :: moving_part_t
    integer,  allocatable :: node(:)        !! of it
    real(wp), allocatable :: motion(:, :)
    !! (6,n_motions) translation of its centre, and rotation times its extent, by each motion [-]
    real(wp) :: centre(3) = 0.0_wp          !! [length]
    real(wp) :: extent = 0.0_wp             !! 0 of a single node [length]
  end type moving_part_t

contains

  !> How far the neutral motions go until what turned normals leave on them is 0: a Newton step, the
  !> derivative by a difference, and by what the last step has done. Nothing where normals do not
  !> turn.
  !>
  !> Residual and derivative are those of where the bodies are now. The difference takes reactions
  !> as they are. Where bodies are thin these change more than normals do, as surfaces that are not
  !> flat any more slide over each other. Where a step has left too much the derivative takes
  !> Broyden's correction. docs/theory.md section 9.
  subroutine neutral_step(scene, points, motions, neutral, placement, state, residual, led)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(free_motions_t), intent(in) :: motions
    real(wp), intent(in) :: neutral(:, :)   !! (n,k) orthonormal [-]
    type(placement_t), intent(in) :: placement !! in which the reactions were found
    type(state_t), intent(in) :: state      !! its reactions, displacement and rotations
    real(wp), intent(in) :: residual(:)     !! (k) what turned normals leave on them [force]
    type(led_t), intent(inout) :: led       !! the last step in, this one out
    real(wp), dimension(size(residual)) :: along, left, here
    real(wp) :: stiffness(size(residual), size(residual)), moved(3, scene%mesh%n_nodes)
    type(placement_t) :: turned
    real(wp) :: step
    integer :: k

    step = difference*maxval(maxval(scene%mesh%coordinates, dim=2) - minval( &
      scene%mesh%coordinates, dim=2))
    ! While places settle bodies are not where the reactions were found.
    turned = placement
    call place_curved(scene, points, state%displacement, turned, state%rotation)
    here = along_neutral(turned)
    left = residual + here - along_neutral(placement)
    do k = 1, size(residual)
      moved = state%displacement
      call add_motions(motions, scene%mesh, step*neutral(:, k), moved)
      call place_curved(scene, points, moved, turned, state%rotation)
      stiffness(:, k) = (here - along_neutral(turned))/step
    end do
    if (allocated(led%step)) then
      along = matmul(led%step, neutral)
      if (norm2(left) > too_much*norm2(matmul(led%from, neutral)) .and. &
        any(abs(along) > 0.0_wp)) stiffness = stiffness + spread(matmul(led%from, neutral) - &
        left - matmul(stiffness, along), 2, size(along))*spread(along, 1, size(along))/ &
        dot_product(along, along)
    end if
    led%step = matmul(neutral, solve_least_squares(stiffness, left))
    led%from = matmul(neutral, left)

  contains

    !> What the reactions do along the neutral motions where normals and weights are others [force].
    pure function along_neutral(turned) result(along)
      type(placement_t), intent(in) :: turned
      real(wp) :: along(size(neutral, 2))
      real(wp) :: force(3)
      integer :: i, j

      along = 0.0_wp
      do i = 1, points%n
        if (.not. points%is_curved(i) .or. .not. any(abs(state%reaction(:, i)) > 0.0_wp)) cycle
        force = matmul(turned%frame(:, :, i), matmul(state%reaction(:, i), &
          placement%frame(:, :, i)))
        do j = 1, motions%n
          along = along + dot_product(force, motion_of_point(scene%mesh, points, turned%weights, &
            motions, i, j))*neutral(j, :)
        end do
      end do
    end function along_neutral

  end subroutine neutral_step

  !> How far the neutral motions go until bodies are, on the average of their nodes, where they
  !> were: deformed about one pin, a body that is pressed in its middle would no longer lie there.
  !>
  !> The rigid motion that fits best is made up of neutral motions and, where these say nothing, of
  !> translations and rotations of the body, or of each piece of one that equations join: what leads
  !> it elsewhere is no neutral motion. Nothing where obstacles move freely.
  function way_to_rest(scene, motions, neutral, moved) result(a)
    type(scene_t), intent(in) :: scene
    type(free_motions_t), intent(in) :: motions
    real(wp), intent(in) :: neutral(:, :)   !! (n,k) orthonormal [-]
    real(wp), intent(in) :: moved(:, :)     !! (3,n_nodes) since bodies were there [length]
    real(wp) :: a(motions%n)                !! [length]
    type(moving_part_t), allocatable :: parts(:)
    real(wp), allocatable :: basis(:, :), fitted(:), share(:)
    integer :: i, k, n

    a = 0.0_wp
    if (any(motions%body == 0)) return
    parts = moving_parts(scene, motions)
    n = 6*size(parts)
    k = size(neutral, 2)
    allocate (basis(n, max(n, k)), fitted(n), source=0.0_wp)
    do i = 1, size(parts)
      basis(6*i - 5:6*i, :k) = matmul(parts(i)%motion, neutral)
      fitted(6*i - 5:6*i) = best_fit(scene, motions, parts(i), moved)
    end do
    call complete_basis(basis, k)
    allocate (share(n), source=solve_least_squares(basis, fitted))
    a = -matmul(neutral, share(:k))
  end function way_to_rest

  !> The bodies that move freely, of one that equations join its pieces.
  function moving_parts(scene, motions) result(parts)
    type(scene_t), intent(in) :: scene
    type(free_motions_t), intent(in) :: motions
    type(moving_part_t), allocatable :: parts(:)
    type(moving_part_t) :: part
    integer :: body, p, j
    logical :: of_body(scene%mesh%n_nodes)

    allocate (parts(0))
    do body = 1, scene%mesh%n_bodies
      if (.not. any(motions%body == body)) cycle
      of_body = scene%mesh%body == body
      if (.not. motions%is_joined(body)) then
        j = findloc(motions%body, body, dim=1)
        part%centre = motions%centre(:, j)
        part%extent = motions%extent(j)
        part%node = nodes_where(of_body)
        part%motion = six_of(motions%translation, motions%rotation, part%extent)
        do j = 1, motions%n
          if (motions%body(j) /= body) part%motion(:, j) = 0.0_wp
        end do
        parts = [parts, part]
        cycle
      end if
      do p = 1, size(motions%piece_extent)
        part%node = nodes_where(of_body .and. motions%piece(:scene%mesh%n_nodes) == p)
        if (size(part%node) == 0) cycle
        part%centre = motions%piece_centre(:, p)
        part%extent = motions%piece_extent(p)
        part%motion = six_of(motions%piece_translation(:, p, :), motions%piece_rotation(:, p, :), &
          part%extent)
        if (any(abs(part%motion) > 0.0_wp)) parts = [parts, part]
      end do
    end do

  contains

    pure function nodes_where(is_in) result(nodes)
      logical, intent(in) :: is_in(:)
      integer, allocatable :: nodes(:)
      integer :: i

      nodes = pack([(i, i=1, size(is_in))], is_in)
    end function nodes_where

    pure function six_of(translation, rotation, extent) result(six)
      real(wp), intent(in) :: translation(:, :), rotation(:, :), extent
      real(wp) :: six(6, size(translation, 2))

      six(:3, :) = translation
      six(4:, :) = extent*rotation
    end function six_of

  end function moving_parts

  !> Translation of a part's centre, and rotation times its extent, that fit displacements best.
  function best_fit(scene, motions, part, moved) result(six)
    type(scene_t), intent(in) :: scene
    type(free_motions_t), intent(in) :: motions
    type(moving_part_t), intent(in) :: part
    real(wp), intent(in) :: moved(:, :)       !! (3,n_nodes) [length]
    real(wp) :: six(6)                        !! [length]
    real(wp) :: field(3, 6), product(6, 6), along(6)
    integer :: k, i

    product = 0.0_wp
    along = 0.0_wp
    field = 0.0_wp
    do i = 1, 3
      field(i, i) = 1.0_wp
    end do
    do k = 1, size(part%node)
      associate (node => part%node(k))
        if (part%extent > 0.0_wp) then
          do i = 1, 3
            field(:, 3 + i) = cross(field(:, i), (place_of(motions, scene%mesh, node) - &
              part%centre)/part%extent)
          end do
        end if
        product = product + matmul(transpose(field), field)
        along = along + matmul(moved(:, node), field)
      end associate
    end do
    six = solve_least_squares(product, along)
  end function best_fit

  !> Make a basis of the first columns and of unit vectors, the first that are independent of what
  !> is there.
  pure subroutine complete_basis(basis, k)
    real(wp), intent(inout) :: basis(:, :) !! (n,n) the first `k` columns given
    integer, intent(in) :: k
    real(wp), parameter :: independent = 1.0e-3_wp !! of a column: what is left of it [-]
    real(wp) :: q(size(basis, 1), size(basis, 1)), column(size(basis, 1))
    integer :: m, i, l, candidate

    m = 0
    do candidate = 1, k + size(basis, 1)
      if (m == size(basis, 1)) return
      if (candidate <= k) then
        column = basis(:, candidate)
      else
        column = 0.0_wp
        column(candidate - k) = 1.0_wp
      end if
      basis(:, m + 1) = column
      do i = 1, 2
        do l = 1, m
          column = column - dot_product(column, q(:, l))*q(:, l)
        end do
      end do
      if (candidate > k .and. norm2(column) <= independent) cycle
      m = m + 1
      q(:, m) = column/max(norm2(column), tiny(1.0_wp))
    end do
  end subroutine complete_basis

end module neutral_motions_mod
