#include "vdi/stream/Steering.h"

#include <fmt/format.h>
#include <fmt/ranges.h>  // fmt::join

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "vdi/core/GenerateSettings.h"

namespace vdi::stream {

namespace {

std::string objectionTo(const std::string& name, double value, const std::vector<Parameter>& parameters) {
  const auto found = std::ranges::find(parameters, name, &Parameter::name);
  if (found == parameters.end()) return fmt::format("the simulation has no parameter \"{}\"", name);
  if (!(value >= found->low && value <= found->high))
    return fmt::format("\"{}\" must be from {} to {}", name, found->low, found->high);
  if (found->isWhole && value != std::nearbyint(value))
    return fmt::format("\"{}\" must be a whole number", name);
  return {};
}

template <typename Value>
void replace(std::optional<Value>& value, const std::optional<Value>& later) {
  if (later) value = later;
}

}  // namespace

bool isParameterName(std::string_view name) {
  constexpr std::string_view letters = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-.";
  return !name.empty() && name.size() <= maxNameBytes &&
         name.find_first_not_of(letters) == std::string_view::npos;
}

bool changesVdi(const Wish& wish) {
  return wish.camera || wish.resolution || wish.supersegments || wish.samplingRate || wish.range ||
         wish.preset;
}

std::string objectionTo(const Wish& wish, const Controls& controls) {
  if (changesVdi(wish) && !controls.generator) return "the VDIs aren't made where they are served";
  if (wish.range && !controls.generator->range) return "the VDIs have no colour map";
  if (wish.preset) {
    const std::vector<std::string>& presets = controls.generator->presets;
    if (std::ranges::find(presets, *wish.preset) == presets.end()) return "no colour map has that name";
  }
  for (const auto& [name, value] : wish.parameters) {
    std::string objection = objectionTo(name, value, controls.parameters);
    if (!objection.empty()) return objection;
  }
  return {};
}

void merge(Wish& wish, const Wish& later) {
  replace(wish.camera, later.camera);
  replace(wish.resolution, later.resolution);
  replace(wish.supersegments, later.supersegments);
  replace(wish.samplingRate, later.samplingRate);
  replace(wish.range, later.range);
  replace(wish.preset, later.preset);
  replace(wish.period, later.period);
  replace(wish.paused, later.paused);
  for (const auto& [name, value] : later.parameters) wish.parameters[name] = value;
}

std::string summaryOf(const Wish& wish) {
  std::vector<std::string> parts;
  for (const auto& [name, value] : wish.parameters) parts.push_back(fmt::format("{} = {}", name, value));
  if (wish.camera) {
    const glm::dvec3& at = wish.camera->position;
    parts.push_back(fmt::format("viewpoint ({:.6g}, {:.6g}, {:.6g})", at.x, at.y, at.z));
  }
  if (wish.resolution)
    parts.push_back(fmt::format("resolution {}x{}", (*wish.resolution)[0], (*wish.resolution)[1]));
  if (wish.supersegments) parts.push_back(fmt::format("supersegments {}", *wish.supersegments));
  if (wish.samplingRate) {
    parts.push_back(*wish.samplingRate == automaticRate
                        ? "automatic sampling rate"
                        : fmt::format("sampling rate {}", *wish.samplingRate));
  }
  if (wish.preset) parts.push_back(fmt::format("colours \"{}\"", *wish.preset));
  if (wish.range)
    parts.push_back(fmt::format("colours from {:.6g} to {:.6g}", (*wish.range)[0], (*wish.range)[1]));
  if (wish.period) parts.push_back(fmt::format("a VDI every {} steps", *wish.period));
  if (wish.paused) parts.emplace_back(*wish.paused ? "pause" : "continue");
  return fmt::format("{}", fmt::join(parts, ", "));
}

void Wishes::put(std::uint32_t viewer, const Wish& wish) {
  {
    const std::scoped_lock lock(mutex_);
    if (!request_) request_.emplace();
    request_->viewer = viewer;
    merge(request_->wish, wish);
  }
  changed_.notify_all();
}

std::optional<SteeringRequest> Wishes::take(std::chrono::milliseconds patience) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, patience, [this] { return request_.has_value(); });
  return std::exchange(request_, std::nullopt);
}

}  // namespace vdi::stream
