#include "bench/Redistribution.h"

#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>

#include "bench/ConvexRegions.h"
#include "vdi/core/Error.h"
#include "vdi/synthetic/Decomposition.h"

namespace vdi::bench {

namespace {

/// The lattice of all ranks' blocks.
synthetic::Lattice commonLattice(const comm::Communicator& comm, const std::vector<Block>& blocks) {
  constexpr double none = -std::numeric_limits<double>::infinity();
  // Maxima of properties and of their negatives.
  enum : std::size_t {
    Origin = 0,
    Last = 3,
    Spacing = 6,
    MinusSpacing = 9,
    Type = 12,
    MinusType,
    Cells,
    Points
  };
  std::array<double, 16> maximum{};
  maximum.fill(none);
  const auto include = [&](std::size_t at, double value) { maximum[at] = std::max(maximum[at], value); };
  for (const Block& block : blocks) {
    for (int axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<std::size_t>(axis);
      include(Origin + a, -block.origin[axis]);
      include(Last + a, block.origin[axis] + (block.dims[axis] - 1) * block.spacing[axis]);
      include(Spacing + a, block.spacing[axis]);
      include(MinusSpacing + a, -block.spacing[axis]);
    }
    include(Type, static_cast<double>(block.type));
    include(MinusType, -static_cast<double>(block.type));
    include(block.owned.lo.x < block.origin.x - 0.25 * block.spacing.x ? Cells : Points, 1.0);
  }
  comm.allReduceMax(maximum);
  synthetic::Lattice lattice;
  if (maximum[Type] == none) return lattice;  // no rank has a block
  bool one = maximum[Type] == -maximum[MinusType] && (maximum[Cells] == none || maximum[Points] == none);
  for (std::size_t a = 0; a < 3; ++a)
    one = one && maximum[Spacing + a] + maximum[MinusSpacing + a] <= 1e-6 * maximum[Spacing + a];
  if (!one) {
    throw Error(ErrorCode::InvalidArgument,
                "can't redistribute blocks of several spacings, types or associations");
  }
  lattice.type = static_cast<ScalarType>(static_cast<std::uint32_t>(maximum[Type]));
  lattice.joint = maximum[Cells] != none ? synthetic::Joint::Cells : synthetic::Joint::SharedPoints;
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    const double first = -maximum[Origin + a];
    lattice.spacing[axis] = maximum[Spacing + a];
    lattice.size[axis] =
        1 + static_cast<int>(std::lround((maximum[Last + a] - first) / maximum[Spacing + a]));
    lattice.origin[axis] =
        first - (lattice.joint == synthetic::Joint::Cells ? 0.5 * maximum[Spacing + a] : 0.0);
  }
  return lattice;
}

/// The lattice indices of a block's stored values.
IndexBox placeOf(const synthetic::Lattice& lattice, const Block& block) {
  const double corner = lattice.joint == synthetic::Joint::Cells
                            ? 0.5
                            : 0.0;  // a lattice of cells begins half a spacing earlier
  const glm::ivec3 first(glm::round((block.origin - lattice.origin) / lattice.spacing - corner));
  return {first, first + block.dims};
}

/// Copies the values of `part` from an array that covers `source` to one that covers `target`.
void copyValues(const IndexBox& part, const IndexBox& source, const std::byte* from, const IndexBox& target,
                std::byte* to, std::size_t bytes) {
  const glm::ivec3 size = part.size();
  const std::size_t row = static_cast<std::size_t>(size.x) * bytes;
  synthetic::layerByLayer(size.z, part.count(), [&](int z) {
    for (int y = 0; y < size.y; ++y) {
      const glm::ivec3 at = part.lo + glm::ivec3(0, y, z);
      std::memcpy(to + target.position(at) * bytes, from + source.position(at) * bytes, row);
    }
  });
}

/// The unit of messages. A rank never receives more than 2^31 units.
constexpr std::size_t granule = 64;

std::size_t padded(std::size_t bytes) {
  return (bytes + granule - 1) / granule * granule;
}

}  // namespace

Redistributed redistribute(const comm::Communicator& comm, const std::vector<Block>& blocks) {
  static_assert(sizeof(IndexBox) <= granule);
  const synthetic::Lattice lattice = commonLattice(comm, blocks);
  const std::size_t bytes = sizeOf(lattice.type);
  const bool cells = lattice.joint == synthetic::Joint::Cells;
  // Divides cells, as decompose does, because boxes share the points at cuts.
  const std::vector<IndexBox> cuts = kdCuts(cells ? lattice.size : lattice.size - 1, comm.size());
  const auto valuesOf = [&](int rank) {
    IndexBox box = cuts[static_cast<std::size_t>(rank)];
    if (!cells && !box.empty()) box.hi += 1;
    return box;
  };
  const IndexBox own = valuesOf(comm.rank());
  std::vector<std::byte> message;
  std::vector<std::uint64_t> counts(static_cast<std::size_t>(comm.size()), 0);
  std::shared_ptr<std::byte[]> data;
  Redistributed result;
  comm.together([&] {
    for (int rank = 0; rank < comm.size(); ++rank) {
      const std::size_t begin = message.size();
      for (const Block& block : blocks) {
        const IndexBox place = placeOf(lattice, block);
        const IndexBox part = place.intersection(valuesOf(rank));
        if (rank == comm.rank() || part.empty()) continue;
        const std::size_t at = message.size();
        message.resize(at + granule + padded(part.count() * bytes));
        std::memcpy(message.data() + at, &part, sizeof(part));
        copyValues(part, place, static_cast<const std::byte*>(block.data), part,
                   message.data() + at + granule, bytes);
      }
      counts[static_cast<std::size_t>(rank)] = (message.size() - begin) / granule;
    }
    if (own.empty()) return;
    data = std::shared_ptr<std::byte[]>(new std::byte[own.count() * bytes]);
    for (const Block& block : blocks) {
      const IndexBox place = placeOf(lattice, block);
      const IndexBox part = place.intersection(own);
      if (!part.empty())
        copyValues(part, place, static_cast<const std::byte*>(block.data), own, data.get(), bytes);
    }
  });
  result.bytesSent = message.size();
  const comm::Gathered received = comm.allToAll(message, counts, granule);
  if (own.empty()) return result;
  for (std::size_t at = 0; at < received.bytes.size();) {
    IndexBox part;
    std::memcpy(&part, received.bytes.data() + at, sizeof(part));
    copyValues(part, part, received.bytes.data() + at + granule, own, data.get(), bytes);
    at += granule + padded(part.count() * bytes);
  }
  result.blocks.push_back(synthetic::blockOf(lattice, {own.lo, own.size(), comm.rank()}, data));
  return result;
}

}  // namespace vdi::bench
