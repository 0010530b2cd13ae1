// SPDX-License-Identifier: Apache-2.0
import { check_box, choice, colour_field, element, file_button, push_button, radio, slider, text_field } from "./widgets.js";
import { kCurves } from "./tone.js";
import { new_light } from "./state.js";

const kModes = {
  move: "Move lights",
  brush: "Paint light with the brush",
  light: "Light one projector pixel (a column of T)",
  sees: "Show which light one camera pixel sees (a row of T)",
  path: "Draw a path for the animation",
};
const kKinds = { flood: "All on", spot: "Spot", bar: "Bar", brush: "Brush", text: "Text", picture: "Picture" };

const place = (id) => document.getElementById(id);
const percent = (v) => `${(100 * v).toFixed(v < 0.1 ? 1 : 0)} %`;

/** Builds the panel. app: the state, facts and actions of the page (main.js). */
export function build_controls(app) {
  build_modes(app);
  build_adders(app);
  build_lights(app);
  build_tone(app);
  build_compare(app);
  build_views(app);
  build_inside(app);
  build_animation(app);
  build_save(app);
}

export function build_modes(app) {
  place("modes").replaceChildren(...Object.entries(kModes).map(([key, label]) =>
    radio("mode", label, app.state.mode === key, () => app.set_mode(key))));
}

function build_adders(app) {
  const adders = ["spot", "bar", "brush", "text", "flood"].map((kind) => push_button(`+ ${kKinds[kind]}`, () => app.add_light(new_light(kind))));
  adders.push(file_button("+ Picture…", "image/*", (file) => app.add_picture(file)));
  place("add-buttons").replaceChildren(...adders);
}

export function build_lights(app) {
  const { lights, chosen } = app.state;
  place("lights").replaceChildren(...lights.map((light, k) => {
    const name = light.kind === "text" ? `Text “${light.text}”` : light.kind === "picture" ? `Picture ${light.name}` : kKinds[light.kind];
    return radio("light", `${k + 1}. ${name}`, k === chosen, () => app.choose_light(k));
  }));
  if (lights.length === 0) place("lights").replaceChildren(element("p", { className: "hint", textContent: "No light. Add one." }));
  build_properties(app);
}

function build_properties(app) {
  const light = app.state.lights[app.state.chosen];
  if (!light) return place("properties").replaceChildren();
  const change = (key) => (value) => app.change_light(key, value);
  const share = (key, label, min, max) => slider(label, { min, max, step: 0.001, value: light[key], text: percent, change: change(key) });
  const rows = [colour_field("Colour", light.colour, change("colour"))];
  rows.push(slider("Brightness", { min: 0, max: 3, step: 0.01, value: light.power, text: percent, change: change("power") }));
  if ("x" in light && !["flood", "brush"].includes(light.kind)) rows.push(share("x", "Across", 0, 1), share("y", "Down", 0, 1));
  if ("size" in light) rows.push(share("size", light.kind === "picture" ? "Scale" : "Size", 0.002, light.kind === "picture" ? 2 : 0.6));
  if ("soft" in light) rows.push(share("soft", "Soft edge", 0, 1));
  if ("angle" in light) rows.push(slider("Angle", { min: -90, max: 90, step: 1, value: light.angle, text: (v) => `${v}°`, change: change("angle") }));
  if (light.kind === "text") rows.push(text_field("Text", light.text, change("text")));
  rows.push(element("div", { className: "buttons" }, [
    push_button("Remove this light", () => app.remove_light()),
    ...(light.kind === "brush" ? [push_button("Undo stroke", () => app.undo_stroke())] : []),
  ]));
  place("properties").replaceChildren(...rows);
}

export function build_tone(app) {
  const { state } = app;
  const stops = slider("Exposure", { min: -12, max: 16, step: 0.05, value: state.stops ?? 0, text: (v) => `${v.toFixed(2)} EV`,
    change: (v) => app.change({ stops: v, automatic: false }) });
  const curves = Object.fromEntries(Object.entries(kCurves).map(([key, [label]]) => [key, label]));
  place("tone").replaceChildren(
    stops,
    check_box("Automatic: half a percent is white", state.automatic, (v) => app.change({ automatic: v })),
    choice("Curve", curves, state.curve, (v) => app.change({ curve: v })),
    choice("Colours", { grey: "As they are", false: "False colour (brightness)" }, state.colours, (v) => app.change({ colours: v })),
  );
}

function build_compare(app) {
  const { state, facts } = app;
  const options = { none: "Nothing", light: "The light itself", flood: "The flood-lit scene", dual: "The dual view (from the projector)" };
  if (facts.truth) options.truth = "The truth of this simulated scene";
  facts.heldOut.forEach((name, k) => { options[`held:${k}`] = `Held-out photograph: ${name}`; });
  if (!(state.compare in options)) state.compare = "none";
  place("compare").replaceChildren(
    choice("Show beside", options, state.compare, (v) => app.change({ compare: v })),
    check_box("Show the difference instead", state.difference, (v) => app.change({ difference: v })),
    slider("Gain", { min: 0, max: 10, step: 0.1, value: state.gain, text: (v) => `× ${(2 ** v).toPrecision(3)}`, change: (v) => app.change({ gain: v }) }),
    element("p", { className: "hint", textContent: facts.truth || facts.heldOut.length > 0
      ? "With a held-out photograph, the light is the pattern of that photograph. Difference: blue is too dark, orange too bright."
      : "Difference: blue is darker than the picture beside it, orange is brighter." }),
  );
}

function build_views(app) {
  const [rows, cols] = app.facts.views;
  place("views-group").hidden = rows * cols === 1;
  if (rows * cols === 1) return;
  const options = { "": "All views" };
  for (let r = 0; r < rows; ++r) for (let c = 0; c < cols; ++c) options[`${r},${c}`] = `View ${r},${c}`;
  place("views").replaceChildren(
    choice("Lit from", options, app.state.from, (v) => app.change({ from: v })),
    choice("Seen from", options, app.state.to, (v) => app.change({ to: v })),
  );
}

function build_inside(app) {
  place("inside").replaceChildren(
    choice("Lay over", { none: "Nothing", levels: "Levels of the leaves", ranks: "Ranks of the leaves" }, app.state.inside, (v) => app.change({ inside: v })),
    element("p", { className: "hint", textContent: "Shows how the tensor holds the light from the projector pixel under the pointer to each camera pixel. Without colour: single entries, bands or dark." }),
  );
}

export function build_animation(app) {
  const play = push_button(app.playing ? "Stop" : "Play", () => app.play(!app.playing));
  play.setAttribute("aria-pressed", String(app.playing));
  place("animation").replaceChildren(
    choice("Path", { circle: "Circle", across: "Left and right", down: "Up and down", drawn: "Drawn by you" }, app.state.path, (v) => app.change({ path: v })),
    slider("Speed", { min: 0.02, max: 1, step: 0.01, value: app.state.speed, text: (v) => `${v.toFixed(2)} /s`, change: (v) => app.change({ speed: v }) }),
    element("div", { className: "buttons" }, [play]),
  );
}

function build_save(app) {
  place("save").replaceChildren(
    push_button("PNG", () => app.save_png()),
    push_button("OpenEXR", () => app.save_exr()),
    push_button("Copy a link to this state", () => app.copy_link()),
  );
}
