// The scene of all ranks' blocks.
#pragma once

#include "vdi/comm/Communicator.h"
#include "vdi/core/Scene.h"

namespace vdi::comm {

/// Collective: the union of every rank's localScene.
Scene globalScene(const Communicator& comm, const Scene& local);

}  // namespace vdi::comm
