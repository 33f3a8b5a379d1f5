// A run's log as a picture.
#pragma once

#include <string>

#include "vdi/runlog/Record.h"

namespace vdi::runlog {

struct PlotOptions {
  std::string title;
  bool means = false;  // shows the ranks' mean instead of the slowest rank
};

/// An SVG document: above, each frame's stages on top of each other, in milliseconds, with a line at the time
/// that the simulation waited, or that the frame took in another process; below, the bytes that the frame
/// wrote. Frames stand in the log's order; their steps are written below them, and failed ones are red.
/// Throws Error{Format} if there are no frames.
std::string plot(const RunRecords& records, const PlotOptions& options);

}  // namespace vdi::runlog
