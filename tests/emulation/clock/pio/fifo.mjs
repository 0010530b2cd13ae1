// SPDX-License-Identifier: Apache-2.0
// A PIO FIFO: 4 words, or 8 or 0 when the two of a state machine are joined.

export class Fifo {
  constructor(depth) {
    this.depth = depth;
    this.words = [];
  }

  get empty() {
    return this.words.length === 0;
  }

  get full() {
    return this.words.length >= this.depth;
  }

  get level() {
    return this.words.length;
  }

  push(word) {
    this.words.push(word >>> 0);
  }

  pull() {
    return this.words.shift();
  }

  /** Empties it; a change of FJOIN does so too. */
  clear(depth = this.depth) {
    this.depth = depth;
    this.words.length = 0;
  }
}
