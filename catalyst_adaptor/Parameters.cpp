#include "catalyst_adaptor/Parameters.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <utility>

namespace vdi::catalyst {

namespace {

// The limits of vdi/stream/Steering.h.
constexpr std::size_t mostParameters = 64;
constexpr std::size_t longestName = 64;
constexpr std::string_view letters = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-.";

/// A number that is equal for equal declarations. Values may differ between ranks, because the first rank's
/// counts.
std::int64_t fingerprintOf(const Parameter& parameter) {
  std::size_t hash = std::hash<std::string>()(parameter.name);
  for (const double number : {parameter.isWhole ? 1.0 : 0.0, parameter.low, parameter.high})
    hash = hash * 31U + std::hash<double>()(number);
  return static_cast<std::int64_t>(hash >> 1U);
}

[[noreturn]] void failFor(const Parameter& parameter, const char* what) {
  throw std::invalid_argument("the parameter \"" + parameter.name + "\" " + what);
}

/// The value in force; nullopt after an error, which has been reported.
std::optional<double> valueOf(Calls& self, Parameters& parameters, const char* name, Parameter parameter) {
  self.error.clear();  // afterwards, its text tells whether this call failed
  int rank = 0;
  MPI_Comm_rank(self.comm, &rank);
  const Parameter* known = nullptr;  // on all ranks or on none, once they have agreed on the name
  int code = guarded(self, VDI_CATALYST_BAD_ARGUMENT, [&] {
    require(name != nullptr, "a parameter needs a name");
    parameter.name = name;
    parameters.prepare(parameter);
    known = parameters.find(parameter.name);
    if (known == nullptr && rank == 0) Parameters::checkValue(parameter);
  });
  if (code != VDI_CATALYST_OK) return std::nullopt;
  code = guarded(self, VDI_CATALYST_BAD_ARGUMENT, [&] {
    requireEqual(self.comm, fingerprintOf(known != nullptr ? *known : parameter),
                 "the ranks ask for different parameters");
  });
  if (code != VDI_CATALYST_OK) return std::nullopt;
  double value = known != nullptr ? known->value : parameter.value;
  MPI_Bcast(&value, 1, MPI_DOUBLE, 0, self.comm);
  if (known != nullptr) return value;
  parameter.value = value;
  parameters.declare(std::move(parameter));
  return value;
}

}  // namespace

const Parameter* Parameters::find(const std::string& name) const {
  const auto found = std::ranges::find(all_, name, &Parameter::name);
  return found != all_.end() ? &*found : nullptr;
}

void Parameters::prepare(const Parameter& parameter) {
  if (const Parameter* known = find(parameter.name)) {
    if (known->isWhole != parameter.isWhole) failFor(parameter, "was declared with another type");
    return;
  }
  const std::string& name = parameter.name;
  if (name.empty() || name.size() > longestName || name.find_first_not_of(letters) != std::string::npos)
    throw std::invalid_argument("a parameter's name has 1 to 64 letters, digits, \"_\", \"-\" and \".\"");
  if (!std::isfinite(parameter.low) || !std::isfinite(parameter.high))
    failFor(parameter, "has bounds that aren't finite");
  constexpr double largestWhole = 9007199254740992.0;  // doubles represent all whole numbers up to it
  if (parameter.isWhole && std::max(std::abs(parameter.low), std::abs(parameter.high)) > largestWhole)
    failFor(parameter, "has bounds beyond 2^53");
  if (all_.size() >= mostParameters) throw std::invalid_argument("a run can have at most 64 parameters");
  all_.reserve(mostParameters);
}

void Parameters::checkValue(const Parameter& parameter) {
  if (!(parameter.low <= parameter.value && parameter.value <= parameter.high))
    failFor(parameter, "is out of its bounds");
}

void Parameters::declare(Parameter parameter) noexcept {
  all_.push_back(std::move(parameter));
}

void Parameters::set(const std::map<std::string, double>& values) {
  for (Parameter& parameter : all_) {
    const auto found = values.find(parameter.name);
    if (found != values.end()) parameter.value = std::clamp(found->second, parameter.low, parameter.high);
  }
}

double inForce(Calls& self, Parameters& parameters, const char* name, double value, double low, double high) {
  return valueOf(self, parameters, name, {"", false, value, low, high}).value_or(value);
}

std::int64_t inForce(Calls& self, Parameters& parameters, const char* name, std::int64_t value,
                     std::int64_t low, std::int64_t high) {
  const auto number = [](std::int64_t whole) { return static_cast<double>(whole); };
  const std::optional<double> found =
      valueOf(self, parameters, name, {"", true, number(value), number(low), number(high)});
  return found ? static_cast<std::int64_t>(*found) : value;
}

}  // namespace vdi::catalyst
