// Moves the camera by mouse, touch and keyboard.

import {orbited, panned, rolled, zoomed} from "./camera.js";

/** @typedef {import("./format.js").Camera} Camera */
/** @typedef {import("./format.js").Vec3} Vec3 */

const DEGREES_PER_HEIGHT = 180;  // a drag across the picture's height turns this far
const KEY_DEGREES = 5;
const KEY_PAN = 0.05;
const KEY_ZOOM = 1.1;

/**
 * @typedef {object} Hand the camera that the controls move
 * @property {() => Camera | undefined} camera
 * @property {() => Vec3} center point that the camera orbits
 * @property {() => number} diagonal of the scene
 * @property {() => number} framed share of the element's height that the camera's vertical extent takes
 * @property {(camera: Camera) => void} move
 */

/** @typedef {{x: number, y: number}} Place in CSS pixels */

/**
 * The motion that a drag causes.
 * @param {PointerEvent} event
 * @returns {"orbit" | "pan" | "roll" | "zoom"}
 */
function dragOf(event) {
  if (event.button === 1 || (event.button === 0 && event.shiftKey)) return "pan";
  if (event.button === 2) return "zoom";
  return event.ctrlKey || event.altKey ? "roll" : "orbit";
}

/**
 * The angle through which a place turns around another one, counterclockwise, in degrees.
 * @param {Place} middle
 * @param {Place} from
 * @param {Place} to
 */
function degreesAround(middle, from, to) {
  // CSS counts y downwards.
  const angle = (/** @type {Place} */ place) => Math.atan2(middle.y - place.y, place.x - middle.x);
  return (angle(to) - angle(from)) * 180 / Math.PI;
}

/** @param {HTMLElement} element @param {Hand} hand */
function addPointers(element, hand) {
  /** @type {Map<number, Place>} */
  const pointers = new Map();
  /** @type {"orbit" | "pan" | "roll" | "zoom"} */
  let drag = "orbit";

  /** @param {Camera} camera @param {number} dx in CSS pixels @param {number} dy likewise, downwards */
  const pannedBy = (camera, dx, dy) => {
    const height = element.getBoundingClientRect().height * hand.framed();
    return panned(camera, dx / height, -dy / height);
  };

  /** @param {Camera} camera @param {Place} from @param {Place} to */
  const dragged = (camera, from, to) => {
    const box = element.getBoundingClientRect();
    const dx = (to.x - from.x) / box.height, dy = (to.y - from.y) / box.height;
    if (drag === "pan") return pannedBy(camera, to.x - from.x, to.y - from.y);
    if (drag === "zoom") return zoomed(camera, Math.exp(-2 * dy), hand.diagonal());
    if (drag === "orbit") return orbited(camera, hand.center(), -dx * DEGREES_PER_HEIGHT, dy * DEGREES_PER_HEIGHT);
    const middle = {x: box.left + box.width / 2, y: box.top + box.height / 2};
    return rolled(camera, degreesAround(middle, from, to));
  };

  /**
   * Moves the camera by two fingers. The material between them stays between them.
   * @param {Camera} camera
   * @param {Place} fixed
   * @param {Place} from
   * @param {Place} to
   */
  const pinched = (camera, fixed, from, to) => {
    const before = {x: from.x - fixed.x, y: from.y - fixed.y}, after = {x: to.x - fixed.x, y: to.y - fixed.y};
    const factor = Math.hypot(after.x, after.y) / Math.max(Math.hypot(before.x, before.y), 1);
    const moved = pannedBy(camera, (to.x - from.x) / 2, (to.y - from.y) / 2);
    return rolled(zoomed(moved, Math.min(Math.max(factor, 0.5), 2), hand.diagonal()), degreesAround(fixed, from, to));
  };

  element.addEventListener("pointerdown", (event) => {
    element.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, {x: event.clientX, y: event.clientY});
    drag = dragOf(event);
  });
  element.addEventListener("pointermove", (event) => {
    const from = pointers.get(event.pointerId);
    const camera = hand.camera();
    if (!from || !camera) return;
    const to = {x: event.clientX, y: event.clientY};
    const other = [...pointers].find(([id]) => id !== event.pointerId);
    pointers.set(event.pointerId, to);
    hand.move(other ? pinched(camera, other[1], from, to) : dragged(camera, from, to));
  });
  for (const name of /** @type {const} */ (["pointerup", "pointercancel", "lostpointercapture"]))
    element.addEventListener(name, (event) => pointers.delete(event.pointerId));
  element.addEventListener("contextmenu", (event) => event.preventDefault());
}

/** @param {KeyboardEvent} event @param {Camera} camera @param {Hand} hand @returns {Camera | undefined} */
function keyed(event, camera, hand) {
  const step = event.shiftKey;
  const center = hand.center();
  switch (event.key) {
    case "ArrowLeft": return step ? panned(camera, -KEY_PAN, 0) : orbited(camera, center, -KEY_DEGREES, 0);
    case "ArrowRight": return step ? panned(camera, KEY_PAN, 0) : orbited(camera, center, KEY_DEGREES, 0);
    case "ArrowUp": return step ? panned(camera, 0, KEY_PAN) : orbited(camera, center, 0, KEY_DEGREES);
    case "ArrowDown": return step ? panned(camera, 0, -KEY_PAN) : orbited(camera, center, 0, -KEY_DEGREES);
    case "+": case "=": return zoomed(camera, KEY_ZOOM, hand.diagonal());
    case "-": case "_": return zoomed(camera, 1 / KEY_ZOOM, hand.diagonal());
    case "[": return rolled(camera, KEY_DEGREES);
    case "]": return rolled(camera, -KEY_DEGREES);
    default: return undefined;
  }
}

/** @param {HTMLElement} element that has the focus and the pointer @param {Hand} hand */
export function addControls(element, hand) {
  addPointers(element, hand);
  element.addEventListener("wheel", (event) => {
    event.preventDefault();
    const camera = hand.camera();
    const lines = event.deltaMode === 0 ? event.deltaY / 100 : event.deltaMode === 1 ? event.deltaY / 3 : event.deltaY;
    if (camera) hand.move(zoomed(camera, Math.exp(-0.15 * Math.min(Math.max(lines, -5), 5)), hand.diagonal()));
  }, {passive: false});
  element.addEventListener("keydown", (event) => {
    const camera = hand.camera();
    if (!camera || event.ctrlKey || event.altKey || event.metaKey) return;
    const next = keyed(event, camera, hand);
    if (!next) return;
    event.preventDefault();
    hand.move(next);
  });
}
