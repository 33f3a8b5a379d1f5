#include "vdi/core/Budget.h"

#include "vdi/core/Error.h"

namespace vdi {

const char* toString(Budget budget) {
  switch (budget) {
    case Budget::List:
      return "list";
    case Budget::Total:
      return "total";
  }
  return "unknown";
}

Budget budgetFromString(const std::string& name) {
  for (const Budget known : {Budget::List, Budget::Total}) {
    if (name == toString(known)) return known;
  }
  throw Error(ErrorCode::InvalidArgument, "no budget '" + name + "'; there are list and total");
}

float Survey::levelFor(double fill) const {
  const double wanted = fill * static_cast<double>(equally);
  for (std::size_t level = 0; level + 1 < levels; ++level) {
    const auto here = static_cast<double>(supersegments[level]);
    const auto next = static_cast<double>(supersegments[level + 1]);
    if (here <= wanted) return static_cast<float>(level);
    if (next <= wanted)
      return static_cast<float>(static_cast<double>(level) + (here - wanted) / (here - next));
  }
  return static_cast<float>(levels - 1);
}

}  // namespace vdi
