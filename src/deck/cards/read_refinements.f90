!> Bricks that the deck cuts into smaller ones.
!>
!>     *REFINE, NSET=EDGE, TIMES=2        the bricks at the nodes of a set
!>     *REFINE, ELSET=CORE                those of a set
module read_refinements_mod
  use cards_mod, only: reader_t, report
  use options_mod, only: allow_no_data, allow_options, card_t, has_option, integer_option, &
    name_option, open_card, option_position
  use refine_locally_mod, only: most_times, refinement_t
  use sets_mod, only: find_set, model_t, report_unknown
  implicit none
  private

  public :: read_refinements

contains

  !> All *REFINE cards; sets have been read.
  subroutine read_refinements(reader, model, refinements)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(refinement_t), allocatable, intent(out) :: refinements(:)
    type(refinement_t) :: refinement
    type(card_t) :: card
    character(:), allocatable :: name
    integer :: k
    logical :: ok

    allocate (refinements(0))
    do k = 1, reader%n_cards
      if (reader%cards(k)%keyword /= 'REFINE') cycle
      call open_card(reader, k, card)
      call allow_options(reader, card, ['NSET ', 'ELSET', 'TIMES'])
      call allow_no_data(reader, card)
      refinement = refinement_t(position=card%position)
      call integer_option(reader, card, 'TIMES', 1, most_times, refinement%times, ok)
      if (has_option(card, 'NSET') .eqv. has_option(card, 'ELSET')) then
        call report(reader, card%position, '*REFINE needs a set of nodes or one of elements: '// &
          'NSET= or ELSET=')
        cycle
      end if
      if (has_option(card, 'NSET')) then
        call name_option(reader, card, 'NSET', .true., name, ok)
        if (.not. ok) cycle
        refinement%node_set = find_set(model%node_sets, name)
        if (refinement%node_set == 0) call report_unknown(reader, model%node_sets, &
          option_position(card, 'NSET'), name)
      else
        call name_option(reader, card, 'ELSET', .true., name, ok)
        if (.not. ok) cycle
        refinement%element_set = find_set(model%element_sets, name)
        if (refinement%element_set == 0) call report_unknown(reader, model%element_sets, &
          option_position(card, 'ELSET'), name)
      end if
      if (refinement%node_set + refinement%element_set > 0) refinements = [refinements, refinement]
    end do
  end subroutine read_refinements

end module read_refinements_mod
