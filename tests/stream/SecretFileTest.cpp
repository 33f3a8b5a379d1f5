// The file with the link.
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <optional>
#include <string>

#include "tests/Catch.h"
#include "tests/TemporaryFolder.h"
#include "vdi/stream/SecretFile.h"

using namespace vdi;
using namespace vdi::stream;

namespace {

/// Changes the working directory until this object ends.
class WorkingDirectory {
 public:
  explicit WorkingDirectory(const std::filesystem::path& path) { std::filesystem::current_path(path); }
  ~WorkingDirectory() { std::filesystem::current_path(before_); }
  WorkingDirectory(const WorkingDirectory&) = delete;
  WorkingDirectory& operator=(const WorkingDirectory&) = delete;

 private:
  std::filesystem::path before_ = std::filesystem::current_path();
};

std::string lineIn(const std::filesystem::path& file) {
  std::string line;
  std::getline(std::ifstream(file), line);
  return line;
}

}  // namespace

TEST_CASE("a secret file goes with its object, wherever the program works then") {
  const test::TemporaryFolder first;
  const test::TemporaryFolder second;
  std::ofstream(second.path() / "link") << "another's\n";
  {
    const WorkingDirectory outer(first.path());
    std::optional<SecretFile> secret;
    secret.emplace("link", "http://here/");
    CHECK(lineIn(first.path() / "link") == "http://here/");
    struct stat status {};
    REQUIRE(::stat((first.path() / "link").c_str(), &status) == 0);
    CHECK((status.st_mode & 0777U) == 0600U);
    const WorkingDirectory inner(second.path());
    secret.reset();
  }
  CHECK(first.fileCount() == 0);
  CHECK(lineIn(second.path() / "link") == "another's");
}

TEST_CASE("a secret file that another has replaced stays") {
  const test::TemporaryFolder folder;
  const std::string path = (folder.path() / "link").string();
  std::optional<SecretFile> before;
  before.emplace(path, "http://before/");
  std::optional<SecretFile> after;
  after.emplace(path, "http://after/");
  before.reset();
  CHECK(lineIn(path) == "http://after/");
  after.reset();
  CHECK(folder.fileCount() == 0);
}
