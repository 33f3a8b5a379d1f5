// The exception that a call throws.
#pragma once

#include <exception>
#include <functional>
#include <optional>
#include <string>

#include "tests/Catch.h"
#include "vdi/core/Error.h"

namespace vdi::test {

/// The code and the text of an exception; no code if there was none. An exception that isn't an Error has
/// code Io.
struct Thrown {
  std::optional<ErrorCode> code;
  std::string text;
};

inline Thrown thrownBy(const std::function<void()>& call) {
  try {
    call();
  } catch (const Error& error) {
    return {error.code(), error.what()};
  } catch (const std::exception& error) {
    return {ErrorCode::Io, error.what()};
  }
  return {};
}

/// The error that `call` throws; fails the test if it throws none, or another exception.
inline Error errorOf(const std::function<void()>& call) {
  try {
    call();
  } catch (const Error& error) {
    return error;
  }
  FAIL("nothing was thrown");
  return {ErrorCode::Io, ""};
}

}  // namespace vdi::test
