// Finds the slopes of supersegments' fronts and backs from list to list. Twin of
// vdi/reference/Slopes.cpp, which has the rules.

import {basisOf, pixelSizeOf, toView} from "./camera.js";
import {COUNT_BITS, leaningHeads, supersegmentsOf} from "./heads.js";
import {dot} from "./vector.js";

/** @typedef {import("./decoder.js").PreparedVdi} PreparedVdi */

/**
 * The data that sheared pictures need besides a decoded VDI.
 * @typedef {object} Leaning
 * @property {Uint32Array} slopes a word for each supersegment: slopes of front x, front y, back x and
 *   back y, a signed byte each, in units of slopeUnit
 * @property {number} slopeUnit depth per list at a slope of 1
 * @property {number[][]} faces of the VDI's box in V_O's view space: x, y, z and w of each
 * @property {Uint32Array} heads as in Heads, with the reach of leaning faces
 * @property {Uint32Array} tiles
 */

const MAX_SLOPE = 8;  // depth per list, in footprints
const SLOPES = 127;   // steps from 0 to MAX_SLOPE
const NO_SLOPE = -128;
export const ON_FACE = -128;  // in both slopes of an end that lies on a face of the box
const MOST_DEPTH = 6;
const TIE = 1 / 64;
const LEAST_OPACITY = 0.05;

/**
 * The six faces of the VDI's box, which is where dot(xyz, p) >= w. An empty box counts as all
 * space.
 * @param {PreparedVdi} vdi
 * @returns {number[][]}
 */
export function facesOf(vdi) {
  const [low, high] = vdi.bounds;
  if (low.some((value, axis) => !(value < high[axis]))) return Array.from({length: 6}, () => [0, 0, 0, -1]);
  const basis = basisOf(vdi.camera);
  const [from, to] = [toView(low, vdi.camera, basis), toView(high, vdi.camera, basis)];
  return [0, 1, 2].flatMap((axis) => {
    /** @type {[number, number, number]} */
    const normal = [basis.right[axis], basis.up[axis], basis.forward[axis]];
    return [[...normal, dot(normal, from)], [...normal.map((value) => -value), -dot(normal, to)]];
  });
}

/** Finds the slopes of a VDI, list after list. */
class SlopeFinder {
  /**
   * @param {PreparedVdi} vdi
   */
  constructor(vdi) {
    const {fronts, backs, depths} = supersegmentsOf(vdi);
    this.vdi = vdi;
    this.fronts = fronts;
    this.backs = backs;
    /** Optical depths. Behind MOST_DEPTH hardly anything shows. */
    this.depths = depths.map((depth) => Math.min(depth, MOST_DEPTH));
    const middle = vdi.camera.parallel ? 1 : 0.5 * (vdi.nearest + vdi.farthest);
    this.footprint = pixelSizeOf(vdi) * middle;
    this.unit = this.footprint * (MAX_SLOPE / SLOPES);
    this.slopes = new Int8Array(4 * fronts.length);
    this.faces = facesOf(vdi);
    const rounding = 4e-6 * vdi.farthest;
    this.depthTolerance = (vdi.compact ? vdi.code.step : 0) + rounding;
    this.distanceTolerance = rounding;
    // The run that `runFrom` has found: supersegments that touch each other.
    this.last = 0;
    this.opticalDepth = 0;
    // The position of `placeOf`.
    this.at = 0;
    this.before = 0;
  }

  /**
   * The supersegments of a list: first, and the one after its last.
   * @param {number} list
   * @returns {[number, number]}
   */
  ofList(list) {
    const {heads} = this.vdi;
    return [heads[4 * list], heads[4 * list] + heads[4 * list + 1] % 2 ** COUNT_BITS];
  }

  /**
   * Finds a run of the list that ends before `end`.
   * @param {number} first
   * @param {number} end
   */
  runFrom(first, end) {
    const {fronts, backs, depths} = this;
    let last = first, depth = depths[first];
    while (last + 1 < end && fronts[last + 1] <= backs[last]) depth += depths[++last];
    this.last = last;
    this.opticalDepth = depth;
  }

  /**
   * The depth of the run [.., last] that has this optical depth in front of it, from `at` and `before`
   * on; Infinity if the run has less.
   * @param {number} last
   * @param {number} opticalDepth
   */
  placeOf(last, opticalDepth) {
    const {depths} = this;
    let {at, before} = this;
    while (at < last && before + depths[at] < opticalDepth) before += depths[at++];
    this.at = at;
    this.before = before;
    const share = (opticalDepth - before) / depths[at];
    if (share > 1.001 || opticalDepth < -0.001 * depths[at]) return Infinity;
    return this.fronts[at] + (this.backs[at] - this.fronts[at]) * Math.min(Math.max(share, 0), 1);
  }

  /**
   * Sets a face's slope from one neighbour. The second neighbour on an axis averages it with the first one's.
   * @param {number} index in `slopes`
   * @param {number} change of depth towards the neighbour
   * @param {boolean} isAfter whether it is the second neighbour on this axis
   */
  combine(index, change, isAfter) {
    const {slopes} = this;
    const isKnown = Math.abs(change) <= MAX_SLOPE * this.footprint;
    const slope = isKnown ? Math.floor(change / this.unit + 0.5 + TIE) : NO_SLOPE;
    const before = slopes[index];
    if (!isAfter || before === NO_SLOPE) slopes[index] = slope;
    else if (isKnown) slopes[index] = Math.trunc((before + slope) / 2);
  }

  /**
   * @param {number} list
   * @param {number} neighbour -1: there is none
   * @param {boolean} isAfter
   * @param {number} axis
   */
  addNeighbour(list, neighbour, isAfter, axis) {
    const {fronts, backs, depths, footprint} = this;
    const [begin, end] = this.ofList(list);
    const [otherBegin, otherEnd] = neighbour < 0 ? [0, 0] : this.ofList(neighbour);
    let from = otherBegin;
    const reach = MAX_SLOPE * footprint;
    for (let first = begin; first < end;) {
      this.runFrom(first, end);
      const last = this.last, opticalDepth = this.opticalDepth;
      let otherFirst = -1, otherLast = 0, otherDepth = 0, most = -reach;
      for (let i = from; i < otherEnd && fronts[i] < backs[last] + reach;) {
        this.runFrom(i, otherEnd);
        const overlap = Math.min(backs[last], backs[this.last]) - Math.max(fronts[first], fronts[i]);
        if (overlap > most + TIE * footprint) {
          most = overlap;
          otherFirst = i;
          otherLast = this.last;
          otherDepth = this.opticalDepth;
        }
        i = this.last + 1;
      }
      if (otherFirst >= 0) from = otherFirst;
      this.at = otherFirst;
      this.before = 0;
      let isFrontHalf = true, before = 0;
      const placeOf = () => {
        if (otherFirst < 0) return Infinity;
        if (isFrontHalf && before > (0.5 + TIE) * opticalDepth) {
          isFrontHalf = false;
          this.at = otherFirst;
          this.before = 0;
        }
        return this.placeOf(otherLast, isFrontHalf ? before : before + (otherDepth - opticalDepth));
      };
      const changeTo = (/** @type {number} */ place, /** @type {number} */ depth) =>
        isAfter ? place - depth : depth - place;
      let place = placeOf();
      for (let i = first; i <= last; ++i) {
        this.combine(4 * i + axis, changeTo(place, fronts[i]), isAfter);
        before += depths[i];
        place = placeOf();
        this.combine(4 * i + 2 + axis, changeTo(place, backs[i]), isAfter);
      }
      first = last + 1;
    }
  }

  /**
   * Flattens the slopes of faint supersegments, because haze has no faces.
   * @param {number} first
   * @param {number} end
   */
  fade(first, end) {
    const {fronts, backs, depths, slopes, footprint} = this;
    const opacityOf = (/** @type {number} */ i) => 1 - 2 ** (-depths[i] * footprint / (backs[i] - fronts[i]));
    const faded = (/** @type {number} */ index, /** @type {number} */ opacity) => {
      const weight = Math.min(Math.max(opacity / LEAST_OPACITY - 1, 0), 1);
      slopes[index] = slopes[index] === NO_SLOPE ? 0 : Math.floor(slopes[index] * weight + 0.5 + TIE);
    };
    let previous = 0;  // opacity of the supersegment that touches this one in front
    for (let i = first; i < end; ++i) {
      const own = opacityOf(i);
      const next = i + 1 < end && fronts[i + 1] <= backs[i] ? opacityOf(i + 1) : 0;
      for (const axis of [0, 1]) {
        faded(4 * i + axis, Math.max(own, previous));
        faded(4 * i + 2 + axis, Math.max(own, next));
      }
      previous = next > 0 ? own : 0;
    }
  }

  /**
   * The depths and faces at which a ray of V_O's picture enters and leaves the box.
   * @param {number} x in lists from the lower left corner
   * @param {number} y
   */
  passage(x, y) {
    const {vdi, faces} = this;
    const size = pixelSizeOf(vdi);
    const plane = [(x - 0.5 * vdi.width) * size, (y - 0.5 * vdi.height) * size];
    const passage = {enter: -Infinity, enterRate: 1, enterFace: faces[0], leave: Infinity, leaveRate: 1, leaveFace: faces[0]};
    for (const face of faces) {
      const {depth, rate} = throughFace(face, plane, vdi.camera.parallel);
      if (rate > 0 && depth > passage.enter)
        Object.assign(passage, {enter: depth, enterRate: rate, enterFace: face});
      else if (rate < 0 && depth < passage.leave)
        Object.assign(passage, {leave: depth, leaveRate: -rate, leaveFace: face});
    }
    return passage;
  }

  /**
   * Marks the list's ends that lie on faces of the box.
   * @param {number} x
   * @param {number} y
   * @param {number} first
   * @param {number} end
   */
  putOnFaces(x, y, first, end) {
    const {slopes} = this;
    const passage = this.passage(x + 0.5, y + 0.5);
    const isNear = (/** @type {number} */ depth, /** @type {number} */ face, /** @type {number} */ rate) =>
      Math.abs(depth - face) <= this.depthTolerance + this.distanceTolerance / rate;
    if (isNear(this.fronts[first], passage.enter, passage.enterRate)) slopes.fill(ON_FACE, 4 * first, 4 * first + 2);
    if (isNear(this.backs[end - 1], passage.leave, passage.leaveRate)) slopes.fill(ON_FACE, 4 * end - 2, 4 * end);
  }

  /**
   * @param {number} x
   * @param {number} y
   */
  find(x, y) {
    const {width, height} = this.vdi;
    const list = y * width + x;
    const [first, end] = this.ofList(list);
    if (first === end) return;
    this.addNeighbour(list, x > 0 ? list - 1 : -1, false, 0);
    this.addNeighbour(list, x + 1 < width ? list + 1 : -1, true, 0);
    this.addNeighbour(list, y > 0 ? list - width : -1, false, 1);
    this.addNeighbour(list, y + 1 < height ? list + width : -1, true, 1);
    this.fade(first, end);
    this.putOnFaces(x, y, first, end);
  }

  /**
   * The ends of a supersegment over its list's pixel and half a pixel around it, where rays are
   * intersected with the list (expand.comp).
   * @param {number} i
   * @param {number} list
   * @returns {import("./heads.js").Ends}
   */
  endsOf(i, list) {
    const {slopes, unit, vdi} = this;
    const reach = (/** @type {number} */ at) => {
      const [a, b] = [Math.abs(slopes[at]), Math.abs(slopes[at + 1])];
      return 1.5 * Math.max(a, b) + 0.5 * Math.min(a, b);
    };
    const isOnFace = (/** @type {number} */ at) => slopes[at] === ON_FACE && slopes[at + 1] === ON_FACE;
    const [x, y] = [list % vdi.width, Math.floor(list / vdi.width)];
    const ends = {front: this.fronts[i], back: this.backs[i], reach: 0};
    const around = (/** @type {number[]} */ face, /** @type {number} */ depth, /** @type {number} */ sign) => {
      const size = pixelSizeOf(vdi);
      let most = depth;
      for (const [dx, dy] of [[-1.5, -1.5], [1.5, -1.5], [-1.5, 1.5], [1.5, 1.5]]) {
        const plane = [(x + 0.5 + dx - 0.5 * vdi.width) * size, (y + 0.5 + dy - 0.5 * vdi.height) * size];
        const {depth: there, rate} = throughFace(face, plane, vdi.camera.parallel);
        most = rate * sign < 0 ? (sign > 0 ? Math.max(most, there) : Math.min(most, there)) : sign * Infinity;
        if (!Number.isFinite(most)) break;
      }
      return most;
    };
    if (isOnFace(4 * i)) {
      const passage = this.passage(x + 0.5, y + 0.5);
      ends.front = Math.min(ends.front, around(passage.enterFace, passage.enter, -1));
    } else {
      ends.reach = reach(4 * i);
      ends.front -= ends.reach * unit;
    }
    if (isOnFace(4 * i + 2)) {
      const passage = this.passage(x + 0.5, y + 0.5);
      ends.back = Math.max(ends.back, around(passage.leaveFace, passage.leave, 1));
    } else {
      const behind = reach(4 * i + 2);
      ends.reach = Math.max(ends.reach, behind);
      ends.back += behind * unit;
    }
    return ends;
  }
}

/**
 * The depth at which a ray of V_O's picture passes through a face, and the rate: distance from the
 * face per depth.
 * @param {number[]} face
 * @param {number[]} plane x and y of the ray in the image plane
 * @param {boolean} parallel
 */
function throughFace(face, plane, parallel) {
  const along = face[0] * plane[0] + face[1] * plane[1];
  return parallel ? {depth: (face[3] - along) / face[2], rate: face[2]}
                  : {depth: face[3] / (along + face[2]), rate: along + face[2]};
}

/**
 * Finds how a VDI's supersegments lean.
 * @param {PreparedVdi} vdi
 * @param {() => Promise<void> | undefined} pause called between rows, which await the promise if it
 *     returns one
 * @param {() => boolean} isWanted called after each pause
 * @returns {Promise<Leaning | undefined>} undefined if it is no longer wanted
 */
export async function leaningOf(vdi, pause, isWanted) {
  const finder = new SlopeFinder(vdi);
  for (let y = 0; y < vdi.height; ++y) {
    for (let x = 0; x < vdi.width; ++x) finder.find(x, y);
    await pause();
    if (!isWanted()) return undefined;
  }
  return {
    slopes: new Uint32Array(finder.slopes.buffer),
    slopeUnit: finder.unit,
    faces: finder.faces,
    ...leaningHeads(vdi, (i, list) => finder.endsOf(i, list)),
  };
}
