// SPDX-License-Identifier: Apache-2.0
// Cycles: one instruction a clock, delays, dividers, side-set, stalls. Lengths below: positive = high, negative = low.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Bench, TXF, pinsOf, shiftOf } from '../../testing/bench.mjs';

const PIN = 5;
const BLINK = 'set pins, 1 [3]\nset pins, 0 [1]';

function blink(clkdiv, options = {}) {
  const bench = new Bench(options);
  bench.outputs([PIN]);
  bench.load(BLINK, { clkdiv, pins: pinsOf({ set: PIN, setCount: 1 }) });
  bench.enable(1);
  bench.run(20_000);
  return bench.levelsOf(PIN).slice(1);
}

test('an instruction takes one cycle plus its delay', () => {
  const lengths = blink(0x10000);
  assert.ok(lengths.length > 6000);
  assert.deepEqual([...new Set(lengths)].sort(), [-2, 4]);
});

test('whole dividers stretch every clock', () => {
  assert.deepEqual([...new Set(blink(2 << 16))].sort(), [-4, 8]);
  assert.deepEqual([...new Set(blink(125 << 16))].sort(), [-250, 500]);
});

test('a fractional divider is exact over its period', () => {
  // 2.5 cycles a clock: 4 clocks are 10 cycles, 2 clocks are 5.
  assert.deepEqual([...new Set(blink((2 << 16) | (128 << 8)))].sort(), [-5, 10]);
  // 1 + 1/256: 6 clocks are 6 + 6/256 cycles; the mean must come out.
  const lengths = blink((1 << 16) | (1 << 8));
  const periods = Math.floor(lengths.length / 2);
  const cycles = lengths.slice(0, 2 * periods).reduce((sum, each) => sum + Math.abs(each), 0);
  assert.ok(Math.abs(cycles - periods * 6 * (257 / 256)) <= 1);
});

test('a divider of 0 means 65536', () => {
  const bench = new Bench();
  bench.outputs([PIN]);
  bench.load('set pins, 1\nset pins, 0', { clkdiv: 0, pins: pinsOf({ set: PIN, setCount: 1 }) });
  bench.enable(1);
  bench.run(4 * 65536);
  assert.deepEqual(bench.levelsOf(PIN), [65536, -65536, 65536]);
});

test('side-set takes effect in the first cycle even if the instruction stalls', () => {
  const bench = new Bench();
  bench.outputs([PIN]);
  bench.load('out x, 32 side 1 [2]\nnop side 0', {
    sideBits: 1,
    pins: pinsOf({ side: PIN, sideCount: 1 }),
    shift: shiftOf({ autopull: true }),
  });
  bench.enable(1);
  bench.run(50);
  assert.equal(bench.chip.pads.level(PIN), 1);
  bench.put(1);
  const begin = bench.chip.cycle;
  bench.run(50);
  // The word arrives: one cycle to fill the OSR, one to shift it out, two of delay, then the next instruction lowers the pin.
  assert.deepEqual(bench.recorder.of(PIN).map(({ cycle, level }) => [cycle - begin, level]).at(-2), [5, 0]);
});

test('side-set wins over SET on the same pin', () => {
  const bench = new Bench();
  bench.outputs([PIN]);
  bench.load('set pins, 0 side 1', { sideBits: 1, pins: pinsOf({ set: PIN, setCount: 1, side: PIN, sideCount: 1 }) });
  bench.enable(1);
  bench.run(10);
  assert.equal(bench.chip.pads.level(PIN), 1);
});

test('pulse trains from the FIFO are exact: low = x + 3, high = y + 1', () => {
  const bench = new Bench();
  bench.outputs([PIN]);
  bench.load('out x, 32 side 0\nout y, 32 side 0\nlow:\njmp x--, low side 0\nhigh:\njmp y--, high side 1', {
    sideBits: 1,
    pins: pinsOf({ side: PIN, sideCount: 1 }),
    shift: shiftOf({ autopull: true, joinTx: true }),
  });
  for (const word of [5, 0, 10, 3, 0, 100, 1000, 1]) bench.put(word);
  bench.enable(1);
  bench.run(2000);
  assert.deepEqual(bench.levelsOf(PIN), [1, -13, 4, -3, 101, -1003, 2]);
});

test('the highest machine wins a pin that two write in the same cycle', () => {
  const bench = new Bench();
  bench.outputs([PIN]);
  bench.load('set pins, 0', { machine: 0, origin: 0, pins: pinsOf({ set: PIN, setCount: 1 }) });
  bench.load('set pins, 1', { machine: 1, origin: 4, pins: pinsOf({ set: PIN, setCount: 1 }) });
  bench.enable(3);
  bench.run(10);
  assert.equal(bench.chip.pads.level(PIN), 1);
  assert.equal(bench.recorder.of(PIN).length, 1);
});

test('all machines enabled by one write start in the same cycle, over both blocks in the same order every time', () => {
  const bench = new Bench();
  bench.outputs([2, 3], 0);
  for (const [machine, gpio] of [[0, 2], [1, 3]]) {
    bench.load(`set pins, 1\nstop${machine}:\njmp stop${machine}`, { machine, origin: 4 * machine, pins: pinsOf({ set: gpio, setCount: 1 }) });
  }
  bench.enable(3);
  bench.run(10);
  const [first, second] = bench.recorder.edges.filter((edge) => edge.level === 1);
  assert.equal(first.cycle, second.cycle);
});

test('pin groups wrap round pin 31', () => {
  const bench = new Bench();
  bench.outputs([0, 29]);
  bench.load('set pins, 31', { pins: pinsOf({ set: 29, setCount: 4 }) });
  bench.enable(1);
  bench.run(5);
  assert.equal(bench.chip.pads.level(29), 1);
  assert.equal(bench.chip.pads.level(0), 1);
});

test('a full FIFO keeps what it has', () => {
  const bench = new Bench();
  bench.load('nop');
  for (let i = 0; i < 5; i++) bench.put(i);
  assert.equal(bench.pio(0x08), 1 << 16);
  assert.equal(bench.pio(0x0c) & 15, 4);
  assert.equal(bench.pio(TXF), 0);
});
