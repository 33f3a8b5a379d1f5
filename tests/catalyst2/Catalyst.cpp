// Stands in for libcatalyst.so: Conduit's C functions on the nodes of catalyst.hpp, and calls of the
// implementation.
#include <dlfcn.h>

#include <cstdio>
#include <cstdlib>
#include <sstream>

#include "catalyst.hpp"

int conduit_node_has_path(const conduit_node* node, const char* path) {
  return node->find(path) != nullptr ? 1 : 0;
}
conduit_node* conduit_node_fetch_existing(conduit_node* node, const char* path) {
  return node->find(path);
}
conduit_index_t conduit_node_number_of_children(conduit_node* node) {
  return static_cast<conduit_index_t>(node->children.size());
}
conduit_node* conduit_node_child(conduit_node* node, conduit_index_t index) {
  return node->children[static_cast<std::size_t>(index)].get();
}
char* conduit_node_name(const conduit_node* node) {
  return strdup(node->name.c_str());
}
const conduit_datatype* conduit_node_dtype(const conduit_node* node) {
  return &node->type;
}
char* conduit_node_as_char8_str(conduit_node* node) {
  return static_cast<char*>(node->values);
}
void* conduit_node_element_ptr(conduit_node* node, conduit_index_t index) {
  return static_cast<char*>(node->values) + index * node->type.stride;
}
void conduit_node_set_path_int32(conduit_node* node, const char* path, conduit_int32 value) {
  node->fetch(path).copy(CONDUIT_INT32_ID, &value, 1, sizeof value);
}
void conduit_node_set_path_int64(conduit_node* node, const char* path, conduit_int64 value) {
  node->fetch(path).copy(CONDUIT_INT64_ID, &value, 1, sizeof value);
}
void conduit_node_set_path_float64(conduit_node* node, const char* path, conduit_float64 value) {
  node->fetch(path).copy(CONDUIT_FLOAT64_ID, &value, 1, sizeof value);
}
void conduit_node_set_path_char8_str(conduit_node* node, const char* path, const char* value) {
  node->fetch(path).copy(CONDUIT_CHAR8_STR_ID, value, static_cast<conduit_index_t>(std::strlen(value) + 1),
                         1);
}
conduit_index_t conduit_datatype_id(const conduit_datatype* type) {
  return type->id;
}
int conduit_datatype_is_object(const conduit_datatype* type) {
  return type->id == CONDUIT_OBJECT_ID ? 1 : 0;
}
int conduit_datatype_is_list(const conduit_datatype* type) {
  return type->id == CONDUIT_LIST_ID ? 1 : 0;
}
int conduit_datatype_is_string(const conduit_datatype* type) {
  return type->id == CONDUIT_CHAR8_STR_ID ? 1 : 0;
}
int conduit_datatype_is_integer(const conduit_datatype* type) {
  return type->id >= CONDUIT_INT8_ID && type->id <= CONDUIT_UINT64_ID ? 1 : 0;
}
int conduit_datatype_is_number(const conduit_datatype* type) {
  return type->id >= CONDUIT_INT8_ID && type->id <= CONDUIT_FLOAT64_ID ? 1 : 0;
}
int conduit_datatype_endianness_matches_machine(const conduit_datatype*) {
  return 1;
}
conduit_index_t conduit_datatype_number_of_elements(const conduit_datatype* type) {
  return type->count;
}
conduit_index_t conduit_datatype_stride(const conduit_datatype* type) {
  return type->stride;
}

namespace {

/// A function of the implementation, which is loaded when it is first needed.
void* functionOf(const char* call) {
  static void* const library = [] {
    const char* const name = std::getenv("CATALYST_IMPLEMENTATION_NAME");
    const char* const paths = std::getenv("CATALYST_IMPLEMENTATION_PATHS");
    std::stringstream folders(paths != nullptr ? paths : "");
    void* found = nullptr;
    for (std::string folder; found == nullptr && name != nullptr && std::getline(folders, folder, ':');)
      found = dlopen((folder + "/libcatalyst-" + name + ".so").c_str(), RTLD_NOW | RTLD_LOCAL);
    if (found == nullptr) std::fprintf(stderr, "no implementation of Catalyst: %s\n", dlerror());
    return found;
  }();
  const char* const name = std::getenv("CATALYST_IMPLEMENTATION_NAME");
  return library != nullptr ? dlsym(library, (std::string("catalyst_") + call + "_" + name).c_str())
                            : nullptr;
}

template <typename Params>
catalyst_status callOf(const char* call, Params* params) {
  auto* const function = reinterpret_cast<catalyst_status (*)(Params*)>(functionOf(call));
  return function != nullptr ? function(params) : catalyst_status_error_no_implementation;
}

}  // namespace

catalyst_status catalyst_initialize(const conduit_node* params) {
  return callOf("initialize", params);
}
catalyst_status catalyst_execute(const conduit_node* params) {
  return callOf("execute", params);
}
catalyst_status catalyst_finalize(const conduit_node* params) {
  return callOf("finalize", params);
}
catalyst_status catalyst_about(conduit_node* params) {
  return callOf("about", params);
}
catalyst_status catalyst_results(conduit_node* params) {
  return callOf("results", params);
}
