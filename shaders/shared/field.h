// Parameters of field.comp.
#ifndef VDI_SHARED_FIELD_H
#define VDI_SHARED_FIELD_H
#include "lists.h"

VDI_SHARED_BEGIN

VDI_CONST uint fieldGroup = 64;

struct FieldConstants {
  VDI_ADDRESS(FloatArray) values;  // [size.z][size.y][size.x], in [0, 1]
  uvec3 size;
  uint field;  // index in fields() of vdi/synthetic/Fields.h
  vec3 first;  // lattice index of the first value; half an index more for cells
  float spacing;
  uint seed;
  uint pad;
};

VDI_SHARED_END

#endif
