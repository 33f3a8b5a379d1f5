#include "vdi/comm/GlobalScene.h"

#include <array>
#include <limits>

namespace vdi::comm {

Scene globalScene(const Communicator& comm, const Scene& local) {
  std::array<double, 7> minimum{
      local.bounds.lo.x,
      local.bounds.lo.y,
      local.bounds.lo.z,
      -local.bounds.hi.x,
      -local.bounds.hi.y,
      -local.bounds.hi.z,
      local.minSpacing > 0.0 ? local.minSpacing : std::numeric_limits<double>::infinity()};
  comm.allReduceMin(minimum);
  Scene scene;
  scene.bounds.lo = {minimum[0], minimum[1], minimum[2]};
  scene.bounds.hi = {-minimum[3], -minimum[4], -minimum[5]};
  scene.minSpacing = minimum[6] < std::numeric_limits<double>::infinity() ? minimum[6] : 0.0;
  return scene;
}

}  // namespace vdi::comm
