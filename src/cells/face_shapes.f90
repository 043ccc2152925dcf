!> The faces of cells: triangles and quadrilaterals with or without mid-side nodes, their shape
!> functions and quadrature. Nodes: the corners anticlockwise from outside, then the middles of the
!> edges, that of corners 1 and 2 first.
!>
!> Natural coordinates go from -1 to 1 across a quadrilateral, and from 0 to 1 along the edges from
!> the first corner of a triangle. docs/theory.md, section 8.
module face_shapes_mod
  use kinds_mod, only: wp
  use cells_mod, only: face_nodes
  implicit none
  private

  public :: face_rule_t, rule_of, face_functions, face_gradients, is_triangle, &
    places_of_nodes, terms_of_functions, find_monomials, find_values, slopes_of

  integer, parameter :: most_points = 9

  !> Points in natural coordinates. Integrals of a shape function times the area vector of any face
  !> are exact, and of two shape functions where edges are straight and opposite ones parallel.
  type :: face_rule_t
    integer :: n = 0
    real(wp) :: point(2, most_points) = 0.0_wp !! [-]
    real(wp) :: weight(most_points) = 0.0_wp   !! [-]
  end type face_rule_t

  ! The rule of degree 5 on a triangle, Radon's: the middle and two groups of three.
  real(wp), parameter :: root = sqrt(15.0_wp)
  real(wp), parameter :: inner = (6.0_wp + root)/21.0_wp, outer = (6.0_wp - root)/21.0_wp
  real(wp), parameter :: triangle(2, 7) = reshape([1.0_wp/3.0_wp, 1.0_wp/3.0_wp, &
    inner, inner, 1.0_wp - 2.0_wp*inner, inner, inner, 1.0_wp - 2.0_wp*inner, &
    outer, outer, 1.0_wp - 2.0_wp*outer, outer, outer, 1.0_wp - 2.0_wp*outer], [2, 7])
  real(wp), parameter :: triangle_weight(7) = 0.5_wp*[9.0_wp/40.0_wp, &
    spread((155.0_wp + root)/1200.0_wp, 1, 3), spread((155.0_wp - root)/1200.0_wp, 1, 3)]
  real(wp), parameter :: line(3) = [-sqrt(0.6_wp), 0.0_wp, sqrt(0.6_wp)]
  real(wp), parameter :: line_weight(3) = [5.0_wp, 8.0_wp, 5.0_wp]/9.0_wp
  real(wp), parameter :: corner(2, 4) = reshape([real(wp) :: -1, -1, 1, -1, 1, 1, -1, 1], [2, 4])
  real(wp), parameter :: gauss = 1.0_wp/sqrt(3.0_wp)

contains

  !> Whether a face of so many nodes has three corners.
  pure elemental logical function is_triangle(n_nodes)
    integer, intent(in) :: n_nodes !! 3, 4, 6 or 8

    is_triangle = modulo(n_nodes, 3) == 0
  end function is_triangle

  !> The quadrature of a face.
  pure type(face_rule_t) function rule_of(n_nodes) result(rule)
    integer, intent(in) :: n_nodes !! 3, 4, 6 or 8
    integer :: i

    if (is_triangle(n_nodes)) then
      rule%n = 7
      rule%point(:, :7) = triangle
      rule%weight(:7) = triangle_weight
    else if (n_nodes == 4) then
      rule%n = 4
      rule%point(:, :4) = gauss*corner
      rule%weight(:4) = 1.0_wp
    else
      rule%n = 9
      do i = 1, 3
        rule%point(1, 3*i - 2:3*i) = line
        rule%point(2, 3*i - 2:3*i) = line(i)
        rule%weight(3*i - 2:3*i) = line_weight*line_weight(i)
      end do
    end if
  end function rule_of

  !> The shape functions of a face.
  pure function face_functions(n_nodes, place) result(n)
    integer,  intent(in) :: n_nodes   !! 3, 4, 6 or 8
    real(wp), intent(in) :: place(2)  !! natural coordinates [-]
    real(wp) :: n(n_nodes)            !! they add up to 1 [-]
    real(wp) :: gradient(2, face_nodes), all_functions(face_nodes)

    call evaluate_face(n_nodes, place, all_functions, gradient)
    n = all_functions(:n_nodes)
  end function face_functions

  !> Their gradients along the natural coordinates.
  pure function face_gradients(n_nodes, place) result(gradient)
    integer,  intent(in) :: n_nodes   !! 3, 4, 6 or 8
    real(wp), intent(in) :: place(2)  !! natural coordinates [-]
    real(wp) :: gradient(2, n_nodes)  !! (i,a) [-]
    real(wp) :: all_gradients(2, face_nodes), n(face_nodes)

    call evaluate_face(n_nodes, place, n, all_gradients)
    gradient = all_gradients(:, :n_nodes)
  end function face_gradients

  !> Natural coordinates of the nodes of a face.
  pure function places_of_nodes(n_nodes) result(place)
    integer, intent(in) :: n_nodes     !! 3, 4, 6 or 8
    real(wp) :: place(2, n_nodes)      !! [-]
    integer :: corners, k

    corners = merge(3, 4, is_triangle(n_nodes))
    if (corners == 3) then
      place(:, :3) = reshape([0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [2, 3])
    else
      place(:, :4) = corner
    end if
    do k = corners + 1, n_nodes
      place(:, k) = 0.5_wp*(place(:, k - corners) + place(:, 1 + modulo(k - corners, corners)))
    end do
  end function places_of_nodes

  !> Shape functions and gradients together; 0 behind the nodes of the face.
  pure subroutine evaluate_face(n_nodes, place, n, gradient)
    integer,  intent(in)  :: n_nodes     !! 3, 4, 6 or 8
    real(wp), intent(in)  :: place(2)    !! natural coordinates [-]
    real(wp), intent(out) :: n(face_nodes), gradient(2, face_nodes) !! (a), (i,a) [-]
    real(wp) :: l(3), slope(2, 3), a(4), b(4), arch(2)
    integer :: corners, k, next

    n = 0.0_wp
    gradient = 0.0_wp
    corners = merge(3, 4, is_triangle(n_nodes))
    if (corners == 3) then
      l = [1.0_wp - place(1) - place(2), place(1), place(2)]
      slope = reshape([-1.0_wp, -1.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [2, 3])
      n(:3) = l
      gradient(:, :3) = slope
    else
      a = 1.0_wp + place(1)*corner(1, :)
      b = 1.0_wp + place(2)*corner(2, :)
      n(:4) = 0.25_wp*a*b
      gradient(1, :4) = 0.25_wp*corner(1, :)*b
      gradient(2, :4) = 0.25_wp*a*corner(2, :)
    end if
    if (n_nodes == corners) return
    if (corners == 3) then
      do k = 1, 3
        next = merge(1, k + 1, k == 3)
        n(3 + k) = 4.0_wp*l(k)*l(next)
        gradient(:, 3 + k) = 4.0_wp*(slope(:, k)*l(next) + l(k)*slope(:, next))
      end do
    else
      arch = 0.5_wp*(1.0_wp - place**2)
      do k = 1, 3, 2 ! edges along the first coordinate, and along the second
        n(4 + k) = arch(1)*b(k)
        gradient(1, 4 + k) = -place(1)*b(k)
        gradient(2, 4 + k) = arch(1)*corner(2, k)
        n(5 + k) = arch(2)*a(k + 1)
        gradient(1, 5 + k) = arch(2)*corner(1, k + 1)
        gradient(2, 5 + k) = -place(2)*a(k + 1)
      end do
    end if
    do k = 1, corners
      next = merge(1, k + 1, k == corners)
      n(k) = n(k) - 0.5_wp*n(corners + k)
      n(next) = n(next) - 0.5_wp*n(corners + k)
      gradient(:, k) = gradient(:, k) - 0.5_wp*gradient(:, corners + k)
      gradient(:, next) = gradient(:, next) - 0.5_wp*gradient(:, corners + k)
    end do
  end subroutine evaluate_face

  !> The shape functions of a face as polynomials: what `find_monomials` are multiplied by.
  pure function terms_of_functions(n_nodes) result(terms)
    integer, intent(in) :: n_nodes     !! 3, 4, 6 or 8
    real(wp) :: terms(face_nodes, face_nodes) !! (a,k) of function a, monomial k; 0 behind n_nodes
    real(wp), parameter :: slope(3, 3) = reshape([real(wp) :: 1, -1, -1, 0, 1, 0, 0, 0, 1], [3, 3])
    integer :: corners, k, next

    terms = 0.0_wp
    corners = merge(3, 4, is_triangle(n_nodes))
    if (corners == 3) then
      terms(:3, :3) = transpose(slope)
    else
      terms(:4, 1) = 0.25_wp
      terms(:4, 2:3) = 0.25_wp*transpose(corner)
      terms(:4, 5) = 0.25_wp*corner(1, :)*corner(2, :)
    end if
    if (n_nodes == corners) return
    do k = 1, corners
      next = 1 + modulo(k, corners)
      associate (middle => terms(corners + k, :))
        if (corners == 3) then
          associate (l => slope(:, k), m => slope(:, next))
            middle(:6) = 4.0_wp*[l(1)*m(1), l(1)*m(2) + l(2)*m(1), l(1)*m(3) + l(3)*m(1), &
              l(2)*m(2), l(2)*m(3) + l(3)*m(2), l(3)*m(3)]
          end associate
        else if (modulo(k, 2) == 1) then
          middle([1, 3]) = 0.5_wp*[1.0_wp, corner(2, k)]
          middle([4, 7]) = -middle([1, 3])
        else
          middle([1, 2]) = 0.5_wp*[1.0_wp, corner(1, k)]
          middle([6, 8]) = -middle([1, 2])
        end if
        terms(k, :) = terms(k, :) - 0.5_wp*middle
        terms(next, :) = terms(next, :) - 0.5_wp*middle
      end associate
    end do
  end function terms_of_functions

  !> The monomials that shape functions of a face consist of, at places: those of a triangle of
  !> second order first.
  pure subroutine find_monomials(n, xi, p)
    integer, intent(in) :: n                  !! places
    real(wp), intent(in) :: xi(n, 2)          !! natural coordinates [-]
    real(wp), intent(out) :: p(n, face_nodes) !! [-]

    p(:, 1) = 1.0_wp
    p(:, 2:3) = xi
    p(:, 4) = xi(:, 1)**2
    p(:, 5) = xi(:, 1)*xi(:, 2)
    p(:, 6) = xi(:, 2)**2
    p(:, 7) = p(:, 4)*xi(:, 2)
    p(:, 8) = p(:, 6)*xi(:, 1)
  end subroutine find_monomials

  !> The values of a polynomial.
  pure subroutine find_values(n, f, p, value)
    integer, intent(in) :: n                 !! places
    real(wp), intent(in) :: f(face_nodes)    !! what monomials are multiplied by
    real(wp), intent(in) :: p(n, face_nodes) !! as of `find_monomials` [-]
    real(wp), intent(out) :: value(n)

    value = ((f(1) + f(2)*p(:, 2)) + (f(3)*p(:, 3) + f(4)*p(:, 4))) + ((f(5)*p(:, 5) + &
      f(6)*p(:, 6)) + (f(7)*p(:, 7) + f(8)*p(:, 8)))
  end subroutine find_values

  !> What polynomials grow by along the natural coordinates, as polynomials.
  pure function slopes_of(terms) result(slope)
    real(wp), intent(in) :: terms(:, :)                 !! (8,n) as of `find_monomials`
    real(wp) :: slope(face_nodes, 2, size(terms, 2))

    slope = 0.0_wp
    slope([1, 2, 3, 5, 6], 1, :) = terms([2, 4, 5, 7, 8], :)
    slope([2, 5], 1, :) = 2.0_wp*slope([2, 5], 1, :)
    slope([1, 2, 3, 4, 5], 2, :) = terms([3, 5, 6, 7, 8], :)
    slope([3, 5], 2, :) = 2.0_wp*slope([3, 5], 2, :)
  end function slopes_of

end module face_shapes_mod
