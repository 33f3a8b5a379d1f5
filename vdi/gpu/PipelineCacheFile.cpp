#include "vdi/gpu/PipelineCacheFile.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <system_error>
#include <utility>

namespace vdi::gpu {

namespace {

constexpr std::uint64_t maxBytes = 256ULL << 20;

/// At the file's beginning.
struct Header {
  std::array<char, 8> what{'v', 'd', 'i', 's', 'h', 'd', 'r', '1'};
  std::uint64_t bytes = 0;     // of the data, which follow
  std::uint64_t checksum = 0;  // of the data: drivers need not notice damage
};

/// FNV-1a.
std::uint64_t checksumOf(std::span<const std::byte> data) {
  std::uint64_t sum = 0xCBF29CE484222325U;
  for (const std::byte byte : data) sum = (sum ^ static_cast<std::uint64_t>(byte)) * 0x100000001B3U;
  return sum;
}

std::string hex(const std::array<std::uint8_t, VK_UUID_SIZE>& uuid) {
  std::string text;
  for (const std::uint8_t byte : uuid) text += fmt::format("{:02x}", byte);
  return text;
}

/// A file descriptor that its destructor closes.
class OpenFile {
 public:
  explicit OpenFile(int descriptor) : descriptor_(descriptor) {}
  ~OpenFile() {
    if (descriptor_ >= 0) close(descriptor_);
  }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
  OpenFile(OpenFile&&) = delete;
  OpenFile& operator=(OpenFile&&) = delete;
  bool isOpen() const { return descriptor_ >= 0; }
  int descriptor() const { return descriptor_; }

  bool read(void* to, std::size_t bytes) const {
    auto* at = static_cast<std::byte*>(to);
    while (bytes > 0) {
      const ssize_t got = ::read(descriptor_, at, bytes);
      if (got <= 0) return false;
      at += got;
      bytes -= static_cast<std::size_t>(got);
    }
    return true;
  }
  bool write(const void* from, std::size_t bytes) const {
    const auto* at = static_cast<const std::byte*>(from);
    while (bytes > 0) {
      const ssize_t put = ::write(descriptor_, at, bytes);
      if (put <= 0) return false;
      at += put;
      bytes -= static_cast<std::size_t>(put);
    }
    return true;
  }

 private:
  int descriptor_;
};

/// Whether the data begin with Vulkan's header for this device, and have more than that.
bool suits(std::span<const std::byte> data, const PipelineCacheKey& key) {
  VkPipelineCacheHeaderVersionOne header{};
  if (data.size() <= sizeof header) return false;
  std::memcpy(&header, data.data(), sizeof header);
  return header.headerSize >= sizeof header && header.headerSize < data.size() &&
         header.headerVersion == VK_PIPELINE_CACHE_HEADER_VERSION_ONE && header.vendorID == key.vendor &&
         header.deviceID == key.device &&
         std::equal(key.cacheUuid.begin(), key.cacheUuid.end(), header.pipelineCacheUUID);
}

}  // namespace

PipelineCacheKey pipelineCacheKeyOf(VkPhysicalDevice device) {
  VkPhysicalDeviceIDProperties id{};
  id.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_ID_PROPERTIES;
  VkPhysicalDeviceProperties2 properties{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2, &id, {}};
  vkGetPhysicalDeviceProperties2(device, &properties);
  PipelineCacheKey key;
  key.vendor = properties.properties.vendorID;
  key.device = properties.properties.deviceID;
  key.driverVersion = properties.properties.driverVersion;
  std::copy_n(properties.properties.pipelineCacheUUID, VK_UUID_SIZE, key.cacheUuid.begin());
  std::copy_n(id.driverUUID, VK_UUID_SIZE, key.driverUuid.begin());
  return key;
}

PipelineCacheFile::PipelineCacheFile(std::string folder, const PipelineCacheKey& key)
    : folder_(std::move(folder)), key_(key) {
  if (folder_.empty()) return;
  path_ = fmt::format("{}/shaders-{:x}-{:x}-{:x}-{}-{}", folder_, key.vendor, key.device, key.driverVersion,
                      hex(key.driverUuid), hex(key.cacheUuid));
}

std::vector<std::byte> PipelineCacheFile::read() const noexcept {
  if (path_.empty()) return {};
  try {
    const OpenFile file(open(path_.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
    struct stat state {};
    if (!file.isOpen() || fstat(file.descriptor(), &state) != 0 || !S_ISREG(state.st_mode) ||
        state.st_uid != geteuid())
      return {};
    Header header;
    const Header expected;
    const auto bytes = static_cast<std::uint64_t>(state.st_size);
    if (bytes < sizeof header || bytes > maxBytes || !file.read(&header, sizeof header) ||
        header.what != expected.what || header.bytes != bytes - sizeof header)
      return {};
    std::vector<std::byte> data(header.bytes);
    if (!file.read(data.data(), data.size()) || checksumOf(data) != header.checksum || !suits(data, key_))
      return {};
    return data;
  } catch (const std::exception&) {  // no memory
    return {};
  }
}

void PipelineCacheFile::write(std::span<const std::byte> data) const noexcept {
  if (path_.empty() || data.size() + sizeof(Header) > maxBytes || !suits(data, key_)) return;
  try {
    std::error_code failed;
    std::filesystem::create_directories(folder_, failed);
    std::string temporary = path_ + ".XXXXXX";
    const OpenFile file(mkostemp(temporary.data(), O_CLOEXEC));
    if (!file.isOpen()) return;
    Header header;
    header.bytes = data.size();
    header.checksum = checksumOf(data);
    const bool isWritten = file.write(&header, sizeof header) && file.write(data.data(), data.size());
    if (!isWritten || std::rename(temporary.c_str(), path_.c_str()) != 0) unlink(temporary.c_str());
  } catch (const std::exception&) {  // the next run compiles again
  }
}

}  // namespace vdi::gpu
