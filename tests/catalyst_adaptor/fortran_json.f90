! A simulation in Fortran without a script: one block per rank, a VDI every 2 steps.
program fortran_json
  use, intrinsic :: iso_c_binding
  use mpi
  use vdi_catalyst
  implicit none
  integer, parameter :: n = 12
  integer :: rank, error, i, j, k, code
  integer(c_int64_t) :: step
  type(vdi_catalyst_block) :: blocks(1)
  type(vdi_catalyst_particles) :: particles
  real(c_double), target :: positions(3, 1), mass(1)
  real(c_double), target :: values(n, n, n)
  character(len=1024) :: folder
  type(c_ptr) :: vdi

  call mpi_init(error)
  call mpi_comm_rank(mpi_comm_world, rank, error)
  call get_environment_variable("VDI_OUTPUT", folder)
  if (vdi_catalyst_initialize_json(mpi_comm_world, '{"field": "W"' // c_null_char, vdi) /= vdi_catalyst_script) &
    call mpi_abort(mpi_comm_world, 2, error)
  if (c_associated(vdi)) call mpi_abort(mpi_comm_world, 3, error)
  code = vdi_catalyst_initialize_json(mpi_comm_world, '{"field": "V", "every": 2, "resolution": [64, 48], ' // &
    '"when": {"min": "P", "above": 3.9}, "output": "' // trim(folder) // '/f_{timestep}.vdi"}' // c_null_char, vdi)
  blocks(1)%cells = n
  blocks(1)%origin = [real(rank * n, c_double), 0.0_c_double, 0.0_c_double]
  code = code + vdi_catalyst_set_blocks(vdi, 1, blocks)
  code = code + vdi_catalyst_set_stream(vdi, c_null_ptr)
  code = code + vdi_catalyst_set_array(vdi, "V" // c_null_char, vdi_catalyst_f64, vdi_catalyst_cells, [c_loc(values)])
  ! The run's condition: each rank puts a weight of 2 into the middle of the same cell of the first rank's block. Cells
  ! without particles are missing.
  positions(:, 1) = [1.5_c_double, 2.5_c_double, 3.5_c_double]
  mass = 2
  particles%count = 1
  particles%kind = vdi_catalyst_density
  do i = 1, 3
    particles%positions(i) = c_loc(positions(i, 1))
  end do
  particles%position_stride = 24
  particles%weights = c_loc(mass)
  code = code + vdi_catalyst_set_particles(vdi, "P" // c_null_char, particles)
  code = code + vdi_catalyst_set_array_missing(vdi, "P" // c_null_char, vdi_catalyst_cells, 1, [0.0_c_double])
  do step = 0, 2
    do k = 1, n
      do j = 1, n
        do i = 1, n
          values(i, j, k) = step + sin(0.3d0 * (i + rank * n)) * cos(0.2d0 * j) + 0.05d0 * k
        end do
      end do
    end do
    code = code + vdi_catalyst_execute(vdi, step, 0.5d0 * step)
  end do
  code = code + vdi_catalyst_finalize(vdi)
  if (code /= vdi_catalyst_ok) call mpi_abort(mpi_comm_world, 1, error)
  call mpi_finalize(error)
end program
