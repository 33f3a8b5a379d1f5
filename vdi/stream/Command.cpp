#include "vdi/stream/Command.h"

#include <fmt/format.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <thread>
#include <utility>

#include "vdi/core/Error.h"

namespace vdi::stream {

namespace {

constexpr std::chrono::seconds endPatience{1};
constexpr std::chrono::milliseconds pause{5};

[[noreturn]] void failToStart(int error) {
  throw Error(ErrorCode::Io, std::string("can't start a command: ") + std::strerror(error));
}

/// The set-up of a child: the socket as its standard input and output, and signals as a shell expects them.
class Setup {
 public:
  explicit Setup(int socket) {
    ::posix_spawn_file_actions_init(&actions_);
    for (const int standard : {STDIN_FILENO, STDOUT_FILENO})
      ::posix_spawn_file_actions_adddup2(&actions_, socket, standard);
    // The command must not inherit this process's sockets, or it would keep a port taken.
    ::posix_spawn_file_actions_addclosefrom_np(&actions_, STDERR_FILENO + 1);
    ::posix_spawnattr_init(&attributes_);
    sigset_t signals;
    sigemptyset(&signals);
    ::posix_spawnattr_setsigmask(&attributes_, &signals);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE}) sigaddset(&signals, signal);
    ::posix_spawnattr_setsigdefault(&attributes_, &signals);
    ::posix_spawnattr_setflags(&attributes_, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
  }
  ~Setup() {
    ::posix_spawn_file_actions_destroy(&actions_);
    ::posix_spawnattr_destroy(&attributes_);
  }
  Setup(const Setup&) = delete;
  Setup& operator=(const Setup&) = delete;

  pid_t start(const std::string& text) const {
    std::string shell = "sh";
    std::string option = "-c";
    std::string command = text;
    const std::array<char*, 4> arguments{shell.data(), option.data(), command.data(), nullptr};
    pid_t process = -1;
    const int error =
        ::posix_spawn(&process, "/bin/sh", &actions_, &attributes_, arguments.data(), ::environ);
    if (error != 0) failToStart(error);
    return process;
  }

 private:
  posix_spawn_file_actions_t actions_{};
  posix_spawnattr_t attributes_{};
};

Command::Ending endingOf(int status) {
  if (WIFSIGNALED(status)) return {fmt::format("was ended by signal {}", WTERMSIG(status)), false};
  constexpr int cannotRun = 126;
  constexpr int notFound = 127;
  const int code = WEXITSTATUS(status);
  return {fmt::format("ended with status {}", code), code == cannotRun || code == notFound};
}

}  // namespace

Command::Command(const std::string& text) {
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) failToStart(errno);
  socket_ = Descriptor(ends[0]);
  const Descriptor other(ends[1]);
  process_ = Setup(other.number()).start(text);
}

Command::~Command() {
  end();
}

int Command::takeSocket() {
  return socket_.release();
}

Command::Ending Command::end() {
  socket_ = Descriptor();
  if (process_ < 0) return ending_;
  int status = 0;
  for (const int signal : {0, SIGTERM}) {
    if (signal != 0) ::kill(process_, signal);
    const auto until = std::chrono::steady_clock::now() + endPatience;
    pid_t ended = 0;
    while ((ended = ::waitpid(process_, &status, WNOHANG)) == 0 && std::chrono::steady_clock::now() < until)
      std::this_thread::sleep_for(pause);
    if (ended == 0) continue;
    process_ = -1;
    ending_ = ended > 0 ? endingOf(status) : Ending{"is gone", false};
    return ending_;
  }
  ::kill(process_, SIGKILL);
  ::waitpid(std::exchange(process_, -1), &status, 0);
  ending_ = endingOf(status);
  return ending_;
}

}  // namespace vdi::stream
