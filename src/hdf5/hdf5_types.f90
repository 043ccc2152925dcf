!> Kinds of numbers, texts and extents as HDF5 knows them; for the other hdf5_ files.
module hdf5_types_mod
  use hdf5, only: hid_t, hsize_t, size_t, h5kind_to_type, h5screate_f, h5screate_simple_f, &
    h5tcopy_f, h5tequal_f, h5tget_class_f, h5tset_cset_f, h5tset_size_f, h5tset_strpad_f, &
    H5S_SCALAR_F, H5T_CSET_UTF8_F, H5T_C_S1, H5T_IEEE_F64LE, H5T_STD_I32LE, H5T_STD_I64LE, &
    H5T_STD_I8LE, H5T_STD_U8LE, H5T_STRING_F, H5T_STR_NULLPAD_F, H5_INTEGER_KIND, H5_REAL_KIND
  use dataset_kinds_mod, only: of_real, bytes_of
  use kinds_mod, only: wp, i1, i4, i8
  implicit none
  private

  public :: no_id, type_in_file, kind_of_type, type_in_memory, text_type, is_text, new_space

  integer(hid_t), parameter :: no_id = -1 !! nothing of HDF5 is open

contains

  integer(hid_t) function type_in_file(kind) result(type_id)
    integer, intent(in) :: kind !! of_real, of_integer, of_long, of_byte, of_unsigned_byte
    integer(hid_t) :: types(5)

    types = [H5T_IEEE_F64LE, H5T_STD_I32LE, H5T_STD_I64LE, H5T_STD_I8LE, H5T_STD_U8LE]
    type_id = types(kind)
  end function type_in_file

  !> The kind whose numbers a type is that of, to the place of every bit; 0: of none.
  function kind_of_type(type_id) result(kind)
    integer(hid_t), intent(in) :: type_id
    integer :: kind, status
    logical :: same

    do kind = size(bytes_of), 1, -1
      call h5tequal_f(type_id, type_in_file(kind), same, status)
      if (status >= 0 .and. same) exit
    end do
  end function kind_of_type

  integer(hid_t) function type_in_memory(kind) result(type_id)
    integer, intent(in) :: kind !! likewise
    integer, parameter :: kinds(5) = [wp, i4, i8, i1, i1]

    type_id = h5kind_to_type(kinds(kind), merge(H5_REAL_KIND, H5_INTEGER_KIND, kind == of_real))
  end function type_in_memory

  !> A text type of `length` bytes, padded with NUL; to be closed.
  integer(hid_t) function text_type(length, ascii) result(type_id)
    integer, intent(in) :: length !! bytes, at least 1
    logical, intent(in) :: ascii  !! as VTK wants it; else UTF-8
    integer :: status

    call h5tcopy_f(H5T_C_S1, type_id, status)
    call h5tset_size_f(type_id, int(length, size_t), status)
    call h5tset_strpad_f(type_id, H5T_STR_NULLPAD_F, status)
    if (.not. ascii) call h5tset_cset_f(type_id, H5T_CSET_UTF8_F, status)
  end function text_type

  !> A space of fixed extents, a scalar where there are none; to be closed.
  integer(hid_t) function new_space(extents) result(space)
    integer(hsize_t), intent(in) :: extents(:)
    integer :: status

    if (size(extents) == 0) then
      call h5screate_f(H5S_SCALAR_F, space, status)
    else
      call h5screate_simple_f(size(extents), extents, space, status)
    end if
  end function new_space


  logical function is_text(type_id) result(text)
    integer(hid_t), intent(in) :: type_id
    integer :: class, status

    call h5tget_class_f(type_id, class, status)
    text = status >= 0 .and. class == H5T_STRING_F
  end function is_text

end module hdf5_types_mod
