!> What the result file of a run will take, and the memory in which HDF5 keeps parts of it.
module estimate_file_mod
  use kinds_mod, only: wp
  use obstacles_mod, only: is_flat
  use scene_mod, only: scene_t
  use plan_mod, only: plan_t
  use count_sizes_mod, only: sizes_t
  implicit none
  private

  public :: file_size_t, size_of_file

  real(wp), parameter :: chunk_cache = 65536.0_wp !! of HDF5, a dataset at most [bytes]

  ! The file [bytes]: what a dataset that grows takes beside its table of chunks, an entry of that
  ! table, and the share of numbers that is left where HDF5 squeezes them.
  real(wp), parameter :: growing_dataset = 5200.0_wp, entry = 34.0_wp
  real(wp), parameter :: squeezed = 0.8_wp, page = 4096.0_wp
  integer, parameter :: history_datasets = 38, datasets_of_a_pair = 8

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

  !> The result file: fields of the outputs, contact of every increment, what grows empty.
  pure function size_of_file(scene, plan, sizes) result(file)
    type(scene_t), intent(in) :: scene
    type(plan_t), intent(in) :: plan
    type(sizes_t), intent(in) :: sizes
    type(file_size_t) :: file
    real(wp) :: held, once, contact, table, entries
    integer :: i

    held = count(prescribed_nodes(scene))
    file%datasets = history_datasets + datasets_of_a_pair*size(scene%pairs)
    contact = 0.0_wp
    associate (output => scene%output)
      if (output%displacement) call add_field(24.0_wp*sizes%nodes, 24.0_wp*sizes%nodes, sizes, file)
      if (output%reaction) call add_field(24.0_wp*sizes%nodes, 24.0_wp*held, sizes, file)
      if (output%contact .and. plan%points%n > 0) then
        call add_field(24.0_wp*sizes%nodes, 24.0_wp*sizes%points, sizes, file)
        call add_field(8.0_wp*sizes%nodes, 8.0_wp*sizes%points, sizes, file)
        call add_field(sizes%nodes, 0.0_wp, sizes, file)
      end if
      if (output%mesh_error) call add_field(8.0_wp*sizes%bricks, 8.0_wp*sizes%bricks, sizes, file)
      do i = 1, count([output%stress, output%strain])
        if (output%at_centroids) call add_field(48.0_wp*sizes%bricks, 48.0_wp*sizes%bricks, &
          sizes, file)
        if (output%at_nodes) call add_field(48.0_wp*sizes%nodes, 48.0_wp*sizes%nodes, sizes, file)
        if (output%at_gauss_points) call add_field(384.0_wp*sizes%bricks, 384.0_wp*sizes%bricks, &
          sizes, file)
      end do
    end associate
    ! Reactions, gaps, slips and status; frames where they turn.
    do i = 1, plan%points%n
      contact = contact + 65.0_wp
      if (is_flat(scene%obstacles(scene%pairs(plan%points%pair(i))%obstacle))) cycle
      contact = contact + 72.0_wp
    end do
    file%cache = file%cache + min(5.0_wp*chunk_cache, sizes%increments*contact)
    file%fields = file%dense + squeezed*file%varying + file%zeros/200.0_wp
    file%dense = file%dense + sizes%increments*contact
    ! The mesh and its ids; nodes, places, areas and frames of the points.
    once = 32.0_wp*sizes%nodes + 81.0_wp*sizes%bricks + 112.0_wp*sizes%points + &
      real(len(scene%deck), wp)
    ! A table of a dataset has room for the increments (result_file), for more where they may be
    ! cut; the state is there in two slots, and of the forces in it few are not 0.
    entries = max(256.0_wp, real(sizes%increments, wp))
    if (.not. all(scene%steps%direct)) entries = max(1024.0_wp, 2.0_wp*sizes%increments)
    table = growing_dataset + entry*min(65534.0_wp, entries)
    file%datasets = file%datasets + 2
    file%size = once + table*file%datasets + file%dense + squeezed*file%varying + &
      file%zeros/200.0_wp + 100.0_wp*sizes%nodes
    ! Nothing squeezed, and room to spare in the tables.
    file%most = once + 1.0e6_wp + 2.0_wp*table*file%datasets + file%dense + file%varying + &
      file%zeros + 340.0_wp*sizes%nodes
  end function size_of_file

  !> A field: all its numbers in an output, and those of them that are not 0 throughout. HDF5 does
  !> not squeeze what is not 0 anywhere, nor what fits into a page.
  pure subroutine add_field(all, varying, sizes, file)
    real(wp), intent(in) :: all, varying !! [bytes]
    type(sizes_t), intent(in) :: sizes
    type(file_size_t), intent(inout) :: file

    file%datasets = file%datasets + 2 ! with its offsets
    if (varying < all .and. all > page) then
      file%varying = file%varying + sizes%outputs*varying
      file%zeros = file%zeros + sizes%outputs*(all - varying)
    else
      file%dense = file%dense + sizes%outputs*all
    end if
    if (all <= chunk_cache) file%cache = file%cache + min(chunk_cache, sizes%outputs*all)
  end subroutine add_field

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
