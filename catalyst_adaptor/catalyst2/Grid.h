// The uniform grids of a Catalyst channel, as vdi_catalyst.h takes them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "catalyst_adaptor/catalyst2/Node.h"
#include "catalyst_adaptor/memory/GpuMemory.h"
#include "catalyst_adaptor/vdi_catalyst.h"

namespace vdi::catalyst {

/// This rank's blocks and arrays. The values stay where the simulation has them, except for vectors whose
/// components lie at uneven distances: these are copied side by side.
class Grid {
 public:
  /// Association, components, name. Arrays that differ in these between ranks or blocks aren't shown, nor are
  /// those of more than maxComponents.
  using Key = std::tuple<std::int32_t, std::int32_t, std::string>;
  struct Array {
    std::int32_t type = VDI_CATALYST_F64;
    std::vector<const void*> data;              // one for each block
    std::vector<vdi_catalyst_strides> strides;  // one for each block
    std::vector<double> missing;                // numbers that stand for missing values in any block
  };

  /// Replaces blocks and arrays by those of `data`: a domain, or any number of domains in lists or objects.
  /// Without data there are no blocks. Returns whether blocks, arrays and the places of all values are as
  /// before. Throws std::invalid_argument unless all domains are uniform grids in three dimensions.
  bool read(const std::optional<Node>& data);

  /// Where the values that `read` itself needs are read: marks of ghost cells, and vectors that are copied.
  GpuMemory& gpuMemory() { return gpuMemory_; }
  const std::vector<vdi_catalyst_block>& blocks() const { return blocks_; }
  /// The arrays that all blocks have.
  const std::map<Key, Array>& arrays() const { return arrays_; }
  /// The names of the fields that some blocks lack, or have with another type.
  const std::vector<std::string>& leftOut() const { return leftOut_; }

 private:
  void leaveOutPartial();
  void leaveOut(const std::string& name);
  void addDomains(const Node& node, int depth);
  void addDomain(const Node& domain);
  void addField(const Node& field, const vdi_catalyst_block& block);
  const std::byte* copySideBySide(const Node& values, const std::vector<Leaf>& components);

  GpuMemory gpuMemory_;
  std::vector<vdi_catalyst_block> blocks_;
  std::map<Key, Array> arrays_;
  std::vector<std::string> leftOut_;
  /// Copies of values, kept from step to step so that their addresses stay the same.
  std::vector<std::vector<std::byte>> copies_;
  std::size_t copiesUsed_ = 0;
};

}  // namespace vdi::catalyst
