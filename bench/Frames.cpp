#include "bench/Frames.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cassert>

namespace vdi::bench {

using nlohmann::json;

namespace {

struct StageSource {
  const char* name;
  double RankReport::*wall;
  double RankReport::*device;  // null: not reported
};

/// The reports' times of each stage, indexed by FrameStage. Only this table names the device times.
constexpr std::array<StageSource, frameStages> sources{
    {{"generate", &RankReport::generateSeconds, &RankReport::generateDeviceSeconds},
     {"distribute", &RankReport::distributeSeconds, nullptr},
     {"composite", &RankReport::compositeSeconds, &RankReport::compositeDeviceSeconds},
     {"gather", &RankReport::gatherSeconds, nullptr}}};

RankTimes over(const std::vector<RankReport>& reports, double RankReport::*seconds) {
  RankTimes times;
  for (const RankReport& report : reports) {
    times.slowest = std::max(times.slowest, 1e3 * report.*seconds);
    times.mean += 1e3 * report.*seconds / static_cast<double>(reports.size());
  }
  return times;
}

json toJson(const RankTimes& times) {
  return {{"slowest", times.slowest}, {"mean", times.mean}};
}

json toJson(const StageTimes& stage) {
  return {{"wall_ms", toJson(stage.wall)},
          {"device_ms", stage.device ? toJson(*stage.device) : json(nullptr)}};
}

void addStageLines(std::string& text, const char* of, const std::array<StageTimes, frameStages>& stages) {
  for (std::size_t i = 0; i < frameStages; ++i) {
    const StageTimes& stage = stages[i];
    text += fmt::format("  {:<20}{:>6.3f}{:>10.3f}", fmt::format("{}{}", of, sources[i].name),
                        stage.wall.slowest, stage.wall.mean);
    text += stage.device ? fmt::format("{:>16.3f}{:>10.3f}\n", stage.device->slowest, stage.device->mean)
                         : fmt::format("{:>16}{:>10}\n", "-", "-");
  }
}

}  // namespace

void FrameLog::add(double wallMs, const std::vector<RankReport>& reports) {
  if (reports.empty()) return;
  FrameTimes frame;
  frame.wallMs = wallMs;
  for (std::size_t i = 0; i < frameStages; ++i) {
    frame.stages[i].wall = over(reports, sources[i].wall);
    if (sources[i].device != nullptr) frame.stages[i].device = over(reports, sources[i].device);
  }
  frames_.push_back(frame);
  ranks_ = static_cast<int>(reports.size());
  subSupersegments_ = 0;
  bytesSent_ = 0;
  for (const RankReport& report : reports) {
    subSupersegments_ += report.subSupersegments;
    bytesSent_ += report.bytesSent;
  }
}

FrameFigures FrameLog::figures(std::size_t repeats) const {
  FrameFigures figures;
  if (frames_.empty()) return figures;
  assert(repeats >= 1 && repeats <= frames_.size());
  const auto middle = [&](auto value) {
    std::vector<double> values;
    for (std::size_t i = frames_.size() - repeats; i < frames_.size(); ++i)
      values.push_back(value(frames_[i]));
    return spreadOf(std::move(values));
  };
  figures.ranks = ranks_;
  figures.wall = middle([](const FrameTimes& frame) { return frame.wallMs; });
  for (std::size_t i = 0; i < frameStages; ++i) {
    StageTimes& stage = figures.stages[i];
    stage.wall = {middle([i](const FrameTimes& frame) { return frame.stages[i].wall.slowest; }).median,
                  middle([i](const FrameTimes& frame) { return frame.stages[i].wall.mean; }).median};
    if (!frames_.back().stages[i].device) continue;
    stage.device = {middle([i](const FrameTimes& frame) { return frame.stages[i].device->slowest; }).median,
                    middle([i](const FrameTimes& frame) { return frame.stages[i].device->mean; }).median};
  }
  figures.subSupersegments = subSupersegments_;
  figures.bytesSent = bytesSent_;
  return figures;
}

void FrameFigures::takePictures(const FrameFigures& pictures) {
  volumeRendering = pictures.wall;
  pictureStages = pictures.stages;
}

double vdisPerSecond(VdiGenerator& generator, ClockRaiser& clock, const FrameInput& input, int frames) {
  assert(frames >= 1);
  constexpr int orbit = 20;
  const auto start = [&](int frame) {
    return generator.start(input.camera.azimuth(360.0 * frame / orbit), input.function, input.settings);
  };
  clock.run();
  {  // Make two frames first: two VDIs hold memory at once.
    VdiFrame first = start(orbit - 2);
    generator.finish(start(orbit - 1));
    generator.finish(std::move(first));
  }
  const double milliseconds = readyMs(generator.communicator(), [&] {
    VdiFrame last = start(0);
    for (int frame = 1; frame < frames; ++frame) {
      VdiFrame next = start(frame);
      generator.finish(std::move(last));
      last = std::move(next);
    }
    generator.finish(std::move(last));
  });
  return 1e3 * frames / milliseconds;
}

Spread measureShown(VdiGenerator& generator, const std::shared_ptr<gpu::Device>& device, ClockRaiser& clock,
                    const FrameInput& input, int repeats) {
  const comm::Communicator& comm = generator.communicator();
  std::optional<VdiRenderer> renderer;
  comm.together([&] {
    if (comm.rank() == 0) renderer.emplace(device);
  });
  return repeated(repeats, [&] {
    clock.run();
    return readyMs(comm, [&] {
      generator.show(renderer ? &*renderer : nullptr, input.camera, input.function, input.settings);
      comm.together([&] {
        if (!renderer) return;
        renderer->renderBytes(input.camera, input.settings.width, input.settings.height, Alpha::Premultiplied,
                              Reconstruction::Smooth);
      });
    });
  });
}

FrameFigures measureFrames(VdiGenerator& generator, const std::shared_ptr<gpu::Device>& device,
                           ClockRaiser& clock, const FrameInput& input, int repeats, int orbitFrames) {
  const comm::Communicator& comm = generator.communicator();
  FrameLog pictureLog;
  repeated(repeats, [&] {
    clock.run();
    const double milliseconds =
        readyMs(comm, [&] { generator.renderVolume(input.camera, input.function, input.settings); });
    pictureLog.add(milliseconds, generator.reports());
    return milliseconds;
  });
  FrameLog log;
  repeated(repeats, [&] {
    clock.run();
    const double milliseconds =
        readyMs(comm, [&] { generator.generate(input.camera, input.function, input.settings); });
    log.add(milliseconds, generator.reports());
    return milliseconds;
  });
  FrameFigures figures = log.figures(static_cast<std::size_t>(repeats));
  figures.takePictures(pictureLog.figures(static_cast<std::size_t>(repeats)));
  figures.shown = measureShown(generator, device, clock, input, repeats);
  if (orbitFrames > 0) {
    figures.orbitFrames = orbitFrames;
    figures.vdisPerSecond = vdisPerSecond(generator, clock, input, orbitFrames);
  }
  return figures;
}

std::string stageLines(const FrameFigures& figures) {
  std::string text;
  if (figures.ranks > 1) {
    text += fmt::format("  {:<12}{:>14}{:>10}{:>16}{:>10}\n", "stage", "wall: slowest", "mean",
                        "device: slowest", "mean");
    addStageLines(text, "", figures.stages);
    addStageLines(text, "picture: ", figures.pictureStages);
  }
  text += fmt::format("  whole frame {:.3f} ms, shown {:.3f} ms, volume rendering {:.3f} ms",
                      figures.wall.median, figures.shown.median, figures.volumeRendering.median);
  if (figures.vdisPerSecond)
    text += fmt::format("; {:.2f} VDIs/s over {} frames", *figures.vdisPerSecond, figures.orbitFrames);
  if (figures.ranks > 1) {
    text += fmt::format("; sent {:.2f} MiB, {:.2f} M sub-supersegments",
                        static_cast<double>(figures.bytesSent) / (1 << 20),
                        1e-6 * static_cast<double>(figures.subSupersegments));
  }
  return text + "\n";
}

void addSettings(json& row, const GenerateSettings& settings) {
  row["algorithm"] = toString(settings.algorithm);
  row["precision"] = toString(settings.precision);
  row["supersegments"] = settings.supersegments;
  row["budget"] = toString(settings.budget);
  row["fill"] = settings.fill;
  row["width"] = settings.width;
  row["height"] = settings.height;
  row["margin"] = settings.margin;
  row["sampling_rate"] = settings.samplesPerVoxel;
}

void addFigures(json& row, const FrameFigures& figures) {
  const bool several = figures.ranks > 1;
  row["ranks"] = figures.ranks;
  row["frame_ms"] = figures.wall.median;
  row["frame_spread_ms"] = figures.wall.width();
  row["shown_ms"] = figures.shown.median;
  row["volume_rendering_ms"] = figures.volumeRendering.median;
  row["vdis_per_second"] = figures.vdisPerSecond ? json(*figures.vdisPerSecond) : json(nullptr);
  row["orbit_frames"] = figures.orbitFrames;
  row["sub_supersegments"] = figures.subSupersegments;
  row["bytes_sent"] = figures.bytesSent;
  json stages = json::object();
  json pictureStages = json::object();
  for (std::size_t i = 0; i < frameStages; ++i) {
    const StageTimes& stage = figures.stages[i];
    const bool ran = several || i == static_cast<std::size_t>(FrameStage::Generate);
    // generate_ms is the device's time, for compatibility with older files. The row has it already.
    if (i != static_cast<std::size_t>(FrameStage::Generate))
      row[std::string(sources[i].name) + "_ms"] = ran ? json(stage.wall.slowest) : json(nullptr);
    if (!ran) continue;
    stages[sources[i].name] = toJson(stage);
    pictureStages[sources[i].name] = toJson(figures.pictureStages[i]);
  }
  row["stages"] = std::move(stages);
  row["picture_stages"] = std::move(pictureStages);
}

}  // namespace vdi::bench
