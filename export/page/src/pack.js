// The map out of the page: base64 of deflated bytes, which ../../web/page_writer.h describes.

const TYPES = {
  f64: Float64Array,
  f32: Float32Array,
  i32: Int32Array,
  u16: Uint16Array,
  u8: Uint8Array,
};

function bytesOfBase64(text) {
  const STEP = 1 << 20; // characters; a multiple of 4
  const bytes = new Uint8Array(Math.floor((text.length / 4) * 3));
  let length = 0;
  for (let from = 0; from < text.length; from += STEP) {
    const part = atob(text.slice(from, from + STEP));
    for (let i = 0; i < part.length; i++) bytes[length++] = part.charCodeAt(i);
  }
  return bytes.subarray(0, length);
}

async function inflate(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Response(stream).arrayBuffer();
}

// Returns the document, and its arrays by name.
export async function unpack(base64) {
  const buffer = await inflate(bytesOfBase64(base64));
  const length = new DataView(buffer).getUint32(0, true);
  const document = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const arrays = {};
  for (const [name, { type, offset, count }] of Object.entries(document.arrays)) {
    arrays[name] = new TYPES[type](buffer, 4 + length + offset, count);
  }
  return { document, arrays };
}

// The standard deviation in metres of a code of ../../web/page_data.h.
export function sigmaOfCode(code) {
  return 1e-4 * 2 ** (code / 16);
}
