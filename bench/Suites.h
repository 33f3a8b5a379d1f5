// Options of `vdi bench`, and the suites of docs/benchmarks.md.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "apps/Source.h"
#include "vdi/comm/Communicator.h"
#include "vdi/core/Reconstruction.h"

namespace vdi::bench {

struct BenchOptions {
  std::vector<std::string> raws;
  std::vector<std::string> fields;
  apps::DecompositionOptions decomposition;
  apps::ViewOptions view;
  apps::QualityOptions quality;
  std::vector<double> angles{0.0, 5.0, 10.0, 20.0, 30.0, 40.0, 50.0};
  std::vector<std::string> algorithms;       // empty: merge, or the suite's
  std::vector<std::uint32_t> supersegments;  // empty: 25, or the suite's
  int views = 0;                             // 0: 1, or the suite's
  int repeats = 5;
  int frames = 20;  // on the orbit for VDIs per second; 0: not measured
  std::string reconstruction = toString(Reconstruction::Smooth);  // as in moving windows
  double truthRate = 8.0;  // samples per voxel of the truth, with which all views are compared
  std::string suite;       // empty, or a name that suiteNames() has
  std::string rival;       // empty, or icet
  std::string output;
  std::vector<std::string> comparison;
  // For the suite `ranks`:
  std::vector<std::string> scalings{"strong", "weak"};
  std::vector<std::string> layouts{"slabs", "interleaved", "random"};
  std::vector<int> rankCounts;  // empty: 1, 2, 4 ... and all
  std::string sizePerRank;      // in weak scaling; empty: half of decomposition.size on each axis
  // For the suite `viewpoints`:
  int viewpoints = 100;
  double turn = 20.0;  // degrees
  std::vector<double> zooms{1.0, 4.0};
  std::vector<double> margins{0.0};
  std::vector<std::string> listResolutions;  // the VDIs' resolutions; empty: those of the views
  // For the suite `stream`, which uses `turn` and `frames`, too:
  std::vector<std::string> rates{"1Gbit", "100Mbit"};  // to the viewer
  double period = 33.0;                                // milliseconds between two frames
};

struct DataSet {
  std::string name;
  std::string field;  // empty: `raw` is set
  std::string raw;    // sidecar
  std::string size;
  std::string type;
};

const std::vector<std::string>& suiteNames();

/// The suite that varies the number of ranks. It has no data sets of its own.
inline constexpr const char* ranksSuite = "ranks";
/// The suite of viewpoints around the scene. It has no data sets of its own.
inline constexpr const char* viewpointsSuite = "viewpoints";
/// The suite that sends frames to a viewer. It has no data sets of its own.
inline constexpr const char* streamSuite = "stream";

/// Completes the options with the suite's values, or with the defaults without a suite.
void applySuite(BenchOptions& options);

/// The suite's data sets, of which --fields may choose some, or the options' raw volumes and
/// fields.
std::vector<DataSet> dataSets(const BenchOptions& options);

/// Settings of a VDI. Bisection gets List, the only budget that it supports.
GenerateSettings benchSettings(const BenchOptions& options, const std::string& algorithm,
                               std::uint32_t supersegments);

/// Returns this rank's blocks of the data set, with the data set's size and type if it has them.
/// Collective: if one rank throws, all do.
std::vector<Block> blocksOf(const DataSet& set, const BenchOptions& options,
                            const std::shared_ptr<gpu::Device>& device, const comm::Communicator& world);

}  // namespace vdi::bench
