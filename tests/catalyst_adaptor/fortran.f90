! A simulation in Fortran: one block per rank, point data, two steps. Its argument is the script.
program fortran_simulation
  use, intrinsic :: iso_c_binding
  use mpi
  use vdi_catalyst
  implicit none
  integer, parameter :: n = 12
  integer :: rank, error, i, j, k, length
  integer(c_int64_t) :: step
  type(c_ptr) :: catalyst
  type(vdi_catalyst_block) :: blocks(1)
  real(c_double), target :: field(0:n + 2, 0:n, 0:n) ! the first extent is padded
  type(vdi_catalyst_strides) :: strides(1)
  character(len=1024) :: argument
  character(kind=c_char, len=:), allocatable, target :: script

  call get_command_argument(1, argument, length)
  script = argument(1:length) // c_null_char
  call mpi_init(error)
  call mpi_comm_rank(mpi_comm_world, rank, error)
  call require(vdi_catalyst_initialize(mpi_comm_world, 1, [c_loc(script)], catalyst))

  blocks(1)%cells = n
  blocks(1)%origin = [real(rank * n, c_double), 0.0_c_double, 0.0_c_double]
  call require(vdi_catalyst_set_blocks(catalyst, 1, blocks))
  strides(1)%strides = 8 * [1, n + 3, (n + 3) * (n + 1)]
  call require(vdi_catalyst_set_array_strided(catalyst, "V" // c_null_char, vdi_catalyst_f64, vdi_catalyst_points, 1, &
    [c_loc(field)], strides))
  if (len(vdi_catalyst_error(catalyst)) /= 0) call mpi_abort(mpi_comm_world, 2, error)
  if (vdi_catalyst_execute(catalyst, -1_c_int64_t, 0.0_c_double) /= vdi_catalyst_bad_argument) &
    call mpi_abort(mpi_comm_world, 3, error)
  if (index(vdi_catalyst_error(catalyst), "step -1 is refused") == 0) call mpi_abort(mpi_comm_world, 4, error)
  if (abs(vdi_catalyst_parameter_f64(catalyst, "feed" // c_null_char, 0.037_c_double, 0.0_c_double, 0.1_c_double) - &
    0.037_c_double) > 0) call mpi_abort(mpi_comm_world, 6, error)
  if (vdi_catalyst_parameter_i64(catalyst, "waves" // c_null_char, 3_c_int64_t, 1_c_int64_t, 9_c_int64_t) /= 3_c_int64_t) &
    call mpi_abort(mpi_comm_world, 7, error)
  do step = 1, 2
    if (vdi_catalyst_wants(catalyst, step, 0.5d0 * step) /= 1) call mpi_abort(mpi_comm_world, 5, error)
    do k = 0, n
      do j = 0, n
        do i = 0, n
          field(i, j, k) = step + sin(0.3d0 * (i + rank * n)) * cos(0.2d0 * j) + 0.05d0 * k
        end do
      end do
    end do
    call require(vdi_catalyst_execute(catalyst, step, 0.5d0 * step))
  end do
  call require(vdi_catalyst_finalize(catalyst))
  call mpi_finalize(error)

contains

  subroutine require(code)
    integer(c_int), intent(in) :: code
    if (code /= vdi_catalyst_ok) call mpi_abort(mpi_comm_world, 1, error)
  end subroutine
end program
