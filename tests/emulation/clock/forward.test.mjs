// SPDX-License-Identifier: Apache-2.0
// Passing over quiet stretches must not change anything: the same edges, words and registers as cycle by cycle.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Bench, execOf, pinsOf, shiftOf } from '../testing/bench.mjs';

const PULSES = 'out x, 32 side 0\nout y, 32 side 0\nlow:\njmp x--, low side 0\nhigh:\njmp y--, high side 1';
const STAMPS = 'mov x, !null\nlow:\njmp pin, rise\njmp x--, low\njmp low\nrise:\nin x, 32\njmp x--, high\nhigh:\njmp pin, high2\njmp low\nhigh2:\njmp x--, high';

/** A seeded stream of numbers (xorshift32). */
function* randoms(seed) {
  for (let state = seed; ; ) {
    state ^= state << 13;
    state ^= state >>> 17;
    state ^= state << 5;
    yield state >>> 0;
  }
}

/** Trains on one block, stamps of a wire and of a random input on the other, words put in at odd times, stops and starts. */
function scene(fastForward, seed, { clkdiv = 0x10000 } = {}) {
  const bench = new Bench({ fastForward });
  const random = randoms(seed);
  const next = (below) => random.next().value % below;
  bench.outputs([2, 3]);
  for (const machine of [0, 1]) {
    bench.load(PULSES, { machine, sideBits: 1, clkdiv, pins: pinsOf({ side: 2 + machine, sideCount: 1 }), shift: shiftOf({ autopull: true, joinTx: true }) });
  }
  for (const [machine, jumpPin] of [[0, 20], [1, 21]]) {
    bench.load(STAMPS, { block: 1, machine, exec: execOf({ jumpPin }), shift: shiftOf({ autopush: true, joinRx: true }) });
  }
  bench.chip.pads.join(2, 20);
  bench.enable(3);
  bench.enable(3, { block: 1 });
  const words = [];
  let level = 0;
  for (let round = 0; round < 60; round++) {
    for (const machine of [0, 1]) if (next(3)) for (let i = 0; i < 2; i++) bench.put(next(next(8) ? 60 : 20_000), machine);
    if (next(2)) bench.drive(21, (level ^= 1));
    if (next(12) === 0) bench.setPio(0, next(4));
    if (next(6) === 0) bench.setPio(0, 3);
    bench.run(1 + next(next(4) ? 200 : 30_000));
    for (const machine of [0, 1]) if (next(2)) words.push(bench.get(machine, 1));
  }
  bench.chip.settle();
  const state = bench.chip.pio.flatMap((block) => block.machines.map(({ pc, x, y, osr, isr, delay, phase }) => [pc, x, y, osr, isr, delay, phase]));
  const { stepped, cycle: cycles } = bench.chip.scheduler;
  return { hash: bench.recorder.hash(), edges: bench.recorder.edges.length, words, state, debug: bench.pio(8), stepped, cycles };
}

for (const clkdiv of [0x10000, (3 << 16) | (64 << 8)]) {
  test(`same edges, words and state with a divider of ${clkdiv / 65536}`, () => {
    let [edges, stepped, cycles] = [0, 0, 0];
    for (let seed = 1; seed <= 12; seed++) {
      const { stepped: slow, ...expected } = scene(false, seed, { clkdiv });
      const { stepped: fast, ...got } = scene(true, seed, { clkdiv });
      assert.deepEqual(got, expected, `seed ${seed}`);
      assert.equal(slow, expected.cycles);
      [edges, stepped, cycles] = [edges + expected.edges, stepped + fast, cycles + expected.cycles];
    }
    assert.ok(edges > 500, `${edges} edges say too little`);
    assert.ok(stepped < cycles / 4, `${stepped} of ${cycles} cycles were taken one by one`);
  });
}
