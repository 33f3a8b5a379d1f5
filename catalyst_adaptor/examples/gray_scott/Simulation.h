// Gray-Scott reaction-diffusion in three dimensions (Pearson, Science 261, 1993), on blocks
// assigned to MPI ranks.
#pragma once

#include <mpi.h>

#include <array>
#include <vector>

namespace gray_scott {

struct Parameters {
  int size = 96;            // cells per axis of the cubic, periodic domain
  int blocks = 6;           // blocks per axis; divides size
  double feed = 0.01;       // F
  double kill = 0.05;       // k
  double diffusionU = 0.2;  // per unit of time, towards the mean of the six neighbours
  double diffusionV = 0.1;
  double timeStep = 2.0;
};

/// One cube of cells with a layer of halo cells around it.
struct Block {
  std::array<int, 3> at;  // position in the grid of blocks
  int owner;              // rank
  std::vector<float> u;   // [n + 2][n + 2][n + 2], x fastest
  std::vector<float> v;
  std::vector<float> nextU;
  std::vector<float> nextV;
};

/// The simulation numbers blocks along a Morton curve, and assigns them to the ranks in turn. Each
/// rank's region is therefore scattered all over the domain, far from convex, as after load
/// balancing.
class Simulation {
 public:
  Simulation(MPI_Comm comm, const Parameters& parameters);

  void step();
  /// Sets rates from the next step on. They must be the same on all ranks.
  void setRates(double feed, double kill);

  int cellsPerBlock() const { return n_; }  // per axis, without halo
  /// This rank's blocks. Halo cells are up to date after step() and after construction.
  const std::vector<Block>& blocks() const { return blocks_; }

 private:
  struct Face {
    int axis;
    bool above;
  };

  void exchangeHalos();
  void exchangeAxis(int axis);
  int ownerOf(const std::array<int, 3>& at) const;
  int indexOf(const std::array<int, 3>& at) const;  // among all blocks
  void pack(const Block& block, const Face& face, std::vector<float>& out) const;
  void unpack(Block& block, const Face& face, const float* in) const;
  void react(Block& block) const;
  std::size_t cell(int x, int y, int z) const {
    const auto side = static_cast<std::size_t>(n_) + 2;
    return (static_cast<std::size_t>(z) * side + static_cast<std::size_t>(y)) * side +
           static_cast<std::size_t>(x);
  }

  MPI_Comm comm_;
  Parameters parameters_;
  int n_;
  int rank_ = 0;
  std::vector<int> owners_;      // by block
  std::vector<int> localIndex_;  // by block; -1: another rank's
  std::vector<Block> blocks_;
};

}  // namespace gray_scott
