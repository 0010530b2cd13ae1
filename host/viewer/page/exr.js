// SPDX-License-Identifier: Apache-2.0
// Writes OpenEXR 2 files: 32-bit floats in scan lines, not compressed. source: "OpenEXR File Layout", openexr.com.

/** planes: 1 (Y) or 3 (R, G, B) of rows × cols values. facts: texts and numbers by the name of their attribute (docs/images.md). */
export function exr_bytes(planes, rows, cols, facts = {}) {
  // Channels stand in the order of their names.
  const channels = planes.length === 1 ? [["Y", planes[0]]] : [["B", planes[2]], ["G", planes[1]], ["R", planes[0]]];
  const head = exr_head(channels.map(([name]) => name), rows, cols, facts);
  const line = 4 * cols * channels.length, block = 8 + line;
  const start = head.length + 8 * rows;
  const bytes = new Uint8Array(start + rows * block), view = new DataView(bytes.buffer);
  bytes.set(head);
  for (let row = 0; row < rows; ++row) {
    const at = start + row * block;
    view.setBigUint64(head.length + 8 * row, BigInt(at), true);
    view.setInt32(at, row, true);
    view.setInt32(at + 4, line, true);
    channels.forEach(([, plane], c) => {
      for (let col = 0; col < cols; ++col) view.setFloat32(at + 8 + 4 * (c * cols + col), plane[row * cols + col], true);
    });
  }
  return bytes;
}

function exr_head(names, rows, cols, facts) {
  const out = [];
  const u32 = (...values) => values.forEach((v) => out.push(v & 255, (v >> 8) & 255, (v >> 16) & 255, (v >>> 24) & 255));
  const text = (value) => out.push(...new TextEncoder().encode(value), 0);
  const attribute = (name, type, size) => { text(name); text(type); u32(size); };
  const kOne = 0x3f800000; // 1.0 as bits
  u32(20000630, 2); // magic number, version 2
  attribute("channels", "chlist", 18 * names.length + 1);
  for (const name of names) { text(name); u32(2, 0, 1, 1); } // 32-bit float, not perceptually linear, no subsampling
  out.push(0);
  attribute("compression", "compression", 1);
  out.push(0); // none
  attribute("dataWindow", "box2i", 16);
  u32(0, 0, cols - 1, rows - 1);
  attribute("displayWindow", "box2i", 16);
  u32(0, 0, cols - 1, rows - 1);
  attribute("lineOrder", "lineOrder", 1);
  out.push(0); // rows from the top
  attribute("pixelAspectRatio", "float", 4);
  u32(kOne);
  attribute("screenWindowCenter", "v2f", 8);
  u32(0, 0);
  attribute("screenWindowWidth", "float", 4);
  u32(kOne);
  for (const [name, value] of Object.entries(facts)) {
    const bytes = typeof value === "number" ? new Uint8Array(Float32Array.of(value).buffer) : new TextEncoder().encode(value);
    attribute(name, typeof value === "number" ? "float" : "string", bytes.length);
    out.push(...bytes);
  }
  out.push(0);
  return out;
}
