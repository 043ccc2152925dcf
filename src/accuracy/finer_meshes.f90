!> The meshes of a sequence: the coarsest that it begins with, and finer ones.
module finer_meshes_mod
  use kinds_mod, only: wp
  use mesh_size_mod, only: mesh_size_t, blocks_t, common_divisor, relative_size
  use scene_mod, only: scene_t
  use mesh_sequence_mod, only: mesh_sequence_t, family_t, start_sequence, has_bound, mesh_runs
  implicit none
  private

  public :: begin_sequence, finer, next_finer, odd_finer, skip_mesh, mesh_before
  public :: least_step, largest_step, second_step

  integer, parameter :: fewest_elements = 2 !! along the longest edge of a block, to begin with
  integer, parameter :: fewest_of_trial = 4 !! likewise, where increments are tried
  real(wp), parameter :: least_step = 1.25_wp, largest_step = 2.0_wp
  !! from size to size: nearer meshes differ by scatter, half the size takes thirty times as long
  real(wp), parameter :: second_step = 1.5_wp !! from the first size to the second
  real(wp), parameter :: rounding = 1.0e-9_wp

contains

  !> A sequence without runs; the mesh to begin with is that of the deck where its blocks cannot
  !> have other elements.
  subroutine begin_sequence(deck, blocks, across, sequence)
    type(scene_t), intent(in) :: deck       !! as written
    type(blocks_t), intent(in) :: blocks(3) !! of it that may have others, along each axis
    integer, intent(in) :: across           !! the axis across it, if it is a slice; else 0
    type(mesh_sequence_t), intent(out) :: sequence

    call start_sequence(deck, sequence)
    sequence%blocks = but_across(blocks, across)
    sequence%trial = coarsest(sequence%blocks, fewest_of_trial)
    sequence%first = sequence%trial
    ! What coarser meshes take is too little to foresee others by.
    if (.not. has_bound(sequence)) sequence%first = coarsest(sequence%blocks, fewest_elements)
    sequence%trial%across = across
    sequence%first%across = across
  end subroutine begin_sequence

  !> Blocks along all axes but that across a slice.
  pure type(blocks_t) function but_across(blocks, across) result(all_of)
    type(blocks_t), intent(in) :: blocks(3)
    integer, intent(in) :: across !! 0: none is left out
    integer :: axis

    do axis = 1, 3
      if (axis == across) cycle
      all_of%common = common_divisor(all_of%common, blocks(axis)%common)
      all_of%longest = max(all_of%longest, blocks(axis)%longest)
    end do
  end function but_across

  !> The coarsest mesh with so many elements along the longest edge of a block.
  pure type(mesh_size_t) function coarsest(blocks, fewest)
    type(blocks_t), intent(in) :: blocks
    integer, intent(in) :: fewest

    coarsest = mesh_size_t()
    if (blocks%common == 0) return
    coarsest%blocks = [1, blocks%common]
    do while (coarsest%blocks(1)*blocks%longest < fewest*blocks%common)
      coarsest%blocks(1) = coarsest%blocks(1) + 1
    end do
  end function coarsest

  !> A finer mesh, of elements about so many times smaller.
  pure type(mesh_size_t) function finer(sequence, mesh_size, times)
    type(mesh_sequence_t), intent(in) :: sequence
    type(mesh_size_t), intent(in) :: mesh_size
    real(wp), intent(in) :: times
    integer, parameter :: few = 3 !! another one is a third of them

    finer = mesh_size
    if (sequence%blocks%common == 0) then
      finer%parts = more(mesh_size%parts)
      return
    end if
    finer%blocks(1) = more(mesh_size%blocks(1))
    ! Even numbers: a node in the middle is there on all meshes, but for the very first.
    associate (n => finer%blocks(1))
      if (n > few .and. mod(n, 2) == 1) n = merge(n - 1, n + 1, n - 1 >= least_step* &
        mesh_size%blocks(1))
    end associate

  contains

    pure integer function more(n)
      integer, intent(in) :: n

      more = ceiling(max(least_step, min(times, largest_step))*real(n, wp) - rounding)
    end function more

  end function finer

  !> The next finer mesh.
  pure type(mesh_size_t) function next_finer(sequence, mesh_size)
    type(mesh_sequence_t), intent(in) :: sequence
    type(mesh_size_t), intent(in) :: mesh_size

    next_finer = mesh_size
    if (sequence%blocks%common == 0) then
      next_finer%parts = mesh_size%parts + 1
    else
      next_finer%blocks(1) = mesh_size%blocks(1) + 2 - mod(mesh_size%blocks(1), 2)
    end if
  end function next_finer

  !> A mesh with one more element along an edge, where the next one has two.
  pure type(mesh_size_t) function odd_finer(sequence, mesh_size) result(finer)
    type(mesh_sequence_t), intent(in) :: sequence
    type(mesh_size_t), intent(in) :: mesh_size

    finer = next_finer(sequence, mesh_size)
    if (sequence%blocks%common > 0) finer%blocks(1) = mesh_size%blocks(1) + 1
  end function odd_finer

  !> Begin with a finer mesh than the one that was not solved; coarser ones, if any was, are too
  !> coarse to count.
  subroutine skip_mesh(sequence, not_solved)
    type(mesh_sequence_t), intent(inout) :: sequence
    type(mesh_size_t), intent(in) :: not_solved

    sequence%first = finer(sequence, not_solved, least_step)
    sequence%runs = sequence%runs(:0)
    if (relative_size(sequence%first) < relative_size(sequence%trial)) sequence%trial = &
      sequence%first
  end subroutine skip_mesh

  !> The next of the meshes with undivided increments that lead to one where these are tried.
  pure type(mesh_size_t) function mesh_before(sequence)
    type(mesh_sequence_t), intent(in) :: sequence

    associate (runs => mesh_runs(sequence, family_t()))
      mesh_before = finer(sequence, sequence%runs(runs(size(runs)))%mesh_size, merge(second_step, &
        least_step, size(runs) == 1))
    end associate
  end function mesh_before

end module finer_meshes_mod
