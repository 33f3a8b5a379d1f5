#include "vdi/comm/GlobalScene.h"

#include <array>
#include <limits>

namespace vdi::comm {

Scene globalScene(const Communicator& comm, const Scene& local) {
  std::array<double, 7> least{
      local.bounds.lo.x,
      local.bounds.lo.y,
      local.bounds.lo.z,
      -local.bounds.hi.x,
      -local.bounds.hi.y,
      -local.bounds.hi.z,
      local.minSpacing > 0.0 ? local.minSpacing : std::numeric_limits<double>::infinity()};
  comm.allReduceMin(least);
  Scene scene;
  scene.bounds.lo = {least[0], least[1], least[2]};
  scene.bounds.hi = {-least[3], -least[4], -least[5]};
  scene.minSpacing = least[6] < std::numeric_limits<double>::infinity() ? least[6] : 0.0;
  return scene;
}

}  // namespace vdi::comm
