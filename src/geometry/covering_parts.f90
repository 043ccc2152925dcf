!> The parts of a master that cover a slave face: faces with nodes in the middles of their edges are
!> cut into parts between all of their nodes.
module covering_parts_mod
  use kinds_mod, only: wp
  use cells_mod, only: face_corners, face_nodes
  use connectivity_mod, only: corners_in
  use surfaces_mod, only: cut_at_middles
  use face_grid_mod, only: face_grid_t, make_face_grid, faces_near
  use face_overlap_mod, only: overlap_t, plane_t, outward_normal, find_overlap, opposite_weights
  use curved_overlap_mod, only: whole_face_t, whole_face, find_curved_overlap
  use surface_reach_mod, only: largest_face, against
  use mortar_rows_mod, only: opposite_t
  use slave_face_mod, only: face_t
  implicit none
  private

  public :: master_t, part_t, cut_master, find_parts, look_opposite

  !> A covered part of a slave face.
  type :: part_t
    integer :: node(face_nodes) = 0 !! of the master face
    integer :: n = 0              !! how many there are
    integer :: of = 0             !! which part of the master it is
    integer :: corner(face_corners) = 0 !! of that part, 0 behind them
    type(plane_t) :: plane        !! of the part of the slave face
    real(wp) :: distance = 0.0_wp !! of its middle from the slave's plane [length]
    type(overlap_t) :: overlap
  end type part_t

  !> A master, its faces cut into parts.
  type :: master_t
    integer, allocatable :: face(:, :)             !! (4,n_master) or (8,n_master) all nodes
    type(face_grid_t) :: grid                      !! of the parts
    integer, allocatable :: part(:, :)             !! (4,n) as of nodes_of_face
    integer, allocatable :: whole(:)               !! (n) the face of each
    real(wp) :: largest = 0.0_wp                   !! part [length]
  end type master_t

  ! By how much more of a slave face is covered than there is before something lies behind something
  ! else. Parts of curved faces lean, and seem to overlap a little: by 0.3 % on faces of 45 degrees.
  real(wp), parameter :: overlap_of_flat = 1.0e-6_wp, overlap_of_curved = 0.05_wp !! [-]

contains

  !> A master in parts, where its nodes are at `x`.
  pure type(master_t) function cut_master(faces, x) result(master)
    integer, intent(in) :: faces(:, :) !! as of `face`
    real(wp), intent(in) :: x(:, :)    !! (3,n_nodes) [length]

    master%face = faces
    call cut_at_middles(faces, master%part, master%whole)
    master%grid = make_face_grid(master%part, x)
    master%largest = largest_face(master%part, x)
  end function cut_master

  !> The parts of the master that cover a part of a slave face, and what they cover of it.
  pure subroutine find_parts(master, x, face, plane, reach, parts, u)
    type(master_t), intent(in) :: master
    real(wp), intent(in) :: x(:, :)       !! (3,n_nodes) [length]
    type(face_t), intent(in) :: face      !! the whole of it
    type(plane_t), intent(in) :: plane    !! of the part
    real(wp), intent(in) :: reach(2)      !! before the slave's plane, and behind it [length]
    type(part_t), allocatable, intent(out) :: parts(:)
    real(wp), intent(in), optional :: u(:, :) !! (3,n_nodes) as of slave_t [length]
    integer, allocatable :: near(:)
    type(part_t) :: part
    type(part_t), allocatable :: larger(:)
    type(whole_face_t) :: slave
    real(wp) :: low(3), high(3), height(face_corners), sideways, along
    real(wp), dimension(3, face_nodes) :: by_slave, by_master !! [length]
    integer :: i, k, n

    ! What covers the face lies in the prism over it.
    sideways = 1.0e-6_wp*sqrt(plane%area)
    along = maxval(reach) + master%largest
    low = minval(face%x(:, :face%n), 2) - along*abs(plane%axis(:, 3)) - sideways
    high = maxval(face%x(:, :face%n), 2) + along*abs(plane%axis(:, 3)) + sideways
    call faces_near(master%grid, low, high, near)
    by_slave = 0.0_wp
    by_master = 0.0_wp
    if (present(u)) by_slave(:, :face%n) = u(:, face%node(:face%n))
    if (face%n > face_corners) slave = whole_face(face%x(:, :face%n), by_slave(:, :face%n))
    allocate (parts(face_corners))
    n = 0
    do i = 1, size(near)
      k = corners_in(master%part(:, near(i)))
      associate (corner => x(:, master%part(:k, near(i))), of => master%face(:, &
                 master%whole(near(i))))
        if (dot_product(outward_normal(corner), plane%axis(:, 3)) > against) cycle
        height(:k) = matmul(plane%axis(:, 3), corner) - dot_product(plane%axis(:, 3), plane%origin)
        if (minval(height(:k)) > reach(1) .or. maxval(height(:k)) < -reach(2)) cycle
        part%of = near(i)
        part%n = count(of > 0)
        part%node(:size(of)) = of
        part%corner = master%part(:, near(i))
        part%plane = plane
        part%distance = abs(sum(height(:k)))/real(k, wp)
        if (max(face%n, part%n) <= face_corners) then
          if (present(u)) by_master(:, :k) = u(:, part%corner(:k))
          part%overlap = find_overlap(plane, face%x(:, :face%n) + by_slave(:, :face%n), corner, &
            by_master(:, :k))
        else
          if (slave%n == 0) slave = whole_face(face%x(:, :face%n), by_slave(:, :face%n))
          if (present(u)) by_master(:, :part%n) = u(:, of(:part%n))
          part%overlap = find_curved_overlap(plane, slave, corner, whole_face(x(:, &
            of(:part%n)), by_master(:, :part%n)))
        end if
      end associate
      if (.not. part%overlap%area > 0.0_wp) cycle
      if (n == size(parts)) then
        allocate (larger(2*n))
        larger(:n) = parts
        call move_alloc(larger, parts)
      end if
      n = n + 1
      parts(n) = part
    end do
    parts = parts(:n)
    call keep_nearest(plane%area, merge(overlap_of_curved, overlap_of_flat, max(face%n, &
      maxval(parts%n)) > face_corners), parts)
  end subroutine find_parts

  !> Leave out the farthest parts where more is covered than there is: of a master that lies behind
  !> another.
  pure subroutine keep_nearest(area, rounding, parts)
    real(wp), intent(in) :: area     !! of the part of the slave face [length^2]
    real(wp), intent(in) :: rounding !! of this area [-]
    type(part_t), allocatable, intent(inout) :: parts(:)
    logical :: kept(size(parts))
    integer :: i

    kept = .true.
    do i = 1, size(parts)
      if (sum(parts%overlap%area, mask=kept) <= (1.0_wp + rounding)*area) exit
      kept(maxloc(parts%distance, dim=1, mask=kept)) = .false.
    end do
    if (.not. all(kept)) parts = pack(parts, kept)
  end subroutine keep_nearest

  !> Find the places of the master opposite the nodes of a slave face that ask for it: among the
  !> corners of the master's parts.
  pure subroutine look_opposite(asks, plane, x, master, parts, row, opposite)
    logical, intent(in) :: asks(:)
    type(plane_t), intent(in) :: plane    !! of the slave face
    real(wp), intent(in) :: x(:, :)       !! (3,n_nodes) [length]
    type(master_t), intent(in) :: master
    type(part_t), intent(in) :: parts(:)
    integer, intent(in) :: row(:)         !! of the face's nodes
    type(opposite_t), intent(inout) :: opposite(:)
    real(wp) :: weight(face_corners)
    integer :: a, i, k

    do i = 1, size(parts)
      k = corners_in(master%part(:, parts(i)%of))
      do a = 1, size(row)
        if (.not. asks(a)) cycle
        associate (found => opposite(row(a)), node => master%part(:k, parts(i)%of))
          weight = opposite_weights(plane, a, x(:, node))
          if (-minval(weight) >= found%beyond) cycle
          found%n = k
          found%node(:found%n) = node
          found%beyond = -minval(weight)
          found%weight = max(0.0_wp, weight)/sum(max(0.0_wp, weight))
        end associate
      end do
    end do
  end subroutine look_opposite

end module covering_parts_mod
