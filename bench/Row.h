// One line of what `vdi bench` reports: a view of a VDI, and what making and seeing it took.
#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "bench/Frames.h"
#include "bench/Rival.h"
#include "bench/Timing.h"
#include "vdi/core/GenerateSettings.h"
#include "vdi/core/ImageMetrics.h"
#include "vdi/core/Reconstruction.h"

namespace vdi::bench {

/// What a data set's values take to get to the device.
struct UploadTimes {
  double milliseconds = 0.0;
  std::optional<double> stepMs;  // a frame beside the next step's upload; none: no room for two volumes
};

/// Volume rendering at the rate that VDIs are made at.
struct DvrFigures {
  Spread device;              // ms
  Spread frame;               // ms
  ImageDifference fromTruth;  // the root's
};

/// What making a VDI took, and how large it is. Only the root has the sizes.
struct GenerationFigures {
  Spread device;   // ms
  Spread frame;    // ms, the stages of the slowest rank
  Spread overDvr;  // device time over that of volume rendering right before it
  double countMs = 0.0;
  double writeMs = 0.0;
  FrameFigures frames;
  std::size_t supersegments = 0;
  std::size_t storedBytes = 0;
};

/// What seeing it took, and how true it is.
struct ViewFigures {
  Spread device;               // ms
  Spread frame;                // ms
  double dvrOverDevice = 0.0;  // one rank only
  ImageDifference fromTruth;
};

struct BenchRow {
  std::string dataset;
  GenerateSettings settings;
  Reconstruction reconstruction{};
  double truthRate = 0.0;     // samples per voxel of the volume rendering that both views are compared with
  double viewDegrees = 0.0;   // of the VDI's viewpoint around the scene
  double angleDegrees = 0.0;  // of this view from there
  UploadTimes upload;
  DvrFigures dvr;
  GenerationFigures generation;
  ViewFigures view;
  std::optional<RivalFigures> rival;  // of the VDI's viewpoint
};

std::string tableHead();
std::string tableLine(const BenchRow& row);
/// null: not measured, or infinite.
nlohmann::json toJson(const BenchRow& row);

}  // namespace vdi::bench
