// Options that several subcommands share: the volume, the view and the settings.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/Cameras.h"
#include "vdi/config/Orbit.h"
#include "vdi/core/Camera.h"
#include "vdi/core/Coloring.h"
#include "vdi/core/GenerateSettings.h"
#include "vdi/core/Scene.h"
#include "vdi/core/TransferFunction.h"
#include "vdi/gpu/Device.h"
#include "vdi/synthetic/Decomposition.h"

namespace CLI {
class App;
}

namespace vdi::apps {

/// How a volume is cut into blocks and assigned to ranks.
struct DecompositionOptions {
  std::string size = "96x96x96";
  std::string copies = "1x1x1";
  std::string type = "f32";
  std::uint32_t seed = 1;
  std::string blocks = "2x2x2";
  std::string layout = "interleaved";
  std::string joint;            // empty: the raw volume's, or shared points
  std::vector<double> missing;  // numbers that stand for missing values, beside the raw volume's
};
void addDecompositionOptions(CLI::App& command, DecompositionOptions& options);

/// Makes the blocks of a procedural field that `rank` of `ranks` holds, on the rank's device.
/// Copies of the field share memory. Throws Error.
std::vector<Block> fieldBlocks(const std::string& field, const DecompositionOptions& options,
                               const std::shared_ptr<gpu::Device>& device, int rank, int ranks);
/// The blocks of a raw volume, with the sidecar's size and type. Throws Error.
std::vector<Block> rawBlocks(const std::string& sidecar, const DecompositionOptions& options, int rank,
                             int ranks);
/// The name of the blocks' scalars in a VDI's file: the field's name, or the sidecar's file name
/// without extension. Throws Error.
ScalarArray fieldArray(const std::string& field, const DecompositionOptions& options);
ScalarArray rawArray(const std::string& sidecar);
/// "name: description" of each field, for --help.
std::string fieldsHelp();

/// A camera's given properties. The others come from a file or another camera.
struct CameraOptions {
  std::string file;
  std::vector<double> position;    // 3, or none
  std::vector<double> focalPoint;  // 3, or none
  std::vector<double> viewUp;      // 3, or none
  std::optional<double> viewAngle;
  std::optional<double> parallelScale;
};
void addCameraOptions(CLI::App& command, CameraOptions& options, const std::string& otherwise);
/// Returns the file's camera, or `otherwise` without a file, with the given properties.
Camera chosenCamera(const CameraOptions& options, const Camera& otherwise);

/// A viewpoint on an orbit around the scene, unless the camera is given.
struct ViewOptions {
  CameraOptions camera;
  config::Orbit orbit{.azimuth = 30.0, .elevation = 20.0};
  bool parallel = false;
};
void addViewOptions(CLI::App& command, ViewOptions& options);
Camera makeCamera(const ViewOptions& options, const Scene& scene);

struct QualityOptions {
  std::string resolution = "640x360";
  /// The settings of the table. The other members hold the rest, and makeSettings combines both.
  GenerateSettings settings{.samplesPerVoxel = automaticRate};
  std::string lights = "kit";
  std::vector<double> crop;  // 6, or none
  std::vector<double> clip;  // 6 for each plane
  std::string blend = "composite";
  std::vector<double> isovalues;
  std::string transferFunction = "three-hues";  // a preset or a file
  std::optional<double> unitDistance;
};
/// Several: the command chooses numbers of supersegments and algorithms itself.
enum class QualityUse { One, Several };
void addQualityOptions(CLI::App& command, QualityOptions& options, QualityUse use = QualityUse::One);
GenerateSettings makeSettings(const QualityOptions& options);
/// Presets stretch over the data's range. Their unit distance is a fiftieth of the scene's
/// diagonal.
TransferFunction makeTransferFunction(const QualityOptions& options, const Scene& scene,
                                      const ScalarRange& range);

/// Adds the option for planes that clip a volume or a view of a VDI: six numbers each, a point and
/// the normal.
void addClipOption(CLI::App& command, std::vector<double>& numbers, const char* group);
std::vector<ClipPlane> makeClipPlanes(const std::vector<double>& numbers);

/// Adds the option for views of a VDI: a name that reconstructionFromString knows.
void addReconstructionOption(CLI::App& command, std::string& name);

/// Adds a suffix to a path: folder/picture.png with the suffix 20deg is folder/picture_20deg.png.
std::filesystem::path withSuffix(const std::filesystem::path& path, const std::string& suffix);

/// Parses "640x360" or "96x96x96"; throws Error{InvalidArgument}.
std::vector<int> parseSizes(const std::string& text, std::size_t count);

}  // namespace vdi::apps
