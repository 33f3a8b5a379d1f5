! The Fortran interface of vdi_catalyst.h: compile this file with the simulation and `use vdi_catalyst`. The header has
! the documentation. The handle is a type(c_ptr), strings end with c_null_char, arrays of pointers are arrays of
! c_loc(...).
module vdi_catalyst
  use, intrinsic :: iso_c_binding, only: c_char, c_double, c_f_pointer, c_int, c_int32_t, c_int64_t, c_null_ptr, c_ptr, &
    c_size_t
  implicit none
  private :: c_char, c_double, c_f_pointer, c_int, c_int32_t, c_int64_t, c_null_ptr, c_ptr, &
    c_size_t
  private :: error_in_c, length_in_c

  enum, bind(c)
    enumerator :: vdi_catalyst_ok = 0
    enumerator :: vdi_catalyst_bad_argument = 1
    enumerator :: vdi_catalyst_engine = 2
    enumerator :: vdi_catalyst_script = 3
    enumerator :: vdi_catalyst_busy = 4
  end enum

  integer(c_int32_t), parameter :: vdi_catalyst_u8 = 0
  integer(c_int32_t), parameter :: vdi_catalyst_i8 = 1
  integer(c_int32_t), parameter :: vdi_catalyst_u16 = 2
  integer(c_int32_t), parameter :: vdi_catalyst_i16 = 3
  integer(c_int32_t), parameter :: vdi_catalyst_u32 = 4
  integer(c_int32_t), parameter :: vdi_catalyst_i32 = 5
  integer(c_int32_t), parameter :: vdi_catalyst_f32 = 6
  integer(c_int32_t), parameter :: vdi_catalyst_f64 = 7
  integer(c_int32_t), parameter :: vdi_catalyst_i64 = 8
  integer(c_int32_t), parameter :: vdi_catalyst_u64 = 9

  integer(c_int32_t), parameter :: vdi_catalyst_points = 0
  integer(c_int32_t), parameter :: vdi_catalyst_cells = 1

  type, bind(c) :: vdi_catalyst_block
    integer(c_int32_t) :: cells(3) = 0
    integer(c_int32_t) :: ghost_lo(3) = 0
    integer(c_int32_t) :: ghost_hi(3) = 0
    real(c_double) :: origin(3) = 0
    real(c_double) :: spacing(3) = 1
  end type

  type, bind(c) :: vdi_catalyst_pipeline
    type(c_ptr) :: file
    integer(c_int32_t) :: argument_count = 0
    type(c_ptr) :: arguments
  end type

  type, bind(c) :: vdi_catalyst_strides
    integer(c_int64_t) :: strides(3) = 0
    integer(c_int64_t) :: component_stride = 0
  end type

  integer(c_int32_t), parameter :: vdi_catalyst_sum = 0
  integer(c_int32_t), parameter :: vdi_catalyst_density = 1

  ! Without weights or lengths, their pointers stay c_null_ptr.
  type, bind(c) :: vdi_catalyst_particles
    integer(c_int64_t) :: count = 0
    integer(c_int32_t) :: kind = vdi_catalyst_sum
    integer(c_int32_t) :: position_type = vdi_catalyst_f64
    type(c_ptr) :: positions(3) = c_null_ptr
    integer(c_int64_t) :: position_stride = 8
    type(c_ptr) :: weights = c_null_ptr
    integer(c_int64_t) :: weight_stride = 8
    type(c_ptr) :: lengths = c_null_ptr
    integer(c_int64_t) :: length_stride = 8
    integer(c_int32_t) :: weight_type = vdi_catalyst_f64
    integer(c_int32_t) :: length_type = vdi_catalyst_f64
    integer(c_int32_t) :: periodic(3) = 0
  end type

  interface
    ! communicator: an `integer` handle of mpif.h or `use mpi`, or comm%mpi_val of `use mpi_f08`.
    function vdi_catalyst_initialize(communicator, script_count, scripts, catalyst) bind(c) result(code)
      import :: c_int, c_int32_t, c_ptr
      integer(c_int32_t), value :: communicator, script_count
      type(c_ptr), intent(in) :: scripts(*)
      type(c_ptr), intent(out) :: catalyst
      integer(c_int) :: code
    end function

    function vdi_catalyst_initialize_pipelines(communicator, script_count, scripts, catalyst) bind(c) result(code)
      import :: c_int, c_int32_t, c_ptr, vdi_catalyst_pipeline
      integer(c_int32_t), value :: communicator, script_count
      type(vdi_catalyst_pipeline), intent(in) :: scripts(*)
      type(c_ptr), intent(out) :: catalyst
      integer(c_int) :: code
    end function

    ! json: the text or a file's name, with c_null_char at its end.
    function vdi_catalyst_initialize_json(communicator, json, catalyst) bind(c) result(code)
      import :: c_char, c_int, c_int32_t, c_ptr
      integer(c_int32_t), value :: communicator
      character(kind=c_char), intent(in) :: json(*)
      type(c_ptr), intent(out) :: catalyst
      integer(c_int) :: code
    end function

    function vdi_catalyst_set_blocks(catalyst, count, blocks) bind(c) result(code)
      import :: c_int, c_int32_t, c_ptr, vdi_catalyst_block
      type(c_ptr), value :: catalyst
      integer(c_int32_t), value :: count
      type(vdi_catalyst_block), intent(in) :: blocks(*)
      integer(c_int) :: code
    end function

    function vdi_catalyst_set_array(catalyst, name, type, association, values) bind(c) result(code)
      import :: c_char, c_int, c_int32_t, c_ptr
      type(c_ptr), value :: catalyst
      character(kind=c_char), intent(in) :: name(*)
      integer(c_int32_t), value :: type, association
      type(c_ptr), intent(in) :: values(*)
      integer(c_int) :: code
    end function

    function vdi_catalyst_set_array_strided(catalyst, name, type, association, components, values, strides) &
        bind(c) result(code)
      import :: c_char, c_int, c_int32_t, c_ptr, vdi_catalyst_strides
      type(c_ptr), value :: catalyst
      character(kind=c_char), intent(in) :: name(*)
      integer(c_int32_t), value :: type, association, components
      type(c_ptr), intent(in) :: values(*)
      type(vdi_catalyst_strides), intent(in) :: strides(*)
      integer(c_int) :: code
    end function

    function vdi_catalyst_set_array_offset(catalyst, name, association, offset) bind(c) result(code)
      import :: c_char, c_double, c_int, c_int32_t, c_ptr
      type(c_ptr), value :: catalyst
      character(kind=c_char), intent(in) :: name(*)
      integer(c_int32_t), value :: association
      real(c_double), intent(in) :: offset(3)
      integer(c_int) :: code
    end function

    function vdi_catalyst_set_array_missing(catalyst, name, association, count, values) bind(c) result(code)
      import :: c_char, c_double, c_int, c_int32_t, c_ptr
      type(c_ptr), value :: catalyst
      character(kind=c_char), intent(in) :: name(*)
      integer(c_int32_t), value :: association, count
      real(c_double), intent(in) :: values(*)
      integer(c_int) :: code
    end function

    function vdi_catalyst_set_particles(catalyst, name, particles) bind(c) result(code)
      import :: c_char, c_int, c_ptr, vdi_catalyst_particles
      type(c_ptr), value :: catalyst
      character(kind=c_char), intent(in) :: name(*)
      type(vdi_catalyst_particles), intent(in) :: particles
      integer(c_int) :: code
    end function

    ! stream: of CUDA Fortran, an integer(cuda_stream_kind), transfer(stream, c_null_ptr).
    function vdi_catalyst_set_stream(catalyst, stream) bind(c) result(code)
      import :: c_int, c_ptr
      type(c_ptr), value :: catalyst, stream
      integer(c_int) :: code
    end function

    function vdi_catalyst_wants(catalyst, step, time) bind(c) result(wants)
      import :: c_double, c_int, c_int64_t, c_ptr
      type(c_ptr), value :: catalyst
      integer(c_int64_t), value :: step
      real(c_double), value :: time
      integer(c_int) :: wants
    end function

    function vdi_catalyst_execute(catalyst, step, time) bind(c) result(code)
      import :: c_double, c_int, c_int64_t, c_ptr
      type(c_ptr), value :: catalyst
      integer(c_int64_t), value :: step
      real(c_double), value :: time
      integer(c_int) :: code
    end function

    function vdi_catalyst_parameter_f64(catalyst, name, value, low, high) bind(c) result(in_force)
      import :: c_char, c_double, c_ptr
      type(c_ptr), value :: catalyst
      character(kind=c_char), intent(in) :: name(*)
      real(c_double), value :: value, low, high
      real(c_double) :: in_force
    end function

    function vdi_catalyst_parameter_i64(catalyst, name, value, low, high) bind(c) result(in_force)
      import :: c_char, c_int64_t, c_ptr
      type(c_ptr), value :: catalyst
      character(kind=c_char), intent(in) :: name(*)
      integer(c_int64_t), value :: value, low, high
      integer(c_int64_t) :: in_force
    end function

    function vdi_catalyst_finalize(catalyst) bind(c) result(code)
      import :: c_int, c_ptr
      type(c_ptr), value :: catalyst
      integer(c_int) :: code
    end function

    function error_in_c(catalyst) bind(c, name="vdi_catalyst_error") result(text)
      import :: c_ptr
      type(c_ptr), value :: catalyst
      type(c_ptr) :: text
    end function

    function length_in_c(text) bind(c, name="strlen") result(length)
      import :: c_ptr, c_size_t
      type(c_ptr), value :: text
      integer(c_size_t) :: length
    end function
  end interface

contains

  ! Returns a copy of the error as a Fortran string, which has length 0 if there was no error.
  function vdi_catalyst_error(catalyst) result(text)
    type(c_ptr), intent(in) :: catalyst
    character(len=:), allocatable :: text
    character(kind=c_char), pointer :: bytes(:)
    type(c_ptr) :: start
    integer(c_size_t) :: i
    start = error_in_c(catalyst)
    call c_f_pointer(start, bytes, [length_in_c(start)])
    allocate(character(len=size(bytes)) :: text)
    do i = 1, size(bytes, kind=c_size_t)
      text(i:i) = bytes(i)
    end do
  end function
end module
