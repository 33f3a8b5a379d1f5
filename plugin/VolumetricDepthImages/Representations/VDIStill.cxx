#include "VDIStill.h"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <thread>
#include <utility>

#include "vdi/core/Ready.h"

namespace pv {

namespace {

using Clock = std::chrono::steady_clock;

double secondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// The longest time that another thread waits for the renderer.
constexpr double stripSeconds = 0.03;
/// The length of a pause, and the time between two checks whether it is over.
constexpr std::chrono::milliseconds restTime{500};
constexpr std::chrono::milliseconds restStep{5};
/// Rows of the renderer's tiles.
constexpr int tileRows = 8;

}  // namespace

void VDIStill::start(vdi::VdiRenderer& renderer, StillView view) {
  this->drop();
  view_ = std::move(view);
  has_ = true;
  restEnd_ = Clock::time_point{};
  job_ = std::async(std::launch::async, [this, &renderer] { this->make(renderer); });
}

void VDIStill::make(vdi::VdiRenderer& renderer) {
  Clock::time_point start = Clock::now();  // moved on by each pause
  const auto width = static_cast<std::size_t>(view_.size.x);
  const bool hasObjects = std::any_of(view_.window.begin(), view_.window.end(), isObject);
  std::vector<float> ends(hasObjects ? view_.window.size() : 0);
  if (hasObjects) depthsOf(view_.matrices, view_.window, view_.size, view_.size, ends);
  pixels_.resize(view_.window.size());
  renderer.setClipPlanes(view_.planes);
  int rows = tileRows;
  for (int row = 0; row < view_.size.y && !isDropped_;) {
    if (Clock::now() < restEnd_.load()) {
      const Clock::time_point restStart = Clock::now();
      std::this_thread::sleep_for(restStep);
      start += Clock::now() - restStart;
      continue;
    }
    rows = std::min(rows, view_.size.y - row);
    const Clock::time_point stripStart = Clock::now();
    const std::size_t first = width * static_cast<std::size_t>(row);
    const std::size_t count = width * static_cast<std::size_t>(rows);
    const auto stripEnds =
        hasObjects ? std::span<const float>(ends).subspan(first, count) : std::span<float>();
    const vdi::ImageBytes strip = renderer.renderBytes(view_.matrices.rows(view_.size, row, rows), stripEnds,
                                                       vdi::Alpha::Premultiplied, view_.reconstruction);
    std::copy(strip.rgba.begin(), strip.rgba.end(), pixels_.begin() + static_cast<std::ptrdiff_t>(first));
    row += rows;
    // The next rows may take longer than these: the picture's bottom may show nothing.
    const double fitting = stripSeconds / std::max(secondsSince(stripStart), 1e-4) * rows;
    const double most = 2.0 * std::max(rows, tileRows);
    rows = static_cast<int>(std::clamp(fitting, 1.0 * tileRows, most)) / tileRows * tileRows;
  }
  seconds_ = secondsSince(start);
}

bool VDIStill::isBeingMade() const {
  return job_.valid() && !vdi::isReady(job_);
}

std::span<const glm::u8vec4> VDIStill::picture() {
  isSeen_ = true;
  if (job_.valid()) {
    try {
      job_.get();
    } catch (...) {
      has_ = false;
      throw;
    }
  }
  return pixels_;
}

void VDIStill::rest() {
  if (this->isBeingMade()) restEnd_ = Clock::now() + restTime;
}

void VDIStill::drop() {
  isDropped_ = true;
  if (job_.valid()) job_.wait();
  job_ = {};
  isDropped_ = false;
  has_ = false;
  isSeen_ = false;
}

}  // namespace pv
