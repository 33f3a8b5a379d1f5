// Saves what the page shows as a file: a picture of any size, or bytes that something else has made.

/** @typedef {import("./viewer.js").Viewer} Viewer */

const STRIP_PIXELS = 1 << 20;

/** @param {HTMLCanvasElement} canvas @returns {Promise<Blob>} */
function pngOf(canvas) {
  return new Promise((resolve, reject) => {
    canvas.toBlob((blob) => blob ? resolve(blob) : reject(new Error("the browser can't save the picture as PNG")), "image/png");
  });
}

/**
 * The picture on show as PNG.
 * @param {Viewer} viewer
 * @param {[number, number]} [size] in pixels; the canvas' without it
 * @param {boolean} [isTransparent] leaves the background out
 * @returns {Promise<Blob>}
 */
export function pictureOf(viewer, size, isTransparent = false) {
  const {renderer, canvas, camera} = viewer;
  if (!camera) return Promise.reject(new Error("there is no picture yet"));
  if (viewer.isLost) return Promise.reject(new Error("the graphics driver has lost the picture"));
  const former = [canvas.width, canvas.height], {framing} = renderer;
  const [width, height] = size ?? former;
  const [mostWidth, mostHeight] = renderer.most;
  if (width > mostWidth || height > mostHeight)
    return Promise.reject(new Error(`this GPU draws pictures of at most ${mostWidth} × ${mostHeight} pixels`));
  const isOther = width !== former[0] || height !== former[1];
  if (isOther) {
    [canvas.width, canvas.height] = [width, height];
    renderer.framing = undefined;  // no panels cover such a picture
  }
  const rows = Math.max(1, Math.floor(STRIP_PIXELS / width));
  for (let row = 0; row < height; row += rows)
    renderer.drawPicture(camera, 1, row, Math.min(row + rows, height), renderer.canShear());
  renderer.finishPicture();
  viewer.refresh();
  let png;
  if (isTransparent) {
    const flat = document.createElement("canvas");
    [flat.width, flat.height] = [width, height];
    const pixels = renderer.transparentPixels(camera, viewer.outline ? viewer.outlineColor : undefined);
    flat.getContext("2d")?.putImageData(new ImageData(pixels, width, height), 0, 0);
    png = pngOf(flat);
  } else {
    png = pngOf(canvas);  // copies the canvas before it returns
  }
  viewer.onPicture(isOther);
  if (isOther) {
    [canvas.width, canvas.height] = former;
    renderer.framing = framing;
    viewer.redraw();
  }
  return png;
}

/**
 * Lets the browser save a file, named after the page.
 * @param {Blob} blob
 * @param {string} extension
 */
export function save(blob, extension) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = `${(document.title || "vdi").replace(/[^\w.-]+/g, "_")}.${extension}`;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}
