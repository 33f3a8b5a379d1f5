// Which parts of V_O's picture the rays of a workgroup have to walk.
//
// Needs: beam.glsl, line.glsl; params.

// Bit t of an axis' marks: rays that go along that axis may meet material in columns of tile t.
const int invocations = int(gl_WorkGroupSize.x);
const int markWords = renderMostMarks / 32;
shared uint marks[2 * markWords];
shared int beamFirst[2];  // column, of all rays along that axis
shared int beamLast[2];

void markAlong(Beam beam, int axis) {
  bool byColumns = axis == 0;
  int first = beamFirst[axis];
  int last = beamLast[axis];
  int lastTile = last >> renderTileShift;  // none: -1 stays -1
  for (int tile = (first >> renderTileShift) + int(gl_LocalInvocationIndex); tile <= lastTile;
       tile += invocations) {
    if (beamMask(beam, byColumns, tile, first, last) == 0ul) continue;
    atomicOr(marks[axis * markWords + (tile >> 5)], 1u << (tile & 31));
  }
}

// For all invocations of a workgroup, those whose ray doesn't walk included.
void markBeam(Beam beam, PictureLine line, bool walks) {
  int own = int(gl_LocalInvocationIndex);
  for (int i = own; i < 2 * markWords; i += invocations) marks[i] = 0u;
  if (own < 2) {
    beamFirst[own] = 0x7fffffff;
    beamLast[own] = -1;
  }
  barrier();
  if (walks) {
    int axis = line.byColumns ? 0 : 1;
    atomicMin(beamFirst[axis], min(line.first, line.last));
    atomicMax(beamLast[axis], max(line.first, line.last));
  }
  barrier();
  markAlong(beam, 0);
  markAlong(beam, 1);
  barrier();
}

// The first tile to walk from `tile` to `last`, in the line's direction; -1 if there's none.
int nextTile(PictureLine line, int tile, int last) {
  int base = line.byColumns ? 0 : markWords;
  bool up = line.direction > 0.0;
  int word = tile >> 5;
  int lastWord = last >> 5;
  uint ahead = up ? ~0u << (tile & 31) : ~0u >> (31 - (tile & 31));
  uint bits = marks[base + word] & ahead;
  while (bits == 0u && word != lastWord) {
    word += up ? 1 : -1;
    bits = marks[base + word];
  }
  if (bits == 0u) return -1;
  int found = word * 32 + (up ? findLSB(bits) : findMSB(bits));
  return (up ? found > last : found < last) ? -1 : found;
}
