// SPDX-License-Identifier: Apache-2.0
// Lights become light planes: one number for each pixel of the projector, 0 to 1 for a light of power 1.

/** The linear red, green and blue of "#rrggbb" (IEC 61966-2-1). */
export function linear_colour(hex) {
  return [1, 3, 5].map((at) => {
    const code = parseInt(hex.slice(at, at + 2), 16) / 255;
    return code <= 0.04045 ? code / 12.92 : ((code + 0.055) / 1.055) ** 2.4;
  });
}

/** [plane] for white light, [red, green, blue] for coloured light. grid: [rows, cols]; tile: the part that shines. */
export function light_planes(lights, grid, tile) {
  const pixels = grid[0] * grid[1];
  const coloured = lights.some((light) => light.colour.toLowerCase() !== "#ffffff" || light.pixels?.coloured);
  const planes = Array.from({ length: coloured ? 3 : 1 }, () => new Float32Array(pixels));
  for (const light of lights) {
    const colour = linear_colour(light.colour);
    const masks = masks_of(light, tile.rows, tile.cols);
    planes.forEach((plane, c) => {
      const weight = light.power * (coloured ? colour[c] : 1);
      add_mask(plane, masks[masks.length === 3 ? c : 0], weight, grid[1], tile);
    });
  }
  return planes;
}

function add_mask(plane, mask, weight, cols, tile) {
  for (let row = 0; row < tile.rows; ++row) {
    const to = (tile.row + row) * cols + tile.col;
    for (let col = 0; col < tile.cols; ++col) plane[to + col] += weight * mask[row * tile.cols + col];
  }
}

/** One mask, or three for a coloured picture. */
function masks_of(light, rows, cols) {
  switch (light.kind) {
    case "flood": return [new Float32Array(rows * cols).fill(1)];
    case "spot": return [spot_mask(light, rows, cols)];
    case "bar": return [bar_mask(light, rows, cols)];
    case "brush": return [brush_mask(light, rows, cols)];
    case "text": return [text_mask(light, rows, cols)];
    default: return picture_masks(light, rows, cols);
  }
}

/** 1 inside, 0 outside, and a slope of the given width between. Distances in pixels; the slope is a pixel at least. */
function edge(inside, width) {
  const w = Math.max(width, 1);
  return Math.min(Math.max(inside / w + 0.5, 0), 1);
}

/** The longer side: sizes are shares of it. */
function side_of(rows, cols) {
  return Math.max(rows, cols);
}

/** The pixels of one axis within reach: [first, end). */
function span(centre, reach, size) {
  return [Math.max(Math.ceil(centre - reach), 0), Math.min(Math.floor(centre + reach) + 1, size)];
}

function spot_mask(light, rows, cols) {
  const mask = new Float32Array(rows * cols);
  const radius = light.size * side_of(rows, cols), slope = light.soft * radius * 2;
  const x = light.x * cols - 0.5, y = light.y * rows - 0.5;
  const reach = radius + slope / 2 + 1;
  const [top, bottom] = span(y, reach, rows), [left, right] = span(x, reach, cols);
  for (let row = top; row < bottom; ++row)
    for (let col = left; col < right; ++col)
      mask[row * cols + col] = edge(radius - Math.sqrt((col - x) * (col - x) + (row - y) * (row - y)), slope);
  return mask;
}

function bar_mask(light, rows, cols) {
  const mask = new Float32Array(rows * cols);
  const half = (light.size * side_of(rows, cols)) / 2, slope = light.soft * half * 2;
  const angle = (light.angle * Math.PI) / 180, nx = Math.cos(angle), ny = Math.sin(angle);
  const x = light.x * cols - 0.5, y = light.y * rows - 0.5;
  for (let row = 0; row < rows; ++row)
    for (let col = 0; col < cols; ++col)
      mask[row * cols + col] = edge(half - Math.abs((col - x) * nx + (row - y) * ny), slope);
  return mask;
}

/** Strokes are polylines: each pixel takes the brightest dab. */
function brush_mask(light, rows, cols) {
  const mask = new Float32Array(rows * cols);
  const radius = Math.max(light.size * side_of(rows, cols), 0.5), slope = light.soft * radius * 2;
  const reach = radius + slope / 2 + 1;
  for (const stroke of light.strokes)
    for (let k = 0; k < stroke.length; ++k) {
      const [x1, y1] = stroke[k], [x0, y0] = stroke[Math.max(k - 1, 0)];
      stamp(mask, rows, cols, [x0 * cols - 0.5, y0 * rows - 0.5, x1 * cols - 0.5, y1 * rows - 0.5], radius, slope, reach);
    }
  return mask;
}

function stamp(mask, rows, cols, [x0, y0, x1, y1], radius, slope, reach) {
  const dx = x1 - x0, dy = y1 - y0, length = dx * dx + dy * dy;
  const top = Math.max(Math.ceil(Math.min(y0, y1) - reach), 0), bottom = Math.min(Math.floor(Math.max(y0, y1) + reach), rows - 1);
  const left = Math.max(Math.ceil(Math.min(x0, x1) - reach), 0), right = Math.min(Math.floor(Math.max(x0, x1) + reach), cols - 1);
  for (let row = top; row <= bottom; ++row)
    for (let col = left; col <= right; ++col) {
      const t = length > 0 ? Math.min(Math.max(((col - x0) * dx + (row - y0) * dy) / length, 0), 1) : 0;
      const value = edge(radius - Math.hypot(col - x0 - t * dx, row - y0 - t * dy), slope);
      if (value > mask[row * cols + col]) mask[row * cols + col] = value;
    }
}

function text_mask(light, rows, cols) {
  const context = canvas_context(rows, cols);
  context.translate(light.x * cols, light.y * rows);
  context.rotate((light.angle * Math.PI) / 180);
  context.fillStyle = "#fff";
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.font = `bold ${light.size * side_of(rows, cols)}px sans-serif`;
  context.fillText(light.text, 0, 0);
  return channel_of(context, rows, cols, 3);
}

function canvas_context(rows, cols) {
  const canvas = document.createElement("canvas");
  canvas.width = cols;
  canvas.height = rows;
  return canvas.getContext("2d", { willReadFrequently: true });
}

/** One channel of a canvas, code / 255: pictures are linear light, as for `symrig relight`. */
function channel_of(context, rows, cols, channel) {
  const codes = context.getImageData(0, 0, cols, rows).data;
  const mask = new Float32Array(rows * cols);
  for (let k = 0; k < mask.length; ++k) mask[k] = codes[4 * k + channel] / 255;
  return mask;
}

/** A picture of the projector's size in the middle keeps its pixels. Others are scaled to fit. */
function picture_masks(light, rows, cols) {
  if (!light.pixels) return [new Float32Array(rows * cols)];
  const { image, coloured } = light.pixels;
  const scale = light.size * Math.min(cols / image.width, rows / image.height);
  const context = canvas_context(rows, cols);
  const wide = image.width * scale, high = image.height * scale;
  context.imageSmoothingQuality = "high";
  context.drawImage(image, Math.round(light.x * cols - wide / 2), Math.round(light.y * rows - high / 2), wide, high);
  return (coloured ? [0, 1, 2] : [0]).map((channel) => channel_of(context, rows, cols, channel));
}

/** Decodes a picture file. Codes stay as stored: no colour profile, no alpha. fails: not a picture. */
export async function read_picture(file) {
  const image = await createImageBitmap(file, { colorSpaceConversion: "none", premultiplyAlpha: "none" });
  const context = canvas_context(image.height, image.width);
  context.drawImage(image, 0, 0);
  const codes = context.getImageData(0, 0, image.width, image.height).data;
  let coloured = false;
  for (let k = 0; k < codes.length && !coloured; k += 4) coloured = codes[k] !== codes[k + 1] || codes[k] !== codes[k + 2];
  return { image, coloured };
}
