!> What the result file of a run will take, and the memory in which HDF5 keeps parts of it.
module estimate_file_mod
  use kinds_mod, only: wp
  use dataset_kinds_mod, only: of_byte
  use scene_mod, only: scene_t, elements_with_modes
  use state_mod, only: bytes_to_continue
  use plan_mod, only: plan_t
  use output_field_mod, only: field_t, block_bytes, every_time, at_start, at_supports, at_contact
  use history_fields_mod, only: plan_history_fields
  use pair_fields_mod, only: list_pair_fields
  use reference_fields_mod, only: list_reference_fields
  use spring_fields_mod, only: list_spring_fields
  use print_fields_mod, only: list_print_fields
  use view_fields_mod, only: list_view_fields
  use gauss_fields_mod, only: list_gauss_fields
  use count_sizes_mod, only: sizes_t
  implicit none
  private

  public :: file_size_t, size_of_file

  real(wp), parameter :: chunk_cache = 65536.0_wp !! of HDF5, a dataset at most [bytes]

  ! The file [bytes]: what a dataset that grows takes beside its table of chunks, an entry of that
  ! table, and the fraction of numbers that is left where HDF5 squeezes them.
  real(wp), parameter :: growing_dataset = 4500.0_wp, entry = 34.0_wp
  real(wp), parameter :: squeezed = 0.8_wp, page = 4096.0_wp
  ! Growing datasets that are no fields: six in /VTKHDF/Steps, the checksums, the state's two slots.
  integer, parameter :: other_datasets = 9

  !> What the result file takes [bytes].
  type :: file_size_t
    real(wp) :: size = 0.0_wp
    real(wp) :: most = 0.0_wp
    real(wp) :: fields = 0.0_wp   !! of its size
    integer  :: datasets = 0      !! that grow
    real(wp) :: dense = 0.0_wp    !! numbers of fields that vary everywhere, kept as they are
    real(wp) :: varying = 0.0_wp  !! others that are not 0 throughout
    real(wp) :: zeros = 0.0_wp
    real(wp) :: cache = 0.0_wp    !! memory in which HDF5 keeps chunks
  end type file_size_t

contains

  !> The result file: histories and contact of every increment, fields of the outputs, what grows
  !> empty.
  type(file_size_t) function size_of_file(scene, plan, sizes) result(file)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    type(sizes_t), intent(in) :: sizes
    type(field_t), allocatable :: fields(:)
    real(wp) :: once, table, entries
    integer :: i

    call plan_history_fields(fields, any(scene%steps%is_dynamic))
    file%datasets = size(fields) + other_datasets
    ! The mesh without what is in the table of fields.
    once = 24.0_wp*size(scene%mesh%element_nodes) + 73.0_wp*sizes%elements + &
      real(len(scene%deck), wp)
    once = once + bytes_of_sets(scene)
    call list_view_fields(scene, plan%points%n > 0, fields)
    file%datasets = file%datasets + size(fields) ! their offsets
    call add_fields(fields, nonzero_bytes(fields, scene, sizes), sizes%outputs, once, file)
    call list_gauss_fields(scene, fields)
    call add_fields(fields, block_bytes(fields), sizes%outputs, once, file)
    file%fields = file%dense + squeezed*file%varying + file%zeros/200.0_wp
    do i = 1, size(scene%pairs)
      call list_pair_fields(scene, i, count(plan%points%pair(:plan%points%n) == i), fields)
      call add_fields(fields, block_bytes(fields), sizes%written, once, file)
    end do
    call list_reference_fields(scene, fields)
    call add_fields(fields, block_bytes(fields), sizes%written, once, file)
    call list_spring_fields(scene, fields)
    call add_fields(fields, block_bytes(fields), sizes%written, once, file)
    if (allocated(scene%output%prints)) then
      do i = 1, size(scene%output%prints)
        call list_print_fields(scene, i, fields)
        call add_fields(fields, block_bytes(fields), sizes%written, once, file)
      end do
    end if
    ! A table of a dataset has room for the increments (result_file), for more where they may be
    ! cut; the state is there in two slots, and of the forces in it few are not 0.
    entries = max(256.0_wp, real(sizes%written, wp))
    if (.not. all(scene%steps%direct)) entries = max(1024.0_wp, 2.0_wp*sizes%written)
    table = growing_dataset + entry*min(65534.0_wp, entries)
    file%size = once + table*file%datasets + file%dense + squeezed*file%varying + &
      file%zeros/200.0_wp + 100.0_wp*sizes%nodes
    ! Nothing squeezed, and room to spare in the tables.
    file%most = once + 1.0e6_wp + 2.0_wp*table*file%datasets + file%dense + file%varying + &
      file%zeros + 2.0_wp*bytes_to_continue(scene%mesh%n_nodes, plan%points%n, &
      elements_with_modes(scene), any(scene%steps%is_dynamic))
  end function size_of_file

  !> The named sets, each a dataset of rows [bytes]; long ones are squeezed, mostly to less.
  pure real(wp) function bytes_of_sets(scene) result(bytes)
    type(scene_t), intent(in) :: scene
    real(wp), parameter :: dataset = 700.0_wp, row = 4.0_wp
    integer :: i

    bytes = 0.0_wp
    if (.not. allocated(scene%node_sets) .or. .not. allocated(scene%element_sets)) return
    do i = 1, size(scene%node_sets)
      bytes = bytes + dataset + row*size(scene%node_sets(i)%members)
    end do
    do i = 1, size(scene%element_sets)
      bytes = bytes + dataset + row*size(scene%element_sets(i)%members)
    end do
    do i = 1, scene%n_named_surfaces
      bytes = bytes + dataset + row*size(scene%surfaces(i)%faces)
    end do
  end function bytes_of_sets

  !> The bytes of each field that are not 0 throughout: of what there is at supports and in contact
  !> those of the nodes there; codes are squeezed to next to nothing.
  pure function nonzero_bytes(fields, scene, sizes) result(bytes)
    type(field_t), intent(in) :: fields(:)
    type(scene_t), intent(in) :: scene
    type(sizes_t), intent(in) :: sizes
    real(wp) :: bytes(size(fields)) !! written at a time
    logical :: held(scene%mesh%n_nodes)
    integer :: i

    held = prescribed_nodes(scene)
    bytes = block_bytes(fields)
    do i = 1, size(fields)
      if (fields(i)%spread == at_supports) bytes(i) = bytes(i)* &
        count(held(scene%mesh%element_nodes))/size(scene%mesh%element_nodes)
      if (fields(i)%spread == at_contact) bytes(i) = bytes(i)*sizes%points/ &
        size(scene%mesh%element_nodes)
      if (fields(i)%kind == of_byte) bytes(i) = 0.0_wp
    end do
  end function nonzero_bytes

  !> Add fields, written so many times. HDF5 does not squeeze what is not 0 anywhere, nor what fits
  !> into a page.
  pure subroutine add_fields(fields, nonzero, times, once, file)
    type(field_t), intent(in) :: fields(:)
    real(wp), intent(in) :: nonzero(:) !! at a time [bytes]
    real(wp), intent(in) :: times
    real(wp), intent(inout) :: once    !! gets what is written one time only [bytes]
    type(file_size_t), intent(inout) :: file
    real(wp) :: all
    integer :: i

    do i = 1, size(fields)
      all = block_bytes(fields(i))
      if (fields(i)%written /= every_time) once = once + all
      if (fields(i)%written /= at_start) file%datasets = file%datasets + 1
      if (fields(i)%written /= every_time) cycle
      if (nonzero(i) < all .and. all > page) then
        file%varying = file%varying + times*nonzero(i)
        file%zeros = file%zeros + times*(all - nonzero(i))
      else
        file%dense = file%dense + times*all
      end if
      if (all <= chunk_cache) file%cache = file%cache + min(chunk_cache, times*all)
    end do
  end subroutine add_fields

  !> The nodes that any step holds.
  pure function prescribed_nodes(scene) result(held)
    type(scene_t), intent(in) :: scene
    logical :: held(scene%mesh%n_nodes)
    integer :: step

    held = .false.
    do step = 1, size(scene%steps)
      held(scene%steps(step)%boundary%node) = .true.
    end do
  end function prescribed_nodes

end module estimate_file_mod
