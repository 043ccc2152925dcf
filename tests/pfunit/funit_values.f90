!> What the assertions of the stand-in for pFUnit compare: values of any kind and rank, flattened.
module funit_values_mod
  use, intrinsic :: iso_fortran_env, only: int32, int64, real32, real64
  implicit none
  private

  public :: values_t, funit_values
  public :: kind_i32, kind_i64, kind_r32, kind_r64, kind_text, kind_names

  integer, parameter :: kind_i32 = 1, kind_i64 = 2, kind_r32 = 3, kind_r64 = 4, kind_text = 5
  character(len=9), parameter :: kind_names(5) = &
    [character(len=9) :: 'int32', 'int64', 'real32', 'real64', 'character']

  type :: text_t
    character(len=:), allocatable :: s
  end type text_t

  !> Any value an assertion compares, flattened: one of the three arrays is used.
  type :: values_t
    integer                      :: kind = 0      !! one of kind_*
    integer, allocatable         :: extents(:)    !! shape, of size 0 for a scalar
    integer(int64), allocatable  :: integers(:)
    real(real64), allocatable    :: reals(:)
    type(text_t), allocatable    :: texts(:)
  end type values_t

  !> Flatten a value of any supported kind and rank.
  interface funit_values
    module procedure values_i32_0, values_i32_1, values_i32_2, values_i32_3
    module procedure values_i64_0, values_i64_1, values_i64_2, values_i64_3
    module procedure values_r32_0, values_r32_1, values_r32_2, values_r32_3
    module procedure values_r64_0, values_r64_1, values_r64_2, values_r64_3
    module procedure values_text_0, values_text_1
  end interface funit_values

contains

  pure function of_integers(kind, integers, extents) result(v)
    integer,        intent(in) :: kind
    integer(int64), intent(in) :: integers(:)
    integer,        intent(in) :: extents(:)
    type(values_t) :: v

    v%kind = kind
    allocate (v%integers(size(integers)), v%extents(size(extents)))
    v%integers(:) = integers
    v%extents(:) = extents
  end function of_integers

  pure function of_reals(kind, reals, extents) result(v)
    integer,      intent(in) :: kind
    real(real64), intent(in) :: reals(:)
    integer,      intent(in) :: extents(:)
    type(values_t) :: v

    v%kind = kind
    allocate (v%reals(size(reals)), v%extents(size(extents)))
    v%reals(:) = reals
    v%extents(:) = extents
  end function of_reals

  pure function values_i32_0(x) result(v)
    integer(int32), intent(in) :: x
    type(values_t) :: v

    v = of_integers(kind_i32, int([x], int64), shape(x))
  end function values_i32_0

  pure function values_i32_1(x) result(v)
    integer(int32), intent(in) :: x(:)
    type(values_t) :: v

    v = of_integers(kind_i32, int(pack(x, .true.), int64), shape(x))
  end function values_i32_1

  pure function values_i32_2(x) result(v)
    integer(int32), intent(in) :: x(:, :)
    type(values_t) :: v

    v = of_integers(kind_i32, int(pack(x, .true.), int64), shape(x))
  end function values_i32_2

  pure function values_i32_3(x) result(v)
    integer(int32), intent(in) :: x(:, :, :)
    type(values_t) :: v

    v = of_integers(kind_i32, int(pack(x, .true.), int64), shape(x))
  end function values_i32_3

  pure function values_i64_0(x) result(v)
    integer(int64), intent(in) :: x
    type(values_t) :: v

    v = of_integers(kind_i64, [x], shape(x))
  end function values_i64_0

  pure function values_i64_1(x) result(v)
    integer(int64), intent(in) :: x(:)
    type(values_t) :: v

    v = of_integers(kind_i64, pack(x, .true.), shape(x))
  end function values_i64_1

  pure function values_i64_2(x) result(v)
    integer(int64), intent(in) :: x(:, :)
    type(values_t) :: v

    v = of_integers(kind_i64, pack(x, .true.), shape(x))
  end function values_i64_2

  pure function values_i64_3(x) result(v)
    integer(int64), intent(in) :: x(:, :, :)
    type(values_t) :: v

    v = of_integers(kind_i64, pack(x, .true.), shape(x))
  end function values_i64_3

  pure function values_r32_0(x) result(v)
    real(real32), intent(in) :: x
    type(values_t) :: v

    v = of_reals(kind_r32, real([x], real64), shape(x))
  end function values_r32_0

  pure function values_r32_1(x) result(v)
    real(real32), intent(in) :: x(:)
    type(values_t) :: v

    v = of_reals(kind_r32, real(pack(x, .true.), real64), shape(x))
  end function values_r32_1

  pure function values_r32_2(x) result(v)
    real(real32), intent(in) :: x(:, :)
    type(values_t) :: v

    v = of_reals(kind_r32, real(pack(x, .true.), real64), shape(x))
  end function values_r32_2

  pure function values_r32_3(x) result(v)
    real(real32), intent(in) :: x(:, :, :)
    type(values_t) :: v

    v = of_reals(kind_r32, real(pack(x, .true.), real64), shape(x))
  end function values_r32_3

  pure function values_r64_0(x) result(v)
    real(real64), intent(in) :: x
    type(values_t) :: v

    v = of_reals(kind_r64, [x], shape(x))
  end function values_r64_0

  pure function values_r64_1(x) result(v)
    real(real64), intent(in) :: x(:)
    type(values_t) :: v

    v = of_reals(kind_r64, pack(x, .true.), shape(x))
  end function values_r64_1

  pure function values_r64_2(x) result(v)
    real(real64), intent(in) :: x(:, :)
    type(values_t) :: v

    v = of_reals(kind_r64, pack(x, .true.), shape(x))
  end function values_r64_2

  pure function values_r64_3(x) result(v)
    real(real64), intent(in) :: x(:, :, :)
    type(values_t) :: v

    v = of_reals(kind_r64, pack(x, .true.), shape(x))
  end function values_r64_3

  pure function values_text_0(x) result(v)
    character(len=*), intent(in) :: x
    type(values_t) :: v

    v%kind = kind_text
    allocate (v%texts(1), v%extents(0))
    v%texts(1)%s = x
  end function values_text_0

  pure function values_text_1(x) result(v)
    character(len=*), intent(in) :: x(:)
    type(values_t) :: v
    integer :: i

    v%kind = kind_text
    allocate (v%texts(size(x)), v%extents(1))
    v%extents(1) = size(x)
    do i = 1, size(x)
      v%texts(i)%s = x(i)
    end do
  end function values_text_1

end module funit_values_mod
