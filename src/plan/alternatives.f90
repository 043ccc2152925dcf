!> In what arithmetic, and where, the stiffness may be factorised, from what costs nothing to what
!> takes least memory.
!>
!> What *PRECISION says stands; what it leaves open is the plan's to choose.
module alternatives_mod
  use controls_mod, only: precision_controls_t, precision_in_words
  use kinds_mod, only: wp
  implicit none
  private

  public :: alternatives, where_in_words

  !> What compression may drop, where the plan chooses it: refinement makes good for it in two or
  !> three iterations (docs/arithmetic.md) [-].
  real(wp), parameter :: chosen_low_rank = 1.0e-5_wp

contains

  !> The choices that a deck leaves open, best first: double precision, single precision, that
  !> compressed, and at last the factor on the disk.
  !>
  !> With FACTOR=DOUBLE nothing is compressed unless the deck asks for it.
  pure function alternatives(given) result(list)
    type(precision_controls_t), intent(in) :: given
    type(precision_controls_t), allocatable :: list(:)
    type(precision_controls_t) :: choice

    choice = given
    list = [choice]
    if (.not. choice%factor_is_given) then
      choice%single_factor = .true.
      list = [list, choice]
    end if
    if (choice%single_factor .and. .not. choice%low_rank_is_given) then
      choice%block_low_rank = chosen_low_rank
      list = [list, choice]
      choice%block_low_rank = 0.0_wp
    end if
    if (.not. choice%core_is_given) then
      choice%out_of_core = .true.
      list = [list, choice]
    end if
  end function alternatives

  !> single precision, in core.
  function where_in_words(precision) result(words)
    type(precision_controls_t), intent(in) :: precision
    character(:), allocatable :: words

    words = precision_in_words(precision)
    if (precision%iterative) return
    words = words//', in core'
    if (precision%out_of_core) words = precision_in_words(precision)//', out of core'
  end function where_in_words

end module alternatives_mod
