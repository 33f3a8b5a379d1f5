#include "bench/RankGroup.h"

#include <mpi.h>

#include <cassert>
#include <chrono>
#include <string>
#include <thread>

#include "vdi/core/Error.h"

namespace vdi::bench {

namespace {

void check(int result, const char* call) {
  if (result != MPI_SUCCESS) throw Error(ErrorCode::Communication, std::string(call) + " failed");
}

bool mpiRuns() {
  int initialized = 0;
  int finalized = 0;
  MPI_Initialized(&initialized);
  MPI_Finalized(&finalized);
  return initialized != 0 && finalized == 0;
}

}  // namespace

RankGroup::RankGroup(const comm::Communicator& world, int size)
    : member_(world.rank() < size), mpi_(mpiRuns()) {
  assert(size >= 1 && size <= world.size());
  if (!mpi_) return;
  MPI_Comm group = MPI_COMM_NULL;
  check(MPI_Comm_split(MPI_COMM_WORLD, member_ ? 0 : MPI_UNDEFINED, world.rank(), &group), "MPI_Comm_split");
  handle_ = MPI_Comm_c2f(group);
}

RankGroup::~RankGroup() {
  if (!mpi_ || !member_) return;
  MPI_Comm group = MPI_Comm_f2c(handle_);
  MPI_Comm_free(&group);
}

comm::Communicator RankGroup::communicator() const {
  assert(member_);
  return mpi_ ? comm::Communicator::fromMpi(handle_) : comm::Communicator::serial();
}

int RankGroup::handle() const {
  assert(member_);
  if (!mpi_) throw Error(ErrorCode::InvalidArgument, "this requires MPI: start it with mpirun");
  return handle_;
}

void waitForAll() {
  if (!mpiRuns()) return;
  MPI_Request request = MPI_REQUEST_NULL;
  check(MPI_Ibarrier(MPI_COMM_WORLD, &request), "MPI_Ibarrier");
  int done = 0;
  check(MPI_Test(&request, &done, MPI_STATUS_IGNORE), "MPI_Test");
  while (done == 0) {
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
    check(MPI_Test(&request, &done, MPI_STATUS_IGNORE), "MPI_Test");
  }
}

}  // namespace vdi::bench
