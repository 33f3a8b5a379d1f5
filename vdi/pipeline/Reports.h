// A frame's reports, and its progress.
#pragma once

#include <cstdint>
#include <functional>

#include "vdi/core/Coloring.h"

namespace vdi {

/// Seconds and bytes of one rank in one frame. Seconds of a stage are wall-clock time on the host, waiting
/// for other ranks included, unless they are called device work.
struct RankReport {
  double uploadSeconds = 0.0;          // setBlocks, or setNextBlocks and advance, since the last frame
  double generateSeconds = 0.0;        // casting and segmenting, transfers included
  double generateDeviceSeconds = 0.0;  // device work in generateSeconds, without transfers
  /// Device work before anything is written: bisection's search or the counting of pre-segments.
  double countSeconds = 0.0;
  double writeSeconds = 0.0;            // device work of writing supersegments (bisection) or pre-segments
  double distributeSeconds = 0.0;       // sending each list's parts to its owner
  double compositeSeconds = 0.0;        // compositing the lists or pixels that this rank owns
  double compositeDeviceSeconds = 0.0;  // device work in compositeSeconds, and copies of received lists
  double gatherSeconds = 0.0;           // bringing the result to rank 0
  double outputSeconds = 0.0;           // time of write, in place of the gather: download, encoding, writing
  double samplesPerVoxel = 0.0;         // rate of the frame, also with automaticRate
  std::uint64_t blocks = 0;             // blocks that this rank has set
  std::uint64_t volumeBytes = 0;        // size of their stored values
  std::uint64_t subSupersegments = 0;   // supersegments made from them, before compositing
  std::uint64_t bytesSent = 0;          // bytes of lists, pixels and file chunks sent to other ranks
  std::uint64_t bytesWritten = 0;       // bytes that write put into the file from this rank
  std::uint64_t deviceBytes = 0;        // device memory held
  std::uint64_t hostPeakBytes = 0;      // peak host memory of the process, shared memory included
};

/// A file written by VdiGenerator::write.
struct WrittenVdi {
  std::uint64_t supersegments = 0;
  std::uint64_t bytes = 0;
};

/// The simulation's state that a VDI's file records.
struct TimeStamp {
  double time = 0.0;
  std::uint64_t step = 0;
  ScalarArray array = {};  // the array that the blocks' scalars come from
};

/// Called on every rank with the frame's finished share, 0 .. 1, after each band of lists or pixels, on the
/// thread that called the generator. It must not call the generator. It returns false to request an abort,
/// which all ranks then obey together at the next stage (Error{Cancelled}). An exception fails the frame on
/// all ranks. The last call, with 1, comes when the frame is complete (from VdiGenerator::start there is
/// none): its result is ignored, and it must throw nothing.
using Progress = std::function<bool(double)>;

}  // namespace vdi
