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

#include "vdi/core/Descriptor.h"

namespace vdi::gpu {

namespace {

constexpr std::uint64_t maxBytes = 256ULL << 20;

/// The file's header.
struct Header {
  std::array<char, 8> what{'v', 'd', 'i', 's', 'h', 'd', 'r', '1'};
  std::uint64_t bytes = 0;     // size of the data, which follow
  std::uint64_t checksum = 0;  // checksum of the data, because drivers need not notice damage
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

bool readAll(int descriptor, std::span<std::byte> to) {
  while (!to.empty()) {
    const ssize_t got = ::read(descriptor, to.data(), to.size());
    if (got <= 0) return false;
    to = to.subspan(static_cast<std::size_t>(got));
  }
  return true;
}

/// Whether the data begin with Vulkan's header for this device, followed by more.
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
    const Descriptor file(open(path_.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
    struct stat state {};
    if (!file.isOpen() || fstat(file.number(), &state) != 0 || !S_ISREG(state.st_mode) ||
        state.st_uid != geteuid())
      return {};
    Header header;
    const Header expected;
    const auto bytes = static_cast<std::uint64_t>(state.st_size);
    if (bytes < sizeof header || bytes > maxBytes ||
        !readAll(file.number(), std::as_writable_bytes(std::span(&header, 1))) ||
        header.what != expected.what || header.bytes != bytes - sizeof header)
      return {};
    std::vector<std::byte> data(header.bytes);
    if (!readAll(file.number(), data) || checksumOf(data) != header.checksum || !suits(data, key_)) return {};
    return data;
  } catch (const std::exception&) {  // out of memory
    return {};
  }
}

void PipelineCacheFile::write(std::span<const std::byte> data) const noexcept {
  if (path_.empty() || data.size() + sizeof(Header) > maxBytes || !suits(data, key_)) return;
  try {
    std::error_code failed;
    std::filesystem::create_directories(folder_, failed);
    std::string temporary = path_ + ".XXXXXX";
    const Descriptor file(mkostemp(temporary.data(), O_CLOEXEC));
    if (!file.isOpen()) return;
    Header header;
    header.bytes = data.size();
    header.checksum = checksumOf(data);
    const bool isWritten =
        writeAll(file.number(), std::as_bytes(std::span(&header, 1))) && writeAll(file.number(), data);
    if (!isWritten || std::rename(temporary.c_str(), path_.c_str()) != 0) unlink(temporary.c_str());
  } catch (const std::exception&) {  // the next run compiles again
  }
}

}  // namespace vdi::gpu
