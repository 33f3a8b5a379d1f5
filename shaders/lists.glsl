// One list from intervals to stored supersegments: search in one dispatch, write in a later one.
//
// Needs: push.params.value with sensitivities, counts, offsets, segments, form, status; void walk().

uint listIndex;

#include "optical.glsl"
#include "appearance.glsl"
#include "store.glsl"
void emitSegment(Material m);
#include "segmenter.glsl"
#include "search.glsl"

void emitSegment(Material m) {
  if (search.writing && search.emitted < push.params.value.counts.at[listIndex]) {
    uint slot = push.params.value.offsets.at[listIndex] + search.emitted;
    SegmentArray segments = push.params.value.segments;
    StoredForm form = push.params.value.form;
    storeSegment(segments, slot, m, form);
  }
  ++search.emitted;
}

void searchOrWriteList(bool write) {
  segmenterStep = push.params.value.step;
  segmenterCutAtGaps = push.params.value.cutAtGaps != 0u;
  if (write && push.params.value.counts.at[listIndex] == 0u) return;
  beginStoring();
  float known = write ? push.params.value.sensitivities.at[listIndex] : 0.0;
  SearchResult result = searchList(write, known, push.params.value.budget, push.params.value.runsOnly != 0u);
  if (write) {
    if (result.count != push.params.value.counts.at[listIndex]) atomicAdd(push.params.value.status.at[0], 1u);
  } else {
    push.params.value.sensitivities.at[listIndex] = result.sensitivity;
    push.params.value.counts.at[listIndex] = result.count;
  }
}
