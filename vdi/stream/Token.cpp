#include "vdi/stream/Token.h"

#include <fmt/format.h>
#include <openssl/crypto.h>
#include <openssl/sha.h>
#include <sys/random.h>

#include <algorithm>
#include <cerrno>
#include <string>

#include "vdi/core/Error.h"
#include "vdi/io/Files.h"

namespace vdi::stream {

namespace {

constexpr std::size_t randomBytes = 32;
constexpr std::size_t longestToken = 256;
constexpr std::uint64_t longestFile = 4096;

std::array<unsigned char, SHA256_DIGEST_LENGTH> digestOf(std::string_view text) {
  std::array<unsigned char, SHA256_DIGEST_LENGTH> digest{};
  SHA256(reinterpret_cast<const unsigned char*>(text.data()), text.size(), digest.data());
  return digest;
}

bool standsInLinks(char c) {
  const bool isLetter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
  return isLetter || (c >= '0' && c <= '9') || std::string_view("-._~").find(c) != std::string_view::npos;
}

}  // namespace

std::string randomToken() {
  std::array<unsigned char, randomBytes> bytes{};
  std::size_t filled = 0;
  while (filled < bytes.size()) {
    const ssize_t got = ::getrandom(bytes.data() + filled, bytes.size() - filled, 0);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) throw Error(ErrorCode::Io, "the system has no source of randomness for a token");
    filled += static_cast<std::size_t>(got);
  }
  std::string token;
  for (const unsigned char byte : bytes) token += fmt::format("{:02x}", byte);
  return token;
}

void requireToken(const std::string& token, const std::string& origin) {
  if (token.size() < shortestToken || token.size() > longestToken) {
    throw Error(ErrorCode::InvalidArgument,
                fmt::format("a token has {} to {} characters, this one has {}", shortestToken, longestToken,
                            token.size()),
                origin);
  }
  if (!std::all_of(token.begin(), token.end(), standsInLinks)) {
    throw Error(ErrorCode::InvalidArgument, "a token may only contain letters, digits, '-', '.', '_' and '~'",
                origin);
  }
}

std::string tokenIn(const std::filesystem::path& file) {
  constexpr std::string_view blanks = " \t\r\n";
  const io::InputFile input(file);
  const std::vector<std::byte> bytes = input.read(0, std::min(input.size(), longestFile));
  std::string line(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  line = line.substr(0, line.find('\n'));
  const std::size_t first = line.find_first_not_of(blanks);
  line = first == std::string::npos ? "" : line.substr(first, line.find_last_not_of(blanks) - first + 1);
  requireToken(line, file.string());
  return line;
}

TokenCheck::TokenCheck(std::string_view token) : digest_(digestOf(token)) {
  static_assert(digestBytes == SHA256_DIGEST_LENGTH);
}

bool TokenCheck::accepts(std::string_view token) const {
  // All digests have the same length, so the comparison doesn't reveal the token's length.
  const auto digest = digestOf(token);
  return CRYPTO_memcmp(digest.data(), digest_.data(), digest.size()) == 0;
}

}  // namespace vdi::stream
