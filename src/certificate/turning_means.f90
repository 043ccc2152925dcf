!> What the certificate knows of reference nodes that *DISTRIBUTING makes means over a surface, at
!> finite strain: whether they are where the surface has them, and what forces on them do there.
!>
!> A force F and a moment M on the reference node are the forces w_i F + p x R m_i on the nodes of
!> the surface, I p = M + R (X_ref - X_m) x F. R is its own, by powers of a matrix of quaternions.
!> Weights and moments of the undeformed surface are the scene's. docs/theory.md (8.47).
module turning_means_mod
  use kinds_mod, only: wp
  use small_matrix_mod, only: cross, inverse
  use constraints_mod, only: constraints_t, add_constraint
  use grips_mod, only: is_turning_mean
  use scene_mod, only: scene_t, coupled_rotation_t
  use error_measures_mod, only: ratio, rounded
  implicit none
  private

  public :: turning_means_t, find_means, spread_forces, misplaced, is_of_mean

  !> The means, and where their nodes are to be.
  type :: turning_means_t
    type(coupled_rotation_t), allocatable :: of(:) !! (n)
    real(wp), allocatable :: q(:, :)               !! (0:3,n) of their rotations
  end type turning_means_t

contains

  !> The means of a scene, about displaced places.
  pure type(turning_means_t) function find_means(scene, u) result(means)
    type(scene_t), intent(in) :: scene
    real(wp), intent(in) :: u(:, :)  !! (3,n_nodes) [length]
    integer :: i

    allocate (means%of(0))
    if (scene%finite_strain .and. allocated(scene%rotations)) means%of = pack(scene%rotations, &
      [(is_turning_mean(scene, i), i=1, size(scene%rotations))])
    allocate (means%q(0:3, size(means%of)))
    do i = 1, size(means%of)
      means%q(:, i) = turn_of(means%of(i), from_middle(means%of(i), scene%mesh%coordinates) + &
        from_middle(means%of(i), u))
    end do
  end function find_means

  !> Whether a degree of freedom is such a mean.
  pure logical function is_of_mean(means, node, dof) result(is_mean)
    type(turning_means_t), intent(in) :: means
    integer, intent(in) :: node, dof
    integer :: i

    is_mean = .false.
    if (.not. allocated(means%of)) return
    do i = 1, size(means%of)
      if (means%of(i)%node == node) is_mean = is_mean .or. means%of(i)%is_mean(dof)
      if (means%of(i)%rotation_node == node) is_mean = is_mean .or. means%of(i)%is_mean(3 + dof)
    end do
  end function is_of_mean

  !> Put in the place of the constraints of means, which are those of small rotations, what forces
  !> on them are on the nodes of their surfaces.
  pure subroutine spread_forces(means, x, u, constraints)
    type(turning_means_t), intent(in) :: means
    real(wp), intent(in) :: x(:, :)  !! (3,n_nodes) undeformed [length]
    real(wp), intent(in) :: u(:, :)  !! (3,n_nodes) [length]
    type(constraints_t), intent(inout) :: constraints
    type(constraints_t) :: before
    real(wp), allocatable :: force(:, :)  !! (3,n) of a unit on the mean [-]
    integer :: c, i, k, m

    do i = 1, size(means%of)
      before = constraints
      constraints = constraints_t(n_equations=before%n_equations)
      associate (of => means%of(i))
        m = size(of%surface_nodes)
        do c = 1, before%n
          associate (node => before%node(c), dof => before%dof(c), first => before%first(c), &
                     last => before%first(c + 1) - 1)
            if (node == of%node .and. of%is_mean(dof)) then
              force = forces_of(of, means%q(:, i), x, u, unit(dof), [0.0_wp, 0.0_wp, 0.0_wp])
            else if (node == of%rotation_node .and. of%is_mean(3 + dof)) then
              force = forces_of(of, means%q(:, i), x, u, [0.0_wp, 0.0_wp, 0.0_wp], &
                of%length*unit(dof))
            else
              call add_constraint(constraints, node, dof, before%master(first:last), &
                before%master_dof(first:last), before%weight(first:last))
              cycle
            end if
            call add_constraint(constraints, node, dof, [(spread(of%surface_nodes(k), 1, 3), k=1, &
              m)], [(modulo(k, 3) + 1, k=0, 3*m - 1)], reshape(force, [3*m]))
          end associate
        end do
      end associate
    end do
  end subroutine spread_forces

  !> The forces on the nodes of a surface of a force and a moment on its mean.
  pure function forces_of(of, q, x, u, force, moment) result(f)
    type(coupled_rotation_t), intent(in) :: of
    real(wp), intent(in) :: q(0:3)
    real(wp), intent(in) :: x(:, :), u(:, :)          !! (3,n_nodes) [length]
    real(wp), intent(in) :: force(3), moment(3)       !! [force], [force length]
    real(wp) :: f(3, size(of%surface_nodes))          !! [force]
    real(wp) :: turned(3, size(of%surface_nodes)), p(3)
    integer :: i

    do i = 1, size(turned, 2)
      turned(:, i) = of%moment(:, i) + turned_by(q, of%moment(:, i))
    end do
    associate (arm => arm_of(of, x))
      p = matmul(inverse(inertia_of(turned, from_middle(of, x) + from_middle(of, u))), moment + &
        cross(arm + turned_by(q, arm), force))
    end associate
    do i = 1, size(f, 2)
      f(:, i) = of%share(i)*force + cross(p, turned(:, i))
    end do
  end function forces_of

  !> How far means are from where their surfaces have them, rotations as the farthest arm moves by
  !> them, less what rounding makes of that, beside the size of the mesh.
  pure real(wp) function misplaced(means, x, u)
    type(turning_means_t), intent(in) :: means
    real(wp), intent(in) :: x(:, :)  !! (3,n_nodes) undeformed [length]
    real(wp), intent(in) :: u(:, :)  !! (3,n_nodes) [length]
    real(wp) :: off(3), theta(3), p(0:3), q(0:3), size_of_mesh, largest
    integer :: i

    misplaced = 0.0_wp
    if (.not. allocated(means%of)) return
    size_of_mesh = maxval(maxval(x, dim=2) - minval(x, dim=2))
    do i = 1, size(means%of)
      q = means%q(:, i)
      associate (of => means%of(i), arm => arm_of(means%of(i), x))
        largest = maxval(norm2(u(:, of%surface_nodes), dim=1)) + norm2(arm) + of%length
        off = u(:, of%node) - matmul(u(:, of%surface_nodes), of%share) - turned_by(q, arm)
        where (.not. of%is_mean(:3)) off = 0.0_wp
        misplaced = max(misplaced, ratio(norm2(off) - 8.0_wp*rounded*largest, size_of_mesh))
        if (.not. any(of%is_mean(4:))) cycle
        theta = u(:, of%rotation_node)/of%length
        p(0) = cos(0.5_wp*norm2(theta))
        p(1:) = 0.5_wp*theta
        if (norm2(theta) > 0.0_wp) p(1:) = sin(0.5_wp*norm2(theta))/norm2(theta)*theta
        off = 2.0_wp*of%length*(q(0)*p(1:) - p(0)*q(1:) - cross(p(1:), q(1:)))
        misplaced = max(misplaced, ratio(norm2(off) - 8.0_wp*rounded*(1.0_wp + &
          norm2(theta))*largest, size_of_mesh))
      end associate
    end do
  end function misplaced

  !> From the middle of the undeformed surface to the reference node.
  pure function arm_of(of, x) result(arm)
    type(coupled_rotation_t), intent(in) :: of
    real(wp), intent(in) :: x(:, :)  !! (3,n_nodes) [length]
    real(wp) :: arm(3)

    arm = x(:, of%node) - matmul(x(:, of%surface_nodes), of%share)
  end function arm_of

  !> Values at the nodes of a surface less their mean.
  pure function from_middle(of, values) result(there)
    type(coupled_rotation_t), intent(in) :: of
    real(wp), intent(in) :: values(:, :)  !! (3,n_nodes)
    real(wp) :: there(3, size(of%surface_nodes))

    there = values(:, of%surface_nodes)
    there = there - spread(matmul(there, of%share), 2, size(there, 2))
  end function from_middle

  !> I = sum (m_i . y_i) 1 - m_i y_i^T.
  pure function inertia_of(m, y) result(inertia)
    real(wp), intent(in) :: m(:, :), y(:, :) !! (3,n) [length]
    real(wp) :: inertia(3, 3)
    integer :: i

    inertia = -matmul(m, transpose(y))
    do i = 1, 3
      inertia(i, i) = inertia(i, i) + sum(m*y)
    end do
  end function inertia_of

  !> The quaternion of the R for which sum R m_i . y_i is the largest.
  !>
  !> That sum is q . H q; powers of H, made positive, leave the largest eigenvalue alone. A step of
  !> Newton's on sum R m_i x y_i = 0 makes the last digits.
  pure function turn_of(of, y) result(q)
    type(coupled_rotation_t), intent(in) :: of
    real(wp), intent(in) :: y(:, :)  !! (3,n) from the middle [length]
    real(wp) :: q(0:3)
    real(wp) :: h(0:3, 0:3), shift, m(3), turned(3, size(y, 2)), spin(3), total(3)
    integer :: i, k

    h = 0.0_wp
    do i = 1, size(y, 2)
      m = of%moment(:, i)
      h(0, 0) = h(0, 0) + dot_product(m, y(:, i))
      h(1:, 0) = h(1:, 0) + cross(m, y(:, i))
      do k = 1, 3
        h(1:, k) = h(1:, k) + m*y(k, i) + y(:, i)*m(k) - dot_product(m, y(:, i))*unit(k)
      end do
    end do
    h(0, 1:) = h(1:, 0)
    shift = sqrt(sum(h**2))
    do k = 0, 3
      h(k, k) = h(k, k) + shift
    end do
    do i = 1, 40
      h = h/maxval(abs(h))
      h = matmul(h, h)
    end do
    k = maxloc([(h(i, i), i=0, 3)], dim=1) - 1
    q = h(:, k)/norm2(h(:, k))
    total = 0.0_wp
    do i = 1, size(y, 2)
      turned(:, i) = of%moment(:, i) + turned_by(q, of%moment(:, i))
      total = total + cross(turned(:, i), y(:, i))
    end do
    spin = matmul(inverse(inertia_of(turned, y)), total)
    q = q + 0.5_wp*[-dot_product(spin, q(1:)), q(0)*spin + cross(spin, q(1:))]
    q = q/norm2(q)
  end function turn_of

  !> What a rotation changes a vector by.
  pure function turned_by(q, v) result(change)
    real(wp), intent(in) :: q(0:3), v(3)
    real(wp) :: change(3)

    change = 2.0_wp*cross(q(1:), q(0)*v + cross(q(1:), v))
  end function turned_by

  pure function unit(dof)
    integer, intent(in) :: dof
    real(wp) :: unit(3)

    unit = 0.0_wp
    unit(dof) = 1.0_wp
  end function unit

end module turning_means_mod
