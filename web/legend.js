// The colour bar, which shows the meaning of a VDI's colours.

/** @typedef {import("./format.js").Coloring} Coloring */

const MOST_DECIMALS = 15;  // more digits tell doubles apart only in the shortest text that gives the value
const MOST_STEPS = 5;      // between round numbers
const MOST_NUMBER = 2 ** 50;  // of a step, counted from 0; doubles hardly resolve steps with higher numbers

/**
 * The value with enough digits to differ from its neighbours, even in a narrow range.
 * @param {number} value
 * @param {number} span distance between the least and the greatest value
 */
export function numberText(value, span) {
  if (Math.abs(value) < span * 1e-9) return "0";
  const size = Math.max(Math.abs(value), span);
  const decimals = 2 - Math.floor(Math.log10(span));
  if (Math.floor(Math.log10(size)) + decimals > MOST_DECIMALS) return String(value);
  const fixed = value.toFixed(Math.min(Math.max(decimals, 0), MOST_DECIMALS));
  if (size < 1e5 && size >= 1e-3) return fixed;
  const digits = Math.floor(Math.log10(size)) + decimals;  // after the first one
  if (digits <= 2) return value.toExponential(2);
  const short = value.toExponential(Math.min(digits, MOST_DECIMALS));
  return size >= 1e5 && size < 1e15 && fixed.length <= short.length ? fixed : short;
}

/**
 * The share of the way from `low` to `high`, whose distance may exceed the largest number.
 * @param {number} value @param {number} low @param {number} high
 */
function shareOf(value, low, high) {
  const scale = Number.isFinite(high - low) ? 1 : 0.5;
  return (value * scale - low * scale) / (high * scale - low * scale);
}

/**
 * The numbers beside the bar: both ends, and round numbers between them that don't collide. A range
 * whose round numbers doubles don't resolve has its ends only.
 * @param {number} low @param {number} high
 */
export function ticksOf(low, high) {
  const span = Math.min(high - low, Number.MAX_VALUE);
  const power = 10 ** Math.floor(Math.log10(span / 4));
  const step = [1, 2, 5, 10].map((n) => n * power).find((s) => span / s <= 4.5) ?? span;
  const first = Math.ceil(low / step);
  const ticks = [low, high];
  for (let n = 0; n <= MOST_STEPS && Math.abs(first) < MOST_NUMBER; ++n) {
    const value = (first + n) * step;
    const share = shareOf(value, low, high);
    if (share > 0.1 && share < 0.9) ticks.push(value);
  }
  return ticks;
}

/**
 * Both ends of a range in six digits, or in as many as tell them apart.
 * @param {number} low @param {number} high
 */
export function rangeText(low, high) {
  const [from, to] = [low, high].map((value) => String(Number(value.toPrecision(6))));
  return from === to ? `${low} to ${high}` : `${from} to ${to}`;
}

/**
 * A colour map as a CSS gradient.
 * @param {Coloring["transferFunction"]["colors"]} colors of at least two values
 * @param {string} towards the side of the greatest value
 */
export function gradientOf(colors, towards) {
  const low = colors[0][0], high = colors[colors.length - 1][0];
  const stops = colors.map(([scalar, ...rgb]) =>
    `rgb(${rgb.map((share) => Math.round(255 * share)).join(" ")}) ${(100 * shareOf(scalar, low, high)).toFixed(3)}%`);
  return `linear-gradient(to ${towards}, ${stops.join(", ")})`;
}

/** @param {Coloring} coloring */
function titleOf(coloring) {
  const {name, components, component} = coloring.array;
  if (name === "") return "Value";
  if (components === 1) return name;
  if (component === -2) return `${name}, phase`;
  if (component < 0) return `${name}, magnitude`;
  return `${name}, ${components <= 3 ? "XYZ"[component] : component}`;
}

/**
 * @param {string} name of a class
 * @param {string} [text]
 */
function part(name, text = "") {
  const div = document.createElement("div");
  div.className = name;
  div.textContent = text;
  return div;
}

/**
 * Fills `figure`, or hides it if the VDI has no metadata.
 * @param {HTMLElement} figure @param {Coloring | undefined} coloring
 */
export function showLegend(figure, coloring) {
  const colors = coloring?.transferFunction.colors ?? [];
  const low = colors.length > 0 ? colors[0][0] : 0, high = colors.length > 0 ? colors[colors.length - 1][0] : 0;
  figure.hidden = !coloring || !(high > low);
  if (!coloring || !(high > low)) return;
  const span = Math.min(high - low, Number.MAX_VALUE);
  const percent = (/** @type {number} */ value) => 100 * shareOf(value, low, high);
  const caption = document.createElement("figcaption");
  caption.textContent = titleOf(coloring);
  const bar = part("bar");
  bar.style.background = gradientOf(colors, "top");
  const ticks = ticksOf(low, high).map((value) => {
    const tick = part("tick", numberText(value, span));
    tick.style.bottom = `${percent(value)}%`;
    return tick;
  });
  const widest = Math.max(...ticks.map((tick) => (tick.textContent ?? "").length));
  const scale = part("scale");
  scale.style.minWidth = `calc(28px + ${widest}ch)`;
  scale.append(bar, ...ticks);
  figure.replaceChildren(caption, scale);
}
