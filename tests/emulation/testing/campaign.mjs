// SPDX-License-Identifier: Apache-2.0
// A campaign that takes hours adds up over runs: a ledger holds what was done with this image, and the next run goes on behind it.
//   SYMRIG_LEDGER=FILE    where results are kept: one JSON line for each item, appended. Without it every run begins anew.
//   SYMRIG_SHARD=K/N      this run takes every N-th item, from the K-th on (0 to N - 1). Shards may share a ledger.
//   SYMRIG_SECONDS=S      no item begins later than that

import { createHash } from 'node:crypto';
import fs from 'node:fs';

export class Ledger {
  /** `campaign`: its name; `image`: the file under test. Results of other images do not count. */
  constructor(campaign, image, { LEDGER = process.env.SYMRIG_LEDGER, SHARD = process.env.SYMRIG_SHARD ?? '0/1', SECONDS = process.env.SYMRIG_SECONDS } = {}) {
    const digest = createHash('sha256').update(fs.readFileSync(image)).digest('hex').slice(0, 16);
    Object.assign(this, { campaign, image: digest, file: LEDGER, results: new Map() });
    [this.shard, this.shards] = SHARD.split('/').map(Number);
    if (!(this.shard >= 0 && this.shard < this.shards)) throw new Error(`SYMRIG_SHARD=${SHARD}: K/N with K from 0 to N - 1`);
    this.deadline = SECONDS === undefined ? Infinity : Date.now() + 1000 * Number(SECONDS);
    this.read();
  }

  /** Takes in what other shards have written meanwhile, too. */
  read() {
    if (!this.file || !fs.existsSync(this.file)) return;
    for (const line of fs.readFileSync(this.file, 'utf8').split('\n')) {
      if (line === '') continue;
      const { campaign, image, item, result } = JSON.parse(line);
      if (campaign === this.campaign && image === this.image) this.results.set(item, result);
    }
  }

  /** Those of `items` that this run has to do: its shard, less what is done; they end with the time. */
  *left(items) {
    let index = 0;
    for (const item of items) {
      const mine = index++ % this.shards === this.shard;
      if (!mine || this.results.has(item)) continue;
      if (Date.now() >= this.deadline) return;
      yield item;
    }
  }

  note(item, result) {
    this.results.set(item, result);
    if (this.file) fs.appendFileSync(this.file, `${JSON.stringify({ campaign: this.campaign, image: this.image, item, result })}\n`);
  }
}

// Seeded numbers (xorshift32): the same on every machine.

export function randomSource(seed) {
  let state = seed >>> 0 || 1;
  const next = () => {
    state ^= state << 13;
    state ^= state >>> 17;
    state ^= state << 5;
    return state >>> 0;
  };
  const below = (limit) => next() % limit;
  return { next, below, bytes: (length) => Buffer.from(Array.from({ length }, () => below(256))) };
}
