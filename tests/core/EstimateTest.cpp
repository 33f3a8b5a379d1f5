// Estimates of a VDI's size and time.
#include "tests/Catch.h"
#include "vdi/core/Estimate.h"

using namespace vdi;

namespace {

GenerateSettings settingsOf(int width, int height, std::uint32_t supersegments) {
  GenerateSettings settings;
  settings.width = width;
  settings.height = height;
  settings.supersegments = supersegments;
  return settings;
}

/// A fifth of the supersegments that the lists may hold.
MadeVdi made() {
  return {.settings = settingsOf(100, 50, 20),
          .lists = 5000,
          .supersegments = 20000,
          .castSeconds = 3.0,
          .listSeconds = 0.5};
}

}  // namespace

TEST_CASE("estimate: without a VDI it is of typically filled lists, and without a time") {
  const VdiEstimate estimate = estimateOf(settingsOf(1920, 1080, 25), std::nullopt);
  const double lists = 1920.0 * 1080.0;
  CHECK_FALSE(estimate.isFromLast);
  CHECK_FALSE(estimate.seconds.has_value());
  CHECK(estimate.bytesInMemory == Approx(lists * (4.0 + 8.0 * 25.0 * typicalFill)));
  CHECK(estimate.mostBytesInMemory == Approx(lists * (4.0 + 8.0 * 25.0)));
  CHECK(estimate.bytesAsFile == Approx(lists * 25.0 * typicalFill * typicalFileBytes(Precision::Compact)));
  // The data sets of docs/benchmarks.md, of which 20 to 82 MiB are stored.
  CHECK(estimate.bytesAsFile > 20.0 * 1048576.0);
  CHECK(estimate.bytesAsFile < 82.0 * 1048576.0);
}

TEST_CASE("estimate: the last VDI's own settings give what it was") {
  const VdiEstimate estimate = estimateOf(made().settings, made());
  CHECK(estimate.isFromLast);
  CHECK(estimate.bytesInMemory == Approx(5000.0 * 4.0 + 20000.0 * 8.0));
  CHECK(estimate.seconds.value() == Approx(3.5));
}

TEST_CASE("estimate: it grows with lists and supersegments") {
  const double before = estimateOf(made().settings, made()).bytesAsFile;
  const VdiEstimate wider = estimateOf(settingsOf(300, 50, 20), made());
  CHECK(wider.bytesInMemory == Approx(3.0 * (5000.0 * 4.0 + 20000.0 * 8.0)));
  CHECK(wider.bytesAsFile == Approx(3.0 * before));
  CHECK(wider.seconds.value() == Approx(3.0 * 3.5));
  const VdiEstimate longer = estimateOf(settingsOf(100, 50, 40), made());
  CHECK(longer.bytesInMemory == Approx(5000.0 * 4.0 + 40000.0 * 8.0));
  CHECK(longer.seconds.value() == Approx(3.0 + 2.0 * 0.5));

  GenerateSettings settings = made().settings;
  settings.margin = 0.5;  // four times as many lists
  CHECK(estimateOf(settings, made()).bytesAsFile == Approx(4.0 * before));
  settings.margin = 0.0;
  settings.samplesPerVoxel = 2.0;
  CHECK(estimateOf(settings, made()).bytesAsFile == Approx(before));
  CHECK(estimateOf(settings, made()).seconds.value() == Approx(2.0 * 3.0 + 0.5));
  settings.samplesPerVoxel = automaticRate;  // as it came out last time
  CHECK(estimateOf(settings, made()).seconds.value() == Approx(3.5));
  settings.precision = Precision::Full;
  CHECK(estimateOf(settings, made()).bytesInMemory == Approx(5000.0 * 4.0 + 20000.0 * 24.0));
}

TEST_CASE("estimate: another budget or algorithm takes an unknown time") {
  GenerateSettings settings = made().settings;
  settings.budget = Budget::Total;
  settings.fill = 0.5;
  const VdiEstimate half = estimateOf(settings, made());
  CHECK(half.bytesInMemory == Approx(5000.0 * 4.0 + 10000.0 * 8.0));
  CHECK_FALSE(half.seconds.has_value());
  settings = made().settings;
  settings.algorithm = Algorithm::Bisection;
  CHECK_FALSE(estimateOf(settings, made()).seconds.has_value());
}

TEST_CASE("estimate: lists hold no more than they may") {
  MadeVdi full = made();
  full.supersegments = 5000 * 20;
  GenerateSettings settings = made().settings;
  const VdiEstimate estimate = estimateOf(settings, full);
  CHECK(estimate.bytesInMemory == Approx(estimate.mostBytesInMemory));
  settings.width = 0;  // while it is typed
  CHECK(estimateOf(settings, full).bytesInMemory == 0.0);
}
