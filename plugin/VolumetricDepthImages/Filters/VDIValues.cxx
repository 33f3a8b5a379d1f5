#include "VDIValues.h"

#include <vtkDoubleArray.h>
#include <vtkFieldData.h>
#include <vtkImageData.h>
#include <vtkNew.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "vdi/comm/Communicator.h"
#include "vdi/core/ComponentValues.h"

namespace pv {

namespace {

constexpr std::uint64_t mostValues = 4096;

glm::ivec3 placeOf(const vdi::Block& block, std::size_t index) {
  const auto width = static_cast<std::size_t>(block.dims.x);
  const auto height = static_cast<std::size_t>(block.dims.y);
  return {static_cast<int>(index % width), static_cast<int>(index / width % height),
          static_cast<int>(index / (width * height))};
}

bool isMasked(const vdi::Block& block, const glm::ivec3& at) {
  if (!block.masked) return false;
  return std::any_of(block.masked->begin(), block.masked->end(),
                     [&at](const vdi::IndexBox& box) { return box.contains(at); });
}

/// Takes one of each `step` consecutive values. Its place among them varies, so that the sample follows no
/// pattern of rows.
std::vector<double> sampleOf(std::span<const vdi::Block> blocks, std::uint64_t step) {
  constexpr double golden = 0.6180339887498949;
  std::vector<double> values;
  std::uint64_t number = 0;
  for (const vdi::Block& block : blocks) {
    for (std::uint64_t first = 0; first < block.valueCount(); first += step) {
      const double share = static_cast<double>(++number) * golden;
      const auto place = static_cast<std::uint64_t>((share - std::floor(share)) * static_cast<double>(step));
      const std::size_t index = std::min<std::uint64_t>(first + place, block.valueCount() - 1);
      const glm::ivec3 at = placeOf(block, index);
      const double value = vdi::storedValueAt(block, at);
      if (std::isfinite(value) && !isMasked(block, at)) values.push_back(value);
    }
  }
  return values;
}

}  // namespace

std::vector<double> sampleOf(std::span<const vdi::Block> blocks, const vdi::ScalarRange& range,
                             const vdi::comm::Communicator& comm) {
  std::array<std::uint64_t, 1> count{0};
  for (const vdi::Block& block : blocks) count[0] += block.valueCount();
  comm.allReduceSum(count);
  std::vector<double> mine;
  comm.together([&] { mine = sampleOf(blocks, std::max<std::uint64_t>(count[0] / mostValues, 1)); });
  constexpr int root = 0;
  const vdi::comm::Gathered all = comm.gather(std::as_bytes(std::span(mine)), sizeof(double), root);
  if (comm.rank() != root || !(range.min <= range.max)) return {};
  std::vector<double> values(all.bytes.size() / sizeof(double));
  if (!values.empty()) std::memcpy(values.data(), all.bytes.data(), all.bytes.size());
  for (double& value : values) value = std::clamp(value, range.min, range.max);
  values.push_back(range.min);
  values.push_back(range.max);
  return values;
}

void setShownValues(vtkImageData* image, const vdi::ScalarArray& array, std::span<const double> values) {
  // The names of the VDI's own arrays are taken.
  if (array.name.empty() || array.name.starts_with("VDI.") || values.empty()) return;
  vtkNew<vtkDoubleArray> shown;
  shown->SetName(array.name.c_str());
  // The phase gets an array of one component. ParaView shows its magnitude, which is the value itself.
  shown->SetNumberOfComponents(array.component == vdi::phase ? 1 : array.components);
  shown->SetNumberOfTuples(static_cast<vtkIdType>(values.size()));
  shown->Fill(0.0);
  const int component = std::max(array.component, 0);
  for (std::size_t i = 0; i < values.size(); ++i)
    shown->SetComponent(static_cast<vtkIdType>(i), component, values[i]);
  image->GetFieldData()->AddArray(shown);
}

void setShownRange(vtkImageData* image, const vdi::Coloring& coloring) {
  const auto& [low, high] = coloring.range;
  if (low <= high) setShownValues(image, coloring.array, std::array{low, high});
}

}  // namespace pv
