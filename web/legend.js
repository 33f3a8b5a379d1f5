// The colour bar, which shows the meaning of a VDI's colours.

/** @typedef {import("./format.js").Coloring} Coloring */

const MOST_DECIMALS = 15;  // doubles have no more digits

/**
 * The value with enough digits to differ from its neighbours, even in a narrow range.
 * @param {number} value
 * @param {number} span distance between the least and the greatest value
 */
export function numberText(value, span) {
  if (Math.abs(value) < span * 1e-9) return "0";
  const size = Math.max(Math.abs(value), span);
  const decimals = 2 - Math.floor(Math.log10(span));
  const fixed = value.toFixed(Math.min(Math.max(decimals, 0), MOST_DECIMALS));
  if (size < 1e5 && size >= 1e-3) return fixed;
  const digits = Math.floor(Math.log10(size)) + decimals;  // after the first one
  if (digits <= 2) return value.toExponential(2);
  const short = value.toExponential(Math.min(digits, MOST_DECIMALS));
  return size >= 1e5 && size < 1e15 && fixed.length <= short.length ? fixed : short;
}

/**
 * The numbers beside the bar: both ends, and round numbers between them that don't collide.
 * @param {number} low @param {number} high
 */
function ticksOf(low, high) {
  const span = high - low;
  const power = 10 ** Math.floor(Math.log10(span / 4));
  const step = [1, 2, 5, 10].map((n) => n * power).find((s) => span / s <= 4.5) ?? span;
  const ticks = [low, high];
  for (let i = Math.ceil(low / step); i * step < high; ++i) {
    const share = (i * step - low) / span;
    if (share > 0.1 && share < 0.9) ticks.push(i * step);
  }
  return ticks;
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
  const percent = (/** @type {number} */ value) => 100 * (value - low) / (high - low);
  const stops = colors.map(([scalar, ...rgb]) =>
    `rgb(${rgb.map((share) => Math.round(255 * share)).join(" ")}) ${percent(scalar).toFixed(3)}%`);
  const caption = document.createElement("figcaption");
  caption.textContent = titleOf(coloring);
  const bar = part("bar");
  bar.style.background = `linear-gradient(to top, ${stops.join(", ")})`;
  const ticks = ticksOf(low, high).map((value) => {
    const tick = part("tick", numberText(value, high - low));
    tick.style.bottom = `${percent(value)}%`;
    return tick;
  });
  const widest = Math.max(...ticks.map((tick) => (tick.textContent ?? "").length));
  const scale = part("scale");
  scale.style.minWidth = `calc(28px + ${widest}ch)`;
  scale.append(bar, ...ticks);
  figure.title = coloring.range
    ? `Values from ${coloring.range.map((value) => Number(value.toPrecision(6))).join(" to ")}` : "";
  figure.replaceChildren(caption, scale);
}
