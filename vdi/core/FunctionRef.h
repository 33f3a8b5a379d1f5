// A reference to a function object.
#pragma once

#include <concepts>
#include <memory>
#include <type_traits>
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
  requires(!std::same_as<std::remove_cvref_t<Function>, FunctionRef> &&
           std::is_invocable_r_v<Result, Function&, Arguments...>) FunctionRef(Function&& function)
  noexcept  // NOLINT(*-explicit-*, *-forwarding-reference-*, *-missing-std-*)
      : object_(const_cast<void*>(static_cast<const void*>(std::addressof(function)))),
        call_([](void* object, Arguments... arguments) -> Result {
          return (*static_cast<std::remove_reference_t<Function>*>(object))(
              std::forward<Arguments>(arguments)...);
        }) {}

  Result operator()(Arguments... arguments) const {
    return call_(object_, std::forward<Arguments>(arguments)...);
  }

 private:
  void* object_;
  Result (*call_)(void*, Arguments...);
};

}  // namespace vdi
