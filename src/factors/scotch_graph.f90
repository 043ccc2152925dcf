!> A guard for MUMPS's block low rank, whose analysis divides fronts into blocks by SCOTCH.
!>
!> MUMPS 5.5 hands SCOTCH a graph that it has not initialised, which SCOTCH 7 takes for anything:
!> the analysis then ends in a segmentation fault, or does not, by what the stack held before. Under
!> the name that MUMPS calls this initialises the graph and then goes on to SCOTCH's own procedure,
!> which has a second name. An initialisation more does no harm where MUMPS has learnt it. The same
!> seed every time, and one thread, make the same blocks in every run.
module scotch_graph_mod
  use, intrinsic :: iso_c_binding, only: c_ptr, c_int
  use system_mod, only: set_environment
  implicit none
  private

  public :: build_graph

  interface
    subroutine initialise(graph, status) bind(C, name='SCOTCHFGRAPHINIT')
      import :: c_ptr, c_int
      implicit none
      type(c_ptr), value :: graph
      integer(c_int), intent(out) :: status
    end subroutine initialise

    subroutine seed(number) bind(C, name='SCOTCHFRANDOMSEED')
      import :: c_int
      implicit none
      integer(c_int), intent(in) :: number
    end subroutine seed

    subroutine reset() bind(C, name='SCOTCHFRANDOMRESET')
      implicit none
    end subroutine reset

    !> SCOTCH's arguments as they come: none is looked at here.
    subroutine build(a1, a2, a3, a4, a5, a6, a7, a8, a9, a10, a11) bind(C, &
      name='SCOTCHFGRAPHBUILD')
      import :: c_ptr
      implicit none
      type(c_ptr), value :: a1, a2, a3, a4, a5, a6, a7, a8, a9, a10, a11
    end subroutine build
  end interface

contains

  !> What MUMPS calls.
  ! allow(too-many-arguments)
  subroutine build_graph(a1, a2, a3, a4, a5, a6, a7, a8, a9, a10, a11) bind(C, &
    name='scotchfgraphbuild_')
    type(c_ptr), value :: a1 !! the graph
    type(c_ptr), value :: a2, a3, a4, a5, a6, a7, a8, a9, a10
    type(c_ptr), value :: a11 !! status
    integer(c_int) :: status
    logical :: worked

    ! One thread, unless the environment says otherwise: more are slower and never do the same
    ! twice.
    call set_environment('SCOTCH_PTHREAD_NUMBER', '1', .false., worked)
    call seed(1_c_int)
    call reset()
    call initialise(a1, status)
    call build(a1, a2, a3, a4, a5, a6, a7, a8, a9, a10, a11)
  end subroutine build_graph

end module scotch_graph_mod
