!> The memory of a run, from its sizes: a sum over the arrays that it has.
module estimate_memory_mod
  use kinds_mod, only: wp, i8
  use resource_limits_mod, only: resident_bytes
  use parallel_mod, only: usage_t, usage_of_others
  use controls_mod, only: is_exact, precision_controls_t
  use count_sizes_mod, only: sizes_t
  use estimate_file_mod, only: file_size_t
  implicit none
  private

  public :: take_precision, peak_memory, needed_memory, taken_already, room_within, enough

  ! Memory that no array of the run explains [bytes]: pages of the libraries' code that are first
  ! touched by a solution and by writing, HDF5's own tables, the heap's unused parts.
  real(wp), parameter :: libraries = 15.0e6_wp
  ! What must be left whenever a library is called (resource_limits_mod) [bytes].
  real(wp), parameter :: granted = 32.0e6_wp

  real(wp), parameter :: of_panels = 2.0_wp !! of W in single precision, a number of W [bytes]
  real(wp), parameter :: near_interface = 3.0e3_wp
  !! a number of the interface, where W is not formed [bytes]

  !> Of the memory that is left, what a plan with an alternative may take: estimates are that good.
  real(wp), parameter :: enough = 0.9_wp

contains

  !> Sizes of numbers in an arithmetic, and the least that the factor takes.
  pure subroutine take_precision(precision, sizes)
    type(precision_controls_t), intent(in) :: precision
    type(sizes_t), intent(inout) :: sizes

    sizes%word = merge(4.0_wp, 8.0_wp, precision%single_factor)
    sizes%is_exact = is_exact(precision)
    sizes%by_iteration = precision%iterative
    sizes%columns = 0.0_wp
    if (sizes%is_exact .and. sizes%is_dense) sizes%columns = sizes%most_columns
    sizes%workspace = sizes%fraction_here*sizes%word*sizes%factor
    if (precision%out_of_core) sizes%workspace = 0.0_wp
  end subroutine take_precision

  !> What the run takes beside what the process has already, at the peak: while it factorises, or
  !> afterwards.
  pure real(wp) function peak_memory(sizes, file) result(bytes)
    type(sizes_t), intent(in) :: sizes
    type(file_size_t), intent(in) :: file
    real(wp) :: matrix, mesh, factorising, running, copying, square, copies

    ! Row, column and value of every entry, ours and MUMPS's copy; neighbours, numbers of the
    ! unknowns, their order.
    matrix = (24.0_wp + sizes%word)*sizes%entries
    mesh = 4.0_wp*sizes%neighbours + 24.0_wp*sizes%nodes + 12.0_wp*sizes%equations
    ! The Schur complement beside MUMPS's fronts.
    square = merge(1.0_wp, 0.0_wp, sizes%is_dense)
    factorising = matrix + mesh + sizes%workspace + square*sizes%word*sizes%interface**2
    ! What is near the points, and their blocks of it.
    if (.not. sizes%is_dense) factorising = factorising + near_interface*sizes%interface
    ! The factor stays; compliance and W, of which proximal steps have a copy; responses and loads
    ! of two patterns, old and new state, forces and fields of a step: some thirty vectors over the
    ! nodes; the columns of the increments ahead, ours and MUMPS's; HDF5's chunks.
    copies = merge(2.0_wp, 1.0_wp, sizes%has_twins)
    running = sizes%workspace + square*(8.0_wp*sizes%squares + &
      (8.0_wp + of_panels)*copies*sizes%rows**2) + &
      (1.0_wp - square)*near_interface*sizes%interface + &
      30.0_wp*24.0_wp*sizes%nodes + 16.0_wp*sizes%equations*sizes%columns + krylov_bytes(sizes) + &
      file%cache
    ! Shadow runs: states, Anderson's displacements, the scene; and once a *STEP another factor.
    if (sizes%shadows > 0.0_wp) running = running + matrix + mesh + sizes%workspace + &
      (20.0_wp + 10.0_wp*sizes%shadows)*24.0_wp*sizes%nodes
    ! The Schur complement beside its blocks, which are copied out of it where there are several.
    copying = 0.0_wp
    if (sizes%squares < sizes%interface**2) copying = mesh + sizes%workspace + &
      square*8.0_wp*(sizes%interface**2 + sizes%squares)
    bytes = sizes%ranks*libraries + max(factorising, running, copying)
  end function peak_memory

  !> What must be free for that.
  pure real(wp) function needed_memory(sizes, file) result(bytes)
    type(sizes_t), intent(in) :: sizes
    type(file_size_t), intent(in) :: file

    bytes = peak_memory(sizes, file) + granted
  end function needed_memory

  !> The vectors of GMRES that are used; where bodies are free the dense system of the response to
  !> their motions, and LAPACK's copy.
  pure real(wp) function krylov_bytes(sizes) result(bytes)
    type(sizes_t), intent(in) :: sizes
    real(wp), parameter :: most_dense = 1000.0_wp ! rows, of global_newton

    bytes = 8.0_wp*40.0_wp*sizes%rows + 1.3e6_wp*min(1.0_wp, sizes%rows/100.0_wp)
    if (sizes%motions > 0.0_wp .and. sizes%rows <= most_dense .and. sizes%is_dense) bytes = &
      bytes + 16.0_wp*sizes%rows**2
  end function krylov_bytes

  !> Memory that the process has and does not get again: what runs before this one have touched of
  !> the libraries is counted with those.
  real(wp) function taken_already(runs_before) result(bytes)
    integer, intent(in) :: runs_before !! as of choices_t
    type(usage_t) :: others

    others = usage_of_others()
    bytes = real(resident_bytes() + others%resident, wp)
    if (runs_before > 0) bytes = bytes - others%ranks_here*libraries
  end function taken_already

  !> What a run may take beside that for its peak to stay below a bound: what must be left whenever
  !> a library is called need not be used.
  integer(i8) function room_within(memory, runs_before) result(bytes)
    real(wp), intent(in) :: memory     !! the bound [bytes]
    integer, intent(in) :: runs_before !! as of choices_t

    bytes = int(max(0.0_wp, memory + granted - taken_already(runs_before)), i8)
  end function room_within

end module estimate_memory_mod
