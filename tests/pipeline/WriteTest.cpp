// A frame written to a file by all ranks equals the gathered frame.
#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "tests/Catch.h"
#include "tests/Devices.h"
#include "tests/Scenes.h"
#include "tests/Thrown.h"
#include "tests/comm/SharedFolder.h"
#include "tests/io/Samples.h"
#include "vdi/core/Error.h"
#include "vdi/io/Files.h"
#include "vdi/io/VdiFile.h"
#include "vdi/pipeline/VdiGenerator.h"

using namespace vdi;
using synthetic::Layout;
using test::device;
namespace fs = std::filesystem;

namespace {

struct Case {
  const char* name;
  int width;
  int height;
  Precision precision;
  Budget budget;
  bool inSight;
};

const Case cases[] = {
    {"five chunks", 161, 119, Precision::Compact, Budget::List, true},
    {"floats", 161, 119, Precision::Full, Budget::List, true},
    {"a total budget", 97, 131, Precision::Compact, Budget::Total, true},
    {"one chunk, and a list", 17, 241, Precision::Compact, Budget::List, true},
    {"fewer lists than ranks", 2, 1, Precision::Full, Budget::List, true},
    {"one list", 1, 1, Precision::Compact, Budget::List, true},
    {"no supersegments", 161, 119, Precision::Compact, Budget::List, false},
};

}  // namespace

TEST_CASE("the file of a frame that all ranks write is that of the gathered frame") {
  const comm::Communicator world = comm::Communicator::world();
  const bool root = world.rank() == 0;
  const test::SharedFolder folder(world);
  const fs::path path = folder.path() / "f.vdi";
  VdiGenerator generator(device(), comm::Communicator::world());
  const TransferFunction function = test::threeHues(0.8);
  generator.setBlocks(test::dealt(world, "turbulence", {24, 20, 22}, {3, 2, 3}, Layout::Random).mine);
  for (const Case& c : cases) {
    INFO(c.name);
    GenerateSettings settings = test::smallSettings(c.width, c.height, 6);
    settings.precision = c.precision;
    settings.budget = c.budget;
    Camera camera = test::oblique();
    if (!c.inSight) camera.focalPoint = camera.position + (camera.position - camera.focalPoint);
    std::optional<Vdi> vdi = generator.generate(camera, function, settings);
    const WrittenVdi written = generator.write(path, camera, function, settings, {2.5, 7, {"V", true, 3, 2}});
    std::array<std::uint64_t, 1> bytes{written.bytes};
    world.allReduceMax(bytes);
    CHECK(bytes[0] == written.bytes);
    if (!root) continue;
    vdi->time = 2.5;
    vdi->timeStep = 7;
    vdi->coloring->array = {"V", true, 3, 2};
    if (c.width > 2) CHECK((vdi->supersegmentCount() > 0) == c.inSight);
    CHECK(written.supersegments == vdi->supersegmentCount());
    CHECK(io::InputFile(path).readAll() == io::encode(*vdi));
    CHECK(io::readVdi(path) == *vdi);
    CHECK(folder.fileCount() == 1);
    std::uint64_t inAll = 0;
    for (const RankReport& report : generator.reports()) {
      inAll += report.bytesWritten;
      CHECK(report.outputSeconds > 0.0);
      CHECK(report.gatherSeconds == 0.0);
      CHECK(report.hostPeakBytes > 0);
    }
    CHECK(inAll == written.bytes);
  }

  // Errors leave the old file, and the generator stays usable.
  const std::vector<std::byte> old = root ? io::InputFile(path).readAll() : std::vector<std::byte>();
  const GenerateSettings settings = test::smallSettings(161, 119, 6);
  const int last = world.size() - 1;
  const auto write = [&](const fs::path& to, const Progress& progress = {}) {
    return generator.write(to, test::oblique(), function, settings, {}, progress);
  };
  const Error noFolder = test::errorOf([&] { write(folder.path() / "none" / "f.vdi"); });
  CHECK(noFolder.code() == (root ? ErrorCode::Io : ErrorCode::RemoteRank));
  CHECK(std::string(noFolder.what()).find("none") != std::string::npos);
  const Error stopped = test::errorOf([&] { write(path, [&](double) { return world.rank() != last; }); });
  CHECK(stopped.code() == ErrorCode::Cancelled);
  {
    std::optional<test::FileSizeLimit> full;
    if (world.rank() == last) full.emplace(4096);
    const Error noRoom = test::errorOf([&] { write(path); });
    full.reset();
    CHECK(noRoom.code() == (world.rank() == last ? ErrorCode::Io : ErrorCode::RemoteRank));
    CHECK(std::string(noRoom.what()).find("File too large") != std::string::npos);
  }
  if (root) {
    CHECK(io::InputFile(path).readAll() == old);
    CHECK(folder.fileCount() == 1);
  }
  const auto vdi = generator.generate(test::oblique(), function, settings);
  write(path);
  if (root) CHECK(io::readVdi(path) == *vdi);
}
