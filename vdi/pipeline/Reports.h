// What a frame reports, and how its caller follows it.
#pragma once

#include <cstdint>
#include <functional>

#include "vdi/core/Coloring.h"

namespace vdi {

/// Wall-clock seconds and bytes of one rank in the last frame.
struct RankReport {
  double uploadSeconds = 0.0;          // of setBlocks, or setNextBlocks and advance, since the last frame
  double generateSeconds = 0.0;        // casting and segmenting, transfers included
  double generateDeviceSeconds = 0.0;  // of these, the device's work without transfers
  double countSeconds = 0.0;  // of these, the first step: bisection's search or the counting of pre-segments
  double writeSeconds = 0.0;  // and the second
  double distributeSeconds = 0.0;
  double compositeSeconds = 0.0;
  double compositeDeviceSeconds = 0.0;  // of these, the device's work, and the copying of what was received
  double gatherSeconds = 0.0;
  double outputSeconds = 0.0;    // of write, instead of the gather: downloading, encoding and writing
  double samplesPerVoxel = 0.0;  // of the frame: what automaticRate came to
  std::uint64_t blocks = 0;
  std::uint64_t volumeBytes = 0;
  std::uint64_t subSupersegments = 0;
  std::uint64_t bytesSent = 0;
  std::uint64_t bytesWritten = 0;   // of write: into the file, by this rank
  std::uint64_t deviceBytes = 0;    // device memory held
  std::uint64_t hostPeakBytes = 0;  // the most host memory that the process has had, shared one included
};

/// A file that VdiGenerator::write has made.
struct WrittenVdi {
  std::uint64_t supersegments = 0;
  std::uint64_t bytes = 0;
};

/// What a VDI's file says of the simulation.
struct TimeStamp {
  double time = 0.0;
  std::uint64_t step = 0;
  ScalarArray array = {};  // that the blocks' scalars are of
};

/// Called on every rank with the share done, 0 .. 1; returns false to ask for an abort, which all ranks then
/// obey together at the next stage (Error{Cancelled}).
using Progress = std::function<bool(double)>;

}  // namespace vdi
