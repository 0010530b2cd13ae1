// SPDX-License-Identifier: Apache-2.0
// Pins: outputs read back, wires, pulls, the input synchroniser, edge interrupts of IO_BANK0.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Bench, IO_BANK0, PADS_BANK0, pinsOf, SYNC_BYPASS } from '../testing/bench.mjs';

const SIO = 0xd0000000;
const GPIO_IN = SIO + 4;
const OUT_SET = SIO + 0x14;
const OUT_CLEAR = SIO + 0x18;
const OE_SET = SIO + 0x24;
const FUNCTION_SIO = 5;
const IRQ_IO_BANK0 = 1 << 13;
const EDGE_LOW = 4;
const EDGE_HIGH = 8;

function sioOutput(bench, gpio) {
  bench.write(IO_BANK0 + 8 * gpio + 4, FUNCTION_SIO);
  bench.write(OE_SET, 1 << gpio);
}

test('after power-up a pin is an input that is enabled and pulled down', () => {
  const bench = new Bench();
  assert.equal(bench.read(PADS_BANK0 + 4), 0x56);
  bench.drive(0, 1);
  assert.equal(bench.read(GPIO_IN), 1);
  bench.drive(0, 2);
  assert.equal(bench.read(GPIO_IN), 0);
});

test('an output of SIO is read back on the same pin, by SIO and by the PIO', () => {
  const bench = new Bench();
  sioOutput(bench, 3);
  bench.load('wait 1 gpio 3\nset x, 1\nend:\njmp end');
  bench.enable(1);
  bench.run(10);
  bench.write(OUT_SET, 1 << 3);
  assert.equal(bench.read(GPIO_IN), 1 << 3);
  bench.run(10);
  assert.equal(bench.chip.pio[0].machines[0].x, 1);
});

test('an output of the PIO is read back through SIO', () => {
  const bench = new Bench();
  bench.outputs([7]);
  bench.setMachine('pins', pinsOf({ set: 7, setCount: 1 }));
  bench.force('set pins, 1');
  assert.equal(bench.read(GPIO_IN), 1 << 7);
});

test('a wire takes a level from pin to pin, and on', () => {
  const bench = new Bench();
  sioOutput(bench, 1);
  bench.chip.pads.join(1, 20);
  bench.chip.pads.join(20, 21);
  bench.write(OUT_SET, 1 << 1);
  assert.equal(bench.read(GPIO_IN), (1 << 1) | (1 << 20) | (1 << 21));
  bench.chip.pads.cutAll();
  assert.equal(bench.read(GPIO_IN), 1 << 1);
});

test('pulls hold a pin that nobody drives; the pad may cut the output off and the input off', () => {
  const bench = new Bench();
  bench.write(PADS_BANK0 + 4 + 4 * 2, 0x4a); // input enabled, pull-up
  assert.equal(bench.read(GPIO_IN), 1 << 2);
  sioOutput(bench, 2);
  assert.equal(bench.read(GPIO_IN), 0);
  bench.write(PADS_BANK0 + 4 + 4 * 2, 0xca); // output disabled
  assert.equal(bench.read(GPIO_IN), 1 << 2);
  bench.write(PADS_BANK0 + 4 + 4 * 2, 0x0a); // input disabled
  assert.equal(bench.read(GPIO_IN), 0);
});

test('two drivers that disagree are noted', () => {
  const bench = new Bench();
  sioOutput(bench, 4);
  bench.drive(4, 0);
  bench.run(10);
  assert.equal(bench.chip.pads.contention.size, 0);
  bench.write(OUT_SET, 1 << 4);
  assert.deepEqual([...bench.chip.pads.contention], [[4, 10]]);
});

test('the PIO sees an input two cycles late, or at once with INPUT_SYNC_BYPASS', () => {
  for (const [bypass, delay] of [[0, 4], [1 << 9, 2]]) {
    const bench = new Bench();
    bench.outputs([0]);
    bench.load('wait 1 gpio 9\nset pins, 1\nend:\njmp end', { pins: pinsOf({ set: 0, setCount: 1 }) });
    bench.setPio(SYNC_BYPASS, bypass);
    bench.enable(1);
    bench.run(37);
    bench.drive(9, 1);
    const begin = bench.chip.cycle;
    bench.run(20);
    // The wait is met in the cycle in which it sees the level, the set follows, its level stands from the next cycle on.
    assert.equal(bench.recorder.of(0)[0].cycle - begin, delay);
  }
});

test('edge interrupts: each edge once, cleared by writing 1, nothing without a change', () => {
  const bench = new Bench();
  const line = () => bench.chip.nvic.lines & IRQ_IO_BANK0;
  bench.write(IO_BANK0 + 0x100 + 4 * 2, (EDGE_HIGH | EDGE_LOW) << 0); // INTE2: GPIO16
  bench.drive(16, 0);
  assert.equal(line(), 0, 'the level did not change');
  bench.drive(16, 1);
  assert.equal(line(), IRQ_IO_BANK0);
  assert.equal(bench.read(IO_BANK0 + 0x120 + 4 * 2) & 15, EDGE_HIGH);
  bench.write(IO_BANK0 + 0xf0 + 4 * 2, EDGE_HIGH);
  assert.equal(line(), 0);
  bench.drive(16, 1);
  assert.equal(line(), 0);
  bench.drive(16, 0);
  assert.equal(bench.read(IO_BANK0 + 0x120 + 4 * 2) & 15, EDGE_LOW);
});

test('an edge interrupt through a wire from a PIO output', () => {
  const bench = new Bench();
  bench.outputs([0]);
  bench.chip.pads.join(0, 19);
  bench.write(IO_BANK0 + 0x100 + 4 * 2, EDGE_HIGH << 12); // GPIO19
  bench.setMachine('pins', pinsOf({ set: 0, setCount: 1 }));
  bench.force('set pins, 1');
  assert.equal(bench.chip.nvic.lines & IRQ_IO_BANK0, IRQ_IO_BANK0);
  bench.write(OUT_CLEAR, 0);
});
