!> What the nodes of a slave surface face of an obstacle of facets: the mortar of a surface whose
!> nodes move as one. docs/theory.md section 11.
module facet_mortar_mod
  use connectivity_mod, only: corners_in
  use kinds_mod, only: wp
  use obstacles_mod, only: obstacle_t
  use sorting_mod, only: sort_unique
  use surface_reach_mod, only: reach_of_faces, reach_of_all, face_each_other
  use mortar_rows_mod, only: mortar_t, slave_t
  use mortar_mod, only: make_mortar
  implicit none
  private

  public :: facet_pair_t, join_facets, near_facets, corners_of, face_facets, reach_of_facets, &
    reach_of_all_facets, facets_face

  !> A slave surface and facets, where both are, as faces over one list of places.
  type :: facet_pair_t
    type(slave_t) :: slave                !! by their places
    integer,  allocatable :: facet(:, :)  !! (4,n_facets) the same; the fourth is 0 in a triangle
    integer :: n = 0                      !! slave nodes: the first places
    real(wp), allocatable :: x(:, :)  !! (3,n+n_corners) [length]
  end type facet_pair_t

contains

  !> Slave nodes where they are now, and an obstacle as it has turned, moved by `shift`.
  pure type(facet_pair_t) function join_facets(slave, x, obstacle, shift, facets) result(pair)
    type(slave_t), intent(in) :: slave
    real(wp), intent(in) :: x(:, :)       !! (3,n_nodes) [length]
    type(obstacle_t), intent(in) :: obstacle
    real(wp), intent(in) :: shift(3)      !! [length]
    integer, intent(in), optional :: facets(:) !! those that count; left out: all
    integer :: number(0:size(x, 2)), i, n
    integer :: number_of_corner(0:size(obstacle%corner, 2))
    integer, allocatable :: corners(:)

    n = size(slave%nodes)
    pair%n = n
    number(0) = 0
    number(slave%nodes) = [(i, i=1, n)]
    pair%slave%nodes = [(i, i=1, n)]
    pair%slave%faces = reshape(number([slave%faces]), shape(slave%faces))
    if (allocated(slave%hanging)) pair%slave%hanging = reshape(number([slave%hanging]), &
      shape(slave%hanging))
    number_of_corner = [0, (n + i, i=1, size(obstacle%corner, 2))]
    if (present(facets)) then
      pair%facet = obstacle%facet(:, facets)
      corners = corners_of(pair%facet)
      number_of_corner(corners) = [(n + i, i=1, size(corners))]
    else
      pair%facet = obstacle%facet
      corners = [(i, i=1, size(obstacle%corner, 2))]
    end if
    do i = 1, size(pair%facet, 2)
      pair%facet(:, i) = number_of_corner(pair%facet(:, i))
    end do
    allocate (pair%x(3, n + size(corners)))
    pair%x(:, :n) = x(:, slave%nodes)
    do i = 1, size(corners)
      pair%x(:, n + i) = obstacle%corner(:, corners(i)) + shift
    end do
  end function join_facets

  !> The same with the facets alone that may cover a part of a slave face within reach.
  pure type(facet_pair_t) function near_facets(pair, reach) result(near)
    type(facet_pair_t), intent(in) :: pair
    real(wp), intent(in) :: reach         !! as of `make_mortar` [length]
    real(wp) :: low(3), high(3), far
    logical :: is_near(size(pair%facet, 2)), is_low(size(pair%x, 2)), is_high(size(pair%x, 2))
    integer :: f, i

    ! A facet may reach over a face from where its own corner is near.
    far = reach + 2.0_wp*reach_of_facets(pair)
    low = minval(pair%x(:, :pair%n), 2) - far
    high = maxval(pair%x(:, :pair%n), 2) + far
    is_near = .true.
    do i = 1, 3
      is_low = pair%x(i, :) < low(i)
      is_high = pair%x(i, :) > high(i)
      do f = 1, size(pair%facet, 2)
        associate (corner => pair%facet(:corners_in(pair%facet(:, f)), f))
          is_near(f) = is_near(f) .and. .not. (all(is_low(corner)) .or. all(is_high(corner)))
        end associate
      end do
    end do
    near%slave = pair%slave
    near%n = pair%n
    near%x = pair%x
    near%facet = pair%facet(:, pack([(f, f=1, size(is_near))], is_near))
  end function near_facets

  !> The corners of facets, ascending, each once.
  pure function corners_of(facet) result(corners)
    integer, intent(in) :: facet(:, :) !! (4,n_facets)
    integer, allocatable :: corners(:)

    corners = pack(facet, facet > 0)
    call sort_unique(corners)
  end function corners_of

  !> Normals, areas, and what nodes are apart from where the facets are; rows have nodes of the
  !> slave alone.
  pure subroutine face_facets(pair, reach, mortar, behind)
    type(facet_pair_t), intent(in) :: pair
    real(wp), intent(in) :: reach            !! as of `make_mortar` [length]
    type(mortar_t), intent(out) :: mortar    !! in the order of the slave nodes
    real(wp), intent(in), optional :: behind !! as of `make_mortar` [length]

    call make_mortar(pair%slave, pair%facet, pair%x, reach, mortar, behind, is_rigid=.true.)
  end subroutine face_facets

  !> Half of the largest face, of the slave or of the obstacle.
  pure real(wp) function reach_of_facets(pair) result(reach)
    type(facet_pair_t), intent(in) :: pair

    reach = reach_of_faces(pair%slave%faces, pair%facet, pair%x)
  end function reach_of_facets

  !> How far apart the farthest places of slave and obstacle are, at most.
  pure real(wp) function reach_of_all_facets(pair) result(reach)
    type(facet_pair_t), intent(in) :: pair
    integer :: i

    reach = reach_of_all([(i, i=1, pair%n)], [(i, i=pair%n + 1, size(pair%x, 2))], pair%x)
  end function reach_of_all_facets

  !> Whether any slave face is turned towards any facet.
  pure logical function facets_face(pair)
    type(facet_pair_t), intent(in) :: pair

    facets_face = face_each_other(pair%slave%faces, pair%facet, pair%x)
  end function facets_face

end module facet_mortar_mod
