// Reading and writing of whole files, with and without failures.
#include <fcntl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <optional>
#include <thread>

#include "tests/Catch.h"
#include "tests/TemporaryFolder.h"
#include "tests/Thrown.h"
#include "tests/io/Samples.h"
#include "vdi/io/Files.h"

using namespace vdi;
namespace fs = std::filesystem;

namespace {

std::vector<std::byte> bytesOf(std::size_t count, std::uint8_t value) {
  return std::vector<std::byte>(count, std::byte{value});
}

}  // namespace

TEST_CASE("a file is written, replaced and read, whole or in part") {
  const test::TemporaryFolder folder;
  const fs::path path = folder.path() / "file with spaces";
  io::writeAtomically(path, bytesOf(100000, 1));
  CHECK(io::InputFile(path).readAll() == bytesOf(100000, 1));
  std::vector<std::byte> other = bytesOf(10, 2);
  other[3] = std::byte{7};
  io::writeAtomically(path, other);
  const io::InputFile file(path);
  CHECK(file.size() == 10);
  CHECK(file.readAll() == other);
  CHECK(file.read(3, 1) == bytesOf(1, 7));
  CHECK(file.read(10, 0).empty());
  std::vector<std::byte> part = bytesOf(2, 0);
  file.readInto(2, part);
  CHECK(part == std::vector<std::byte>{std::byte{2}, std::byte{7}});
  CHECK(test::errorOf([&] { file.readInto(9, part); }).code() == ErrorCode::Io);
  io::writeAtomically(path, {});
  CHECK(io::InputFile(path).readAll().empty());
  CHECK(folder.fileCount() == 1);
}

TEST_CASE("a link is replaced, and what isn't one stays") {
  const test::TemporaryFolder folder;
  const fs::path link = folder.path() / "latest";
  io::replaceLink(link, "a");
  io::writeAtomically(folder.path() / "b", bytesOf(1, 2));
  io::replaceLink(link, "b");
  CHECK(fs::read_symlink(link) == "b");
  CHECK(io::InputFile(link).readAll() == bytesOf(1, 2));
  CHECK(folder.fileCount() == 2);
  const Error refused = test::errorOf([&] { io::replaceLink(folder.path() / "b", "a"); });
  CHECK(refused.code() == ErrorCode::Io);
  CHECK(io::InputFile(folder.path() / "b").readAll() == bytesOf(1, 2));
  CHECK(test::errorOf([&] { io::replaceLink(folder.path() / "none" / "latest", "a"); }).code() ==
        ErrorCode::Io);
}

TEST_CASE("a new file has the permissions that any new file has") {
  const test::TemporaryFolder folder;
  const mode_t before = ::umask(027);
  io::writeAtomically(folder.path() / "f", bytesOf(1, 1));
  ::umask(before);
  CHECK(fs::status(folder.path() / "f").permissions() == fs::perms(0640));
}

TEST_CASE("a file that is replaced keeps its permissions") {
  const test::TemporaryFolder folder;
  const fs::path path = folder.path() / "f";
  io::writeAtomically(path, bytesOf(1, 1));
  for (const unsigned mode : {0600U, 0664U, 0755U}) {
    fs::permissions(path, fs::perms(mode));
    io::writeAtomically(path, bytesOf(2, 2));
    CHECK(fs::status(path).permissions() == fs::perms(mode));
  }
}

TEST_CASE("a symbolic link stays one, the file that it names is written") {
  const test::TemporaryFolder folder;
  fs::create_directory(folder.path() / "sub");
  const fs::path file = folder.path() / "sub" / "f";
  const fs::path link = folder.path() / "link";
  const fs::path second = folder.path() / "second";
  fs::create_symlink("sub/f", link);
  fs::create_symlink(link, second);
  for (std::uint8_t value = 1; value <= 2; ++value) {  // created, then replaced
    io::writeAtomically(second, bytesOf(10, value));
    CHECK(fs::is_symlink(link));
    CHECK(fs::is_symlink(second));
    CHECK(fs::is_regular_file(fs::symlink_status(file)));
    CHECK(io::InputFile(file).readAll() == bytesOf(10, value));
  }
  CHECK(io::requireWritable(second) == fs::canonical(file));
  fs::create_symlink("circle", folder.path() / "circle");
  CHECK(test::errorOf([&] { io::writeAtomically(folder.path() / "circle", {}); }).code() == ErrorCode::Io);
}

TEST_CASE("devices and pipes are written to, not replaced") {
  const test::TemporaryFolder folder;
  io::writeAtomically("/dev/null", bytesOf(10, 1));
  CHECK(fs::is_character_file("/dev/null"));
  CHECK(io::requireWritable("/dev/null").empty());
  const Error full = test::errorOf([&] { io::writeAtomically("/dev/full", bytesOf(10, 1)); });
  CHECK(std::string(full.what()).find("No space") != std::string::npos);

  const fs::path pipe = folder.path() / "pipe";
  REQUIRE(::mkfifo(pipe.c_str(), 0600) == 0);
  const Error nobody = test::errorOf([&] { io::writeAtomically(pipe, bytesOf(10, 1)); });
  CHECK(std::string(nobody.what()).find("nobody reads") != std::string::npos);
  const int reader = ::open(pipe.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  io::writeAtomically(pipe, bytesOf(10, 1));
  std::vector<std::byte> got(20);
  CHECK(::read(reader, got.data(), got.size()) == 10);
  std::thread leaver([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    ::close(reader);
  });
  CHECK(test::errorOf([&] { io::writeAtomically(pipe, bytesOf(1U << 20, 1)); }).code() == ErrorCode::Io);
  leaver.join();
  CHECK(fs::is_fifo(pipe));
  CHECK(folder.fileCount() == 1);
}

TEST_CASE("a path that cannot be written is known before there is anything to write") {
  const test::TemporaryFolder folder;
  const auto refused = [](const fs::path& path) {
    const Error asked = test::errorOf([&] { io::requireWritable(path); });
    const Error tried = test::errorOf([&] { io::writeAtomically(path, {}); });
    CHECK(asked.code() == ErrorCode::Io);
    CHECK(asked.context() == path.string());
    CHECK(std::string(asked.what()) == tried.what());
  };
  refused(folder.path());
  refused(folder.path() / "none" / "f");
  refused(folder.path() / "");
  refused("");
  io::writeAtomically(folder.path() / "f", {});
  refused(folder.path() / "f" / "g");
  fs::create_symlink("none/f", folder.path() / "link");
  refused(folder.path() / "link");
  CHECK(io::requireWritable(folder.path() / "new") == fs::canonical(folder.path()) / "new");
  CHECK(io::requireWritable(folder.path() / "." / "f") == fs::canonical(folder.path() / "f"));
  CHECK(folder.fileCount() == 2);
  if (::geteuid() != 0) {  // root may write anywhere
    fs::permissions(folder.path() / "f", fs::perms(0400));
    refused(folder.path() / "f");
    fs::permissions(folder.path(), fs::perms(0500));
    refused(folder.path() / "new");
    fs::permissions(folder.path(), fs::perms(0700));
  }
}

TEST_CASE("a process killed while it writes leaves the old file, and no other one") {
  const test::TemporaryFolder folder;
  const fs::path path = folder.path() / "f";
  io::writeAtomically(path, bytesOf(1000, 1));
  const pid_t child = ::fork();
  if (child == 0) {
    const rlimit tight{4096, RLIM_INFINITY};
    ::setrlimit(RLIMIT_FSIZE, &tight);
    std::signal(SIGXFSZ, SIG_DFL);  // ends the process in the middle of writing
    io::writeAtomically(path, bytesOf(100000, 2));
    ::_exit(0);
  }
  int status = 0;
  REQUIRE(::waitpid(child, &status, 0) == child);
  CHECK(WIFSIGNALED(status));
  CHECK(io::InputFile(path).readAll() == bytesOf(1000, 1));
  const int unnamed = ::open(folder.path().c_str(), O_WRONLY | O_TMPFILE | O_CLOEXEC, 0600);
  if (unnamed >= 0) ::close(unnamed);
  CHECK(folder.fileCount() == (unnamed >= 0 ? 1 : 2));
}

TEST_CASE("a file that cannot be read gives Error{Io} with path and reason") {
  const test::TemporaryFolder folder;
  const auto reading = [](const fs::path& path) {
    const Error error = test::errorOf([&] { io::InputFile file(path); });
    CHECK(error.code() == ErrorCode::Io);
    CHECK(error.context() == path.string());
    return std::string(error.what());
  };
  CHECK(reading(folder.path() / "none").find("No such file") != std::string::npos);
  CHECK(reading(folder.path()).find("not a regular file") != std::string::npos);
  CHECK(reading("/dev/zero").find("not a regular file") != std::string::npos);
  const fs::path pipe = folder.path() / "pipe";
  REQUIRE(::mkfifo(pipe.c_str(), 0600) == 0);
  CHECK(reading(pipe).find("a pipe") != std::string::npos);  // and does not wait for a writer

  io::writeAtomically(folder.path() / "shrinks", bytesOf(1000, 1));
  const io::InputFile file(folder.path() / "shrinks");
  fs::resize_file(folder.path() / "shrinks", 10);
  CHECK(test::errorOf([&] { file.readAll(); }).code() == ErrorCode::Io);
}

TEST_CASE("a failed write gives Error{Io}, and leaves only the old file") {
  const test::TemporaryFolder folder;
  const fs::path missing = folder.path() / "none" / "f";
  const Error noFolder = test::errorOf([&] { io::writeAtomically(missing, bytesOf(1, 1)); });
  CHECK(noFolder.code() == ErrorCode::Io);
  CHECK(noFolder.context() == missing.string());
  CHECK(std::string(noFolder.what()).find("No such file") != std::string::npos);

  fs::create_directory(folder.path() / "folder");
  CHECK(test::errorOf([&] { io::writeAtomically(folder.path() / "folder", bytesOf(1, 1)); }).code() ==
        ErrorCode::Io);
  CHECK(folder.fileCount() == 1);

  const fs::path path = folder.path() / "f";
  io::writeAtomically(path, bytesOf(1000, 1));
  {
    const test::FileSizeLimit full(4096);
    CHECK(test::errorOf([&] { io::writeAtomically(path, bytesOf(100000, 2)); }).code() == ErrorCode::Io);
  }
  CHECK(io::InputFile(path).readAll() == bytesOf(1000, 1));
  CHECK(folder.fileCount() == 2);
}

TEST_CASE("readers always see a whole file while several writers replace it") {
  const test::TemporaryFolder folder;
  const fs::path path = folder.path() / "f";
  constexpr std::size_t size = 50000;
  io::writeAtomically(path, bytesOf(size, 0));
  std::atomic<int> writing{3};
  std::vector<std::thread> writers;
  for (std::uint8_t id = 1; id <= 3; ++id) {
    writers.emplace_back([&, id] {
      for (int i = 0; i < 100; ++i) io::writeAtomically(path, bytesOf(size + id, id));
      --writing;
    });
  }
  int torn = 0;
  do {
    const std::vector<std::byte> bytes = io::InputFile(path).readAll();
    const auto id = std::to_integer<std::uint8_t>(bytes.at(0));
    if (bytes != bytesOf(size + id, id)) ++torn;
  } while (writing > 0);
  for (std::thread& writer : writers) writer.join();
  CHECK(torn == 0);
  CHECK(folder.fileCount() == 1);
}

TEST_CASE("a file of several writers gets its name, and any bytes, once all have finished") {
  const test::TemporaryFolder folder;
  const fs::path path = folder.path() / "f";
  for (const bool old : {false, true}) {
    INFO(old);
    if (old) io::writeAtomically(path, bytesOf(5, 9));
    io::OutputFile file(path);
    REQUIRE(file.takesOffsets());
    file.write(6, bytesOf(2, 3));
    file.reserve(10);
    const fs::path name = file.share();
    CHECK(name.is_absolute());
    {
      std::optional<io::SharedOutput> other = io::SharedOutput::open(name, path);
      REQUIRE(other);
      other->write(8, bytesOf(2, 4));
      other->finish();
    }
    file.write(0, bytesOf(6, 2));
    CHECK(fs::exists(path) == old);
    if (old) CHECK(io::InputFile(path).readAll() == bytesOf(5, 9));
    file.commit();
    std::vector<std::byte> expected = bytesOf(10, 2);
    std::fill(expected.begin() + 6, expected.begin() + 8, std::byte{3});
    std::fill(expected.begin() + 8, expected.end(), std::byte{4});
    CHECK(io::InputFile(path).readAll() == expected);
    CHECK(folder.fileCount() == 1);
    fs::remove(path);
  }
}

TEST_CASE("an unfinished file leaves nothing but the old one") {
  const test::TemporaryFolder folder;
  const fs::path path = folder.path() / "f";
  io::writeAtomically(path, bytesOf(5, 9));
  fs::path name;
  {
    io::OutputFile file(path);
    file.write(0, bytesOf(100, 1));
    name = file.share();
    CHECK(folder.fileCount() == 2);
  }
  CHECK(folder.fileCount() == 1);
  CHECK(io::InputFile(path).readAll() == bytesOf(5, 9));
  CHECK_FALSE(io::SharedOutput::open(name, path));
  CHECK_FALSE(io::SharedOutput::open(folder.path() / "none" / "f", path));
  const Error folderError = test::errorOf([&] { (void)io::SharedOutput::open(folder.path(), path); });
  CHECK(folderError.context() == path.string());
  {
    const test::FileSizeLimit full(4096);
    io::OutputFile file(path);
    CHECK(test::errorOf([&] { file.reserve(5000); }).code() == ErrorCode::Io);
  }
  CHECK(folder.fileCount() == 1);
}
