// What ranks compare to see that they were given the same. Not part of the library's interface.
#pragma once

#include <vector>

#include "vdi/comm/Communicator.h"

namespace vdi {
struct Camera;
struct GenerateSettings;
struct TransferFunction;
}  // namespace vdi

namespace vdi::detail {

/// For Communicator::requireEqual, one for each value that a user sets. Equal for equal values on every rank,
/// and different otherwise but by a chance of 2^-64.
std::vector<comm::Communicator::Fingerprint> fingerprintsOf(const Camera& camera,
                                                            const TransferFunction& function,
                                                            const GenerateSettings& settings);

}  // namespace vdi::detail
