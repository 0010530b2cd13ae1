// SPDX-License-Identifier: Apache-2.0
// The pictures on the page: painting them, and reading the pointer and the keys over them.
import { scale_colour } from "./leaves.js";

const kNear = 0.06; // share of the picture: a light this near to the pointer is taken hold of

/** A canvas with one pixel for each pixel of a picture. fill(codes) writes its RGBA codes. frame: the grid whose shape it has. */
export function paint_canvas(canvas, rows, cols, fill, frame = [rows, cols]) {
  if (canvas.width !== cols || canvas.height !== rows) {
    canvas.width = cols;
    canvas.height = rows;
    const { style } = canvas.parentElement, [high, wide] = frame;
    style.aspectRatio = `${wide} / ${high}`;
    style.maxWidth = `calc(var(--tallest) * ${(wide / high).toFixed(4)})`;
  }
  const context = canvas.getContext("2d");
  const image = context.createImageData(cols, rows);
  fill(image.data);
  context.putImageData(image, 0, 0);
}

/** Calls handlers.point(phase, [x, y], event) with "down", "move", "up" or "hover", and handlers.key(event). */
export function watch_pointer(canvas, handlers) {
  let held = false;
  const place = (event) => {
    const box = canvas.getBoundingClientRect();
    const share = (at, from, size) => Math.min(Math.max((at - from) / size, 0), 1);
    return [share(event.clientX, box.left, box.width), share(event.clientY, box.top, box.height)];
  };
  canvas.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    held = true;
    canvas.setPointerCapture(event.pointerId);
    handlers.point("down", place(event), event);
  });
  canvas.addEventListener("pointermove", (event) => handlers.point(held ? "move" : "hover", place(event), event));
  for (const name of ["pointerup", "pointercancel"])
    canvas.addEventListener(name, (event) => {
      if (held) handlers.point("up", place(event), event);
      held = false;
    });
  canvas.addEventListener("keydown", (event) => handlers.key(event));
}

/** The light nearest to a place, or -1. */
export function nearest_light(lights, [x, y]) {
  let best = -1, least = kNear;
  lights.forEach((light, k) => {
    const distance = Math.hypot(light.x - x, light.y - y);
    if (has_place(light) && distance < least) [best, least] = [k, distance];
  });
  return best;
}

export function has_place(light) {
  return ["spot", "bar", "text", "picture"].includes(light.kind);
}

/** Draws over the picture: leaves, lights, the chosen pixel, the drawn path. */
export function draw_overlay(canvas, { lights, chosen, pixel, leaves, path, path_closed }) {
  const box = canvas.parentElement.getBoundingClientRect(), density = window.devicePixelRatio || 1;
  canvas.width = Math.max(Math.round(box.width * density), 1);
  canvas.height = Math.max(Math.round(box.height * density), 1);
  const context = canvas.getContext("2d");
  if (leaves) draw_leaves(context, canvas, leaves);
  context.scale(density, density);
  if (path.length > 1) draw_path(context, box, path, path_closed);
  lights.forEach((light, k) => { if (has_place(light)) draw_handle(context, box, light, k === chosen); });
  if (pixel) draw_cross(context, box, pixel);
}

/** affine: where the cells lie on the picture (places.js). */
function draw_leaves(context, canvas, { rows, cols, codes, affine: [a, b, e, c, d, f] }) {
  const small = document.createElement("canvas");
  small.width = cols;
  small.height = rows;
  small.getContext("2d").putImageData(new ImageData(codes, cols, rows), 0, 0);
  context.imageSmoothingEnabled = false;
  context.setTransform(a * canvas.width, c * canvas.height, b * canvas.width, d * canvas.height, e * canvas.width, f * canvas.height);
  context.drawImage(small, 0, 0, 1, 1);
  context.resetTransform();
}

function outlined(context, draw, width = 2) {
  for (const [colour, wide] of [["rgba(0,0,0,0.75)", width + 2], ["#ffffff", width]]) {
    context.beginPath();
    context.strokeStyle = colour;
    context.lineWidth = wide;
    draw();
    context.stroke();
  }
}

function draw_path(context, box, points, closed) {
  outlined(context, () => {
    points.forEach(([x, y], k) => context[k === 0 ? "moveTo" : "lineTo"](x * box.width, y * box.height));
    if (closed) context.closePath();
  }, 1);
}

function draw_handle(context, box, light, is_chosen) {
  const x = light.x * box.width, y = light.y * box.height;
  if (light.kind === "bar") {
    const angle = ((light.angle + 90) * Math.PI) / 180, dx = 22 * Math.cos(angle), dy = 22 * Math.sin(angle);
    outlined(context, () => { context.moveTo(x - dx, y - dy); context.lineTo(x + dx, y + dy); }, 1.5);
  }
  outlined(context, () => context.arc(x, y, is_chosen ? 9 : 6, 0, 2 * Math.PI), is_chosen ? 2.5 : 1.5);
  context.fillStyle = light.colour;
  context.beginPath();
  context.arc(x, y, 3, 0, 2 * Math.PI);
  context.fill();
}

function draw_cross(context, box, [x, y]) {
  const px = x * box.width, py = y * box.height;
  outlined(context, () => {
    for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
      context.moveTo(px + 5 * dx, py + 5 * dy);
      context.lineTo(px + 13 * dx, py + 13 * dy);
    }
  }, 1.5);
}

/** RGBA codes of a map of levels or ranks; 0 alpha where no leaf is. Also the legend: [[text, colour]]. */
export function leaf_codes(map, what, levels) {
  const values = what === "levels" ? map.level : map.rank;
  const most = what === "levels" ? levels - 1 : values.reduce((a, b) => Math.max(a, b), 1);
  const codes = new Uint8ClampedArray(4 * values.length);
  for (let k = 0; k < values.length; ++k) {
    if (map.level[k] < 0) continue;
    const t = what === "levels" ? values[k] : values[k] - 1;
    codes.set([...scale_colour(t, what === "levels" ? most + 1 : most), 150], 4 * k);
  }
  const legend = [];
  const first = what === "levels" ? 0 : 1, step = Math.max(Math.ceil((most - first + 1) / 8), 1);
  for (let v = first; v <= most; v += step)
    legend.push([`${what === "levels" ? "level" : "rank"} ${v}`, scale_colour(v - first, most - first + 1)]);
  return { codes, legend };
}
