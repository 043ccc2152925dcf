!> Equilibria that are unstable: what ends a run for it, in words.
module refuse_unstable_mod
  use errors_mod, only: error_t
  use text_mod, only: counted
  use increments_mod, only: increment_t
  use mesh_mod, only: mesh_t, kind_c3d8
  use cells_mod, only: hexahedron_20_reduced
  use stability_mod, only: stability_t
  use name_refusal_mod, only: raise_at
  implicit none
  private

  public :: refuse_unstable, unstable_in_words, meshes_that_buckle

contains

  !> An equilibrium that the least disturbance leaves is not what a body does.
  subroutine refuse_unstable(mesh, increment, stability, error)
    type(mesh_t), intent(in) :: mesh
    type(increment_t), intent(in) :: increment
    type(stability_t), intent(in) :: stability !! with unstable motions
    type(error_t), allocatable, intent(out) :: error

    call raise_at(increment, error, 'the equilibrium is unstable'//unstable_in_words(stability))
    error%n_meshes = meshes_that_buckle(mesh)
  end subroutine refuse_unstable

  !> How many meshes have to buckle until all finer ones do. Those are softer, so one is enough, but
  !> for elements that may be too soft where they are large.
  pure integer function meshes_that_buckle(mesh) result(n)
    type(mesh_t), intent(in) :: mesh

    n = merge(1, 2, all(mesh%element_kind == kind_c3d8 .and. mesh%connectivity%cell /= &
      hexahedron_20_reduced))
  end function meshes_that_buckle

  !> In how many ways an equilibrium is unstable, and what may be done.
  pure function unstable_in_words(stability) result(words)
    type(stability_t), intent(in) :: stability
    character(:), allocatable :: words

    words = ' ('//counted(stability%n_unstable, 'motion')//' of the body would release '// &
      'energy): it buckles'
    if (stability%by_element) then
      words = words//', or the elements do: C3D8I instead of C3D8B, or smaller strains, tell'
    else
      words = words//'; a small imperfection of its shape or a small force across it leads to '// &
        'the stable equilibrium'
    end if
  end function unstable_in_words

end module refuse_unstable_mod
