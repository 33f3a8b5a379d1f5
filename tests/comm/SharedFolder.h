// A folder for tests on several ranks.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>

#include "tests/TemporaryFolder.h"
#include "vdi/comm/Communicator.h"

namespace vdi::test {

/// The root's temporary folder, known to all ranks. Creating it is collective. It is removed when all ranks
/// have finished with it.
class SharedFolder {
 public:
  explicit SharedFolder(const comm::Communicator& comm) : comm_(comm) {
    const auto create = [this] { return own_.emplace().path().string(); };
    path_ = comm.broadcastText(create, 0);
  }
  ~SharedFolder() { comm_.barrier(); }
  SharedFolder(const SharedFolder&) = delete;
  SharedFolder& operator=(const SharedFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }
  std::size_t fileCount() const { return own_->fileCount(); }  // on the root only

 private:
  const comm::Communicator& comm_;
  std::optional<TemporaryFolder> own_;
  std::filesystem::path path_;
};

}  // namespace vdi::test
