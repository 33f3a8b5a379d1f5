// One list from intervals to stored supersegments: search in one dispatch, write in a later one.
//
// Needs: params with sensitivities, counts, offsets, segments, form, status; void walk().

uint listIndex;

#include "optical.glsl"
#include "appearance.glsl"
#include "exact.glsl"
#include "store.glsl"
void emitSegment(Material m);
#include "segmenter.glsl"
#include "search.glsl"

void emitSegment(Material m) {
  if (search.writing && search.emitted < params.counts.at[listIndex]) {
    uint slot = params.offsets.at[listIndex] + search.emitted;
    SegmentArray segments = params.segments;
    StoredForm form = params.form;
    storeSegment(segments, slot, m, form);
  }
  ++search.emitted;
}

void searchOrWriteList(bool write) {
  segmenterStep = params.step;
  if (write && params.counts.at[listIndex] == 0u) return;
  beginStoring();
  float known = write ? params.sensitivities.at[listIndex] : 0.0;
  SearchResult result = searchList(write, known, params.budget);
  if (write) {
    if (result.count != params.counts.at[listIndex]) atomicAdd(params.status.at[0], 1u);
  } else {
    params.sensitivities.at[listIndex] = result.sensitivity;
    params.counts.at[listIndex] = result.count;
  }
}
