! Separation of two phases, after Allen and Cahn: d phi / dt = laplacian(phi) + phi - phi**3,
! periodic, in slabs of z, one per rank.
!
!     mpirun -n 4 phases [vdi.json]
!
! The array has two layers of halo all around. Its first dimension is padded, as in codes that
! align columns.
program phases
  use, intrinsic :: iso_c_binding
  use mpi_f08
  use vdi_catalyst
  implicit none
  integer, parameter :: n = 32, halo = 2, padding = 3
  real(c_double), parameter :: time_step = 0.1d0
  real(c_double), target, allocatable :: phi(:, :, :)
  real(c_double), allocatable :: next(:, :, :), noise(:, :, :)
  integer :: rank, ranks, first, nz, code, i, j, k
  integer(c_int64_t) :: step
  character(len=4096) :: json
  type(mpi_file) :: file
  type(c_ptr) :: vdi = c_null_ptr ! while it is null, calls do nothing

  call mpi_init()
  call mpi_comm_rank(mpi_comm_world, rank)
  call mpi_comm_size(mpi_comm_world, ranks)
  first = n * rank / ranks
  nz = n * (rank + 1) / ranks - first
  allocate(noise(n, n, n), next(n, n, nz))
  allocate(phi(1 - halo:n + halo + padding, 1 - halo:n + halo, 1 - halo:nz + halo))
  call random_init(repeatable=.true., image_distinct=.false.)
  call random_number(noise)
  next = 0.2d0 * noise(:, :, first + 1:first + nz) - 0.1d0

  call get_command_argument(1, json)
  if (json /= "") code = vdi_catalyst_initialize_json(mpi_comm_world%mpi_val, &
                                                      trim(json) // c_null_char, vdi)
  call hand_over()
  do step = 0, 60
    phi(1:n, 1:n, 1:nz) = next
    code = vdi_catalyst_execute(vdi, step, step * time_step)
    call fill_halo()
    do concurrent (i = 1:n, j = 1:n, k = 1:nz)
      next(i, j, k) = phi(i, j, k) + time_step * ( &
        phi(i - 1, j, k) + phi(i + 1, j, k) + phi(i, j - 1, k) + phi(i, j + 1, k) &
        + phi(i, j, k - 1) + phi(i, j, k + 1) - 5 * phi(i, j, k) - phi(i, j, k)**3)
    end do
  end do
  code = vdi_catalyst_finalize(vdi)

  call mpi_file_open(mpi_comm_world, "phases.raw", mpi_mode_create + mpi_mode_wronly, &
                     mpi_info_null, file)
  call mpi_file_write_ordered(file, next, size(next), mpi_real8, mpi_status_ignore)
  call mpi_file_close(file)
  call mpi_finalize()

contains

  ! Hands over the inside of phi in place: the address of its first value, and the distance in bytes
  ! to the next value on each axis.
  subroutine hand_over()
    type(vdi_catalyst_block) :: block
    type(vdi_catalyst_strides) :: strides
    block%cells = [n, n, nz]
    block%origin = [0, 0, first] ! in cells, for the spacing is 1
    strides%strides = storage_size(phi) / 8 * [1, size(phi, 1), size(phi, 1) * size(phi, 2)]
    code = vdi_catalyst_set_blocks(vdi, 1, [block])
    code = vdi_catalyst_set_array_strided(vdi, "phi" // c_null_char, vdi_catalyst_f64, &
                                          vdi_catalyst_cells, 1, [c_loc(phi(1, 1, 1))], [strides])
  end subroutine

  subroutine fill_halo()
    integer :: below, above, count
    phi(1 - halo:0, :, :) = phi(n + 1 - halo:n, :, :)
    phi(n + 1:n + halo, :, :) = phi(1:halo, :, :)
    phi(:, 1 - halo:0, :) = phi(:, n + 1 - halo:n, :)
    phi(:, n + 1:n + halo, :) = phi(:, 1:halo, :)
    below = modulo(rank - 1, ranks)
    above = modulo(rank + 1, ranks)
    count = halo * size(phi, 1) * size(phi, 2)
    call mpi_sendrecv(phi(:, :, 1:halo), count, mpi_real8, below, 0, &
                      phi(:, :, nz + 1:), count, mpi_real8, above, 0, mpi_comm_world, mpi_status_ignore)
    call mpi_sendrecv(phi(:, :, nz + 1 - halo:nz), count, mpi_real8, above, 1, &
                      phi(:, :, :0), count, mpi_real8, below, 1, mpi_comm_world, mpi_status_ignore)
  end subroutine
end program
