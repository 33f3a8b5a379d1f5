// The settings of a running simulation, and of its VDIs, that a viewer may change.
#pragma once

#include <array>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "vdi/core/Camera.h"

namespace vdi::stream {

/// The most parameters that a simulation can offer, and the most bytes of a name.
inline constexpr std::size_t maxParameters = 64;
inline constexpr std::size_t maxNameBytes = 64;
inline constexpr int maxPeriod = 1'000'000;

/// 1 to maxNameBytes letters, digits, "_", "-" and ".".
bool isParameterName(std::string_view name);

/// A number that the simulation reads at each step.
struct Parameter {
  std::string name;      // isParameterName
  bool isWhole = false;  // takes whole numbers only
  double value = 0.0;    // in force
  double low = 0.0;      // finite bounds, both included
  double high = 0.0;
  bool operator==(const Parameter&) const = default;
};

/// The controls of the generator that makes the VDIs.
struct GeneratorControls {
  std::array<int, 2> resolution{};             // as set: 0 is a view's, or the default
  int supersegments = 0;                       // N_S
  std::optional<std::array<double, 2>> range;  // of the colour map, if there is one
  std::vector<std::string> presets;            // names of colour maps to choose from
  std::optional<double> samplingRate;          // samples per voxel, 0: automatic; older servers don't say
  std::optional<std::string> preset;           // in force, "" if it has no name; older servers don't say
  bool operator==(const GeneratorControls&) const = default;
};

/// The settings that can be steered, as they are in force.
struct Controls {
  std::optional<GeneratorControls> generator;  // none: the VDIs come from elsewhere
  int period = 1;                              // a VDI is made every `period` steps
  bool paused = false;                         // the simulation waits
  std::vector<Parameter> parameters;
  bool operator==(const Controls&) const = default;
};

/// A viewer's request. Fields that it leaves out stay unchanged.
struct Wish {
  std::optional<Camera> camera;                  // a viewpoint V_O that View accepts
  std::optional<std::array<int, 2>> resolution;  // 1 to View::maxSide
  std::optional<int> supersegments;              // 1 to vdi::maxSupersegments
  std::optional<double> samplingRate;            // within the range of the table of settings
  std::optional<std::array<double, 2>> range;    // finite, rising
  std::optional<std::string> preset;             // one of GeneratorControls::presets
  std::optional<int> period;                     // 1 to maxPeriod
  std::optional<bool> paused;
  std::map<std::string, double> parameters;  // at most maxParameters

  bool isEmpty() const { return *this == Wish{}; }
  bool operator==(const Wish&) const = default;
};

/// Whether the wish changes the VDIs of the same step.
bool changesVdi(const Wish& wish);
/// The reason why the wish can't be granted under these controls; empty if it can.
std::string objectionTo(const Wish& wish, const Controls& controls);
/// Merges a later wish into `wish`. The later one wins.
void merge(Wish& wish, const Wish& later);

struct SteeringRequest {
  std::uint32_t viewer = 0;  // the viewer that asked last
  Wish wish;                 // all wishes since the last take()
};

/// A wish as text and back, for other ranks. These three are in SteeringJson.cpp.
std::string textOf(const Wish& wish);
/// Reads a text that textOf has made. Throws Error{Format} for other texts.
Wish wishOf(std::string_view text);
/// A line of the steering log, one JSON object: {"step":…,"time":…,"viewer":…,"steer":{…}}.
std::string logEntryOf(const SteeringRequest& request, std::int64_t step, double time);
/// The wish in words for people, such as "feed = 0.04, viewpoint (1, 2, 3)".
std::string summaryOf(const Wish& wish);

/// Carries wishes from the network's thread to the simulation's. Merges waiting wishes into one request.
class Wishes {
 public:
  /// Never waits.
  void put(std::uint32_t viewer, const Wish& wish);
  /// Waits `patience` at most for a request; nullopt if none came.
  std::optional<SteeringRequest> take(std::chrono::milliseconds patience);

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<SteeringRequest> request_;
};

}  // namespace vdi::stream
