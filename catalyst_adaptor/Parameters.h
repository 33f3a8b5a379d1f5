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
  /// The declared parameter of that name; null if there is none.
  const Parameter* find(const std::string& name) const;
  /// Throws std::invalid_argument if the parameter can't be declared because of its name or bounds, or
  /// because there are too many, or if it was declared with another type. The bounds of a declared parameter
  /// don't matter. Afterwards, `declare` can't fail.
  void prepare(const Parameter& parameter);
  /// Throws std::invalid_argument if the value is outside the bounds.
  static void checkValue(const Parameter& parameter);
  /// Declares a parameter, which has been prepared.
  void declare(Parameter parameter) noexcept;
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
