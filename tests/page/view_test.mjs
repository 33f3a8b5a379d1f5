// What the page does with hands, pictures and numbers, without a browser: elements, renderer and clock are this test's.
import {Viewer} from "../../web/viewer.js";

let failures = 0;
const check = (/** @type {boolean} */ holds, /** @type {string} */ what) => {
  if (holds) return;
  console.log(`FAILED  ${what}`);
  ++failures;
};

/** A clock that only `pass` moves. */
const clock = {
  now: 0,
  /** @type {{at: number, act: () => void}[]} */
  timers: [],
  pass(/** @type {number} */ milliseconds) {
    const end = this.now + milliseconds;
    for (;;) {
      const due = this.timers.filter(({at}) => at <= end).sort((a, b) => a.at - b.at);
      if (due.length === 0) break;
      this.timers.splice(this.timers.indexOf(due[0]), 1);
      this.now = Math.max(this.now, due[0].at);
      due[0].act();
    }
    this.now = end;
  },
};
Object.defineProperty(globalThis, "performance", {value: {now: () => clock.now}});
Object.assign(globalThis, {
  window: {devicePixelRatio: 1},
  setTimeout: (/** @type {() => void} */ act, /** @type {number} */ after) => {
    const timer = {at: clock.now + after, act};
    clock.timers.push(timer);
    return timer;
  },
  clearTimeout: (/** @type {any} */ timer) => {
    clock.timers = clock.timers.filter((other) => other !== timer);
  },
  requestAnimationFrame: (/** @type {() => void} */ act) => setTimeout(act, 16),
});

/** @type {any} */
const CAMERA = {position: [0, 0, 5], focalPoint: [0, 0, 0], viewUp: [0, 1, 0], viewAngle: 30, parallel: false, parallelScale: 1};

/** A viewer of a square canvas, whose renderer notes for each row of its two pictures which camera drew it, and how coarsely. */
function viewerOf(/** @type {number} */ millisecondsPerPixel) {
  const side = 100;
  const gl = new Proxy({}, {get: (_, name) => /^[A-Z]/.test(String(name)) ? name : () => 1});
  /** @type {any} */
  const canvas = {width: side, height: side, clientWidth: side, clientHeight: side, getContext: () => gl, addEventListener: () => {},
                  toBlob: (/** @type {(blob: object) => void} */ take) => take({})};
  const viewer = new Viewer(canvas, () => {}, async () => undefined);
  const blank = () => Array(side).fill("");
  let drawn = 0;
  const renderer = {
    gl: {
      TIMEOUT_EXPIRED: 1, flush: () => {}, deleteSync: () => {},
      fenceSync: () => ({at: clock.now + drawn * millisecondsPerPixel}),
      clientWaitSync: (/** @type {{at: number}} */ sync) => clock.now < sync.at ? 1 : 0,
    },
    loaded: undefined, smooth: false, canShear: () => false, shown: blank(), next: blank(),
    pictureSize: (/** @type {number} */ scale) => ({width: Math.ceil(side / scale), height: Math.ceil(side / scale)}),
    drawPicture(/** @type {any} */ camera, /** @type {number} */ scale, /** @type {number} */ first, /** @type {number} */ end) {
      this.next.fill(`${camera.position[0]} at ${scale}`, first, end);
      drawn = Math.ceil(side / scale) * (end - first);
    },
    finishPicture() { [this.shown, this.next] = [this.next, this.shown]; },
    present: () => {},
  };
  viewer.renderer = /** @type {any} */ (renderer);
  viewer.cost = millisecondsPerPixel;
  let rests = 0;
  viewer.onRest = () => void ++rests;
  const look = (/** @type {number} */ x, /** @type {boolean} */ moving) => viewer.setCamera({...CAMERA, position: [x, 0, 5]}, moving);
  return {viewer, renderer, look, rests: () => rests};
}

function testRest() {
  const {viewer, look, rests} = viewerOf(1e-6);
  for (let x = 0; x < 60; ++x) {
    look(x, true);
    clock.pass(10);
  }
  check(rests() === 0, `a view that moves doesn't rest: ${rests()} times`);
  clock.pass(1000);
  check(rests() === 1, `a view rests once after a motion: ${rests()} times`);
  look(99, false);
  clock.pass(40);
  check(rests() === 2 && viewer.isWhole(), "a view that jumps rests at once");

  // A motion that ends in strips, because its pictures became too slow for the whole canvas meanwhile.
  const slow = viewerOf(1e-6);
  slow.look(0, true);
  clock.pass(100);
  slow.viewer.cost = 0.01;
  for (let x = 1; x < 20; ++x) {
    slow.look(x, true);
    clock.pass(20);
  }
  check(slow.rests() === 0, `a slow view that moves doesn't rest: ${slow.rests()} times`);
  clock.pass(2000);
  check(slow.viewer.isWhole() && slow.rests() === 1, `a slow view rests, too: ${slow.rests()} times`);
}

async function testScreenshot() {
  const {viewer, renderer, look, rests} = viewerOf(0.01);
  look(7, false);
  while (viewer.nextRow === 0) clock.pass(1);
  check(viewer.nextRow < 100 && renderer.shown[0] !== "7 at 1", "a picture is drawn in strips");
  await viewer.screenshot();
  const isWhole = () => renderer.shown.every((row) => row === "7 at 1");
  check(isWhole(), "a screenshot shows the whole picture");
  check(viewer.missing === "nothing" && rests() === 1, "which is one at rest");
  clock.pass(2000);
  check(isWhole(), `it stays, and no strips are put into an older one: ${new Set(renderer.shown).size} kinds of rows`);
  check(rests() === 1, `and the view rests once: ${rests()} times`);
}

testRest();
await testScreenshot();
console.log(failures === 0 ? "all well" : `${failures} failures`);
process.exit(failures === 0 ? 0 : 1);
