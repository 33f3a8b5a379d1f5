// The token that a user has set.
#pragma once

#include <string>

namespace vdi::stream {

/// The token in `file`, or without a file that in the environment variable VDI_TOKEN; empty if neither is
/// set. Throws Error as tokenIn and requireToken (Token.h).
std::string givenToken(const std::string& file);

}  // namespace vdi::stream
