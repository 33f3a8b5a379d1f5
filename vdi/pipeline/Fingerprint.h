// What ranks compare to see that they were given the same. Not part of the library's interface.
#pragma once

#include <cstdint>

namespace vdi {
struct Camera;
struct GenerateSettings;
struct TransferFunction;
}  // namespace vdi

namespace vdi::detail {

/// Equal for equal values on every rank, and different otherwise but by a chance of 2^-64.
std::uint64_t fingerprintOf(const Camera& camera);
std::uint64_t fingerprintOf(const TransferFunction& function);
std::uint64_t fingerprintOf(const GenerateSettings& settings);

}  // namespace vdi::detail
