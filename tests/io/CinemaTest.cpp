// The index of a Cinema database: its text, and the existing indices that it continues or refuses.
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "tests/Catch.h"
#include "tests/TemporaryFolder.h"
#include "vdi/core/Error.h"
#include "vdi/io/Cinema.h"

using namespace vdi;

namespace {

class Database {
 public:
  Database() { std::filesystem::create_directories(folder); }
  std::string text() const {
    std::ifstream file(folder / "data.csv");
    return {std::istreambuf_iterator<char>(file), {}};
  }
  void write(const std::string& text) const { std::ofstream(folder / "data.csv") << text; }

  const test::TemporaryFolder parent;
  const std::filesystem::path folder = parent.path() / "a.cdb";
};

}  // namespace

TEST_CASE("a Cinema index has a line for each picture") {
  const Database database;
  io::CinemaIndex index(database.folder, false);
  index.add({0.5, 30.0, -45.0, "a.png"});
  index.add({0.5, 0.1, 0.0, "b.png"});
  index.write();
  CHECK(database.text() == "time,phi,theta,FILE\n0.5,30,-45,a.png\n0.5,0.1,0,b.png\n");
  index.add({1.0, 60.0, -45.0, "a.png"});
  index.write();
  CHECK(database.text() == "time,phi,theta,FILE\n1,60,-45,a.png\n0.5,0.1,0,b.png\n");
}

TEST_CASE("a Cinema index continues an existing one, or begins again") {
  const Database database;
  database.write("time,phi,theta,FILE\r\n0,0,0,a.png\n\n1,0,0,b.png");
  io::CinemaIndex kept(database.folder, true);
  kept.add({2.0, 0.0, 0.0, "b.png"});
  kept.write();
  CHECK(database.text() == "time,phi,theta,FILE\n0,0,0,a.png\n2,0,0,b.png\n");
  const io::CinemaIndex anew(database.folder, false);
  anew.write();
  CHECK(database.text() == "time,phi,theta,FILE\n");
}

TEST_CASE("a Cinema index of several fields names them") {
  const Database database;
  io::CinemaIndex index(database.folder, false, true);
  index.add({0.5, 30.0, -45.0, "a.png", "V"});
  index.write();
  CHECK(database.text() == "time,phi,theta,field,FILE\n0.5,30,-45,V,a.png\n");
  CHECK_NOTHROW(io::CinemaIndex(database.folder, true, true));
  CHECK_THROWS_WITH(io::CinemaIndex(database.folder, true),
                    test::ContainsSubstring("columns time,phi,theta,FILE"));
}

TEST_CASE("an index of other columns isn't gone on with") {
  const Database database;
  for (const char* text : {"time,FILE\n0,a.png\n", "time,phi,theta,FILE\n0,0,a.png\n", "0,0,0,a.png\n"}) {
    database.write(text);
    CHECK_THROWS_WITH(io::CinemaIndex(database.folder, true), test::ContainsSubstring("data.csv"));
  }
}

TEST_CASE("an index whose folder is missing says so") {
  const io::CinemaIndex index("/none/at/all.cdb", true);
  CHECK_THROWS_AS(index.write(), Error);
}
