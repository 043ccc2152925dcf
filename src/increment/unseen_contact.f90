!> Errors of contact between faces that recovery of stresses cannot see: stresses are as smooth
!> wherever in a face contact is.
!>
!> Where the edge of a tool lies within faces, the points beneath it carry forces that may act
!> anywhere in the faces around. Where the faces of both sides are not parallel, gaps are closed in
!> the mean, and the faces overlap between the nodes. docs/theory.md (10.23), (10.24).
module unseen_contact_mod
  use kinds_mod, only: wp
  use mesh_mod, only: mesh_t
  use controls_mod, only: accuracy_of_resultants
  use scene_mod, only: scene_t
  use mesh_forces_mod, only: add_nodal_areas
  use bodies_mod, only: is_linear
  use contact_points_mod, only: contact_points_t
  use candidate_points_mod, only: areas_at
  use increment_report_mod, only: contact_fields_t
  implicit none
  private

  public :: unseen_error, share_on_little_covered

  real(wp), parameter :: half = 0.5_wp*(1.0_wp - 1.0e-6_wp)
  !! of a node's area, but for rounding: an edge along edges of the mesh leaves that much [-]

contains

  !> The error that this makes, relative to the largest resultant.
  pure real(wp) function unseen_error(scene, points, contact, strain, u) result(error)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(contact_fields_t), intent(in) :: contact
    real(wp), intent(in) :: strain !! energy of the bodies [energy]
    real(wp), intent(in) :: u(:, :) !! (3,n_nodes) displacement [length]
    integer :: i

    error = 0.0_wp
    do i = 1, points%n
      if (.not. points%on_surface(i)) cycle
      ! What is inside in the deck is so on any mesh, or was moved until it is not in the mean.
      associate (depth => -contact%least_gap(i), of_deck => scene%pairs(points%pair(i))%overlap + &
        max(0.0_wp, -points%extra_gap(i)))
        if (depth > 2.0_wp*of_deck) error = error + contact%reaction(1, i)*depth
      end associate
    end do
    if (strain > 0.0_wp) error = error/(2.0_wp*strain)
    error = error + share_on_little_covered(scene, points, contact, u)
    ! The energy is the same, whoever carries the force.
    if (scene%accuracy%of == accuracy_of_resultants) error = error + share_of_supports(points, &
      contact, u)
  end function unseen_error

  !> The part of the normal forces that supports may carry where they hold the normals of points
  !> which would press: the area of points that touch and carry nothing, beside others that press,
  !> under the largest pressure of the pair. Of the pair with the largest such force, over the
  !> largest force of a pair. docs/theory.md (10.29).
  pure real(wp) function share_of_supports(points, contact, u) result(share)
    type(contact_points_t), intent(in) :: points
    type(contact_fields_t), intent(in) :: contact
    real(wp), intent(in) :: u(:, :) !! (3,n_nodes) displacement [length]
    real(wp), parameter :: rounding = 1.0e-9_wp !! of the largest displacement: a gap of nothing [-]
    real(wp) :: touches, largest
    integer :: p

    share = 0.0_wp
    largest = 0.0_wp
    touches = rounding*maxval(abs(u))
    do p = 1, size(points%first) - 1
      associate (a => points%first(p), b => points%first(p + 1) - 1)
        if (a > b) cycle
        associate (force => contact%reaction(1, a:b), area => points%area(a:b))
          largest = max(largest, sum(force))
          if (.not. any(force > 0.0_wp .and. area > 0.0_wp)) cycle
          share = max(share, maxval(force/max(area, tiny(1.0_wp)), mask=area > 0.0_wp)*sum(area, &
            mask=.not. force > 0.0_wp .and. abs(contact%gap(a:b)) <= touches))
        end associate
      end associate
    end do
    if (largest > 0.0_wp) share = share/largest
  end function share_of_supports

  !> The part of the normal forces that is on nodes of which less than half is covered, of either
  !> side: of the pair with the largest such force, over the largest force of a pair.
  pure real(wp) function share_on_little_covered(scene, points, contact, u) result(share)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(contact_fields_t), intent(in) :: contact
    real(wp), intent(in) :: u(:, :) !! (3,n_nodes) displacement [length]
    real(wp), dimension(scene%mesh%n_nodes) :: area, covered, force
    real(wp) :: whole(points%n) !! where what covers it is measured: at finite strain deformed
    real(wp) :: largest
    type(mesh_t) :: mesh
    integer :: p, i

    share = 0.0_wp
    mesh = scene%mesh
    whole = points%area
    if (.not. is_linear(scene)) then
      mesh%coordinates = mesh%coordinates + u
      whole = areas_at(scene, points, u)
    end if
    largest = 0.0_wp
    do p = 1, size(points%first) - 1
      associate (a => points%first(p), b => points%first(p + 1) - 1)
        largest = max(largest, sum(contact%reaction(1, a:b)))
        if (a > b) cycle
        if (.not. points%on_surface(a)) cycle
        share = max(share, sum(contact%reaction(1, a:b), mask=contact%covered_area(a:b) < &
          half*whole(a:b)))
        if (scene%pairs(p)%master > 0) cycle
        area = 0.0_wp
        call add_nodal_areas(mesh, scene%surfaces(scene%pairs(p)%master_surface), area)
        covered = 0.0_wp
        force = 0.0_wp
        do i = a, b
          ! Dual mortar weights: the covered areas of the slave nodes times these are those of the
          ! master's.
          associate (first => contact%weights%first(i), last => contact%weights%first(i + 1) - 1)
            associate (node => contact%weights%node(first:last), weight => &
              contact%weights%weight(first:last))
              covered(node) = covered(node) + contact%covered_area(i)*weight
              force(node) = force(node) + contact%reaction(1, i)*weight
            end associate
          end associate
        end do
        share = max(share, sum(force, mask=covered < half*area))
      end associate
    end do
    if (largest > 0.0_wp) share = share/largest
  end function share_on_little_covered

end module unseen_contact_mod
