// Finds the point that a pixel shows: where half of its opacity lies in front. The renderer draws the
// pixel with the scene cut off behind planes of growing depth.

import {basisOf, halfHeightOf} from "./camera.js";
import {cornerOf} from "./renderer.js";
import {dot, length, minus, plus, times} from "./vector.js";

/** @typedef {import("./format.js").Vec3} Vec3 */
/** @typedef {import("./viewer.js").Viewer} Viewer */

const LEAST_ALPHA = 8;  // of 255; below it, a pixel shows nothing
const HALVINGS = 16;

/**
 * @param {Viewer} viewer
 * @param {number} x share of the canvas' width
 * @param {number} y share of its height, downwards
 * @returns {Vec3 | undefined} undefined where nothing is shown
 */
export function pointAt(viewer, x, y) {
  const {renderer, camera, canvas} = viewer;
  const vdi = renderer.loaded?.vdi;
  if (!vdi || !camera || viewer.isLost) return undefined;
  const column = Math.min(Math.max(Math.floor(x * canvas.width), 0), canvas.width - 1);
  const row = Math.min(Math.max(Math.floor((1 - y) * canvas.height), 0), canvas.height - 1);
  const {right, up, forward} = basisOf(camera);
  const pixel = 2 * halfHeightOf(camera) / renderer.framedHeight();
  const [beside, above] = renderer.framedMiddle();
  const u = (column + 0.5 - canvas.width / 2 - beside) * pixel, v = (row + 0.5 - canvas.height / 2 - above) * pixel;
  const across = plus(times(u, right), times(v, up));
  const at = (/** @type {number} */ depth) => camera.parallel
    ? plus(plus(camera.position, across), times(depth, forward))
    : plus(camera.position, times(depth, plus(forward, across)));
  const alphaBefore = (/** @type {number} */ depth) =>
    renderer.alphaAt(camera, column, row, {origin: at(depth), normal: times(-1, forward)});

  const depths = [0, 1, 2, 3, 4, 5, 6, 7].map((corner) =>
    dot(cornerOf(vdi.bounds, corner, camera.position), forward));
  const spare = length(minus(vdi.bounds[1], vdi.bounds[0])) * 1e-3;
  let near = Math.max(Math.min(...depths) - spare, camera.parallel ? -Infinity : 0), far = Math.max(...depths) + spare;
  const whole = far > near ? alphaBefore(far) : 0;
  if (whole >= LEAST_ALPHA) {
    for (let i = 0; i < HALVINGS; ++i) {
      const middle = (near + far) / 2;
      if (alphaBefore(middle) < whole / 2) near = middle;
      else far = middle;
    }
  }
  viewer.redraw();  // the strips of a picture in the making are gone
  return whole >= LEAST_ALPHA ? at(far) : undefined;
}
