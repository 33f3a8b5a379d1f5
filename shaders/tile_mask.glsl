// Finds the parts of V_O's picture that a workgroup's rays must traverse.
//
// The program provides params.
#ifndef VDI_TILE_MASK_GLSL
#define VDI_TILE_MASK_GLSL
#include "line.glsl"
#include "packet.glsl"

// Bit t of an axis' tile mask: rays along that axis may meet material in columns of tile t.
const int invocations = int(gl_WorkGroupSize.x);
const int tileBitWords = renderMaxTiles / 32;
shared uint tileBits[2 * tileBitWords];
shared int packetFirst[2];  // first column of all rays along that axis
shared int packetLast[2];

void findTilesAlong(RayPacket packet, int axis) {
  bool byColumns = axis == 0;
  int first = packetFirst[axis];
  int last = packetLast[axis];
  int lastTile = last >> renderTileShift;  // none: -1 stays -1
  for (int tile = (first >> renderTileShift) + int(gl_LocalInvocationIndex); tile <= lastTile;
       tile += invocations) {
    if (packetMask(packet, byColumns, tile, first, last) == 0ul) continue;
    atomicOr(tileBits[axis * tileBitWords + (tile >> 5)], 1u << (tile & 31));
  }
}

// All invocations of a workgroup must call this, including those whose ray does not traverse.
void findTiles(RayPacket packet, PictureLine line, bool traverses) {
  int own = int(gl_LocalInvocationIndex);
  for (int i = own; i < 2 * tileBitWords; i += invocations) tileBits[i] = 0u;
  if (own < 2) {
    packetFirst[own] = 0x7fffffff;
    packetLast[own] = -1;
  }
  barrier();
  if (traverses) {
    int axis = line.byColumns ? 0 : 1;
    atomicMin(packetFirst[axis], min(line.first, line.last));
    atomicMax(packetLast[axis], max(line.first, line.last));
  }
  barrier();
  findTilesAlong(packet, 0);
  findTilesAlong(packet, 1);
  barrier();
}

// The first tile to traverse from `tile` to `last`, in the line's direction; -1 if there is none.
int nextTile(PictureLine line, int tile, int last) {
  int base = line.byColumns ? 0 : tileBitWords;
  bool up = line.direction > 0.0;
  int word = tile >> 5;
  int lastWord = last >> 5;
  uint ahead = up ? ~0u << (tile & 31) : ~0u >> (31 - (tile & 31));
  uint bits = tileBits[base + word] & ahead;
  while (bits == 0u && word != lastWord) {
    word += up ? 1 : -1;
    bits = tileBits[base + word];
  }
  if (bits == 0u) return -1;
  int found = word * 32 + (up ? findLSB(bits) : findMSB(bits));
  return (up ? found > last : found < last) ? -1 : found;
}

#endif
