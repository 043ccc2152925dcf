!> Elastic constants of materials that are not isotropic.
!>
!>     *ELASTIC, TYPE=ENGINEERING CONSTANTS
!>     E1, E2, E3, nu12, nu13, nu23, G12, G13,
!>     G23
!>     *ELASTIC, TYPE=ORTHOTROPIC           stresses by strains, as is
!>     D1111, D1122, D2222, D1133, D2233, D3333, D1212, D1313,
!>     D2323
!>     *ELASTIC, TYPE=ANISOTROPIC           the upper triangle, column by column
!>     D1111, D1122, D2222, D1133, D2233, D3333, D1112, D2212,
!>     D3312, D1212, ...                    21 of them
!>
!> The strain energy must be positive in all strains: where it is not, the constant is named.
module read_anisotropic_mod
  use cards_mod, only: reader_t, report
  use elasticity_mod, only: anisotropic_elasticity
  use fields_mod, only: fields_t
  use kinds_mod, only: wp
  use material_law_mod, only: law_t
  use new_law_mod, only: anisotropic_law
  use options_mod, only: card_t
  use read_constants_mod, only: read_constants
  use small_matrix_mod, only: solve_small
  use text_mod, only: to_text
  implicit none
  private

  public :: read_anisotropic

  integer, parameter :: engineering = 1, orthotropic = 2 !! else anisotropic: what is given
  character(5), parameter :: of_engineering(9) = ['E1   ', 'E2   ', 'E3   ', 'nu12 ', 'nu13 ', &
    'nu23 ', 'G12  ', 'G13  ', 'G23  ']
  character(5), parameter :: of_anisotropic(21) = ['D1111', 'D1122', 'D2222', 'D1133', 'D2233', &
    'D3333', 'D1112', 'D2212', 'D3312', 'D1212', 'D1113', 'D2213', 'D3313', 'D1213', 'D1313', &
    'D1123', 'D2223', 'D3323', 'D1223', 'D1323', 'D2323']
  integer, parameter :: of_orthotropic(9) = [1, 2, 3, 4, 5, 6, 10, 15, 21]
  !! those of them that an orthotropic material has
  integer, parameter :: as_ordered(6) = [1, 2, 3, 4, 6, 5]
  !! 11 22 33 12 13 23 among stresses as they are ordered, XX YY ZZ XY YZ XZ

contains

  !> The constants of a card, and their law.
  subroutine read_anisotropic(reader, card, kind, law)
    type(reader_t), intent(inout) :: reader
    type(card_t), intent(in) :: card
    integer, intent(in) :: kind         !! engineering, orthotropic, or else
    type(law_t), intent(inout) :: law   !! stays after a mistake
    type(fields_t) :: fields
    real(wp) :: constants(21), d(6, 6), c(6, 6)
    integer :: position(21), i, j
    logical :: ok

    constants = 0.0_wp
    position = card%position
    if (kind == engineering) then
      call read_constants(reader, card, of_engineering, 9, fields, constants(:9), ok, &
        position(:9))
      if (ok) call invert_engineering(reader, constants(:9), position(:9), d, ok)
    else
      if (kind == orthotropic) then
        call read_constants(reader, card, of_anisotropic(of_orthotropic), 9, fields, &
          constants(:9), ok, position(:9))
        constants(of_orthotropic(7:)) = constants(7:9)
        constants([7, 8, 9]) = 0.0_wp
        position(of_orthotropic(7:)) = position(7:9)
      else
        call read_constants(reader, card, of_anisotropic, 21, fields, constants, ok, position)
      end if
      do j = 1, 6
        d(:j, j) = constants(j*(j - 1)/2 + 1:j*(j + 1)/2)
        d(j, :j) = d(:j, j)
      end do
      if (ok) call check_positive(reader, d, position, ok)
    end if
    if (.not. ok) return
    do j = 1, 6
      do i = 1, 6
        c(as_ordered(i), as_ordered(j)) = d(i, j)
      end do
    end do
    law = anisotropic_law(anisotropic_elasticity(c))
  end subroutine read_anisotropic

  !> Stresses by strains of moduli and ratios, by their inverse: strains by stresses.
  subroutine invert_engineering(reader, constants, position, d, ok)
    type(reader_t), intent(inout) :: reader
    real(wp), intent(in) :: constants(9) !! as of of_engineering
    integer, intent(in) :: position(9)
    real(wp), intent(out) :: d(6, 6)     !! 11 22 33 12 13 23 [force/length^2]
    logical, intent(out) :: ok           !! false: a mistake was reported
    integer, parameter :: first(3) = [1, 1, 2], second(3) = [2, 3, 3] ! of nu12, nu13, nu23
    real(wp) :: s(3, 3), limit, left
    integer :: i

    d = 0.0_wp
    ok = .true.
    do i = 1, 9
      if (i >= 4 .and. i <= 6) cycle
      if (constants(i) > 0.0_wp) cycle
      call report(reader, position(i), trim(of_engineering(i))//' must be positive, not '// &
        to_text(constants(i), 4))
      ok = .false.
    end do
    if (.not. ok) return
    s = 0.0_wp
    do i = 1, 3
      associate (j => first(i), k => second(i), nu => constants(3 + i))
        limit = sqrt(constants(j)/constants(k))
        if (.not. abs(nu) < limit) then
          call report(reader, position(3 + i), trim(of_engineering(3 + i))//' must lie between '// &
            to_text(-limit, 4)//' and '//to_text(limit, 4)//', not '//to_text(nu, 4), &
            'the root of '//trim(of_engineering(j))//'/'//trim(of_engineering(k))//': beyond '// &
            'it a stress would do no work')
          ok = .false.
        end if
        s(i, i) = 1.0_wp
        s(j, k) = -nu/limit ! beside 1 on the diagonal
        s(k, j) = s(j, k)
      end associate
    end do
    if (.not. ok) return
    left = 1.0_wp - s(1, 2)**2 - s(1, 3)**2 - s(2, 3)**2 + 2.0_wp*s(1, 2)*s(1, 3)*s(2, 3)
    if (.not. left > 64.0_wp*epsilon(1.0_wp)) then
      call report(reader, position(4), 'nu12, nu13 and nu23 are too large together: 1 - nu12 '// &
        'nu21 - nu13 nu31 - nu23 nu32 - 2 nu21 nu32 nu13 must be positive, not '// &
        to_text(left, 4), 'nu21 is nu12 E2/E1, and so on: beyond it a stress would do no work')
      ok = .false.
      return
    end if
    do i = 1, 3
      s(i, :) = s(i, :)/sqrt(constants(i)*constants(:3))
    end do
    do i = 1, 3
      call solve_small(s, real([merge(1, 0, i == 1), merge(1, 0, i == 2), merge(1, 0, i == 3)], &
        wp), d(:3, i), ok)
      if (.not. ok) return
      d(3 + i, 3 + i) = constants(6 + i)
    end do
    d(:3, :3) = 0.5_wp*(d(:3, :3) + transpose(d(:3, :3)))
  end subroutine invert_engineering

  !> Report the constant of the diagonal that is too small beside those before it.
  subroutine check_positive(reader, d, position, ok)
    type(reader_t), intent(inout) :: reader
    real(wp), intent(in) :: d(6, 6)      !! 11 22 33 12 13 23 [force/length^2]
    integer, intent(in) :: position(21)
    logical, intent(out) :: ok
    real(wp) :: left(6, 6), least
    integer :: i, k, diagonal

    ok = .true.
    left = d
    do k = 1, 6
      diagonal = k*(k + 1)/2
      if (left(k, k) > 64.0_wp*epsilon(1.0_wp)*abs(d(k, k))) then
        do i = k + 1, 6
          left(i, k + 1:) = left(i, k + 1:) - left(i, k)/left(k, k)*left(k, k + 1:)
        end do
        cycle
      end if
      ok = .false.
      least = d(k, k) - left(k, k)
      if (abs(least) > 0.0_wp) then
        call report(reader, position(diagonal), of_anisotropic(diagonal)//' must be more than '// &
          to_text(least, 4)//', not '//to_text(d(k, k), 4), 'with the constants before it a '// &
          'strain would take no work')
      else
        call report(reader, position(diagonal), of_anisotropic(diagonal)//' must be positive, '// &
          'not '//to_text(d(k, k), 4))
      end if
      return
    end do
  end subroutine check_positive

end module read_anisotropic_mod
