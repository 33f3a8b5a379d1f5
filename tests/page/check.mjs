// Shared by the page's tests that Node runs.

let failures = 0;

export function check(/** @type {boolean} */ holds, /** @type {string} */ what) {
  if (holds) return;
  console.log(`FAILED  ${what}`);
  ++failures;
}

/** Random numbers below a bound: the same in each run with the same VDI_FUZZ_SEED. */
export function randomFrom(/** @type {number} */ start) {
  let state = start + Number(process.env.VDI_FUZZ_SEED ?? 1);
  return (/** @type {number} */ below) => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return Math.floor(state / 0x100000000 * below);
  };
}

/** Ends the program. */
export function finish() {
  console.log(failures === 0 ? "all well" : `${failures} failures`);
  process.exit(failures === 0 ? 0 : 1);
}
