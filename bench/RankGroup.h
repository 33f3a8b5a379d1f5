// Some of the ranks that mpirun started, for measurements on fewer ranks.
#pragma once

#include "vdi/comm/Communicator.h"

namespace vdi::bench {

/// The first ranks of MPI_COMM_WORLD, or the single rank without MPI. The constructor is collective
/// over `world`, which has MPI_COMM_WORLD's ranks. Destroy it before MPI is finalised.
class RankGroup {
 public:
  /// 1 <= size <= world.size(). Throws Error{Communication}.
  RankGroup(const comm::Communicator& world, int size);
  ~RankGroup();
  RankGroup(const RankGroup&) = delete;
  RankGroup& operator=(const RankGroup&) = delete;

  bool member() const { return member_; }
  /// Collective over the members. Only members may call it.
  comm::Communicator communicator() const;
  /// MPI_Comm_c2f of the members' communicator, which the group owns. Throws Error{InvalidArgument}
  /// without MPI.
  int handle() const;

 private:
  bool member_;
  bool mpi_ = false;
  int handle_ = 0;
};

/// A barrier of all ranks of MPI_COMM_WORLD. Ranks without work sleep in it and leave the cores to
/// the measured ones. Returns at once without MPI. Throws Error{Communication}.
void waitForAll();

}  // namespace vdi::bench
