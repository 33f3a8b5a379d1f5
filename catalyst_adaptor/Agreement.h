// Keeps ranks from waiting for one whose script has ended.
#pragma once

#include <mpi.h>

#include <cstdint>
#include <string>

namespace vdi::catalyst {

/// Ranks that run scripts meet here, on a communicator of their own: before each collective operation of ours
/// (plugin/.../VDICollective.h), and where a part of a script has ended. A rank whose script fails goes on
/// meeting until it has ended on all, so that those who want to enter an operation are told not to, instead
/// of waiting there. All functions are collective in this sense: any of them meets any other.
class Agreement {
 public:
  /// Duplicates the communicator.
  explicit Agreement(MPI_Comm comm);
  ~Agreement();
  Agreement(const Agreement&) = delete;
  Agreement& operator=(const Agreement&) = delete;

  /// Before an operation, that of the same name on all ranks. "": all enter; else why none does.
  std::string enter(const std::string& operation);
  /// What enter says where another rank's script has failed; that rank has more to tell.
  static constexpr const char* otherFailed = "another rank's script failed before this update";

  /// A part of a script has ended here; returns once it has on all ranks. Whether it failed on any, or some
  /// ranks have left the step without it.
  bool leavePart(bool failed);
  /// All scripts have ended here for this step; returns once they have on all ranks.
  void leaveStep();

 private:
  enum class Place : std::int64_t { Entering, PartOver, StepOver };
  struct Meeting {
    Place first;  // the least far of any rank
    Place last;
    bool failed;
    bool same;  // operation
  };
  Meeting meet(Place place, bool failed, std::int64_t operation) const;

  MPI_Comm comm_ = MPI_COMM_NULL;
};

}  // namespace vdi::catalyst
