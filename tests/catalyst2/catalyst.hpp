// Conduit's nodes as C++ programs use them: the part that the test's simulation needs.
#pragma once

#include <cstring>
#include <map>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

#include "catalyst.h"

struct conduit_datatype_impl {
  conduit_index_t id = CONDUIT_EMPTY_ID;
  conduit_index_t count = 0;
  conduit_index_t stride = 0;
};

struct conduit_node_impl {
  conduit_datatype_impl type;
  std::string name;
  std::vector<std::unique_ptr<conduit_node_impl>> children;
  std::vector<char> own;  // the values, unless they are external
  void* values = nullptr;

  conduit_node_impl* find(const std::string& path) const {
    const std::size_t slash = path.find('/');
    for (const auto& child : children) {
      if (child->name != path.substr(0, slash)) continue;
      return slash == std::string::npos ? child.get() : child->find(path.substr(slash + 1));
    }
    return nullptr;
  }
  conduit_node_impl& add(const std::string& given, conduit_index_t kind) {
    if (type.id != kind) children.clear();
    type.id = kind;
    children.push_back(std::make_unique<conduit_node_impl>());
    children.back()->name = given;
    return *children.back();
  }
  conduit_node_impl& fetch(const std::string& path) {
    const std::size_t slash = path.find('/');
    const std::string first = path.substr(0, slash);
    conduit_node_impl* child = find(first);
    if (child == nullptr) child = &add(first, CONDUIT_OBJECT_ID);
    return slash == std::string::npos ? *child : child->fetch(path.substr(slash + 1));
  }
  void refer(conduit_index_t id, void* to, conduit_index_t count, conduit_index_t stride) {
    children.clear();
    type = {id, count, stride};
    values = to;
  }
  void copy(conduit_index_t id, const void* from, conduit_index_t count, std::size_t bytes) {
    const auto* const begin = static_cast<const char*>(from);
    own.assign(begin, begin + static_cast<std::size_t>(count) * bytes);
    refer(id, own.data(), count, static_cast<conduit_index_t>(bytes));
  }
};

namespace conduit_cpp {

/// The number of Conduit's type for a type of C++.
template <typename Number>
constexpr conduit_index_t idOf() {
  constexpr int log = sizeof(Number) == 1 ? 0 : sizeof(Number) == 2 ? 1 : sizeof(Number) == 4 ? 2 : 3;
  if (std::is_floating_point_v<Number>) return CONDUIT_FLOAT32_ID + log - 2;
  return (std::is_signed_v<Number> ? CONDUIT_INT8_ID : CONDUIT_UINT8_ID) + log;
}

class Node {
 public:
  Node() : root_(std::make_shared<conduit_node_impl>()), node_(root_.get()) {}

  Node operator[](const std::string& path) const { return Node(root_, &node_->fetch(path)); }
  Node append() const { return Node(root_, &node_->add("", CONDUIT_LIST_ID)); }

  void set(const std::string& text) const {
    node_->copy(CONDUIT_CHAR8_STR_ID, text.c_str(), static_cast<conduit_index_t>(text.size() + 1), 1);
  }
  template <typename Number>
  requires std::is_arithmetic_v<Number>
  void set(Number value) const { node_->copy(idOf<Number>(), &value, 1, sizeof value); }
  template <typename Number>
  void set(const std::vector<Number>& values) const {
    node_->copy(idOf<Number>(), values.data(), static_cast<conduit_index_t>(values.size()), sizeof(Number));
  }
  template <typename Number>
  void set_external(Number* values, conduit_index_t count, conduit_index_t offset = 0,
                    conduit_index_t stride = sizeof(Number)) const {
    node_->refer(idOf<Number>(), reinterpret_cast<char*>(values) + offset, count, stride);
  }
  conduit_int64 as_int64() const { return as<conduit_int64>(); }
  conduit_float64 as_float64() const { return as<conduit_float64>(); }
  std::string as_string() const { return static_cast<const char*>(node_->values); }

 private:
  friend conduit_node* c_node(Node* node);
  friend const conduit_node* c_node(const Node* node);

  Node(std::shared_ptr<conduit_node_impl> root, conduit_node_impl* node)
      : root_(std::move(root)), node_(node) {}
  template <typename Number>
  Number as() const {
    Number value{};
    if (node_->type.id == idOf<Number>()) std::memcpy(&value, node_->values, sizeof value);
    return value;
  }

  std::shared_ptr<conduit_node_impl> root_;
  conduit_node_impl* node_;
};

inline conduit_node* c_node(Node* node) {
  return node->node_;
}
inline const conduit_node* c_node(const Node* node) {
  return node->node_;
}

}  // namespace conduit_cpp
