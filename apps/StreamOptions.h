// Options that vdi serve and vdi receive share.
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace vdi::apps {

/// --token-file.
void addTokenOption(CLI::App& command, std::string& file, const std::string& otherwise);
/// The token in the file, or in the environment variable VDI_TOKEN; empty: neither. Throws Error as
/// stream::tokenIn and stream::requireToken.
std::string givenToken(const std::string& file);

/// "100Mbit", "1Gbit", "5MB": bytes a second; 0 for an empty text. Decimal prefixes. Throws
/// Error{InvalidArgument} for what requireRate refuses.
double bytesPerSecond(const std::string& rate);
/// For CLI11: empty, or why it isn't a rate.
std::string requireRate(const std::string& text);

}  // namespace vdi::apps
