// Options that vdi serve and vdi receive share.
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace vdi::apps {

/// Adds --token-file.
void addTokenOption(CLI::App& command, std::string& file, const std::string& otherwise);

/// Bytes a second of "100Mbit", "1Gbit" or "5MB", with decimal prefixes; 0 for an empty text. Throws
/// Error{InvalidArgument} for texts that requireRate rejects.
double bytesPerSecond(const std::string& rate);
/// A check for CLI11: empty, or the reason why the text is not a rate.
std::string requireRate(const std::string& text);

}  // namespace vdi::apps
