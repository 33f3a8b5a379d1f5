#include "Simulation.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <stdexcept>
#include <utility>

namespace gray_scott {

namespace {

/// Position on the Morton curve: the bits of the three coordinates, interleaved.
std::uint64_t morton(const std::array<int, 3>& at) {
  std::uint64_t code = 0;
  for (int bit = 0; bit < 20; ++bit) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      code |= static_cast<std::uint64_t>((at[axis] >> bit) & 1) << (3 * bit + static_cast<int>(axis));
    }
  }
  return code;
}

/// V is seeded in a few balls, spread by a small lattice of points, so that patterns grow everywhere.
float seededV(double x, double y, double z) {
  constexpr double seeds[][4] = {{0.5, 0.5, 0.5, 0.09},  {0.25, 0.3, 0.6, 0.06}, {0.7, 0.35, 0.3, 0.07},
                                 {0.35, 0.7, 0.3, 0.05}, {0.7, 0.7, 0.65, 0.06}, {0.2, 0.6, 0.8, 0.05}};
  for (const auto& seed : seeds) {
    if (std::hypot(x - seed[0], y - seed[1], z - seed[2]) < seed[3]) return 0.4F;
  }
  return 0.0F;
}

}  // namespace

Simulation::Simulation(MPI_Comm comm, const Parameters& parameters)
    : comm_(comm),
      parameters_(parameters),
      n_(parameters.blocks > 0 ? parameters.size / parameters.blocks : 0) {
  if (parameters.blocks < 1 || parameters.size < parameters.blocks ||
      parameters.size % parameters.blocks != 0) {
    throw std::invalid_argument("the number of blocks per axis must divide the size");
  }
  int ranks = 1;
  MPI_Comm_rank(comm_, &rank_);
  MPI_Comm_size(comm_, &ranks);
  const int b = parameters.blocks;
  std::vector<std::array<int, 3>> places;
  for (int z = 0; z < b; ++z) {
    for (int y = 0; y < b; ++y) {
      for (int x = 0; x < b; ++x) places.push_back({x, y, z});
    }
  }
  std::vector<std::size_t> curve(places.size());
  std::iota(curve.begin(), curve.end(), 0);
  std::sort(curve.begin(), curve.end(),
            [&](std::size_t i, std::size_t j) { return morton(places[i]) < morton(places[j]); });
  owners_.resize(places.size());
  localIndex_.assign(places.size(), -1);
  for (std::size_t i = 0; i < curve.size(); ++i) owners_[curve[i]] = static_cast<int>(i) % ranks;
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (owners_[i] != rank_) continue;
    localIndex_[i] = static_cast<int>(blocks_.size());
    Block block{places[i], rank_, {}, {}, {}, {}};
    const std::size_t cells = cell(n_ + 1, n_ + 1, n_ + 1) + 1;
    block.u.assign(cells, 1.0F);
    block.v.assign(cells, 0.0F);
    for (int z = 1; z <= n_; ++z) {
      for (int y = 1; y <= n_; ++y) {
        for (int x = 1; x <= n_; ++x) {
          const auto share = [&](int local, std::size_t axis) {
            return (block.at[axis] * n_ + local - 0.5) / parameters_.size;
          };
          const float v = seededV(share(x, 0), share(y, 1), share(z, 2));
          block.v[cell(x, y, z)] = v;
          if (v > 0.0F) block.u[cell(x, y, z)] = 0.5F;
        }
      }
    }
    block.nextU = block.u;
    block.nextV = block.v;
    blocks_.push_back(std::move(block));
  }
  exchangeHalos();
}

void Simulation::step() {
  for (Block& block : blocks_) react(block);
  for (Block& block : blocks_) {
    std::swap(block.u, block.nextU);
    std::swap(block.v, block.nextV);
  }
  exchangeHalos();
}

void Simulation::setRates(double feed, double kill) {
  parameters_.feed = feed;
  parameters_.kill = kill;
}

void Simulation::react(Block& block) const {
  const auto du = static_cast<float>(parameters_.diffusionU);
  const auto dv = static_cast<float>(parameters_.diffusionV);
  const auto feed = static_cast<float>(parameters_.feed);
  const auto loss = static_cast<float>(parameters_.feed + parameters_.kill);
  const auto dt = static_cast<float>(parameters_.timeStep);
  const std::size_t strideY = cell(0, 1, 0);
  const std::size_t strideZ = cell(0, 0, 1);
  const auto laplacian = [&](const std::vector<float>& f, std::size_t i) {
    return (f[i - 1] + f[i + 1] + f[i - strideY] + f[i + strideY] + f[i - strideZ] + f[i + strideZ]) / 6.0F -
           f[i];
  };
  for (int z = 1; z <= n_; ++z) {
    for (int y = 1; y <= n_; ++y) {
      for (int x = 1; x <= n_; ++x) {
        const std::size_t i = cell(x, y, z);
        const float u = block.u[i];
        const float v = block.v[i];
        const float reaction = u * v * v;
        block.nextU[i] = u + dt * (du * laplacian(block.u, i) - reaction + feed * (1.0F - u));
        block.nextV[i] = v + dt * (dv * laplacian(block.v, i) + reaction - loss * v);
      }
    }
  }
}

int Simulation::indexOf(const std::array<int, 3>& at) const {
  const int b = parameters_.blocks;
  const auto wrap = [b](int i) { return (i + b) % b; };
  return (wrap(at[2]) * b + wrap(at[1])) * b + wrap(at[0]);
}

int Simulation::ownerOf(const std::array<int, 3>& at) const {
  return owners_[static_cast<std::size_t>(indexOf(at))];
}

/// Exchanges one axis after the other, each with the halo of the axes before, so that edges and corners
/// arrive through faces.
void Simulation::exchangeHalos() {
  for (int axis = 0; axis < 3; ++axis) exchangeAxis(axis);
}

void Simulation::exchangeAxis(int axis) {
  std::vector<std::vector<float>> out;
  std::vector<std::vector<float>> in;
  std::vector<std::pair<Block*, Face>> recipients;
  std::vector<MPI_Request> requests;
  const std::size_t maximum = blocks_.size() * 2;
  out.reserve(maximum);  // MPI's addresses must stay valid
  in.reserve(maximum);
  for (Block& block : blocks_) {
    for (const bool above : {false, true}) {
      std::array<int, 3> neighbour = block.at;
      neighbour[static_cast<std::size_t>(axis)] += above ? 1 : -1;
      std::vector<float> values;
      pack(block, {axis, above}, values);
      const auto localNeighbour = localIndex_[static_cast<std::size_t>(indexOf(neighbour))];
      if (localNeighbour >= 0) {
        unpack(blocks_[static_cast<std::size_t>(localNeighbour)], {axis, !above}, values.data());
        continue;
      }
      // The target block and its side identify a message.
      const int size = static_cast<int>(values.size());
      out.push_back(std::move(values));
      in.emplace_back(out.back().size());
      recipients.emplace_back(&block, Face{axis, above});
      requests.resize(requests.size() + 2);
      MPI_Irecv(in.back().data(), size, MPI_FLOAT, ownerOf(neighbour),
                indexOf(block.at) * 2 + (above ? 1 : 0), comm_, &requests[requests.size() - 2]);
      MPI_Isend(out.back().data(), size, MPI_FLOAT, ownerOf(neighbour),
                indexOf(neighbour) * 2 + (above ? 0 : 1), comm_, &requests[requests.size() - 1]);
    }
  }
  MPI_Waitall(static_cast<int>(requests.size()), requests.data(), MPI_STATUSES_IGNORE);
  for (std::size_t i = 0; i < recipients.size(); ++i)
    unpack(*recipients[i].first, recipients[i].second, in[i].data());
}

void Simulation::pack(const Block& block, const Face& face, std::vector<float>& out) const {
  const int layer = face.above ? n_ : 1;
  for (const std::vector<float>* field : {&block.u, &block.v}) {
    for (int b = 0; b < n_ + 2; ++b) {
      for (int a = 0; a < n_ + 2; ++a) {
        out.push_back((*field)[face.axis == 0   ? cell(layer, a, b)
                               : face.axis == 1 ? cell(a, layer, b)
                                                : cell(a, b, layer)]);
      }
    }
  }
}

void Simulation::unpack(Block& block, const Face& face, const float* in) const {
  const int layer = face.above ? n_ + 1 : 0;
  for (std::vector<float>* field : {&block.u, &block.v}) {
    for (int b = 0; b < n_ + 2; ++b) {
      for (int a = 0; a < n_ + 2; ++a) {
        (*field)[face.axis == 0   ? cell(layer, a, b)
                 : face.axis == 1 ? cell(a, layer, b)
                                  : cell(a, b, layer)] = *in++;
      }
    }
  }
}

}  // namespace gray_scott
