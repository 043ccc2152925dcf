!> What the nodes of a slave surface face of an obstacle of facets: the mortar of a surface whose
!> nodes move as one. docs/theory.md section 11.
module facet_mortar_mod
  use kinds_mod, only: wp
  use obstacles_mod, only: obstacle_t
  use mortar_mod, only: mortar_t, make_mortar, reach_of_faces, reach_of_all, face_each_other
  implicit none
  private

  public :: face_facets, reach_of_facets, reach_of_all_facets, facets_face

contains

  !> Normals, areas and what nodes are apart from where the facets are; rows are empty.
  pure subroutine face_facets(slave, slave_nodes, x, obstacle, shift, reach, mortar, behind)
    integer, intent(in) :: slave(:, :)    !! (4,n_slave) nodes, anticlockwise from outside
    integer, intent(in) :: slave_nodes(:) !! (n) each once, in the order of the rows
    real(wp), intent(in) :: x(:, :)       !! (3,n_nodes) where they are now [length]
    type(obstacle_t), intent(in) :: obstacle !! as it has turned
    real(wp), intent(in) :: shift(3)      !! how far it has moved [length]
    real(wp), intent(in) :: reach         !! as of `make_mortar` [length]
    type(mortar_t), intent(out) :: mortar
    real(wp), intent(in), optional :: behind !! as of `make_mortar` [length]
    integer, allocatable :: slaves(:, :), facets(:, :), nodes(:)
    real(wp), allocatable :: places(:, :)

    call put_together(slave, slave_nodes, x, obstacle, shift, slaves, facets, nodes, places)
    call make_mortar(slaves, facets, nodes, places, reach, mortar, behind, is_rigid=.true.)
  end subroutine face_facets

  !> Half of the largest face, of the slave or of the obstacle.
  pure real(wp) function reach_of_facets(slave, slave_nodes, x, obstacle) result(reach)
    integer, intent(in) :: slave(:, :), slave_nodes(:)
    real(wp), intent(in) :: x(:, :)       !! (3,n_nodes) [length]
    type(obstacle_t), intent(in) :: obstacle
    integer, allocatable :: slaves(:, :), facets(:, :), nodes(:)
    real(wp), allocatable :: places(:, :)

    call put_together(slave, slave_nodes, x, obstacle, spread(0.0_wp, 1, 3), slaves, facets, nodes, &
      places)
    reach = reach_of_faces(slaves, facets, places)
  end function reach_of_facets

  !> How far apart the farthest places of slave and obstacle are, at most.
  pure real(wp) function reach_of_all_facets(slave_nodes, x, obstacle, shift) result(reach)
    integer, intent(in) :: slave_nodes(:)
    real(wp), intent(in) :: x(:, :)       !! (3,n_nodes) [length]
    type(obstacle_t), intent(in) :: obstacle
    real(wp), intent(in) :: shift(3)      !! [length]
    integer, allocatable :: slaves(:, :), facets(:, :), nodes(:)
    real(wp), allocatable :: places(:, :)
    integer :: i

    call put_together(reshape([integer ::], [4, 0]), slave_nodes, x, obstacle, shift, slaves, &
      facets, nodes, places)
    reach = reach_of_all(nodes, [(i, i=size(nodes) + 1, size(places, 2))], places)
  end function reach_of_all_facets

  !> Whether any slave face is turned towards any facet.
  pure logical function facets_face(slave, slave_nodes, x, obstacle) result(they_do)
    integer, intent(in) :: slave(:, :), slave_nodes(:)
    real(wp), intent(in) :: x(:, :)       !! (3,n_nodes) [length]
    type(obstacle_t), intent(in) :: obstacle
    integer, allocatable :: slaves(:, :), facets(:, :), nodes(:)
    real(wp), allocatable :: places(:, :)

    call put_together(slave, slave_nodes, x, obstacle, spread(0.0_wp, 1, 3), slaves, facets, nodes, &
      places)
    they_do = face_each_other(slaves, facets, places)
  end function facets_face

  !> Slave nodes and corners of facets as one list of nodes, slave nodes first.
  pure subroutine put_together(slave, slave_nodes, x, obstacle, shift, slaves, facets, nodes, places)
    integer, intent(in) :: slave(:, :), slave_nodes(:)
    real(wp), intent(in) :: x(:, :)       !! (3,n_nodes) [length]
    type(obstacle_t), intent(in) :: obstacle
    real(wp), intent(in) :: shift(3)      !! [length]
    integer, allocatable, intent(out) :: slaves(:, :), facets(:, :) !! (4,n_slave), (4,n_facets)
    integer, allocatable, intent(out) :: nodes(:)      !! (n) of the slave
    real(wp), allocatable, intent(out) :: places(:, :) !! (3,n+n_corners) [length]
    integer :: number(size(x, 2)), i, n

    n = size(slave_nodes)
    allocate (nodes(n), slaves(4, size(slave, 2)), facets(4, size(obstacle%facet, 2)))
    allocate (places(3, n + size(obstacle%corner, 2)))
    nodes(:) = [(i, i=1, n)]
    number(slave_nodes) = nodes
    do i = 1, size(slave, 2)
      slaves(:, i) = number(slave(:, i))
    end do
    facets(:, :) = merge(obstacle%facet + n, 0, obstacle%facet > 0)
    places(:, :n) = x(:, slave_nodes)
    do i = 1, size(obstacle%corner, 2)
      places(:, n + i) = obstacle%corner(:, i) + shift
    end do
  end subroutine put_together

end module facet_mortar_mod
