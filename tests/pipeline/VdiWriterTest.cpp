// All ranks write one file, or none at all. It equals the file of one rank, however the lists are
// distributed.
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <optional>
#include <string>
#include <thread>
#include <type_traits>
#include <vector>

#include "tests/Catch.h"
#include "tests/Thrown.h"
#include "tests/comm/SharedFolder.h"
#include "tests/io/Samples.h"
#include "vdi/io/Files.h"
#include "vdi/io/VdiFile.h"
#include "vdi/pipeline/VdiWriter.h"

using namespace vdi;
using detail::WrittenBy;
namespace fs = std::filesystem;

namespace {

const comm::Communicator& world() {
  static const comm::Communicator comm = comm::Communicator::world();
  return comm;
}

bool isRoot() {
  return world().rank() == 0;
}

/// Lists [first, last) of a VDI.
struct Range {
  std::uint64_t first = 0;
  std::uint64_t last = 0;
};

/// The ranges that each rank adds, in order.
using Deal = std::vector<std::vector<Range>>;

struct NamedDeal {
  const char* name;
  Deal ranges;  // [ranks]
};

/// Bands, each divided among all ranks at random places.
Deal dealInBands(std::uint64_t lists, int ranks, std::uint64_t bands, std::uint64_t seed) {
  test::Noise noise(seed);
  Deal deal(static_cast<std::size_t>(ranks));
  for (std::uint64_t b = 0; b < bands; ++b) {
    const std::uint64_t first = lists * b / bands;
    const std::uint64_t last = lists * (b + 1) / bands;
    std::vector<std::uint64_t> ends{first, last};
    for (int r = 1; r < ranks; ++r)
      ends.push_back(first + noise.below(static_cast<std::uint32_t>(last - first + 1)));
    std::sort(ends.begin(), ends.end());
    for (std::size_t r = 0; r < deal.size(); ++r) deal[r].push_back({ends[r], ends[r + 1]});
  }
  return deal;
}

std::vector<NamedDeal> dealsOf(std::uint64_t lists) {
  const int ranks = world().size();
  Deal last(static_cast<std::size_t>(ranks));
  last.back() = {{0, lists}};
  Deal backwards = dealInBands(lists, ranks, 1, 4);
  std::reverse(backwards.begin(), backwards.end());
  Deal listByList(static_cast<std::size_t>(ranks));
  const std::uint64_t thin = std::min<std::uint64_t>(lists, 50);
  for (std::uint64_t i = 0; i < thin; ++i) listByList[i % listByList.size()].push_back({i, i + 1});
  listByList.front().push_back({thin, lists});
  return {{"in one band", dealInBands(lists, ranks, 1, 1)},
          {"in three bands", dealInBands(lists, ranks, 3, 2)},
          {"in eleven bands", dealInBands(lists, ranks, 11, 3)},
          {"all on the last rank", last},
          {"the last rank has the first lists", backwards},
          {"list by list", listByList}};
}

template <typename Segment>
ListsOf<Segment> cut(const ListsOf<Segment>& lists, const Range& range) {
  ListsOf<Segment> part;
  for (std::uint64_t i = range.first; i < range.last; ++i) {
    const auto list = lists.list(i);
    part.segments.insert(part.segments.end(), list.begin(), list.end());
    part.offsets.push_back(static_cast<std::uint32_t>(part.segments.size()));
  }
  return part;
}

/// Collective: all ranks know the VDI, and each adds the lists that were assigned to it.
WrittenVdi writeDealt(const fs::path& path, const Vdi& vdi, const Deal& deal,
                      WrittenBy writtenBy = WrittenBy::Owner) {
  return std::visit(
      [&](const auto& lists) {
        using Segment = std::remove_cvref_t<decltype(lists.segments[0])>;
        Vdi header = vdi;
        header.lists = SupersegmentLists();
        detail::VdiWriter<Segment> writer(world(), 0, path, header, writtenBy);
        world().together([&] {
          for (const Range& range : deal[static_cast<std::size_t>(world().rank())])
            writer.add(range.first, cut(lists, range));
        });
        return writer.finish();
      },
      vdi.lists);
}

std::vector<Vdi> samples() {
  return {
      test::noisyVdi(97, 131, 5),  // four chunks, the last one shorter
      test::noisyVdi(128, 64, 3),  // exactly two
      test::colored(test::noisyVdi(128, 65, 3)),
      test::plausibleVdi(64, 64, 8),  // exactly one
      test::noisyVdi(3, 2, 4),        // fewer lists than ranks
      test::noisyVdi(1, 1, 4),        //
      test::emptyVdi(100, 83, 4),
  };
}

/// Collective: the error of a call that fails on all ranks, as rank `where` gets it; other ranks' errors must
/// contain its text.
Error errorEverywhere(const std::function<void()>& call, int where) {
  const Error error = test::errorOf(call);
  if (world().rank() != where) {
    CHECK(error.code() == ErrorCode::RemoteRank);
    CHECK(std::string(error.what()).find("rank " + std::to_string(where)) != std::string::npos);
  }
  return error;
}

}  // namespace

TEST_CASE("the file is that of one rank, whichever ranks have which lists") {
  const test::SharedFolder folder(world());
  const fs::path path = folder.path() / "f.vdi";
  for (const Vdi& full : samples()) {
    for (const Vdi& vdi : {full, test::compact(full)}) {
      const std::vector<std::byte> expected = io::encode(vdi);
      for (const NamedDeal& deal : dealsOf(vdi.listCount())) {
        for (const WrittenBy by : {WrittenBy::Owner, WrittenBy::Root}) {
          if (by == WrittenBy::Root && vdi.height != 131) continue;
          INFO(vdi.width << " x " << vdi.height << ", " << toString(vdi.precision()) << ", " << deal.name
                         << (by == WrittenBy::Root ? ", by the root" : ""));
          const WrittenVdi written = writeDealt(path, vdi, deal.ranges, by);
          CHECK(written.bytes == expected.size());
          CHECK(written.supersegments == vdi.supersegmentCount());
          if (!isRoot()) continue;
          CHECK(io::InputFile(path).readAll() == expected);
          CHECK(folder.fileCount() == 1);
        }
      }
      if (isRoot()) CHECK(io::readVdi(path) == vdi);
    }
  }
}

TEST_CASE("a rank writes its own lists, and sends no more than parts of chunks") {
  const test::SharedFolder folder(world());
  const Vdi vdi = test::noisyVdi(128, 320, 4);  // ten chunks
  const auto ranks = static_cast<std::uint64_t>(world().size());
  const auto rank = static_cast<std::uint64_t>(world().rank());
  const Range mine{vdi.listCount() * rank / ranks, vdi.listCount() * (rank + 1) / ranks};
  for (const WrittenBy by : {WrittenBy::Owner, WrittenBy::Root}) {
    detail::VdiWriter<Supersegment> writer(world(), 0, folder.path() / "f.vdi", vdi, by);
    world().together([&] { writer.add(mine.first, cut(test::full(vdi), mine)); });
    const WrittenVdi written = writer.finish();
    std::array<std::uint64_t, 2> sums{writer.bytesWritten(), writer.bytesSent()};
    world().allReduceSum(sums);
    CHECK(sums[0] == written.bytes);
    const std::uint64_t share = written.bytes / ranks;
    const std::uint64_t chunk = written.bytes / 10;
    if (by == WrittenBy::Owner) {
      CHECK(writer.bytesWritten() + 3 * chunk / 2 > share);
      CHECK(writer.bytesWritten() < share + 3 * chunk / 2);
      CHECK(sums[1] < ranks * 2 * chunk);
    } else {
      CHECK(writer.bytesWritten() == (isRoot() ? written.bytes : 0));
      if (!isRoot()) CHECK(writer.bytesSent() + 3 * chunk / 2 > share);
    }
  }
}

TEST_CASE("a pipe gets the bytes in their order, and a full device is an error") {
  const test::SharedFolder folder(world());
  const fs::path pipe = folder.path() / "pipe";
  const Vdi vdi = test::colored(test::noisyVdi(97, 131, 5));
  const Deal deal = dealInBands(vdi.listCount(), world().size(), 2, 1);
  world().together([&] {
    if (isRoot() && ::mkfifo(pipe.c_str(), 0600) != 0) throw Error(ErrorCode::Io, "no pipe");
  });
  std::vector<std::byte> got;
  std::thread reader;
  if (isRoot()) {
    const int file = ::open(pipe.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);  // before a writer opens it
    ::fcntl(file, F_SETFL, 0);
    reader = std::thread([&got, file] {
      std::array<std::byte, 4096> buffer{};
      ssize_t count = 0;
      // Before a writer opens the pipe, reads return an end of file.
      while ((count = ::read(file, buffer.data(), buffer.size())) > 0 || (count == 0 && got.empty())) {
        got.insert(got.end(), buffer.begin(), buffer.begin() + count);
      }
      ::close(file);
    });
  }
  writeDealt(pipe, vdi, deal);
  if (isRoot()) {
    reader.join();
    CHECK(got == io::encode(vdi));
    CHECK(fs::is_fifo(pipe));
  }
  writeDealt("/dev/null", vdi, deal);
  const Error full = errorEverywhere([&] { writeDealt("/dev/full", vdi, deal); }, 0);
  CHECK(std::string(full.what()).find("No space left") != std::string::npos);
}

namespace {

/// A file that a failing write must leave as it is, and a VDI to replace it with.
class Replacement {
 public:
  Replacement() {
    writeDealt(path, old_, deal);
    if (isRoot()) fs::permissions(path, fs::perms(0640));
  }
  void requireUnchanged() const {
    if (!isRoot()) return;
    CHECK(io::readVdi(path) == old_);
    CHECK(folder.fileCount() == 1);
  }
  /// After failures, the VDI takes the file's place.
  void requireReplaced() const {
    writeDealt(path, vdi, deal);
    if (!isRoot()) return;
    CHECK(io::readVdi(path) == vdi);
    CHECK(fs::status(path).permissions() == fs::perms(0640));
    CHECK(folder.fileCount() == 1);
  }

  const test::SharedFolder folder{world()};
  const fs::path path = folder.path() / "f.vdi";
  const Vdi vdi = test::noisyVdi(97, 131, 5, 2);
  const Deal deal = dealInBands(vdi.listCount(), world().size(), 1, 1);

 private:
  const Vdi old_ = test::noisyVdi(97, 131, 5, 1);
};

void requireText(const Error& error, const char* what) {
  CHECK(std::string(error.what()).find(what) != std::string::npos);
}

}  // namespace

TEST_CASE("if the root can't open the file, all ranks fail, and the old file stays") {
  const Replacement file;
  for (const fs::path& bad :
       {file.folder.path() / "none" / "f.vdi", file.folder.path(), fs::path("/proc/self/f.vdi")}) {
    const Error error = errorEverywhere([&] { writeDealt(bad, file.vdi, file.deal); }, 0);
    if (isRoot()) {
      CHECK(error.code() == ErrorCode::Io);
      CHECK(error.context() == bad.string());
    }
    requireText(error, bad.c_str());
  }
  if (::geteuid() != 0) {  // root may write anywhere
    if (isRoot()) fs::permissions(file.folder.path(), fs::perms(0500));
    world().barrier();
    requireText(errorEverywhere([&] { writeDealt(file.path, file.vdi, file.deal); }, 0), "Permission denied");
    if (isRoot()) fs::permissions(file.folder.path(), fs::perms(0700));
  }
  file.requireUnchanged();
  file.requireReplaced();
}

TEST_CASE("if a disk is full for one rank, all ranks fail, and the old file stays") {
  const Replacement file;
  // When the root reserves space, when it writes early, and when the last rank writes.
  for (const int where : {0, world().size() - 1}) {
    for (const WrittenBy by : {WrittenBy::Owner, WrittenBy::Root}) {
      const int failing = by == WrittenBy::Root ? 0 : where;
      std::optional<test::FileSizeLimit> full;
      if (world().rank() == failing) full.emplace(4096);
      const Error error = errorEverywhere([&] { writeDealt(file.path, file.vdi, file.deal, by); }, failing);
      full.reset();
      requireText(error, "File too large");
      requireText(error, file.path.c_str());
      file.requireUnchanged();
    }
  }
  file.requireReplaced();
}

TEST_CASE("if one rank's lists are bad or it gives up, all ranks fail, and the old file stays") {
  const Replacement file;
  const Vdi& vdi = file.vdi;
  const int last = world().size() - 1;
  Vdi broken = vdi;
  test::full(broken).segments.back().opacity = 2.0F;
  Deal onLast(file.deal.size());
  onLast.back() = {{0, vdi.listCount()}};
  const Error refused = errorEverywhere([&] { writeDealt(file.path, broken, onLast); }, last);
  requireText(refused, "opacity 2");
  file.requireUnchanged();
  const auto giveUp = [&] {
    detail::VdiWriter<Supersegment> writer(world(), 0, file.path, vdi);
    world().together([&] {
      writer.add(0, cut(test::full(vdi), {0, 8000}));
      if (world().rank() == last) throw Error(ErrorCode::DeviceFailure, "the device is lost");
    });
  };
  requireText(errorEverywhere(giveUp, last), "the device is lost");
  file.requireUnchanged();
  // Lists that no rank has, or two ranks have.
  for (const Range gap : {Range{0, 5}, Range{5000, 5001}, Range{8192, 12288}, Range{12706, 12707}}) {
    Deal missing(file.deal.size());
    missing.front() = {{0, gap.first}};
    missing.back().push_back({gap.last, vdi.listCount()});
    Deal twice(file.deal.size());
    twice.front() = {{0, gap.last}};
    twice.back().push_back({gap.first, vdi.listCount()});
    for (const Deal& bad : {missing, twice})
      CHECK(test::errorOf([&] { writeDealt(file.path, vdi, bad); }).code() == ErrorCode::InvalidArgument);
  }
  file.requireUnchanged();
  file.requireReplaced();
}

TEST_CASE("a reader sees a whole file while all ranks write") {
  const test::SharedFolder folder(world());
  const fs::path path = folder.path() / "f.vdi";
  const std::array vdis{test::noisyVdi(97, 131, 3, 1), test::noisyVdi(97, 131, 3, 2)};
  const std::array files{io::encode(vdis[0]), io::encode(vdis[1])};
  const Deal deal = dealInBands(vdis[0].listCount(), world().size(), 1, 1);
  writeDealt(path, vdis[0], deal);
  std::atomic<bool> done = false;
  std::atomic<int> torn = 0;
  std::thread reader;
  if (isRoot()) {
    reader = std::thread([&] {
      while (!done) {
        const std::vector<std::byte> bytes = io::InputFile(path).readAll();
        if (bytes != files[0] && bytes != files[1]) ++torn;
      }
    });
  }
  for (std::size_t i = 1; i <= 10; ++i) writeDealt(path, vdis[i % 2], deal);
  done = true;
  if (isRoot()) reader.join();
  CHECK(torn == 0);
}
