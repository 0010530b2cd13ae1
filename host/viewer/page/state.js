// SPDX-License-Identifier: Apache-2.0
// What the user has chosen. Positions and sizes are shares of the picture's width and height, so a state fits every resolution.

/** The state of a new page: one spot, so wide and soft that all of the scene is seen. */
export function first_state() {
  return {
    mode: "move",
    lights: [{ ...new_light("spot"), size: 0.5, soft: 0.8 }],
    chosen: 0,
    pixel: [0.5, 0.5],
    automatic: false,
    stops: null,
    curve: "srgb",
    colours: "grey",
    compare: "none",
    difference: false,
    gain: 3,
    from: "",
    to: "",
    inside: "none",
    path: "circle",
    drawn: [],
    speed: 0.2,
  };
}

/** kind: "flood", "spot", "bar", "brush", "text" or "picture". */
export function new_light(kind) {
  const common = { kind, colour: "#ffffff", power: 1, x: 0.5, y: 0.5 };
  const own = {
    flood: {},
    spot: { size: 0.12, soft: 0.3 },
    bar: { size: 0.08, soft: 0.1, angle: 0 },
    brush: { size: 0.03, soft: 0.5, strokes: [] },
    text: { text: "light", size: 0.25, angle: 0 },
    picture: { size: 1, name: "", pixels: null },
  };
  return { ...common, ...own[kind] };
}

const kLongestLink = 16000; // characters; browsers take more, mail programs do not

/** The state as text for a link, and what it leaves out. */
export function state_text(state) {
  const kept = structured_without_pictures(state);
  let left_out = state.lights.some((light) => light.kind === "picture") ? "Pictures are not in the link. " : "";
  let text = encoded(kept);
  if (text.length > kLongestLink) {
    kept.lights = kept.lights.filter((light) => light.kind !== "brush");
    kept.drawn = [];
    left_out += "Brush strokes are too long for a link. ";
    text = encoded(kept);
  }
  return { text, left_out };
}

function structured_without_pictures(state) {
  const lights = state.lights.filter((light) => light.kind !== "picture");
  return { ...state, lights, chosen: Math.min(state.chosen, lights.length - 1) };
}

function encoded(value) {
  const rounded = JSON.stringify(value, (key, one) => (typeof one === "number" ? Math.round(one * 1e4) / 1e4 : one));
  const bytes = new TextEncoder().encode(rounded);
  return btoa(String.fromCharCode(...bytes)).replace(/\+/g, "-").replace(/\//g, "_").replace(/=+$/, "");
}

/** The state of a link, or null. Values of another type than in a new state are left out, so any text is safe. */
export function state_of_text(text) {
  try {
    const bytes = Uint8Array.from(atob(text.replace(/-/g, "+").replace(/_/g, "/")), (c) => c.charCodeAt(0));
    const given = JSON.parse(new TextDecoder().decode(bytes));
    const state = checked(given, first_state());
    state.stops = Number.isFinite(given.stops) ? given.stops : null;
    state.pixel = points([given.pixel])[0] ?? [0.5, 0.5];
    state.drawn = points(given.drawn);
    state.lights = Array.isArray(given.lights) ? given.lights.slice(0, 64).map(checked_light).filter(Boolean) : [];
    state.chosen = Math.min(Math.max(Math.trunc(state.chosen), -1), state.lights.length - 1);
    return state;
  } catch {
    return null;
  }
}

function checked(given, model) {
  const result = { ...model };
  for (const key of Object.keys(model)) {
    const same = typeof given[key] === typeof model[key] && !Array.isArray(model[key]) && model[key] !== null;
    if (same && (typeof given[key] !== "number" || Number.isFinite(given[key]))) result[key] = given[key];
  }
  return result;
}

function checked_light(given) {
  if (given === null || typeof given !== "object" || !["flood", "spot", "bar", "brush", "text"].includes(given.kind)) return null;
  const light = checked(given, new_light(given.kind));
  if (!/^#[0-9a-f]{6}$/i.test(light.colour)) light.colour = "#ffffff";
  if (light.kind === "brush") light.strokes = Array.isArray(given.strokes) ? given.strokes.slice(0, 1000).map(points) : [];
  return light;
}

function points(given) {
  if (!Array.isArray(given)) return [];
  const good = (p) => Array.isArray(p) && p.length === 2 && p.every((v) => Number.isFinite(v));
  return given.slice(0, 20000).filter(good);
}
