#include "catalyst_adaptor/isolated/Job.h"

#include <fcntl.h>
#include <mpi.h>
#include <poll.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "catalyst_adaptor/isolated/Messages.h"
#include "catalyst_adaptor/isolated/StepSignals.h"

namespace vdi::catalyst {

namespace {

#ifdef OPEN_MPI
constexpr const char* usual = "mpirun --oversubscribe --bind-to none -np {ranks} --host {hosts}";
#else
constexpr const char* usual = "mpirun -n {ranks} -hosts {hosts}";
#endif

void replaceAll(std::string& text, const std::string& what, const std::string& with) {
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + with.size()))
    text.replace(at, what.size(), with);
}

/// "a:2,b:1" for ranks on a, a and b.
std::string hostsOf(const std::vector<std::string>& names) {
  std::vector<std::pair<std::string, int>> hosts;
  for (const std::string& name : names) {
    auto found = hosts.begin();
    while (found != hosts.end() && found->first != name) ++found;
    if (found == hosts.end()) found = hosts.insert(found, {name, 0});
    ++found->second;
  }
  std::string list;
  for (const auto& [name, count] : hosts)
    list += (list.empty() ? "" : ",") + name + ":" + std::to_string(count);
  return list;
}

std::vector<char*> pointersOf(const std::vector<std::string>& texts) {
  std::vector<char*> pointers;
  pointers.reserve(texts.size() + 1);
  for (const std::string& text : texts) pointers.push_back(const_cast<char*>(text.c_str()));
  pointers.push_back(nullptr);
  return pointers;
}

/// The actions and attributes of posix_spawn, which need freeing.
struct Spawning {
  Spawning() {
    posix_spawn_file_actions_init(&actions);
    posix_spawnattr_init(&attributes);
  }
  ~Spawning() {
    posix_spawn_file_actions_destroy(&actions);
    posix_spawnattr_destroy(&attributes);
  }
  Spawning(const Spawning&) = delete;
  Spawning& operator=(const Spawning&) = delete;
  posix_spawn_file_actions_t actions{};
  posix_spawnattr_t attributes{};
};

}  // namespace

std::vector<std::string> commandOf(const std::string& launcher, const std::vector<std::string>& names,
                                   const std::vector<std::string>& program) {
  std::vector<std::string> command;
  if (!launcher.empty() || names.size() > 1) {
    std::istringstream words(launcher.empty() ? usual : launcher);
    for (std::string word; words >> word;) {
      replaceAll(word, "{ranks}", std::to_string(names.size()));
      replaceAll(word, "{hosts}", hostsOf(names));
      command.push_back(word);
    }
  }
  command.insert(command.end(), program.begin(), program.end());
  return command;
}

Job::Job(const std::string& program, const std::vector<std::string>& command) {
  std::array<int, 2> ends{-1, -1};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) throw std::runtime_error(std::strerror(errno));
  life_ = Descriptor(ends[0]);
  const Descriptor written(ends[1]);
  output_ = Descriptor(memfd_create("pv-vdi-launcher", MFD_CLOEXEC));
  if (!output_.isOpen()) throw std::runtime_error(std::strerror(errno));

  std::vector<std::string> arguments{program, "launch"};
  arguments.insert(arguments.end(), command.begin(), command.end());
  std::vector<std::string> environment;
  for (char** variable = environ; variable != nullptr && *variable != nullptr; ++variable) {
    if (!isOfMpiJob(*variable)) environment.emplace_back(*variable);
  }
  // These variables have the effect of mpirun --quiet, an option that Open MPI 5 lacks.
  environment.emplace_back("OMPI_MCA_orte_execute_quiet=1");
  environment.emplace_back("PRTE_MCA_prte_execute_quiet=1");

  Spawning how;
  constexpr int life = 3;  // as the program expects it
  posix_spawn_file_actions_addopen(&how.actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&how.actions, output_.number(), STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&how.actions, output_.number(), STDERR_FILENO);
  posix_spawn_file_actions_adddup2(&how.actions, written.number(), life);
  posix_spawn_file_actions_addclosefrom_np(&how.actions, life + 1);
  sigset_t all;
  sigfillset(&all);
  // Launchers handle these signals, so ignoring them wouldn't last. Blocking does.
  sigset_t blocked = setOfStepSignals();
  sigdelset(&blocked, endOfLauncher);
  posix_spawnattr_setsigdefault(&how.attributes, &all);
  posix_spawnattr_setsigmask(&how.attributes, &blocked);
  posix_spawnattr_setflags(&how.attributes,
                           POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSID);
  pid_t starter = 0;
  const int error = posix_spawn(&starter, program.c_str(), &how.actions, &how.attributes,
                                pointersOf(arguments).data(), pointersOf(environment).data());
  if (error != 0) throw std::runtime_error(program + " can't be started: " + std::strerror(error));
  // The starter starts the job and ends, so that the job isn't a child for which the simulation must wait.
  while (waitpid(starter, nullptr, 0) < 0 && errno == EINTR) {
  }
  pollfd events{life_.number(), POLLIN, 0};
  constexpr int patience = 10000;  // ms; the job writes its number at once, unless it has failed
  if (poll(&events, 1, patience) != 1 ||
      read(life_.number(), &process_, sizeof process_) != static_cast<ssize_t>(sizeof process_))
    process_ = 0;
}

Job::~Job() {
  if (process_ <= 0 || isOver(std::chrono::milliseconds(0))) return;
  kill(process_, endOfLauncher);
  kill(process_, SIGCONT);
}

bool Job::isOver(std::chrono::milliseconds patience) const {
  pollfd events{life_.number(), 0, 0};
  return poll(&events, 1, static_cast<int>(patience.count())) == 1;
}

std::string Job::said() const {
  std::array<char, 4096> text{};
  const ssize_t count = pread(output_.number(), text.data(), text.size(), 0);
  std::string line;
  for (ssize_t i = 0; i < count; ++i) {
    const char letter = text[static_cast<std::size_t>(i)];
    const bool isBlank = letter == '\n' || letter == ' ';
    if (!isBlank) {
      line += letter;
    } else if (!line.empty() && line.back() != ' ') {
      line += ' ';
    }
  }
  while (!line.empty() && line.back() == ' ') line.pop_back();
  constexpr std::size_t longest = 600;
  return line.substr(0, longest);
}

}  // namespace vdi::catalyst
