#include "vdi/pipeline/ParticleDepositor.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstring>
#include <limits>
#include <mutex>
#include <new>
#include <optional>
#include <string>
#include <utility>

#include "vdi/core/Error.h"
#include "vdi/core/Parallel.h"
#include "vdi/gpu/DepositPass.h"
#include "vdi/pipeline/ParticleRouting.h"

namespace vdi {

using detail::ParticleRouting;
using detail::RoutedParticle;
using gpu::shared::DepositParticle;

namespace {

/// The number of entries, of 76 bytes each, that the device gets at a time.
constexpr std::size_t entriesAtOnce = std::size_t{1} << 18;

/// About the number of entries that a rank sends at a time, and of particles that it routes for them. This
/// bounds the memory of a rank that receives entries from all others.
std::size_t sentAtOnce(int ranks) {
  constexpr std::size_t received = std::size_t{1} << 21;
  constexpr std::size_t least = std::size_t{1} << 12;
  return std::clamp(received / static_cast<std::size_t>(ranks), least, entriesAtOnce);
}

/// Particles [first, last) that are still to be routed.
struct Range {
  std::size_t first;
  std::size_t last;
};

/// The most cells that an invocation visits. It visits a kernel's cells twice. Lavapipe ends an invocation's
/// loops after 65535 passes. On a GPU the bound keeps dispatches short.
constexpr double mostCellsOnCpu = 1 << 14;
constexpr double mostCellsOnGpu = 1 << 20;

/// The total of the weights' magnitudes of all ranks is at most 2^totalBits units of the sums. A cell's share
/// of a weight is at most 64, and exceeds 1 only in ghost and hidden cells.
constexpr int totalBits = 55;

/// The exponent of the sums' unit: a power of two, so that the number of ranks hardly changes it.
int unitExponent(const comm::Communicator& comm, const Particles& particles) {
  const auto magnitude = [&](std::size_t i) {
    const double weight = std::abs(particles.weights.at(i));
    return std::isfinite(weight) ? weight : 0.0;
  };
  std::array<double, 1> largest{0.0};
  if (particles.count > 0) largest[0] = 1.0;
  if (particles.weights) {
    largest[0] = 0.0;
    for (std::size_t i = 0; i < particles.count; ++i) largest[0] = std::max(largest[0], magnitude(i));
  }
  comm.allReduceMax(largest);
  std::array<double, 1> sum{static_cast<double>(particles.count)};
  if (!(largest[0] > 0.0)) largest[0] = 1.0;
  if (particles.weights) {
    sum[0] = 0.0;
    for (std::size_t i = 0; i < particles.count; ++i) sum[0] += magnitude(i) / largest[0];
  }
  comm.allReduceSum(sum);
  const int bits = std::ilogb(largest[0]) + 1 + std::ilogb(std::max(sum[0], 1.0)) + 1;
  return bits - totalBits;
}

std::shared_ptr<float[]> newValues(std::size_t count) {
  std::shared_ptr<float[]> values(new (std::nothrow) float[count]);
  if (!values) {
    throw Error(ErrorCode::OutOfMemory, "no memory for an array of deposited particles: " +
                                            std::to_string(count * sizeof(float)) + " bytes");
  }
  return values;
}

}  // namespace

struct ParticleDepositor::State {
  State(const std::shared_ptr<gpu::Device>& device, const comm::Communicator& communicator)
      : comm(communicator), mostCells(device->isCpu() ? mostCellsOnCpu : mostCellsOnGpu), pass(device) {}

  std::vector<DepositParticle> exchange(std::vector<RoutedParticle> routed) const;
  std::vector<RoutedParticle> route(const Particles& particles, std::vector<Range>& left, int exponent,
                                    ParticleCounts& counts) const;
  void add(std::span<const DepositParticle> particles);
  std::vector<std::shared_ptr<float[]>> values(DepositKind kind, int exponent);

  const comm::Communicator& comm;
  double mostCells;
  gpu::DepositPass pass;
  std::vector<Block> blocks;
  std::optional<ParticleRouting> routing;
};

/// Routes some of the particles that are left, on several threads.
std::vector<RoutedParticle> ParticleDepositor::State::route(const Particles& particles,
                                                            std::vector<Range>& left, int exponent,
                                                            ParticleCounts& counts) const {
  std::vector<RoutedParticle> all;
  if (left.empty()) return all;
  const std::size_t most = sentAtOnce(comm.size());
  const Range now{left.back().first, std::min(left.back().last, left.back().first + most)};
  left.back().first = now.last;
  if (left.back().first == left.back().last) left.pop_back();
  std::mutex mutex;
  constexpr std::size_t least = 512;
  inParallel(now.last - now.first, least, [&](std::size_t from, std::size_t to) {
    std::vector<RoutedParticle> mine;
    ParticleCounts more;
    mine.reserve(to - from);
    const std::size_t last = now.first + to;
    const std::size_t next = routing->route(particles, now.first + from, last, exponent, most, mine, more);
    const std::scoped_lock lock(mutex);
    all.insert(all.end(), mine.begin(), mine.end());
    if (next < last) left.push_back({next, last});
    counts.given += more.given;
    counts.notFinite += more.notFinite;
    counts.outside += more.outside;
    counts.badLength += more.badLength;
  });
  return all;
}

/// Collective: returns the particles that all ranks send to this one.
std::vector<DepositParticle> ParticleDepositor::State::exchange(std::vector<RoutedParticle> routed) const {
  std::vector<std::uint64_t> counts;
  std::vector<DepositParticle> sorted;
  comm.together([&] {
    counts.resize(static_cast<std::size_t>(comm.size()));
    for (const RoutedParticle& one : routed) ++counts[static_cast<std::size_t>(one.rank)];
    std::vector<std::uint64_t> places(counts.size(), 0);
    for (std::size_t r = 1; r < places.size(); ++r) places[r] = places[r - 1] + counts[r - 1];
    sorted.resize(routed.size());
    for (const RoutedParticle& one : routed)
      sorted[places[static_cast<std::size_t>(one.rank)]++] = one.particle;
    routed = {};
  });
  if (comm.size() == 1) return sorted;
  const comm::Gathered got = comm.allToAll(std::as_bytes(std::span(sorted)), counts, sizeof(DepositParticle));
  comm.together([&] {
    sorted.resize(got.bytes.size() / sizeof(DepositParticle));
    if (!sorted.empty()) std::memcpy(sorted.data(), got.bytes.data(), got.bytes.size());
  });
  return sorted;
}

void ParticleDepositor::State::add(std::span<const DepositParticle> particles) {
  for (std::size_t first = 0; first < particles.size(); first += entriesAtOnce)
    pass.add(particles.subspan(first, std::min(entriesAtOnce, particles.size() - first)));
}

/// Returns the sums as floats.
std::vector<std::shared_ptr<float[]>> ParticleDepositor::State::values(DepositKind kind, int exponent) {
  std::vector<std::shared_ptr<float[]>> all;
  for (const Block& block : blocks) all.push_back(newValues(block.valueCount()));
  const double unit = std::ldexp(1.0, exponent);
  std::atomic<bool> isTooLarge = false;
  pass.finish([&](std::size_t block, std::uint64_t start, std::span<const std::int64_t> sums) {
    const glm::dvec3& spacing = blocks[block].spacing;
    const double volume = kind == DepositKind::Density ? spacing.x * spacing.y * spacing.z : 1.0;
    float* to = all[block].get() + start;
    constexpr std::size_t least = 65536;
    inParallel(sums.size(), least, [&](std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) {
        const double value = static_cast<double>(sums[i]) * unit / volume;
        if (std::abs(value) > static_cast<double>(std::numeric_limits<float>::max())) isTooLarge = true;
        to[i] = static_cast<float>(value);
      }
    });
  });
  if (isTooLarge) {
    throw Error(
        ErrorCode::InvalidArgument,
        "deposited particles make values beyond 3.4e38, the largest of f32; use a larger unit of weight");
  }
  return all;
}

ParticleDepositor::ParticleDepositor(const std::shared_ptr<gpu::Device>& device,
                                     const comm::Communicator& comm)
    : state_(std::make_unique<State>(device, comm)) {}

ParticleDepositor::~ParticleDepositor() = default;

void ParticleDepositor::setBlocks(const std::vector<Block>& blocks) {
  State& state = *state_;
  state.routing.reset();
  std::array<double, 1> mostCells{state.mostCells};
  state.comm.allReduceMin(mostCells);
  state.routing.emplace(state.comm, blocks, static_cast<int>(mostCells[0]));
  state.comm.together([&] { state.blocks = blocks; });
}

DepositedArray ParticleDepositor::deposit(const Particles& particles, DepositKind kind) {
  State& state = *state_;
  const comm::Communicator& comm = state.comm;
  const int exponent = unitExponent(comm, particles);
  std::vector<Range> left;
  comm.together([&] {
    std::vector<glm::ivec3> sizes;
    for (const Block& block : state.blocks) sizes.push_back(block.dims);
    state.pass.start(sizes);
    if (particles.count > 0) left.push_back({0, particles.count});
  });
  ParticleCounts counts;
  bool isMore = true;
  while (isMore) {
    std::vector<RoutedParticle> routed;
    isMore = comm.anyTogether([&] {
      routed = state.route(particles, left, -exponent, counts);
      return !left.empty();
    });
    const std::vector<DepositParticle> mine = state.exchange(std::move(routed));
    comm.together([&] { state.add(mine); });
  }
  DepositedArray result;
  comm.together([&] {
    result.values = state.values(kind, exponent);
    state.pass.release();
  });
  std::array<std::uint64_t, 4> sums{counts.given, counts.notFinite, counts.outside, counts.badLength};
  comm.allReduceSum(sums);
  result.counts = {sums[0], sums[1], sums[2], sums[3]};
  return result;
}

}  // namespace vdi
