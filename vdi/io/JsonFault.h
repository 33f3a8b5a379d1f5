// Says what is wrong with text that isn't JSON. Not part of the library's interface.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace vdi::io {

/// The fault at which a parser of nlohmann's gave up, in one line. `taken`: the characters that it has taken,
/// one more than `text` has at its end. `id`: the exception's.
std::string jsonFault(std::string_view text, std::size_t taken, int id);

/// The line of the last character taken, from 1 on.
std::size_t lineOf(std::string_view text, std::size_t taken);

}  // namespace vdi::io
