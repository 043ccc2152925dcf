!> The table of the deck as JSON, for editors and for the card index of docs/deck.md.
module card_index_mod
  use deck_table_mod, only: anywhere, deck_table, in_model, in_model_or_first_step, is_checked, &
    is_ignored, is_read, item_t, rule_t, split_at, split_items
  use text_mod, only: string_t
  implicit none
  private

  public :: cards_as_json

contains

  !> One object a keyword, each on a line.
  function cards_as_json() result(text)
    character(:), allocatable :: text
    integer :: i

    text = '{"cards": ['
    do i = 1, size(deck_table)
      if (i > 1) text = text//','
      text = text//new_line('a')//card_as_json(deck_table(i))
    end do
    text = text//new_line('a')//']}'
  end function cards_as_json

  function card_as_json(rule) result(text)
    type(rule_t), intent(in) :: rule
    character(:), allocatable :: text, place, reading

    place = 'step'
    if (rule%place == in_model) place = 'model'
    if (rule%place == in_model_or_first_step) place = 'model or first step'
    if (rule%place == anywhere) place = 'anywhere'
    reading = 'refused'
    if (rule%reading == is_read .or. rule%reading == is_checked) reading = 'read'
    if (rule%reading == is_ignored) reading = 'ignored'
    text = '{"keyword": '//quoted(rule%name)//', "is": '//quoted(reading)
    if (reading == 'read') then
      text = text//', "place": '//quoted(place)//', "options": ['// &
        items_as_json(rule%options)//'], "ignored options": ['//items_as_json(rule%ignored)// &
        '], "data": '//quoted(rule%data)
    end if
    if (rule%remark /= '') text = text//', "remark": '//quoted(rule%remark)
    text = text//'}'
  end function card_as_json

  !> Options: name, value, words to choose from, default, whether it must be there.
  function items_as_json(options) result(text)
    character(*), intent(in) :: options
    character(:), allocatable :: text
    type(item_t), allocatable :: items(:)
    type(string_t), allocatable :: words(:)
    integer :: i, j

    text = ''
    call split_items(options, items)
    do i = 1, size(items)
      if (i > 1) text = text//', '
      text = text//'{"name": '//quoted(items(i)%name)
      if (items(i)%may_stand_alone) text = text//', "flag": true'
      if (items(i)%has_words) then
        call split_at(items(i)%value, '|', words)
        text = text//', "words": ['
        do j = 1, size(words)
          if (j > 1) text = text//', '
          text = text//quoted(words(j)%text)
        end do
        text = text//']'
      else if (items(i)%value /= '') then
        text = text//', "value": '//quoted(items(i)%value)
      end if
      if (items(i)%default /= '') text = text//', "default": '//quoted(items(i)%default)
      if (items(i)%required) text = text//', "required": true'
      text = text//'}'
    end do
  end function items_as_json

  !> A text of the table between quotes; it has no letter that JSON would need escaped.
  pure function quoted(text)
    character(*), intent(in) :: text
    character(:), allocatable :: quoted

    quoted = '"'//trim(text)//'"'
  end function quoted

end module card_index_mod
