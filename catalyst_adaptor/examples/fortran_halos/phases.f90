! Separation of two phases, after Allen and Cahn, in Fortran with halos: d phi / dt =
! laplacian(phi) + phi - phi**3, periodic.
!
!     mpirun -n 4 phases [vdi.json]
!
! The program writes the last phi to phases.raw. Without vdi.json it draws nothing, and the result
! has the same bits.
program phases
  use, intrinsic :: iso_c_binding
  use mpi_f08
  use vdi_catalyst
  implicit none
  integer, parameter :: n = 32, steps = 60, halo = 2, padding = 3
  real(c_double), parameter :: spacing = 1.0d0, time_step = 0.1d0
  real(c_double), allocatable, target :: phi(:, :, :)
  real(c_double), allocatable :: rate(:, :, :)
  integer :: ranks, cells(3), first(3), parts(3) = 0, place(3), code = 0, i, j, k
  integer(c_int64_t) :: step
  character(len=4096) :: json
  type(mpi_comm) :: grid
  type(c_ptr) :: vdi = c_null_ptr

  call mpi_init()
  call mpi_comm_size(mpi_comm_world, ranks)
  call mpi_dims_create(ranks, 3, parts)
  call mpi_cart_create(mpi_comm_world, 3, parts, [.true., .true., .true.], .false., grid)
  call find_place()
  first = n * place / parts
  cells = n * (place + 1) / parts - first
  ! The array has two layers of halo all around. Its first dimension is padded, as in codes that
  ! align columns.
  allocate(phi(1 - halo:cells(1) + halo + padding, 1 - halo:cells(2) + halo, &
               1 - halo:cells(3) + halo))
  allocate(rate(cells(1), cells(2), cells(3)))
  phi = -huge(phi)
  do concurrent (i = 1:cells(1), j = 1:cells(2), k = 1:cells(3))
    phi(i, j, k) = noise(first(1) + i, first(2) + j, first(3) + k)
  end do

  call get_command_argument(1, json)
  if (json /= "") call hand_over()
  do step = 1, steps
    call exchange()
    do concurrent (i = 1:cells(1), j = 1:cells(2), k = 1:cells(3))
      rate(i, j, k) = (phi(i - 1, j, k) + phi(i + 1, j, k) + phi(i, j - 1, k) + phi(i, j + 1, k) &
                       + phi(i, j, k - 1) + phi(i, j, k + 1) - 6 * phi(i, j, k)) / spacing**2 &
                      + phi(i, j, k) - phi(i, j, k)**3
    end do
    associate (inside => phi(1:cells(1), 1:cells(2), 1:cells(3)))
      inside = inside + time_step * rate
    end associate
    if (c_associated(vdi)) code = max(code, vdi_catalyst_execute(vdi, step, step * time_step))
  end do
  if (c_associated(vdi)) code = max(code, vdi_catalyst_finalize(vdi))
  call write_result()
  call mpi_finalize()
  if (code /= vdi_catalyst_ok) stop 3

contains

  subroutine find_place()
    integer :: rank
    call mpi_comm_rank(grid, rank)
    call mpi_cart_coords(grid, rank, 3, place)
  end subroutine

  ! Hands over the inside of phi in place: the address of its first value, and the distance in bytes
  ! to the next value on each axis.
  subroutine hand_over()
    type(vdi_catalyst_block) :: block
    type(vdi_catalyst_strides) :: strides
    integer(c_int64_t) :: bytes
    bytes = storage_size(phi) / 8
    block%cells = cells
    block%origin = first * spacing
    block%spacing = spacing
    strides%strides = [bytes, bytes * size(phi, 1), bytes * size(phi, 1) * size(phi, 2)]
    code = vdi_catalyst_initialize_json(grid%mpi_val, trim(json) // c_null_char, vdi)
    if (code /= vdi_catalyst_ok) return
    code = vdi_catalyst_set_blocks(vdi, 1, [block])
    code = max(code, vdi_catalyst_set_array_strided(vdi, "phi" // c_null_char, vdi_catalyst_f64, &
                                                    vdi_catalyst_cells, 1, &
                                                    [c_loc(phi(1, 1, 1))], [strides]))
  end subroutine

  ! Exchanges halos axis by axis. The stencil needs no edges and corners, so these are left out.
  subroutine exchange()
    integer :: axis, below, above
    type(mpi_datatype) :: face
    do axis = 1, 3
      call mpi_cart_shift(grid, axis - 1, 1, below, above)
      call mpi_type_create_subarray(3, shape(phi), merge(halo, cells, [1, 2, 3] == axis), &
                                    [0, 0, 0], mpi_order_fortran, mpi_double_precision, face)
      call mpi_type_commit(face)
      call send(axis, 1, below, cells(axis) + 1, above, face)
      call send(axis, cells(axis) + 1 - halo, above, 1 - halo, below, face)
      call mpi_type_free(face)
    end do
  end subroutine

  ! Sends the layers from `from` on to the rank `to`, and receives those from `into` on of `source`.
  subroutine send(axis, from, to, into, source, face)
    integer, intent(in) :: axis, from, to, into, source
    type(mpi_datatype), intent(in) :: face
    integer :: a(3), b(3)
    a = merge(from, 1, [1, 2, 3] == axis)
    b = merge(into, 1, [1, 2, 3] == axis)
    call mpi_sendrecv(phi(a(1), a(2), a(3)), 1, face, to, axis, &
                      phi(b(1), b(2), b(3)), 1, face, source, axis, grid, mpi_status_ignore)
  end subroutine

  ! A number from -0.1 to 0.1, the same on whichever rank has the cell.
  pure function noise(x, y, z) result(value)
    integer, intent(in) :: x, y, z
    real(c_double) :: value
    integer(c_int64_t) :: hash
    integer :: round
    hash = x + n * (y + n * z)
    do round = 1, 4
      hash = modulo(hash * hash + 12345, 2147483647_c_int64_t)
    end do
    value = 0.2d0 * hash / 2147483647 - 0.1d0
  end function

  subroutine write_result()
    type(mpi_file) :: file
    type(mpi_datatype) :: part
    call mpi_type_create_subarray(3, [n, n, n], cells, first, mpi_order_fortran, &
                                  mpi_double_precision, part)
    call mpi_type_commit(part)
    call mpi_file_open(grid, "phases.raw", mpi_mode_create + mpi_mode_wronly, mpi_info_null, file)
    call mpi_file_set_view(file, 0_mpi_offset_kind, mpi_double_precision, part, "native", &
                           mpi_info_null)
    rate = phi(1:cells(1), 1:cells(2), 1:cells(3))
    call mpi_file_write_all(file, rate, size(rate), mpi_double_precision, mpi_status_ignore)
    call mpi_file_close(file)
  end subroutine
end program
