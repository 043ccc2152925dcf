!> What it takes to reach the accuracy that the user wants, and what to say where that is missed.
!>
!> docs/theory.md section 10.
module meet_accuracy_mod
  use kinds_mod, only: wp
  use text_mod, only: to_text, percent
  use controls_mod, only: subject_in_words
  use step_contact_mod, only: least_friction
  use scene_mod, only: scene_t
  use connectivity_mod, only: nodes_of_hexahedron
  use mesh_mod, only: mesh_t
  use hexahedron8_mod, only: volume
  use increment_report_mod, only: error_parts_t, total_error
  implicit none
  private

  public :: set_contact_tolerance, accuracy_shortfall

  ! The contact tolerance, beside the accuracy: the certificate allows ten times as much.
  real(wp), parameter :: least_fraction = 0.02_wp
  real(wp), parameter :: largest_fraction = 0.05_wp
  real(wp), parameter :: of_discretisation = 0.1_wp
  !! of the error of mesh and load steps: the certificate then allows as much again
  real(wp), parameter :: of_differences = 0.002_wp
  !! of the accuracy where meshes are compared: what differs must not be the solver's residual
  real(wp), parameter :: order_of_mesh = 4.0_wp/3.0_wp
  !! of its error in the size of the elements: 1 to 2 where it was measured

contains

  !> Choose the contact tolerance: a tenth of the error that mesh and load steps make anyway; where
  !> meshes are compared, a small part of the accuracy, of friction as of normal forces.
  pure subroutine set_contact_tolerance(scene, divisions, tolerance, errors)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: divisions       !! as of choices_t
    real(wp), intent(inout) :: tolerance   !! stays where no accuracy is wanted [-]
    type(error_parts_t), intent(in), optional :: errors !! of the last *STEP, where there was one

    associate (wanted => scene%accuracy%wanted)
      if (wanted <= 0.0_wp) return
      if (.not. scene%accuracy%keeps_mesh) then
        ! What each increment leaves friction keeps: more of them leave as much together.
        tolerance = of_differences*wanted*least_friction(scene)/real(divisions, wp)
        return
      end if
      tolerance = least_fraction*wanted
      if (present(errors)) tolerance = min(largest_fraction*wanted, max(tolerance, &
        of_discretisation*(max(0.0_wp, errors%mesh) + max(0.0_wp, errors%load_steps))))
    end associate
  end subroutine set_contact_tolerance

  !> Why the accuracy was missed at the end of a *STEP, and what would reach it; empty where it was
  !> not.
  function accuracy_shortfall(scene, step, errors, of_elements) result(words)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: step
    type(error_parts_t), intent(in) :: errors
    real(wp), intent(in) :: of_elements(:) !! (n_elements) their parts of the mesh's error [energy]
    character(:), allocatable :: words
    real(wp) :: others

    words = ''
    if (scene%accuracy%wanted <= 0.0_wp .or. .not. scene%accuracy%keeps_mesh) return
    if (total_error(errors) >= 0.0_wp .and. total_error(errors) <= scene%accuracy%wanted) return
    words = 'step '//to_text(step)//': '//subject_in_words(scene%accuracy)//' are wrong by about '
    if (errors%load_steps < 0.0_wp) then
      words = words//percent(errors%mesh)//' by the mesh, and by the load steps nobody knows '// &
        'how much: twice their size could not be solved'
      return
    end if
    if (errors%geometry < 0.0_wp) then
      words = words//percent(errors%mesh)//' by the mesh; the error by the geometry of faces '// &
        'is not known'
      return
    end if
    words = words//percent(total_error(errors))//', not '//percent(scene%accuracy%wanted)
    others = errors%load_steps + errors%contact + errors%arithmetic
    if (errors%mesh > scene%accuracy%wanted) then
      words = words//'; the mesh alone makes '//percent(errors%mesh)//': it takes '// &
        elements_in_words(scene%mesh, of_elements, errors%mesh, scene%accuracy%wanted)
    else if (errors%geometry > scene%accuracy%wanted) then
      words = words//'; the geometry of faces makes '//percent(errors%geometry)// &
        cure_of_geometry(errors)
    else if (errors%load_steps > 0.5_wp*others) then
      words = words//'; the load steps make '//percent(errors%load_steps)
      if (scene%steps(step)%direct) words = words//', and DIRECT keeps them as they are'
    else
      words = words//'; contact makes '//percent(errors%contact)//', arithmetic '// &
        percent(errors%arithmetic)
    end if
  end function accuracy_shortfall

  !> What lessens the largest part of what the geometry of faces makes.
  pure function cure_of_geometry(errors) result(cure)
    type(error_parts_t), intent(in) :: errors
    character(:), allocatable :: cure

    select case (maxloc([errors%between_nodes, errors%at_edges, errors%of_facets], dim=1))
    case (1)
      cure = ', for faces are entered between their nodes: smaller elements at contact, or '// &
        'meshes that match, lessen it'
    case (2)
      cure = ', for edges of one side are inside faces of the other: edges of elements along '// &
        'them lessen it'
    case default
      cure = ', for flat faces stand for arcs: ADJUST=0 of *CONTACT PAIR, more faces along the '// &
        'arcs, or elements of second order lessen it'
    end select
  end function cure_of_geometry

  !> Elements of about 0.03 in place of 0.125 around element 17.
  function elements_in_words(mesh, of_elements, error, wanted) result(words)
    type(mesh_t), intent(in) :: mesh
    real(wp), intent(in) :: of_elements(:), error, wanted
    character(:), allocatable :: words
    real(wp) :: edge
    integer :: e

    e = maxloc(of_elements, dim=1)
    edge = volume(mesh%coordinates(:, nodes_of_hexahedron(mesh%connectivity, e)))**(1.0_wp/3.0_wp)
    words = 'elements of about '//to_text(edge*(wanted/error)**(1.0_wp/order_of_mesh), 2)// &
      ' where they are '//to_text(edge, 2)//' now, around element '// &
      to_text(mesh%element_id(e))//' first'
  end function elements_in_words

end module meet_accuracy_mod
