// Wishes and controls as JSON. Only sources include this header.
#pragma once

#include <string>

#include "vdi/io/Json.h"
#include "vdi/io/JsonText.h"
#include "vdi/stream/Steering.h"

namespace vdi::stream {

/// Throws Error{Format}.
[[noreturn]] void refuse(const std::string& what);
/// Adds the fields of "steer" that are set, without its type.
void addWish(io::JsonObject& object, const Wish& wish);
/// Adds the fields of "steering" that hold controls.
void addControls(io::JsonObject& object, const Controls& controls);
/// Throw Error{Format} for fields of the wrong kind or out of the bounds that Steering.h gives.
Wish wishIn(const io::JsonValue& object);
Controls controlsIn(const io::JsonValue& object);

}  // namespace vdi::stream
