// The one exception type that the library throws for bad input and a failing environment.
// A caller's mistake (a broken precondition) is an assert, not an Error.
#pragma once

#include <stdexcept>
#include <string>
#include <utility>

namespace vdi {

enum class ErrorCode {
  InvalidArgument,    // a value that the caller passed can't be used: N_S = 0, zero spacing, mismatch between
                      // ranks
  DeviceUnavailable,  // no Vulkan device fits; the message lists every device and why it was refused
  OutOfMemory,        // the device or the host can't hold what was asked for; the message has the figure
  DeviceFailure,      // a Vulkan call failed
  Io,                 // a file can't be opened, read or written
  Format,             // the bytes of a file or message aren't what the format requires
  Communication,      // an MPI call failed
  RemoteRank,         // this rank is well, another one failed; the message carries the other rank's text
  Cancelled,          // the progress callback asked to stop
};

/// "InvalidArgument" and so on, for messages.
const char* toString(ErrorCode code);

/// what() reads "<what> (<context>)"; context names the file, device, rank or property in question and may be
/// empty.
class Error : public std::runtime_error {
 public:
  Error(ErrorCode code, const std::string& what, std::string context = {})
      : std::runtime_error(context.empty() ? what : what + " (" + context + ")"),
        code_(code),
        context_(std::move(context)) {}

  ErrorCode code() const { return code_; }
  const std::string& context() const { return context_; }

 private:
  ErrorCode code_;
  std::string context_;
};

}  // namespace vdi
