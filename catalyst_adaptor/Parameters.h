// The parameters that a simulation declares, and their values in force.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "catalyst_adaptor/Calls.h"

namespace vdi::catalyst {

struct Parameter {
  std::string name;
  bool isWhole = false;
  double value = 0.0;
  double low = 0.0;
  double high = 0.0;
};

class Parameters {
 public:
  /// Throws std::invalid_argument for a parameter that can't be declared: because of its name or bounds, or a
  /// value outside them.
  static void check(const Parameter& parameter);

  /// Returns the value in force, which is the parameter's own when its name is declared first. Throws
  /// std::invalid_argument if there are too many parameters, or the name has another type already.
  double declare(const Parameter& parameter);
  /// Sets declared parameters. A value outside the bounds becomes the nearest one inside.
  void set(const std::map<std::string, double>& values);
  /// All parameters in the order of declaration.
  const std::vector<Parameter>& all() const { return all_; }

 private:
  std::vector<Parameter> all_;
};

/// These functions implement vdi_catalyst_parameter_f64 and _i64. Collective.
double inForce(Calls& self, Parameters& parameters, const char* name, double value, double low, double high);
std::int64_t inForce(Calls& self, Parameters& parameters, const char* name, std::int64_t value,
                     std::int64_t low, std::int64_t high);

}  // namespace vdi::catalyst
