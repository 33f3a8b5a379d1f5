// Clipping by planes across the scene's axes: the user cuts off shares of the scene from both sides.

/** @typedef {import("./format.js").Vec3} Vec3 */
/** @typedef {import("./renderer.js").ClipPlane} ClipPlane */

const STEPS = 200;  // of a slider

/**
 * The planes that keep these shares of a box along each axis. Whole axes have none.
 * @param {[Vec3, Vec3]} bounds
 * @param {[number, number][]} shares of each axis, from 0 to 1
 * @returns {ClipPlane[]}
 */
export function planesOf(bounds, shares) {
  const [low, high] = bounds;
  return shares.flatMap(([from, to], axis) => {
    const at = (/** @type {number} */ share) =>
      /** @type {Vec3} */ (low.map((value, i) => i === axis ? value + share * (high[i] - value) : value));
    const along = (/** @type {number} */ sign) => /** @type {Vec3} */ ([0, 1, 2].map((i) => i === axis ? sign : 0));
    return [...from > 0 ? [{origin: at(from), normal: along(1)}] : [], ...to < 1 ? [{origin: at(to), normal: along(-1)}] : []];
  });
}

/**
 * Fills `box` with a row of two sliders for each axis, and a button that undoes the clipping.
 * @param {HTMLElement} box
 * @param {(shares: [number, number][]) => void} onChange
 */
export function addClipping(box, onChange) {
  const sliders = ["x", "y", "z"].map((name) => ["from", "to"].map((end) => {
    const slider = document.createElement("input");
    Object.assign(slider, {type: "range", min: "0", max: String(STEPS), value: end === "from" ? "0" : String(STEPS)});
    slider.setAttribute("aria-label", `Clip ${name} ${end}`);
    return slider;
  }));
  const tell = () => onChange(sliders.map(([from, to]) => [from.valueAsNumber / STEPS, to.valueAsNumber / STEPS]));
  sliders.forEach(([from, to], axis) => {
    from.addEventListener("input", () => {
      to.value = String(Math.max(to.valueAsNumber, from.valueAsNumber + 1));
      from.value = String(Math.min(from.valueAsNumber, to.valueAsNumber - 1));
      tell();
    });
    to.addEventListener("input", () => {
      from.value = String(Math.min(from.valueAsNumber, to.valueAsNumber - 1));
      to.value = String(Math.max(to.valueAsNumber, from.valueAsNumber + 1));
      tell();
    });
    const label = document.createElement("span");
    label.textContent = "xyz"[axis];
    box.append(label, from, to);
  });
  const whole = document.createElement("button");
  whole.textContent = "Show all";
  whole.addEventListener("click", () => {
    for (const [from, to] of sliders) [from.value, to.value] = ["0", String(STEPS)];
    tell();
  });
  box.append(whole);
}
