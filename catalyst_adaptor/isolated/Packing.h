// Values as bytes, for messages between two processes of one host that run the same build.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace vdi::catalyst {

class Packer {
 public:
  template <typename Value>
  void put(const Value& value) {
    static_assert(std::is_trivially_copyable_v<Value> && !std::is_pointer_v<Value>);
    const auto* from = reinterpret_cast<const std::byte*>(&value);
    bytes_.insert(bytes_.end(), from, from + sizeof value);
  }
  void putText(std::string_view text) {
    put(std::uint64_t{text.size()});
    const auto* from = reinterpret_cast<const std::byte*>(text.data());
    bytes_.insert(bytes_.end(), from, from + text.size());
  }
  template <typename Value>
  void putAll(const std::vector<Value>& values) {
    put(std::uint64_t{values.size()});
    for (const Value& value : values) put(value);
  }
  std::span<const std::byte> bytes() const { return bytes_; }

 private:
  std::vector<std::byte> bytes_;
};

class Unpacker {
 public:
  explicit Unpacker(std::span<const std::byte> bytes) : rest_(bytes) {}

  /// Throws std::runtime_error if too few bytes are left.
  template <typename Value>
  Value take() {
    static_assert(std::is_trivially_copyable_v<Value> && !std::is_pointer_v<Value>);
    Value value;
    std::memcpy(&value, next(sizeof value), sizeof value);
    return value;
  }
  std::string takeText() {
    const auto size = take<std::uint64_t>();
    return {reinterpret_cast<const char*>(next(size)), size};
  }
  template <typename Value>
  std::vector<Value> takeAll() {
    std::vector<Value> values;
    for (auto left = take<std::uint64_t>(); left > 0; --left) values.push_back(take<Value>());
    return values;
  }

 private:
  const std::byte* next(std::size_t count) {
    if (count > rest_.size()) throw std::runtime_error("a message between the processes is cut short");
    const std::byte* at = rest_.data();
    rest_ = rest_.subspan(count);
    return at;
  }

  std::span<const std::byte> rest_;
};

}  // namespace vdi::catalyst
