// SPDX-License-Identifier: Apache-2.0
// Every change of every pin: cycle, GPIO, level.

import { createHash } from 'node:crypto';

export class EdgeRecorder {
  constructor(chip) {
    this.edges = []; // {cycle, gpio, level}
    this.taken = 0;
    this.keep = true; // also what was taken
    this.initial = chip.pads.levels;
    chip.edgeListeners.add((cycle, gpio, level) => this.edges.push({ cycle, gpio, level }));
  }

  /** The edges since the last call. */
  take() {
    const fresh = this.edges.slice(this.taken);
    if (this.keep) this.taken = this.edges.length;
    else this.clear();
    return fresh;
  }

  of(gpio) {
    return this.edges.filter((edge) => edge.gpio === gpio);
  }

  clear() {
    this.edges.length = 0;
    this.taken = 0;
  }

  /** One number for a whole recording: two runs are the same if their hashes are. */
  hash() {
    const hash = createHash('sha256');
    for (const { cycle, gpio, level } of this.edges) hash.update(`${cycle} ${gpio} ${level}\n`);
    return hash.digest('hex');
  }
}
