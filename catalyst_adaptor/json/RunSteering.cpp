#include "catalyst_adaptor/json/RunSteering.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "vdi/core/Error.h"
#include "vdi/io/Files.h"

namespace vdi::catalyst {

namespace {

constexpr std::chrono::milliseconds waitingPause{50};

/// Moves nodes from the old range to another one, as ParaView rescales functions.
void rescale(std::vector<OpacityNode>& nodes, const std::array<double, 2>& range) {
  if (nodes.empty()) return;
  const double first = nodes.front().x;
  const double width = nodes.back().x - first;
  if (!(width > 0.0)) return;
  for (OpacityNode& node : nodes) node.x = range[0] + (range[1] - range[0]) * ((node.x - first) / width);
  nodes.back().x = range[1];
}

}  // namespace

stream::Controls RunSteering::controlsOf(const Steered& steered) const {
  const config::Run& run = steered.run;
  const config::RunColors& colors = run.fields.front().colors;
  stream::GeneratorControls generator;
  generator.resolution = {run.settings.width, run.settings.height};
  generator.supersegments = static_cast<int>(run.settings.supersegments);
  generator.samplingRate = run.settings.samplesPerVoxel;
  const std::optional<ScalarRange> range = colors.range ? colors.range : steered.range;
  if (range) {
    generator.range = {range->min, range->max};
    generator.presets = config::presetNames();
    const bool isDefault = colors.file.empty() && colors.preset.empty();
    generator.preset = isDefault ? generator.presets.front() : colors.preset;
  }
  stream::Controls controls;
  controls.generator = std::move(generator);
  controls.period = static_cast<int>(std::min<std::int64_t>(steered.schedule.period(), stream::maxPeriod));
  controls.paused = isPaused_;
  for (const Parameter& one : steered.parameters.all())
    controls.parameters.push_back({one.name, one.isWhole, one.value, one.low, one.high});
  return controls;
}

void RunSteering::apply(const stream::Wish& wish, const Steered& steered) {
  config::Run& run = steered.run;
  config::RunColors& colors = run.fields.front().colors;
  if (wish.camera) run.cameras.front().fixed = wish.camera;
  if (wish.resolution) {
    run.settings.width = (*wish.resolution)[0];
    run.settings.height = (*wish.resolution)[1];
  }
  if (wish.supersegments) run.settings.supersegments = static_cast<std::uint32_t>(*wish.supersegments);
  if (wish.samplingRate) run.settings.samplesPerVoxel = *wish.samplingRate;
  if (wish.preset) {  // keeps the range, and opacities that the run names
    if (!colors.range) colors.range = steered.range;
    colors.preset = *wish.preset;
    colors.file.clear();
    colors.map.reset();
  }
  if (wish.range) {
    colors.range = ScalarRange{(*wish.range)[0], (*wish.range)[1]};
    rescale(colors.opacities, *wish.range);
  }
  steered.parameters.set(wish.parameters);
  if (wish.period) steered.schedule.setPeriod(*wish.period);
  isPaused_ = wish.paused.value_or(isPaused_);
}

/// Reports a request. Called on the first rank.
void RunSteering::tell(const stream::SteeringRequest& request, const std::string& log, std::int64_t step,
                       double time) {
  fmt::print(stderr, "vdi_catalyst: step {}: {} (viewer {})\n", step, stream::summaryOf(request.wish),
             request.viewer);
  if (log.empty()) return;
  try {
    io::appendLine(log, stream::logEntryOf(request, step, time));
  } catch (const Error&) {  // reported at the end, when no other rank waits for this one
    trouble_ = std::current_exception();
  }
}

void RunSteering::requireLogged() {
  comm_.together([&] {
    if (trouble_) std::rethrow_exception(std::exchange(trouble_, nullptr));
  });
}

bool RunSteering::take(const Steered& steered, std::int64_t step, double time) {
  comm_.together([&] {
    if (stream_ != nullptr) stream_->setControls(controlsOf(steered));
  });
  std::optional<stream::SteeringRequest> request;
  while (true) {
    const std::chrono::milliseconds patience = isPaused_ ? waitingPause : std::chrono::milliseconds(0);
    if (stream_ != nullptr) {
      request = stream_->takeRequest(patience);
    } else {
      std::this_thread::sleep_for(patience);  // a waiting broadcast would keep a core busy
    }
    const std::string text =
        comm_.broadcastText([&] { return request ? stream::textOf(request->wish) : std::string(); }, 0);
    if (text.empty() && isPaused_) continue;
    if (text.empty()) return false;
    stream::Wish wish;
    comm_.together([&] {
      wish = stream::wishOf(text);
      apply(wish, steered);
    });
    const bool changesVdi = stream::changesVdi(wish);
    comm_.together([&] {
      if (stream_ == nullptr) return;
      stream_->setControls(controlsOf(steered));
      tell(*request, steered.run.stream->steeringLog, step, time);
    });
    if (changesVdi || !isPaused_) return changesVdi;
  }
}

}  // namespace vdi::catalyst
