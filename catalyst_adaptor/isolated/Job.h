// The MPI job of the processes that make a run's frames, which the simulation's first rank starts.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <string>
#include <vector>

#include "vdi/core/Descriptor.h"

namespace vdi::catalyst {

/// The command by which a launcher starts one process for each rank, on the rank's host. `names` are the
/// hosts' names by rank. `launcher` is a command in which {ranks} becomes the number of ranks, and {hosts} a
/// list of hosts with the number of ranks on each, "a:2,b:1". If it is empty, one rank needs no launcher, and
/// several get Open MPI's or Hydra's mpirun. `program` and its arguments come at the end.
std::vector<std::string> commandOf(const std::string& launcher, const std::vector<std::string>& names,
                                   const std::vector<std::string>& program);

class Job {
 public:
  /// Starts the command in a session of its own, with default signals, all cores, no descriptors of this
  /// process, and this process's environment without the variables of its own MPI job. `program` is the file
  /// of vdi_catalyst_process. Throws std::runtime_error if that program can't be started.
  Job(const std::string& program, const std::vector<std::string>& command);
  /// Ends the job if it still runs, and doesn't wait for its end.
  ~Job();
  Job(const Job&) = delete;
  Job& operator=(const Job&) = delete;

  /// Whether all its processes on this host have ended. Waits at most `patience`.
  bool isOver(std::chrono::milliseconds patience) const;
  /// The first lines of the launcher's output, in one line.
  std::string said() const;

 private:
  Descriptor life_;    // reads end of file when the job is over
  Descriptor output_;  // its standard output and error
  pid_t process_ = 0;
};

}  // namespace vdi::catalyst
