// Signals that a batch system or a terminal sends to all processes of a simulation, so that it
// writes a checkpoint or ends.
#pragma once

#include <array>
#include <csignal>

namespace vdi::catalyst {

/// An isolated run's processes end with the simulation, which alone decides what these signals
/// mean. In those processes they therefore do nothing. SIGSTOP and SIGKILL always act; SIGCONT,
/// which ends the former, does no harm.
constexpr std::array stepSignals{SIGHUP,  SIGINT,  SIGQUIT, SIGUSR1, SIGUSR2,
                                 SIGALRM, SIGTERM, SIGXCPU, SIGTSTP};

/// The signal with which a launcher is told to end. Batch systems don't send it.
constexpr int endOfLauncher = SIGHUP;

inline sigset_t setOfStepSignals() {
  sigset_t set;
  sigemptyset(&set);
  for (const int number : stepSignals) sigaddset(&set, number);
  return set;
}

}  // namespace vdi::catalyst
