// Files in a ZIP archive, which an FMU is, read from memory.

const END = 0x06054b50;
const ENTRY = 0x02014b50;
const [STORED, DEFLATED] = [0, 8];
const END_SIZE = 22;
const LONGEST_COMMENT = 65535;

/** Where each file of an archive lies: a Map from its name to { method, size, at }. */
export function entriesOf(bytes) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  let end = bytes.length - END_SIZE;
  while (end >= 0 && view.getUint32(end, true) !== END) {
    end = end > bytes.length - END_SIZE - LONGEST_COMMENT ? end - 1 : -1;
  }
  if (end < 0) {
    throw new Error("it is no ZIP archive, which every FMU is");
  }
  const found = new Map();
  let at = view.getUint32(end + 16, true);
  for (let left = view.getUint16(end + 10, true); left > 0; left -= 1) {
    if (view.getUint32(at, true) !== ENTRY) {
      throw new Error("the list of its files is damaged");
    }
    const lengths = [28, 30, 32].map((place) => view.getUint16(at + place, true));
    const name = new TextDecoder().decode(bytes.subarray(at + 46, at + 46 + lengths[0]));
    found.set(name, {
      method: view.getUint16(at + 10, true),
      size: view.getUint32(at + 20, true),
      at: view.getUint32(at + 42, true),
    });
    at += 46 + lengths[0] + lengths[1] + lengths[2];
  }
  return found;
}

/** The bytes of a file of an archive. */
export async function unzip(bytes, { method, size, at }) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const begin = at + 30 + view.getUint16(at + 26, true) + view.getUint16(at + 28, true);
  const packed = bytes.subarray(begin, begin + size);
  if (method === STORED) {
    return packed;
  }
  if (method !== DEFLATED) {
    throw new Error(`it is compressed by method ${method}; expected ${STORED} or ${DEFLATED}`);
  }
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}
