#include "vdi/core/Parallel.h"

#include <sched.h>

#include <thread>

namespace vdi {

std::size_t usableCores() {
  cpu_set_t cores;
  if (sched_getaffinity(0, sizeof(cores), &cores) == 0) return static_cast<std::size_t>(CPU_COUNT(&cores));
  return std::max(std::thread::hardware_concurrency(), 1U);
}

}  // namespace vdi
