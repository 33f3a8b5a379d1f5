// Finds the blocks on which each particle is deposited. Not part of the library's interface.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "shaders/shared/deposit.h"
#include "vdi/comm/BlockDirectory.h"
#include "vdi/comm/Communicator.h"
#include "vdi/core/Block.h"
#include "vdi/core/Particles.h"

namespace vdi::detail {

/// A particle to send to a block.
struct RoutedParticle {
  std::int32_t rank;
  gpu::shared::DepositParticle particle;
};

/// The places of all ranks' blocks, as every rank knows them.
class ParticleRouting {
 public:
  /// Collective. An entry has `mostCells` cells at most, equal on all ranks. Throws as comm::settleOverlaps
  /// does.
  ParticleRouting(const comm::Communicator& comm, const std::vector<Block>& mine, int mostCells);

  /// Appends an entry for each particle of [first, last) and each block that it meets, or several if it meets
  /// many cells. Counts particles that are left out. Weights are multiplied by 2^`exponent`. Stops when
  /// `routed` has `enough` entries, and returns the index of the first particle that is still to be routed.
  /// Several threads may call it at once.
  std::size_t route(const Particles& particles, std::size_t first, std::size_t last, int exponent,
                    std::size_t enough, std::vector<RoutedParticle>& routed, ParticleCounts& counts) const;

 private:
  /// A block of any rank.
  struct PlacedBlock {
    glm::dvec3 lower;  // corner of the first stored cell
    glm::dvec3 spacing;
    glm::ivec3 cells;
    std::int32_t rank;
    std::int32_t block;               // index on its rank
    std::size_t lattice = 0;          // equal for blocks whose cells continue each other
    std::vector<Box> owned{};         // disjoint
    Box stored{};                     // all cells
    std::vector<std::size_t> near{};  // indices of blocks that a cloud around a position in `owned` may meet
  };
  /// The spread of a particle.
  struct Spread {
    const PlacedBlock* owner;
    glm::dvec3 position;
    double weight;
    double h;              // 0: cloud in cell
    bool isImage = false;  // repeated at another place than the owner's

    Box bounds() const {
      const glm::dvec3 reach = h > 0.0 ? glm::dvec3(2.0 * h) : 0.5 * owner->spacing;
      return {position - reach, position + reach};
    }
  };
  /// A block's cells, or their equal parts, around a particle.
  struct Cells;

  void findOwned(const comm::Communicator& comm);
  void findLattices();
  void findNear();
  std::optional<Spread> spreadOf(const Particles& particles, std::size_t index, ParticleCounts& counts) const;
  void findMet(const Spread& spread, std::vector<const PlacedBlock*>& met) const;
  bool isWithinOneLattice(const Spread& spread, std::span<const PlacedBlock* const> met) const;
  double sumOf(const Spread& spread, std::span<const PlacedBlock* const> met) const;
  static double peakOf(const Spread& spread);
  std::vector<Spread> imagesOf(const Spread& spread, const std::array<bool, 3>& periodic) const;
  void sendShares(const Spread& spread, std::span<const PlacedBlock* const> met, double sum, bool isSummed,
                  int exponent, std::vector<RoutedParticle>& routed) const;
  void sendImages(Spread spread, const std::array<bool, 3>& periodic, int exponent,
                  std::vector<const PlacedBlock*>& met, std::vector<RoutedParticle>& routed) const;
  void send(Spread spread, int exponent, std::vector<const PlacedBlock*>& met,
            std::vector<RoutedParticle>& routed) const;

  struct OwnedBox {
    Box box;
    std::uint64_t place;
  };
  comm::BlockDirectory directory_;
  std::vector<PlacedBlock> places_;  // in the order of the directory's entries
  std::vector<OwnedBox> owned_;
  std::unique_ptr<comm::BoxTree> ownedTree_;  // of owned_
  int mostCells_;
  Box domain_;            // bounds of all owned boxes
  Box stored_;            // bounds of all stored cells
  double longest_ = 0.0;  // beyond this h the kernel is flat over all blocks
};

}  // namespace vdi::detail
