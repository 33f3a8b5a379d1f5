// Draws the directions of the world's axes in a corner of the view.

import {basisOf} from "./camera.js";
import {dot} from "./vector.js";

/** @typedef {import("./format.js").Camera} Camera */
/** @typedef {import("./format.js").Vec3} Vec3 */

/** @type {[string, Vec3][]} */
const AXES = [["x", [1, 0, 0]], ["y", [0, 1, 0]], ["z", [0, 0, 1]]];

/** @param {SVGElement} svg with a viewBox of -1.5 to 1.5 @param {Camera} camera */
export function drawAxes(svg, camera) {
  const {right, up, forward} = basisOf(camera);
  const nearLast = [...AXES].sort((a, b) => dot(b[1], forward) - dot(a[1], forward));
  svg.replaceChildren(...nearLast.map(([name, axis]) => {
    const [x, y] = [dot(axis, right), -dot(axis, up)];
    const group = document.createElementNS(svg.namespaceURI, "g");
    group.setAttribute("class", `axis ${name}`);
    const line = document.createElementNS(svg.namespaceURI, "line");
    line.setAttribute("x2", String(x));
    line.setAttribute("y2", String(y));
    const text = document.createElementNS(svg.namespaceURI, "text");
    text.setAttribute("x", String(1.28 * x));
    text.setAttribute("y", String(1.28 * y + 0.12));
    text.textContent = name;
    group.append(line, text);
    return group;
  }));
}
