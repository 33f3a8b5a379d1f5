#include "vdi/reference/Deposit.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace vdi::reference {

namespace {

/// A block as particles see it.
struct Lattice {
  glm::dvec3 lower;  // corner of the first stored cell
  glm::dvec3 spacing;
  glm::ivec3 cells;
  std::vector<Box> owned;

  double volume() const { return spacing.x * spacing.y * spacing.z; }
  Box box(const glm::ivec3& cell) const {
    return {lower + glm::dvec3(cell) * spacing, lower + glm::dvec3(cell + 1) * spacing};
  }
};

double volumeOf(const Box& box) {
  const glm::dvec3 size = box.size();
  return size.x * size.y * size.z;
}

std::vector<Lattice> latticesOf(std::span<const Block> blocks) {
  constexpr double sameLevel = 0.99;  // volumes closer than this ratio are of one level
  std::vector<Lattice> lattices;
  for (const Block& block : blocks)
    lattices.push_back({block.origin - 0.5 * block.spacing, block.spacing, block.dims, {}});
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    std::vector<Box> finer;
    for (std::size_t j = 0; j < blocks.size(); ++j) {
      if (lattices[j].volume() < sameLevel * lattices[i].volume()) finer.push_back(blocks[j].owned);
    }
    lattices[i].owned = withoutAll(blocks[i].owned, finer);
  }
  return lattices;
}

bool contains(const Box& box, const glm::dvec3& p) {
  return glm::all(glm::lessThanEqual(box.lo, p)) && glm::all(glm::lessThan(p, box.hi));
}

/// The part of a cell that its block owns, as a share of the cell.
double ownedShare(const Lattice& lattice, const glm::ivec3& cell) {
  const Box box = lattice.box(cell);
  double sum = 0.0;
  for (const Box& part : lattice.owned) sum += volumeOf(part.intersection(box));
  return sum / volumeOf(box);
}

/// The cubic spline W(r, h) of Monaghan (1992) in three dimensions, per volume.
double cubicSpline(double r, double h) {
  const double q = r / h;
  const double scale = 1.0 / (std::numbers::pi * h * h * h);
  if (q < 1.0) return scale * (1.0 - 1.5 * q * q + 0.75 * q * q * q);
  if (q < 2.0) return scale * 0.25 * std::pow(2.0 - q, 3.0);
  return 0.0;
}

/// The spread of a particle of weight 1, before its shares are divided by their sum.
struct Spread {
  glm::dvec3 position;
  glm::dvec3 spacing;  // spacing of the owner's cells
  double h = 0.0;      // 0: cloud in cell

  glm::dvec3 reach() const { return h > 0.0 ? glm::dvec3(2.0 * h) : 0.5 * spacing; }

  /// The mean density in a cell.
  double density(const Lattice& lattice, const glm::ivec3& cell) const {
    const Box box = lattice.box(cell);
    if (!(h > 0.0)) {
      const Box cloud{position - 0.5 * spacing, position + 0.5 * spacing};
      return volumeOf(cloud.intersection(box)) / (volumeOf(cloud) * volumeOf(box));
    }
    const glm::ivec3 parts(
        glm::clamp(glm::round(lattice.spacing / spacing), glm::dvec3(1.0), glm::dvec3(mostKernelParts)));
    const glm::dvec3 size = lattice.spacing / glm::dvec3(parts);
    double sum = 0.0;
    for (int z = 0; z < parts.z; ++z) {
      for (int y = 0; y < parts.y; ++y) {
        for (int x = 0; x < parts.x; ++x)
          sum += cubicSpline(glm::length(box.lo + (glm::dvec3(x, y, z) + 0.5) * size - position), h);
      }
    }
    return sum / (parts.x * parts.y * parts.z);
  }
};

/// Calls visit(lattice's index, cell) for all stored cells that the particle may reach.
template <typename Visit>
void forEachCell(const std::vector<Lattice>& lattices, const Spread& spread, Visit visit) {
  for (std::size_t i = 0; i < lattices.size(); ++i) {
    const Lattice& lattice = lattices[i];
    const glm::dvec3 at = (spread.position - lattice.lower) / lattice.spacing;
    const glm::dvec3 reach = spread.reach() / lattice.spacing;
    const glm::dvec3 all(lattice.cells);
    const glm::ivec3 lo(glm::clamp(glm::floor(at - reach) - 1.0, glm::dvec3(0.0), all));
    const glm::ivec3 hi(glm::clamp(glm::ceil(at + reach) + 1.0, glm::dvec3(0.0), all));
    for (int z = lo.z; z < hi.z; ++z) {
      for (int y = lo.y; y < hi.y; ++y) {
        for (int x = lo.x; x < hi.x; ++x) visit(i, glm::ivec3(x, y, z));
      }
    }
  }
}

/// The sum of the particle's shares over all owned cells.
double sumOf(const std::vector<Lattice>& lattices, const Spread& spread) {
  double sum = 0.0;
  forEachCell(lattices, spread, [&](std::size_t i, const glm::ivec3& cell) {
    const double density = spread.density(lattices[i], cell);
    if (density > 0.0) sum += density * ownedShare(lattices[i], cell) * lattices[i].volume();
  });
  return sum;
}

/// The spread, and its repetitions along periodic axes.
std::vector<Spread> imagesOf(const Spread& spread, const std::array<bool, 3>& periodic, const Box& domain) {
  std::vector<Spread> images{spread};
  for (int axis = 0; axis < 3; ++axis) {
    if (!periodic[static_cast<std::size_t>(axis)]) continue;
    const std::vector<Spread> before = images;
    for (int shift = -mostPeriods; shift <= mostPeriods; ++shift) {
      for (Spread image : before) {
        image.position[axis] += shift * domain.size()[axis];
        if (shift != 0) images.push_back(image);
      }
    }
  }
  return images;
}

double sumOf(const std::vector<Lattice>& lattices, const std::vector<Spread>& images) {
  double sum = 0.0;
  for (const Spread& image : images) sum += sumOf(lattices, image);
  return sum;
}

std::size_t indexOf(const Lattice& lattice, const glm::ivec3& cell) {
  return IndexBox{glm::ivec3(0), lattice.cells}.position(cell);
}

}  // namespace

Deposit deposit(std::span<const Block> blocks, const Particles& particles, DepositKind kind) {
  const std::vector<Lattice> lattices = latticesOf(blocks);
  Deposit result;
  for (const Block& block : blocks) result.values.emplace_back(block.valueCount(), 0.0);
  Box domain;
  for (const Lattice& lattice : lattices) {
    for (const Box& box : lattice.owned) domain.include(box);
  }
  ParticleCounts& counts = result.counts;
  counts.given = particles.count;
  for (std::size_t p = 0; p < particles.count; ++p) {
    glm::dvec3 position(particles.positions[0].at(p), particles.positions[1].at(p),
                        particles.positions[2].at(p));
    const double weight = particles.weights ? particles.weights.at(p) : 1.0;
    if (glm::any(glm::isnan(position)) || glm::any(glm::isinf(position)) || !std::isfinite(weight)) {
      ++counts.notFinite;
      continue;
    }
    for (int axis = 0; axis < 3; ++axis) {
      if (particles.periodic[static_cast<std::size_t>(axis)])
        position[axis] = wrapped(position[axis], domain.lo[axis], domain.hi[axis]);
    }
    const auto owner = std::find_if(lattices.begin(), lattices.end(), [&](const Lattice& lattice) {
      return std::any_of(lattice.owned.begin(), lattice.owned.end(),
                         [&](const Box& box) { return contains(box, position); });
    });
    if (owner == lattices.end()) {
      ++counts.outside;
      continue;
    }
    Spread spread{position, owner->spacing, 0.0};
    if (particles.lengths) {
      const double h = particles.lengths.at(p);
      const bool isGood = std::isfinite(h) && h > 0.0;
      if (!isGood) ++counts.badLength;
      const double largest = std::max({owner->spacing.x, owner->spacing.y, owner->spacing.z});
      if (isGood && h >= shortestKernel * largest) spread.h = h;
    }
    std::vector<Spread> images = imagesOf(spread, particles.periodic, domain);
    double sum = sumOf(lattices, images);
    if (spread.h > 0.0 && sum < leastKernelSum * cubicSpline(0.0, spread.h) * owner->volume()) {
      spread.h = 0.0;
      images = imagesOf(spread, particles.periodic, domain);
      sum = sumOf(lattices, images);
    }
    for (const Spread& image : images) {
      forEachCell(lattices, image, [&](std::size_t i, const glm::ivec3& cell) {
        const double scale = kind == DepositKind::Sum ? lattices[i].volume() : 1.0;
        result.values[i][indexOf(lattices[i], cell)] +=
            weight / sum * image.density(lattices[i], cell) * scale;
      });
    }
  }
  return result;
}

double totalOf(std::span<const Block> blocks, std::span<const std::vector<double>> values, DepositKind kind) {
  const std::vector<Lattice> lattices = latticesOf(blocks);
  double total = 0.0;
  for (std::size_t i = 0; i < lattices.size(); ++i) {
    const Lattice& lattice = lattices[i];
    const double scale = kind == DepositKind::Sum ? 1.0 : lattice.volume();
    for (int z = 0; z < lattice.cells.z; ++z) {
      for (int y = 0; y < lattice.cells.y; ++y) {
        for (int x = 0; x < lattice.cells.x; ++x) {
          const glm::ivec3 cell(x, y, z);
          total += values[i][indexOf(lattice, cell)] * ownedShare(lattice, cell) * scale;
        }
      }
    }
  }
  return total;
}

}  // namespace vdi::reference
