!> Who makes a result file: program, build, libraries, command.
module provenance_mod
  use kinds_mod, only: wp
  use system_mod, only: build_description, utc_now
  use parallel_mod, only: n_ranks
  use blas_core_mod, only: blas_core_name, blas_version
  use loaded_libraries_mod, only: loaded_libraries
  use sparse_factor_mod, only: sparse_factor_t, library_version
  use hdf5_files_mod, only: hdf5_version
  use result_run_mod, only: provenance_t
  use command_line_mod, only: command_text
  use tally_mod, only: tally_t, list_counters
  use version_mod, only: version
  implicit none
  private

  public :: make_provenance

contains

  !> What can be told at the start of a run, when its equations are analysed.
  type(provenance_t) function make_provenance(factor) result(provenance)
    type(sparse_factor_t), intent(in) :: factor
    type(tally_t) :: empty
    real(wp), allocatable :: unused(:)

    provenance%version = version
    provenance%build = build_description()
    provenance%libraries = library_text(factor)
    provenance%ranks = n_ranks()
    provenance%command = command_text()
    provenance%blas_core = blas_core_name()
    provenance%started = utc_now()
    call list_counters(empty, provenance%counters, unused)
  end function make_provenance

  !> Versions as the libraries tell them, and the files that were loaded.
  function library_text(factor) result(text)
    type(sparse_factor_t), intent(in) :: factor
    character(:), allocatable :: text, mumps, blas

    mumps = library_version(factor)
    if (mumps /= '') mumps = 'MUMPS '//mumps//', '
    blas = blas_version()
    if (blas == '') blas = 'BLAS'
    text = mumps//blas//', HDF5 '//hdf5_version()//'; loaded '//loaded_libraries([character(9) :: &
      'libdmumps', 'libsmumps', 'libmpi.so', 'metis', 'scotch-', 'blas', 'lapack', 'hdf5', &
      'gfortran'])
  end function library_text

end module provenance_mod
