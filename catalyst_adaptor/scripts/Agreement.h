// Agreement among ranks, so that none waits for a rank whose script has ended.
#pragma once

#include <mpi.h>

#include <cstdint>
#include <string>

namespace vdi::catalyst {

/// Ranks that run scripts meet here, on a communicator of their own: before each of our collective operations
/// (plugin/.../VDICollective.h), and when a part of a script has ended. A rank whose script has
/// failed keeps meeting the others until the part has ended on all ranks. Ranks that want to enter
/// an operation are therefore refused instead of waiting there. All functions are collective in
/// this sense: any of them meets any other.
class Agreement {
 public:
  /// Duplicates the communicator.
  explicit Agreement(MPI_Comm comm);
  ~Agreement();
  Agreement(const Agreement&) = delete;
  Agreement& operator=(const Agreement&) = delete;

  /// Call it before an operation, with the same name on all ranks. Returns "" if all ranks enter, else the
  /// reason why none does.
  std::string enter(const std::string& operation);
  /// The reason that `enter` returns if another rank's script has failed. That rank reports more.
  static constexpr const char* otherFailed = "another rank's script failed before this update";

  /// Call it when a part of a script has ended here; it returns once the part has ended on all ranks. Returns
  /// whether it failed on any rank, or other ranks have left the step already.
  bool leavePart(bool failed);
  /// Call it when all scripts have ended here for this step; it returns once they have on all ranks.
  void leaveStep();

 private:
  enum class Place : std::int64_t { Entering, PartOver, StepOver };
  struct Meeting {
    Place first;  // place of the rank that has come least far
    Place last;   // place of the rank that has come farthest
    bool failed;
    bool same;  // all ranks name the same operation
  };
  Meeting meet(Place place, bool failed, std::int64_t operation) const;

  MPI_Comm comm_ = MPI_COMM_NULL;
};

}  // namespace vdi::catalyst
