! A simulation in Fortran: the unit cube's cells on one rank, and one step. Its argument is the script.
program simulation
  use, intrinsic :: iso_c_binding
  use mpi
  use vdi_catalyst
  implicit none
  integer, parameter :: n = 16
  integer :: error, i, j, k, length
  type(c_ptr) :: catalyst
  type(vdi_catalyst_block) :: blocks(1)
  real(c_double), target :: field(n, n, n)
  character(len=1024) :: argument
  character(kind=c_char, len=:), allocatable, target :: script

  call get_command_argument(1, argument, length)
  script = argument(1:length) // c_null_char
  call mpi_init(error)
  do k = 1, n
    do j = 1, n
      do i = 1, n
        field(i, j, k) = i * j + k
      end do
    end do
  end do
  blocks(1)%cells = n
  blocks(1)%spacing = 1.0d0 / n
  call must(vdi_catalyst_initialize(mpi_comm_world, 1, [c_loc(script)], catalyst))
  call must(vdi_catalyst_set_blocks(catalyst, 1, blocks))
  call must(vdi_catalyst_set_array(catalyst, "V" // c_null_char, vdi_catalyst_f64, vdi_catalyst_cells, [c_loc(field)]))
  call must(vdi_catalyst_execute(catalyst, 1_c_int64_t, 0.5d0))
  call must(vdi_catalyst_finalize(catalyst))
  call mpi_finalize(error)

contains

  subroutine must(code)
    integer(c_int), intent(in) :: code
    if (code /= vdi_catalyst_ok) call mpi_abort(mpi_comm_world, 1, error)
  end subroutine
end program
