// SPDX-License-Identifier: Apache-2.0
// The two engines answer the same questions: planes of light in, planes of the picture out, as 32-bit floats.
import { encode_light, Planes } from "./light_code.js";
import { Places } from "./places.js";

/** Asks the server of `symrig view` for bytes. */
export async function ask(what, options) {
  const reply = await fetch(what, { credentials: "omit", ...options });
  if (!reply.ok) throw new Error(`symrig view answered: ${(await reply.text()).trim()}`);
  return reply.arrayBuffer();
}

/** A picture that the server computes. what: "relight", "quick", "dual" or "truth". */
export async function asked_picture(what, planes, pixels) {
  return new Planes(await ask(what, { method: "POST", body: encode_light(planes) })).all(pixels);
}

export function server_engine() {
  return {
    relight: (planes, pixels) => asked_picture("relight", planes, pixels),
    dual: (planes, pixels) => asked_picture("dual", planes, pixels),
    // Of a camera with pixels of its own:
    quick: (planes, pixels) => asked_picture("quick", planes, pixels),
    sees: async (pixel, pixels) => new Planes(await ask(`sees/${pixel}`)).all(pixels),
    places: async (cells) => new Places(new Float32Array(await ask("places")), cells),
    leaves: async () => leaf_table(new Int32Array(await ask("leaves"))),
    held_out: async (k, pattern_pixels, camera_pixels) => {
      const planes = new Planes(await ask(`held-out/${k}`));
      return { pattern: planes.next(pattern_pixels), photograph: planes.all(camera_pixels) };
    },
  };
}

/** Pixels of the camera, of the projector (0: the same), leaves; the orders; 7 numbers for each leaf. */
function leaf_table(numbers) {
  const [camera, projector, count] = numbers;
  const order = numbers.subarray(3, 3 + camera);
  const other = projector > 0 ? numbers.subarray(3 + camera, 3 + camera + projector) : order;
  const at = 3 + camera + projector;
  return { camera_order: order, projector_order: other, leaves: numbers.subarray(at, at + 7 * count) };
}
