!> How fine the mesh of a deck is made, beside what the deck says.
module mesh_size_mod
  use kinds_mod, only: wp, i8
  implicit none
  private

  public :: mesh_size_t, relative_size, is_same_size, is_of_deck, blocks_t, common_divisor, &
    zone_t, is_near

  real(wp), parameter :: ring = 1.5_wp !! of an element's diagonal: between two edges and three [-]

  !> Where elements are cut again: about balls, and as far around them as an element is large.
  type :: zone_t
    integer :: times = 0
    real(wp), allocatable :: balls(:, :) !! (4,n) centre and radius [length]
  end type zone_t

  !> A mesh of the deck: that which it writes down, of other blocks, refined.
  type :: mesh_size_t
    integer :: blocks(2) = [1, 1]
    !! of the elements along each axis of each *BLOCK there are blocks(1)/blocks(2) times as many
    integer :: parts = 1 !! into which every edge of an element is cut
    integer :: across = 0
    !! the axis, 1 to 3, along which blocks and elements stay as they are: that across a slice in
    !! plane strain; 0: none
    type(zone_t) :: zone = zone_t() !! where they are cut again
  end type mesh_size_t

  !> The blocks of a deck that may have more or fewer elements without its saying something else:
  !> their NX, NY and NZ, or one of these.
  type :: blocks_t
    integer :: common = 0  !! divides all of them, the largest number; 0: none may
    integer :: longest = 0 !! the largest of them
  end type blocks_t

contains

  !> The edge of an element over that of the deck's.
  pure real(wp) function relative_size(mesh_size)
    type(mesh_size_t), intent(in) :: mesh_size

    relative_size = real(mesh_size%blocks(2), wp)/(real(mesh_size%blocks(1), wp)* &
      real(mesh_size%parts, wp))
  end function relative_size

  !> Whether it is the mesh that the deck writes down.
  pure logical function is_of_deck(mesh_size)
    type(mesh_size_t), intent(in) :: mesh_size

    is_of_deck = is_same_size(mesh_size, mesh_size_t()) .and. mesh_size%zone%times == 0
  end function is_of_deck

  !> Whether two meshes have equally large elements where these are not cut again.
  pure logical function is_same_size(one, other)
    type(mesh_size_t), intent(in) :: one, other

    is_same_size = one%parts*int(one%blocks(1), i8)*other%blocks(2) == &
      other%parts*int(other%blocks(1), i8)*one%blocks(2)
  end function is_same_size

  !> The largest number that divides both.
  elemental integer function common_divisor(one, other) result(divisor)
    integer, intent(in) :: one, other !! 0 or more
    integer :: rest, last

    divisor = one
    rest = other
    do while (rest > 0)
      last = mod(divisor, rest)
      divisor = rest
      rest = last
    end do
  end function common_divisor

  !> Whether an element lies in a zone, or in the ring around it.
  pure logical function is_near(zone, x, across)
    type(zone_t), intent(in) :: zone
    real(wp), intent(in) :: x(:, :)   !! (3,n) its nodes [length]
    integer, intent(in) :: across     !! the axis along which it stays as it is, as of mesh_size_t
    real(wp) :: low(3), high(3), reach
    integer :: i

    is_near = .false.
    if (zone%times == 0) return
    low = minval(x, 2)
    high = maxval(x, 2)
    reach = ring*norm2(pack(high - low, [1, 2, 3] /= across))
    do i = 1, size(zone%balls, 2)
      associate (centre => zone%balls(:3, i), radius => zone%balls(4, i))
        is_near = norm2(max(low - centre, centre - high, 0.0_wp)) <= radius + reach
      end associate
      if (is_near) return
    end do
  end function is_near

end module mesh_size_mod
