// The watch of a folder, by the system's reports and by listing.
#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "apps/FolderWatch.h"
#include "tests/Catch.h"
#include "tests/TemporaryFolder.h"
#include "vdi/core/Error.h"

using namespace vdi;
using namespace vdi::apps;

namespace {

void write(const std::filesystem::path& file, const std::string& text) {
  std::ofstream(file) << text;
}

std::vector<std::string> namesOf(const std::vector<std::filesystem::path>& files) {
  std::vector<std::string> names;
  names.reserve(files.size());
  for (const std::filesystem::path& file : files) names.push_back(file.filename().string());
  return names;
}

using Names = std::vector<std::string>;

}  // namespace

TEST_CASE("a watch names new, changed and vanished files") {
  const test::TemporaryFolder folder;
  write(folder.path() / "b10.vdi", "old");
  write(folder.path() / "b2.vdi", "old");
  FolderWatch watch(folder.path());
  CHECK(namesOf(watch.changed().files) == Names{"b2.vdi", "b10.vdi"});

  // The system reports these. If the next listing is due already, it finds the same.
  write(folder.path() / "b3.vdi", "new");
  write(folder.path() / "b2.vdi", "longer");
  write(folder.path() / ".part.vdi", "hidden");
  write(folder.path() / "notes.txt", "no VDI");
  std::filesystem::create_symlink("b3.vdi", folder.path() / "latest.vdi");
  std::filesystem::create_directory(folder.path() / "folder.vdi");
  std::filesystem::remove(folder.path() / "b10.vdi");
  FolderWatch::Changes changes = watch.changed();
  CHECK(namesOf(changes.files) == Names{"b2.vdi", "b3.vdi"});
  CHECK(namesOf(changes.gone) == Names{"b10.vdi"});

  std::this_thread::sleep_for(watch.untilListing());
  changes = watch.changed();  // lists
  CHECK(changes.files.empty());
  CHECK(changes.gone.empty());
  CHECK(watch.untilListing() > std::chrono::milliseconds(0));
}

TEST_CASE("a watch follows the name of its folder") {
  const test::TemporaryFolder parent;
  const std::filesystem::path folder = parent.path() / "live";
  std::filesystem::create_directory(folder);
  write(folder / "a.vdi", "first");
  FolderWatch watch(folder);
  CHECK(watch.changed().files.size() == 1);
  std::filesystem::rename(folder, parent.path() / "former");
  CHECK_THROWS_AS(watch.changed(), Error);
  std::filesystem::create_directory(folder);
  write(folder / "b.vdi", "second");
  write(parent.path() / "former" / "c.vdi", "elsewhere");
  const FolderWatch::Changes changes = watch.changed();
  CHECK(namesOf(changes.files) == Names{"b.vdi"});
  CHECK(namesOf(changes.gone) == Names{"a.vdi"});
}
