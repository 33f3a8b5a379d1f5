// vdi_catalyst_process: the program in which an isolated run's frames are made. It has three parts.
//
//   launch COMMAND...    starts the run's MPI job, apart from the simulation, and ends
//   serve NAME RANKS     finds a rank of the simulation on this host, starts the worker for it, supervises
//                        it, and tells the rank how the worker ends
//   work SOCKET SETUP    is a simulation of its own, which hands the rank's data to vdi_catalyst.h
#include <fcntl.h>
#include <poll.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/signalfd.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <span>
#include <string>
#include <vector>

#include "catalyst_adaptor/isolated/Messages.h"
#include "catalyst_adaptor/isolated/SharedPages.h"
#include "catalyst_adaptor/isolated/Socket.h"
#include "catalyst_adaptor/isolated/StepSignals.h"
#include "catalyst_adaptor/isolated/process/Worker.h"

namespace {

using vdi::Descriptor;
using vdi::catalyst::isOfMpiJob;
using vdi::catalyst::Packer;
using vdi::catalyst::Say;
using vdi::catalyst::Setup;
using vdi::catalyst::SharedPages;
using vdi::catalyst::Socket;
using vdi::catalyst::Unpacker;

constexpr int life = 3;  // the descriptor by which Job sees whether the job is over

std::vector<char*> pointersOf(std::vector<std::string>& texts) {
  std::vector<char*> pointers;
  pointers.reserve(texts.size() + 1);
  for (std::string& text : texts) pointers.push_back(text.data());
  pointers.push_back(nullptr);
  return pointers;
}

/// Undoes the binding to cores that this process inherits from the simulation.
void useAllCores() {
  cpu_set_t all;
  CPU_ZERO(&all);
  for (int i = 0; i < CPU_SETSIZE; ++i) CPU_SET(i, &all);
  sched_setaffinity(0, sizeof all, &all);
}

int launch(std::span<char*> command) {
  const pid_t job = fork();
  if (job != 0) return job < 0 ? 1 : 0;
  setsid();
  const pid_t self = getpid();
  if (write(life, &self, sizeof self) != static_cast<ssize_t>(sizeof self)) return 1;
  useAllCores();
  execvp(command.front(), command.data());
  std::fprintf(stderr, "%s: %s\n", command.front(), std::strerror(errno));
  return 127;
}

/// The rank that an MPI launcher has given this process; 0 if there is none.
int givenRank() {
  for (const char* name : {"OMPI_COMM_WORLD_RANK", "PMIX_RANK", "PMI_RANK", "SLURM_PROCID"}) {
    const char* value = std::getenv(name);
    if (value != nullptr) return std::atoi(value);
  }
  return 0;
}

/// Connects to a rank of the simulation on this host that has no process yet. Launchers may number their
/// processes differently, so any rank will do. Returns its greeting with its descriptors.
Socket::Received greetingOf(const std::string& name, int ranks, Socket& socket) {
  const int first = givenRank();
  for (int i = 0; i < ranks; ++i) {
    socket = Socket::connectTo(name + "-" + std::to_string((first + i) % ranks));
    if (!socket.isOpen()) continue;
    Socket::Received greeting = socket.receive(std::chrono::milliseconds(-1));
    constexpr std::size_t expected = 3;
    if (greeting.result == Socket::Result::Message && greeting.descriptors.size() == expected)
      return greeting;
  }
  socket.close();
  return {};
}

/// The rank's environment, with the variables of this process's own MPI job in place of the rank's.
std::vector<std::string> environmentOf(const Setup& setup) {
  std::vector<std::string> variables;
  for (char** own = environ; *own != nullptr; ++own) {
    if (isOfMpiJob(*own)) variables.emplace_back(*own);
  }
  for (const std::string& variable : setup.environment) {
    if (!isOfMpiJob(variable) && !variable.starts_with("VDI_ISOLATION=")) variables.push_back(variable);
  }
  variables.emplace_back("VDI_ISOLATION=none");  // this process makes the frames itself
  return variables;
}

std::string ownFile() {
  std::array<char, 4096> path{};
  const ssize_t length = readlink("/proc/self/exe", path.data(), path.size() - 1);
  return length > 0 ? path.data() : "";
}

/// Becomes the worker. Returns only if that fails.
void work(const Setup& setup, const Socket& socket, const Socket::Received& greeting, pid_t supervisor) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != supervisor) return;
  // The new program takes no notice of these signals only once it has begun.
  const sigset_t blocked = vdi::catalyst::setOfStepSignals();
  sigprocmask(SIG_SETMASK, &blocked, nullptr);
  const int pages = greeting.descriptors[2].number();
  for (const int kept : {socket.number(), pages}) fcntl(kept, F_SETFD, 0);
  fcntl(life, F_SETFD, FD_CLOEXEC);
  std::vector<std::string> arguments{ownFile(), "work", std::to_string(socket.number()),
                                     std::to_string(pages)};
  std::vector<std::string> environment = environmentOf(setup);
  // From here on, the worker's output goes where the rank's does.
  dup2(greeting.descriptors[0].number(), STDOUT_FILENO);
  dup2(greeting.descriptors[1].number(), STDERR_FILENO);
  umask(setup.umask);
  if (chdir(setup.folder.c_str()) != 0) {
    std::fprintf(stderr, "vdi_catalyst: %s: %s\n", setup.folder.c_str(), std::strerror(errno));
    return;
  }
  execve(arguments.front().c_str(), pointersOf(arguments).data(), pointersOf(environment).data());
}

int serve(const std::string& name, int ranks) {
  const sigset_t stepSignals = vdi::catalyst::setOfStepSignals();
  sigprocmask(SIG_BLOCK, &stepSignals, nullptr);
  sigset_t children;
  sigemptyset(&children);
  sigaddset(&children, SIGCHLD);
  sigprocmask(SIG_BLOCK, &children, nullptr);
  const Descriptor ends(signalfd(-1, &children, SFD_CLOEXEC));
  Socket socket;
  Socket::Received greeting = greetingOf(name, ranks, socket);
  if (!socket.isOpen()) {
    std::fprintf(stderr, "no rank of the simulation on this host waits for a process\n");
    return 1;
  }
  pid_t worker = 0;
  {
    const SharedPages pages(Descriptor(dup(greeting.descriptors[2].number())));
    Unpacker unpacker(pages.bytes());
    const Setup setup = Setup::unpack(unpacker);
    const pid_t self = getpid();
    worker = fork();
    if (worker == 0) {
      work(setup, socket, greeting, self);
      return 127;
    }
  }
  greeting.descriptors.clear();
  if (worker < 0) return 1;
  Packer number;
  number.put(Say::Worker);
  number.put(std::int32_t{worker});
  (void)socket.send(number.bytes());
  // Waits until the rank hangs up, or the worker ends.
  std::array<pollfd, 2> events{pollfd{socket.number(), 0, 0}, pollfd{ends.number(), POLLIN, 0}};
  int status = 0;
  for (;;) {
    poll(events.data(), events.size(), -1);
    if (events[0].revents != 0) {
      kill(worker, SIGKILL);
      return 1;
    }
    if (waitpid(worker, &status, WNOHANG) == worker) break;
    signalfd_siginfo taken{};
    if (events[1].revents != 0) (void)!read(ends.number(), &taken, sizeof taken);
  }
  Packer end;
  end.put(Say::Ended);
  end.put(std::int32_t{status});
  (void)socket.send(end.bytes());
  // If this process ended now, a launcher would end the whole job. The simulation ends the job once all its
  // ranks know.
  const bool isGood = WIFEXITED(status) && WEXITSTATUS(status) == 0;
  if (!isGood) poll(events.data(), 1, -1);
  return isGood ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  const std::span<char*> arguments(argv, static_cast<std::size_t>(argc));
  try {
    const std::string part = argc > 2 ? arguments[1] : "";
    if (part == "launch") return launch(std::span<char*>(argv + 2, static_cast<std::size_t>(argc - 1)));
    if (part == "serve" && argc == 4) return serve(arguments[2], std::atoi(arguments[3]));
    if (part == "work" && argc == 4)
      return vdi::catalyst::work(Socket(Descriptor(std::atoi(arguments[2]))),
                                 Descriptor(std::atoi(arguments[3])));
    std::fprintf(stderr, "%s is part of pv-vdi's Catalyst adaptor; only the adaptor can start it\n",
                 arguments[0]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "vdi_catalyst: %s\n", error.what());
  }
  return 1;
}
