// The stream over a process's standard input and output, for `ssh host vdi serve --stdio`: one connection,
// and no port.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "vdi/stream/Server.h"

namespace vdi::stream {

/// The line that comes first, before the HTTP of docs/live.md. Without its end.
std::string greeting(const std::string& token);
/// The token in such a line; none: it's another one, of a shell that says something when it starts.
std::optional<std::string> tokenInGreeting(std::string_view line);

/// Greets, and carries one connection of the server, whose token this is, until either side closes it. The
/// descriptors stay the caller's. The process ignores SIGPIPE. Throws Error{Io} without a socket.
void serveOver(Server& server, const std::string& token, int input, int output);

}  // namespace vdi::stream
