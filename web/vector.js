// Vectors of three numbers, in double precision.

/** @typedef {import("./format.js").Vec3} Vec3 */

/** @param {Vec3} a @param {Vec3} b @returns {Vec3} */
export const plus = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
/** @param {Vec3} a @param {Vec3} b @returns {Vec3} */
export const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
/** @param {number} s @param {Vec3} a @returns {Vec3} */
export const times = (s, a) => [s * a[0], s * a[1], s * a[2]];
/** @param {Vec3} a @param {Vec3} b */
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
/** @param {Vec3} a @param {Vec3} b @returns {Vec3} */
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
/** @param {Vec3} a */
export const length = (a) => Math.hypot(a[0], a[1], a[2]);
/** @param {Vec3} a @returns {Vec3} */
export const normalize = (a) => times(1 / length(a), a);

/**
 * Turns `a` about the unit vector `axis`, counterclockwise as seen from its tip.
 * @param {Vec3} a
 * @param {Vec3} axis
 * @param {number} radians
 * @returns {Vec3}
 */
export function turn(a, axis, radians) {
  const along = dot(axis, a);
  const across = times(Math.sin(radians), cross(axis, a));
  return plus(plus(times(Math.cos(radians), a), across), times((1 - Math.cos(radians)) * along, axis));
}
