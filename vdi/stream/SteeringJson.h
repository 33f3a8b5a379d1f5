// Wishes and controls as JSON. Only sources include this header, because it includes the JSON library.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "vdi/stream/Steering.h"

namespace vdi::stream {

/// Throws Error{Format}.
[[noreturn]] void refuse(const std::string& what);
/// The fields of "steer" that are set, without its type.
nlohmann::json jsonOf(const Wish& wish);
/// The fields of "steering" that hold controls.
nlohmann::json jsonOf(const Controls& controls);
/// Throw Error{Format} for fields of the wrong kind or out of the bounds that Steering.h gives.
Wish wishIn(const nlohmann::json& object);
Controls controlsIn(const nlohmann::json& object);

}  // namespace vdi::stream
