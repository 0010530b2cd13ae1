// SPDX-License-Identifier: Apache-2.0
// The image that users flash, on the emulated board, with a host that speaks the wire.
// SYMRIG_PICO_UF2 names the image; else it is build/pico/symrig-pico.uf2 (cmake --preset pico, cmake --build --preset pico).

import fs from 'node:fs';
import { fileURLToPath } from 'node:url';
import { Board } from '../board/board.mjs';
import { WireClient, assembleProgram } from '../wire/client.mjs';

const DEFAULT = fileURLToPath(new URL('../../../build/pico/symrig-pico.uf2', import.meta.url));
export const IMAGE = process.env.SYMRIG_PICO_UF2 ?? DEFAULT;

/** For node:test: why the tests of the image are left out, or false. */
export const skip = fs.existsSync(IMAGE) ? false : `no image at ${IMAGE}; build it with the preset 'pico'`;

export const OUTPUTS = 12;
export const VSYNC = { line: 12, gpio: 16 };
export const INTERLOCK = { line: 15, gpio: 19 };
export const IN_A = { line: 16, gpio: 20 };

export const outputs = Array.from({ length: OUTPUTS }, (_, line) => ({ line, direction: 'DIRECTION_OUTPUT', role: 'LINE_ROLE_GENERAL' }));
export const input = (line, role, more = {}) => ({ line, direction: 'DIRECTION_INPUT', role, ...more });

export class PicoRig {
  constructor(options) {
    this.board = new Board(fs.readFileSync(IMAGE), options);
    this.connect();
  }

  /** Waits for the device and begins a session; also after the board was reset. */
  connect() {
    this.client?.pipe.release();
    this.board.connect();
    this.client = new WireClient(this.board);
    this.hello = this.client.hello();
  }

  /** Another board with this one's flash, as after a power cycle. */
  powerCycle() {
    const next = Object.create(PicoRig.prototype);
    next.board = new Board(fs.readFileSync(IMAGE));
    next.board.inherit(this.board);
    next.connect();
    return next;
  }

  configure(lines = outputs) {
    this.configHash = this.client.configure(lines);
  }

  upload(list) {
    this.commit = this.client.upload(assembleProgram(list));
    return this.commit;
  }

  arm({ autonomous = true } = {}) {
    return this.client.must({ arm: { program_hash: this.commit.program_hash, config_hash: this.configHash, autonomous } });
  }

  /** Uploads, arms and starts; the recording holds the run only. */
  start(list, options) {
    this.upload(list);
    this.arm(options);
    this.board.recorder.clear();
    this.client.must({ start: { now: true } });
  }

  finish(milliseconds = 5000) {
    return this.client.waitFor('run_done', milliseconds);
  }

  status() {
    return this.client.must({ get_status: {} }).status;
  }

  edges(gpio) {
    return this.board.recorder.of(gpio);
  }

  get outputLevels() {
    return this.board.chip.pads.levels & ((1 << OUTPUTS) - 1);
  }

  /** Cycle of the last change of any output. */
  get lastOutputEdge() {
    return this.board.recorder.edges.filter((edge) => edge.gpio < OUTPUTS).at(-1)?.cycle;
  }
}

/** Edges that a list of [levels, ticks] must give, from the first word on: [cycle, gpio, level] in the recorder's order. */
export function expectedEdges(words, last = 0) {
  const edges = [];
  let [before, at] = [0, 0];
  for (const [levels, ticks] of [...words, [last, 0]]) {
    for (let gpio = 0; gpio < OUTPUTS; gpio++) if (((before ^ levels) >>> gpio) & 1) edges.push([at, gpio, (levels >>> gpio) & 1]);
    before = levels;
    at += ticks;
  }
  return edges;
}

/** The outputs' edges of a recording, from the first of them on. */
export function outputEdges(rig) {
  const edges = rig.board.recorder.edges.filter((edge) => edge.gpio < OUTPUTS);
  return edges.map(({ cycle, gpio, level }) => [cycle - edges[0].cycle, gpio, level]);
}
