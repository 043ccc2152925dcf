!> What an accuracy is of: the quantities that are compared from mesh to mesh, and what their errors
!> are measured by.
!>
!> docs/theory.md section 10.
module measured_quantities_mod
  use kinds_mod, only: wp
  use text_mod, only: to_text
  use controls_mod, only: accuracy_of_resultants, accuracy_of_energy, accuracy_of_pressure, &
    accuracy_of_slip, accuracy_of_displacement, accuracy_of_reaction, accuracy_of_contact_force, &
    subjects
  use scene_mod, only: scene_t
  use step_contact_mod, only: most_friction
  implicit none
  private

  public :: quantity_t, list_quantities, error_scales

  !> A number or a vector of an increment, with a place among its values.
  type :: quantity_t
    character(:), allocatable :: name
    !! <pair>/<name>, <set>/<node>/<name>, <set>/<name> or <name>
    character(:), allocatable :: kind        !! force, energy, ... as for datasets
    character(:), allocatable :: description
    integer  :: pair = 0         !! 0: of no pair
    integer  :: first = 1        !! of its components
    integer  :: n = 1
    integer  :: scale = 0        !! its errors are parts of the largest of quantities of this scale
    logical  :: is_scale = .true. !! which this one is among
    real(wp) :: factor = 1.0_wp  !! times this
    logical  :: is_compared = .true.
    !! its error counts; else it is there for its scale, or beside another one
    logical  :: is_share = .false. !! a number up to 1: they are parts of what is left to that
    integer  :: beside = 0
    !! of a largest value the place of what the next one is, across an element; 0: none
  end type quantity_t

  !> The least size of a pair, or of a set, beside the largest, down to which errors are its own;
  !> likewise of a share.
  real(wp), parameter :: smallest_pair = 1.0e-3_wp

contains

  !> The quantities that an accuracy of the scene is of.
  subroutine list_quantities(scene, list)
    type(scene_t), intent(in) :: scene
    type(quantity_t), allocatable, intent(out) :: list(:)

    allocate (list(0))
    if (allocated(scene%accuracy%set)) then
      call list_of_set(scene, list)
    else
      call list_of_scene(scene, list)
    end if
    call add_used_gaps(scene, list)
    call name_pairs(scene, list)
  end subroutine list_quantities

  !> Those of an accuracy that is of no set.
  subroutine list_of_scene(scene, list)
    type(scene_t), intent(in) :: scene
    type(quantity_t), allocatable, intent(inout) :: list(:)
    real(wp) :: mu(size(scene%pairs))
    integer :: p

    mu = most_friction(scene)
    select case (scene%accuracy%of)
    case (accuracy_of_resultants)
      do p = 1, size(scene%pairs)
        associate (pair => scene%pairs(p))
          call add(list, quantity_t('pressing_force', 'force', &
            'sum of the normal reactions', pair=p, scale=p))
          call add(list, quantity_t('normal_force', 'force', &
            'sum of the normal reactions on the slave body as vectors, x, y, z', pair=p, n=3, &
            scale=p, is_scale=.false.))
          if (mu(p) > 0.0_wp) call add(list, quantity_t('friction_force', &
            'force', 'sum of the friction on the slave body, x, y, z', pair=p, n=3, scale=p, &
            is_scale=.false., factor=min(mu(p), 1.0_wp)))
        end associate
      end do
    case (accuracy_of_energy)
      call add(list, quantity_t('strain', 'energy', 'elastic energy of the bodies', scale=1))
    case (accuracy_of_pressure)
      do p = 1, size(scene%pairs)
        call add_largest(list, quantity_t('largest_pressure', 'pressure', &
          'normal reaction over the area of its point, the largest', pair=p, scale=p), &
          'pressure_beside', 'that of its neighbours, the least')
      end do
    case (accuracy_of_slip)
      do p = 1, size(scene%pairs)
        call add(list, quantity_t('largest_slip', 'length', &
          'sum of the slip increments of a point, the longest', pair=p, scale=p))
        if (mu(p) > 0.0_wp) call add(list, quantity_t( &
          'used_friction', 'ratio', 'friction over mu times the normal reaction, the largest '// &
          'of points with a thousandth of the largest of these and more; 1 where a point slips', &
          pair=p, is_scale=.false., is_share=.true.))
      end do
      call add_measure(list, quantity_t('largest_displacement', 'length', &
        'of the nodes of elements', scale=size(scene%pairs) + 1))
    case (accuracy_of_displacement)
      call add(list, quantity_t('largest_displacement', 'length', 'of the nodes of elements', &
        scale=1))
    case default
      call add_largest(list, quantity_t('largest_von_mises', 'pressure', &
        'of the mean stresses of the elements', scale=1), 'von_mises_beside', &
        'of the elements that share a face with that one, the least')
    end select
  end subroutine list_of_scene

  !> Put the names of pairs before what is theirs.
  pure subroutine name_pairs(scene, list)
    type(scene_t), intent(in) :: scene
    type(quantity_t), intent(inout) :: list(:)
    integer :: i

    do i = 1, size(list)
      if (list(i)%pair > 0) list(i)%name = scene%pairs(list(i)%pair)%name//'/'//list(i)%name
    end do
  end subroutine name_pairs

  !> Of what comes of contact: how near each pair is to touching. Where none of the meshes has it
  !> touch, all are alike, and say nothing of one on which it does.
  subroutine add_used_gaps(scene, list)
    type(scene_t), intent(in) :: scene
    type(quantity_t), allocatable, intent(inout) :: list(:)
    integer :: p

    if (.not. subjects(scene%accuracy%of)%is_of_contact) return
    do p = 1, size(scene%pairs)
      call add(list, quantity_t('used_gap', 'ratio', &
        'longest displacement of the pair''s nodes over itself and the least gap; 1 where it '// &
        'touches', pair=p, is_scale=.false., is_share=.true.))
    end do
  end subroutine add_used_gaps

  !> Those of a set: of each of its nodes, or a force that is summed; and by what it is found that
  !> these are next to nothing.
  subroutine list_of_set(scene, list)
    type(scene_t), intent(in) :: scene
    type(quantity_t), allocatable, intent(inout) :: list(:)
    character(:), allocatable :: ending, name
    integer :: n

    associate (accuracy => scene%accuracy)
      n = 3
      ending = ''
      if (accuracy%direction > 0) then
        n = 1
        ending = '_'//'xyz'(accuracy%direction:accuracy%direction)
      end if
      select case (accuracy%of)
      case (accuracy_of_reaction, accuracy_of_contact_force)
        ! By a name: gfortran 12 does not free a text that stands in a constructor of a type.
        name = accuracy%set//'/'//trim(merge('reaction_force', 'contact_force ', &
          accuracy%of == accuracy_of_reaction))//ending
        call add(list, quantity_t(name, 'force', 'on the set', n=n, scale=1))
        name = accuracy%set//'/sum_of_sizes'
        call add_measure(list, quantity_t(name, 'force', 'of the forces on its nodes', scale=2))
      case (accuracy_of_displacement)
        call add_nodes('displacement'//ending, 'length', 'of the node', n)
        call add_measure(list, quantity_t('largest_displacement', 'length', 'of all nodes', &
          scale=2))
      case (accuracy_of_pressure)
        call add_nodes('contact_pressure', 'pressure', &
          'normal reactions over the areas of the node', 1)
        call add_measure(list, quantity_t('largest_contact_pressure', 'pressure', &
          'of all nodes', scale=2))
      case (accuracy_of_slip)
        call add_nodes('slip', 'length', 'sum of the slip increments, as a vector', 1)
        call add_measure(list, quantity_t('largest_slip', 'length', 'of all nodes', scale=2))
        call add_measure(list, quantity_t('largest_displacement', 'length', 'of all nodes', &
          scale=3))
      case default
        call add_nodes('von_mises', 'pressure', 'of the stress averaged at the node', 1)
        call add_measure(list, quantity_t('largest_von_mises', 'pressure', 'of all nodes', &
          scale=2))
      end select
    end associate

  contains

    !> One of each node.
    subroutine add_nodes(name, kind, description, n)
      character(*), intent(in) :: name, kind, description
      integer, intent(in) :: n !! components
      type(quantity_t) :: quantity
      integer :: k

      quantity%kind = kind
      quantity%description = description
      quantity%n = n
      quantity%scale = 1
      do k = 1, size(scene%accuracy%nodes)
        quantity%name = scene%accuracy%set//'/'// &
          to_text(scene%mesh%node_id(scene%accuracy%nodes(k)))//'/'//name
        call add(list, quantity)
      end do
    end subroutine add_nodes

  end subroutine list_of_set

  !> What errors are measured by alone.
  subroutine add_measure(list, quantity)
    type(quantity_t), allocatable, intent(inout) :: list(:)
    type(quantity_t), intent(in) :: quantity

    call add(list, quantity)
    list(size(list))%is_compared = .false.
  end subroutine add_measure

  !> A largest value, and what the values next to it are.
  subroutine add_largest(list, quantity, name, description)
    type(quantity_t), allocatable, intent(inout) :: list(:)
    type(quantity_t), intent(in) :: quantity
    character(*), intent(in) :: name, description !! of those
    type(quantity_t) :: next

    call add(list, quantity)
    next = quantity
    next%name = name
    next%description = description
    next%is_scale = .false.
    next%is_compared = .false.
    call add(list, next)
    list(size(list) - 1)%beside = list(size(list))%first
  end subroutine add_largest

  !> Put a quantity behind those that are there.
  subroutine add(list, quantity)
    type(quantity_t), allocatable, intent(inout) :: list(:)
    type(quantity_t), intent(in) :: quantity
    integer :: first

    first = 1
    if (size(list) > 0) first = list(size(list))%first + list(size(list))%n
    list = [list, quantity]
    list(size(list))%first = first
  end subroutine add

  !> What the errors of each quantity are measured by: the largest that those of its scale get in
  !> the run, where that is not far below those of the others. Of a share that stays below 1 it is
  !> ten times what is left, so that an error of a tenth is all that, but no less than rounding is
  !> far below; where it does not stay there, nothing is asked of it.
  pure function error_scales(list, values) result(scales)
    type(quantity_t), intent(in) :: list(:)
    real(wp), intent(in) :: values(:, :) !! (n_components,n_increments)
    real(wp) :: scales(size(list))       !! > 0, or 0 where there is nothing
    real(wp) :: largest(maxval([list%scale, 1])), left
    integer :: k, j

    largest = 0.0_wp
    do k = 1, size(list)
      associate (a => list(k)%first, b => list(k)%first + list(k)%n - 1)
        if (.not. list(k)%is_scale) cycle
        do j = 1, size(values, 2)
          largest(list(k)%scale) = max(largest(list(k)%scale), norm2(values(a:b, j)))
        end do
      end associate
    end do
    largest = max(largest, smallest_pair*maxval(largest))
    do k = 1, size(list)
      if (list(k)%is_share) then
        left = 1.0_wp - maxval(values(list(k)%first, :))
        scales(k) = merge(max(10.0_wp*left, smallest_pair), huge(1.0_wp), left > 0.0_wp)
      else
        scales(k) = largest(list(k)%scale)*list(k)%factor
      end if
    end do
  end function error_scales

end module measured_quantities_mod
