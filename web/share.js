// The dialog with a link to the view on show. It leaves the server's token out unless the user adds it.

/** @param {string} id */
const shareElement = (id) => /** @type {HTMLElement} */ (document.getElementById(id));

/**
 * @param {() => string} viewText the fragment that describes the view, without "#"
 * @param {() => string} tokenText the server's token; empty without a server
 */
export function addSharing(viewText, tokenText) {
  const dialog = /** @type {HTMLDialogElement} */ (shareElement("share"));
  const field = /** @type {HTMLInputElement} */ (shareElement("sharelink"));
  const withToken = /** @type {HTMLInputElement} */ (shareElement("sharetoken"));
  const show = () => {
    const token = withToken.checked && tokenText() !== "" ? [`token=${tokenText()}`] : [];
    const fragment = [...token, viewText()].filter(Boolean).join("&");
    field.value = location.href.split("#")[0] + (fragment ? `#${fragment}` : "");
    shareElement("copied").textContent = "";
  };
  shareElement("link").addEventListener("click", () => {
    withToken.checked = false;
    shareElement("askfortoken").hidden = tokenText() === "";
    show();
    dialog.showModal();
    field.select();
  });
  withToken.addEventListener("change", show);
  dialog.addEventListener("close", () => field.value = "");  // no token stays in the page
  shareElement("copy").addEventListener("click", async () => {
    field.select();
    try {
      await navigator.clipboard.writeText(field.value);
      shareElement("copied").textContent = "Copied";
    } catch {  // no clipboard for pages over plain HTTP
      shareElement("copied").textContent = document.execCommand("copy") ? "Copied" : "Press Ctrl+C to copy the selected link";
    }
  });
}
