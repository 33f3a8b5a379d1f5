// The one exception type that the library throws for bad input and a failing environment.
// A mistake of the library's own code (a broken precondition) is an assert, not an Error.
#pragma once

#include <stdexcept>
#include <string>
#include <utility>

namespace vdi {

enum class ErrorCode {
  InvalidArgument,    // the caller passed an unusable value, or ranks passed different ones
  DeviceUnavailable,  // no Vulkan device fits; the message lists every device and why it was refused
  OutOfMemory,        // the device or the host cannot hold the data; the message gives the sizes
  DeviceFailure,      // a Vulkan call failed
  Io,                 // a file cannot be opened, read or written
  Format,             // the bytes of a file or message violate the format
  Communication,      // an MPI call failed
  RemoteRank,         // another rank failed, but not this one; the message carries that rank's text
  Cancelled,          // the progress callback asked to stop
};

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
