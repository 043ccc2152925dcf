!> Energy that is lost or gained along the path: what ends a run for it, in words.
module refuse_energy_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t
  use text_mod, only: to_text, percent
  use increments_mod, only: increment_t
  use increment_report_mod, only: increment_report_t
  use mesh_mod, only: mesh_t
  use name_refusal_mod, only: raise_at
  implicit none
  private

  public :: refuse_lost_energy, refuse_gained_energy, refuse_jump

contains

  !> Energy that contact gives or takes along the path, and that smaller increments do not make
  !> smaller, ends the run. docs/theory.md (6.5).
  subroutine refuse_lost_energy(increment, report, error)
    type(increment_t), intent(in) :: increment
    type(increment_report_t), intent(in) :: report
    type(error_t), allocatable, intent(out) :: error

    associate (left => report%left_over, strain => report%energy%strain)
      if (.not. left(1) > 0.0_wp) return
      call raise_at(increment, error, 'contact gains or loses '//to_text(left(1), 2)// &
        ' of energy that is neither work nor friction, beside a strain energy of '// &
        to_text(strain, 2)//', and '//to_text(left(2), 2)//' in increments of a quarter of the '// &
        'size: points pass edges or their master turns too far; use much smaller increments, '// &
        'or another mesh')
    end associate
  end subroutine refuse_lost_energy

  !> Bodies must not gain energy that nothing has given them.
  subroutine refuse_gained_energy(mesh, increment, report, error)
    type(mesh_t), intent(in) :: mesh
    type(increment_t), intent(in) :: increment
    type(increment_report_t), intent(in) :: report
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: most = 0.03_wp !! of the largest energy so far [-]

    character(:), allocatable :: whom, given

    if (max(report%energy%risen, report%energy%risen_of_one) <= most) return
    whom = 'the bodies'
    given = percent(report%energy%risen)//' of their'
    if (report%energy%risen <= most) then
      whom = 'the body of node '//to_text(mesh%node_id(findloc(mesh%body, &
        report%energy%risen_body, dim=1)))
      given = percent(report%energy%risen_of_one)//' of its'
    end if
    call raise_at(increment, error, 'contact and the scheme in time have given '//whom//' '//given &
      //' largest energy, and in nature they give none: increments no longer than an element '// &
      'over the speed of sound give less, and an ALPHA of *DYNAMIC below 0 takes some')
  end subroutine refuse_gained_energy

  !> A solution beyond which the one before does not go on.
  subroutine refuse_jump(increment, lost, strain, error)
    type(increment_t), intent(in) :: increment
    real(wp), intent(in) :: lost, strain !! energy that is lost, and of the strains [energy]
    type(error_t), allocatable, intent(out) :: error

    call raise_at(increment, error, 'the solution jumps: '//to_text(lost, 2)//' of energy is '// &
      'neither work nor friction, beside a strain energy of '//to_text(strain, 2)// &
      ', however small the increment. The body snaps over to another shape, or a surface slips '// &
      'off its master at once; what it does then is a matter of its inertia (*DYNAMIC)'// &
      new_line('a')// &
      '  Prescribed motions instead of forces, a finer mesh at edges, or a step that ends '// &
      'before, may avoid it')
    error%n_meshes = 2
  end subroutine refuse_jump

end module refuse_energy_mod
