// A step's blocks, arrays, particles and parameters in memory that two processes share.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <string>
#include <vector>

#include "catalyst_adaptor/Fields.h"
#include "catalyst_adaptor/Parameters.h"
#include "catalyst_adaptor/ParticleArray.h"
#include "catalyst_adaptor/vdi_catalyst.h"

namespace vdi::catalyst {

/// The fields of a run that are handed over.
struct StepFields {
  struct NamedParticles {
    std::string name;
    ParticleArray array;
    glm::dvec3 offset{0.0};         // the offset, in cells, of the array that the particles become
    std::vector<double> missing{};  // the numbers that stand for its missing values
  };
  std::vector<Fields::NamedArray> arrays;
  std::vector<NamedParticles> particles;
};

/// Places a step's data. The simulation makes one for each step that it hands over.
class StepWriter {
 public:
  /// The fields are those of blocks with this version's number.
  StepWriter(std::uint64_t version, const std::vector<vdi_catalyst_block>& blocks, StepFields fields,
             const std::vector<Parameter>& parameters);
  std::uint64_t bytes() const { return bytes_; }
  /// Copies all values, as they are now, and their descriptions. `to` has room for `bytes()`.
  void write(std::span<std::byte> to) const;

 private:
  StepFields fields_;
  std::vector<std::uint64_t>
      offsets_;  // first those of arrays' blocks that have values, then those of particles' columns
  std::vector<std::byte> head_;
  std::uint64_t bytes_ = 0;
};

/// A step as the other process finds it.
struct StepData {
  struct Array {
    std::string name;
    bool cells = false;
    std::int32_t type = VDI_CATALYST_F64;
    std::int32_t components = 1;
    double offset[3] = {};
    std::vector<double> missing;
    std::vector<const void*> blocks;  // values in VTK's order; null where a block lacks the array
  };
  struct Particles {
    std::string name;
    double offset[3] = {};
    std::vector<double> missing;
    vdi_catalyst_particles given{};
  };
  std::uint64_t version = 0;  // another number means other blocks
  std::vector<vdi_catalyst_block> blocks;
  std::vector<Array> arrays;
  std::vector<Particles> particles;
  std::vector<Parameter> parameters;

  /// Reads what a StepWriter has written. Values stay in `from`. Throws std::runtime_error if it is damaged.
  static StepData read(std::span<const std::byte> from);
};

}  // namespace vdi::catalyst
