#include "VDIFramePolicy.h"

#include <algorithm>
#include <cmath>

#include "VDIView.h"
#include "vdi/core/Viewpoint.h"

namespace pv {

namespace {

double pixelsOf(const glm::ivec2& size) {
  return static_cast<double>(size.x) * size.y;
}

void blend(std::optional<double>& mean, double value) {
  mean = mean ? 0.5 * (*mean + value) : value;
}

/// The level with the fewest lists that still has enough across what the view shows of the VDI.
std::optional<std::size_t> thinLevelFor(const VDIBuffers& buffers, const vdi::View& view) {
  constexpr double leastAcross = 100.0;
  const double across = vdi::listsAcross(boxOf(buffers.bounds().data()), *buffers.viewpoint(), view);
  for (std::size_t level = 0; level < VDIBuffers::thinLevels; ++level) {
    const VDIBuffers::Thin& thin = buffers.thin(level);
    const bool isLast = level + 1 == VDIBuffers::thinLevels;
    if (thin.lists > 0 && (isLast || across * thin.share >= leastAcross)) return level;
  }
  return std::nullopt;
}

}  // namespace

void VDIFramePolicy::Pace::measure(double seconds, double renderSeconds, double pixels) {
  blend(anyway_, seconds - renderSeconds);
  blend(perPixel_, renderSeconds / pixels);
}

void VDIFramePolicy::Pace::guess(double renderSeconds, double pixels) {
  if (!perPixel_) perPixel_ = renderSeconds / pixels;
}

std::optional<double> VDIFramePolicy::Pace::pixels(double rate) const {
  if (!perPixel_) return std::nullopt;
  return std::max(1.0 / rate - anyway_.value_or(0.0), 0.5 / rate) / *perPixel_;
}

std::optional<double> VDIFramePolicy::Pace::seconds(double pixels) const {
  if (!perPixel_) return std::nullopt;
  return pixels * *perPixel_;
}

PictureForm VDIFramePolicy::interactive(VDIBuffers& buffers, const vdi::View& view, const glm::ivec2& port,
                                        double rate) {
  const double all = pixelsOf(port);
  PictureForm form{port, std::nullopt};
  double pixels = whole_.pixels(rate).value_or(0.0);
  const std::optional<std::size_t> thin = thinLevelFor(buffers, view);
  const double fewLists = thin ? static_cast<double>(buffers.thin(*thin).lists) : 0.0;
  if (thin && pixels < std::min(all, 2.0 * fewLists)) {
    // So few pixels would miss most of the lists.
    form.thin = thin;
    pixels = thins_.at(*thin).pixels(rate).value_or(fewLists);
  }
  constexpr double coarsest = 8.0;  // larger pixels show hardly anything recognisable
  const double wanted = std::sqrt(std::clamp(all / std::max(pixels, 1.0), 1.0, coarsest * coarsest));
  // A size that changed from frame to frame would flicker.
  const double ratio = wanted / reduction_;
  if (ratio < 0.8 || ratio > 1.25 || wanted == 1.0) reduction_ = wanted;
  form.size = glm::max(glm::ivec2(glm::ceil(glm::dvec2(port) / reduction_)), 1);
  return form;
}

bool VDIFramePolicy::takesLong(const VDIBuffers& buffers, const glm::ivec2& port) const {
  constexpr double longTime = 0.05;
  return whole_.seconds(pixelsOf(port)).value_or(buffers.isOnCpu() ? 2.0 * longTime : 0.0) > longTime;
}

void VDIFramePolicy::measure(const PictureForm& form, double seconds, double renderSeconds) {
  this->paceOf(form).measure(seconds, renderSeconds, pixelsOf(form.size));
}

void VDIFramePolicy::guess(const PictureForm& form, double renderSeconds) {
  this->paceOf(form).guess(renderSeconds, pixelsOf(form.size));
}

}  // namespace pv
