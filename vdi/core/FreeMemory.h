// The memory that this process may still take.
#pragma once

#include <cstdint>

namespace vdi {

/// Bytes that the machine can give without swapping, and that the process' control group may take. If neither
/// says, the largest number. Linux gives more than it has, and later ends the process that uses it: ask
/// before taking much.
std::uint64_t availableHostBytes();

/// Throws Error{OutOfMemory} with both sizes if `what` ("the VDI") needs more. Doesn't ask for less than 64
/// MiB.
void requireHostBytes(std::uint64_t bytes, const char* what);

}  // namespace vdi
