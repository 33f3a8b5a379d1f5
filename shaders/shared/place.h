// Parameters of place.comp: values as they lie in memory become texels of pages.
#ifndef VDI_SHARED_PLACE_H
#define VDI_SHARED_PLACE_H
#include "interop.h"

VDI_SHARED_BEGIN

VDI_CONST uint placeGroup = 256;
VDI_CONST uint placeEach = 4;  // values of an invocation

// Types of values. Signed integers of 8 and 16 bits are shifted up to unsigned texels. A float of 32 bits
// is its own texel. All others are relative to the job's scale and offset.
VDI_CONST uint placeU8 = 0;
VDI_CONST uint placeI8 = 1;
VDI_CONST uint placeU16 = 2;
VDI_CONST uint placeI16 = 3;
VDI_CONST uint placeU32 = 4;
VDI_CONST uint placeI32 = 5;
VDI_CONST uint placeF32 = 6;
VDI_CONST uint placeTexel = 7;  // texels of another box, with the same scale and offset, instead of values

VDI_SHARED_END

#ifndef __cplusplus
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer PlaceWords {
  uint at[];
};
#endif

VDI_SHARED_BEGIN

// A box of values, [size.z][size.y][size.x], for a box of a page. They begin at a multiple of 8 bytes.
struct PlaceJob {
  VDI_ADDRESS(PlaceWords) values;
  double scale;  // value = texel * scale + offset
  double offset;
  uvec3 size;
  uint type;
  uvec3 place;  // in the page, texels
  uint page;
  uvec3 from;  // of the other box, if the type is placeTexel
  uint fromPage;
  uint firstGroup;  // the first of the job's workgroups
  uint pad;
};

VDI_SHARED_END

#ifndef __cplusplus
layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer PlaceJobArray {
  PlaceJob at[];
};
#endif

VDI_SHARED_BEGIN

struct PlaceConstants {
  VDI_ADDRESS(PlaceJobArray) jobs;  // by firstGroup
  uint jobCount;
  uint groupCount;
};

VDI_SHARED_END

#endif
