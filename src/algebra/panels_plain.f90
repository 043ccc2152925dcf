!> Products with a panel of a matrix, for any processor.
module panels_plain_mod
  use kinds_mod, only: sp
  implicit none
  private

  public :: add_panel, columns, rows

  include 'add_panel.inc'

end module panels_plain_mod
