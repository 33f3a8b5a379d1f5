// Options that vdi serve and vdi receive share.
#pragma once

#include <span>
#include <string>

#include "vdi/stream/Client.h"

namespace CLI {
class App;
}

namespace vdi::apps {

/// The source of frames. It is a link, whose token may be in the file or in VDI_TOKEN, or a command
/// for `sh -c` that runs `vdi serve --stdio`. Throws Error{InvalidArgument} for a link without a
/// token, and as givenToken.
stream::ClientOptions clientOf(const std::string& from, const std::string& tokenFile);

/// The token that the user has set, as stream::givenToken returns it. Prints a line if others can
/// read the file.
std::string tokenOf(const std::string& file);

/// Overwrites the tokens of links with x in the program's arguments, which other users of the
/// machine can list.
void hideTokens(std::span<char* const> arguments);

/// Adds --token-file.
void addTokenOption(CLI::App& command, std::string& file, const std::string& otherwise);

/// Converts "100Mbit", "1Gbit" or "5MB" to bytes per second, with decimal prefixes; an empty text
/// to 0. Throws Error{InvalidArgument} for texts that requireRate rejects.
double bytesPerSecond(const std::string& rate);
/// Checks for CLI11: empty, or the reason why the text is not a rate, or not an origin as browsers
/// send it.
std::string requireRate(const std::string& text);
std::string requireOrigin(const std::string& text);

}  // namespace vdi::apps
