// Fingerprints by which ranks check that they got the same arguments. Not part of the library's interface.
#pragma once

#include <vector>

#include "vdi/comm/Communicator.h"

namespace vdi {
struct Camera;
struct GenerateSettings;
struct TransferFunction;
}  // namespace vdi

namespace vdi::detail {

/// Arguments of Communicator::requireEqual, one for each value that a user sets. Equal values have equal
/// fingerprints on every rank; different ones have equal fingerprints with a chance of 2^-64.
std::vector<comm::Communicator::Fingerprint> fingerprintsOf(const Camera& camera,
                                                            const TransferFunction& function,
                                                            const GenerateSettings& settings);

}  // namespace vdi::detail
