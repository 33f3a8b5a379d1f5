// One row of `vdi bench`: a view of a VDI, with the figures of making and viewing it.
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

/// Times to bring a data set's values to the device.
struct UploadTimes {
  double milliseconds = 0.0;
  std::optional<double> stepMs;  // a frame during the next step's upload; nullopt: no memory for two volumes
};

/// Volume rendering at the sampling rate of the VDIs.
struct DvrFigures {
  Spread device;              // ms
  Spread frame;               // ms
  ImageDifference fromTruth;  // on the root
};

/// Figures of making a VDI, and its size. Only the root has the sizes.
struct GenerationFigures {
  Spread device;   // ms
  Spread frame;    // ms, summed over the stages of the slowest rank
  Spread overDvr;  // device time relative to that of volume rendering right before it
  double countMs = 0.0;
  double writeMs = 0.0;
  FrameFigures frames;
  std::size_t supersegments = 0;
  std::size_t storedBytes = 0;
};

/// Figures of viewing the VDI, and its accuracy.
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
  double truthRate = 0.0;     // samples per voxel of the truth, with which both views are compared
  double viewDegrees = 0.0;   // from the original viewpoint to the VDI's, around the scene
  double angleDegrees = 0.0;  // from the VDI's viewpoint to this view
  UploadTimes upload;
  DvrFigures dvr;
  GenerationFigures generation;
  ViewFigures view;
  std::optional<RivalFigures> rival;  // at the VDI's viewpoint
};

std::string tableHead();
std::string tableLine(const BenchRow& row);
/// A figure that wasn't measured or is infinite is null.
nlohmann::json toJson(const BenchRow& row);

}  // namespace vdi::bench
