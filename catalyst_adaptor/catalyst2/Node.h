// Reads the nodes that a simulation passes through Catalyst, and trusts none of them.
#pragma once

#include <catalyst.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace vdi::catalyst {

/// The numbers of a leaf, where the simulation has them.
struct Leaf {
  std::int32_t type = 0;  // a type of vdi_catalyst.h
  std::size_t scalarBytes = 1;
  const std::byte* first = nullptr;
  std::int64_t count = 0;
  std::int64_t stride = 0;  // in bytes

  /// Value number `index`, 0 <= index < count.
  double at(std::int64_t index) const;
  /// Value number `index` as an integer, 0 <= index < count.
  std::int64_t wholeAt(std::int64_t index) const;
};

/// A Conduit node, which must outlive this object. All functions except has and find throw
/// std::invalid_argument, with the node's path, if the node isn't of the requested kind.
class Node {
 public:
  Node(const conduit_node* node, std::string path);

  bool has(const std::string& path) const;
  std::optional<Node> find(const std::string& path) const;
  Node at(const std::string& path) const;
  /// The children; none if the node is a leaf or empty.
  std::vector<Node> children() const;

  const std::string& path() const { return path_; }
  std::string name() const;
  bool isText() const;
  bool isWhole() const;
  bool isNumber() const;
  std::string text() const;
  std::int64_t whole() const;
  double number() const;
  Leaf leaf() const;

  [[noreturn]] void refuse(const std::string& why) const;

 private:
  conduit_node* node_;
  std::string path_;
};

}  // namespace vdi::catalyst
