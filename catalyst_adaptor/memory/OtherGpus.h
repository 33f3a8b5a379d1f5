// Memory of GPUs from which values can't be copied here: those of HIP and Level Zero.
#pragma once

#include <memory>
#include <string>

namespace vdi::catalyst {

/// It asks only libraries that the process has loaded.
class OtherGpus {
 public:
  OtherGpus();
  ~OtherGpus();
  OtherGpus(OtherGpus&&) noexcept;
  OtherGpus& operator=(OtherGpus&&) noexcept;

  /// Finds libraries and drivers that the process has loaded since.
  void look();
  /// What the address is, and what to write instead, if it lies in memory of such a GPU that the host can't
  /// read; "" for all other addresses.
  std::string at(const void* address) const;

 private:
  struct Hip;
  struct LevelZero;
  std::unique_ptr<Hip> hip_;
  std::unique_ptr<LevelZero> levelZero_;
};

}  // namespace vdi::catalyst
