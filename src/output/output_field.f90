!> An entry of the table of fields: a dataset of the result file, and how it is computed.
!>
!> The table has seven parts: history_fields, one number an increment; pair_fields, at the points of
!> a contact pair; reference_fields, of reference nodes; spring_fields, of springs; print_fields, of
!> a set that the deck prints; view_fields, over the mesh; gauss_fields, at Gauss points. Stresses
!> and strains are rows of tensor_fields in the last three.
!> A new field is one entry in one of them and, but for a
!> history, the procedure that computes it; what nodes have is computed at all of them
!> (nodal_fields), and an entry says at which it is written. The result file, its XDMF sidecar, the
!> plan's list of fields and the estimate of the file's size are made from the table.
module output_field_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t
  use dataset_kinds_mod, only: of_real, bytes_of
  use mesh_mod, only: shown_nodes
  use scene_mod, only: scene_t, reference_nodes
  use contact_points_mod, only: contact_points_t
  use state_mod, only: state_t
  use increment_report_mod, only: increment_report_t
  use step_fields_mod, only: tensor_field_t
  implicit none
  private

  public :: field_t, field_source_t, field_list_t, add_field, get_fields, compute_field
  public :: block_shape, block_bytes, fill_field
  public :: every_time, first_time, at_start, everywhere, at_supports, at_contact
  public :: of_elements, of_references, of_set

  ! When a field is written.
  integer, parameter :: every_time = 1 !! a row an increment; over the mesh: where fields are due
  integer, parameter :: first_time = 2 !! the same, but one row for the whole run
  integer, parameter :: at_start = 3
  !! before the first increment, as a dataset that does not grow: reals of one or two extents, longs
  !! of one

  ! Where the numbers of a field are not 0.
  integer, parameter :: everywhere = 1
  integer, parameter :: at_supports = 2
  integer, parameter :: at_contact = 3

  ! The nodes whose columns are written of a field that is computed at all nodes of the deck.
  integer, parameter :: as_computed = 0   !! the columns are those that are written
  integer, parameter :: of_elements = 1     !! nodes that elements have
  integer, parameter :: of_references = 2 !! reference nodes
  integer, parameter :: of_set = 3        !! members of the source's set

  !> A field. Its extents are Fortran's way round; the last one counts points, nodes or elements.
  type :: field_t
    character(:), allocatable :: name !! below /history, the pair's group, or /VTKHDF
    integer :: kind = of_real                !! of_real, ...: of its numbers in the file
    integer, allocatable :: extents(:)       !! of what is written at a time; none: one number
    character(:), allocatable :: quantity    !! what kind of number: length, force, code, ...
    character(:), allocatable :: description
    integer :: written = every_time          !! every_time, first_time or at_start
    integer :: spread = everywhere           !! everywhere, at_supports or at_contact
    integer :: nodes = as_computed           !! as_computed, of_elements, of_references or of_set
    integer :: element_type = 0 !! of elements whose Gauss points it has, as of gauss_types
    integer :: tensor_row = 0, place = 0 !! as of tensor_fields
    real(wp) :: value = 0.0_wp               !! of a history: the number itself
    procedure(compute_field), pointer, nopass :: compute => null() !! of all others
  end type field_t

  !> What the fields of an increment are computed from. Nothing of it is a copy.
  type :: field_source_t
    type(scene_t), pointer :: scene => null()
    type(contact_points_t), pointer :: points => null()
    type(state_t), pointer :: state => null()        !! at the end of the increment
    type(increment_report_t), pointer :: report => null()
    character(:), allocatable :: name   !! of the field that is computed
    integer :: pair = 0                 !! whose fields are computed
    integer :: first = 1, last = 0      !! its points
    integer :: print = 0                !! set whose fields are computed, of the output controls
    integer :: element_type = 0         !! whose Gauss points are computed, as of gauss_types
    integer :: tensor_row = 0, place = 0 !! what of stresses and strains is computed, and where
    integer :: tensors_of = 0           !! set whose stresses and strains these are
    real(wp), allocatable :: set_stress(:, :), set_strain(:, :) !! (6, places)
    type(tensor_field_t) :: stress, strain !! where the deck asks for them; made with the first one
    type(tensor_field_t) :: pk2, green !! likewise: second Piola-Kirchhoff stress, Green's strain
    type(error_t), allocatable :: error !! a field could not be computed
  end type field_source_t

  !> A part of the table while it is made.
  type :: field_list_t
    type(field_t), allocatable, private :: fields(:)
    integer, private :: n = 0
  end type field_list_t

  abstract interface
    !> Compute a field: a column a point, node or element; of some nodes only: a column for each
    !> node of the deck. What are whole numbers in the file are whole numbers here.
    subroutine compute_field(source, values)
      import :: field_source_t, wp
      implicit none
      type(field_source_t), intent(inout) :: source
      real(wp), intent(inout) :: values(:, :) !! 0 on entry
    end subroutine compute_field
  end interface

contains

  !> Add an entry.
  subroutine add_field(list, field)
    type(field_list_t), intent(inout) :: list
    type(field_t), intent(in) :: field

    if (.not. allocated(list%fields)) allocate (list%fields(16))
    if (list%n == size(list%fields)) list%fields = [list%fields, list%fields]
    list%n = list%n + 1
    list%fields(list%n) = field
  end subroutine add_field

  !> The entries of a list.
  subroutine get_fields(list, fields)
    type(field_list_t), intent(in) :: list
    type(field_t), allocatable, intent(out) :: fields(:)

    allocate (fields(list%n))
    if (list%n > 0) fields(:) = list%fields(:list%n)
  end subroutine get_fields

  !> Compute a field as it is written.
  subroutine fill_field(field, source, values)
    type(field_t), intent(in) :: field
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! of the field's block_shape; 0 on entry

    call fill_of_part(field, source, values)
    ! Of a body of revolution a wedge is computed, of a plate a slice.
    select case (field%quantity)
    case ('force', 'area', 'energy')
      values = values*source%scene%mesh%parts
    case ('moment')
      values = values*merge(0.0_wp, source%scene%mesh%parts, source%scene%mesh%sector_angle > &
        0.0_wp)
    case default
      continue
    end select
  end subroutine fill_field

  !> Compute a field of the bodies as they are computed.
  subroutine fill_of_part(field, source, values)
    type(field_t), intent(in) :: field
    type(field_source_t), intent(inout) :: source
    real(wp), intent(inout) :: values(:, :) !! of the field's block_shape; 0 on entry
    real(wp), allocatable :: of_all(:, :)
    integer, allocatable :: nodes(:)

    source%name = field%name
    source%element_type = field%element_type
    source%tensor_row = field%tensor_row
    source%place = field%place
    select case (field%nodes)
    case (of_elements)
      nodes = source%scene%mesh%element_nodes
    case (of_references)
      nodes = reference_nodes(source%scene)
    case (of_set)
      nodes = source%scene%output%prints(source%print)%members
    case default
      call field%compute(source, values)
      return
    end select
    associate (n => shown_nodes(source%scene%mesh))
      if (field%nodes == of_elements .and. size(nodes) == n) then
        call field%compute(source, values)
      else
        allocate (of_all(size(values, 1), n), source=0.0_wp)
        call field%compute(source, of_all)
        values = of_all(:, nodes)
      end if
    end associate
  end subroutine fill_of_part

  !> Numbers a point, node or element; and how many of these.
  pure function block_shape(field) result(n)
    type(field_t), intent(in) :: field
    integer :: n(2)
    integer :: rank

    rank = size(field%extents)
    n = 1
    if (rank > 0) n = [product(field%extents(:rank - 1)), field%extents(rank)]
  end function block_shape

  !> What is written at a time [bytes].
  elemental real(wp) function block_bytes(field)
    type(field_t), intent(in) :: field

    block_bytes = bytes_of(field%kind)*product(real(block_shape(field), wp))
  end function block_bytes

end module output_field_mod
