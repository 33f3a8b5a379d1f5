// Writes a list's pre-segments at its tolerance into its room. ListTolerance in
// vdi/reference/Segmenter.h explains tolerance and room.
//
// The program provides params with thresholds, capacities, offsets, preSegments, written, left,
// status, budget; where SEVERAL_RANKS is defined, quotas, too; bool cutAtGaps, constant.
#ifndef VDI_WRITE_PRE_SEGMENTS_GLSL
#define VDI_WRITE_PRE_SEGMENTS_GLSL
#include "interval.glsl"
#include "stored_pre_segment.glsl"

// The pre-segment that is being written.
struct OpenPreSegment {
  bool open;            // otherwise the next visible interval begins another one, if there is room
  bool startsRun;
  vec4 first;           // appearance of its first interval
  float deviation;      // sum over its intervals
  vec2 span;            // front, back
  float before;         // transmittance in front of it
  float transmittance;  // transmittance of its material
  vec4 light;           // premultiplied colour, optical depth
};

struct PreSegmentWriter {
  PreSegmentArray preSegments;  // pre-segments of the list
  uint slots;                   // room for all pre-segments
  uint room;                    // room for those that begin no run, if there are several ranks
  uint supersegments;           // most that merging may leave, unless the list has more runs
  float initialTolerance;
  float tolerance;
  uint begun;
  uint runs;  // number of those that begin a run; counted if there are several ranks
  bool cut;   // whether the next one begins a run
  OpenPreSegment last;
};

// A writer that has not begun a list.
PreSegmentWriter idleWriter() {
  PreSegmentWriter writer;
  writer.begun = 0u;
  writer.runs = 0u;
  writer.cut = true;
  writer.last.open = false;
  writer.last.first = vec4(0.0);
  writer.last.deviation = 0.0;
  return writer;
}

PreSegmentWriter beginWriter(uint list) {
  PreSegmentWriter writer = idleWriter();
  writer.preSegments = preSegmentsFrom(params.preSegments, params.offsets.at[list]);
  writer.slots = params.capacities.at[list];
  writer.room = writer.slots;
  writer.supersegments = params.budget;
#ifdef SEVERAL_RANKS
  if (cutAtGaps) {
    uint quota = params.quotas.at[list];
    writer.room -= quota >> 16;
    writer.supersegments = quota & 0xffffu;
  }
#endif
  writer.initialTolerance = params.thresholds.at[list];
  writer.tolerance = writer.initialTolerance;
  return writer;
}

void close(inout PreSegmentWriter writer) {
  uint slot = writer.begun - 1u;
  bool open = writer.last.open;
  uint slots = writer.slots;
  if (open && slot < slots) {
    writer.preSegments.at[slot] = storedPreSegment(writer.last.span, writer.last.before,
                                                   writer.last.light, writer.last.startsRun);
  }
  writer.last.open = false;
}

// Raises the tolerance while the last of the room is being used.
void adaptTolerance(inout PreSegmentWriter writer) {
  uint left = writer.room - min(writer.room, writer.begun - writer.runs);
  if (left >= sparePreSegments) return;
  float base =
      writer.initialTolerance < 0.0 ? finestTolerance / toleranceRatio : writer.initialTolerance;
  writer.tolerance =
      left == 0u ? unlimited : base * pow(toleranceRatio, float(sparePreSegments - left));
}

// Once the room is used up, only the start of a run may open a pre-segment.
bool hasRoom(PreSegmentWriter writer) {
  bool cut = writer.cut;
  uint used = writer.begun - writer.runs;
  uint room = writer.room;
  return (cutAtGaps && cut) || used < room;
}

void begin(inout PreSegmentWriter writer, float front, float before, vec4 x) {
  close(writer);
  ++writer.begun;
  writer.last.first = x;
  writer.last.deviation = 0.0;
  bool cut = writer.cut;
  writer.last.startsRun = cutAtGaps && cut;
  if (writer.last.startsRun) ++writer.runs;
  writer.last.span.x = front;
  writer.last.before = before;
  writer.last.light = vec4(0.0);
  writer.last.transmittance = 1.0;
  writer.cut = false;
  adaptTolerance(writer);
}

void absorb(inout OpenPreSegment last, Interval interval) {
  last.light = vec4(last.light.rgb + last.transmittance * interval.color,
                    min(last.light.a + interval.opticalDepth, maxOpticalDepth));
  last.span.y = interval.back;
  last.transmittance *= 1.0 - interval.opacity;
  last.open = true;
}

void deviate(inout OpenPreSegment last, vec4 x, float weightedLength) {
  last.deviation += weightedLength * differenceOf(x, last.first);
}

// Adds a visible interval behind material of transmittance `before`. It continues the last
// pre-segment unless that is closed or the interval `deviates`.
void addVisible(inout PreSegmentWriter writer, Interval interval, bool deviates, float before) {
  bool open = writer.last.open;
  if ((!open || deviates) && hasRoom(writer))
    begin(writer, interval.front, before, interval.appearance);
  absorb(writer.last, interval);
}

// Requests that the list be written again with room for its runs, of which it has more than the
// counted lists around it.
void askForRoom(PreSegmentWriter writer, ListProgress progress, uint list) {
  atomicAdd(params.status.at[statusWrongLists], 1u);
#ifdef SEVERAL_RANKS
  atomicMax(params.status.at[statusMostRuns], progress.runs);
  params.capacities.at[list] = writer.room + progress.runs;
  params.quotas.at[list] = (params.quotas.at[list] & 0xffffu) | progress.runs << 16;
#endif
}

// Stores how many pre-segments a list has, and how many of them merging has to leave.
void storeCounts(uint written, uint supersegments, uint list) {
  params.written.at[list] = written;
  params.left.at[list] = min(written, supersegments);
}

// Closes the last pre-segment. Returns the number written.
uint endWriter(inout PreSegmentWriter writer, ListProgress progress, uint list) {
  close(writer);
  uint written = min(writer.begun, writer.slots);
  if (written != writer.begun) askForRoom(writer, progress, list);
  return written;
}

#endif
