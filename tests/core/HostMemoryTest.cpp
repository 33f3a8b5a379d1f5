#include "vdi/core/HostMemory.h"

#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <string>

#include "tests/Catch.h"
#include "vdi/core/Error.h"

using namespace vdi;

namespace {

bool hasName(const std::string& name) {
  return std::filesystem::exists("/dev/shm" + name);
}

/// Runs `work` in a process that is then killed, and returns its result, up to a pipe's size.
template <typename Work>
std::string inKilledProcess(Work work) {
  int ends[2];
  REQUIRE(pipe(ends) == 0);
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    const std::string said = work();
    const ssize_t written = write(ends[1], said.data(), said.size());
    kill(getpid(), written == static_cast<ssize_t>(said.size()) ? SIGKILL : SIGABRT);
  }
  close(ends[1]);
  std::string said(256, '\0');
  const ssize_t bytes = read(ends[0], said.data(), said.size());
  close(ends[0]);
  int status = 0;
  REQUIRE(waitpid(child, &status, 0) == child);
  REQUIRE(WIFSIGNALED(status));
  CHECK(WTERMSIG(status) == SIGKILL);
  REQUIRE(bytes > 0);
  return said.substr(0, static_cast<std::size_t>(bytes));
}

}  // namespace

TEST_CASE("memory to be shared has a name only from publish to unlink") {
  const auto memory = HostMemory::shareable(1000);
  CHECK(!hasName(memory->name()));
  CHECK_THROWS_AS(HostMemory::open(memory->name(), 1000), Error);
  memory->bytes()[999] = std::byte{7};
  REQUIRE(memory->publish());
  CHECK(memory->publish());
  CHECK(hasName(memory->name()));
  const auto other = HostMemory::open(memory->name(), 1000);
  CHECK(other->bytes()[999] == std::byte{7});
  memory->unlink();
  CHECK(!hasName(memory->name()));
  CHECK(!memory->publish());
  other->bytes()[0] = std::byte{5};
  CHECK(memory->bytes()[0] == std::byte{5});
  CHECK(!HostMemory::anonymous(1000)->publish());
}

TEST_CASE("the next process removes only names that a killed one has left") {
  const auto nameThatStays = [] {
    auto* kept =
        new std::shared_ptr(HostMemory::shared(1000));  // never deleted, as in a process that is killed
    const std::string& name = (*kept)->name();
    return hasName(name) ? name : "(none)";  // here: once it's killed, any process of the host may remove it
  };
  const auto living = HostMemory::shared(1000);
  const std::string first = inKilledProcess(nameThatStays);
  CHECK(first != "(none)");
  const std::string second = inKilledProcess(nameThatStays);
  CHECK(second != "(none)");
  CHECK(!hasName(first));
  CHECK(hasName(living->name()));
  std::filesystem::remove("/dev/shm" + second);
}
