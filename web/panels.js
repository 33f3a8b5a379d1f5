// The panels above the bar. One is open at a time. On a phone the picture moves above the open one.

/**
 * @param {HTMLDetailsElement[]} panels
 * @param {() => void} onChange called when the picture's place may have changed
 */
export function addPanels(panels, onChange) {
  const makeRoom = () => {
    const open = panels.find((panel) => panel.open && !panel.hidden);
    const top = open?.querySelector("div")?.getBoundingClientRect().top;
    document.body.style.setProperty("--covered", top === undefined ? "0px" : `${Math.round(window.innerHeight - top)}px`);
    onChange();
  };
  for (const panel of panels) {
    panel.addEventListener("toggle", () => {
      if (panel.open) for (const other of panels) if (other !== panel) other.open = false;
      makeRoom();
    });
    new ResizeObserver(makeRoom).observe(/** @type {HTMLElement} */ (panel.querySelector("div")));
  }
  window.addEventListener("resize", makeRoom);
}
