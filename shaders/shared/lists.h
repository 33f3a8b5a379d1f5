// Supersegments and the constants of the sensitivity search.
#ifndef VDI_SHARED_LISTS_H
#define VDI_SHARED_LISTS_H
#include "interop.h"

VDI_SHARED_BEGIN

// Supersegment of core/Vdi.h.
struct Segment {
  float front;
  float back;
  float red;
  float green;
  float blue;
  float opacity;
};

VDI_SHARED_END

#ifndef __cplusplus
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer SegmentArray { Segment at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer UintArray { uint at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer FloatArray { float at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 16) buffer Vec4Array { vec4 at[]; };
#endif

#endif
