!> Elements, faces and laws beyond what they can follow: what ends a run for it, in words.
module refuse_shapes_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t
  use text_mod, only: to_text
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use increments_mod, only: increment_t
  use elasticity_mod, only: elasticity_t, bulk_modulus
  use law_limits_mod, only: stretched_t
  use name_refusal_mod, only: raise_at, node_name
  implicit none
  private

  public :: refuse_inverted, refuse_folded, refuse_lost_law, stretches_in_words, &
    neo_hooke_in_words

contains

  !> An element that is inside out ends the run: no theory has such a body.
  subroutine refuse_inverted(scene, increment, element, least, error)
    type(scene_t), intent(in) :: scene
    type(increment_t), intent(in) :: increment
    integer, intent(in) :: element
    real(wp), intent(in) :: least !! det(I + grad u) [-]
    type(error_t), allocatable, intent(out) :: error

    call raise_at(increment, error, 'element '//to_text(scene%mesh%element_id(element))// &
      ' is turned inside out, det(I + grad u) = '//to_text(least, 2)//': the body would go '// &
      'through itself, far beyond small strain; check loads, prescribed displacements '// &
      'and units')
  end subroutine refuse_inverted

  !> A contact face whose corner has been pushed or twisted inwards ends the run: no gap, weight or
  !> pressure is computed over it.
  subroutine refuse_folded(scene, points, increment, point, error)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(increment_t), intent(in) :: increment
    integer, intent(in) :: point !! as of certificate_t
    type(error_t), allocatable, intent(out) :: error

    if (point == 0) return
    call raise_at(increment, error, 'at '//node_name(scene, points, point)//' of '// &
      scene%pairs(points%pair(point))%name//' a face is folded, or one before it: seen along '// &
      'the normal of the first surface a corner points inwards, and contact cannot be '// &
      'computed there; less motion, less load, or other faces')
  end subroutine refuse_folded

  !> A law that has lost its ellipticity ends the run: what follows depends on the mesh.
  subroutine refuse_lost_law(scene, increment, lost, error)
    type(scene_t), intent(in) :: scene
    type(increment_t), intent(in) :: increment
    type(stretched_t), intent(in) :: lost
    type(error_t), allocatable, intent(out) :: error

    associate (material => scene%materials(scene%mesh%material(lost%element)))
      call raise_at(increment, error, 'the law of material '//material%name//' does not hold '// &
        'in element '//to_text(scene%mesh%element_id(lost%element))//', stretched by '// &
        stretches_in_words(lost%stretch)//': it has lost its ellipticity (its acoustic tensor '// &
        'is not positive), and a layer of elements collapses or tears; smaller increments do '// &
        'not help; '//neo_hooke_in_words(material%law%elastic)//' holds at all stretches')
    end associate
  end subroutine refuse_lost_law

  !> "0.702, 1 and 1".
  pure function stretches_in_words(stretch) result(words)
    real(wp), intent(in) :: stretch(3) !! the largest first [-]
    character(:), allocatable :: words

    words = to_text(stretch(3), 3)//', '//to_text(stretch(2), 3)//' and '//to_text(stretch(1), 3)
  end function stretches_in_words

  !> The neo-Hookean law of an elasticity, as a deck has it.
  pure function neo_hooke_in_words(elastic) result(words)
    type(elasticity_t), intent(in) :: elastic
    character(:), allocatable :: words

    words = '*HYPERELASTIC, NEO HOOKE with C10 = '//to_text(0.5_wp*elastic%shear, 4)// &
      ' and D1 = '//to_text(2.0_wp/bulk_modulus(elastic), 4)
  end function neo_hooke_in_words

end module refuse_shapes_mod
