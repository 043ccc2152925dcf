!> Whether constraints join the pieces of a body to one that is rigid as a whole.
!>
!> Pieces that a tie joins count as one body, with the six motions of one. A tie on a single line of
!> nodes is a hinge, and one that supports take the place of may hold nothing: then pieces move
!> against each other without a force, and the stiffness is singular.
module tied_pieces_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t, raise, exit_not_solved, exit_machine
  use text_mod, only: to_text
  use small_matrix_mod, only: cross
  use dense_mod, only: symmetric_eigenvectors
  use constraints_mod, only: constraints_t
  use mesh_mod, only: mesh_t, find_bodies
  use rigid_modes_mod, only: free_motions_t, is_joined
  implicit none
  private

  public :: check_pieces

  integer, parameter :: most_pieces = 150 !! of a body; of more a singular stiffness tells
  real(wp), parameter :: nothing = 1.0e-14_wp
  !! of the largest eigenvalue: squares of singular values [-]

contains

  !> Refuse a body whose pieces can move against each other.
  subroutine check_pieces(mesh, active, prescribed, motions, error)
    type(mesh_t), intent(in) :: mesh           !! its bodies are joined by the constraints
    type(constraints_t), intent(in) :: active  !! that hold with these supports
    logical, intent(in) :: prescribed(:, :)    !! (3,n_nodes)
    type(free_motions_t), intent(in) :: motions
    type(error_t), allocatable, intent(out) :: error !! a mechanism; LAPACK failed
    type(mesh_t) :: apart
    integer :: body, piece, n
    integer, allocatable :: pieces(:), of_body(:)

    if (active%n == 0) return
    apart%n_nodes = mesh%n_nodes
    apart%n_elements = mesh%n_elements
    apart%connectivity = mesh%connectivity
    call find_bodies(apart)
    allocate (of_body(apart%n_bodies), source=0)
    do n = 1, mesh%n_nodes
      if (apart%body(n) > 0) of_body(apart%body(n)) = mesh%body(n)
    end do
    do body = 1, mesh%n_bodies
      if (is_joined(motions, body)) cycle ! by equations: motions of the pieces are free motions
      pieces = pack([(piece, piece=1, apart%n_bodies)], of_body == body)
      if (size(pieces) < 2 .or. size(pieces) > most_pieces) cycle
      call check_body(mesh, apart%body, pieces, active, prescribed, count(motions%body == body), &
        error)
      if (allocated(error)) return
    end do
  end subroutine check_pieces

  !> Count the motions of the pieces that neither constraints nor supports see.
  subroutine check_body(mesh, piece_of, pieces, active, prescribed, n_motions, error)
    type(mesh_t), intent(in) :: mesh
    integer, intent(in) :: piece_of(:)         !! (n_nodes)
    integer, intent(in) :: pieces(:)           !! of the body
    type(constraints_t), intent(in) :: active
    logical, intent(in) :: prescribed(:, :)    !! (3,n_nodes)
    integer, intent(in) :: n_motions           !! of the body as a whole
    type(error_t), allocatable, intent(out) :: error
    real(wp), dimension(3, size(pieces)) :: low, high
    real(wp) :: gram(6*size(pieces), 6*size(pieces)), seen(6*size(pieces))
    real(wp) :: eigenvalues(6*size(pieces))
    integer :: position(maxval(piece_of)), node, c, i, k
    logical :: ok

    position = 0
    position(pieces) = [(k, k=1, size(pieces))]
    low = huge(1.0_wp)
    high = -huge(1.0_wp)
    do node = 1, mesh%n_nodes
      if (index_of(node) == 0) cycle
      associate (p => index_of(node), x => mesh%coordinates(:, node))
        low(:, p) = min(low(:, p), x)
        high(:, p) = max(high(:, p), x)
      end associate
    end do
    gram = 0.0_wp
    do c = 1, active%n
      if (index_of(active%node(c)) == 0) cycle
      seen = 0.0_wp
      call add_motion(active%node(c), active%dof(c), 1.0_wp)
      do k = active%first(c), active%first(c + 1) - 1
        call add_motion(active%master(k), active%master_dof(k), -active%weight(k))
      end do
      call add_square()
    end do
    do node = 1, mesh%n_nodes
      if (index_of(node) == 0) cycle
      do i = 1, 3
        if (.not. prescribed(i, node)) cycle
        seen = 0.0_wp
        call add_motion(node, i, 1.0_wp)
        call add_square()
      end do
    end do
    call symmetric_eigenvectors(gram, eigenvalues, ok)
    if (.not. ok) then
      call raise(error, exit_machine, 'LAPACK failed on the motions of tied bodies')
      return
    end if
    if (count(eigenvalues <= nothing*maxval(eigenvalues)) <= n_motions) return
    call raise(error, exit_not_solved, 'the ties of the body of node '// &
      to_text(mesh%node_id(findloc(piece_of, pieces(1), dim=1)))//' leave its pieces free to '// &
      'move against each other: they hold them on a line or a point, or supports hold the tied '// &
      'nodes instead')

  contains

    integer function index_of(node)
      integer, intent(in) :: node

      index_of = 0
      if (piece_of(node) > 0) index_of = position(piece_of(node))
    end function index_of

    !> Add what the six motions of a node's piece do to it.
    subroutine add_motion(node, dof, weight)
      integer, intent(in) :: node, dof
      real(wp), intent(in) :: weight !! [-]
      real(wp) :: arm(3), axis(3), turn(3)
      integer :: p, l

      p = index_of(node)
      arm = (mesh%coordinates(:, node) - 0.5_wp*(low(:, p) + high(:, p)))/ &
        maxval(high(:, p) - low(:, p))
      seen(6*(p - 1) + dof) = seen(6*(p - 1) + dof) + weight
      do l = 1, 3
        axis = 0.0_wp
        axis(l) = 1.0_wp
        turn = cross(axis, arm)
        seen(6*(p - 1) + 3 + l) = seen(6*(p - 1) + 3 + l) + weight*turn(dof)
      end do
    end subroutine add_motion

    !> Add what is seen of two motions to their product: few pieces are seen at once.
    subroutine add_square()
      integer, allocatable :: list(:)
      integer :: l

      list = pack([(l, l=1, size(seen))], abs(seen) > 0.0_wp)
      do l = 1, size(list)
        gram(list, list(l)) = gram(list, list(l)) + seen(list)*seen(list(l))
      end do
    end subroutine add_square

  end subroutine check_body

end module tied_pieces_mod
