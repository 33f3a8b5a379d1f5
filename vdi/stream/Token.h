// The secret that a viewer has to know.
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

namespace vdi::stream {

/// The fewest characters of a token. Those of randomToken have 64.
inline constexpr std::size_t shortestToken = 16;

/// 32 bytes from the system's source of randomness, in hexadecimal. Throws Error{Io} without one.
std::string randomToken();
/// The first line of a file, without blanks around it. Throws Error: Io if it can't be read, InvalidArgument
/// as requireToken does; messages have the path, never the token.
std::string tokenIn(const std::filesystem::path& file);
/// Throws Error{InvalidArgument} unless the token has at least shortestToken characters, at most 256, all of
/// them letters, digits, '-', '.', '_' or '~', because links contain it. `origin` names its source.
void requireToken(const std::string& token, const std::string& origin);

/// Compares tokens in a time that reveals nothing about the right one, of which it keeps only a digest.
class TokenCheck {
 public:
  explicit TokenCheck(std::string_view token);
  bool accepts(std::string_view token) const;

 private:
  static constexpr std::size_t digestBytes = 32;
  std::array<unsigned char, digestBytes> digest_;
};

}  // namespace vdi::stream
