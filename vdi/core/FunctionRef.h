// A reference to a function object.
#pragma once

#include <memory>
#include <utility>

namespace vdi {

template <typename Signature>
class FunctionRef;

/// Refers to a function object that outlives the reference, such as an argument of the call that takes it.
/// Unlike std::function it allocates no memory, so that making one can't fail.
template <typename Result, typename... Arguments>
class FunctionRef<Result(Arguments...)> {
 public:
  template <typename Function>
  FunctionRef(const Function& function) noexcept  // NOLINT: implicit, as std::function's
      : object_(std::addressof(function)), call_([](const void* object, Arguments... arguments) -> Result {
          return (*static_cast<const Function*>(object))(std::forward<Arguments>(arguments)...);
        }) {}

  Result operator()(Arguments... arguments) const {
    return call_(object_, std::forward<Arguments>(arguments)...);
  }

 private:
  const void* object_;
  Result (*call_)(const void*, Arguments...);
};

}  // namespace vdi
