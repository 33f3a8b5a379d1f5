#include "VDILoad.h"

#include <vtkAlgorithm.h>
#include <vtkCommunicator.h>
#include <vtkDataObject.h>
#include <vtkMultiProcessController.h>

#include <algorithm>
#include <array>
#include <cstring>

#include "VDIArrays.h"
#include "vdi/core/ComponentValues.h"
#include "vdi/core/Error.h"
#include "vdi/core/Scene.h"

namespace pv {

namespace {

template <std::size_t n>
void allReduceMin(std::array<double, n>& values, vtkMultiProcessController* controller) {
  if (controller == nullptr || controller->GetNumberOfProcesses() <= 1) return;
  const auto mine = values;
  controller->AllReduce(mine.data(), values.data(), static_cast<vtkIdType>(n), vtkCommunicator::MIN_OP);
}

/// The number of the smallest voxels that fill a unit of volume; 0 without blocks.
double mostPerVolume(const std::vector<vdi::Block>& blocks) {
  double most = 0.0;
  for (const vdi::Block& block : blocks) {
    const double volume = block.spacing.x * block.spacing.y * block.spacing.z;
    if (volume > 0.0) most = std::max(most, 1.0 / volume);
  }
  return most;
}

/// Collective: stretches four components together as Volume does.
OpacityStretch stretchOf(std::vector<vdi::Block>& blocks, vtkMultiProcessController* controller) {
  std::array<vdi::ScalarRange, 4> ranges;
  double top = 0.0;
  bool isExact = false;
  for (const vdi::Block& block : blocks) {
    if (block.colors.size() != 3) continue;  // the generator rejects it
    const vdi::Block& red = block.colors.front();
    top = red.displayed.y;
    isExact = red.type != vdi::ScalarType::F32 && vdi::sizeOf(red.type) >= 4;
    for (std::size_t c = 0; c < 3 && isExact; ++c) ranges[c].include(vdi::ownRange(block.withColors(c)));
    ranges[3].include(vdi::ownRange(block));
  }
  std::array<double, 9> least{isExact ? 0.0 : -top};
  for (std::size_t c = 0; c < 4; ++c) {
    least[2 * c + 1] = ranges[c].min;
    least[2 * c + 2] = -ranges[c].max;
  }
  allReduceMin(least, controller);
  for (std::size_t c = 0; c < 3; ++c) {
    const glm::dvec2 ends(least[2 * c + 1], -least[2 * c + 2]);
    for (vdi::Block& block : blocks) {
      if (isExact && ends.x < ends.y && c < block.colors.size()) block.colors[c].displayed = ends;
    }
  }
  return {{least[7], -least[8]}, -least[0]};
}

}  // namespace

void requireInput(vtkDataObject* input) {
  if (input != nullptr && std::strcmp(input->GetClassName(), "vtkDataObject") != 0) return;
  throw vdi::Error(vdi::ErrorCode::InvalidArgument,
                   "the input has no data; in a Catalyst script, TrivialProducer(registrationName=...) names "
                   "what the simulation hands over, \"grid\" for vdi_catalyst");
}

Load loadOf(vtkDataObject* input, vtkAlgorithm* upstream, const Origin& origin) {
  requireInput(input);
  Load load{.of = origin, .blocks = {}, .array = {}, .lack = lackOf(input, upstream, origin.choice)};
  // ParaView may have added the missing array by averaging the one of the other association.
  if (load.lack.empty()) load.blocks = blocksOf(input, origin.choice);
  return load;
}

vdi::Box complete(Load& load, vtkDataObject* input, vtkMultiProcessController* controller) {
  const vdi::Box own = vdi::localScene(load.blocks).bounds;
  const double components = componentsOf(input, load.of.choice);
  const bool lacksArray = !load.lack.empty();
  std::array<double, 10> least{own.lo.x,
                               own.lo.y,
                               own.lo.z,
                               -own.hi.x,
                               -own.hi.y,
                               -own.hi.z,
                               -components,
                               -mostPerVolume(load.blocks),
                               lacksArray ? -1.0 : 0.0,
                               load.blocks.empty() ? 0.0 : -1.0};
  allReduceMin(least, controller);
  if (least[8] < 0.0 && least[9] == 0.0) {
    if (lacksArray) throw vdi::Error(vdi::ErrorCode::InvalidArgument, load.lack);
    throw vdi::Error(vdi::ErrorCode::RemoteRank, "other ranks' blocks lack the array");
  }
  const int count = std::max(static_cast<int>(-least[6]), 1);  // 0: no rank has the array
  load.array = {.name = load.of.choice.name,
                .cells = load.of.choice.cells,
                .components = count,
                .component = count > 1 ? vdi::legendComponent(load.of.choice.component, count) : 0};
  if (load.of.choice.component == vdi::together && count == 4)
    load.stretch = stretchOf(load.blocks, controller);
  load.voxelVolume = least[7] < 0.0 ? -1.0 / least[7] : 0.0;
  return {{least[0], least[1], least[2]}, {-least[3], -least[4], -least[5]}};
}

}  // namespace pv
