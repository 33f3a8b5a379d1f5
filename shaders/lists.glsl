// Turns a list's intervals into stored supersegments: searches in one dispatch, and writes in a later one.
//
// The program provides params with thresholds, capacities, offsets, segments, form, status; void
// feedIntervals().
#ifndef VDI_LISTS_GLSL
#define VDI_LISTS_GLSL
#include "search.glsl"
#include "store.glsl"

uint listIndex;

void emitSegment(OpticalSegment segment) {
  if (search.writing && search.emitted < params.capacities.at[listIndex]) {
    uint slot = params.offsets.at[listIndex] + search.emitted;
    SegmentArray segments = params.segments;
    StoredForm form = params.form;
    storeSegment(segments, slot, segment, form);
  }
  ++search.emitted;
}

void searchOrWriteList(bool write) {
  segmenterStep = params.step;
  if (write && params.capacities.at[listIndex] == 0u) return;
  beginStoring();
  float known = write ? params.thresholds.at[listIndex] : 0.0;
  SearchResult result = searchList(write, known, params.budget);
  if (write) {
    if (result.count != params.capacities.at[listIndex]) atomicAdd(params.status.at[statusWrongLists], 1u);
  } else {
    params.thresholds.at[listIndex] = result.sensitivity;
    params.capacities.at[listIndex] = result.count;
  }
}

#endif
