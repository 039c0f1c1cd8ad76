// Files that the page carries, compressed, as text.

import { byId } from "./elements.js";

/** Unpacks a file of the page, by its name: a Uint8Array. */
export async function unpackBlob(name) {
  const packed = Uint8Array.from(atob(byId(`blob-${name}`).textContent.trim()), (c) =>
    c.charCodeAt(0),
  );
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** The same of a text. */
export async function unpackText(name) {
  return new TextDecoder().decode(await unpackBlob(name));
}

/** Offers a text to the user as a file. */
export function saveText(name, text) {
  const address = URL.createObjectURL(new Blob([text], { type: "text/csv" }));
  const link = document.createElement("a");
  link.href = address;
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(address), 1000);
}
