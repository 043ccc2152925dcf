!> Elastic foundations of faces.
!>
!>     *FOUNDATION
!>     PLATE, F1, 50.       set or element, face, stiffness per area
module read_foundations_mod
  use cards_mod, only: reader_t, report, report_missing_element
  use fields_mod, only: field_position, field_text, fields_t, name_field, next_data_line, &
    real_field, reference_field, reference_t
  use diagnostics_mod, only: quoted
  use kinds_mod, only: wp
  use mesh_draft_mod, only: solids
  use options_mod, only: allow_options, card_t, open_card
  use sets_mod, only: model_t, referenced_elements
  use spring_elements_mod, only: foundation_t
  use surface_list_mod, only: add_surface_of_sides, check_side, surface_list_t
  implicit none
  private

  public :: read_foundations

contains

  !> All *FOUNDATION cards: a surface of the scene each line.
  subroutine read_foundations(reader, model, surfaces, foundations)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(surface_list_t), intent(inout) :: surfaces !! those of the faces are added
    type(foundation_t), allocatable, intent(out) :: foundations(:) !! not allocated: none
    type(foundation_t), allocatable :: list(:)
    type(foundation_t) :: foundation
    type(card_t) :: card
    type(fields_t) :: fields
    integer, allocatable :: elements(:)
    integer :: k, face
    logical :: found, ok(3)

    allocate (list(0))
    do k = 1, reader%n_cards
      if (reader%cards(k)%keyword /= 'FOUNDATION') cycle
      call open_card(reader, k, card)
      call allow_options(reader, card)
      if (model%mesh%plane /= solids) then
        call report(reader, card%position, '*FOUNDATION is not available with elements of a '// &
          'plane: use solid elements one element thick')
        return
      end if
      do
        call next_data_line(reader, card, fields, found, 3, 'an element or set, F1 to F6, a '// &
          'stiffness')
        if (.not. found) exit
        call read_elements(reader, model, fields, elements, ok(1))
        call read_face(reader, fields, face, ok(2))
        call real_field(reader, fields, 3, 'the stiffness per area', foundation%stiffness, ok(3))
        if (ok(3) .and. .not. foundation%stiffness > 0.0_wp) then
          call report(reader, field_position(reader, fields, 3), 'the stiffness of a '// &
            'foundation must be positive, not '//quoted(field_text(reader, fields, 3)))
          ok(3) = .false.
        end if
        if (all(ok(:2))) call check_side(reader, model%mesh, elements, face, &
          field_position(reader, fields, 2), ok(1))
        if (.not. all(ok)) cycle
        call add_surface_of_sides(model%mesh, elements, face, surfaces, foundation%surface)
        list = [list, foundation]
      end do
    end do
    if (size(list) > 0) call move_alloc(list, foundations)
  end subroutine read_foundations

  !> The elements of a line.
  subroutine read_elements(reader, model, fields, elements, ok)
    type(reader_t), intent(inout) :: reader
    type(model_t), intent(in) :: model
    type(fields_t), intent(in) :: fields
    integer, allocatable, intent(out) :: elements(:)
    logical, intent(out) :: ok !! false: a mistake was reported
    type(reference_t) :: reference
    integer :: before
    logical :: flawed

    call reference_field(reader, fields, 1, 'an element or a set of elements', reference, ok)
    if (.not. ok) return
    before = reader%diagnostics%n_mistakes
    flawed = .false.
    call referenced_elements(reader, model, reference, elements, flawed)
    ok = size(elements) > 0
    if (ok .or. flawed .or. reader%diagnostics%n_mistakes > before) return
    call report_missing_element(reader, reference%position, 'there are no solid elements for a '// &
      '*FOUNDATION here')
  end subroutine read_elements

  !> F1 to F6.
  subroutine read_face(reader, fields, face, ok)
    type(reader_t), intent(inout) :: reader
    type(fields_t), intent(in) :: fields
    integer, intent(out) :: face
    logical, intent(out) :: ok !! false: a mistake was reported
    character(:), allocatable :: word

    face = 0
    call name_field(reader, fields, 2, 'F1 to F6', word, ok)
    if (.not. ok) return
    if (len(word) == 2 .and. index(word, 'F') == 1) face = index('123456', word(len(word):))
    ok = face > 0
    if (.not. ok) call report(reader, field_position(reader, fields, 2), &
      'the face of a foundation must be F1 to F6, not '//quoted(word))
  end subroutine read_face

end module read_foundations_mod
