// What the tool says to its operator, whose terminal would obey control characters.
#pragma once

#include <string>
#include <string_view>
#include <utility>

namespace vdi::apps {

/// The text with what a terminal would obey or hide as escapes, such as \x1b: control characters, bytes that
/// aren't UTF-8, and characters that turn the direction of writing. Names of files, and texts in files and
/// from servers, may have them.
std::string printable(std::string_view text);

/// Prints "vdi: " and the message, made printable, as one line to standard error.
void say(std::string_view message);

/// Two numbers in six digits, or in as many as tell them apart.
std::pair<std::string, std::string> numbersApart(double a, double b);

}  // namespace vdi::apps
