!> The factor that is there, of the bodies' stiffness at another place, with points as they stand
!> now and rigid motions of what nothing holds. docs/theory.md (4.27), (4.28).
module kept_factor_mod
  use kinds_mod, only: wp
  use errors_mod, only: error_t
  use lists_mod, only: lists_t, lists_by_key
  use dense_mod, only: solve_factorised
  use block_diagonal_mod, only: add_column, times_blocks
  use anderson_mod, only: anderson_t
  use rotations_mod, only: fit_motion, rotation_matrix
  use scene_mod, only: scene_t
  use turning_couplings_mod, only: has_turning_unknowns
  use rigid_modes_mod, only: free_motions_t, add_motions
  use dof_map_mod, only: dof_map_t, equations_of, unknowns_of, can_turn
  use assembly_mod, only: triplets_t
  use stiffness_inverse_mod, only: stiffness_inverse_t
  use linearisation_mod, only: linearisation_t
  use gmres_mod, only: linear_map_t
  use iterate_mod, only: task_t, iterate_t
  use point_rows_mod, only: kept_changes_t
  use linearise_mod, only: unknowns_t, number_unknowns, bodies_stiffness_t, system_t, holding
  implicit none
  private

  public :: step_maker_t, begin_steps, kept_t, keep_points, give_way, subtract_law, find_step, &
    solution_of

  !> What steps leave to each other.
  type :: step_maker_t
    real(wp), allocatable :: diagonal(:, :) !! (3,n_nodes) of the stiffness [force/length]
    integer :: products = 0                !! of GMRES, summed
    integer :: last_products = 0           !! of these, in the last solution by GMRES
    integer :: n_factors = 0               !! of matrices of now
    type(unknowns_t) :: unknowns
    real(wp), allocatable :: held(:)       !! (n_free) each back in the last step [force/length]
    type(system_t) :: system               !! of the last step
    real(wp) :: on_bodies = 0.0_wp         !! what part of `holding` that is [-]
    type(kept_changes_t), allocatable :: changes(:, :) !! (n_sides,n_pairs)
    type(bodies_stiffness_t) :: stiffness
    type(stiffness_inverse_t), pointer :: inverse => null() !! K_0^-1
    logical :: has_factor = .false.
    integer, allocatable :: equation(:, :)
    !! (3,n_free) the factor's unknowns of each unknown's node, 0: a pin
    real(wp), allocatable :: along(:, :)
    !! (3,n_free) each unknown along their axes, which have turned with the body [-]
    real(wp), allocatable :: motion(:, :)  !! (n_free,n_motions) that pins stand for [-]
    real(wp), allocatable :: sag(:, :)
    !! (n,n_motions) of the factor's unknowns by forces of `holding` times each motion [-]
    logical :: leads = .true.              !! that factor alone may make steps
    logical :: led = .false.               !! to the last step
    real(wp) :: error = 1.0_wp             !! before the last step [-]
    logical, allocatable :: presses(:), slides(:) !! (n_points) in the last step
    type(anderson_t) :: memory             !! of steps in a row by the factor alone
    real(wp), allocatable :: softness(:)   !! (n_points) lengths of forces there [length/force]
  end type step_maker_t

  real(wp), parameter :: least_turn = 0.01_wp
  !! of a body since its factor was made: with less, 1e-9, input/ironing.inp takes the same
  !! iterations and a sixth more time, for its rows have three entries where there was one [-]

  !> Entries of a block of the matrix, column by column.
  type :: columns_t
    type(lists_t) :: list
    integer, allocatable :: row(:)
    real(wp), allocatable :: value(:)
  end type columns_t

  !> A M^-1, A the matrix of now and M that with the stiffness K_0 of the factor that is there, the
  !> rigid motions R of which nothing but points and weak springs s hold:
  !>
  !>     M = [ K_0 + s  -B^T ]      S = [ Z - X K_0^-1 (-B^T)    X (R - K_0^-1 s R) ]
  !>         [ X         Z   ]          [ R^T (-B^T)             R^T (s + T) R      ]
  !>
  !> T is what forces of loads and reactions change by as bodies turn.
  type, extends(linear_map_t) :: kept_t
    type(step_maker_t), pointer :: maker => null() !! K_0^-1, R, s; the matrix of now
    type(columns_t) :: force, law          !! -B^T, by rows of the interface; X by its columns
    real(wp), allocatable :: schur(:, :)   !! S, and its LU factors where there are pivots
    integer, allocatable :: pivot(:)
  contains
    procedure :: apply => apply_kept
  end type kept_t

contains

  !> Begin an increment: the factor of `body` is there where the unknowns are its own, and pins.
  subroutine begin_steps(scene, task, now, body, maker)
    type(scene_t), intent(in) :: scene
    type(task_t), intent(in) :: task
    type(iterate_t), intent(in) :: now
    type(linearisation_t), intent(in) :: body
    type(step_maker_t), intent(out) :: maker
    type(free_motions_t) :: motions
    real(wp) :: moved(3, size(now%u, 2)), alone(body%motions%n), turn(3, 3, 0:scene%mesh%n_bodies)
    integer :: node, i, of(3), of_factor(3), n_found

    maker%inverse => body%inverse
    call number_unknowns(scene, task, now, maker%unknowns)
    if (has_turning_unknowns(scene) .or. .not. allocated(body%diagonal)) return
    associate (map => maker%unknowns%map, its => body%inverse%map)
      if (.not. body%inverse%is_condensed .or. map%n_free /= its%n_free + body%motions%n) return
      allocate (maker%equation(3, map%n_free), maker%along(3, map%n_free))
      turn = turns_since(scene, map, body, now%u)
      n_found = 0
      do node = 1, size(now%u, 2)
        of = equations_of(map, node)
        of_factor = equations_of(its, node)
        n_found = n_found + count(of > 0 .and. of_factor > 0)
        do i = 1, 3
          if (of(i) == 0) cycle
          maker%equation(:, of(i)) = of_factor
          maker%along(:, of(i)) = turn(i, :, scene%mesh%body(node))
        end do
      end do
      where (maker%equation == 0) maker%along = 0.0_wp
      maker%has_factor = n_found == its%n_free .and. .not. allocated(body%inverse%failure)
      motions = body%motions
      motions%place = scene%mesh%coordinates + now%u
      allocate (maker%motion(map%n_free, motions%n))
      do i = 1, motions%n
        alone = 0.0_wp
        alone(i) = 1.0_wp
        moved = 0.0_wp
        call add_motions(motions, scene%mesh, alone, moved)
        maker%motion(:, i) = unknowns_of(map, moved)
      end do
    end associate
    maker%diagonal = body%diagonal
    if (maker%has_factor .and. size(maker%motion, 2) > 0) call find_sag(holding(scene, task, &
      maker%unknowns%map, maker%diagonal), maker)
  end subroutine begin_steps

  !> How bodies have turned since their factor was made, where what is prescribed of them and joins
  !> them allows that: the law is objective, and the tangent of a body that turns as a whole turns
  !> with it. docs/theory.md (8.36).
  function turns_since(scene, map, body, u) result(turn)
    type(scene_t), intent(in) :: scene
    type(dof_map_t), intent(in) :: map       !! of all that can move, nothing pinned
    type(linearisation_t), intent(in) :: body
    real(wp), intent(in) :: u(:, :)          !! (3,n_nodes) [length]
    real(wp) :: turn(3, 3, 0:scene%mesh%n_bodies) !! [-]
    real(wp) :: none(3, 3), since(3, 3), shift(3)
    integer, allocatable :: nodes(:)
    integer :: b, i
    logical :: is_found

    none = rotation_matrix([0.0_wp, 0.0_wp, 0.0_wp])
    turn = spread(none, 3, size(turn, 3))
    if (.not. allocated(body%tangent)) return
    do b = 1, scene%mesh%n_bodies
      nodes = pack([(i, i=1, size(u, 2))], scene%mesh%body == b)
      if (.not. can_turn(map, nodes)) cycle
      associate (x => scene%mesh%coordinates(:, nodes))
        call fit_motion(x + body%tangent%at(:, nodes), x + u(:, nodes), since, shift, is_found)
      end associate
      if (is_found .and. any(abs(since - none) > least_turn)) turn(:, :, b) = since
    end do
  end function turns_since

  !> What bodies bend by where each of their rigid motions is held back.
  subroutine find_sag(held, maker)
    real(wp), intent(in) :: held(:)        !! (n_free) [force/length]
    type(step_maker_t), intent(inout) :: maker
    real(wp), allocatable :: at_interface(:, :)
    type(error_t), allocatable :: error
    integer :: i

    associate (inverse => maker%inverse, n_motions => size(maker%motion, 2))
      allocate (maker%sag(inverse%map%n_free, n_motions))
      allocate (at_interface(inverse%map%n_interface, n_motions))
      do i = 1, n_motions
        call to_factor(maker, held*maker%motion(:, i), maker%sag(:, i))
      end do
      call inverse%factor%condense(maker%sag, at_interface, error)
      do i = 1, n_motions
        at_interface(:, i) = times_blocks(inverse%compliance, at_interface(:, i))
      end do
      if (.not. allocated(error)) call inverse%factor%expand(at_interface, maker%sag, error)
      if (allocated(error)) then
        call move_alloc(error, inverse%failure)
        return
      end if
      maker%sag(inverse%map%n_free - inverse%map%n_interface + 1:, :) = at_interface
    end associate
  end subroutine find_sag

  !> Forces on the unknowns as forces on those of the factor.
  pure subroutine to_factor(maker, b, of_factor)
    type(step_maker_t), intent(in) :: maker
    real(wp), intent(in) :: b(:)             !! (n_free), or more [force]
    real(wp), intent(out) :: of_factor(:)    !! of the factor's unknowns [force]
    integer :: i, k

    of_factor = 0.0_wp
    do i = 1, size(maker%equation, 2)
      do k = 1, 3
        if (maker%equation(k, i) > 0) of_factor(maker%equation(k, i)) = &
          of_factor(maker%equation(k, i)) + maker%along(k, i)*b(i)
      end do
    end do
  end subroutine to_factor

  !> The points of now with the factor that is there.
  subroutine keep_points(maker, kept, ok)
    type(step_maker_t), target, intent(in) :: maker !! its system is there
    type(kept_t), intent(out) :: kept
    logical, intent(out) :: ok
    !! points have to do with pins and its interface alone, and hold what it does not
    real(wp), allocatable :: moved(:)
    integer :: inner, i, j, k

    kept%maker => maker
    inner = maker%inverse%map%n_free - maker%inverse%map%n_interface
    associate (a => maker%system%a, n => maker%system%n_free, &
      m => maker%system%a%n - maker%system%n_free, n_motions => size(maker%motion, 2))
      kept%force = columns_of(a, a%row <= n .and. a%column > n, .false.)
      kept%law = columns_of(a, a%row > n .and. a%column <= n, .true.)
      ok = all(kept%force%row > inner) .and. all(kept%law%row > inner)
      if (.not. ok) return
      allocate (kept%schur(m + n_motions, m + n_motions), source=0.0_wp)
      do j = 1, n_motions
        do i = 1, n_motions
          kept%schur(m + i, m + j) = sum(maker%motion(:, i)*maker%held*maker%motion(:, j))
        end do
        do i = 1, m
          do k = kept%law%list%first(i), kept%law%list%first(i + 1) - 1
            kept%schur(i, m + j) = kept%schur(i, m + j) - kept%law%value(k)*maker%on_bodies* &
              maker%sag(kept%law%row(k), j)
          end do
        end do
      end do
      do k = 1, size(a%row)
        if (a%column(k) > n) then
          associate (column => kept%schur(:, a%column(k) - n))
            if (a%row(k) > n) then
              column(a%row(k) - n) = column(a%row(k) - n) + a%value(k)
            else
              column(m + 1:) = column(m + 1:) + a%value(k)*maker%motion(a%row(k), :)
            end if
          end associate
        else if (a%row(k) > n) then
          associate (row => kept%schur(a%row(k) - n, m + 1:))
            row = row + a%value(k)*maker%motion(a%column(k), :)
          end associate
        else
          do j = 1, n_motions
            kept%schur(m + 1:, m + j) = kept%schur(m + 1:, m + j) + maker%motion(a%row(k), :)* &
              a%value(k)*maker%motion(a%column(k), j)
          end do
        end if
      end do
      kept%force%row = kept%force%row - inner
      kept%law%row = kept%law%row - inner
      allocate (moved(maker%inverse%map%n_interface))
      do j = 1, m
        moved = 0.0_wp
        do k = kept%force%list%first(j), kept%force%list%first(j + 1) - 1
          call add_column(maker%inverse%compliance, kept%force%row(k), kept%force%value(k), &
            moved)
        end do
        do i = 1, m
          do k = kept%law%list%first(i), kept%law%list%first(i + 1) - 1
            kept%schur(i, j) = kept%schur(i, j) - kept%law%value(k)*moved(kept%law%row(k))
          end do
        end do
      end do
    end associate

  contains

    !> Entries between unknowns of the factor and points, one point's row or column after the other.
    type(columns_t) function columns_of(a, is_there, by_rows) result(block)
      type(triplets_t), intent(in) :: a
      logical, intent(in) :: is_there(:)
      logical, intent(in) :: by_rows
      integer, allocatable :: entry(:), point(:), of_body(:), along(:)
      integer :: i, k

      entry = pack([(i, i=1, size(is_there))], is_there)
      entry = reshape(spread(entry, 1, 3), [3*size(entry)])
      along = [((k, k=1, 3), i=1, size(entry)/3)]
      point = a%column(entry)
      of_body = a%row(entry)
      if (by_rows) then
        point = a%row(entry)
        of_body = a%column(entry)
      end if
      associate (factor => [(maker%along(along(i), of_body(i)), i=1, size(entry))], &
        equation => [(maker%equation(along(i), of_body(i)), i=1, size(entry))])
        associate (counts => equation > 0 .and. abs(factor) > 0.0_wp)
          block%list = lists_by_key(pack(point, counts) - maker%system%n_free, a%n - &
            maker%system%n_free)
          block%row = pack(equation, counts)
          block%row = block%row(block%list%item)
          block%value = pack(factor*a%value(entry), counts)
          block%value = block%value(block%list%item)
        end associate
      end associate
    end function columns_of

  end subroutine keep_points

  !> M^-1 b.
  function solution_of(kept, b) result(x)
    type(kept_t), intent(in) :: kept
    real(wp), intent(in) :: b(:)
    real(wp), allocatable :: x(:)
    real(wp), allocatable :: of_bodies(:, :), moved(:), both(:)
    integer :: n
    logical :: ok

    n = size(kept%maker%equation, 2)
    call give_way(kept%maker, b, of_bodies, moved, ok)
    if (.not. ok) then
      x = 0.0_wp*b
      return
    end if
    both = [b(n + 1:), matmul(b(:n), kept%maker%motion)]
    call subtract_law(kept, moved, both)
    call solve_factorised(kept%schur, kept%pivot, both)
    call find_step(kept, both, moved, of_bodies, x)
  end function solution_of

  !> What the interface moves by under forces on the bodies, without points and motions.
  subroutine give_way(maker, b, of_bodies, moved, ok)
    type(step_maker_t), intent(inout) :: maker
    real(wp), intent(in) :: b(:)             !! (n) of it those on bodies [force]
    real(wp), allocatable, intent(out) :: of_bodies(:, :) !! (n_free,1) for `find_step`
    real(wp), allocatable, intent(out) :: moved(:)        !! (n_interface) [length]
    logical, intent(out) :: ok               !! no failure, here or before
    real(wp), allocatable :: at_interface(:, :)
    type(error_t), allocatable :: error

    associate (inverse => maker%inverse)
      ok = .not. allocated(inverse%failure)
      if (.not. ok) return
      allocate (of_bodies(inverse%map%n_free, 1), at_interface(inverse%map%n_interface, 1))
      call to_factor(maker, b, of_bodies(:, 1))
      call inverse%factor%condense(of_bodies, at_interface, error)
      ok = .not. allocated(error)
      if (ok) then
        moved = times_blocks(inverse%compliance, at_interface(:, 1))
      else
        call move_alloc(error, inverse%failure)
      end if
    end associate
  end subroutine give_way

  !> Subtract the law's rows times displacements of the interface.
  pure subroutine subtract_law(kept, moved, from)
    type(kept_t), intent(in) :: kept
    real(wp), intent(in) :: moved(:)         !! (n_interface) [length]
    real(wp), intent(inout) :: from(:)       !! of points first [force]
    integer :: j, k

    do j = 1, size(kept%law%list%first) - 1
      do k = kept%law%list%first(j), kept%law%list%first(j + 1) - 1
        from(j) = from(j) - kept%law%value(k)*moved(kept%law%row(k))
      end do
    end do
  end subroutine subtract_law

  !> All unknowns, of changes of reactions and rigid motions.
  subroutine find_step(kept, both, moved, of_bodies, x)
    type(kept_t), intent(in) :: kept
    real(wp), intent(in) :: both(:), moved(:)
    real(wp), intent(inout) :: of_bodies(:, :) !! as of `give_way`
    real(wp), allocatable, intent(out) :: x(:)
    real(wp), allocatable :: at_interface(:, :)
    type(error_t), allocatable :: error
    integer :: n, m, i, j, k

    associate (inverse => kept%maker%inverse, equation => kept%maker%equation, &
      along => kept%maker%along, motion => kept%maker%motion)
      n = size(equation, 2)
      m = size(both) - size(motion, 2)
      allocate (x(n + m), source=0.0_wp)
      allocate (at_interface(size(moved), 1), source=0.0_wp)
      do j = 1, m
        do k = kept%force%list%first(j), kept%force%list%first(j + 1) - 1
          associate (of => at_interface(kept%force%row(k), 1))
            of = of - kept%force%value(k)*both(j)
          end associate
        end do
      end do
      at_interface(:, 1) = moved + times_blocks(inverse%compliance, at_interface(:, 1))
      call inverse%factor%expand(at_interface, of_bodies, error)
      if (allocated(error)) then
        call move_alloc(error, inverse%failure)
        return
      end if
      of_bodies(size(of_bodies) - size(moved) + 1:, 1) = at_interface(:, 1)
      if (size(both) > m) then
        ! What is balanced as a whole: pins have no reaction.
        x(:n) = matmul(motion, both(m + 1:))
        of_bodies(:, 1) = of_bodies(:, 1) - kept%maker%on_bodies*matmul(kept%maker%sag, &
          both(m + 1:))
      end if
      do i = 1, n
        do k = 1, 3
          if (equation(k, i) > 0) x(i) = x(i) + along(k, i)*of_bodies(equation(k, i), 1)
        end do
      end do
      x(n + 1:) = both(:m)
    end associate
  end subroutine find_step

  !> A M^-1 v.
  subroutine apply_kept(map, v, product)
    class(kept_t), intent(in) :: map
    real(wp), intent(in) :: v(:)
    real(wp), intent(out) :: product(:)
    real(wp) :: x(size(v))
    integer :: i

    x = solution_of(map, v)
    associate (a => map%maker%system%a, k => map%maker%stiffness%k, held => map%maker%held)
      product = 0.0_wp
      product(:size(held)) = held*x(:size(held))
      do i = 1, size(k%row)
        product(k%row(i)) = product(k%row(i)) + k%value(i)*x(k%column(i))
        if (k%row(i) /= k%column(i)) product(k%column(i)) = product(k%column(i)) + &
          k%value(i)*x(k%row(i))
      end do
      do i = 1, size(a%row)
        product(a%row(i)) = product(a%row(i)) + a%value(i)*x(a%column(i))
      end do
    end associate
  end subroutine apply_kept

end module kept_factor_mod
