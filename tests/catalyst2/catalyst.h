/* The part of Catalyst 2's C API, and of Conduit's in it, that catalyst_adaptor/catalyst2 calls. It stands in
 * for the real headers where these aren't installed. Names, types and numbers are those of the real API. */
#ifndef VDI_TESTS_CATALYST2_CATALYST_H
#define VDI_TESTS_CATALYST2_CATALYST_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define CATALYST_API __attribute__((visibility("default")))

typedef int64_t conduit_index_t;
typedef int8_t conduit_int8;
typedef int16_t conduit_int16;
typedef int32_t conduit_int32;
typedef int64_t conduit_int64;
typedef uint8_t conduit_uint8;
typedef uint16_t conduit_uint16;
typedef uint32_t conduit_uint32;
typedef uint64_t conduit_uint64;
typedef float conduit_float32;
typedef double conduit_float64;
typedef struct conduit_node_impl conduit_node;
typedef struct conduit_datatype_impl conduit_datatype;

enum {
  CONDUIT_EMPTY_ID = 0,
  CONDUIT_OBJECT_ID,
  CONDUIT_LIST_ID,
  CONDUIT_INT8_ID,
  CONDUIT_INT16_ID,
  CONDUIT_INT32_ID,
  CONDUIT_INT64_ID,
  CONDUIT_UINT8_ID,
  CONDUIT_UINT16_ID,
  CONDUIT_UINT32_ID,
  CONDUIT_UINT64_ID,
  CONDUIT_FLOAT32_ID,
  CONDUIT_FLOAT64_ID,
  CONDUIT_CHAR8_STR_ID
};

CATALYST_API int conduit_node_has_path(const conduit_node* node, const char* path);
CATALYST_API conduit_node* conduit_node_fetch_existing(conduit_node* node, const char* path);
CATALYST_API conduit_index_t conduit_node_number_of_children(conduit_node* node);
CATALYST_API conduit_node* conduit_node_child(conduit_node* node, conduit_index_t index);
CATALYST_API char* conduit_node_name(const conduit_node* node); /* the caller frees it */
CATALYST_API const conduit_datatype* conduit_node_dtype(const conduit_node* node);
CATALYST_API char* conduit_node_as_char8_str(conduit_node* node);
CATALYST_API void* conduit_node_element_ptr(conduit_node* node, conduit_index_t index);
CATALYST_API void conduit_node_set_path_int32(conduit_node* node, const char* path, conduit_int32 value);
CATALYST_API void conduit_node_set_path_int64(conduit_node* node, const char* path, conduit_int64 value);
CATALYST_API void conduit_node_set_path_float64(conduit_node* node, const char* path, conduit_float64 value);
CATALYST_API void conduit_node_set_path_char8_str(conduit_node* node, const char* path, const char* value);
CATALYST_API conduit_index_t conduit_datatype_id(const conduit_datatype* type);
CATALYST_API int conduit_datatype_is_object(const conduit_datatype* type);
CATALYST_API int conduit_datatype_is_list(const conduit_datatype* type);
CATALYST_API int conduit_datatype_is_string(const conduit_datatype* type);
CATALYST_API int conduit_datatype_is_integer(const conduit_datatype* type);
CATALYST_API int conduit_datatype_is_number(const conduit_datatype* type);
CATALYST_API int conduit_datatype_endianness_matches_machine(const conduit_datatype* type);
CATALYST_API conduit_index_t conduit_datatype_number_of_elements(const conduit_datatype* type);
CATALYST_API conduit_index_t conduit_datatype_stride(const conduit_datatype* type);

/* Implementations add codes of their own, from 100 on. */
enum catalyst_status {
  catalyst_status_ok = 0,
  catalyst_status_error_no_implementation = 1,
  catalyst_status_last = 127
};

/* They call the library libcatalyst-NAME.so in the folders that CATALYST_IMPLEMENTATION_PATHS names;
 * CATALYST_IMPLEMENTATION_NAME is NAME. */
CATALYST_API enum catalyst_status catalyst_initialize(const conduit_node* params);
CATALYST_API enum catalyst_status catalyst_execute(const conduit_node* params);
CATALYST_API enum catalyst_status catalyst_finalize(const conduit_node* params);
CATALYST_API enum catalyst_status catalyst_about(conduit_node* params);
CATALYST_API enum catalyst_status catalyst_results(conduit_node* params);

#ifdef __cplusplus
}
#endif

#endif
