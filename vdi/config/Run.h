// What a simulation has made of its data without a script: the file that docs/vdi-run.schema.json describes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "vdi/config/ColorMap.h"
#include "vdi/config/Orbit.h"
#include "vdi/core/Box.h"
#include "vdi/core/Camera.h"
#include "vdi/core/GenerateSettings.h"
#include "vdi/core/ScalarRange.h"
#include "vdi/core/TransferFunction.h"

namespace vdi::config {

/// A file's name with the step's number in it, as ParaView's extractors have it: "{timestep}", or
/// "{timestep:06d}" for six digits at least.
class FilePattern {
 public:
  /// Throws std::invalid_argument with the reason: not just one number, other braces, no file's name.
  explicit FilePattern(const std::string& text);
  std::filesystem::path path(std::int64_t step) const;

 private:
  std::string front_;
  std::string back_;
  int digits_ = 1;
};

struct RunColors {
  std::string preset;                  // empty: the file's, or "Cool to Warm"
  std::string file;                    // of ParaView's presets; empty: none
  std::string name;                    // of the preset in the file; empty: its only one
  std::optional<ScalarRange> range;    // nothing: of the first frame's values
  std::vector<OpacityNode> opacities;  // x: values of the field; empty: the preset's, or from 0 to 1
  std::optional<double> unitDistance;  // world; nothing: unitDistanceOf
};

/// An orbit around what the field's blocks cover.
struct RunOrbit {
  Orbit start;              // at step 0
  double turn = 0.0;        // degrees of azimuth, from one frame to the next
  double viewAngle = 30.0;  // degrees
};

struct RunStream {
  std::string host = "127.0.0.1";
  std::uint16_t port = 0;                    // 0: one that is free
  std::string tokenFile;                     // empty: VDI_TOKEN, or a token of its own
  std::string linkFile = "vdi-stream.link";  // empty: the link isn't stored
  std::string certificate;
  std::string key;
  double megabits = 0.0;  // a second, to each viewer; 0: no limit
};

/// Files to which a record of each frame is appended; empty: none.
struct RunLogFiles {
  std::string json;
  std::string text;
  bool any() const { return !json.empty() || !text.empty(); }
};

struct Run {
  std::string field;
  std::optional<bool> cells;  // nothing: as the simulation hands the field over
  int component = -1;         // of a field of vectors; -1: their magnitude
  std::int64_t every = 1;     // a frame at steps that this divides
  std::optional<Camera> camera;
  std::optional<RunOrbit> orbit;  // neither: the whole scene along -z, as ParaView's filter has it
  RunColors colors;
  GenerateSettings settings;
  std::optional<FilePattern> vdi;
  std::optional<FilePattern> png;
  bool latest = false;  // latest.vdi and latest.png, beside the newest file, link it
  std::optional<RunStream> stream;
  RunLogFiles log;

  bool wants(std::int64_t step) const { return step % every == 0; }
  /// `step` is one that it wants; `bounds` are the scene's.
  Camera cameraAt(std::int64_t step, const Box& bounds) const;
  /// `map` is the colours' file's, if they name one; `range` is that of the first frame's values.
  TransferFunction transferFunction(const std::optional<ColorMap>& map, const ScalarRange& range,
                                    double unitDistance) const;
};

/// Throws Error{Format} with the place of the first mistake. `name` is the document's.
Run parseRun(std::string_view text, const std::string& name);

/// The fields of each object in such a document, by the object's JSON pointer.
const std::map<std::string, std::vector<std::string>>& runFields();

/// A run's text, and where it comes from.
struct RunText {
  std::string text;
  std::string name;              // of the document, for messages
  std::filesystem::path folder;  // to which the files that it reads are relative
};
/// `fileOrText` is the text itself if its first character that isn't blank is a brace, else a file's name.
/// Throws Error as readJsonText.
RunText readRun(const std::string& fileOrText);
/// The text of the colours' file; nothing if they name none. Throws Error as readJsonText.
std::optional<std::string> readColorsFile(const Run& run, const RunText& source);

}  // namespace vdi::config
