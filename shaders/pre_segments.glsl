// Pre-segments: neighbouring intervals that deviate little from the first of them. Twin of
// preSegmentsOf in vdi/reference/SegmentByMerging.cpp. Steps 1 and 3 of docs/architecture.md use them;
// reduce.comp merges pre-segments into supersegments (step 4).
//
// A program begins a ListState, adds the list's intervals to it, front to back, and ends it: with
// beginCounting and endCounting, or with beginWriting and endWriting.
//
// The program provides what count_pre_segments.glsl and write_pre_segments.glsl require; bool
// fillsHistogram, constant; where SEVERAL_RANKS is defined, bool countsLevels, too.
#ifndef VDI_PRE_SEGMENTS_GLSL
#define VDI_PRE_SEGMENTS_GLSL
#include "count_pre_segments.glsl"
#include "interval.glsl"
#include "write_pre_segments.glsl"

struct ListState {
  ListProgress progress;
  PreSegmentCounter counter;
  PreSegmentWriter writer;
};

void deviate(inout ListState list, vec4 x, float weightedLength) {
  if (writesPreSegments) deviate(list.writer.last, x, weightedLength);
  if (countedLevels > 0) deviate(list.counter, x, weightedLength);
}

// Adds the list's next interval.
void addInterval(inout ListState list, Interval interval) {
  float reach = list.progress.reach;
  bool gap = interval.front > reach;
  list.progress.reach = interval.back;
  if (gap) list.progress.inRun = false;
  if (gap && cutAtGaps) {
    if (writesPreSegments) close(list.writer);
    list.counter.open = 0u;
    list.writer.cut = true;
  }
  bool visible = interval.opticalDepth > 0.0;
  bool writing = list.writer.last.open;
  uint counting = list.counter.open;
  if (!visible && !writing && counting == 0u) return;
  float weight = weightBehind(list.progress.before) * list.progress.stepsPerDepth;
  if (gap && !cutAtGaps) deviate(list, vec4(0.0), weight * (interval.front - reach));
  deviate(list, interval.appearance, weight * (interval.back - interval.front));
  bool deviates = list.writer.last.deviation > list.writer.tolerance;
  if (!visible) {
    if (writesPreSegments && deviates) close(list.writer);
    return;
  }
  countVisible(list.progress);
  if (writesPreSegments) addVisible(list.writer, interval, deviates, list.progress.before);
  if (countedLevels > 0) addVisible(list.counter, interval.appearance);
  list.progress.before *= 1.0 - interval.opacity;
}

ListState beginCounting(uint samplesAtOnce) {
  return ListState(progressAtFront(samplesAtOnce), beginCounter(), idleWriter());
}

// Stores the counts in the program's form. If it fills the histogram, all invocations of a
// workgroup must call this, including those without a list, and clearGroupHistogram before.
void endCounting(ListState list, uint index, bool hasList) {
  if (fillsHistogram) {
    addToHistogram(list.progress, list.counter, hasList);
    return;
  }
#ifdef SEVERAL_RANKS
  if (countsLevels) {
    storeLevels(list.progress, index);
    return;
  }
#endif
  storeTolerance(list.progress, list.counter, index);
}

ListState beginWriting(uint index) {
  ListState list = ListState(progressAtFront(1u), beginCounter(), beginWriter(index));
  if (byNeed)
    list.counter.atLevels =
        vec2(toleranceOfLevel(levelBelow()), toleranceOfLevel(levelBelow() + 1u));
  return list;
}

void endWriting(inout ListState list, uint index) {
  uint written = endWriter(list.writer, list.progress, index);
  uint supersegments = max(list.writer.supersegments, cutAtGaps ? list.progress.runs : 1u);
  if (byNeed) {
    uint below = min(counted.preSegments[0], params.maxPerList);
    uint above = min(counted.preSegments[1], params.maxPerList);
    supersegments = interpolatedCount(below, above, roundingOf(index));
  }
  storeCounts(written, supersegments, index);
}

#endif
