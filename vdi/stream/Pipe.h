// The stream over a process's standard input and output, for `ssh host vdi serve --stdio`: one connection,
// and no port.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "vdi/stream/Server.h"

namespace vdi::stream {

/// The line that precedes the HTTP of docs/live.md, without a line end.
std::string greeting(const std::string& token);
/// The token in a greeting; nullopt for another line, such as one that a shell writes when it starts.
std::optional<std::string> tokenInGreeting(std::string_view line);

/// Writes the greeting with the server's token, then carries one connection of the server until either side
/// closes it. The descriptors stay the caller's. The process must ignore SIGPIPE. Throws Error{Io}.
void serveOver(Server& server, const std::string& token, int input, int output);

}  // namespace vdi::stream
