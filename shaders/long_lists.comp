// Finds the lists whose pre-segments reduce_subgroup.comp must merge. Most lists are empty or fit, and do not
// justify a workgroup each.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/reduce.h"

layout(local_size_x = longListsGroup) in;
layout(push_constant, scalar) uniform Push { ReduceConstants push; };

shared uint found;
shared uint firstPlace;

void main() {
  if (push.guard.at[0] == 0u) return;
  uint list = gl_GlobalInvocationID.x;
  if (gl_LocalInvocationIndex == 0u) found = 0u;
  barrier();
  uint count = list < push.listCount ? push.written.at[list] : 0u;
  bool waits = count > 0u && count <= push.subgroupCapacity && count > push.left.at[list];
  uint place = waits ? atomicAdd(found, 1u) : 0u;
  barrier();
  if (gl_LocalInvocationIndex == 0u)
    firstPlace = found > 0u ? atomicAdd(push.longListCount.at[0], found) : 0u;
  barrier();
  if (waits) push.longLists.at[firstPlace + place] = list;
}
