// SPDX-License-Identifier: Apache-2.0
// DMA into and out of the PIO: pace, requests, rings, chains.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Bench, DMA, pinsOf, PIO, shiftOf, TXF } from '../testing/bench.mjs';

const RAM = 0x20000000;
const WORD = 2 << 2;
const INCREMENT_READ = 1 << 4;
const INCREMENT_WRITE = 1 << 5;
const QUIET = 1 << 21;
const PERMANENT = 0x3f;

function channel(bench, index, { read, write, count, request = PERMANENT, flags, chain = index }) {
  const base = DMA + 0x40 * index;
  bench.write(base, read);
  bench.write(base + 4, write);
  bench.write(base + 8, count);
  bench.write(base + 0xc, 1 | WORD | flags | (chain << 11) | (request << 15) | QUIET);
}

const fill = (bench, words) => words.forEach((word, i) => bench.write(RAM + 4 * i, word));
const busy = (bench, index) => (bench.read(DMA + 0x40 * index + 0xc) >>> 24) & 1;

test('a transfer takes one cycle', () => {
  const bench = new Bench();
  fill(bench, [1, 2, 3, 4, 5, 6, 7, 8]);
  channel(bench, 0, { read: RAM, write: RAM + 0x100, count: 8, flags: INCREMENT_READ | INCREMENT_WRITE });
  bench.run(7);
  assert.equal(busy(bench, 0), 1);
  bench.run(1);
  assert.equal(busy(bench, 0), 0);
  assert.equal(bench.read(RAM + 0x11c), 8);
});

test('it keeps a state machine fed at two words every seven cycles', () => {
  const bench = new Bench();
  bench.outputs([5]);
  bench.load('out x, 32 side 0\nout y, 32 side 0\nlow:\njmp x--, low side 0\nhigh:\njmp y--, high side 1', {
    sideBits: 1,
    pins: pinsOf({ side: 5, sideCount: 1 }),
    shift: shiftOf({ autopull: true, joinTx: true }),
  });
  const pulses = 500;
  fill(bench, Array.from({ length: 2 * pulses }, (_, i) => (i % 2 ? 2 : 1)));
  channel(bench, 0, { read: RAM, write: PIO[0] + TXF, count: 2 * pulses, request: 0, flags: INCREMENT_READ });
  bench.run(50);
  bench.enable(1);
  bench.run(7 * pulses + 50);
  const lengths = bench.levelsOf(5);
  assert.equal(lengths.length, 2 * pulses - 1);
  assert.deepEqual([...new Set(lengths)].sort(), [-4, 3]);
});

test('words of a state machine reach a ring in memory', () => {
  const bench = new Bench();
  bench.load('in x, 32\njmp x--, again\nagain:\nnop [20]', { shift: shiftOf({ autopush: true }) });
  const ring = (4 << 6) | (1 << 10); // 16 bytes, on the write side
  channel(bench, 1, { read: PIO[0] + 0x20, write: RAM + 0x40, count: 1000, request: 4, flags: INCREMENT_WRITE | ring });
  bench.enable(1);
  bench.run(23 * 10);
  const words = [0, 1, 2, 3].map((i) => bench.read(RAM + 0x40 + 4 * i) | 0);
  assert.deepEqual(words.sort((a, b) => b - a), [-6, -7, -8, -9]);
  assert.equal(bench.read(RAM + 0x50), 0, 'nothing beyond the ring');
});

test('a chain starts the next channel, and an abort is over at once', () => {
  const bench = new Bench();
  fill(bench, [7, 8]);
  channel(bench, 3, { read: RAM + 4, write: RAM + 0x204, count: 1, flags: 0 });
  bench.run(5);
  bench.write(RAM + 0x204, 0);
  bench.write(DMA + 0x40 * 3 + 8, 1);
  channel(bench, 2, { read: RAM, write: RAM + 0x200, count: 1, flags: 0, chain: 3 });
  bench.run(5);
  assert.deepEqual([bench.read(RAM + 0x200), bench.read(RAM + 0x204)], [7, 8]);
  channel(bench, 4, { read: RAM, write: RAM + 0x300, count: 1000, flags: 0 });
  bench.run(5);
  bench.write(DMA + 0x444, 1 << 4);
  assert.equal(bench.read(DMA + 0x444), 0);
  assert.equal(busy(bench, 4), 0);
});

test('an address without anything is a bus error: the channel halts and says so', () => {
  const SIO = 0xd0000000;
  const flags = INCREMENT_READ | INCREMENT_WRITE;
  for (const [read, write, bit] of [[0x30000000, RAM, 30], [RAM, 0x60000000, 29], [SIO, RAM, 30], [RAM, SIO, 29]]) {
    const bench = new Bench();
    channel(bench, 2, { read, write, count: 4, flags });
    bench.run(10);
    const control = bench.read(DMA + 0x80 + 0xc);
    assert.equal((control >>> 24) & 0xe1, (1 << 7) | (1 << (bit - 24)), 'not busy, one error, and their sum');
    assert.equal(bench.read(DMA + 0x400), 1 << 2, 'its interrupt, although it is quiet');
    assert.equal(bench.read(DMA + 0x80 + 8), 4, 'nothing was transferred');
    bench.write(DMA + 0x80 + 0x10 + 0x2000, 1 << bit); // writing 1 clears it
    assert.equal(bench.read(DMA + 0x80 + 0xc) >>> 29, 0);
  }
});

test('an error in the middle of a ring in memory keeps what was transferred', () => {
  const bench = new Bench();
  fill(bench, [1, 2, 3, 4]);
  channel(bench, 0, { read: RAM + 0x41ff8, write: RAM, count: 4, flags: INCREMENT_READ | INCREMENT_WRITE });
  bench.run(10);
  assert.equal(bench.read(DMA + 0xc) >>> 29, 0b110, 'the end of the memory');
  assert.equal(bench.read(DMA + 8), 2);
});
