// The messages between a rank of the simulation and the process that makes its frames.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "catalyst_adaptor/isolated/Packing.h"

namespace vdi::catalyst {

/// The first word of each message.
enum class Say : std::uint32_t {
  // From the simulation.
  Hello,    // with stdout, stderr and the Setup's pages as descriptors
  LeftOut,  // steps that aren't handed over, for the log; with the pages of LeftOutSteps as descriptor
  Step,     // see StepNotice; with the buffer's pages as descriptor if they are new
  Ask,      // int64 first: which steps from there on will be wanted?
  Finish,   // end the run
  // From the process.
  Worker,    // int32 process: the worker's number, from its supervisor
  Started,   // int32 code: initialising has ended
  Begun,     // int64 step: its frame is being made
  Done,      // see DoneNotice
  Wanted,    // int64 first, uint64 count, count bytes of 0 or 1: which steps scripts want
  Finished,  // int32 code, text
  Ended,     // int32 status of waitpid: the worker has ended, from its supervisor
};

/// The run's description for the process.
struct Setup {
  std::int32_t rank = 0;
  bool isJson = false;
  bool isGoingOn = false;  // an earlier process has made a part of the run
  bool hasText = false;
  std::string json;
  struct Pipeline {
    std::string file;
    std::vector<std::string> arguments;
  };
  std::vector<Pipeline> scripts;
  std::vector<std::string> environment;  // the rank's, "NAME=value"
  std::string folder;                    // its working directory
  std::uint32_t umask = 0;

  void pack(Packer& packer) const;
  static Setup unpack(Unpacker& unpacker);
};

struct StepNotice {
  std::int64_t step = 0;
  double time = 0.0;
  double clock = 0.0;        // seconds since the run's start
  std::uint32_t buffer = 0;  // 0 or 1
  bool isNewBuffer = false;  // its pages come with this message
};

/// Steps at which a frame was due, but which were left out because no buffer was free.
struct LeftOutSteps {
  struct Step {
    std::int64_t step = 0;
    double time = 0.0;
  };
  std::vector<Step> steps;

  void pack(Packer& packer) const;
  static LeftOutSteps unpack(Unpacker& unpacker);
};

struct DoneNotice {
  std::int64_t step = 0;
  std::int32_t code = 0;
  std::string text;
  std::vector<double> parameters;  // the values in force, in the order of declaration
};

/// Whether an MPI launcher sets this variable ("NAME=value") for each process of its job. The variables of
/// the simulation's job must not reach another job, which must keep its own.
bool isOfMpiJob(std::string_view variable);

}  // namespace vdi::catalyst
