/** The numbers of a recording, which travel as text. */

/** Return the numbers that a recording holds as 16-bit counts, base64 and little-endian. */
export function numbers({ data, offset, scale }) {
  const text = atob(data);
  const size = offset.length;
  const values = new Float32Array(text.length / 2);
  for (let i = 0; i < values.length; i++) {
    const count = text.charCodeAt(2 * i) + 256 * text.charCodeAt(2 * i + 1);
    values[i] = offset[i % size] + scale[i % size] * count;
  }
  return values;
}

/** Return the numbers that a recording holds as 32-bit floats, base64 and little-endian. */
export function floats(data) {
  const bytes = Uint8Array.from(atob(data), (character) => character.charCodeAt(0));
  const view = new DataView(bytes.buffer);
  return Float32Array.from({ length: bytes.length / 4 }, (_, i) => view.getFloat32(4 * i, true));
}
