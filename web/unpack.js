// Unpacks the data that `vdi export` puts into a page: deflate data as base64.

import {FormatError} from "./format.js";

/** @param {string} text base64 @returns {Uint8Array} */
function bytesOfBase64(text) {
  let binary;
  try {
    binary = atob(text);
  } catch (cause) {
    throw new FormatError("this page's data are damaged: they aren't base64", {cause});
  }
  const bytes = new Uint8Array(binary.length);
  for (let i = 0; i < bytes.length; ++i) bytes[i] = binary.charCodeAt(i);
  return bytes;
}

const MOST_INFLATED = 1032;  // most bytes to which a byte of deflate data expands

/**
 * Expands packed data to at most `size` bytes.
 * @param {string} text
 * @param {number} size
 */
export async function unpack(text, size) {
  const packed = bytesOfBase64(text);
  if (typeof DecompressionStream === "undefined")
    throw new Error("this browser is too old to unpack the data (no DecompressionStream)");
  if (!(size > 0 && size <= packed.length * MOST_INFLATED))
    throw new FormatError("the data in this page are damaged: they have the wrong size");
  const bytes = new Uint8Array(size);
  let at = 0;
  try {
    // WebKit's workers can't read a Blob's stream.
    const body = new Response(/** @type {BodyInit} */ (packed)).body;
    if (!body) throw new Error("the browser gives no stream");
    const reader = body.pipeThrough(new DecompressionStream("deflate-raw")).getReader();
    for (let part = await reader.read(); !part.done; part = await reader.read()) {
      bytes.set(part.value, at);  // throws if the part doesn't fit
      at += part.value.length;
    }
  } catch (cause) {
    throw new FormatError(`this page's data are damaged, or this browser can't unpack them (${cause})`, {cause});
  }
  if (at !== size) throw new FormatError("this page's data are damaged: they end too early");
  return bytes;
}
