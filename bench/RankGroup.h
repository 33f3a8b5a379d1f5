// Some of the ranks that mpirun started, for measurements of fewer ranks.
#pragma once

#include "vdi/comm/Communicator.h"

namespace vdi::bench {

/// The first ranks of MPI_COMM_WORLD, or the one rank that there is without MPI. Making one is collective
/// over all of `world`, which has MPI_COMM_WORLD's ranks. It goes before MPI is finalised.
class RankGroup {
 public:
  /// 1 <= size <= world.size(). Throws Error{Communication}.
  RankGroup(const comm::Communicator& world, int size);
  ~RankGroup();
  RankGroup(const RankGroup&) = delete;
  RankGroup& operator=(const RankGroup&) = delete;

  bool member() const { return member_; }
  /// Collective over the members, for whom alone it is.
  comm::Communicator communicator() const;
  /// MPI_Comm_c2f of the members' communicator, which stays the group's. Throws Error{InvalidArgument} where
  /// MPI doesn't run.
  int handle() const;

 private:
  bool member_;
  bool mpi_ = false;
  int handle_ = 0;
};

/// A barrier of all ranks of MPI_COMM_WORLD that sleeps: ranks without work leave the cores to those that are
/// measured. Returns at once where MPI doesn't run. Throws Error{Communication}.
void waitForAll();

}  // namespace vdi::bench
