// The sensitivity search of vdi/reference/Segmenter.h, and writing with its result. One function does both,
// so that the very same instructions count and write.
//
// The program provides void feedIntervals(), which feeds every interval of the list to searchAdd, front to
// back.
#ifndef VDI_SEARCH_GLSL
#define VDI_SEARCH_GLSL
#include "segmenter.glsl"

struct SearchState {
  bool writing;
  uint emitted;
  uint visible;  // visible intervals
  uint runs;
  float runReach;
  bool runVisible;
};

SearchState search;

void feedIntervals();

void searchAdd(float front, float back, vec3 color, float opticalDepth) {
  if (front > search.runReach) search.runVisible = false;
  if (opticalDepth > 0.0) {
    ++search.visible;
    if (!search.runVisible) ++search.runs;
    search.runVisible = true;
  }
  search.runReach = back;
  segmenterAdd(front, back, color, opticalDepth);
}

// Feeds the list once. Returns the number of supersegments.
uint searchTry(float sensitivity) {
  search.emitted = 0u;
  search.visible = 0u;
  search.runs = 0u;
  search.runReach = -1.0;
  search.runVisible = false;
  segmenterBegin(sensitivity);
  feedIntervals();
  segmenterEnd();
  return search.emitted;
}

struct SearchResult {
  float sensitivity;
  uint count;
};

// If `write` is set, feeds the list once with the sensitivity `known`, and emitSegment writes.
// Otherwise searches for a sensitivity.
SearchResult searchList(bool write, float known, uint budget) {
  search.writing = write;
  float tooFine = smallestSensitivity;
  float fits = largestSensitivity;
  uint maxCount = budget;
  SearchResult best = SearchResult(largestSensitivity, 0u);
  float sensitivity = write ? known : smallestSensitivity;
  // Try 0 is the first one, try 1 the one that always fits, and the others bisect. A single loop has only one
  // copy of feedIntervals. The loop ends by its condition alone: if code jumps out of it, some programs never
  // end on lavapipe of Mesa 26.1.
  int tries = write ? 1 : maxTries + 2;
  bool done = false;
  for (int i = 0; i < tries && !done; ++i) {
    uint count = searchTry(sensitivity);
    SearchResult now = SearchResult(sensitivity, count);
    if (write) {
      best = now;
    } else if (i == 0) {
      maxCount = cutAtGaps ? max(budget, search.runs) : budget;
      bool allFit = search.visible <= maxCount;
      if (allFit) best = SearchResult(-1.0, search.visible);
      if (!allFit && count <= maxCount) best = now;
      done = allFit || count <= maxCount;
      sensitivity = largestSensitivity;
    } else {
      bool isEnough = count <= maxCount;
      if (isEnough) best = now;
      fits = isEnough ? sensitivity : fits;
      tooFine = isEnough ? tooFine : sensitivity;
      bool isGood = isEnough && i > 1 && float(count) >= goodFill * float(maxCount);
      done = isGood || !(fits > closeBounds * tooFine);
      sensitivity = sqrt(tooFine * fits);
    }
  }
  return best;
}

#endif
