#include "vdi/core/Estimate.h"

#include <fmt/format.h>

#include <algorithm>

#include "vdi/core/Error.h"

namespace vdi {

namespace {

/// The number of lists, with all of the requested margin, even where the scene ends before it.
double listsOf(const GenerateSettings& settings) {
  const double share = 1.0 + 2.0 * settings.margin;
  return share * settings.width * share * settings.height;
}

double mostPerList(const GenerateSettings& settings) {
  return settings.supersegments * (settings.budget == Budget::Total ? settings.fill : 1.0);
}

/// The relative number of samples of all rays.
double samplesOf(const GenerateSettings& settings, double automatic) {
  return listsOf(settings) *
         (settings.samplesPerVoxel == automaticRate ? automatic : settings.samplesPerVoxel);
}

}  // namespace

void requireFitsPages(std::uint64_t lists, std::uint64_t supersegments, Precision precision) {
  constexpr double gibibyte = 1024.0 * 1024.0 * 1024.0;
  const std::uint64_t bytes = bytesInPage(lists, supersegments, precision);
  if (bytes <= mostPageBytes) return;
  throw Error(
      ErrorCode::OutOfMemory,
      fmt::format("pages can't hold the VDI: its {} lists and {} supersegments take {:.1f} GiB of at most "
                  "{:.1f}",
                  lists, supersegments, static_cast<double>(bytes) / gibibyte,
                  static_cast<double>(mostPageBytes) / gibibyte));
}

VdiEstimate estimateOf(const GenerateSettings& settings, const std::optional<MadeVdi>& last) {
  double lists = listsOf(settings);
  double supersegments = typicalFill * lists * mostPerList(settings);
  VdiEstimate estimate;
  if (last && last->lists > 0) {
    estimate.isFromLast = true;
    const GenerateSettings& before = last->settings;
    const double growth = lists / listsOf(before);
    const double supersegmentGrowth = growth * mostPerList(settings) / mostPerList(before);
    lists = growth * static_cast<double>(last->lists);
    supersegments = supersegmentGrowth * static_cast<double>(last->supersegments);
    if (settings.algorithm == before.algorithm && settings.budget == before.budget) {
      const double rate = before.samplesPerVoxel;
      estimate.seconds = last->castSeconds * samplesOf(settings, rate) / samplesOf(before, rate) +
                         last->listSeconds * supersegmentGrowth;
    }
  }
  const double most = lists * mostPerList(settings);
  supersegments = std::min(supersegments, most);
  estimate.bytesInMemory = bytesInMemory(lists, supersegments, settings.precision);
  estimate.mostBytesInMemory = bytesInMemory(lists, most, settings.precision);
  estimate.bytesAsFile = supersegments * typicalFileBytes(settings.precision);
  return estimate;
}

}  // namespace vdi
