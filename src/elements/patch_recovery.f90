!> Smooth stresses at the nodes from those of the elements: superconvergent patch recovery.
!>
!> The mean stress of an element is more accurate than any other in it. Around a node inside the
!> body a linear stress is fitted to the means of the elements that meet there; a node on the body's
!> surface, where elements are missing, takes what the fits of its neighbours inside say of it.
!> Where a mesh has nothing inside (a plate of one layer), nodes where more elements meet stand for
!> those inside. Across a layer the means are all at one place: there the gradients of the elements'
!> own stresses are fitted, which say how it bends.
!>
!> Elements of second order give several places each where their stress is more accurate than
!> elsewhere; around a node inside the body a quadratic stress is fitted to these. Mid-side nodes
!> take what the fits around corners say of them.
!>
!> Source: O.C. Zienkiewicz, J.Z. Zhu, Int. J. Numer. Methods Engrg. 33 (1992) 1331-1364.
module patch_recovery_mod
  use kinds_mod, only: wp
  use lists_mod, only: lists_t
  use dense_mod, only: solve_least_squares, symmetric_eigenvectors
  use cells_mod, only: cells, face_corners
  use connectivity_mod, only: connectivity_t, corners_in, nodes_of_element, nodes_of_face, &
    some_elements
  use mesh_mod, only: mesh_t, elements_at_nodes
  use small_matrix_mod, only: determinant
  implicit none
  private

  public :: recover_at_nodes, samples_t

  integer, parameter :: n_linear = 4, n_quadratic = 10 !! terms of polynomials in space

  !> Stresses at places in the elements; none of those whose mean is taken.
  type :: samples_t
    integer, allocatable :: first(:)     !! (n_elements+1) where those of each begin
    real(wp), allocatable :: place(:, :)  !! (3,n) [length]
    real(wp), allocatable :: stress(:, :) !! (6,n) [force/length^2]
  end type samples_t

contains

  !> Smooth stresses at the nodes of the elements of one material; 0 at other nodes.
  subroutine recover_at_nodes(mesh, of_material, means, gradients, smooth, samples)
    type(mesh_t), intent(in) :: mesh
    integer, intent(in) :: of_material
    real(wp), intent(in) :: means(:, :)        !! (6,n_elements) of each [force/length^2]
    real(wp), intent(in) :: gradients(:, :, :) !! (3,6,n_elements) in its middle [force/length^3]
    real(wp), intent(out) :: smooth(:, :)      !! (6,n_nodes) [force/length^2]
    type(samples_t), intent(in), optional :: samples !! of elements of second order
    real(wp), allocatable :: fit(:, :, :) !! (10,6,n_nodes) as of make_fit or fit_samples
    real(wp), allocatable :: middle(:, :) !! (3,n_nodes) where that value is [length]
    type(lists_t) :: at
    integer :: n_elements(mesh%n_nodes), node
    logical :: is_inside(mesh%n_nodes), has_fit(mesh%n_nodes)

    at = elements_at_nodes(mesh, mesh%material == of_material)
    n_elements = at%first(2:) - at%first(:mesh%n_nodes)
    do node = 1, mesh%n_nodes
      is_inside(node) = surrounded(mesh, node, at%item(at%first(node):at%first(node + 1) - 1))
    end do
    ! Fits are made where they are used.
    has_fit = .false.
    do node = 1, mesh%n_nodes
      associate (elements => at%item(at%first(node):at%first(node + 1) - 1))
        call mark_centres(nodes_of(elements), node)
      end associate
    end do
    allocate (fit(n_quadratic, 6, mesh%n_nodes), source=0.0_wp)
    allocate (middle(3, mesh%n_nodes))
    do node = 1, mesh%n_nodes
      if (.not. has_fit(node)) cycle
      associate (elements => at%item(at%first(node):at%first(node + 1) - 1))
        if (has_samples(elements)) then
          call fit_samples(samples, elements, is_inside(node), fit(:, :, node), middle(:, node))
        else
          call make_fit(mesh, elements, means, gradients, fit(:, :, node), middle(:, node))
        end if
      end associate
    end do
    smooth = 0.0_wp
    do node = 1, mesh%n_nodes
      associate (elements => at%item(at%first(node):at%first(node + 1) - 1))
        if (size(elements) > 0) smooth(:, node) = mean_of_fits(nodes_of(elements), node)
      end associate
    end do

  contains

    !> Whether all of some elements have samples.
    pure logical function has_samples(elements)
      integer, intent(in) :: elements(:)

      has_samples = present(samples)
      if (has_samples) has_samples = all(samples%first(elements + 1) > samples%first(elements))
    end function has_samples

    !> The nodes of some elements, one element after the other.
    pure function nodes_of(elements) result(nodes)
      integer, intent(in) :: elements(:)
      integer, allocatable :: nodes(:)
      type(connectivity_t) :: some

      some = some_elements(mesh%connectivity, elements)
      call move_alloc(some%node, nodes)
    end function nodes_of

    !> Say which fits a node takes: its own inside; else those around it that are inside, or else
    !> those where most elements meet, if these are more than its own.
    subroutine centres_of(around, node, list, n)
      integer, intent(in) :: around(:)    !! nodes of its elements
      integer, intent(in) :: node
      integer, intent(out) :: list(:)     !! a centre as often as elements share it with the node
      integer, intent(out) :: n
      integer :: k, most

      n = 0
      most = n_elements(node)
      if (.not. is_inside(node)) then
        do k = 1, size(around)
          most = max(most, n_elements(around(k)))
          if (is_inside(around(k))) call take(around(k), list, n)
        end do
        if (n > 0) return
        do k = 1, size(around)
          if (n_elements(around(k)) == most .and. most > n_elements(node)) then
            call take(around(k), list, n)
          end if
        end do
      end if
      if (n == 0) call take(node, list, n)
    end subroutine centres_of

    subroutine mark_centres(around, node)
      integer, intent(in) :: around(:), node
      integer :: list(max(1, size(around))), n

      if (size(around) == 0) return
      call centres_of(around, node, list, n)
      has_fit(list(:n)) = .true.
    end subroutine mark_centres

    function mean_of_fits(around, node) result(stress)
      integer, intent(in) :: around(:), node
      real(wp) :: stress(6)
      integer :: list(size(around)), n, i

      call centres_of(around, node, list, n)
      stress = 0.0_wp
      do i = 1, n
        associate (centre => list(i))
          stress = stress + matmul(terms(mesh%coordinates(:, node) - middle(:, centre)), &
            fit(:, :, centre))
        end associate
      end do
      stress = stress/real(n, wp)
    end function mean_of_fits

  end subroutine recover_at_nodes

  !> The terms of a quadratic polynomial.
  pure function terms(x) result(t)
    real(wp), intent(in) :: x(3)
    real(wp) :: t(n_quadratic)

    t = [1.0_wp, x, x**2, x(1)*x(2), x(2)*x(3), x(3)*x(1)]
  end function terms

  !> The quadratic or linear stress closest to the samples in some elements.
  subroutine fit_samples(samples, elements, is_quadratic, fit, middle)
    type(samples_t), intent(in) :: samples
    integer, intent(in) :: elements(:)
    logical, intent(in) :: is_quadratic
    real(wp), intent(out) :: fit(:, :)  !! (10,6) factors of the terms, from the samples' middle
    real(wp), intent(out) :: middle(3)  !! [length]
    real(wp), allocatable :: a(:, :)
    real(wp) :: extent
    integer, allocatable :: at(:)
    integer :: i, k, n

    allocate (at(sum(samples%first(elements + 1) - samples%first(elements))))
    n = 0
    do i = 1, size(elements)
      do k = samples%first(elements(i)), samples%first(elements(i) + 1) - 1
        n = n + 1
        at(n) = k
      end do
    end do
    middle = sum(samples%place(:, at), dim=2)/real(n, wp)
    extent = maxval(abs(samples%place(:, at) - spread(middle, 2, n)))
    allocate (a(n, merge(n_quadratic, n_linear, is_quadratic)))
    do i = 1, n
      associate (all_terms => terms((samples%place(:, at(i)) - middle)/extent))
        a(i, :) = all_terms(:size(a, 2))
      end associate
    end do
    fit = 0.0_wp
    fit(:size(a, 2), :) = solve_least_squares(a, transpose(samples%stress(:, at)))
    fit(2:n_linear, :) = fit(2:n_linear, :)/extent
    fit(n_linear + 1:, :) = fit(n_linear + 1:, :)/extent**2
  end subroutine fit_samples

  !> One more in a list.
  pure subroutine take(centre, list, n)
    integer, intent(in) :: centre
    integer, intent(inout) :: list(:), n

    n = n + 1
    list(n) = centre
  end subroutine take

  !> Whether elements lie all around a node: then each face at it belongs to two of them.
  pure logical function surrounded(mesh, node, elements)
    type(mesh_t), intent(in) :: mesh
    integer, intent(in) :: node
    integer, intent(in) :: elements(:) !! those that meet there
    integer :: face(2, sum(cells(mesh%connectivity%cell(elements))%n_faces))
    !! the nodes beside the node in each
    integer :: corners(face_corners), n, e, k, m, i

    n = 0
    do e = 1, size(elements)
      do i = 1, cells(mesh%connectivity%cell(elements(e)))%n_faces
        corners = nodes_of_face(mesh%connectivity, elements(e), i)
        k = findloc(corners, node, dim=1)
        if (k == 0) cycle
        m = corners_in(corners)
        associate (a => corners(1 + modulo(k, m)), b => corners(1 + modulo(k - 2, m)))
          n = n + 1
          face(:, n) = [min(a, b), max(a, b)]
        end associate
      end do
    end do
    surrounded = n > 0
    do i = 1, n
      if (count(face(1, :n) == face(1, i) .and. face(2, :n) == face(2, i)) < 2) surrounded = .false.
    end do
  end function surrounded

  !> The linear stress closest to the means of some elements. Across a layer of them it is that of
  !> the elements themselves, whose gradient there changes linearly along the layer.
  subroutine make_fit(mesh, elements, means, gradients, fit, middle)
    type(mesh_t), intent(in) :: mesh
    integer, intent(in) :: elements(:)
    real(wp), intent(in) :: means(:, :), gradients(:, :, :)
    real(wp), intent(out) :: fit(:, :)  !! (10,6) factors of the terms, from the elements' middle
    real(wp), intent(out) :: middle(3)  !! [length]
    real(wp) :: a(size(elements), n_linear), extent, across(3, 3), along(3, 3), change(n_linear, 6)
    integer :: n_across, e, i

    a(:, 1) = 1.0_wp
    do e = 1, size(elements)
      associate (nodes => nodes_of_element(mesh%connectivity, elements(e)))
        do i = 1, 3
          a(e, i + 1) = sum(mesh%coordinates(i, nodes))/real(size(nodes), wp)
        end do
      end associate
    end do
    ! From their middle: what they do not span is then a column of zeros, apart from the constant.
    middle = sum(a(:, 2:), dim=1)/real(size(elements), wp)
    a(:, 2:) = a(:, 2:) - spread(middle, 1, size(elements))
    call flatten(mesh, elements, middle, a(:, 2:), across, along, n_across)
    extent = maxval(abs(a(:, 2:)))
    if (extent <= 0.0_wp) extent = 1.0_wp
    a(:, 2:) = a(:, 2:)/extent
    fit = 0.0_wp
    fit(:n_linear, :) = of_values(transpose(means(:, elements)))
    do i = 1, n_across
      change = of_values(transpose(reshape(matmul(along(:, i), reshape(gradients(:, :, elements), &
        [3, 6*size(elements)])), [6, size(elements)])))
      fit = fit + product_of(across(:, i), change)
    end do

  contains

    !> A value in the middle of the elements and its gradient.
    function of_values(values) result(found)
      real(wp), intent(in) :: values(:, :) !! (n_elements,6)
      real(wp) :: found(n_linear, 6)

      found = solve_least_squares(a, values)
      found(2:, :) = found(2:, :)/extent
    end function of_values

  end subroutine make_fit

  !> The factors of the terms of a product of linear polynomials.
  pure function product_of(slope, linear) result(factors)
    real(wp), intent(in) :: slope(3)     !! of x; its value at 0 is 0
    real(wp), intent(in) :: linear(:, :) !! (4,n) a value at 0 and its slope, each
    real(wp) :: factors(n_quadratic, size(linear, 2))
    integer :: i, j

    factors(1, :) = 0.0_wp
    do i = 1, 3
      j = 1 + modulo(i, 3)
      factors(1 + i, :) = slope(i)*linear(1, :)
      factors(n_linear + i, :) = slope(i)*linear(1 + i, :)
      factors(n_linear + 3 + i, :) = slope(i)*linear(1 + j, :) + slope(j)*linear(1 + i, :)
    end do
  end function product_of

  !> Take from the middles of elements what they are apart along directions in which that is next to
  !> nothing beside the extent of the elements: a gradient along these would be what rounding or a
  !> little bend of a single layer makes of it, and be carried far outside the middles.
  subroutine flatten(mesh, elements, middle, apart, across, along, n_across)
    type(mesh_t), intent(in) :: mesh
    integer, intent(in) :: elements(:)
    real(wp), intent(in) :: middle(3)       !! of the middles [length]
    real(wp), intent(inout) :: apart(:, :)  !! (n_elements,3) of each, from there [length]
    real(wp), intent(out) :: across(:, :), along(:, :)
    !! (3,3) the part along(:, i) across(:, i).x of a place x is what was taken: such a direction,
    !! and how far the place is along it [length/length, -]
    integer, intent(out) :: n_across        !! the columns of these that are set
    ! Mean squares along a direction, of the middles over those of the corners: 0.5 in a box of two
    ! by two by two, 0 across a flat layer. A layer whose bends are a tenth of its thickness has
    ! 0.01. [-]
    real(wp), parameter :: least = 0.01_wp
    real(wp) :: of_corners(3, 3), of_middles(3, 3), arm(3), width(3), scaled(3, 3), ratio(3)
    real(wp) :: extent !! of the middles: powers of lengths overflow [length]
    integer :: e, a, i
    logical :: ok

    n_across = 0
    extent = maxval(abs(apart))
    if (extent <= 0.0_wp) return
    of_corners = 0.0_wp
    do e = 1, size(elements)
      associate (nodes => nodes_of_element(mesh%connectivity, elements(e)))
        do a = 1, size(nodes)
          arm = (mesh%coordinates(:, nodes(a)) - middle)/extent
          do i = 1, 3
            of_corners(:, i) = of_corners(:, i) + arm*arm(i)/real(size(nodes), wp)
          end do
        end do
      end associate
    end do
    of_middles = matmul(transpose(apart/extent), apart/extent)
    ! The product of the three ratios, each below 1.
    if (determinant(of_middles) >= least*determinant(of_corners)) return
    ! Coordinates in which the corners are apart alike in all directions.
    call symmetric_eigenvectors(of_corners, width, ok)
    if (.not. ok .or. .not. minval(width) > 0.0_wp) return
    width = sqrt(width)
    scaled = matmul(transpose(of_corners), matmul(of_middles, of_corners))/ &
      (spread(width, 1, 3)*spread(width, 2, 3))
    call symmetric_eigenvectors(scaled, ratio, ok)
    if (.not. ok) return
    do i = 1, 3
      if (ratio(i) >= least) cycle
      n_across = n_across + 1
      across(:, n_across) = matmul(of_corners, scaled(:, i)/width)
      along(:, n_across) = matmul(of_corners, scaled(:, i)*width)
      apart = apart - spread(matmul(apart, across(:, n_across)), 2, 3)*spread(along(:, n_across), &
        1, size(elements))
    end do
  end subroutine flatten

end module patch_recovery_mod
