!> The keywords the reader knows, and where in a deck they may stand.
module keywords_mod
  use text_mod, only: string_t, upper
  implicit none
  private

  public :: keyword_t, find_keyword, keyword_names, squeeze, same_word, without_tabs
  public :: in_model, in_step, anywhere, is_read, is_ignored, is_missing, is_outside, is_checked, &
    max_keyword

  integer, parameter :: max_keyword = 36

  integer, parameter :: in_model = 1 !! before the first *STEP
  integer, parameter :: in_step = 2
  integer, parameter :: anywhere = 3

  integer, parameter :: is_read = 1
  integer, parameter :: is_ignored = 2 !! with a note: it changes nothing here
  integer, parameter :: is_missing = 3 !! it would change the result: an error
  integer, parameter :: is_outside = 4 !! likewise, of a field that the program is not made for
  integer, parameter :: is_checked = 5 !! some options would, others are ignored, and so are data

  !> A keyword, in upper case, without its star.
  type :: keyword_t
    character(max_keyword) :: name
    integer :: place   !! in_model, in_step, anywhere
    integer :: reading !! is_read, is_ignored, is_missing, is_outside, is_checked
  end type keyword_t

  type(keyword_t), parameter :: keywords(*) = [ &
    keyword_t('HEADING', anywhere, is_read), &
    keyword_t('PARAMETER', anywhere, is_read), &
    keyword_t('UNITS', in_model, is_read), &
    keyword_t('NODE', in_model, is_read), &
    keyword_t('ELEMENT', in_model, is_read), &
    keyword_t('BLOCK', in_model, is_read), &
    keyword_t('PART', in_model, is_read), &
    keyword_t('END PART', in_model, is_read), &
    keyword_t('ASSEMBLY', in_model, is_read), &
    keyword_t('INSTANCE', in_model, is_read), &
    keyword_t('END INSTANCE', in_model, is_read), &
    keyword_t('END ASSEMBLY', in_model, is_read), &
    keyword_t('NSET', anywhere, is_read), &
    keyword_t('ELSET', anywhere, is_read), &
    keyword_t('SURFACE', in_model, is_read), &
    keyword_t('OBSTACLE', in_model, is_read), &
    keyword_t('RIGID BODY', in_model, is_read), &
    keyword_t('MATERIAL', in_model, is_read), &
    keyword_t('ELASTIC', in_model, is_read), &
    keyword_t('HYPERELASTIC', in_model, is_read), &
    keyword_t('HYPERFOAM', in_model, is_read), &
    keyword_t('REFINE', in_model, is_read), &
    keyword_t('DENSITY', in_model, is_read), &
    keyword_t('EXPANSION', in_model, is_read), &
    keyword_t('SOLID SECTION', in_model, is_read), &
    keyword_t('SURFACE INTERACTION', in_model, is_read), &
    keyword_t('FRICTION', in_model, is_read), &
    keyword_t('CONTACT PAIR', in_model, is_read), &
    keyword_t('TIE', in_model, is_read), &
    keyword_t('EQUATION', in_model, is_read), &
    keyword_t('COUPLING', in_model, is_read), &
    keyword_t('KINEMATIC', in_model, is_read), &
    keyword_t('DISTRIBUTING', in_model, is_read), &
    keyword_t('PRE-TENSION SECTION', in_model, is_read), &
    keyword_t('TRANSFORM', in_model, is_read), &
    keyword_t('CONTACT GAP', in_model, is_read), &
    keyword_t('CLEARANCE', in_model, is_read), &
    keyword_t('CONTACT SOLVER', in_model, is_read), &
    keyword_t('PRECISION', in_model, is_read), &
    keyword_t('BODY SOLVER', in_model, is_read), &
    keyword_t('ACCURACY', in_model, is_read), &
    keyword_t('AMPLITUDE', anywhere, is_read), &
    keyword_t('INITIAL CONDITIONS', in_model, is_read), &
    keyword_t('STEP', anywhere, is_read), &
    keyword_t('STATIC', in_step, is_read), &
    keyword_t('END STEP', in_step, is_read), &
    keyword_t('BOUNDARY', anywhere, is_read), &
    keyword_t('CLOAD', in_step, is_read), &
    keyword_t('DLOAD', in_step, is_read), &
    keyword_t('DSLOAD', in_step, is_read), &
    keyword_t('TEMPERATURE', in_step, is_read), &
    keyword_t('CONTACT INTERFERENCE', in_step, is_read), &
    keyword_t('CHANGE FRICTION', in_step, is_read), &
    keyword_t('MODEL CHANGE', in_step, is_read), &
    keyword_t('NODE FILE', in_step, is_read), &
    keyword_t('EL FILE', in_step, is_read), &
    keyword_t('CONTACT FILE', in_step, is_read), &
    keyword_t('CONTACT PRINT', in_step, is_read), &
    keyword_t('NODE PRINT', in_step, is_read), &
    keyword_t('EL PRINT', in_step, is_read), &
    keyword_t('SURFACE BEHAVIOR', anywhere, is_checked), &
    keyword_t('CHANGE SURFACE BEHAVIOR', in_step, is_checked), &
    keyword_t('CONTROLS', anywhere, is_ignored), &
    keyword_t('CONTACT CONTROLS', anywhere, is_ignored), &
    keyword_t('ENERGY PRINT', anywhere, is_ignored), &
    keyword_t('SECTION PRINT', anywhere, is_ignored), &
    keyword_t('ENERGY FILE', anywhere, is_ignored), &
    keyword_t('FILE FORMAT', anywhere, is_ignored), &
    keyword_t('OUTPUT', anywhere, is_ignored), &
    keyword_t('NODE OUTPUT', anywhere, is_ignored), &
    keyword_t('ELEMENT OUTPUT', anywhere, is_ignored), &
    keyword_t('CONTACT OUTPUT', anywhere, is_ignored), &
    keyword_t('ENERGY OUTPUT', anywhere, is_ignored), &
    keyword_t('INTEGRATED OUTPUT', anywhere, is_ignored), &
    keyword_t('PREPRINT', anywhere, is_ignored), &
    keyword_t('PRINT', anywhere, is_ignored), &
    keyword_t('MONITOR', anywhere, is_ignored), &
    keyword_t('TIME POINTS', anywhere, is_ignored), &
    keyword_t('RESTART', anywhere, is_ignored), &
    keyword_t('CONDUCTIVITY', anywhere, is_ignored), &
    keyword_t('SPECIFIC HEAT', anywhere, is_ignored), &
    keyword_t('GAP CONDUCTANCE', anywhere, is_ignored), &
    keyword_t('FLUID CONSTANTS', anywhere, is_ignored), &
    keyword_t('SPECIFIC GAS CONSTANT', anywhere, is_ignored), &
    keyword_t('PHYSICAL CONSTANTS', anywhere, is_ignored), &
    keyword_t('MAGNETIC PERMEABILITY', anywhere, is_ignored), &
    keyword_t('ELECTRICAL CONDUCTIVITY', anywhere, is_ignored), &
    keyword_t('ORIENTATION', anywhere, is_ignored), &
    keyword_t('SYSTEM', anywhere, is_missing), &
    keyword_t('MPC', anywhere, is_missing), &
    keyword_t('CONTACT', anywhere, is_missing), &
    keyword_t('PLASTIC', anywhere, is_outside), &
    keyword_t('CYCLIC HARDENING', anywhere, is_outside), &
    keyword_t('CREEP', anywhere, is_outside), &
    keyword_t('DEFORMATION PLASTICITY', anywhere, is_outside), &
    keyword_t('MOHR COULOMB', anywhere, is_outside), &
    keyword_t('USER MATERIAL', anywhere, is_outside), &
    keyword_t('SHELL SECTION', anywhere, is_outside), &
    keyword_t('BEAM SECTION', anywhere, is_outside), &
    keyword_t('MEMBRANE SECTION', anywhere, is_outside), &
    keyword_t('FLUID SECTION', anywhere, is_outside), &
    keyword_t('SPRING', anywhere, is_outside), &
    keyword_t('DASHPOT', anywhere, is_outside), &
    keyword_t('GAP', anywhere, is_outside), &
    keyword_t('MASS', anywhere, is_outside), &
    keyword_t('DAMPING', anywhere, is_outside), &
    keyword_t('VISCO', anywhere, is_outside), &
    keyword_t('FREQUENCY', anywhere, is_outside), &
    keyword_t('COMPLEX FREQUENCY', anywhere, is_outside), &
    keyword_t('BUCKLE', anywhere, is_outside), &
    keyword_t('DYNAMIC', anywhere, is_outside), &
    keyword_t('MODAL DYNAMIC', anywhere, is_outside), &
    keyword_t('STEADY STATE DYNAMICS', anywhere, is_outside), &
    keyword_t('HEAT TRANSFER', anywhere, is_outside), &
    keyword_t('COUPLED TEMPERATURE-DISPLACEMENT', anywhere, is_outside), &
    keyword_t('UNCOUPLED TEMPERATURE-DISPLACEMENT', anywhere, is_outside), &
    keyword_t('ELECTROMAGNETICS', anywhere, is_outside), &
    keyword_t('CFD', anywhere, is_outside), &
    keyword_t('SENSITIVITY', anywhere, is_outside), &
    keyword_t('SUBSTRUCTURE GENERATE', anywhere, is_outside), &
    keyword_t('CYCLIC SYMMETRY MODEL', anywhere, is_outside), &
    keyword_t('SELECT CYCLIC SYMMETRY MODES', anywhere, is_outside), &
    keyword_t('CONTACT DAMPING', anywhere, is_outside), &
    keyword_t('GAP HEAT GENERATION', anywhere, is_outside), &
    keyword_t('DESIGN VARIABLES', anywhere, is_outside), &
    keyword_t('DESIGN RESPONSE', anywhere, is_outside), &
    keyword_t('BASE MOTION', anywhere, is_outside), &
    keyword_t('CFLUX', anywhere, is_outside), &
    keyword_t('DFLUX', anywhere, is_outside), &
    keyword_t('FILM', anywhere, is_outside), &
    keyword_t('RADIATE', anywhere, is_outside), &
    keyword_t('ROBUST DESIGN', anywhere, is_outside), &
    keyword_t('OBJECTIVE', anywhere, is_outside), &
    keyword_t('CONSTRAINT', anywhere, is_outside), &
    keyword_t('FEASIBLE DIRECTION', anywhere, is_outside), &
    keyword_t('FILTER', anywhere, is_outside), &
    keyword_t('DEPVAR', anywhere, is_outside), &
    keyword_t('USER ELEMENT', anywhere, is_outside), &
    keyword_t('USER SECTION', anywhere, is_outside), &
    keyword_t('BEAM GENERAL SECTION', anywhere, is_outside), &
    keyword_t('NODAL THICKNESS', anywhere, is_outside), &
    keyword_t('MODAL DAMPING', anywhere, is_outside), &
    keyword_t('GREEN', anywhere, is_outside), &
    keyword_t('CRACK PROPAGATION', anywhere, is_outside), &
    keyword_t('VALUES AT INFINITY', anywhere, is_outside), &
    keyword_t('BOUNDARYF', anywhere, is_outside), &
    keyword_t('TRANSFORMF', anywhere, is_outside), &
    keyword_t('EQUATIONF', anywhere, is_outside), &
    keyword_t('MASS FLOW', anywhere, is_outside), &
    keyword_t('NETWORK MPC', anywhere, is_outside), &
    keyword_t('VIEWFACTOR', anywhere, is_outside), &
    keyword_t('NO ANALYSIS', anywhere, is_missing), &
    keyword_t('REFINE MESH', anywhere, is_missing), &
    keyword_t('SUBMODEL', anywhere, is_missing), &
    keyword_t('NORMAL', anywhere, is_missing), &
    keyword_t('DISTRIBUTION', anywhere, is_missing), &
    keyword_t('CHANGE PLASTIC', anywhere, is_outside), &
    keyword_t('CHANGE SOLID SECTION', anywhere, is_missing), &
    keyword_t('CHANGE MATERIAL', anywhere, is_missing), &
    keyword_t('CHANGE CONTACT TYPE', anywhere, is_missing), &
    keyword_t('DISTRIBUTING COUPLING', anywhere, is_missing), &
    keyword_t('ANISOTROPIC HYPERELASTIC', anywhere, is_missing)]

contains

  !> The keyword `name`, blanks and case aside; `found` is false when there is none.
  pure subroutine find_keyword(name, keyword, found)
    character(*), intent(in) :: name !! without its star
    type(keyword_t), intent(out) :: keyword
    logical, intent(out) :: found
    integer :: i

    found = .false.
    keyword = keyword_t('', anywhere, is_missing)
    do i = 1, size(keywords)
      if (.not. same_word(name, keywords(i)%name)) cycle
      keyword = keywords(i)
      found = .true.
      return
    end do
  end subroutine find_keyword

  !> The keywords that are read, for "did you mean".
  function keyword_names() result(names)
    type(string_t), allocatable :: names(:)
    integer :: i, n

    allocate (names(count(keywords%reading == is_read)))
    n = 0
    do i = 1, size(keywords)
      if (keywords(i)%reading /= is_read) cycle
      n = n + 1
      names(n)%text = '*'//trim(keywords(i)%name)
    end do
  end function keyword_names

  !> `text` in upper case without blanks and tabs: how keywords and parameters are compared.
  pure function squeeze(text) result(squeezed)
    character(*), intent(in) :: text
    character(:), allocatable :: squeezed
    integer :: i, n

    squeezed = upper(text)
    n = 0
    do i = 1, len(squeezed)
      if (squeezed(i:i) == ' ' .or. squeezed(i:i) == achar(9)) cycle
      n = n + 1
      squeezed(n:n) = squeezed(i:i)
    end do
    squeezed = squeezed(:n)
  end function squeeze

  !> `text` with blanks in place of tabs.
  pure function without_tabs(text) result(plain)
    character(*), intent(in) :: text
    character(:), allocatable :: plain
    integer :: i

    plain = text
    do i = 1, len(plain)
      if (plain(i:i) == achar(9)) plain(i:i) = ' '
    end do
  end function without_tabs

  !> Whether two words are the same, blanks, tabs and case aside.
  pure logical function same_word(a, b) result(same)
    character(*), intent(in) :: a, b
    integer :: i, j

    i = 0
    j = 0
    do
      call next_letter(a, i)
      call next_letter(b, j)
      if (i > len(a) .or. j > len(b)) exit
      if (upper(a(i:i)) /= upper(b(j:j))) exit
    end do
    same = i > len(a) .and. j > len(b)
  end function same_word

  !> Move `i` to the next letter that is not blank; len(text) + 1 when there is none.
  pure subroutine next_letter(text, i)
    character(*), intent(in) :: text
    integer, intent(inout) :: i

    i = i + 1
    do while (i <= len(text))
      if (text(i:i) /= ' ' .and. text(i:i) /= achar(9)) exit
      i = i + 1
    end do
  end subroutine next_letter

end module keywords_mod
