// A command of the shell, whose standard input and output are the two directions of one connection.
#pragma once

#include <sys/types.h>

#include <string>

#include "vdi/core/Descriptor.h"

namespace vdi::stream {

class Command {
 public:
  /// Starts `sh -c text`. Its standard error is this process's. Throws Error{Io}.
  explicit Command(const std::string& text);
  /// Calls end().
  ~Command();
  Command(const Command&) = delete;
  Command& operator=(const Command&) = delete;

  /// This side's end of the connection, a local socket, which the caller owns from now on. Call once.
  int takeSocket();

  struct Ending {
    std::string how;          // "ended with status 1"
    bool isNotFound = false;  // the shell found nothing to run
  };
  /// Waits a second for the command to end, as it should when its connection is closed. Then terminates it,
  /// and kills it after another second.
  Ending end();

 private:
  Descriptor socket_;
  pid_t process_ = -1;  // -1: it has ended
  Ending ending_;
};

}  // namespace vdi::stream
