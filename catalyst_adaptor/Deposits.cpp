#include "catalyst_adaptor/Deposits.h"

#include <array>
#include <cstdio>
#include <exception>

#include "vdi/gpu/DeviceRequest.h"

namespace vdi::catalyst {

namespace {

glm::ivec3 vectorOf(const std::int32_t (&v)[3]) {
  return {v[0], v[1], v[2]};
}
glm::dvec3 vectorOf(const double (&v)[3]) {
  return {v[0], v[1], v[2]};
}

}  // namespace

/// Does nothing unless the blocks have changed since the last call. Collective.
void Deposits::setBlocks(const Fields& fields) {
  if (version_ == fields.version()) return;
  version_.reset();
  std::vector<Block> places;
  comm_.together([&] {
    // No values are read: a block's own address only tells it apart from others.
    for (const vdi_catalyst_block& block : fields.blocks()) {
      places.push_back(Block::fromCells(vectorOf(block.cells), vectorOf(block.origin),
                                        vectorOf(block.spacing), ScalarType::F32, &block,
                                        {vectorOf(block.ghost_lo), vectorOf(block.ghost_hi)}));
    }
  });
  depositor_.setBlocks(places);
  version_ = fields.version();
}

void Deposits::make(Fields& fields, const std::string& name, std::int64_t step) {
  setBlocks(fields);
  comm_.together([&] { fields.fetchParticles(name); });
  const ParticleArray& array = *fields.particlesOf(name);
  DepositedArray made = depositor_.deposit(array.particles, array.kind);
  comm_.together([&] {
    tell(name, made.counts, step);
    fields.setDeposit(name, std::move(made.values));
  });
}

/// Reports each kind of fault once, on rank 0.
void Deposits::tell(const std::string& name, const ParticleCounts& counts, std::int64_t step) {
  struct Kind {
    std::uint64_t count;
    const char* text;
  };
  const std::array<Kind, 3> kinds{{
      {counts.outside, "outside all blocks are left out"},
      {counts.notFinite, "whose position or weight isn't finite are left out"},
      {counts.badLength, "whose smoothing length isn't a number above 0 are deposited by cloud in cell"},
  }};
  unsigned& told = told_[name];
  unsigned now = 0;
  std::string text;
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    if (kinds[i].count == 0) continue;
    now |= 1U << i;
    text += (text.empty() ? "" : ", ") + std::to_string(kinds[i].count) + " " + kinds[i].text;
  }
  if ((now & ~told) == 0) return;
  told |= now;
  if (comm_.rank() != 0) return;
  std::fprintf(
      stderr,
      "vdi_catalyst: step %lld: of the %llu particles of '%s', %s; further such steps aren't reported\n",
      static_cast<long long>(step), static_cast<unsigned long long>(counts.given), name.c_str(),
      text.c_str());
}

DeviceDeposits::DeviceDeposits(int fortranCommunicator)
    : comm_(comm::Communicator::fromMpi(fortranCommunicator)) {}

void DeviceDeposits::open() {
  std::unique_ptr<Deposits> fresh;
  comm_.together([&] {
    device_ = gpu::Device::create(gpu::requestFromEnvironment(comm_.localRank()));
    fresh = std::make_unique<Deposits>(device_, comm_);
    if (deposits_) fresh->continueTelling(*deposits_);
  });
  deposits_ = std::move(fresh);
}

void DeviceDeposits::make(Fields& fields, std::int64_t step) {
  for (const auto& [name, array] : fields.particles()) make(fields, name, step);
}

void DeviceDeposits::make(Fields& fields, const std::string& name, std::int64_t step) {
  if (!deposits_) open();
  std::exception_ptr failure;
  try {
    deposits_->make(fields, name, step);
    return;
  } catch (...) {  // thrown on all ranks, but not the same exception on each
    failure = std::current_exception();
  }
  if (!comm_.anyTogether([&] { return device_->isLost(); })) std::rethrow_exception(failure);
  open();
  deposits_->make(fields, name, step);
}

}  // namespace vdi::catalyst
