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
#include "vdi/config/FilePattern.h"
#include "vdi/config/Orbit.h"
#include "vdi/core/Box.h"
#include "vdi/core/Camera.h"
#include "vdi/core/GenerateSettings.h"
#include "vdi/core/ScalarRange.h"
#include "vdi/core/TransferFunction.h"

namespace vdi::config {

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

/// With neither, it shows the whole scene along -z, as ParaView's filter has it.
struct RunCamera {
  std::string name;  // in files' names; empty: the run's only one
  std::optional<Camera> fixed;
  std::optional<RunOrbit> orbit;
};

/// What must hold of a field's values at a step of which a frame would be made. NaN doesn't count; infinite
/// values count for Max and Min alone.
struct RunCondition {
  enum class Measure { Max, Min, Mean, Change };  // Change: how far the mean has moved since the last frame
  Measure measure = Measure::Max;
  std::string field;
  std::optional<bool> cells;  // as Run has them
  int component = -1;
  std::optional<double> above;  // one of the two at least; both: above < below
  std::optional<double> below;
  bool holds(double value) const { return (!above || value > *above) && (!below || value < *below); }
};

/// What becomes of files of the run's names that exist when it starts.
enum class Existing { Refuse, Overwrite, Continue };

struct RunStream {
  std::string host = "127.0.0.1";
  std::uint16_t port = 0;                    // 0: one that is free
  std::string tokenFile;                     // empty: VDI_TOKEN, or a token of its own
  std::string linkFile = "vdi-stream.link";  // empty: the link isn't stored
  std::string certificate;
  std::string key;
  double megabits = 0.0;                           // a second, to each viewer; 0: no limit
  bool steer = false;                              // viewers may change the run
  std::string steeringLog = "vdi-steering.jsonl";  // gets a line for each change; empty: none
};

/// Files to which a record of each frame is appended; empty: none.
struct RunLogFiles {
  std::string json;
  std::string text;
  bool any() const { return !json.empty() || !text.empty(); }
};

/// Pictures of all viewpoints as a Cinema database, whose index is io::CinemaIndex.
struct RunCinema {
  std::filesystem::path folder;  // *.cdb
  FilePattern pictures;          // in it
  std::filesystem::path index() const { return folder / "data.csv"; }
};

struct Run {
  std::string field;
  std::optional<bool> cells;  // nothing: as the simulation hands the field over
  int component = -1;         // of a field of vectors; -1: their magnitude
  /// A frame is made when any of these three is due (Schedule), if `when` holds then.
  std::int64_t every = 1;              // steps whose number it divides; 0: none
  std::optional<double> everyTime;     // of the simulation
  std::optional<double> everySeconds;  // of the wall clock
  std::optional<RunCondition> when;
  std::optional<double> maxShare;  // of the run's wall time that making frames may take
  Existing existing = Existing::Refuse;
  std::vector<RunCamera> cameras{{}};  // one at least; the first is the stream's
  RunColors colors;
  GenerateSettings settings;
  std::optional<FilePattern> vdi;
  std::optional<FilePattern> png;
  std::optional<RunCinema> cinema;
  bool latest = false;  // latest.vdi and latest.png, beside the newest file, link it
  std::optional<RunStream> stream;
  RunLogFiles log;

  bool makesPictures() const { return png || cinema; }
  /// Of an orbiting camera; turned on with the frames.
  Orbit orbitAt(const RunOrbit& orbit, std::int64_t step, double time) const;
  /// `bounds` are the scene's.
  Camera cameraAt(const RunCamera& camera, std::int64_t step, double time, const Box& bounds) const;
  /// `map` is the colours' file's, if they name one; `range` is that of the first frame's values.
  TransferFunction transferFunction(const std::optional<ColorMap>& map, const ScalarRange& range,
                                    double unitDistance) const;
  /// The first file of this run's names that exists: of frames, of the Cinema database, or a log that isn't
  /// empty.
  std::optional<std::filesystem::path> firstExisting() const;
};

/// Throws Error{Io}, which names the first such file and the ways out, if the run refuses files that exist.
void requireNothingInTheWay(const Run& run);

/// The number of whole periods in a time, to within a millionth of a period.
double periodsIn(double time, double period);

/// The names of all presets, the default one first.
std::vector<std::string> presetNames();

/// Throws Error{Format} with the place of the first mistake. `name` is the document's.
Run parseRun(std::string_view text, const std::string& name);

/// The fields of each object in such a document, by the object's JSON pointer; "*" stands for an index.
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
