!> Assertions and test runner of the in-tree stand-in for pFUnit.
!>
!> A `.pf` file is written for real pFUnit 4.14 and knows nothing of this file. When pFUnit is not
!> installed, `funit_preprocess.py` turns each assertion into a call of one of the `funit_*`
!> procedures below. What is accepted is a subset of pFUnit's generic interfaces: an argument
!> list that pFUnit would not compile is a failure here.
!>
!> The failures of the running test are module variables: an assertion has no other way to reach
!> the runner, since the test subroutine has no arguments.
module funit
  use, intrinsic :: iso_fortran_env, only: int64, real32, real64, output_unit
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_is_nan
  ! allow(use-all)
  use funit_names
  use funit_values_mod, only: values_t, funit_values, kind_i32, kind_i64, kind_r32, kind_r64, &
    kind_text, kind_names
  implicit none
  private

  public :: anyexceptions, sourcelocation, test, testsuite
  public :: funit_values, funit_compare, funit_condition, funit_classify, funit_fail

  ! Handed on, see funit_names.f90.
  public :: run, generic_run, initialize, finalize, stub, get_context, throw, catch, catchnext
  public :: disable, expectation, subject, predicate, true, false, is, near, relatively_near
  public :: equal_to, greater_than, any_of, all_of, every, every_item, matchable, testcase
  public :: testmethod, testresult, testrunner, testlistener, serialcontext, assertequal
  public :: assertnotequal, assertrelativelyequal, assertapprox, asserttrue, assertfalse
  public :: assertlessthan, assertlessthanorequal, assertgreaterthan, assertgreaterthanorequal
  public :: assertisnan, assertisfinite, assertfail, assertany, assertall, assertnone
  public :: assertnotall, assertsameshape, assertexceptionraised

  character(len=*), parameter :: new_item = new_line('a')//'    '

  !> Where an assertion stands: the `.pf` file and its line.
  type :: sourcelocation
    character(len=128) :: file = ''  !! file name without folders
    integer            :: line = 0   !! line number, from 1
  end type sourcelocation

  abstract interface
    subroutine plain_procedure()
      implicit none
    end subroutine plain_procedure
  end interface

  !> One test of a suite, with what runs before and after it.
  type :: test
    character(len=:), allocatable :: name
    logical :: disabled = .false.
    procedure(plain_procedure), pointer, nopass :: method   => null()
    procedure(plain_procedure), pointer, nopass :: setup    => null()
    procedure(plain_procedure), pointer, nopass :: teardown => null()
  contains
    procedure :: define
  end type test

  !> Runs the tests it is given, one by one, and counts.
  type :: testsuite
    character(len=:), allocatable :: name      !! <module>_suite, as pFUnit calls it
    character(len=:), allocatable :: filter    !! run only tests whose full name holds this
    integer :: n_run = 0, n_failed = 0, n_disabled = 0
  contains
    procedure :: start
    procedure :: run => run_one
    procedure :: finish
  end type testsuite

  integer :: n_failures = 0                          ! of the running test
  character(len=:), allocatable :: failure_report    ! of the running test
  character(len=:), allocatable :: running_name

  interface funit_condition
    module procedure condition_0, condition_1
  end interface funit_condition

contains

  ! ---------------------------------------------------------------- assertions

  !> Say whether the running test has failed already.
  logical function anyexceptions() result(failed)
    failed = n_failures > 0
  end function anyexceptions

  !> Fail unless `expected <assertion> found` holds for every element.
  !>
  !> A scalar `expected` stands for an array of the shape of `found`. The norm is the largest
  !> difference; a NaN on either side fails every assertion.
  subroutine funit_compare(assertion, expected, found, tolerance, message, location)
    character(len=*), intent(in)           :: assertion   !! lower case: 'assertequal', ...
    type(values_t),   intent(in)           :: expected
    type(values_t),   intent(in)           :: found
    type(values_t),   intent(in), optional :: tolerance   !! scalar, 0 when absent
    character(len=*), intent(in), optional :: message
    type(sourcelocation), intent(in)       :: location
    character(len=:), allocatable :: reason
    real(real64) :: tol
    integer :: i, n

    if (.not. is_supported(assertion, expected, found, tolerance)) then
      reason = 'pFUnit has no '//assertion//'('//described(expected)//', '//described(found)
      if (present(tolerance)) reason = reason//', tolerance '//described(tolerance)
      call record(assertion, reason//')', message, location)
      return
    end if
    if (size(expected%extents) > 0) then
      if (any(expected%extents /= found%extents)) then
        call record(assertion, 'the shapes differ'// &
          new_item//'expected: '//bracketed(expected%extents)// &
          new_item//'found:    '//bracketed(found%extents), message, location)
        return
      end if
    end if

    tol = 0.0_real64
    if (present(tolerance)) tol = tolerance%reals(1)
    n = product(found%extents)
    do i = 1, n
      if (.not. holds(assertion, expected, found, tol, i)) then
        reason = 'is not so'//new_item//'expected: '//element_text(expected, i)// &
          new_item//'found:    '//element_text(found, i)
        if (present(tolerance)) reason = reason//new_item//'tolerance: '//real_text(tol)
        if (size(found%extents) > 0) then
          reason = reason//new_item//'at index: '//bracketed(subscripts(found%extents, i))
        end if
        call record(assertion, reason, message, location)
        return
      end if
    end do
  end subroutine funit_compare

  !> Fail unless the condition has the wanted value.
  subroutine condition_0(assertion, wanted, condition, message, location)
    character(len=*), intent(in)           :: assertion
    logical,          intent(in)           :: wanted
    logical,          intent(in)           :: condition
    character(len=*), intent(in), optional :: message
    type(sourcelocation), intent(in)       :: location

    if (condition .eqv. wanted) return
    call record(assertion, 'the condition is '//logical_text(condition), message, location)
  end subroutine condition_0

  !> Fail unless every condition has the wanted value.
  subroutine condition_1(assertion, wanted, condition, message, location)
    character(len=*), intent(in)           :: assertion
    logical,          intent(in)           :: wanted
    logical,          intent(in)           :: condition(:)
    character(len=*), intent(in), optional :: message
    type(sourcelocation), intent(in)       :: location
    integer :: i

    do i = 1, size(condition)
      if (condition(i) .eqv. wanted) cycle
      call record(assertion, 'the condition is '//logical_text(condition(i))// &
        new_item//'at index: '//bracketed([i]), message, location)
      return
    end do
  end subroutine condition_1

  !> Fail unless the real scalar is a NaN ('assertisnan') or finite ('assertisfinite').
  subroutine funit_classify(assertion, found, message, location)
    character(len=*), intent(in)           :: assertion
    type(values_t),   intent(in)           :: found
    character(len=*), intent(in), optional :: message
    type(sourcelocation), intent(in)       :: location
    logical :: good

    if (.not. (is_real(found%kind) .and. size(found%extents) == 0)) then
      call record(assertion, 'pFUnit has no '//assertion//'('//described(found)//')', &
        message, location)
      return
    end if
    if (assertion == 'assertisnan') then
      good = ieee_is_nan(found%reals(1))
    else
      good = ieee_is_finite(found%reals(1))
    end if
    if (.not. good) then
      call record(assertion, 'is not so'//new_item//'found:    '//element_text(found, 1), &
        message, location)
    end if
  end subroutine funit_classify

  !> Fail.
  subroutine funit_fail(message, location)
    character(len=*), intent(in)     :: message
    type(sourcelocation), intent(in) :: location

    call record('assertfail', 'reached', message, location)
  end subroutine funit_fail

  !> Note a failure of the running test: `FILE.pf:line: test: message`, then the values.
  subroutine record(assertion, reason, message, location)
    character(len=*), intent(in)           :: assertion
    character(len=*), intent(in)           :: reason    !! its further lines are indented
    character(len=*), intent(in), optional :: message
    type(sourcelocation), intent(in)       :: location
    character(len=:), allocatable :: line

    line = trim(location%file)//':'//integer_text(int(location%line, int64))//': '
    if (allocated(running_name)) line = line//running_name//': '
    if (present(message)) line = line//trim(message)//': '
    line = line//assertion//': '//reason//new_line('a')
    if (n_failures == 0) then
      failure_report = line
    else
      failure_report = failure_report//line
    end if
    n_failures = n_failures + 1
  end subroutine record

  ! ---------------------------------------------------------------- what pFUnit accepts

  !> Say whether pFUnit has a specific procedure for these kinds and ranks.
  pure logical function is_supported(assertion, expected, found, tolerance) result(supported)
    character(len=*), intent(in)           :: assertion
    type(values_t),   intent(in)           :: expected
    type(values_t),   intent(in)           :: found
    type(values_t),   intent(in), optional :: tolerance
    integer :: rank_expected, rank_found

    rank_expected = size(expected%extents)
    rank_found = size(found%extents)
    supported = rank_expected == 0 .or. rank_expected == rank_found

    select case (found%kind)
    case (kind_text)
      supported = supported .and. expected%kind == kind_text .and. assertion == 'assertequal'
    case (kind_i32)
      supported = supported .and. expected%kind == kind_i32
    case (kind_i64)
      supported = supported .and. (expected%kind == kind_i32 .or. expected%kind == kind_i64)
    case (kind_r32)
      supported = supported .and. (expected%kind == kind_i32 .or. expected%kind == kind_r32)
    case default
      supported = supported .and. (expected%kind == kind_i32 .or. is_real(expected%kind))
    end select

    if (present(tolerance)) then
      supported = supported .and. is_real(found%kind) .and. size(tolerance%extents) == 0 &
        .and. (tolerance%kind == kind_r32 .or. tolerance%kind == found%kind)
    else
      supported = supported .and. assertion /= 'assertrelativelyequal'
    end if
  end function is_supported

  pure logical function is_real(kind) result(real_kind)
    integer, intent(in) :: kind

    real_kind = kind == kind_r32 .or. kind == kind_r64
  end function is_real

  ! ---------------------------------------------------------------- comparisons

  !> Say whether the assertion holds for element `i` of `found`.
  pure logical function holds(assertion, expected, found, tolerance, i) result(good)
    character(len=*), intent(in) :: assertion
    type(values_t),   intent(in) :: expected, found
    real(real64),     intent(in) :: tolerance
    integer,          intent(in) :: i          !! in element order
    integer :: j

    j = merge(1, i, size(expected%extents) == 0)
    select case (found%kind)
    case (kind_text)
      good = same_text(expected%texts(j)%s, found%texts(i)%s)
    case (kind_i32, kind_i64)
      good = holds_for_integers(assertion, expected%integers(j), found%integers(i))
    case default
      good = holds_for_reals(assertion, real_element(expected, j, found%kind), &
        found%reals(i), tolerance, found%kind)
    end select
  end function holds

  pure logical function holds_for_integers(assertion, e, f) result(holds)
    character(len=*), intent(in) :: assertion
    integer(int64),   intent(in) :: e, f

    select case (assertion)
    case ('assertequal')
      holds = e == f
    case ('assertnotequal')
      holds = e /= f
    case ('assertlessthan')
      holds = e < f
    case ('assertlessthanorequal')
      holds = e <= f
    case ('assertgreaterthan')
      holds = e > f
    case ('assertgreaterthanorequal')
      holds = e >= f
    case default
      holds = .false.
    end select
  end function holds_for_integers

  !> Compare two reals as pFUnit does, in the kind of `found`.
  !>
  !> NaNs are sorted out first, and infinities are never subtracted from each other: a build with
  !> trapped floating-point exceptions must report them, not stop.
  pure logical function holds_for_reals(assertion, e, f, tolerance, kind) result(holds)
    character(len=*), intent(in) :: assertion
    real(real64),     intent(in) :: e, f
    real(real64),     intent(in) :: tolerance
    integer,          intent(in) :: kind       !! kind_r32 or kind_r64, of found
    logical :: same

    holds = .false.
    if (ieee_is_nan(e) .or. ieee_is_nan(f) .or. ieee_is_nan(tolerance)) return
    same = e <= f .and. e >= f
    select case (assertion)
    case ('assertequal')
      holds = same
      if (.not. same) holds = distance(e, f, kind) <= tolerance
    case ('assertnotequal')
      if (.not. same) holds = distance(e, f, kind) > tolerance
    case ('assertlessthan')
      holds = e < in_kind(f + tolerance, kind)
    case ('assertlessthanorequal')
      holds = e <= in_kind(f + tolerance, kind)
    case ('assertgreaterthan')
      holds = e > in_kind(f - tolerance, kind)
    case ('assertgreaterthanorequal')
      holds = e >= in_kind(f - tolerance, kind)
    case ('assertrelativelyequal')
      ! pFUnit refuses a zero expected value, and a non-finite one never passes there.
      if (.not. (ieee_is_finite(e) .and. ieee_is_finite(f))) return
      if (abs(e) > 0.0_real64) then
        holds = distance(e, f, kind) <= in_kind(tolerance*abs(e), kind)
      end if
    case default
      holds = .false.
    end select
  end function holds_for_reals

  !> |a - b| for two different numbers, without overflow.
  pure real(real64) function distance(a, b, kind) result(d)
    real(real64), intent(in) :: a, b
    integer,      intent(in) :: kind

    if (.not. (ieee_is_finite(a) .and. ieee_is_finite(b))) then
      d = huge(a)
    else if (max(abs(a), abs(b)) > 0.5_real64*huge(a)) then
      d = 2.0_real64*min(abs(0.5_real64*a - 0.5_real64*b), 0.5_real64*huge(a))
    else
      d = in_kind(abs(a - b), kind)
    end if
  end function distance

  !> Round to single precision when that is the kind of the comparison.
  pure real(real64) function in_kind(x, kind) result(y)
    real(real64), intent(in) :: x
    integer,      intent(in) :: kind

    y = x
    if (kind == kind_r32 .and. abs(x) <= real(huge(1.0_real32), real64)) then
      y = real(real(x, real32), real64)
    end if
  end function in_kind

  !> Element `i` of integers or reals, as a real of the given kind.
  pure real(real64) function real_element(values, i, kind) result(x)
    type(values_t), intent(in) :: values
    integer,        intent(in) :: i
    integer,        intent(in) :: kind

    if (is_real(values%kind)) then
      x = values%reals(i)
    else
      x = in_kind(real(values%integers(i), real64), kind)
    end if
  end function real_element

  !> Compare texts, blanks and tabs at both ends apart.
  pure logical function same_text(a, b) result(same)
    character(len=*), intent(in) :: a, b
    character(len=*), parameter :: blanks = ' '//achar(9)
    integer :: a1, a2, b1, b2

    a1 = verify(a, blanks)
    a2 = verify(a, blanks, back=.true.)
    b1 = verify(b, blanks)
    b2 = verify(b, blanks, back=.true.)
    if (a1 == 0 .or. b1 == 0) then
      same = a1 == b1
    else
      same = a2 - a1 == b2 - b1
      if (same) same = a(a1:a2) == b(b1:b2)
    end if
  end function same_text

  ! ---------------------------------------------------------------- texts

  pure function integer_text(i) result(text)
    integer(int64), intent(in) :: i
    character(len=:), allocatable :: text
    character(len=24) :: buffer

    write (buffer, '(i0)') i
    text = trim(buffer)
  end function integer_text

  pure function real_text(x) result(text)
    real(real64), intent(in) :: x
    character(len=:), allocatable :: text
    character(len=40) :: buffer

    write (buffer, '(g0)') x
    text = trim(buffer)
  end function real_text

  pure function logical_text(l) result(text)
    logical, intent(in) :: l
    character(len=:), allocatable :: text

    if (l) then
      text = 'true'
    else
      text = 'false'
    end if
  end function logical_text

  !> Element `i`, or the scalar that stands for it.
  pure function element_text(values, i) result(text)
    type(values_t), intent(in) :: values
    integer,        intent(in) :: i
    character(len=:), allocatable :: text
    integer :: j

    j = merge(1, i, size(values%extents) == 0)
    select case (values%kind)
    case (kind_text)
      text = '"'//values%texts(j)%s//'"'
    case (kind_i32, kind_i64)
      text = integer_text(values%integers(j))
    case default
      text = real_text(values%reals(j))
    end select
  end function element_text

  pure function bracketed(numbers) result(text)
    integer, intent(in) :: numbers(:)
    character(len=:), allocatable :: text
    integer :: i

    text = '('
    do i = 1, size(numbers)
      if (i > 1) text = text//', '
      text = text//integer_text(int(numbers(i), int64))
    end do
    text = text//')'
  end function bracketed

  !> Kind and rank, for the message about an interface that does not exist.
  pure function described(values) result(text)
    type(values_t), intent(in) :: values
    character(len=:), allocatable :: text

    text = trim(kind_names(values%kind))//' of rank '// &
      integer_text(int(size(values%extents), int64))
  end function described

  !> Subscripts of element `i` in element order.
  pure function subscripts(extents, i) result(indices)
    integer, intent(in) :: extents(:)
    integer, intent(in) :: i
    integer :: indices(size(extents))
    integer :: d, rest

    rest = i - 1
    do d = 1, size(extents)
      indices(d) = mod(rest, extents(d)) + 1
      rest = rest/extents(d)
    end do
  end function subscripts

  ! ---------------------------------------------------------------- the runner

  !> Describe a test.
  subroutine define(self, name, method, setup, teardown, disabled)
    class(test),      intent(inout)      :: self
    character(len=*), intent(in)         :: name
    procedure(plain_procedure)           :: method
    procedure(plain_procedure), optional :: setup
    procedure(plain_procedure), optional :: teardown
    logical, intent(in), optional        :: disabled

    self%name = name
    self%disabled = .false.
    if (present(disabled)) self%disabled = disabled
    self%method => method
    nullify (self%setup, self%teardown)
    if (present(setup)) self%setup => setup
    if (present(teardown)) self%teardown => teardown
  end subroutine define

  !> Read the command line: `-f TEXT` runs only the tests whose `<module>_suite.<test>` holds TEXT.
  subroutine start(self)
    class(testsuite), intent(inout) :: self
    character(len=:), allocatable :: argument
    integer :: i

    self%filter = ''
    self%name = ''
    i = 1
    do while (i <= command_argument_count())
      argument = argument_text(i)
      select case (argument)
      case ('-f', '--filter')
        i = i + 1
        if (i > command_argument_count()) call refuse('-f wants a text')
        self%filter = argument_text(i)
      case ('-v', '--verbose', '-d', '--debug')
        continue   ! pFUnit's ctest passes it; every name is printed anyway
      case default
        call refuse('unknown argument '//argument//'; usage: [-f TEXT] [-v]')
      end select
      i = i + 1
    end do
  end subroutine start

  subroutine refuse(message)
    character(len=*), intent(in) :: message

    write (output_unit, '(a)') message
    stop 1
  end subroutine refuse

  function argument_text(i) result(text)
    integer, intent(in) :: i
    character(len=:), allocatable :: text
    integer :: length

    call get_command_argument(i, length=length)
    allocate (character(len=length) :: text)
    call get_command_argument(i, value=text)
  end function argument_text

  !> Run one test: what comes before it, the test, what comes after it.
  !>
  !> As in pFUnit, a failure before the test skips the test and what comes after it.
  subroutine run_one(self, t)
    class(testsuite), intent(inout) :: self
    type(test),       intent(in)    :: t

    if (index(self%name//'.'//t%name, self%filter) == 0) return
    if (t%disabled) then
      self%n_disabled = self%n_disabled + 1
      write (output_unit, '(a)') self%name//'.'//t%name//' ... disabled'
      return
    end if

    self%n_run = self%n_run + 1
    n_failures = 0
    running_name = t%name
    ! The name goes out before the test runs, so that a crash names its test.
    write (output_unit, '(a)', advance='no') self%name//'.'//t%name//' ...'
    flush (output_unit)
    if (associated(t%setup)) call t%setup()
    if (.not. anyexceptions()) then
      call t%method()
      if (associated(t%teardown)) call t%teardown()
    end if

    if (anyexceptions()) then
      self%n_failed = self%n_failed + 1
      write (output_unit, '(a)') ' FAILED'
      write (output_unit, '(a)', advance='no') failure_report
    else
      write (output_unit, '(a)') ' ok'
    end if
    flush (output_unit)
  end subroutine run_one

  !> Print the summary; stop with a non-zero status if a test failed or none ran.
  subroutine finish(self)
    class(testsuite), intent(in) :: self

    write (output_unit, '(i0, a, i0, a, i0, a)') self%n_run, ' tests run, ', self%n_failed, &
      ' failed, ', self%n_disabled, ' disabled'
    if (self%n_run == 0) write (output_unit, '(a)') 'FAILED: no test ran'
    flush (output_unit)
    if (self%n_failed > 0 .or. self%n_run == 0) stop 1
  end subroutine finish

end module funit
