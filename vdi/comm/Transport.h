// How ranks of one host pass bytes on.
#pragma once

#include <string_view>

namespace vdi::comm {

enum class Transport {
  Shared,  // they lie in memory that all of them see: nothing is copied
  Mpi      // as between hosts
};

/// `value`, what VDI_TRANSPORT is: "shared" or "mpi"; shared if it's empty. Throws Error{InvalidArgument}
/// that lists the names there are.
Transport transportFromText(std::string_view value);

}  // namespace vdi::comm
