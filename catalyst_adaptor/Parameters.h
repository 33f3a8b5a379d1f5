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
  /// Throws std::invalid_argument for one that can't be declared: its name, bounds, or a value out of them.
  static void check(const Parameter& parameter);

  /// The value in force: the parameter's own when its name is declared first. Throws std::invalid_argument
  /// where there are too many, or one of this name is of the other type.
  double declare(const Parameter& parameter);
  /// Sets what has been declared; values out of its bounds are the nearest that is not.
  void set(const std::map<std::string, double>& values);
  /// In the order of their declarations.
  const std::vector<Parameter>& all() const { return all_; }

 private:
  std::vector<Parameter> all_;
};

/// What vdi_catalyst_parameter_f64 and _i64 do. Collective.
double inForce(Calls& self, Parameters& parameters, const char* name, double value, double low, double high);
std::int64_t inForce(Calls& self, Parameters& parameters, const char* name, std::int64_t value,
                     std::int64_t low, std::int64_t high);

}  // namespace vdi::catalyst
