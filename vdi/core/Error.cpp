#include "vdi/core/Error.h"

namespace vdi {

const char* toString(ErrorCode code) {
  switch (code) {
    case ErrorCode::InvalidArgument:
      return "InvalidArgument";
    case ErrorCode::DeviceUnavailable:
      return "DeviceUnavailable";
    case ErrorCode::OutOfMemory:
      return "OutOfMemory";
    case ErrorCode::DeviceFailure:
      return "DeviceFailure";
    case ErrorCode::Io:
      return "Io";
    case ErrorCode::Format:
      return "Format";
    case ErrorCode::Communication:
      return "Communication";
    case ErrorCode::RemoteRank:
      return "RemoteRank";
    case ErrorCode::Cancelled:
      return "Cancelled";
  }
  return "unknown";
}

}  // namespace vdi
