// The token that a user has set.
#pragma once

#include <string>

namespace vdi::stream {

/// The token in that file, if one is named, or in the environment variable VDI_TOKEN; empty: neither. Throws
/// Error as tokenIn and requireToken (Token.h).
std::string givenToken(const std::string& file);

}  // namespace vdi::stream
