// A simulation that has its own settings of the process, and checks after each call of the adaptor
// that they are unchanged: signals, floating point, locale, environment, folder, umask, limits,
// streams. Argument: a script that changes all it can, or a JSON text. Beside the script's run, a call of
// another run begins earlier and ends earlier. Exit status 0 if each call succeeded, but for the first one,
// which is refused, and nothing had changed.
#include <dirent.h>
#include <fcntl.h>
#include <mpi.h>
#include <pthread.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <unistd.h>

#include <array>
#include <cfenv>
#include <clocale>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>
#include <functional>
#include <future>
#include <iostream>
#include <locale>
#include <map>
#include <new>
#include <sstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "catalyst_adaptor/vdi_catalyst.h"

namespace {

using State = std::map<std::string, std::string>;  // by name

constexpr int lastSignal = 64;

volatile std::sig_atomic_t terminations = 0;

void ownHandler(int signal) {
  if (signal == SIGTERM) terminations = terminations + 1;
}

template <typename Value>
std::string textOf(const Value& value) {
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text << value;
  return text.str();
}

/// A value's bytes as text.
template <typename Value>
std::string bitsOf(const Value& value) {
  std::array<unsigned char, sizeof(Value)> bytes{};
  std::memcpy(bytes.data(), &value, sizeof(Value));
  std::string text;
  for (const unsigned char byte : bytes) text += textOf(static_cast<int>(byte)) + " ";
  return text;
}

std::string setOf(const sigset_t& signals) {
  std::string text;
  for (int signal = 1; signal <= lastSignal; ++signal) {
    if (sigismember(&signals, signal) == 1) text += textOf(signal) + " ";
  }
  return text;
}

void addSignals(State& state) {
  for (int signal = 1; signal <= lastSignal; ++signal) {
    struct sigaction action {};
    if (sigaction(signal, nullptr, &action) != 0) continue;  // signals that libc's threads use
    state["signal " + textOf(signal)] = textOf(reinterpret_cast<const void*>(action.sa_sigaction)) +
                                        ", flags " + textOf(action.sa_flags) + ", blocks " +
                                        setOf(action.sa_mask);
  }
  sigset_t blocked;
  pthread_sigmask(SIG_SETMASK, nullptr, &blocked);
  state["blocked signals"] = setOf(blocked);
  stack_t stack{};
  sigaltstack(nullptr, &stack);
  state["signal stack"] = textOf(stack.ss_sp) + ", flags " + textOf(stack.ss_flags);
  for (const int which : {ITIMER_REAL, ITIMER_VIRTUAL, ITIMER_PROF}) {
    itimerval timer{};
    getitimer(which, &timer);
    state["timer " + textOf(which)] = textOf(timer.it_interval.tv_sec) + " " + textOf(timer.it_value.tv_sec);
  }
}

void addFloatingPoint(State& state) {
  state["floating-point traps"] = textOf(fegetexcept());
  state["rounding"] = textOf(fegetround());
  state["floating-point flags"] = textOf(std::fetestexcept(FE_ALL_EXCEPT));
#if defined(__x86_64__)
  std::fenv_t environment;
  std::fegetenv(&environment);
  state["denormal numbers"] = textOf(environment.__mxcsr & 0x8040U);
#endif
}

void addLocale(State& state) {
  state["locale"] = std::setlocale(LC_ALL, nullptr);
  state["thread's locale"] = textOf(static_cast<const void*>(uselocale(nullptr)));
  state["C++ locale"] = std::locale().name();
}

void addEnvironment(State& state) {
  for (char** variable = environ; *variable != nullptr; ++variable) {
    const std::string text = *variable;
    const auto sign = text.find('=');
    state["variable " + text.substr(0, sign)] = text.substr(sign + 1);
  }
}

void addFiles(State& state) {
  state["folder"] = std::filesystem::current_path().string();
  const mode_t mask = umask(0);
  umask(mask);
  state["umask"] = textOf(mask);
  for (const int file : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    struct stat status {};
    fstat(file, &status);
    state["standard file " + textOf(file)] =
        textOf(status.st_dev) + " " + textOf(status.st_ino) + ", flags " + textOf(fcntl(file, F_GETFL));
  }
}

void addStreams(State& state) {
  for (const auto& [name, stream] : std::vector<std::pair<std::string, std::ios*>>{
           {"cout", &std::cout}, {"cerr", &std::cerr}, {"clog", &std::clog}, {"cin", &std::cin}}) {
    state[name] = textOf(static_cast<const void*>(stream->rdbuf())) + ", flags " + textOf(stream->flags()) +
                  ", precision " + textOf(stream->precision()) + ", state " + textOf(stream->rdstate());
  }
  state["terminate"] = textOf(reinterpret_cast<const void*>(std::get_terminate()));
  state["new handler"] = textOf(reinterpret_cast<const void*>(std::get_new_handler()));
}

void addLimits(State& state) {
  for (int limit = 0; limit < RLIMIT_NLIMITS; ++limit) {
    rlimit values{};
    getrlimit(static_cast<__rlimit_resource>(limit), &values);
    state["limit " + textOf(limit)] = textOf(values.rlim_cur) + " of " + textOf(values.rlim_max);
  }
  cpu_set_t cores;
  sched_getaffinity(0, sizeof cores, &cores);
  state["cores"] = bitsOf(cores);
  state["priority"] = textOf(getpriority(PRIO_PROCESS, 0));
  state["scheduler"] = textOf(sched_getscheduler(0));
  std::array<char, 17> name{};
  prctl(PR_GET_NAME, name.data());
  state["thread's name"] = name.data();
  int deathSignal = 0;
  prctl(PR_GET_PDEATHSIG, &deathSignal);
  state["signal at the parent's end"] = textOf(deathSignal);
  state["dumpable"] = textOf(prctl(PR_GET_DUMPABLE));
  state["no new privileges"] = textOf(prctl(PR_GET_NO_NEW_PRIVS, 0, 0, 0, 0));
}

/// Counts the names of shared memory that would remain if the process were killed now.
void addSharedMemory(State& state) {
  std::ifstream maps("/proc/self/maps");
  int names = 0;
  for (std::string line; std::getline(maps, line);)
    names += line.find("/dev/shm/pv-vdi") != std::string::npos && line.find("(deleted)") == std::string::npos;
  state["names of shared memory"] = textOf(names);
}

State stateOfProcess() {
  State state;
  addFloatingPoint(state);  // first, before this function's own operations
  addSignals(state);
  addLocale(state);
  addEnvironment(state);
  addFiles(state);
  addStreams(state);
  addLimits(state);
  addSharedMemory(state);
  return state;
}

/// Makes settings that no library would choose, so that any change shows.
void makeOwnSettings() {
  for (int signal = 1; signal <= lastSignal; ++signal) {
    struct sigaction action {};
    // A limit of file sizes ends the process, unless the adaptor ignores the signal during its calls.
    action.sa_handler = signal == SIGXFSZ ? SIG_DFL : &ownHandler;
    action.sa_flags = SA_RESTART;
    sigemptyset(&action.sa_mask);
    sigaddset(&action.sa_mask, SIGWINCH);
    if (signal != SIGCHLD) sigaction(signal, &action, nullptr);  // fails for SIGKILL, for example
  }
  std::setlocale(LC_ALL, "C");
  std::setlocale(LC_NUMERIC, "C.UTF-8");  // the only other locale that exists everywhere
  umask(027);
  setenv("SIMULATION_OWN", "value", 1);
  unsetenv("VDI_PLUGIN");
  std::cout.precision(11);
  std::fesetround(FE_UPWARD);
  std::feclearexcept(FE_ALL_EXCEPT);
  std::feraiseexcept(FE_INEXACT);
  feenableexcept(FE_DIVBYZERO | FE_INVALID | FE_OVERFLOW);
}

int wrong = 0;

void compare(const char* call, int code, const State& before, int wanted = VDI_CATALYST_OK) {
  const State now = stateOfProcess();
  const auto valueIn = [](const State& state, const std::string& what) {
    const auto found = state.find(what);
    return found == state.end() ? std::string("(none)") : "'" + found->second + "'";
  };
  State both = before;
  both.insert(now.begin(), now.end());
  if (code != wanted) {
    std::fprintf(stderr, "FAILED: %s returned %d, not %d\n", call, code, wanted);
    ++wrong;
  }
  for (const auto& [what, ignored] : both) {
    const std::string old = valueIn(before, what);
    const std::string current = valueIn(now, what);
    if (old == current) continue;
    std::fprintf(stderr, "FAILED: %s changed: %s: %s became %s\n", call, what.c_str(), old.c_str(),
                 current.c_str());
    ++wrong;
  }
}

/// What happens within this thread's next MPI_Allreduce; empty: nothing.
thread_local std::function<void()> meanwhile;

/// Two threads ask two runs for a step. The first one begins and returns first.
void overlap(vdi_catalyst* first, vdi_catalyst* second) {
  std::promise<void> hasEntered;
  std::promise<void> hasReturned;
  std::thread other;
  meanwhile = [&] {
    other = std::thread([&] {
      meanwhile = [&] {
        hasEntered.set_value();
        hasReturned.get_future().wait();
      };
      vdi_catalyst_wants(second, 1, 1.0);
      if (std::exchange(meanwhile, nullptr)) hasEntered.set_value();  // the call was refused
    });
    hasEntered.get_future().wait();
  };
  vdi_catalyst_wants(first, 1, 1.0);
  hasReturned.set_value();
  if (other.joinable()) other.join();
  if (!std::exchange(meanwhile, nullptr)) return;
  std::fprintf(stderr, "FAILED: the calls didn't overlap\n");
  ++wrong;
}

}  // namespace

/// The libraries find this function, and not MPI's, because the program exports it.
extern "C" __attribute__((visibility("default"))) int MPI_Allreduce(const void* from, void* to, int count,
                                                                    MPI_Datatype type, MPI_Op op,
                                                                    MPI_Comm comm) {
  if (const auto action = std::exchange(meanwhile, nullptr)) action();
  return PMPI_Allreduce(from, to, count, type, op, comm);
}

int main(int argc, char** argv) {
  int level = 0;
  MPI_Init_thread(&argc, &argv, MPI_THREAD_SERIALIZED, &level);
  if (argc < 2) MPI_Abort(MPI_COMM_WORLD, 2);
  const std::string what = argv[1];
  const bool isScript = what.ends_with(".py");
  const MPI_Fint comm = MPI_Comm_c2f(MPI_COMM_WORLD);
  // A script names the folder of its VDIs itself; a run without one writes to the current folder.
  std::filesystem::current_path(isScript ? "/" : std::getenv("VDI_OUTPUT"));
  makeOwnSettings();
  const State before = stateOfProcess();

  vdi_catalyst* catalyst = nullptr;
  const auto initialize = [&](const char* given) {
    if (!isScript) return vdi_catalyst_initialize_json(comm, given, &catalyst);
    return vdi_catalyst_initialize(comm, 1, &given, &catalyst);
  };
  const char* const refused = isScript ? "/nowhere.py" : R"({"field": "V", "every": -1})";
  compare("a refused initialize", initialize(refused), before, VDI_CATALYST_SCRIPT);
  compare("initialize", initialize(what.c_str()), before);
  constexpr int n = 8;
  static std::array<float, n * n * n> values;
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  const vdi_catalyst_block block{
      {n, n, n}, {0, 0, 0}, {0, 0, 0}, {static_cast<double>(n * rank), 0, 0}, {1, 1, 1}};
  const std::array<const void*, 1> data{values.data()};
  compare("set_blocks", vdi_catalyst_set_blocks(catalyst, 1, &block), before);
  compare("set_array",
          vdi_catalyst_set_array(catalyst, "V", VDI_CATALYST_F32, VDI_CATALYST_CELLS, data.data()), before);
  const std::array<double, 3> position{n * rank + 0.5 * n, 0.5 * n, 0.5 * n};
  vdi_catalyst_particles particles{};
  particles.count = 1;
  particles.kind = VDI_CATALYST_DENSITY;
  particles.position_type = VDI_CATALYST_F64;
  for (std::size_t axis = 0; axis < position.size(); ++axis) particles.positions[axis] = &position[axis];
  particles.position_stride = sizeof position;
  compare("set_particles", vdi_catalyst_set_particles(catalyst, "P", &particles), before);
  constexpr int steps = 2;
  for (int step = 1; step <= steps; ++step) {
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<float>(i + 10 * step);
    std::feclearexcept(FE_ALL_EXCEPT);
    std::feraiseexcept(FE_INEXACT);
    const bool isWanted = vdi_catalyst_wants(catalyst, step, step) != 0;
    compare("wants", isWanted ? VDI_CATALYST_OK : VDI_CATALYST_ENGINE, before);
    compare("execute", vdi_catalyst_execute(catalyst, step, step), before);
  }
  if (isScript && std::getenv("VDI_ISOLATION") == nullptr) {
    vdi_catalyst* beside = nullptr;
    compare("a second run", vdi_catalyst_initialize_json(comm, R"({"field": "V"})", &beside), before);
    overlap(beside, catalyst);
    compare("calls that overlap", vdi_catalyst_finalize(beside), before);
  }
  compare("finalize", vdi_catalyst_finalize(catalyst), before);
  // A script in a separate process sends the signals to that process.
  const int sent = isScript && std::getenv("VDI_ISOLATION") == nullptr ? steps : 0;
  if (terminations != sent) {
    std::fprintf(stderr, "FAILED: of %d signals that the script sent, %d came\n", sent,
                 static_cast<int>(terminations));
    ++wrong;
  }
  MPI_Finalize();
  return wrong == 0 ? 0 : 1;
}
