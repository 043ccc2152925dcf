!> What a run at finite strain (*STEP, NLGEOM) does not cover.
module finite_strain_limits_mod
  use kinds_mod, only: wp
  use controls_mod, only: compliance_products, is_exact
  use element_laws_mod, only: varies
  use friction_laws_mod, only: falls_with_rate
  use scene_mod, only: scene_t
  use text_mod, only: to_text
  use grips_mod, only: is_grip, is_turning, is_turning_mean, is_held_at_0
  implicit none
  private

  public :: beyond_finite_strain

  real(wp), parameter :: nothing = 1.0e-10_wp !! of the largest in an equation: rounding [-]

contains

  !> The first thing in the scene that finite strain does not cover, in words; empty: there is none.
  pure function beyond_finite_strain(scene) result(what)
    type(scene_t), intent(in) :: scene
    character(:), allocatable :: what
    integer :: beyond, i

    what = ''
    beyond = turning_coupling(scene)
    if (beyond > 0) then
      what = coupling_in_words(scene, beyond)
    else if (any(scene%pairs%master == 0 .and. scene%pairs%small_sliding)) then
      what = 'SMALL SLIDING between surfaces of elements'
    else if (has_arms(scene)) then
      what = 'ties that leave nodes off their master (ADJUST=NO of *TIE): move them onto it '// &
        '(ADJUST=YES)'
    else if (spring_that_turns(scene)) then
      what = 'springs of rotations, dofs 4 to 6 (*SPRING)'
    else if (any([(varies(scene%mesh, scene%materials(i)), i=1, size(scene%materials))])) then
      what = 'materials that are not isotropic along axes that go around: cylindrical ones '// &
        '(*ORIENTATION), and those of axisymmetric elements'
    else if (falls_in_any_step(scene)) then
      what = '*FRICTION, EXPONENTIAL DECAY'
    else if (scene%precision%iterative) then
      what = '*BODY SOLVER, TYPE=ITERATIVE'
    else if (scene%contact%compliance == compliance_products .and. .not. &
      is_exact(scene%precision)) then
      ! Reactions would be those of another body than displacements are.
      what = 'COMPLIANCE=PRODUCTS with a factor in single precision or of low rank (*PRECISION)'
    end if
  end function beyond_finite_strain

  !> Whether a pair has friction that falls with the rate of slip.
  pure logical function falls_in_any_step(scene) result(falls)
    type(scene_t), intent(in) :: scene
    integer :: k

    falls = any(falls_with_rate(scene%pairs%law))
    do k = 1, size(scene%steps)
      if (allocated(scene%steps(k)%frictions)) falls = falls .or. any(falls_with_rate( &
        scene%steps(k)%frictions%law))
    end do
  end function falls_in_any_step

  !> Whether nodes are tied by arms, which turn by small rotations alone.
  pure logical function has_arms(scene)
    type(scene_t), intent(in) :: scene
    integer :: c

    has_arms = .false.
    associate (joints => scene%constraints)
      do c = 1, joints%n - joints%n_equations
        has_arms = has_arms .or. any(joints%master_dof(joints%first(c):joints%first(c + 1) - 1) /= &
          joints%dof(c))
      end do
    end associate
  end function has_arms

  !> Whether a spring resists rotations of a coupling: large ones add up in no order.
  pure logical function spring_that_turns(scene)
    type(scene_t), intent(in) :: scene
    integer :: i

    spring_that_turns = .false.
    if (.not. allocated(scene%rotations)) return
    associate (springs => scene%mesh%springs)
      if (springs%n > 0) spring_that_turns = any([(any(springs%node(:springs%first(springs%n + &
        1) - 1) == scene%rotations(i)%rotation_node), i=1, size(scene%rotations))])
    end associate
  end function spring_that_turns

  !> The first coupled rotation that is not held at 0 and whose equations are those of small ones; 0
  !> where there is none.
  pure integer function turning_coupling(scene) result(found)
    type(scene_t), intent(in) :: scene
    integer :: c
    logical :: turns

    if (allocated(scene%rotations)) then
      do found = 1, size(scene%rotations)
        associate (of => scene%rotations(found), joints => scene%constraints)
          if (is_held_at_0(scene, of%rotation_node) .or. is_grip(scene, found) .or. &
            is_turning(scene, found) .or. is_turning_mean(scene, found)) cycle
          turns = is_loaded(scene, of%rotation_node)
          do c = 1, joints%n
            associate (first => joints%first(c), last => joints%first(c + 1) - 1)
              turns = turns .or. any(joints%master(first:last) == of%rotation_node)
              if (joints%node(c) /= of%node .and. all(joints%master(first:last) /= of%node)) cycle
              turns = turns .or. any(joints%master_dof(first:last) /= joints%dof(c) .and. &
                abs(joints%weight(first:last)) > nothing*maxval(abs(joints%weight(first:last))))
            end associate
          end do
          if (turns) return
        end associate
      end do
    end if
    found = 0
  end function turning_coupling

  !> What such a coupling is, and what may stand in its place.
  pure function coupling_in_words(scene, rotation) result(words)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: rotation !! among the scene's
    character(:), allocatable :: words
    character(:), allocatable :: id
    logical :: depends !! the node on the surface, as of *DISTRIBUTING, not on local directions

    associate (of => scene%rotations(rotation), joints => scene%constraints)
      id = to_text(scene%mesh%node_id(of%node))
      depends = any(joints%node(:joints%n) == of%rotation_node .or. &
        joints%node(:joints%n) == of%node)
      if (allocated(scene%local_axes)) depends = depends .and. all(scene%local_axes%node /= &
        of%node .and. scene%local_axes%node /= of%rotation_node)
      if (depends) then
        words = '*DISTRIBUTING couplings of one or two of directions 4 to 6, whose reference '// &
          'node has local directions, or whose rotation *KINEMATIC or equations name '// &
          '(reference node '//id//'): couple all directions, and give each coupling a node of '// &
          'its own'
      else
        words = '*KINEMATIC couplings that turn and couple only some of directions 1 to 3, or '// &
          'whose reference node has local directions or rotations that equations name '// &
          '(reference node '//id//'): couple all directions, or hold its directions 4 to 6 at 0'
      end if
    end associate
  end function coupling_in_words

  !> Whether a step puts a force on a node or prescribes its displacement.
  pure logical function is_loaded(scene, node)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: node
    integer :: k

    is_loaded = any([(any(scene%steps(k)%forces%node == node) .or. &
      any(scene%steps(k)%boundary%node == node), k=1, size(scene%steps))])
  end function is_loaded

end module finite_strain_limits_mod
