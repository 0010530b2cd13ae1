// SPDX-License-Identifier: Apache-2.0
import { ask } from "./engine.js";
import { split_planes } from "./light_code.js";

// Relights in the page: the tensor lies in the memory of a WebAssembly module (host/viewer/kernel).

const kPage = 65536; // bytes of a page of WebAssembly memory

function bytes_of(id) {
  const element = document.getElementById(id);
  const text = atob(element.textContent.trim());
  element.textContent = ""; // frees the text, which is larger than the bytes
  const bytes = new Uint8Array(text.length);
  for (let k = 0; k < text.length; ++k) bytes[k] = text.charCodeAt(k);
  return bytes;
}

/** Memory of the module, handed out once and never returned. */
class Arena {
  constructor(module) {
    this.memory = module.memory;
    this.next = module.__heap_base.value;
  }
  take(bytes) {
    const at = (this.next + 63) & ~63;
    this.next = at + bytes;
    const missing = this.next - this.memory.buffer.byteLength;
    if (missing > 0) this.memory.grow(Math.ceil(missing / kPage));
    return at;
  }
  copy(values) {
    const at = this.take(values.byteLength);
    new Uint8Array(this.memory.buffer, at, values.byteLength).set(new Uint8Array(values.buffer, values.byteOffset, values.byteLength));
    return at;
  }
  floats(at, count) {
    return new Float32Array(this.memory.buffer, at, count);
  }
}

/** The bytes of an exported page are in the page; those of a served one come from its server. */
async function part(facts, name) {
  return facts.engine === "kernel" ? bytes_of(`${name}-bytes`) : new Uint8Array(await ask(name));
}

/** facts: as in page_text.cpp. */
export async function kernel_engine(facts) {
  const { instance } = await WebAssembly.instantiate(await part(facts, "kernel"), {});
  const pack = await part(facts, "pack");
  const section = (name, Type) => {
    const [at, count] = facts.sections[name] ?? [0, 0];
    return new Type(pack.buffer, at, count);
  };
  return new KernelEngine(instance.exports, section, facts);
}

class KernelEngine {
  constructor(kernel, section, facts) {
    this.kernel = kernel;
    this.facts = facts;
    this.arena = new Arena(kernel);
    this.channels = facts.channels;
    this.sides = this.read_sides(section);
    this.read_leaves(section);
    this.diagonal = this.copied(section("diagonal", Float32Array));
    this.read_entries(section);
    this.read_bands(section);
    this.read_columns(section);
    this.read_held_out(section);
    const most = Math.max(...this.sides.map((side) => side.order.length));
    const space = () => this.arena.take(4 * (most + 1));
    Object.assign(this, { p: space(), y: space(), lit: space(), p_raster: space(), y_raster: space() });
  }

  /** [camera, projector] */
  read_sides(section) {
    const areas = (name) => (this.facts.sections[name] ? section(name, Float32Array) : null);
    const camera = { order: section("cameraOrder", Int32Array), areas: areas("cameraAreas") };
    if (this.facts.symmetric) return [camera, camera];
    return [camera, { order: section("projectorOrder", Int32Array), areas: areas("projectorAreas") }];
  }

  /** The place of a copy in the kernel's memory, or 0 of nothing. */
  copied(values) {
    return values.length > 0 ? this.arena.copy(values) : 0;
  }

  /** Widens runs of equal length to floats. */
  widened(halves, exponents) {
    if (halves.length === 0) return 0;
    const out = this.arena.take(4 * halves.length), from = this.scratch(halves), run = halves.length / exponents.length;
    exponents.forEach((exponent, k) => this.kernel.widen(from + 2 * k * run, out + 4 * k * run, run, exponent));
    return out;
  }

  /** A copy behind all that is kept: the next one may overwrite it. */
  scratch(values) {
    const kept = this.arena.next;
    const at = this.arena.copy(values);
    this.arena.next = kept;
    return at;
  }

  read_leaves(section) {
    this.leaf_numbers = section("leaves", Int32Array);
    // A leaf is one element of the section: 7 numbers.
    this.leaf_numbers = new Int32Array(this.leaf_numbers.buffer, this.leaf_numbers.byteOffset, 7 * this.leaf_numbers.length);
    this.leaf_count = this.leaf_numbers.length / 7;
    if (this.leaf_count === 0) return;
    const halves = section("factorHalves", Uint16Array), exponents = section("factorExponents", Int8Array);
    this.leaf_table = this.arena.copy(this.leaf_numbers);
    this.factors = this.arena.take(4 * halves.length);
    const kept = this.arena.next;
    const from = this.arena.copy(halves), scales = this.arena.copy(exponents);
    this.arena.next = kept;
    this.kernel.widen_leaves(this.leaf_table, this.leaf_count, this.channels, from, scales, this.factors);
  }

  read_entries(section) {
    this.entry_starts = this.copied(section("entryStarts", Uint32Array));
    const narrow = section("entryCols16", Uint16Array);
    const cols = narrow.length > 0 ? Uint32Array.from(narrow) : section("entryCols", Uint32Array);
    this.entry_cols = this.copied(cols);
    this.entry_count = cols.length;
    this.entry_values = this.widened(section("entryHalves", Uint16Array), section("entryExponents", Int8Array));
  }

  read_bands(section) {
    this.band_planes = section("bandPlanes", Int32Array);
    this.band_values = this.widened(section("bandHalves", Uint16Array), section("bandExponents", Int8Array));
  }

  read_columns(section) {
    this.column_count = section("columns", Int32Array).length / 4;
    this.columns = this.copied(section("columns", Int32Array));
    this.column_rows = this.copied(section("columnRows", Int32Array));
    this.column_entries = section("columnRows", Int32Array).length;
    this.column_values = this.widened(section("columnHalves", Uint16Array), section("columnExponents", Int8Array));
  }

  /** Kept as halves: they are shown seldom. */
  read_held_out(section) {
    this.held = {};
    for (const what of ["pattern", "photograph"])
      this.held[what] = { halves: section(`${what}Halves`, Uint16Array), exponents: section(`${what}Exponents`, Int8Array) };
  }

  relight(planes) { return this.apply(planes, false); }
  dual(planes) { return this.apply(planes, true); }

  leaves() {
    return { camera_order: this.sides[0].order, projector_order: this.sides[1].order, leaves: this.leaf_numbers };
  }

  held_out(k, pattern_pixels, camera_pixels) {
    const run = (what) => {
      const { halves, exponents } = this.held[what], count = halves.length / exponents.length;
      const kept = this.arena.next, out = this.arena.take(4 * count);
      this.kernel.widen(this.scratch(halves.slice(k * count, (k + 1) * count)), out, count, exponents[k]);
      this.arena.next = kept;
      return this.arena.floats(out, count).slice();
    };
    return { pattern: run("pattern"), photograph: split_planes(run("photograph"), camera_pixels) };
  }

  /** White light (one plane) shows all channels; light k of three shows channel k. */
  apply(planes, transposed) {
    const from = this.sides[transposed ? 0 : 1], to = this.sides[transposed ? 1 : 0];
    const pictures = [];
    planes.forEach((plane, k) => {
      this.load(plane, from);
      const channels = planes.length === 1 ? [...Array(this.channels).keys()] : [this.channels === 1 ? 0 : k];
      for (const channel of channels) pictures.push(this.channel_picture(channel, transposed, from, to));
    });
    return pictures;
  }

  load(plane, side) {
    const p = this.arena.floats(this.p, side.order.length);
    for (let t = 0; t < p.length; ++t) p[t] = plane[side.order[t]];
    this.kernel.count_lit(this.p, p.length, this.lit);
    if (this.band_planes.length > 0) this.arena.floats(this.p_raster, plane.length).set(plane);
  }

  channel_picture(channel, transposed, from, to) {
    const { kernel } = this, pixels = to.order.length;
    this.arena.floats(this.y, pixels).fill(0);
    if (this.diagonal) kernel.add_products(this.diagonal + 4 * channel * pixels, this.p, this.y, pixels);
    if (this.entry_count > 0) this.add_entries(channel, transposed);
    if (this.column_count > 0)
      kernel.add_columns(this.columns, this.column_count, this.column_rows, this.column_values + 4 * channel * this.column_entries,
        transposed ? 1 : 0, this.p, this.y);
    if (this.leaf_count > 0)
      kernel.add_leaves(this.leaf_table, this.leaf_count, this.channels, channel, this.factors,
        transposed && !this.facts.symmetric ? 1 : 0, this.lit, this.p, this.y);
    const picture = this.raster(to);
    if (this.band_planes.length > 0) this.add_bands(channel, picture);
    return picture;
  }

  add_entries(channel, transposed) {
    const mode = this.facts.symmetric ? 2 : transposed ? 1 : 0;
    this.kernel.add_entries(this.entry_starts, this.sides[0].order.length, this.entry_cols,
      this.entry_values + 4 * channel * this.entry_count, mode, this.p, this.y);
  }

  raster(side) {
    const picture = new Float32Array(side.order.length), y = this.arena.floats(this.y, picture.length);
    for (let t = 0; t < picture.length; ++t) picture[side.order[t]] = side.areas ? y[t] / side.areas[t] : y[t];
    return picture;
  }

  /** Bands lie in raster order, on the one grid of a symmetric tensor. */
  add_bands(channel, picture) {
    const [rows, cols] = this.facts.camera;
    this.arena.floats(this.y_raster, picture.length).set(picture);
    for (let k = 0; 3 * k < this.band_planes.length; ++k) {
      const [of, dy, dx] = this.band_planes.subarray(3 * k, 3 * k + 3);
      if (of === channel) this.kernel.add_band(this.band_values + 4 * k * picture.length, dy, dx, rows, cols, this.p_raster, this.y_raster);
    }
    picture.set(this.arena.floats(this.y_raster, picture.length));
  }
}
