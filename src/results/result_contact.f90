!> The groups /contact/<pair> of a result file, and the contact as fields over the nodes.
module result_contact_mod
  use kinds_mod, only: wp, i1, i8
  use errors_mod, only: error_t
  use text_mod, only: to_text
  use small_matrix_mod, only: cross
  use hdf5_files_mod, only: hdf5_file_t, exists
  use hdf5_attributes_mod, only: write_attribute, describe_group
  use hdf5_datasets_mod, only: write_dataset
  use hdf5_rows_mod, only: rows_t, create_rows, keep_rows, append_row
  use hdf5_types_mod, only: of_real, of_byte
  use obstacles_mod, only: obstacle_plane
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use state_mod, only: state_t
  use step_report_mod, only: contact_fields_t
  implicit none
  private

  public :: pair_rows_t, create_contact, append_contact
  public :: nodal_contact_t, contact_at_nodes

  integer, parameter :: no_contact = -1 !! status of a node that can touch nothing

  !> The open datasets of a pair.
  type :: pair_rows_t
    character(:), allocatable :: path
    integer :: first = 1, last = 0    !! its points
    real(wp), allocatable :: coordinates(:, :) !! (3, its points) [length]
    logical :: frame_is_fixed = .false.
    logical :: frame_is_written = .false.
    type(rows_t) :: frame, reaction, gap, slip_increment, slip, status, resultant, moment
  end type pair_rows_t

  !> The contact as seen in a picture: fields over all nodes.
  type :: nodal_contact_t
    real(wp),    allocatable :: force(:, :)  !! (3, n_nodes) on the slave body, x, y, z [force]
    real(wp),    allocatable :: pressure(:)  !! (n_nodes) normal reaction over area [force/length^2]
    integer(i1), allocatable :: status(:)    !! (n_nodes) -1 where no contact can be
  end type nodal_contact_t

contains

  !> Make a group for each pair, in their order, and write what does not change.
  subroutine create_contact(file, scene, points, n_rows, pairs, error)
    type(hdf5_file_t), intent(in) :: file
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: n_rows !! that the file has already, of a run that is continued
    type(pair_rows_t), allocatable, intent(out) :: pairs(:)
    type(error_t), allocatable, intent(out) :: error
    integer :: i, n_pairs

    n_pairs = 0
    if (allocated(scene%pairs)) n_pairs = size(scene%pairs)
    allocate (pairs(n_pairs))
    call describe_group(file, '/contact', 'a group a contact pair, named '// &
                        '<slave surface>:<obstacle>', error)
    do i = 1, n_pairs
      if (allocated(error)) return
      if (points%n > 0) then
        pairs(i)%first = points%first(i)
        pairs(i)%last = points%first(i + 1) - 1
      end if
      pairs(i)%frame_is_fixed = scene%obstacles(scene%pairs(i)%obstacle)%kind == obstacle_plane
      pairs(i)%path = free_path(scene%pairs(i)%name, pairs(:i - 1))
      call create_pair(file, n_rows, pairs(i), error)
      call write_points(file, scene%mesh%coordinates, points, pairs(i), error)
      call write_attribute(file, pairs(i)%path, 'friction_coefficient', scene%pairs(i)%mu, error)
    end do
  end subroutine create_contact

  subroutine create_pair(file, n_rows, pair, error)
    type(hdf5_file_t), intent(in) :: file
    integer, intent(in) :: n_rows
    type(pair_rows_t), intent(inout) :: pair
    type(error_t), allocatable, intent(inout) :: error
    integer :: n

    n = pair%last - pair%first + 1
    call describe_group(file, pair%path, 'a row an increment; local components are '// &
                        'along n, t1, t2', error)
    call rows('frame', of_real, [3, 3, n], &
      'local frame: rows n (from the obstacle to the body), '// &
      't1, t2; one for the whole run where it is fixed', 'ratio', pair%frame)
    call rows('reaction', of_real, [3, n], 'on the slave body, local', 'force', pair%reaction)
    call rows('gap', of_real, [n], 'distance along n', 'length', pair%gap)
    call rows('slip_increment', of_real, [2, n], 'slip in the increment, along t1, t2', 'length', &
      pair%slip_increment)
    call rows('slip', of_real, [2, n], 'sum of the slip increments', 'length', pair%slip)
    call rows('status', of_byte, [n], '0: open, 1: stick, 2: slide', 'code', pair%status)
    call rows('resultant', of_real, [3], 'sum of the reactions on the slave body, x, y, z', &
      'force', &
      pair%resultant)
    call rows('moment', of_real, [3], 'moment of the reactions on the slave body about the '// &
      'origin, undeformed arms', 'moment', pair%moment)
    pair%frame_is_written = n_rows > 0

  contains

    subroutine rows(name, kind, row, description, quantity, these)
      character(*), intent(in) :: name, description, quantity
      integer, intent(in) :: kind, row(:)
      type(rows_t), intent(out) :: these
      integer :: n_kept

      call create_rows(file, pair%path//'/'//name, kind, row, description, quantity, these, error)
      n_kept = n_rows
      if (name == 'frame' .and. pair%frame_is_fixed) n_kept = min(n_rows, 1)
      call keep_rows(these, n_kept, error)
    end subroutine rows

  end subroutine create_pair

  !> Write which nodes the points are, where they stand and what they carry.
  subroutine write_points(file, coordinates, points, pair, error)
    type(hdf5_file_t), intent(in) :: file
    real(wp), intent(in) :: coordinates(:, :) !! (3, n_nodes)
    type(contact_points_t), intent(in) :: points
    type(pair_rows_t), intent(inout) :: pair
    type(error_t), allocatable, intent(inout) :: error
    integer, allocatable :: node(:)
    real(wp), allocatable :: area(:)

    allocate (node(0), area(0))
    if (pair%last >= pair%first) then
      node = points%node(pair%first:pair%last)
      area = points%area(pair%first:pair%last)
    end if
    pair%coordinates = coordinates(:, node)
    if (exists(file, pair%path//'/node')) return
    call write_dataset(file, pair%path//'/node', int(node - 1, i8), &
                       'slave node of each point: index into Points, from 0', 'number', error)
    call write_dataset(file, pair%path//'/coordinates', pair%coordinates, &
                       'where each point is in the undeformed mesh', 'length', error)
    call write_dataset(file, pair%path//'/area', area, &
                       'share of the slave surface; 0 where no face of it is', 'area', error)
  end subroutine write_points

  !> The path of a pair's group: its name, made fit for HDF5 and unlike those before it.
  pure function free_path(name, before) result(path)
    character(*), intent(in) :: name
    type(pair_rows_t), intent(in) :: before(:) !! the pairs that have a path
    character(:), allocatable :: path, plain
    integer :: i, n

    plain = name
    do i = 1, len(plain)
      if (plain(i:i) == '/') plain(i:i) = '_'
    end do
    path = '/contact/'//plain
    n = 1
    do while (any([(before(i)%path == path, i = 1, size(before))]))
      n = n + 1
      path = '/contact/'//plain//'-'//to_text(n)
    end do
  end function free_path

  !> Append a row to every pair.
  subroutine append_contact(pairs, state, contact, checksum, error)
    type(pair_rows_t), intent(inout) :: pairs(:)
    type(state_t), intent(in) :: state
    type(contact_fields_t), intent(in) :: contact
    integer(i8), intent(inout) :: checksum !! of the increment, to which that of every row is added
    type(error_t), allocatable, intent(inout) :: error
    type(contact_fields_t) :: none
    real(wp) :: no_vectors(3, 0), no_slips(2, 0)
    integer :: i

    allocate (none%frame(3, 3, 0), none%reaction(3, 0), none%gap(0), none%slip_increment(2, 0), &
              none%status(0))
    do i = 1, size(pairs)
      associate (a => pairs(i)%first, b => pairs(i)%last)
        if (b < a) then
          ! A pair without points: the run may not even have made the arrays.
          call append_points(pairs(i), none, no_slips, 1, 0, checksum, error)
          call append_sums(pairs(i), no_vectors, checksum, error)
        else
          call append_points(pairs(i), contact, state%slip, a, b, checksum, error)
          call append_sums(pairs(i), state%reaction(:, a:b), checksum, error)
        end if
      end associate
    end do
  end subroutine append_contact

  subroutine append_points(pair, contact, slip, a, b, checksum, error)
    type(pair_rows_t), intent(inout) :: pair
    type(contact_fields_t), intent(in) :: contact
    real(wp), intent(in) :: slip(:, :) !! (2, n_points)
    integer, intent(in) :: a, b        !! the pair's points are a to b
    integer(i8), intent(inout) :: checksum !! of the increment, to which that of every row is added
    type(error_t), allocatable, intent(inout) :: error

    if (.not. (pair%frame_is_fixed .and. pair%frame_is_written)) then
      call append_row(pair%frame, contact%frame(:, :, a:b), checksum, error)
      pair%frame_is_written = .true.
    end if
    call append_row(pair%reaction, contact%reaction(:, a:b), checksum, error)
    call append_row(pair%gap, contact%gap(a:b), checksum, error)
    call append_row(pair%slip_increment, contact%slip_increment(:, a:b), checksum, error)
    call append_row(pair%slip, slip(:, a:b), checksum, error)
    call append_row(pair%status, int(contact%status(a:b), i1), checksum, error)
  end subroutine append_points

  subroutine append_sums(pair, reaction, checksum, error)
    type(pair_rows_t), intent(inout) :: pair
    real(wp), intent(in) :: reaction(:, :) !! (3, points of the pair) x, y, z [force]
    integer(i8), intent(inout) :: checksum !! of the increment, to which that of every row is added
    type(error_t), allocatable, intent(inout) :: error
    real(wp) :: moment(3)
    integer :: i

    moment = 0.0_wp
    do i = 1, size(reaction, 2)
      moment = moment + cross(pair%coordinates(:, i), reaction(:, i))
    end do
    call append_row(pair%resultant, sum(reaction, dim=2), checksum, error)
    call append_row(pair%moment, moment, checksum, error)
  end subroutine append_sums

  !> The contact of all points as fields over the nodes; points that share a node add up.
  !>
  !> The status of a node is that of its point which slides, else sticks, else is open.
  pure function contact_at_nodes(n_nodes, points, state, contact) result(nodal)
    integer, intent(in) :: n_nodes
    type(contact_points_t), intent(in) :: points
    type(state_t), intent(in) :: state
    type(contact_fields_t), intent(in) :: contact
    type(nodal_contact_t) :: nodal
    integer :: i

    allocate (nodal%force(3, n_nodes), nodal%pressure(n_nodes), source=0.0_wp)
    allocate (nodal%status(n_nodes), source=int(no_contact, i1))
    do i = 1, points%n
      associate (node => points%node(i))
        nodal%force(:, node) = nodal%force(:, node) + state%reaction(:, i)
        nodal%status(node) = max(nodal%status(node), int(contact%status(i), i1))
        if (points%area(i) > 0.0_wp) then
          nodal%pressure(node) = nodal%pressure(node) + contact%reaction(1, i)/points%area(i)
        end if
      end associate
    end do
  end function contact_at_nodes

end module result_contact_mod
