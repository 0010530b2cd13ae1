// SPDX-License-Identifier: Apache-2.0
import { first_state, new_light, state_of_text, state_text } from "./state.js";
import { light_planes, read_picture } from "./lights.js";
import { ask, asked_picture, server_engine } from "./engine.js";
import { kernel_engine } from "./engine_kernel.js";
import { automatic_exposure, paint_difference, paint_picture, relative_difference } from "./tone.js";
import { exr_bytes } from "./exr.js";
import { leaves_of } from "./leaves.js";
import { Latest } from "./latest.js";
import { place_on_path } from "./animation.js";
import { element, save_file } from "./widgets.js";
import { cut_planes, tile_of } from "./views.js";
import { kSamePlaces } from "./places.js";
import { draw_overlay, leaf_codes, nearest_light, has_place, paint_canvas, watch_pointer } from "./stage.js";
import { RunningCapture } from "./capture.js";
import { build_animation, build_controls, build_lights, build_modes, build_tone } from "./controls.js";

const kModesOfOnePixel = ["light", "sees"];
const kStill = 200; // ms without a change, after which a quick picture becomes the whole one
const by_id = (id) => document.getElementById(id);
const number = (v) => (v === 0 ? "0" : Math.abs(v) >= 1e-3 && Math.abs(v) < 1e4 ? v.toPrecision(4) : v.toExponential(3));

class App {
  constructor(facts, engine) {
    Object.assign(this, { facts, engine });
    this.state = state_of_text(location.hash.slice(1)) ?? first_state();
    this.still_at = 0; // from then on, pictures are whole
    this.playing = false;
    this.phase = 0;
    this.cursor = null; // where values are read: [x, y] in shares of the picture
    this.held = new Map(); // held-out photographs by number
    this.waits = []; // ms from a pointer event to its picture
    this.latest = new Latest(() => this.show_or_tell());
  }

  async start() {
    await this.learn();
    await this.look_flood_lit();
    if (this.state.stops === null) this.state.stops = Math.log2(automatic_exposure(this.flood));
    build_controls(this);
    watch_pointer(by_id("picture"), { point: (...what) => this.point(...what), key: (event) => this.key(event) });
    window.addEventListener("resize", () => this.overlay());
    window.addEventListener("hashchange", () => this.follow_link());
    this.latest.request();
    await this.latest.idle();
  }

  /** What follows from facts and engine. */
  async learn() {
    const pixels = ([rows, cols]) => rows * cols;
    this.own_pixels = this.facts.pixels === "camera";
    this.cells = this.own_pixels ? this.facts.projector : this.facts.camera; // of what only T on the cells tells
    this.camera_pixels = pixels(this.facts.camera);
    this.projector_pixels = pixels(this.facts.projector);
    this.cell_pixels = pixels(this.cells);
    this.places = this.own_pixels ? await this.engine.places(this.facts.projector) : kSamePlaces;
  }

  async look_flood_lit() {
    this.flood = await this.engine.relight([new Float32Array(this.projector_pixels).fill(1)], this.camera_pixels);
  }

  /** The engine has another tensor of the same scene. */
  async refresh() {
    this.leaf_table = undefined;
    await this.look_flood_lit();
    this.latest.request();
    await this.latest.idle();
  }

  /** The scene is captured. The state of the page stays. */
  async complete(facts, engine) {
    await this.latest.idle();
    Object.assign(this, { facts, engine });
    await this.learn();
    build_controls(this);
    await this.refresh();
  }

  // What is shown.

  async show_or_tell() {
    const asked = this.event_time;
    this.event_time = null;
    try {
      await this.show();
      by_id("notice").textContent = this.first_notice ?? "";
    } catch (error) {
      by_id("notice").textContent = `${error.message}. Is symrig view still running?`;
    }
    if (asked) requestAnimationFrame(() => { this.waits = [...this.waits.slice(-999), performance.now() - asked]; });
  }

  tiles() {
    const { camera, projector, views } = this.facts;
    return { from: tile_of(projector, views, this.state.from), to: tile_of(camera, views, this.state.to) };
  }

  /** Computes the picture and what stands beside it, and paints both. */
  async show() {
    const { from, to } = this.tiles();
    const light = await this.light(from);
    const sees = this.state.mode === "sees";
    this.shown = sees ? { planes: cut_planes(await this.row(to), this.facts.projector, from), tile: from } : await this.relit(light, to);
    this.beside = sees ? null : await this.comparison(light, from, to);
    this.paint();
    await this.show_leaves(from, to);
  }

  /** The picture under a light. While something changes, it may be a quick one of fewer pixels. */
  async relit(light, to) {
    const { camera, quick } = this.facts, wait = this.still_at - performance.now();
    clearTimeout(this.later);
    if (!quick || wait <= 0 || this.state.difference) return { planes: cut_planes(await this.engine.relight(light, this.camera_pixels), camera, to), tile: to };
    this.later = setTimeout(() => this.latest.request(), wait);
    return { planes: await this.engine.quick(light, quick[0] * quick[1]), tile: { row: 0, col: 0, rows: quick[0], cols: quick[1] }, frame: camera };
  }

  hurry() {
    this.still_at = performance.now() + kStill;
    this.latest.request();
  }

  /** The whole picture, however short ago something has changed. */
  async whole() {
    this.still_at = 0;
    this.latest.request();
    await this.latest.idle();
  }

  /** The light that the camera's chosen pixel sees. */
  row(to) {
    if (!this.own_pixels) return this.engine.dual(this.one_pixel(this.facts.camera, to), this.projector_pixels);
    return this.engine.sees(this.pixel_in(this.facts.camera, to, this.places.on_picture(this.state.pixel)), this.projector_pixels);
  }

  async light(from) {
    const held = this.held_number();
    if (this.state.mode === "light") return this.one_pixel(this.facts.projector, from);
    if (held !== null) return [(await this.held_out(held)).pattern];
    return light_planes(this.state.lights, this.facts.projector, from);
  }

  held_number() {
    return this.state.compare.startsWith("held:") && !kModesOfOnePixel.includes(this.state.mode) ? Number(this.state.compare.slice(5)) : null;
  }

  async held_out(k) {
    if (!this.held.has(k)) this.held.set(k, await this.engine.held_out(k, this.projector_pixels, this.cell_pixels));
    return this.held.get(k);
  }

  /** The index of the chosen pixel in a grid. */
  pixel_in(grid, tile, place = this.state.pixel) {
    const at = (share, size) => Math.min(Math.max(Math.floor(share * size), 0), size - 1);
    return (tile.row + at(place[1], tile.rows)) * grid[1] + tile.col + at(place[0], tile.cols);
  }

  one_pixel(grid, tile) {
    const plane = new Float32Array(grid[0] * grid[1]);
    plane[this.pixel_in(grid, tile)] = 1;
    return [plane];
  }

  /** {planes, tile, name, comparable} or null. Truth and held-out photographs are on the cells. */
  async comparison(light, from, to) {
    const { compare } = this.state, { camera, projector } = this.facts;
    const seen = (planes, name, grid, tile) =>
      ({ planes: cut_planes(planes, grid, tile), tile, name, comparable: tile.rows === this.shown.tile.rows && tile.cols === this.shown.tile.cols });
    const on_cells = (planes, name) => seen(planes, name, this.cells, this.own_pixels ? from : to);
    if (compare === "flood") return seen(this.flood, "Flood-lit", camera, to);
    if (compare === "truth") return on_cells(await asked_picture("truth", light, this.cell_pixels), "Truth");
    if (compare === "light") return { planes: cut_planes(light, projector, from), tile: from, name: "The light", exposure: 1 };
    const held = this.held_number();
    if (held !== null) return on_cells((await this.held_out(held)).photograph, `Held-out photograph: ${this.facts.heldOut[held]}`);
    if (compare !== "dual") return null;
    const planes = await this.engine.dual(light_planes(this.state.lights, this.cells, this.own_pixels ? from : to), this.projector_pixels);
    return { planes: cut_planes(planes, projector, from), tile: from, name: "Dual view: the light shines from the camera" };
  }

  exposure() {
    const automatic = this.state.automatic || kModesOfOnePixel.includes(this.state.mode);
    return automatic ? automatic_exposure(this.shown.planes) : 2 ** this.state.stops;
  }

  paint() {
    const { planes, tile, frame } = this.shown, { state } = this, exposure = this.exposure();
    const fill = (what, factor) => (codes) => paint_picture(codes, what, factor, state.curve, state.colours);
    paint_canvas(by_id("picture"), tile.rows, tile.cols, fill(planes, exposure), frame);
    by_id("other-figure").hidden = !this.beside;
    if (this.beside) {
      const { beside } = this, difference = state.difference && beside.comparable;
      paint_canvas(by_id("other"), beside.tile.rows, beside.tile.cols, difference
        ? (codes) => paint_difference(codes, planes, beside.planes, exposure * 2 ** state.gain)
        : fill(beside.planes, beside.exposure ?? exposure));
      by_id("other-caption").textContent = difference ? `Relit minus: ${beside.name}` : beside.name;
      by_id("other").setAttribute("aria-label", by_id("other-caption").textContent);
    }
    by_id("picture-caption").textContent = this.caption(exposure);
    this.summarise();
    this.read_values();
    this.overlay();
  }

  caption(exposure) {
    const what = { light: "One projector pixel lit", sees: "The light that one camera pixel sees" }[this.state.mode] ?? "Relit";
    return `${what}, ${this.shown.tile.rows}x${this.shown.tile.cols}, exposure ${exposure.toPrecision(4)}`;
  }

  /** How far the picture is from what stands beside it. */
  summarise() {
    const useful = this.beside?.comparable && this.state.compare !== "flood";
    const apart = useful ? relative_difference(this.shown.planes, this.beside.planes) : null;
    const text = apart === null ? "" : `Relative difference from the ${this.state.compare === "truth" ? "truth" : "photograph"}: ${(100 * apart).toPrecision(3)} %`;
    if (by_id("summary").textContent !== text) by_id("summary").textContent = text;
  }

  read_values() {
    if (!this.cursor || !this.shown) return;
    const { tile, planes, frame } = this.shown;
    const pixel = (rows, cols) => [Math.min(Math.floor(this.cursor[1] * rows), rows - 1), Math.min(Math.floor(this.cursor[0] * cols), cols - 1)];
    const [r, c] = pixel(tile.rows, tile.cols), at = r * tile.cols + c, [row, col] = frame ? pixel(...frame) : [r, c];
    const values = (what) => what.map((plane) => number(plane[at])).join(" ");
    let text = `row ${row}, column ${col}: ${values(planes)}`;
    if (this.beside?.comparable) {
      const gap = this.beside.planes.map((plane, c) => number(planes[planes.length === 1 ? 0 : c][at] - plane[at])).join(" ");
      text += ` · beside: ${values(this.beside.planes)} · difference: ${gap}`;
    }
    by_id("readout").textContent = text;
  }

  async show_leaves(from, to) {
    if (this.state.inside === "none") {
      if (this.leaves) this.set_leaves(null, []);
      return;
    }
    this.leaf_table ??= await this.engine.leaves();
    const map = leaves_of(this.leaf_table, this.pixel_in(this.facts.projector, from));
    const tile = this.own_pixels ? from : to;
    const [level, rank] = cut_planes([map.level, map.rank].map((one) => Float32Array.from(one)), this.cells, tile);
    const { codes, legend } = leaf_codes({ level, rank }, this.state.inside, this.facts.levels);
    this.set_leaves({ rows: tile.rows, cols: tile.cols, codes, affine: this.places.affine }, legend);
  }

  set_leaves(leaves, legend) {
    this.leaves = this.state.mode === "sees" ? null : leaves;
    by_id("legend").hidden = legend.length === 0;
    by_id("legend").replaceChildren(...legend.map(([text, colour]) => {
      const swatch = element("span", { className: "swatch" });
      swatch.style.backgroundColor = `rgb(${colour})`;
      return element("li", {}, [swatch, text]);
    }));
    this.overlay();
  }

  overlay() {
    const { state } = this, of_pixel = kModesOfOnePixel.includes(state.mode);
    draw_overlay(by_id("overlay"), {
      lights: of_pixel || this.held_number() !== null ? [] : state.lights.map((light) => this.seen_light(light)),
      chosen: state.chosen,
      pixel: state.mode !== "move" || state.inside !== "none" ? this.on_shown(state.pixel) : null,
      leaves: this.leaves,
      path: state.mode === "path" ? state.drawn.map((place) => this.on_shown(place)) : [],
      path_closed: !this.drawing,
    });
  }

  /** A place on the cells, on the picture that is shown, and back. The light that a pixel sees is shown on the cells. */
  on_shown(place) {
    return this.state.mode === "sees" ? place : this.places.on_picture(place);
  }

  of_shown(place) {
    return this.state.mode === "sees" ? place : this.places.on_cells(place);
  }

  /** A light as it is drawn over the picture. */
  seen_light(light) {
    if (!this.own_pixels || !has_place(light)) return light;
    const [x, y] = this.on_shown([light.x, light.y]), angle = ((light.angle ?? 0) * Math.PI) / 180, [rows, cols] = this.facts.projector;
    const ahead = this.on_shown([light.x + Math.cos(angle) / cols, light.y + Math.sin(angle) / rows]);
    const turned = Math.atan2((ahead[1] - y) * this.facts.camera[0], (ahead[0] - x) * this.facts.camera[1]);
    return { ...light, x, y, angle: (turned * 180) / Math.PI };
  }

  // What the user does.

  change(values) {
    Object.assign(this.state, values);
    if ("automatic" in values && this.shown) {
      if (!values.automatic && !("stops" in values)) this.state.stops = Math.log2(automatic_exposure(this.shown.planes));
      if (document.activeElement?.type !== "range") build_tone(this);
    }
    this.hurry();
  }

  set_mode(mode) {
    this.change({ mode });
    if (mode === "brush" && this.state.lights[this.state.chosen]?.kind !== "brush") this.choose_brush();
  }

  choose_brush() {
    const k = this.state.lights.findIndex((light) => light.kind === "brush");
    if (k < 0) this.add_light(new_light("brush"));
    else this.choose_light(k);
  }

  choose_light(k) {
    this.state.chosen = k;
    build_lights(this);
    this.overlay();
  }

  add_light(light) {
    this.state.lights.push(light);
    this.choose_light(this.state.lights.length - 1);
    const mode = light.kind === "brush" ? "brush" : "move";
    if (mode !== this.state.mode) this.state.mode = mode;
    build_modes(this);
    this.latest.request();
  }

  async add_picture(file) {
    try {
      const pixels = await read_picture(file);
      this.add_light({ ...new_light("picture"), name: file.name, pixels });
    } catch {
      by_id("notice").textContent = `${file.name} is no picture that this browser can read. Choose a PNG or JPEG file.`;
    }
  }

  change_light(key, value) {
    this.state.lights[this.state.chosen][key] = value;
    this.hurry();
  }

  remove_light() {
    this.state.lights.splice(this.state.chosen, 1);
    this.choose_light(Math.min(this.state.chosen, this.state.lights.length - 1));
    this.latest.request();
  }

  undo_stroke() {
    this.state.lights[this.state.chosen].strokes.pop();
    this.latest.request();
  }

  /** The pointer at a place of the picture. */
  point(phase, place, event) {
    this.cursor = place;
    this.read_values();
    place = this.of_shown(place);
    const { state } = this;
    if (state.inside !== "none" || kModesOfOnePixel.includes(state.mode)) this.choose_pixel(place, event);
    else if (phase !== "hover") this.pull(phase, place, event);
  }

  choose_pixel(place, event) {
    this.state.pixel = place;
    this.ask(event);
    if (this.state.mode === "move" && event.buttons > 0) this.pull(event.type === "pointerdown" ? "down" : "move", place, event);
  }

  /** A drag with the button held. */
  pull(phase, place, event) {
    const { state } = this, pull = { move: this.pull_light, brush: this.pull_brush, path: this.pull_path }[state.mode];
    if (state.mode !== "move") state.pixel = place;
    pull?.call(this, phase, place);
    this.ask(event);
  }

  pull_light(phase, place) {
    const { lights } = this.state;
    if (phase === "down") {
      const near = nearest_light(lights, place);
      if (near >= 0 && near !== this.state.chosen) this.choose_light(near);
    }
    const light = lights[this.state.chosen];
    if (light && has_place(light) && phase !== "up") [light.x, light.y] = place;
    if (phase === "up") build_lights(this);
  }

  pull_brush(phase, place) {
    if (this.state.lights[this.state.chosen]?.kind !== "brush") this.choose_brush();
    const { strokes } = this.state.lights[this.state.chosen];
    if (phase === "down" || strokes.length === 0) strokes.push([]);
    if (phase !== "up") strokes[strokes.length - 1].push(place);
  }

  pull_path(phase, place) {
    if (phase === "down") this.state.drawn = [];
    this.drawing = phase !== "up";
    if (phase !== "up") return void this.state.drawn.push(place);
    this.state.path = "drawn";
    build_animation(this);
  }

  /** A picture for this event. The first of those that wait counts. */
  ask(event) {
    this.event_time ??= event.timeStamp;
    this.hurry();
  }

  key(event) {
    const { state } = this, light = state.lights[state.chosen];
    const step = event.shiftKey ? 10 : 1, size = this.shown.tile;
    const moves = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key in moves) this.move_by(moves[event.key].map((d, axis) => (d * step) / [size.cols, size.rows][axis]));
    else if ("+=-−".includes(event.key) && light && "size" in light) light.size = Math.min(Math.max(light.size * (event.key === "+" || event.key === "=" ? 1.1 : 1 / 1.1), 0.002), 2);
    else if (event.key === " " && ["brush", "path"].includes(state.mode)) this.dab();
    else if (event.key === "Delete" && light) this.remove_light();
    else if ((event.key === "PageUp" || event.key === "PageDown") && light)
      this.choose_light((state.chosen + (event.key === "PageUp" ? -1 : 1) + state.lights.length) % state.lights.length);
    else return;
    event.preventDefault();
    if (event.key !== "PageUp" && event.key !== "PageDown") build_lights(this);
    this.ask(event);
  }

  /** One point of the brush or of the path, at the chosen pixel. */
  dab() {
    if (this.state.mode === "brush") {
      this.pull_brush("down", this.state.pixel);
    } else {
      this.state.drawn.push(this.state.pixel);
      this.state.path = "drawn";
      build_animation(this);
    }
  }

  /** Moves the chosen pixel or light, which is then where values are read. */
  move_by(shift) {
    const { state } = this, light = state.lights[state.chosen];
    const moved = (place) => {
      this.cursor = this.on_shown(place).map((v, axis) => Math.min(Math.max(v + shift[axis], 0), 1));
      return this.of_shown(this.cursor);
    };
    if (state.mode !== "move" || state.inside !== "none") state.pixel = moved(state.pixel);
    if (state.mode !== "move" || !light || !has_place(light)) return;
    [light.x, light.y] = moved([light.x, light.y]);
  }

  play(on) {
    this.playing = on;
    const light = this.state.lights[this.state.chosen];
    if (on && (!light || !has_place(light))) {
      by_id("notice").textContent = "Choose a light that can move: a spot, a bar, a text or a picture.";
      this.playing = false;
    }
    build_animation(this);
    if (this.playing) this.step_animation(performance.now());
  }

  /** One step for each shown picture, so a slow scene skips places and keeps the speed. */
  step_animation(before) {
    requestAnimationFrame(async (now) => {
      const light = this.state.lights[this.state.chosen];
      if (!this.playing || !light || !has_place(light)) return;
      this.phase += ((now - before) / 1000) * this.state.speed;
      [light.x, light.y] = place_on_path(this.state.path, this.phase, this.state.drawn);
      this.hurry();
      await this.latest.idle();
      this.step_animation(now);
    });
  }

  file_name(suffix) {
    return `${this.facts.title.replace(/\.[^.]*$/, "").replace(/[^\w.-]+/g, "-") || "scene"}-relit.${suffix}`;
  }

  async save_png() {
    await this.whole();
    by_id("picture").toBlob((blob) => save_file(this.file_name("png"), blob), "image/png");
    by_id("saved").textContent = `${this.file_name("png")}: the picture as shown.`;
  }

  async save_exr() {
    await this.whole();
    const { planes, tile } = this.shown;
    save_file(this.file_name("exr"), new Blob([exr_bytes(planes, tile.rows, tile.cols, this.exr_facts())], { type: "image/x-exr" }));
    by_id("saved").textContent = `${this.file_name("exr")}: radiance, without exposure and curve.`;
  }

  /** What the header of a saved picture states (docs/images.md). */
  exr_facts() {
    const { state } = this, sees = state.mode === "sees";
    const view = [sees ? "projector" : "camera", state.from && `lit from view ${state.from}`, state.to && `seen from view ${state.to}`];
    return {
      symrigUnits: sees ? "radiance per unit of light from the camera" : "radiance per unit of projector light",
      symrigExposure: this.exposure(),
      symrigView: view.filter(Boolean).join(", "),
    };
  }

  async copy_link() {
    const { text, left_out } = state_text(this.state);
    history.replaceState(null, "", `#${text}`);
    let done = "The address of this page now holds the state.";
    try {
      await navigator.clipboard.writeText(location.href);
      done = "Link copied.";
    } catch {
      // No clipboard on this page: the address bar has the link.
    }
    by_id("saved").textContent = `${done} ${left_out}`.trim();
  }

  follow_link() {
    const state = state_of_text(location.hash.slice(1));
    if (!state) return;
    state.stops ??= this.state.stops;
    this.state = state;
    build_controls(this);
    this.latest.request();
  }
}

function fact_line(facts) {
  const size = ([rows, cols]) => `${rows}x${cols}`;
  const grids = facts.symmetric ? size(facts.camera) : `projector ${size(facts.projector)}, camera ${size(facts.camera)}`;
  const relit = facts.live ? "the tensor so far" : relights_here(facts) ? "relit by this page" : "relit by symrig";
  const shown = { camera: "the camera's own pixels, ", cells: "the projector's cells, " }[facts.pixels] ?? "";
  return `${shown}${grids} pixels, ${facts.channels === 1 ? "one channel" : "colour"}, ${relit}`;
}

/** A served page relights by itself too, unless the scene is large or its address asks for the server. */
function relights_here(facts) {
  return facts.engine === "kernel" || (facts.packed && new URLSearchParams(location.search).get("engine") !== "server");
}

function show_facts(facts) {
  by_id("facts").textContent = fact_line(facts);
  if (facts.reducedFrom)
    by_id("facts").textContent += `. This page has a lower resolution: the scene has ${facts.reducedFrom.join("x")} pixels, too many for one file.`;
}

/** The whole page for a scene. */
async function show_scene(facts) {
  try {
    show_facts(facts);
    const app = new App(facts, relights_here(facts) ? await kernel_engine(facts) : server_engine());
    by_id("main").hidden = false;
    await app.start();
    window.symrigView = app; // for scripts and tests
    return app;
  } catch (error) {
    by_id("notice").textContent = `The scene cannot be shown: ${error.message}`;
    throw error;
  }
}

/** The page of a running capture: without a picture until the first tensor, and in the end the page of the scene. */
function show_capture(first_facts) {
  let app = null;
  const facts = async () => JSON.parse(new TextDecoder().decode(await ask("facts")));
  by_id("facts").textContent = "A capture is running. The picture appears after the flood-lit photograph, and gets better with each level.";
  by_id("main").hidden = true;
  const capture = new RunningCapture(first_facts, {
    on_tensor: async () => {
      if (app) await app.refresh();
      else app = await show_scene(await facts());
    },
    on_complete: async () => {
      const whole = await facts();
      if (!app) return void (app = await show_scene(whole));
      show_facts(whole);
      await app.complete(whole, relights_here(whole) ? await kernel_engine(whole) : server_engine());
    },
  });
  window.symrigCapture = capture; // for scripts and tests
  return capture.watch();
}

function main() {
  const facts = JSON.parse(by_id("scene-facts").textContent);
  document.title = `${facts.title} – symrig view`;
  by_id("title").textContent = facts.title;
  return facts.live ? show_capture(facts) : show_scene(facts);
}

main();
