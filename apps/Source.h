// Options that say which volume, view and settings: what generate and bench have in common.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <string>
#include <vector>

#include "apps/Decomposition.h"
#include "vdi/core/Camera.h"
#include "vdi/core/GenerateSettings.h"
#include "vdi/core/Scene.h"
#include "vdi/core/TransferFunction.h"

namespace vdi::apps {

struct SourceOptions {
  std::string raw;  // sidecar; empty: a procedural field
  std::string field = "turbulence";
  std::string size = "96x96x96";
  std::string type = "f32";
  std::uint32_t seed = 1;
  std::string blocks = "2x2x2";
  std::string layout = "interleaved";
  std::string joint = "shared";
};
void addSourceOptions(CLI::App& command, SourceOptions& options);

/// The blocks that `rank` of `ranks` holds. Throws Error.
std::vector<Block> makeBlocks(const SourceOptions& options, int rank, int ranks);

struct ViewOptions {
  std::string camera;  // file
  double azimuth = 30.0;
  double elevation = 20.0;
  bool parallel = false;
};
void addViewOptions(CLI::App& command, ViewOptions& options);
Camera makeCamera(const ViewOptions& options, const Scene& scene);

struct QualityOptions {
  std::string resolution = "640x360";
  std::uint32_t supersegments = 25;
  double samplesPerVoxel = 1.0;
  std::string algorithm = "bisection";
};
void addQualityOptions(CLI::App& command, QualityOptions& options);
GenerateSettings makeSettings(const QualityOptions& options);

/// The file's, or the default one over the data's range with a unit distance of a fiftieth of the scene's
/// diagonal.
TransferFunction makeTransferFunction(const std::string& file, const Scene& scene, const ScalarRange& range);

/// "640x360" or "96x96x96"; throws Error{InvalidArgument}.
std::vector<int> parseSizes(const std::string& text, std::size_t count);

}  // namespace vdi::apps
