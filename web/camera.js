// Cameras, the rays of their pictures, and the motions that a user gives them. vdi/core/Camera.h
// has the conventions: in view space x points right, y points up and z is the depth. Pictures count
// pixels from their lower left corner.

import {cross, dot, length, minus, normalize, plus, times, turn} from "./vector.js";

/** @typedef {import("./format.js").Vec3} Vec3 */
/** @typedef {import("./format.js").Camera} Camera */
/** @typedef {import("./format.js").Header} Header */

/** @param {Vec3} up @returns {Vec3} of length 1; y for one of length 0, as in vtkCamera */
function unitUp(up) {
  const largest = Math.max(...up.map(Math.abs));
  return largest > 0 ? normalize(times(1 / largest, up)) : [0, 1, 0];
}

/** @typedef {{right: Vec3, up: Vec3, forward: Vec3}} Basis */

/**
 * The orthonormal basis of view space.
 * @param {Camera} camera
 * @returns {Basis}
 */
export function basisOf(camera) {
  const forward = normalize(minus(camera.focalPoint, camera.position));
  const wanted = unitUp(camera.viewUp);
  let rest = minus(wanted, times(dot(wanted, forward), forward));
  if (!(length(rest) > 1e-9)) {  // any orthogonal vector serves
    const sizes = forward.map(Math.abs);
    const least = sizes.indexOf(Math.min(...sizes));
    const axis = /** @type {Vec3} */ ([0, 1, 2].map((i) => i === least ? 1 : 0));
    rest = minus(axis, times(dot(axis, forward), forward));
  }
  const up = normalize(rest);
  return {right: cross(forward, up), up, forward};
}

/**
 * Half the height of the image plane at depth 1; in parallel projection, at any depth.
 * @param {Camera} camera
 */
export function halfHeightOf(camera) {
  return camera.parallel ? camera.parallelScale : Math.tan(camera.viewAngle * Math.PI / 360);
}

/**
 * Transforms a point from world to view space.
 * @param {Vec3} world
 * @param {Camera} camera
 * @param {Basis} basis
 * @returns {Vec3}
 */
export function toView(world, camera, basis) {
  const offset = minus(world, camera.position);
  return [dot(offset, basis.right), dot(offset, basis.up), dot(offset, basis.forward)];
}

/**
 * The rays of a new picture in the view space of V_O, as RenderRays in shaders/shared/render.h. A
 * ray starts at origin + u * originRight + v * originUp; its direction has the same form. u and v
 * count pixels from the picture's middle.
 * @typedef {{origin: Vec3, originRight: Vec3, originUp: Vec3,
 *            direction: Vec3, directionRight: Vec3, directionUp: Vec3}} Rays
 */

/**
 * @param {Camera} camera
 * @param {number} height of the picture, in pixels
 * @param {Camera} original V_O
 * @param {[number, number]} [middle] pixel that shows the focal point, right of and above the picture's middle
 * @returns {Rays}
 */
export function raysOf(camera, height, original, middle = [0, 0]) {
  const from = basisOf(original);
  const basis = basisOf(camera);
  const turned = (/** @type {Vec3} */ v) =>
    /** @type {Vec3} */ ([dot(v, from.right), dot(v, from.up), dot(v, from.forward)]);
  const pixel = 2 * halfHeightOf(camera) / height;
  const right = turned(times(pixel, basis.right));
  const up = turned(times(pixel, basis.up));
  const shift = plus(times(-middle[0], right), times(-middle[1], up));
  const origin = toView(camera.position, original, from);
  const direction = turned(basis.forward);
  /** @type {Vec3} */
  const none = [0, 0, 0];
  return camera.parallel
    ? {origin: plus(origin, shift), originRight: right, originUp: up, direction, directionRight: none, directionUp: none}
    : {origin, originRight: none, originUp: none, direction: plus(direction, shift), directionRight: right, directionUp: up};
}

/**
 * The size of V_O's pixel at depth 1; in parallel projection, at any depth.
 * @param {Header} header
 */
export function pixelSizeOf(header) {
  return 2 * halfHeightOf(header.camera) / (header.height - 2 * header.margin[1]);
}

/**
 * The matrix from world coordinates, less the camera's position, to WebGL's clip space. It doesn't
 * resolve depth. Far from the origin, single precision wouldn't resolve a pixel in world coordinates.
 * @param {Camera} camera
 * @param {[number, number]} extent half the canvas' width and height, in the camera's half heights
 * @param {[number, number]} [middle] place of the focal point in clip space
 * @returns {Float32Array} 16 numbers, by columns
 */
export function clipMatrix(camera, extent, middle = [0, 0]) {
  const {right, up, forward} = basisOf(camera);
  const half = halfHeightOf(camera);
  const rows = [times(1 / (half * extent[0]), right), times(1 / (half * extent[1]), up)];
  const matrix = new Float32Array(16);
  rows.forEach((axis, row) => {
    for (let column = 0; column < 3; ++column) matrix[4 * column + row] = axis[column];
  });
  if (camera.parallel) {
    matrix[15] = 1;
  } else {
    for (let column = 0; column < 3; ++column) matrix[4 * column + 3] = forward[column];
  }
  for (let column = 0; column < 4; ++column)
    for (const row of [0, 1]) matrix[4 * column + row] += middle[row] * matrix[4 * column + 3];
  return matrix;
}

/** @param {[Vec3, Vec3]} bounds @returns {Vec3} */
export function centerOf(bounds) {
  return times(0.5, plus(bounds[0], bounds[1]));
}

/**
 * The angle between the directions from which two cameras see a point, in degrees. A parallel
 * camera sees every point along its axis.
 * @param {Vec3} point
 * @param {Camera} a
 * @param {Camera} b
 */
export function degreesBetween(point, a, b) {
  const towards = (/** @type {Camera} */ camera) => {
    const way = minus(camera.parallel ? camera.focalPoint : point, camera.position);
    return length(way) > 0 ? normalize(way) : /** @type {Vec3} */ ([0, 0, -1]);
  };
  return Math.acos(Math.min(1, Math.max(-1, dot(towards(a), towards(b))))) * 180 / Math.PI;
}

/**
 * Turns the camera about `center`, to its own right and upwards, by degrees. vtkCamera's Azimuth
 * and Elevation do the same. View-up turns, too, so that the picture never flips over.
 * @param {Camera} camera
 * @param {Vec3} center
 * @param {number} azimuth
 * @param {number} elevation
 * @returns {Camera}
 */
export function orbited(camera, center, azimuth, elevation) {
  const radians = Math.PI / 180;
  const {right, up} = basisOf(camera);
  const turnBoth = (/** @type {Vec3} */ v) => turn(turn(v, right, -elevation * radians), up, azimuth * radians);
  return {
    ...camera,
    position: plus(center, turnBoth(minus(camera.position, center))),
    focalPoint: plus(center, turnBoth(minus(camera.focalPoint, center))),
    viewUp: turnBoth(up),
  };
}

/**
 * Turns the picture counterclockwise.
 * @param {Camera} camera
 * @param {number} degrees
 * @returns {Camera}
 */
export function rolled(camera, degrees) {
  const {up, forward} = basisOf(camera);
  return {...camera, viewUp: turn(up, forward, degrees * Math.PI / 180)};
}

/**
 * Moves the camera so that the material at the focal point follows the pointer.
 * @param {Camera} camera
 * @param {number} dx shift to the right, as a share of the picture's height
 * @param {number} dy shift upwards, likewise
 * @returns {Camera}
 */
export function panned(camera, dx, dy) {
  const {right, up} = basisOf(camera);
  const depth = camera.parallel ? 1 : length(minus(camera.focalPoint, camera.position));
  const height = 2 * halfHeightOf(camera) * depth;
  const step = plus(times(-dx * height, right), times(-dy * height, up));
  return {...camera, position: plus(camera.position, step), focalPoint: plus(camera.focalPoint, step)};
}

/** @param {Vec3[]} points */
function largestCoordinate(...points) {
  return Math.max(...points.flat().map(Math.abs));
}

const NEAREST_SHARE = 1e-5;     // of the scene's diagonal
const SHARPEST_SHARE = 1e-10;   // of the largest coordinate, of which double precision holds 1e-16

/**
 * Magnifies the picture by `factor`. In perspective the camera moves closer, but stays at a
 * distance from the focal point that numbers resolve.
 * @param {Camera} camera
 * @param {number} factor > 0
 * @param {number} diagonal of the scene
 * @returns {Camera}
 */
export function zoomed(camera, factor, diagonal) {
  const least = Math.max(NEAREST_SHARE * diagonal, SHARPEST_SHARE * largestCoordinate(camera.focalPoint));
  const limited = (/** @type {number} */ extent) => Math.max(extent / factor, Math.min(extent, least));
  if (camera.parallel) return {...camera, parallelScale: limited(camera.parallelScale)};
  const back = minus(camera.position, camera.focalPoint);
  return {...camera, position: plus(camera.focalPoint, times(limited(length(back)), normalize(back)))};
}

/**
 * Interpolates between two cameras.
 * @param {Camera} a
 * @param {Camera} b
 * @param {number} share of b
 * @returns {Camera}
 */
export function between(a, b, share) {
  const mix = (/** @type {Vec3} */ p, /** @type {Vec3} */ q) => plus(times(1 - share, p), times(share, q));
  const focalPoint = mix(a.focalPoint, b.focalPoint);
  const fromA = minus(a.position, a.focalPoint);
  const fromB = minus(b.position, b.focalPoint);
  const distance = Math.exp((1 - share) * Math.log(length(fromA)) + share * Math.log(length(fromB)));
  const back = mix(normalize(fromA), normalize(fromB));
  if (length(back) < 0.1) return share < 0.5 ? a : b;  // there is no shortest way between opposite directions
  const scale = Math.exp((1 - share) * Math.log(a.parallelScale) + share * Math.log(b.parallelScale));
  return {
    ...b, focalPoint,
    position: plus(focalPoint, times(distance, normalize(back))),
    viewUp: mix(basisOf(a).up, basisOf(b).up),
    parallelScale: Number.isFinite(scale) ? scale : b.parallelScale,
  };
}

const DIGITS = 7;         // significant digits of single precision
const MOST_DIGITS = 17;   // significant digits of double precision

/**
 * A camera as text for a URL. Numbers have the digits of single precision. Positions have more
 * digits where the coordinates are large compared with the part that the camera sees.
 * @param {Camera} camera
 */
export function cameraText(camera) {
  const {position, focalPoint, viewUp, parallel, parallelScale, viewAngle} = camera;
  const distance = length(minus(position, focalPoint));
  const share = largestCoordinate(position, focalPoint) / (parallel ? Math.min(distance, parallelScale) : distance);
  const more = Math.max(Math.floor(Math.log10(share)), 0);
  const digits = Math.min(Number.isFinite(more) ? DIGITS + more : MOST_DIGITS, MOST_DIGITS);
  const text = (/** @type {number} */ n, /** @type {number} */ most) => String(Number(n.toPrecision(most)));
  const words = [...[...position, ...focalPoint].map((n) => text(n, digits)),
                 ...[...viewUp, parallel ? parallelScale : viewAngle].map((n) => text(n, DIGITS))];
  return (parallel ? "parallel," : "") + words.join(",");
}

/**
 * @param {string} text
 * @param {Camera} original gives the values that the text omits
 * @returns {Camera | undefined} undefined if the text describes no camera
 */
export function cameraOfText(text, original) {
  const parallel = text.startsWith("parallel,");
  const n = (parallel ? text.slice(9) : text).split(",").map(Number);
  if (n.length !== 10 || !n.every(Number.isFinite) || parallel !== original.parallel) return undefined;
  /** @type {Camera} */
  const camera = {...original, position: [n[0], n[1], n[2]], focalPoint: [n[3], n[4], n[5]], viewUp: [n[6], n[7], n[8]]};
  if (parallel) camera.parallelScale = n[9];
  else camera.viewAngle = n[9];
  const distance = length(minus(camera.position, camera.focalPoint));
  const extent = parallel ? n[9] > 0 : n[9] > 0 && n[9] < 180;
  return distance > 0 && Number.isFinite(distance) && extent ? camera : undefined;
}
