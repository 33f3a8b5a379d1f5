// Text for HTML and XML. Not part of the library's interface.
#pragma once

#include <string>
#include <string_view>

namespace vdi {

/// Escapes the text of elements and of attributes in double quotes. Control characters, which XML lacks,
/// become spaces.
inline std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += static_cast<unsigned char>(c) < ' ' ? ' ' : c;
    }
  }
  return out;
}

}  // namespace vdi
