#include "catalyst_adaptor/catalyst2/Node.h"

#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <utility>

#include "catalyst_adaptor/vdi_catalyst.h"

namespace vdi::catalyst {

namespace {

template <typename Scalar>
Scalar valueAt(const std::byte* from) {
  Scalar value;
  std::memcpy(&value, from, sizeof value);
  return value;
}

template <typename Result>
Result readAt(int type, const std::byte* from) {
  switch (type) {
    case VDI_CATALYST_U8:
      return static_cast<Result>(valueAt<std::uint8_t>(from));
    case VDI_CATALYST_I8:
      return static_cast<Result>(valueAt<std::int8_t>(from));
    case VDI_CATALYST_U16:
      return static_cast<Result>(valueAt<std::uint16_t>(from));
    case VDI_CATALYST_I16:
      return static_cast<Result>(valueAt<std::int16_t>(from));
    case VDI_CATALYST_U32:
      return static_cast<Result>(valueAt<std::uint32_t>(from));
    case VDI_CATALYST_I32:
      return static_cast<Result>(valueAt<std::int32_t>(from));
    case VDI_CATALYST_U64:
      return static_cast<Result>(valueAt<std::uint64_t>(from));
    case VDI_CATALYST_I64:
      return static_cast<Result>(valueAt<std::int64_t>(from));
    case VDI_CATALYST_F32:
      return static_cast<Result>(valueAt<float>(from));
    default:
      return static_cast<Result>(valueAt<double>(from));
  }
}

struct Scalar {
  std::int32_t type;
  std::size_t bytes;
};

std::optional<Scalar> scalarOf(conduit_index_t id) {
  switch (id) {
    case CONDUIT_UINT8_ID:
      return Scalar{VDI_CATALYST_U8, 1};
    case CONDUIT_INT8_ID:
      return Scalar{VDI_CATALYST_I8, 1};
    case CONDUIT_UINT16_ID:
      return Scalar{VDI_CATALYST_U16, 2};
    case CONDUIT_INT16_ID:
      return Scalar{VDI_CATALYST_I16, 2};
    case CONDUIT_UINT32_ID:
      return Scalar{VDI_CATALYST_U32, 4};
    case CONDUIT_INT32_ID:
      return Scalar{VDI_CATALYST_I32, 4};
    case CONDUIT_UINT64_ID:
      return Scalar{VDI_CATALYST_U64, 8};
    case CONDUIT_INT64_ID:
      return Scalar{VDI_CATALYST_I64, 8};
    case CONDUIT_FLOAT32_ID:
      return Scalar{VDI_CATALYST_F32, 4};
    case CONDUIT_FLOAT64_ID:
      return Scalar{VDI_CATALYST_F64, 8};
    default:
      return std::nullopt;
  }
}

std::string joined(const std::string& path, const std::string& name) {
  return path.empty() ? name : path + "/" + name;
}

}  // namespace

double Leaf::at(std::int64_t index) const {
  return readAt<double>(type, first + index * stride);
}

std::int64_t Leaf::wholeAt(std::int64_t index) const {
  return readAt<std::int64_t>(type, first + index * stride);
}

// Conduit's functions take pointers to non-const nodes even if they only read.
Node::Node(const conduit_node* node, std::string path)
    : node_(const_cast<conduit_node*>(node)), path_(std::move(path)) {}

bool Node::has(const std::string& path) const {
  return conduit_node_has_path(node_, path.c_str()) != 0;
}

std::optional<Node> Node::find(const std::string& path) const {
  if (!has(path)) return std::nullopt;
  return Node(conduit_node_fetch_existing(node_, path.c_str()), joined(path_, path));
}

Node Node::at(const std::string& path) const {
  if (auto node = find(path)) return *std::move(node);
  throw std::invalid_argument("there is no " + joined(path_, path));
}

std::vector<Node> Node::children() const {
  std::vector<Node> all;
  const conduit_datatype* type = conduit_node_dtype(node_);
  if (conduit_datatype_is_object(type) == 0 && conduit_datatype_is_list(type) == 0) return all;
  const conduit_index_t count = conduit_node_number_of_children(node_);
  for (conduit_index_t i = 0; i < count; ++i) {
    Node child(conduit_node_child(node_, i), "");
    const std::string name = child.name();
    child.path_ = joined(path_, name.empty() ? std::to_string(i) : name);
    all.push_back(std::move(child));
  }
  return all;
}

std::string Node::name() const {
  char* text = conduit_node_name(node_);
  std::string name = text != nullptr ? text : "";
  std::free(text);
  return name;
}

bool Node::isText() const {
  return conduit_datatype_is_string(conduit_node_dtype(node_)) != 0;
}

bool Node::isWhole() const {
  return conduit_datatype_is_integer(conduit_node_dtype(node_)) != 0;
}

bool Node::isNumber() const {
  return conduit_datatype_is_number(conduit_node_dtype(node_)) != 0;
}

std::string Node::text() const {
  if (!isText()) refuse("isn't a string");
  const char* text = conduit_node_as_char8_str(node_);
  if (text == nullptr) return "";
  const auto size = conduit_datatype_number_of_elements(conduit_node_dtype(node_));
  return {text, ::strnlen(text, static_cast<std::size_t>(size))};
}

std::int64_t Node::whole() const {
  if (!isWhole()) refuse("isn't a whole number");
  const Leaf values = leaf();
  if (values.count < 1) refuse("has no value");
  return values.wholeAt(0);
}

double Node::number() const {
  if (!isNumber()) refuse("isn't a number");
  const Leaf values = leaf();
  if (values.count < 1) refuse("has no value");
  return values.at(0);
}

Leaf Node::leaf() const {
  const conduit_datatype* type = conduit_node_dtype(node_);
  const std::optional<Scalar> scalar = scalarOf(conduit_datatype_id(type));
  if (!scalar) refuse("isn't made of numbers");
  if (conduit_datatype_endianness_matches_machine(type) == 0) refuse("has another byte order");
  Leaf leaf;
  leaf.type = scalar->type;
  leaf.scalarBytes = scalar->bytes;
  leaf.count = conduit_datatype_number_of_elements(type);
  leaf.stride = conduit_datatype_stride(type);
  if (leaf.count > 0) leaf.first = static_cast<const std::byte*>(conduit_node_element_ptr(node_, 0));
  if (leaf.count > 0 && leaf.first == nullptr) refuse("has no memory");
  return leaf;
}

void Node::refuse(const std::string& why) const {
  throw std::invalid_argument(path_ + " " + why);
}

}  // namespace vdi::catalyst
