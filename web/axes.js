// Draws the directions of the world's axes in a corner of the view, and looks along them.

import {basisOf} from "./camera.js";
import {dot, length, minus, plus, times} from "./vector.js";

/** @typedef {import("./format.js").Camera} Camera */
/** @typedef {import("./format.js").Vec3} Vec3 */

/** @type {[string, Vec3][]} */
const AXES = [["x", [1, 0, 0]], ["y", [0, 1, 0]], ["z", [0, 0, 1]]];

/**
 * The camera that looks at `center` from one side, at its present distance.
 * @param {Camera} camera
 * @param {Vec3} center
 * @param {string} side "+x", "-x" and so on
 * @returns {Camera | undefined} undefined for another text
 */
export function lookingFrom(camera, center, side) {
  const axis = AXES.find(([name]) => name === side.slice(1))?.[1];
  if (!axis) return undefined;
  const distance = length(minus(camera.position, center)) || 1;
  const away = times(side[0] === "-" ? -distance : distance, axis);
  return {...camera, focalPoint: center, position: plus(center, away), viewUp: axis[2] === 1 ? [0, 1, 0] : [0, 0, 1]};
}

/**
 * Draws both ends of each axis. An end has the attribute data-side, "+x" for example.
 * @param {SVGElement} svg with a viewBox of -1.5 to 1.5 @param {Camera} camera
 */
export function drawAxes(svg, camera) {
  const {right, up, forward} = basisOf(camera);
  const make = (/** @type {string} */ tag, /** @type {{[name: string]: string | number}} */ attributes) => {
    const made = document.createElementNS(svg.namespaceURI, tag);
    for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, String(value));
    return made;
  };
  const ends = AXES.flatMap(([name, axis]) => [1, -1].map((sign) => ({name, sign, end: times(sign, axis)})));
  const nearLast = ends.sort((a, b) => dot(b.end, forward) - dot(a.end, forward));
  svg.replaceChildren(...nearLast.map(({name, sign, end}) => {
    const [x, y] = [dot(end, right), -dot(end, up)];
    const group = make("g", {class: `axis ${name}`, "data-side": (sign > 0 ? "+" : "-") + name});
    const title = make("title", {});
    title.textContent = `Look from ${sign > 0 ? "+" : "−"}${name}`;
    const reach = sign > 0 ? 1.28 : 0.8;
    group.append(title, make("circle", {cx: reach * x, cy: reach * y, r: 0.3, class: "target"}));
    if (sign < 0) {
      group.append(make("circle", {cx: 0.8 * x, cy: 0.8 * y, r: 0.11, class: "far"}));
      return group;
    }
    const text = make("text", {x: 1.28 * x, y: 1.28 * y + 0.12});
    text.textContent = name;
    group.append(make("line", {x2: x, y2: y}), text);
    return group;
  }));
}
