// SPDX-License-Identifier: Apache-2.0
// Lights and pictures on the wire (host/src/viewer/service.hpp).

const kGap = 8; // dark pixels that end a run: a run takes 8 bytes, a pixel 2

const float_box = new Float32Array(1), bits_box = new Uint32Array(float_box.buffer);

/** The bits of the nearest binary16, ties to even; the largest finite one for larger values. */
export function half_bits(value) {
  float_box[0] = value;
  const sign = (bits_box[0] >>> 16) & 0x8000, size = bits_box[0] & 0x7fffffff;
  if (size >= 0x477ff000) return sign | 0x7bff;
  if (size < 0x38800000) {
    float_box[0] = Math.abs(value) + 0.5; // its last bit is worth 2^-24
    return sign | (bits_box[0] - 0x3f000000);
  }
  return sign | ((size + 0xfff + ((size >>> 13) & 1) - 0x38000000) >>> 13);
}

/** [first, length] of the parts of a plane that are lit. */
function lit_runs(plane) {
  const runs = [];
  let first = -1, last = -1;
  for (let k = 0; k < plane.length; ++k) {
    if (plane[k] === 0) continue;
    if (first < 0 || k - last > kGap) {
      if (first >= 0) runs.push([first, last + 1 - first]);
      first = k;
    }
    last = k;
  }
  if (first >= 0) runs.push([first, last + 1 - first]);
  return runs;
}

export function encode_light(planes) {
  const runs = planes.map(lit_runs);
  const lit = runs.map((one) => one.reduce((sum, [, length]) => sum + length, 0));
  const words = 1 + runs.reduce((sum, one, p) => sum + 1 + 2 * one.length + Math.ceil(lit[p] / 2), 0);
  const numbers = new Uint32Array(words), halves = new Uint16Array(numbers.buffer);
  let at = 0;
  numbers[at++] = planes.length;
  planes.forEach((plane, p) => {
    numbers[at++] = runs[p].length;
    for (const [first, length] of runs[p]) { numbers[at++] = first; numbers[at++] = length; }
    let to = 2 * at;
    for (const [first, length] of runs[p]) for (let k = first; k < first + length; ++k) halves[to++] = half_bits(plane[k]);
    at += Math.ceil(lit[p] / 2);
  });
  return numbers;
}

let half_values = null;
/** The value of each binary16. */
function values_of_halves() {
  half_values ??= Float32Array.from({ length: 65536 }, (_, bits) => {
    const exponent = (bits >> 10) & 31, fraction = bits & 1023;
    const size = exponent === 0 ? fraction * 2 ** -24 : (1 + fraction / 1024) * 2 ** (exponent - 15);
    return bits & 0x8000 ? -size : size;
  });
  return half_values;
}

/** Reads planes of a reply one after the other. */
export class Planes {
  constructor(buffer) {
    this.buffer = buffer;
    this.at = 0;
  }
  next(pixels) {
    const scale = 2 ** new Int32Array(this.buffer, this.at, 1)[0];
    const halves = new Uint16Array(this.buffer, this.at + 4, pixels), values = values_of_halves();
    const plane = new Float32Array(pixels);
    for (let k = 0; k < pixels; ++k) plane[k] = scale * values[halves[k]];
    this.at += 4 + 2 * (pixels + (pixels % 2));
    return plane;
  }
  all(pixels) {
    const planes = [];
    while (this.at < this.buffer.byteLength) planes.push(this.next(pixels));
    return planes;
  }
}

export function split_planes(values, pixels) {
  const planes = [];
  for (let at = 0; at < values.length; at += pixels) planes.push(values.subarray(at, at + pixels));
  return planes;
}
