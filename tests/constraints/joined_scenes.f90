!> Decks whose constraints are held against motions that must satisfy them.
module joined_scenes
  use constraints_mod, only: constraints_t
  use errors_mod, only: error_t
  use kinds_mod, only: wp
  use read_deck_mod, only: read_deck_text
  use scene_mod, only: scene_t
  use small_matrix_mod, only: cross
  use text_mod, only: string_t
  implicit none
  private

  public :: read_text, moved_rigidly, torn, worst_rigid_motion

  character, parameter, public :: lf = achar(10)
  character(*), parameter, public :: steel = '*MATERIAL, NAME=M'//lf//'*ELASTIC'//lf// &
    '1000., 0.3'//lf
  character(*), parameter, public :: section = '*SOLID SECTION, MATERIAL=M, ELSET='
  character(*), parameter, public :: step = '*STEP'//lf//'*STATIC'//lf//'1., 1.'//lf
  character(*), parameter, public :: end_step = '*END STEP'//lf

contains

  subroutine read_text(text, scene, message)
    character(*), intent(in) :: text
    type(scene_t), intent(out) :: scene
    character(:), allocatable, intent(out) :: message
    type(error_t), allocatable :: error
    type(string_t) :: none(0)

    call read_deck_text(text, 'my.inp', none, scene, error)
    message = ''
    if (allocated(error)) message = error%message
  end subroutine read_text

  !> Displacements of all nodes in a small rigid motion: those that stand for rotations turn, those
  !> that stand in for local directions move as the node does along these.
  pure function moved_rigidly(scene, shift, rotation) result(u)
    type(scene_t), intent(in) :: scene
    real(wp), intent(in) :: shift(3), rotation(3)
    real(wp), allocatable :: u(:, :) !! (3,n_nodes)
    integer :: i

    allocate (u(3, scene%mesh%n_nodes))
    do i = 1, scene%mesh%n_nodes
      u(:, i) = shift + cross(rotation, scene%mesh%coordinates(:, i))
    end do
    if (allocated(scene%rotations)) then
      do i = 1, size(scene%rotations)
        u(:, scene%rotations(i)%rotation_node) = rotation*scene%rotations(i)%length
      end do
    end if
    if (.not. allocated(scene%local_axes)) return
    do i = 1, size(scene%local_axes)
      associate (of => scene%local_axes(i))
        u(:, of%stand_in) = matmul(of%direction, u(:, of%node))
      end associate
    end do
  end function moved_rigidly

  !> By how much displacements violate constraints, at most.
  pure real(wp) function torn(constraints, u)
    type(constraints_t), intent(in) :: constraints
    real(wp), intent(in) :: u(:, :) !! (3,n_nodes)
    real(wp) :: gap
    integer :: c, k

    torn = 0.0_wp
    do c = 1, constraints%n
      gap = u(constraints%dof(c), constraints%node(c))
      do k = constraints%first(c), constraints%first(c + 1) - 1
        gap = gap - constraints%weight(k)*u(constraints%master_dof(k), constraints%master(k))
      end do
      torn = max(torn, abs(gap))
    end do
  end function torn

  !> By how much unit translations and unit rotations violate the constraints of a scene, at most.
  pure real(wp) function worst_rigid_motion(scene) result(worst)
    type(scene_t), intent(in) :: scene
    real(wp), parameter :: none(3) = 0.0_wp
    real(wp) :: axis(3)
    integer :: a

    worst = 0.0_wp
    do a = 1, 3
      axis = 0.0_wp
      axis(a) = 1.0_wp
      worst = max(worst, torn(scene%constraints, moved_rigidly(scene, axis, none)), &
        torn(scene%constraints, moved_rigidly(scene, none, axis)))
    end do
  end function worst_rigid_motion

end module joined_scenes
