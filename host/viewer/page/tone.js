// SPDX-License-Identifier: Apache-2.0
// Radiance becomes colours of the screen.

const kSteps = 65535; // of the table: its step is 0.05 codes of sRGB where the curve is steepest

export const kCurves = {
  srgb: ["sRGB (as relight)", (v) => (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055)],
  linear: ["Linear", (v) => v],
  shadows: ["Lifted (cube root)", (v) => Math.cbrt(v)],
  log: ["Log, 4 decades", (v) => Math.max(1 + Math.log10(Math.max(v, 1e-9)) / 4, 0)],
};

/** Green's cubehelix: its luminance rises evenly. source: D. A. Green, Bull. Astr. Soc. India 39 (2011) 289, eq. 2 */
function cubehelix(v) {
  const angle = 2 * Math.PI * (0.5 / 3 + 1 - 1.5 * v), amplitude = (1.2 * v * (1 - v)) / 2;
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  return [v + amplitude * (-0.14861 * c + 1.78277 * s), v + amplitude * (-0.29227 * c - 0.90649 * s), v + amplitude * 1.97294 * c];
}

/** Negative blue, zero the grey of the middle, positive orange; v in -1..1. */
function signed_colour(v) {
  const end = v < 0 ? [0.1, 0.45, 1] : [1, 0.5, 0.05], t = Math.abs(v);
  return end.map((e) => 0.16 * (1 - t) + e * t);
}

function clip_code(v) {
  return Math.min(Math.max(Math.round(255 * v), 0), 255);
}

/** The curve as codes for 0 .. 1 in kSteps steps. */
function curve_table(name) {
  const curve = kCurves[name][1];
  return Uint8Array.from({ length: kSteps + 1 }, (_, k) => clip_code(curve(k / kSteps)));
}

const tables = new Map();
function table_of(name) {
  if (!tables.has(name)) tables.set(name, curve_table(name));
  return tables.get(name);
}
let helix = null;
function helix_codes() {
  helix ??= Array.from({ length: 256 }, (_, k) => cubehelix(k / 255).map(clip_code));
  return helix;
}

/** Fills RGBA codes. planes: 1 or 3 of `size` values; colours: "grey" or "false". */
export function paint_picture(codes, planes, exposure, curve, colours) {
  const table = table_of(curve in kCurves ? curve : "srgb"), scale = exposure * kSteps;
  const code = (v) => {
    const at = v * scale;
    return table[at > 0 ? (at < kSteps ? (at + 0.5) | 0 : kSteps) : 0];
  };
  const [red, green, blue] = planes.length === 3 ? planes : [planes[0], planes[0], planes[0]];
  const size = red.length, pixels = new Uint32Array(codes.buffer, codes.byteOffset, size);
  if (colours === "false") {
    const palette = helix_codes();
    for (let k = 0; k < size; ++k) set_code(codes, k, palette[code(luminance(red[k], green[k], blue[k]))]);
    return;
  }
  // One number for each pixel: alpha, blue, green, red, from its highest byte.
  if (planes.length === 1) for (let k = 0; k < size; ++k) pixels[k] = 0xff000000 | (code(red[k]) * 0x010101);
  else for (let k = 0; k < size; ++k) pixels[k] = 0xff000000 | (code(blue[k]) << 16) | (code(green[k]) << 8) | code(red[k]);
}

/** Rec. 709. */
function luminance(red, green, blue) {
  return 0.2126 * red + 0.7152 * green + 0.0722 * blue;
}

function set_code(codes, k, [red, green, blue]) {
  codes[4 * k] = red;
  codes[4 * k + 1] = green;
  codes[4 * k + 2] = blue;
  codes[4 * k + 3] = 255;
}

/** Fills RGBA codes with gain · exposure · (a − b), luminance. */
export function paint_difference(codes, a, b, scale) {
  const value = (planes, k) => (planes.length === 1 ? planes[0][k] : luminance(planes[0][k], planes[1][k], planes[2][k]));
  for (let k = 0; k < a[0].length; ++k) {
    const v = Math.min(Math.max(scale * (value(a, k) - value(b, k)), -1), 1);
    set_code(codes, k, signed_colour(v).map(clip_code));
  }
}

/** The factor that maps all values but the brightest half percent below white, as `symrig relight` chooses it. */
export function automatic_exposure(planes) {
  const values = new Float32Array(planes.reduce((sum, plane) => sum + plane.length, 0));
  planes.reduce((at, plane) => (values.set(plane, at), at + plane.length), 0);
  values.sort();
  const white = values[Math.floor(0.995 * (values.length - 1))];
  return white > 0 ? 1 / white : 1;
}

/** ‖a − b‖ / ‖b‖ over all values. */
export function relative_difference(a, b) {
  let difference = 0, size = 0;
  b.forEach((plane, c) => {
    const other = a[a.length === 1 ? 0 : c];
    for (let k = 0; k < plane.length; ++k) {
      difference += (other[k] - plane[k]) ** 2;
      size += plane[k] ** 2;
    }
  });
  return size > 0 ? Math.sqrt(difference / size) : null;
}
