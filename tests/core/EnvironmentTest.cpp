// The table of environment variables, which the user guide repeats for its readers.
#include <fstream>
#include <map>
#include <regex>
#include <string>

#include "tests/Catch.h"
#include "vdi/core/Environment.h"

using namespace vdi;

TEST_CASE("the user guide lists the environment variables, and which of them are for tests") {
  std::map<std::string, bool> listed;  // by name: whether it is for users
  std::ifstream guide(VDI_USER_GUIDE);
  const std::regex row(R"(\| `(VDI_[A-Z_]+)` \| .+ \| (for tests: )?.+ \|)");
  std::smatch match;
  for (std::string line; std::getline(guide, line);)
    if (std::regex_match(line, match, row)) CHECK(listed.emplace(match[1].str(), !match[2].matched).second);
  std::map<std::string, bool> known;
  for (const EnvironmentVariable& variable : environmentVariables())
    known.emplace(variable.name, variable.forUsers);
  CHECK(listed == known);
}
