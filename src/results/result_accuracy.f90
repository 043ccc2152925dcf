!> The group /accuracy of a result file: the runs by which an accuracy was reached, what they give,
!> and what that says of the last of them, whose result the file is.
module result_accuracy_mod
  use kinds_mod, only: wp, i8
  use errors_mod, only: error_t
  use text_mod, only: string_t
  use mesh_size_mod, only: relative_size
  use increment_report_mod, only: told_theory
  use mesh_sequence_mod, only: mesh_sequence_t, theory_beside, theory_of_last
  use sequence_error_mod, only: sequence_error_t, extrapolated, extrapolated_error
  use measured_quantities_mod, only: quantity_t, error_scales
  use hdf5_files_mod, only: hdf5_file_t
  use hdf5_attributes_mod, only: describe_group, write_attribute
  use hdf5_datasets_mod, only: write_dataset, rewrite_dataset
  implicit none
  private

  public :: create_accuracy, finish_accuracy

  character(*), parameter :: group = '/accuracy'

contains

  !> Make the group for the runs that there are and one more, which begins: its numbers come last.
  subroutine create_accuracy(file, sequence, error)
    type(hdf5_file_t), intent(in) :: file
    type(mesh_sequence_t), intent(in) :: sequence
    type(error_t), allocatable, intent(inout) :: error
    integer :: runs, components

    runs = size(sequence%runs) + 1
    components = n_components(sequence%list)
    call describe_group(file, group, 'the runs by which an accuracy was looked for, and what '// &
      'they say of the last one; zeros until it ends', error)
    call write_attribute(file, group, 'wanted', sequence%asked, error)
    call write_attribute(file, group, 'time_allowed', sequence%time, error)
    call write_attribute(file, group, 'memory_allowed', sequence%memory, error)
    call write_attribute(file, group, 'of_extrapolated', merge(1_i8, 0_i8, &
      sequence%extrapolates), error)
    call write_attribute(file, group, 'reached', 0_i8, error)
    call write_attribute(file, group, 'mesh', 0.0_wp, error)
    call write_attribute(file, group, 'load_steps', 0.0_wp, error)
    call write_attribute(file, group, 'mesh_and_load_steps', 0.0_wp, error)
    call write_attribute(file, group, 'others', 0.0_wp, error)
    call write_attribute(file, group, 'small_strain', -1.0_wp, error)
    call of_runs('element_size', 'edges of the elements over those of the deck', 'ratio')
    call of_runs('divisions', 'parts of each increment of the deck', 'number')
    call of_runs('cuts', 'of elements at contact, beside all others', 'number')
    call of_runs('elements', 'elements of the mesh', 'number')
    call of_runs('processor_time', 'of the run', 'seconds')
    call write_dataset(file, group//'/values', reshape([real(wp) ::], [components, &
      sequence%n_increments, runs], pad=[0.0_wp]), 'what each run gives at the end of each '// &
      'increment of the deck; the components are named by the attribute "name"', 'as named', error)
    call write_dataset(file, group//'/extrapolated', spread(spread(0.0_wp, 1, components), 2, &
      sequence%n_increments), 'what several meshes give for elements without size; not '// &
      'certified', 'as named', error)
    call of_components('error', 'of the last run by its mesh, of the scale, increment by '// &
      'increment the largest; -1: not known')
    call of_components('extrapolated_error', 'of the extrapolated values by the mesh, '// &
      'likewise; -1: not known')
    call of_components('order', 'of the error in the size of the elements, as observed')
    call of_components('scale', 'what errors are parts of: of the last run')
    call name_components('values')
    call name_components('extrapolated')
    call name_components('error')
    call name_components('extrapolated_error')
    call name_components('order')
    call name_components('scale')

  contains

    subroutine of_runs(name, description, quantity)
      character(*), intent(in) :: name, description, quantity

      call write_dataset(file, group//'/'//name, spread(0.0_wp, 1, runs), description, quantity, &
        error)
    end subroutine of_runs

    subroutine of_components(name, description)
      character(*), intent(in) :: name, description

      call write_dataset(file, group//'/'//name, spread(0.0_wp, 1, components), description, &
        'ratio', error)
    end subroutine of_components

    subroutine name_components(dataset)
      character(*), intent(in) :: dataset
      type(string_t) :: names(components)
      integer :: k, i

      do k = 1, size(sequence%list)
        associate (quantity => sequence%list(k))
          do i = 0, quantity%n - 1
            names(quantity%first + i)%text = quantity%name
            if (quantity%n > 1) names(quantity%first + i)%text = quantity%name//'_'// &
              'xyz'(i + 1:i + 1)
          end do
        end associate
      end do
      if (components > 0) call write_attribute(file, group//'/'//dataset, 'name', names, error)
    end subroutine name_components

  end subroutine create_accuracy

  !> Put in the numbers, when the last run is done.
  subroutine finish_accuracy(file, sequence, errors, is_reached, error)
    type(hdf5_file_t), intent(in) :: file
    type(mesh_sequence_t), intent(in) :: sequence
    type(sequence_error_t), intent(in) :: errors
    logical, intent(in) :: is_reached
    type(error_t), allocatable, intent(inout) :: error
    real(wp), allocatable :: values(:), limits(:), of_error(:), of_limit(:), of_order(:), &
      of_scale(:)
    real(wp) :: scales(size(sequence%list))
    integer :: i, k

    values = [real(wp) ::]
    do i = 1, size(sequence%runs)
      values = [values, sequence%runs(i)%values]
    end do
    associate (last => sequence%runs(size(sequence%runs)))
      scales = error_scales(sequence%list, last%values)
      limits = spread(0.0_wp, 1, size(last%values))
      of_error = spread(-1.0_wp, 1, size(last%values, 1))
    end associate
    of_limit = of_error
    of_order = 0.0_wp*of_error
    of_scale = 0.0_wp*of_error
    do k = 1, size(sequence%list)
      call put_quantity(k)
    end do
    call write_attribute(file, group, 'reached', merge(1_i8, 0_i8, is_reached), error)
    call write_attribute(file, group, 'mesh', errors%mesh, error)
    call write_attribute(file, group, 'load_steps', errors%load_steps, error)
    call write_attribute(file, group, 'mesh_and_load_steps', errors%together, error)
    call write_attribute(file, group, 'others', errors%others, error)
    if (sequence%theory /= theory_beside) then
      associate (theory => theory_of_last(sequence))
        call write_attribute(file, group, 'small_strain', told_theory(theory%error, &
          theory%is_estimate), error)
      end associate
    end if
    associate (runs => sequence%runs)
      call rewrite_dataset(file, group//'/element_size', [(relative_size(runs(i)%mesh_size), i=1, &
        size(runs))], error)
      call rewrite_dataset(file, group//'/divisions', real(runs%divisions, wp), error)
      call rewrite_dataset(file, group//'/cuts', [(real(runs(i)%mesh_size%zone%times, wp), i=1, &
        size(runs))], error)
      call rewrite_dataset(file, group//'/elements', real(runs%n_elements, wp), error)
      call rewrite_dataset(file, group//'/processor_time', [runs%seconds], error)
    end associate
    call rewrite_dataset(file, group//'/values', values, error)
    call rewrite_dataset(file, group//'/extrapolated', limits, error)
    call rewrite_dataset(file, group//'/error', of_error, error)
    call rewrite_dataset(file, group//'/extrapolated_error', of_limit, error)
    call rewrite_dataset(file, group//'/order', of_order, error)
    call rewrite_dataset(file, group//'/scale', of_scale, error)

  contains

    subroutine put_quantity(k)
      integer, intent(in) :: k
      real(wp), allocatable :: of_quantity(:, :)
      integer :: j

      associate (quantity => sequence%list(k), components => size(of_error))
        of_quantity = extrapolated(sequence, errors, k)
        do j = 1, size(of_quantity, 2)
          associate (a => (j - 1)*components + quantity%first)
            limits(a:a + quantity%n - 1) = of_quantity(:, j)
          end associate
        end do
        associate (a => quantity%first, b => quantity%first + quantity%n - 1)
          of_scale(a:b) = scales(k)
          if (.not. allocated(errors%of_mesh) .or. .not. quantity%is_compared) return
          of_error(a:b) = errors%of_mesh(k)%error
          of_limit(a:b) = extrapolated_error(sequence, errors, k)
          of_order(a:b) = errors%of_mesh(k)%order
        end associate
      end associate
    end subroutine put_quantity

  end subroutine finish_accuracy

  pure integer function n_components(list)
    type(quantity_t), intent(in) :: list(:)

    n_components = sum(list%n)
  end function n_components

end module result_accuracy_mod
