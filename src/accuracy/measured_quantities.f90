!> What an accuracy is of: the quantities that are compared from mesh to mesh, and what their errors
!> are measured by.
!>
!> docs/theory.md section 10.
module measured_quantities_mod
  use kinds_mod, only: wp
  use controls_mod, only: accuracy_of_resultants, accuracy_of_energy, accuracy_of_pressure, &
    accuracy_of_slip, accuracy_of_displacement
  use scene_mod, only: scene_t
  use contact_points_mod, only: contact_points_t
  use state_mod, only: state_t, largest_slip
  use increment_report_mod, only: increment_report_t, largest_pressure
  use step_fields_mod, only: tensor_field_t
  use mesh_fields_mod, only: fill_tensors_of
  use invariants_mod, only: von_mises
  implicit none
  private

  public :: quantity_t, list_quantities, measure_quantities, error_scales

  !> A number or a vector of an increment, with a place among its values.
  type :: quantity_t
    character(:), allocatable :: name        !! <pair>/<name>, or <name>
    character(:), allocatable :: kind        !! force, energy, ... as for datasets
    character(:), allocatable :: description
    integer  :: pair = 0         !! 0: of no pair
    integer  :: first = 1        !! of its components
    integer  :: n = 1
    integer  :: scale = 0        !! its errors are parts of the largest of quantities of this scale
    logical  :: is_scale = .true. !! which this one is among
    real(wp) :: factor = 1.0_wp  !! times this
  end type quantity_t

  !> The least size of a pair beside the largest, down to which errors are its own.
  real(wp), parameter :: smallest_pair = 1.0e-3_wp

contains

  !> The quantities that an accuracy of the scene is of.
  subroutine list_quantities(scene, list)
    type(scene_t), intent(in) :: scene
    type(quantity_t), allocatable, intent(out) :: list(:)
    integer :: p

    allocate (list(0))
    select case (scene%accuracy%of)
    case (accuracy_of_resultants)
      do p = 1, size(scene%pairs)
        associate (pair => scene%pairs(p))
          call add(quantity_t(pair%name//'/pressing_force', 'force', &
            'sum of the normal reactions', pair=p, scale=p))
          call add(quantity_t(pair%name//'/normal_force', 'force', &
            'sum of the normal reactions on the slave body as vectors, x, y, z', pair=p, n=3, &
            scale=p, is_scale=.false.))
          if (pair%mu > 0.0_wp) call add(quantity_t(pair%name//'/friction_force', 'force', &
            'sum of the friction on the slave body, x, y, z', pair=p, n=3, scale=p, &
            is_scale=.false., factor=min(pair%mu, 1.0_wp)))
        end associate
      end do
    case (accuracy_of_energy)
      call add(quantity_t('strain', 'energy', 'elastic energy of the bodies', scale=1))
    case (accuracy_of_pressure)
      do p = 1, size(scene%pairs)
        call add(quantity_t(scene%pairs(p)%name//'/largest_pressure', 'pressure', &
          'normal reaction over the area of its point, the largest', pair=p, scale=p))
      end do
    case (accuracy_of_slip)
      do p = 1, size(scene%pairs)
        call add(quantity_t(scene%pairs(p)%name//'/largest_slip', 'length', &
          'sum of the slip increments of a point, the longest', pair=p, scale=p))
      end do
    case (accuracy_of_displacement)
      call add(quantity_t('largest_displacement', 'length', 'of the nodes of bricks', scale=1))
    case default
      call add(quantity_t('largest_von_mises', 'pressure', 'of the mean stresses of the bricks', &
        scale=1))
    end select

  contains

    subroutine add(quantity)
      type(quantity_t), intent(in) :: quantity
      integer :: first

      first = 1
      if (size(list) > 0) first = list(size(list))%first + list(size(list))%n
      list = [list, quantity]
      list(size(list))%first = first
    end subroutine add

  end subroutine list_quantities

  !> Their values at the end of an increment.
  subroutine measure_quantities(scene, points, list, state, report, values)
    type(scene_t), intent(in) :: scene
    type(contact_points_t), intent(in) :: points
    type(quantity_t), intent(in) :: list(:)
    type(state_t), intent(in) :: state
    type(increment_report_t), intent(in) :: report
    real(wp), intent(out) :: values(:) !! of all components
    real(wp) :: pressing, along(3)
    integer :: k

    values = 0.0_wp
    do k = 1, size(list)
      associate (quantity => list(k), a => list(k)%first)
        select case (quantity%name(index(quantity%name, '/', back=.true.) + 1:))
        case ('pressing_force')
          call sum_normals(quantity%pair, values(a), along)
        case ('normal_force')
          call sum_normals(quantity%pair, pressing, values(a:a + 2))
        case ('friction_force')
          call sum_normals(quantity%pair, pressing, along)
          associate (first => points%first(quantity%pair), last => &
            points%first(quantity%pair + 1) - 1)
            values(a:a + 2) = sum(state%reaction(:, first:last), dim=2) - along
          end associate
        case ('largest_pressure')
          values(a) = largest_pressure(report%contact, points%first(quantity%pair), &
            points%first(quantity%pair + 1) - 1)
        case ('largest_slip')
          values(a) = largest_slip(state, points%first(quantity%pair), &
            points%first(quantity%pair + 1) - 1)
        case ('strain')
          values(a) = report%energy%strain
        case ('largest_displacement')
          values(a) = maxval(norm2(state%displacement(:, scene%mesh%brick_nodes), dim=1))
        case default
          values(a) = largest_mises()
        end select
      end associate
    end do

  contains

    !> Of the normal reactions of a pair the sum, and that as vectors.
    subroutine sum_normals(pair, pressing, vector)
      integer, intent(in) :: pair
      real(wp), intent(out) :: pressing, vector(3)
      integer :: j

      pressing = 0.0_wp
      vector = 0.0_wp
      do j = points%first(pair), points%first(pair + 1) - 1
        associate (normal => report%contact%reaction(1, j))
          pressing = pressing + normal
          vector = vector + normal*report%contact%frame(:, 1, j)
        end associate
      end do
    end subroutine sum_normals

    real(wp) function largest_mises()
      type(tensor_field_t) :: strain, stress

      allocate (stress%at_centroids(6, scene%mesh%n_elements))
      call fill_tensors_of(scene, state, strain, stress)
      largest_mises = maxval(von_mises(stress%at_centroids))
    end function largest_mises

  end subroutine measure_quantities

  !> What the errors of each quantity are measured by: the largest that those of its scale get in
  !> the run, where that is not far below those of the others.
  pure function error_scales(list, values) result(scales)
    type(quantity_t), intent(in) :: list(:)
    real(wp), intent(in) :: values(:, :) !! (n_components,n_increments)
    real(wp) :: scales(size(list))       !! > 0, or 0 where there is nothing
    real(wp) :: largest(maxval([list%scale, 1]))
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
    scales = largest(list%scale)*list%factor
  end function error_scales

end module measured_quantities_mod
