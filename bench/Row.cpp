#include "bench/Row.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <cmath>

namespace vdi::bench {

using nlohmann::json;

namespace {

json finiteOrNull(double value) {
  return std::isfinite(value) ? json(value) : json(nullptr);
}

}  // namespace

std::string tableHead() {
  return fmt::format(
      "{:<22} {:<9} {:>3} {:>4} {:>5} {:>9} {:>9} {:>6} {:>9} {:>6} {:>9} {:>7} {:>7} {:>8} {:>8}",
      "data set", "algorithm", "N_S", "view", "angle", "DVR", "generate", "/ DVR", "render", "faster",
      "composite", "SSIM", "PSNR", "DVR SSIM", "stored");
}

std::string tableLine(const BenchRow& row) {
  return fmt::format(
      "{:<22} {:<9} {:>3} {:>4g} {:>5g} {:>9.3f} {:>9.3f} {:>6.2f} {:>9.3f} {:>6.2f} {:>9.3f} "
      "{:>7.4f} {:>7.2f} {:>8.4f} {:>8.2f}",
      row.dataset, toString(row.settings.algorithm), row.settings.supersegments, row.viewDegrees,
      row.angleDegrees, row.dvr.device.median, row.generation.device.median, row.generation.overDvr.median,
      row.view.device.median, row.view.dvrOverDevice,
      row.generation.frames.stage(FrameStage::Composite).wall.slowest, row.view.fromTruth.ssim,
      row.view.fromTruth.psnrDb, row.dvr.fromTruth.ssim,
      static_cast<double>(row.generation.storedBytes) / (1 << 20));
}

json toJson(const BenchRow& row) {
  json object{
      {"dataset", row.dataset},
      {"reconstruction", toString(row.reconstruction)},
      {"truth_rate", row.truthRate},
      {"upload_ms", row.upload.milliseconds},
      {"step_ms", row.upload.stepMs ? json(*row.upload.stepMs) : json(nullptr)},
      {"view_deg", row.viewDegrees},
      {"angle_deg", row.angleDegrees},
      {"dvr_ms", row.dvr.device.median},
      {"dvr_spread_ms", row.dvr.device.width()},
      {"dvr_frame_ms", row.dvr.frame.median},
      {"dvr_ssim", row.dvr.fromTruth.ssim},
      {"dvr_psnr_db", finiteOrNull(row.dvr.fromTruth.psnrDb)},
      {"generate_ms", row.generation.device.median},
      {"generate_spread_ms", row.generation.device.width()},
      {"generate_over_dvr", row.generation.overDvr.median},
      {"dvr_over_render", row.generation.frames.ranks == 1 ? json(row.view.dvrOverDevice) : json(nullptr)},
      {"generate_frame_ms", row.generation.frame.median},
      {"generate_search_ms", row.generation.countMs},
      {"generate_write_ms", row.generation.writeMs},
      {"render_ms", row.view.device.median},
      {"render_frame_ms", row.view.frame.median},
      {"render_spread_ms", row.view.device.width()},
      {"ssim", row.view.fromTruth.ssim},
      {"psnr_db", finiteOrNull(row.view.fromTruth.psnrDb)},
      {"supersegment_count", row.generation.supersegments},
      {"stored_bytes", row.generation.storedBytes}};
  addSettings(object, row.settings);
  addFigures(object, row.generation.frames);
  if (row.rival) addRival(object, *row.rival);
  return object;
}

}  // namespace vdi::bench
