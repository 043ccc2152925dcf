!> Anderson's acceleration of a fixed-point iteration r <- G(r).
module anderson_mod
  use kinds_mod, only: wp
  use dense_mod, only: solve_least_squares
  implicit none
  private

  public :: anderson_t, new_anderson, accelerate, forget

  !> The last few differences of r's images and of their distances G(r) - r.
  type :: anderson_t
    integer :: depth = 0     !! differences kept at most; 0: images are taken as they come
    integer :: held = 0      !! differences held
    logical :: started = .false.
    real(wp), allocatable :: image(:), distance(:)          !! (n) of the last iteration
    real(wp), allocatable :: images(:, :), distances(:, :)  !! (n,depth) differences, newest first
  end type anderson_t

contains

  !> An accelerator for vectors of length n.
  pure type(anderson_t) function new_anderson(n, depth) result(memory)
    integer, intent(in) :: n, depth

    memory%depth = depth
    allocate (memory%image(n), memory%distance(n), memory%images(n, depth), memory%distances(n, &
      depth))
  end function new_anderson

  !> Start anew: what was learnt no longer holds.
  pure subroutine forget(memory)
    type(anderson_t), intent(inout) :: memory

    memory%held = 0
    memory%started = .false.
  end subroutine forget

  !> The next iterate from r and its image G(r): the combination of the last images whose distances
  !> nearly cancel.
  subroutine accelerate(memory, r, image, next)
    type(anderson_t), intent(inout) :: memory
    real(wp), intent(in)  :: r(:)      !! (n)
    real(wp), intent(in)  :: image(:)  !! (n) G(r)
    real(wp), intent(out) :: next(:)   !! (n)
    real(wp) :: distance(size(r))
    real(wp), allocatable :: coefficient(:)

    distance = image - r
    if (memory%started .and. memory%depth > 0) then
      memory%held = min(memory%held + 1, memory%depth)
      memory%images = eoshift(memory%images, -1, dim=2)
      memory%distances = eoshift(memory%distances, -1, dim=2)
      memory%images(:, 1) = image - memory%image
      memory%distances(:, 1) = distance - memory%distance
    end if
    memory%started = .true.
    memory%image = image
    memory%distance = distance
    next = image
    if (memory%held == 0) return
    coefficient = solve_least_squares(memory%distances(:, :memory%held), distance)
    next = image - matmul(memory%images(:, :memory%held), coefficient)
  end subroutine accelerate

end module anderson_mod
