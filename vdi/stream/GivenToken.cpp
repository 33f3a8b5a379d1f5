#include "vdi/stream/GivenToken.h"

#include <optional>

#include "vdi/core/Environment.h"
#include "vdi/stream/Token.h"

namespace vdi::stream {

std::string givenToken(const std::string& file) {
  constexpr const char* variable = "VDI_TOKEN";
  if (!file.empty()) return tokenIn(file);
  const std::optional<std::string> token = environmentText(variable);
  if (token) requireToken(*token, variable);
  return token.value_or("");
}

}  // namespace vdi::stream
