!> Names that pFUnit's `funit` exports and the stand-in has no use for.
!>
!> They are taken here too, so that a clash with a name of the code under test shows with the
!> stand-in as it would with pFUnit. They are empty types, so that none can be used by mistake as
!> a value or a procedure.
module funit_names
  implicit none
  ! allow(default-public-accessibility)
  public

  type :: run
  end type run
  type :: generic_run
  end type generic_run
  type :: initialize
  end type initialize
  type :: finalize
  end type finalize
  type :: stub
  end type stub
  type :: get_context
  end type get_context
  type :: throw
  end type throw
  type :: catch
  end type catch
  type :: catchnext
  end type catchnext
  type :: disable
  end type disable
  type :: expectation
  end type expectation
  type :: subject
  end type subject
  type :: predicate
  end type predicate
  type :: true
  end type true
  type :: false
  end type false
  type :: is
  end type is
  type :: near
  end type near
  type :: relatively_near
  end type relatively_near
  type :: equal_to
  end type equal_to
  type :: greater_than
  end type greater_than
  type :: any_of
  end type any_of
  type :: all_of
  end type all_of
  type :: every
  end type every
  type :: every_item
  end type every_item
  type :: matchable
  end type matchable
  type :: testcase
  end type testcase
  type :: testmethod
  end type testmethod
  type :: testresult
  end type testresult
  type :: testrunner
  end type testrunner
  type :: testlistener
  end type testlistener
  type :: serialcontext
  end type serialcontext
  type :: assertequal
  end type assertequal
  type :: assertnotequal
  end type assertnotequal
  type :: assertrelativelyequal
  end type assertrelativelyequal
  type :: assertapprox
  end type assertapprox
  type :: asserttrue
  end type asserttrue
  type :: assertfalse
  end type assertfalse
  type :: assertlessthan
  end type assertlessthan
  type :: assertlessthanorequal
  end type assertlessthanorequal
  type :: assertgreaterthan
  end type assertgreaterthan
  type :: assertgreaterthanorequal
  end type assertgreaterthanorequal
  type :: assertisnan
  end type assertisnan
  type :: assertisfinite
  end type assertisfinite
  type :: assertfail
  end type assertfail
  type :: assertany
  end type assertany
  type :: assertall
  end type assertall
  type :: assertnone
  end type assertnone
  type :: assertnotall
  end type assertnotall
  type :: assertsameshape
  end type assertsameshape
  type :: assertexceptionraised
  end type assertexceptionraised

end module funit_names
