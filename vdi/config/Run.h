// The description of a run without a script: the file that docs/vdi-run.schema.json describes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "vdi/config/ColorMap.h"
#include "vdi/config/FilePattern.h"
#include "vdi/config/Orbit.h"
#include "vdi/core/Box.h"
#include "vdi/core/Camera.h"
#include "vdi/core/GenerateSettings.h"
#include "vdi/core/ScalarRange.h"
#include "vdi/core/TransferFunction.h"

namespace vdi::config {

struct RunColors {
  std::string preset;                // empty: the file's, or "Cool to Warm"
  std::string file;                  // a file of ParaView's presets; empty: none
  std::string name;                  // the preset's name in the file; empty: its only preset
  std::optional<ScalarRange> range;  // none: the range of the first frame's values
  // by values of the field; empty: the preset's, or a ramp from 0 to 1
  std::vector<OpacityNode> opacities;
  std::optional<double> unitDistance;  // world units; none: unitDistanceOf the first frame
  std::optional<ColorMap> map;         // the preset in `file`, once somebody has read it

  /// The transfer function. `first` is the range of the first frame's values.
  TransferFunction transferFunction(const ScalarRange& first, double firstUnitDistance) const;
};

/// An array that a run shows, and how.
struct RunField {
  std::string array;
  std::string name;             // as it appears in files' names; empty: the run's only field
  std::optional<bool> cells;    // none: as the simulation hands the array over
  int component = -1;           // of a vector field: one of them, or a special value of ComponentValues.h
  std::vector<double> missing;  // numbers that stand for missing values
  RunColors colors;
  Interpolation interpolation = Interpolation::Linear;
};

/// An orbit around the bounds of the field's blocks.
struct RunOrbit {
  Orbit start;              // at step 0
  double turn = 0.0;        // degrees of azimuth, from one frame to the next
  double viewAngle = 30.0;  // degrees
};

/// A run's camera. Without `fixed` and `orbit`, it shows the whole scene along -z, as ParaView's filter does.
struct RunCamera {
  std::string name;  // as it appears in file names; empty: the run's only camera
  std::optional<Camera> fixed;
  std::optional<RunOrbit> orbit;
};

/// A condition on a field's values that must hold at a step for a frame to be made. NaN doesn't count;
/// infinite values count only for Max and Min.
struct RunCondition {
  // Change: the distance that the mean has moved since the last frame
  enum class Measure { Max, Min, Mean, Change };
  Measure measure = Measure::Max;
  std::string field;
  std::optional<bool> cells;  // as in RunField
  int component = -1;
  std::vector<double> missing = {};
  std::optional<double> above;  // at least one of the two is set; both: above < below
  std::optional<double> below;
  bool holds(double value) const { return (!above || value > *above) && (!below || value < *below); }
};

/// The treatment of files with the run's names that exist when it starts.
enum class Existing { Refuse, Overwrite, Continue };

struct RunStream {
  std::string host = "127.0.0.1";
  std::uint16_t port = 0;                    // 0: a free one
  std::string tokenFile;                     // empty: VDI_TOKEN, or a new token
  std::string linkFile = "vdi-stream.link";  // empty: the link isn't stored
  std::string certificate;
  std::string key;
  std::vector<std::string> origins;                // of other sites' pages that may connect
  std::vector<std::string> embedIn;                // origins of sites that may show the page in a frame
  std::string title = "Live";                      // of the page and its tab
  double megabits = 0.0;                           // rate to each viewer in Mbit/s; 0: no limit
  bool steer = false;                              // viewers may change the run
  std::string steeringLog = "vdi-steering.jsonl";  // gets a line for each change; empty: none
};

/// Files to which a record of each frame is appended; empty: none.
struct RunLogFiles {
  std::string json;
  std::string text;
  bool any() const { return !json.empty() || !text.empty(); }
};

/// A run whose frames are made in separate processes, one per rank.
struct RunIsolation {
  bool restart = false;     // processes that have died are started again
  double patience = 300.0;  // seconds that the simulation waits for a frame; 0: it never waits
};

/// Pictures of all viewpoints as a Cinema database, whose index is io::CinemaIndex.
struct RunCinema {
  std::filesystem::path folder;  // *.cdb
  FilePattern pictures;          // in the folder
  std::filesystem::path index() const { return folder / "data.csv"; }
};

struct Run {
  std::vector<RunField> fields{{}};  // at least one; the first is the stream's
  /// A frame is made when any of these three is due (Schedule), if `when` holds at that step.
  std::int64_t every = 1;              // due at multiples of this step; 0: none
  std::optional<double> everyTime;     // period in the simulation's time
  std::optional<double> everySeconds;  // period in seconds of the wall clock
  std::optional<RunCondition> when;
  std::optional<double> maxShare;            // share of the run's wall time that frames may take
  std::optional<std::int64_t> maxDeviceMiB;  // device memory that a rank may hold
  std::optional<std::int64_t> maxHostMiB;    // host memory beyond which frames are left out
  Existing existing = Existing::Refuse;
  std::vector<RunCamera> cameras{{}};  // at least one; the first is the stream's
  GenerateSettings settings;           // of all fields, but for the interpolation
  std::optional<FilePattern> vdi;
  std::optional<FilePattern> png;
  std::optional<RunCinema> cinema;
  bool latest = false;  // link latest.vdi and latest.png, beside the newest file, to it
  std::optional<RunStream> stream;
  RunLogFiles log;
  std::optional<RunIsolation> isolation;  // none: frames are made in the simulation's processes

  bool makesPictures() const { return png || cinema; }
  GenerateSettings settingsOf(const RunField& field) const;
  /// The place of an orbiting camera, which turns with the frames.
  Orbit orbitAt(const RunOrbit& orbit, std::int64_t step, double time) const;
  /// The camera at a step. `bounds` are the scene's.
  Camera cameraAt(const RunCamera& camera, std::int64_t step, double time, const Box& bounds) const;
  /// The first existing file with one of this run's names: of frames, of the Cinema database, or a log that
  /// isn't empty.
  std::optional<std::filesystem::path> firstExisting() const;
};

/// Throws Error{Io} if the run refuses existing files and there is one. The error names the first one and the
/// remedies.
void requireNothingInTheWay(const Run& run);

/// The number of whole periods in a time, accurate to a millionth of a period.
double periodsIn(double time, double period);

/// The names of all presets, the default one first.
std::vector<std::string> presetNames();

/// Parses a run. Throws Error{Format} with the place of the first mistake. `name` is the document's.
Run parseRun(std::string_view text, const std::string& name);

/// The fields of each object in a run's document, by the object's JSON pointer; "*" matches any index.
const std::map<std::string, std::vector<std::string>>& runFields();

/// A run's text and its origin.
struct RunText {
  std::string text;
  std::string name;              // the document's name, for messages
  std::filesystem::path folder;  // the files that it names are relative to this folder
};
/// Reads a run's text. `fileOrText` is the text itself if its first character that isn't blank is a brace,
/// else a file's name. Throws Error as readJsonText.
RunText readRun(const std::string& fileOrText);
/// The text of the file that the colours name. Throws Error as readJsonText.
std::string readColorsFile(const RunColors& colors, const RunText& source);

}  // namespace vdi::config
