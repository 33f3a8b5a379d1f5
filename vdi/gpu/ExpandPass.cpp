#include "vdi/gpu/ExpandPass.h"

namespace vdi::gpu {

namespace {

std::uint64_t tilesOf(const glm::ivec2& lists, int size) {
  const glm::ivec2 tiles = (lists + size - 1) / size;
  return static_cast<std::uint64_t>(tiles.x) * static_cast<std::uint64_t>(tiles.y);
}

std::uint64_t invocations(const shared::ExpandConstants& constants) {
  if (constants.mode == shared::expandModeSegments) return constants.count;
  if (constants.mode == shared::expandModeBins) return 1;
  if (constants.mode == shared::expandModeTiles) return tilesOf(constants.lists, shared::renderTile);
  if (constants.mode == shared::expandModeLargeTiles)
    return tilesOf(constants.lists, shared::renderLargeTile);
  return static_cast<std::uint64_t>(constants.lists.x) * static_cast<std::uint64_t>(constants.lists.y);
}

}  // namespace

std::uint64_t tileCount(const glm::ivec2& lists) {
  return tilesOf(lists, shared::renderTile) + tilesOf(lists, shared::renderLargeTile);
}

ExpandPass::ExpandPass(std::shared_ptr<Device> device)
    : pipelines_(std::move(device), infoOf<shared::ExpandConstants>("expand")) {}

void ExpandPass::record(Commands& commands, const shared::ExpandConstants& constants) {
  const std::uint64_t count = invocations(constants);
  if (count == 0) return;
  commands.dispatchMany(pipelines_.with({0, 0, constants.form.encoding}), constants, count,
                        shared::expandGroup);
}

}  // namespace vdi::gpu
