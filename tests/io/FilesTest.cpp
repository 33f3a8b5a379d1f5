// Whole files: what a reader and a writer of them see when things go wrong.
#include <fcntl.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <atomic>
#include <catch2/catch.hpp>
#include <csignal>
#include <thread>

#include "tests/io/Samples.h"
#include "vdi/io/Files.h"

using namespace vdi;
namespace fs = std::filesystem;

namespace {

std::vector<std::byte> bytesOf(std::size_t count, std::uint8_t value) {
  return std::vector<std::byte>(count, std::byte{value});
}

/// Files of this process can't grow beyond `bytes` while this lives.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit tight{bytes, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &tight);
  }
  ~FileSizeLimit() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  rlimit before_{};
  void (*handler_)(int);
};

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
  io::writeAtomically(path, {});
  CHECK(io::InputFile(path).readAll().empty());
  CHECK(folder.fileCount() == 1);
}

TEST_CASE("a new file has the permissions that any new file has") {
  const test::TemporaryFolder folder;
  const mode_t before = ::umask(027);
  io::writeAtomically(folder.path() / "f", bytesOf(1, 1));
  ::umask(before);
  CHECK(fs::status(folder.path() / "f").permissions() == fs::perms(0640));
}

TEST_CASE("what can't be read is Error{Io} with path and reason") {
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
  CHECK(reading(pipe).find("not a regular file") != std::string::npos);  // and doesn't wait for a writer

  io::writeAtomically(folder.path() / "shrinks", bytesOf(1000, 1));
  const io::InputFile file(folder.path() / "shrinks");
  fs::resize_file(folder.path() / "shrinks", 10);
  CHECK(test::errorOf([&] { file.readAll(); }).code() == ErrorCode::Io);
}

TEST_CASE("what can't be written is Error{Io}, leaves nothing behind and the old file as it was") {
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
    const FileSizeLimit full(4096);
    CHECK(test::errorOf([&] { io::writeAtomically(path, bytesOf(100000, 2)); }).code() == ErrorCode::Io);
  }
  CHECK(io::InputFile(path).readAll() == bytesOf(1000, 1));
  CHECK(folder.fileCount() == 2);
}

TEST_CASE("readers beside several writers of one path always see a whole file") {
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
