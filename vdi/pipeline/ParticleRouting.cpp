#include "vdi/pipeline/ParticleRouting.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <numbers>

namespace vdi::detail {

namespace shared = gpu::shared;

namespace {

/// The distance, in cells, up to which faces, or cells of two blocks, count as coinciding.
constexpr double coincidence = 1e-6;

constexpr double farthestCell = 1 << 30;

double volumeOf(const Box& box) {
  const glm::dvec3 size = box.size();
  return size.x * size.y * size.z;
}

double largestOf(const glm::dvec3& v) {
  return std::max({v.x, v.y, v.z});
}

/// The cubic spline in three dimensions, times h^3 (vdi/core/Particles.h).
double splineAt(double q) {
  const double outer = std::max(2.0 - q, 0.0);
  const double inner = std::max(1.0 - q, 0.0);
  return (0.25 * outer * outer * outer - inner * inner * inner) / std::numbers::pi;
}

/// The length that two intervals share.
double overlap(double lo, double hi, double otherLo, double otherHi) {
  return std::max(std::min(hi, otherHi) - std::max(lo, otherLo), 0.0);
}

/// Cuts a box into pieces of at most `most` cells: whole layers, rows or parts of rows.
template <typename Visit>
void forEachPiece(const IndexBox& box, int most, Visit visit) {
  const glm::ivec3 size = box.size();
  glm::ivec3 step;
  step.x = std::min(size.x, most);
  step.y = std::clamp(most / step.x, 1, size.y);
  step.z = std::clamp(most / (step.x * step.y), 1, size.z);
  for (int z = box.lo.z; z < box.hi.z; z += step.z) {
    for (int y = box.lo.y; y < box.hi.y; y += step.y) {
      for (int x = box.lo.x; x < box.hi.x; x += step.x) {
        const glm::ivec3 lo(x, y, z);
        visit(IndexBox{lo, glm::min(lo + step, box.hi)});
      }
    }
  }
}

}  // namespace

/// Indices count parts of cells from the block's lower corner.
struct ParticleRouting::Cells {
  glm::ivec3 parts{1};  // parts of a cell, per axis
  glm::dvec3 spacing;   // spacing of the parts
  glm::dvec3 at;        // the particle's position
  glm::dvec3 reach;     // reach of the particle
  IndexBox all;         // parts that the particle meets, inside the block or not
  IndexBox stored;      // parts of `all` inside the block

  Cells(const Spread& spread, const PlacedBlock& place) {
    if (spread.h > 0.0) {
      parts = glm::ivec3(glm::clamp(glm::round(place.spacing / spread.owner->spacing), glm::dvec3(1.0),
                                    glm::dvec3(mostKernelParts)));
    }
    spacing = place.spacing / glm::dvec3(parts);
    at = (spread.position - place.lower) / spacing;
    reach = spread.bounds().size() * 0.5 / spacing;
    const glm::dvec3 limit(farthestCell);
    all = {glm::ivec3(glm::clamp(glm::floor(at - reach), -limit, limit)),
           glm::ivec3(glm::clamp(glm::floor(at + reach), -limit, limit)) + 1};
    stored = all.intersection({glm::ivec3(0), place.cells * parts});
  }
  /// Number of parts that the particle meets; a double, because a long kernel's number exceeds 64 bits.
  double count() const {
    const glm::dvec3 size(all.size());
    return size.x * size.y * size.z;
  }
  /// Cells that lie in `all`, in the world.
  Box box(const PlacedBlock& place) const {
    return {place.lower + glm::dvec3(all.lo) * spacing, place.lower + glm::dvec3(all.hi) * spacing};
  }
};

ParticleRouting::ParticleRouting(const comm::Communicator& comm, const std::vector<Block>& mine,
                                 int mostCells)
    : directory_(comm, mine, false), mostCells_(mostCells) {
  comm.together([&] {
    for (const comm::BlockEntry& entry : directory_.entries()) {
      places_.push_back(
          {entry.origin - 0.5 * entry.spacing, entry.spacing, entry.dims, entry.rank, entry.block});
      PlacedBlock& place = places_.back();
      place.stored = {place.lower, place.lower + glm::dvec3(place.cells) * place.spacing};
      domain_.include(entry.owned);
      stored_.include(place.stored);
    }
    constexpr double flat = 1e6;
    longest_ = flat * glm::length(domain_.size());
  });
  findOwned(comm);
  comm.together([&] {
    findLattices();
    findNear();
  });
}

/// Each rank finds what its own blocks own, and tells the others.
void ParticleRouting::findOwned(const comm::Communicator& comm) {
  const std::vector<comm::OwnParts> parts = comm::settleOverlaps(comm, directory_);
  std::vector<OwnedBox> mine;
  comm.together([&] {
    for (std::size_t i = 0; i < parts.size(); ++i) {
      for (const Box& box : parts[i].boxes) mine.push_back({box, directory_.firstMine() + i});
    }
  });
  const comm::Gathered all = comm.allGather(std::as_bytes(std::span(mine)), sizeof(OwnedBox));
  comm.together([&] {
    owned_.resize(all.bytes.size() / sizeof(OwnedBox));
    if (!owned_.empty()) std::memcpy(owned_.data(), all.bytes.data(), all.bytes.size());
    std::vector<Box> boxes;
    for (const OwnedBox& one : owned_) {
      places_[one.place].owned.push_back(one.box);
      boxes.push_back(one.box);
    }
    ownedTree_ = std::make_unique<comm::BoxTree>(std::move(boxes));
  });
}

/// Numbers the lattices of the blocks. If one lattice gets two numbers, that only costs time.
void ParticleRouting::findLattices() {
  using Key = std::array<double, 6>;
  std::map<Key, std::size_t> lattices;
  for (PlacedBlock& place : places_) {
    Key key{};
    for (int axis = 0; axis < 3; ++axis) {
      const auto i = static_cast<std::size_t>(axis);
      key[i] = static_cast<double>(static_cast<float>(place.spacing[axis]));
      const double cells = (place.lower[axis] - places_.front().lower[axis]) / place.spacing[axis];
      // In (-1/2, 1/2] of a cell, since both ends are the same place.
      key[i + 3] = std::round((cells - std::ceil(cells - 0.5)) / (2.0 * coincidence));
    }
    place.lattice = lattices.try_emplace(key, lattices.size()).first->second;
  }
}

void ParticleRouting::findNear() {
  for (PlacedBlock& place : places_) {
    Box around;
    for (const Box& box : place.owned) around.include(box);
    if (around.empty()) continue;
    place.near = directory_.meeting({around.lo - 0.5 * place.spacing, around.hi + 0.5 * place.spacing});
  }
}

/// Finds the blocks with cells among those that the particle meets.
void ParticleRouting::findMet(const Spread& spread, std::vector<const PlacedBlock*>& met) const {
  const PlacedBlock& owner = *spread.owner;
  const Box box = Cells(spread, owner).box(owner);
  const glm::dvec3 slack = coincidence * owner.spacing;
  const auto find = [&](const std::vector<std::size_t>& among) {
    met.clear();
    for (const std::size_t i : among) {
      const Box common = places_[i].stored.intersection(box);
      if (glm::all(glm::greaterThan(common.hi - common.lo, slack))) met.push_back(&places_[i]);
    }
  };
  if (spread.h > 0.0 || spread.isImage) {
    find(directory_.meeting(box));
  } else {
    find(owner.near);
  }
}

std::size_t ParticleRouting::route(const Particles& particles, std::size_t first, std::size_t last,
                                   int exponent, std::size_t enough, std::vector<RoutedParticle>& routed,
                                   ParticleCounts& counts) const {
  std::vector<const PlacedBlock*> met;
  std::size_t i = first;
  for (; i < last && routed.size() < enough; ++i) {
    const std::optional<Spread> spread = spreadOf(particles, i, counts);
    if (!spread) continue;
    if (particles.periodic == std::array<bool, 3>{}) {
      send(*spread, exponent, met, routed);
    } else {
      sendImages(*spread, particles.periodic, exponent, met, routed);
    }
  }
  return i;
}

/// Returns nullopt for a particle that is left out.
std::optional<ParticleRouting::Spread> ParticleRouting::spreadOf(const Particles& particles,
                                                                 std::size_t index,
                                                                 ParticleCounts& counts) const {
  ++counts.given;
  Spread spread{
      nullptr,
      {particles.positions[0].at(index), particles.positions[1].at(index), particles.positions[2].at(index)},
      particles.weights ? particles.weights.at(index) : 1.0,
      0.0};
  glm::dvec3& p = spread.position;
  if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z) || !std::isfinite(spread.weight)) {
    ++counts.notFinite;
    return std::nullopt;
  }
  for (int axis = 0; axis < 3; ++axis) {
    if (particles.periodic[static_cast<std::size_t>(axis)] && domain_.lo[axis] < domain_.hi[axis])
      p[axis] = wrapped(p[axis], domain_.lo[axis], domain_.hi[axis]);
  }
  const std::optional<std::size_t> found = ownedTree_->containing(p);
  if (!found) {
    ++counts.outside;
    return std::nullopt;
  }
  spread.owner = &places_[owned_[*found].place];
  if (!particles.lengths) return spread;
  const double h = particles.lengths.at(index);
  if (!std::isfinite(h) || !(h > 0.0)) {
    ++counts.badLength;
  } else if (h >= shortestKernel * largestOf(spread.owner->spacing)) {
    spread.h = std::min(h, longest_);
  }
  return spread;
}

/// Whether the particle meets only cells of its owner's lattice, all of them owned by some block.
bool ParticleRouting::isWithinOneLattice(const Spread& spread,
                                         std::span<const PlacedBlock* const> met) const {
  const PlacedBlock& owner = *spread.owner;
  const Box cells = Cells(spread, owner).box(owner);
  if (met.size() == 1 && owner.owned.size() == 1) {
    const glm::dvec3 slack = coincidence * owner.spacing;
    const Box& box = owner.owned.front();
    return glm::all(glm::greaterThanEqual(cells.lo, box.lo - slack)) &&
           glm::all(glm::lessThanEqual(cells.hi, box.hi + slack));
  }
  double covered = 0.0;
  for (const PlacedBlock* place : met) {
    if (place->lattice != owner.lattice) return false;
    for (const Box& box : place->owned) covered += volumeOf(box.intersection(cells));
  }
  return covered >= (1.0 - coincidence) * volumeOf(cells);
}

/// The sum of the particle's shares over all owned cells.
double ParticleRouting::sumOf(const Spread& spread, std::span<const PlacedBlock* const> met) const {
  double sum = 0.0;
  std::array<std::vector<double>, 3> shares;  // share of each part, by its index in the range
  for (const PlacedBlock* one : met) {
    const PlacedBlock& place = *one;
    const Cells cells(spread, place);
    const IndexBox& range = cells.stored;
    if (range.empty()) continue;
    const glm::dvec3 step = spread.h > 0.0 ? cells.spacing / spread.h : glm::dvec3(1.0);
    for (const Box& owned : place.owned) {
      if (!cells.box(place).intersection(owned).empty()) {
        for (int axis = 0; axis < 3; ++axis) {
          std::vector<double>& along = shares[static_cast<std::size_t>(axis)];
          along.clear();
          for (int part = range.lo[axis]; part < range.hi[axis]; ++part) {
            // The share of the part's cell that is owned; a cloud has one part per cell.
            const int cell = part / cells.parts[axis];  // rounds down: >= 0
            const double lower = place.lower[axis] + cell * place.spacing[axis];
            double share = overlap(lower, lower + place.spacing[axis], owned.lo[axis], owned.hi[axis]) /
                           place.spacing[axis];
            if (!(spread.h > 0.0)) {
              share *= overlap(part, part + 1.0, cells.at[axis] - cells.reach[axis],
                               cells.at[axis] + cells.reach[axis]) /
                       (2.0 * cells.reach[axis]);
            }
            along.push_back(share);
          }
        }
        if (!(spread.h > 0.0)) {
          double product = 1.0;
          for (const std::vector<double>& along : shares) {
            double total = 0.0;
            for (const double share : along) total += share;
            product *= total;
          }
          sum += product;
          continue;
        }
        double total = 0.0;
        for (int z = range.lo.z; z < range.hi.z; ++z) {
          const double shareZ = shares[2][static_cast<std::size_t>(z - range.lo.z)];
          for (int y = range.lo.y; y < range.hi.y; ++y) {
            const double shareYZ = shareZ * shares[1][static_cast<std::size_t>(y - range.lo.y)];
            if (!(shareYZ > 0.0)) continue;
            for (int x = range.lo.x; x < range.hi.x; ++x) {
              const glm::dvec3 away = (glm::dvec3(x, y, z) + 0.5 - cells.at) * step;
              total +=
                  shareYZ * shares[0][static_cast<std::size_t>(x - range.lo.x)] * splineAt(glm::length(away));
            }
          }
        }
        sum += total * step.x * step.y * step.z;
      }
    }
  }
  return sum;
}

/// The share of a cell of the owner's size at the kernel's centre; 0 for a cloud.
double ParticleRouting::peakOf(const Spread& spread) {
  if (!(spread.h > 0.0)) return 0.0;
  const glm::dvec3 size = spread.owner->spacing / spread.h;
  return splineAt(0.0) * size.x * size.y * size.z;
}

/// `met` is memory that all calls reuse.
void ParticleRouting::send(Spread spread, int exponent, std::vector<const PlacedBlock*>& met,
                           std::vector<RoutedParticle>& routed) const {
  double sum = 1.0;
  findMet(spread, met);
  const bool isLarge = spread.h > 0.0 && Cells(spread, *spread.owner).count() > mostCells_;
  bool isSummed = isLarge || !isWithinOneLattice(spread, met);
  if (isSummed) sum = sumOf(spread, met);
  if (isSummed && sum < leastKernelSum * peakOf(spread)) {
    spread.h = 0.0;
    findMet(spread, met);
    isSummed = !isWithinOneLattice(spread, met);
    sum = isSummed ? sumOf(spread, met) : 1.0;
  }
  sendShares(spread, met, sum, isSummed, exponent, routed);
}

/// The spread, and its repetitions along periodic axes that may meet stored cells.
std::vector<ParticleRouting::Spread> ParticleRouting::imagesOf(const Spread& spread,
                                                               const std::array<bool, 3>& periodic) const {
  std::vector<Spread> images{spread};
  // Cells that the spread meets reach up to a cell beyond it.
  const Box bounds{spread.bounds().lo - spread.owner->spacing, spread.bounds().hi + spread.owner->spacing};
  for (int axis = 0; axis < 3; ++axis) {
    if (!periodic[static_cast<std::size_t>(axis)]) continue;
    const double period = domain_.size()[axis];
    const std::size_t count = images.size();
    for (int shift = -mostPeriods; shift <= mostPeriods; ++shift) {
      const double by = shift * period;
      if (shift == 0 || bounds.hi[axis] + by < stored_.lo[axis] || bounds.lo[axis] + by > stored_.hi[axis])
        continue;
      for (std::size_t i = 0; i < count; ++i) {
        Spread image = images[i];
        image.position[axis] += by;
        image.isImage = true;
        images.push_back(image);
      }
    }
  }
  return images;
}

/// Sends a particle of periodic axes. Its shares add up to its weight over all repetitions.
void ParticleRouting::sendImages(Spread spread, const std::array<bool, 3>& periodic, int exponent,
                                 std::vector<const PlacedBlock*>& met,
                                 std::vector<RoutedParticle>& routed) const {
  std::vector<Spread> images = imagesOf(spread, periodic);
  if (images.size() == 1) return send(spread, exponent, met, routed);
  const auto sumOfAll = [&] {
    double sum = 0.0;
    for (const Spread& image : images) {
      findMet(image, met);
      sum += sumOf(image, met);
    }
    return sum;
  };
  double sum = sumOfAll();
  if (sum < leastKernelSum * peakOf(spread)) {
    spread.h = 0.0;
    images = imagesOf(spread, periodic);
    sum = sumOfAll();
  }
  for (const Spread& image : images) {
    findMet(image, met);
    sendShares(image, met, sum, true, exponent, routed);
  }
}

/// Sends the particle to all blocks that it meets.
void ParticleRouting::sendShares(const Spread& spread, std::span<const PlacedBlock* const> met, double sum,
                                 bool isSummed, int exponent, std::vector<RoutedParticle>& routed) const {
  for (const PlacedBlock* to : met) {
    const PlacedBlock& place = *to;
    const Cells cells(spread, place);
    if (cells.stored.empty()) continue;
    const glm::dvec3 cell = glm::floor(cells.at);
    double factor = 1.0 / sum;
    RoutedParticle one{};
    one.rank = place.rank;
    shared::DepositParticle& particle = one.particle;
    if (!(spread.h > 0.0)) {
      particle.mode = shared::depositModeCloud;
      particle.size = glm::vec3(2.0 * cells.reach);
    } else {
      const glm::dvec3 step = cells.spacing / spread.h;
      particle.size = glm::vec3(step);
      particle.mode = isSummed ? shared::depositModeShares : shared::depositModeKernel;
      // A hidden cell that is larger than its parts allow must not exceed the sums' range.
      constexpr double most = 64.0;
      if (isSummed) factor = std::min(factor * step.x * step.y * step.z / std::numbers::pi, most);
    }
    particle.cellX = static_cast<int>(cell.x);
    particle.cellY = static_cast<int>(cell.y);
    particle.cellZ = static_cast<int>(cell.z);
    particle.within = glm::vec3(cells.at - cell);
    particle.weight = static_cast<float>(std::ldexp(spread.weight * factor, exponent));
    const glm::uvec3 parts(cells.parts - 1);
    particle.parts = parts.x | parts.y << 10U | parts.z << 20U;
    particle.block = static_cast<std::uint32_t>(place.block);
    forEachPiece(cells.stored, mostCells_, [&](const IndexBox& piece) {
      particle.firstX = piece.lo.x;
      particle.firstY = piece.lo.y;
      particle.firstZ = piece.lo.z;
      particle.lastX = piece.hi.x;
      particle.lastY = piece.hi.y;
      particle.lastZ = piece.hi.z;
      routed.push_back(one);
    });
  }
}

}  // namespace vdi::detail
