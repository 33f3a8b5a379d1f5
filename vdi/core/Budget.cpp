#include "vdi/core/Budget.h"

#include "vdi/core/EnumNames.h"

namespace vdi {

namespace {

constexpr EnumNames<Budget> budgetNames{{{Budget::List, "list"}, {Budget::Total, "total"}}};

}  // namespace

const char* toString(Budget budget) {
  return nameOf(budget, budgetNames);
}

Budget budgetFromString(const std::string& name) {
  return namedValue(name, "budget", budgetNames);
}

float SupersegmentHistogram::levelFor(double fill) const {
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
