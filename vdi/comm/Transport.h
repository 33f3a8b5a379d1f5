// The ways in which ranks of one host exchange bytes.
#pragma once

#include <string_view>

namespace vdi::comm {

enum class Transport {
  Shared,  // through shared memory, without copying
  Mpi      // by messages, as between hosts
};

/// Parses the value of VDI_TRANSPORT: "shared" or "mpi"; shared if it is empty. Throws Error{InvalidArgument}
/// that lists the valid names.
Transport transportFromText(std::string_view value);

}  // namespace vdi::comm
