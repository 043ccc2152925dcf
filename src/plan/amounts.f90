!> Memory and time in words, as estimates and bounds are told.
module amounts_mod
  use kinds_mod, only: wp
  use text_mod, only: to_text
  use controls_mod, only: accuracy_controls_t
  implicit none
  private

  public :: bytes_in_words, time_in_words, bounds_in_words

contains

  !> 512 bytes, 6.0 MB, 1.7 GB.
  pure function bytes_in_words(bytes) result(words)
    real(wp), intent(in) :: bytes
    character(:), allocatable :: words

    if (bytes < 1.0e3_wp) then
      words = to_text(bytes)//' bytes'
    else if (bytes < 1.0e6_wp) then
      words = to_text(bytes/1.0e3_wp, 2)//' kB'
    else if (bytes < 1.0e9_wp) then
      words = to_text(bytes/1.0e6_wp, merge(2, 3, bytes < 1.0e8_wp))//' MB'
    else
      words = to_text(bytes/1.0e9_wp, 3)//' GB'
    end if
  end function bytes_in_words

  !> 0.32 s, 12 s, 23 min, 9.5 h: two digits are all that an estimate has.
  pure function time_in_words(seconds) result(words)
    real(wp), intent(in) :: seconds
    character(:), allocatable :: words

    if (seconds < 120.0_wp) then
      words = to_text(seconds, 2)//' s'
    else if (seconds < 7200.0_wp) then
      words = to_text(seconds/60.0_wp, 2)//' min'
    else
      words = to_text(seconds/3600.0_wp, 2)//' h'
    end if
  end function time_in_words

  !> 60 s of CPU time and 4 GB of memory.
  function bounds_in_words(accuracy) result(words)
    type(accuracy_controls_t), intent(in) :: accuracy !! with a bound
    character(:), allocatable :: words

    words = ''
    if (accuracy%time > 0.0_wp) words = to_text(accuracy%time, 3)//' s of CPU time'
    if (accuracy%memory <= 0.0_wp) return
    if (words /= '') words = words//' and '
    words = words//bytes_in_words(accuracy%memory)//' of memory'
  end function bounds_in_words

end module amounts_mod
