// SPDX-License-Identifier: Apache-2.0
// What the processor does to a state machine: forced instructions, restart, stop and go.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Bench, CTRL, execOf, pinsOf, shiftOf, TXF } from '../../testing/bench.mjs';

const PIN = 6;
const EXEC_STALLED = 0x80000000;

function prepare(text, options = {}) {
  const bench = new Bench();
  bench.outputs([PIN]);
  bench.load(text, { pins: pinsOf({ set: PIN, setCount: 1, out: PIN, outCount: 1 }), ...options });
  return bench;
}

const sm = (bench) => bench.chip.pio[0].machines[0];

test('a forced instruction acts at once, stopped or not, whatever the divider, and ignores its delay', () => {
  const bench = prepare('end:\njmp end', { clkdiv: 1000 << 16 });
  bench.force('set pins, 1 [7]');
  assert.equal(bench.chip.pads.level(PIN), 1);
  assert.equal(sm(bench).delay, 0);
  bench.enable(1);
  bench.run(3);
  bench.force('set pins, 0');
  assert.equal(bench.chip.pads.level(PIN), 0);
});

test('a forced jump breaks a stall; other instructions leave PC alone', () => {
  const bench = prepare('pull block\nend:\njmp end\nset pins, 1\nend2:\njmp end2');
  bench.enable(1);
  bench.run(10);
  bench.force('set x, 3');
  assert.equal(bench.machine('address'), 0);
  bench.run(5);
  bench.force('jmp 2');
  bench.run(5);
  assert.equal(bench.chip.pads.level(PIN), 1);
  assert.equal(sm(bench).x, 3);
});

test('a forced mov pins, x while the machine is stopped sets safe levels', () => {
  const bench = prepare('set pins, 1\nend:\njmp end');
  bench.enable(1);
  bench.run(5);
  bench.enable(0);
  bench.force('set x, 0');
  bench.force('mov pins, x');
  assert.equal(bench.chip.pads.level(PIN), 0);
});

test('a forced instruction that stalls is latched and shown, and completes later', () => {
  const bench = prepare('end:\njmp end');
  bench.force('pull block');
  assert.equal(bench.machine('exec') & EXEC_STALLED, EXEC_STALLED | 0);
  bench.run(10);
  bench.put(5);
  bench.run(2);
  assert.equal(bench.machine('exec') & EXEC_STALLED, 0);
  assert.equal(sm(bench).osr, 5);
  bench.force('wait 1 gpio 9');
  assert.notEqual(bench.machine('exec') & EXEC_STALLED, 0);
  bench.force('nop');
  assert.equal(bench.machine('exec') & EXEC_STALLED, 0, 'a NOP takes its place');
});

test('SM_RESTART clears shift counters, ISR, delay and latches, not PC, X, Y, OSR', () => {
  const bench = prepare('pull\nout y, 8\nin y, 8\nset x, 4 [31]\nend:\njmp end', { shift: shiftOf({ inRight: false }) });
  bench.put(0xabcd);
  bench.enable(1);
  bench.run(6);
  const machine = sm(bench);
  assert.deepEqual([machine.osrCount, machine.isrCount, machine.isr, machine.x], [8, 8, 0xcd, 4]);
  assert.ok(machine.delay > 0);
  bench.setPio(CTRL, 1 << 4);
  assert.deepEqual([machine.osrCount, machine.isrCount, machine.isr, machine.delay], [32, 0, 0, 0]);
  assert.deepEqual([machine.x, machine.y, machine.osr, machine.pc, machine.enabled], [4, 0xcd, 0xab, 4, false]);
  bench.force('wait 1 gpio 9');
  bench.setPio(CTRL, 1 << 4);
  assert.equal(bench.machine('exec') & EXEC_STALLED, 0);
});

test('a stopped machine keeps its place and goes on', () => {
  const bench = prepare('set pins, 1\nset x, 31\nloop:\njmp x--, loop\nset pins, 0\nend:\njmp end');
  bench.enable(1);
  bench.run(10);
  bench.enable(0);
  bench.run(1000);
  bench.enable(1);
  bench.run(100);
  const [up, down] = bench.recorder.of(PIN);
  assert.equal(down.cycle - up.cycle, 1 + 32 + 1 + 1000);
});

test('CLKDIV_RESTART sets the phase', () => {
  const bench = prepare('set pins, 1\nset pins, 0', { clkdiv: 10 << 16 });
  bench.enable(1);
  bench.run(15);
  bench.enable(1, { restart: true });
  const begin = bench.chip.cycle;
  bench.run(10);
  const fresh = bench.recorder.of(PIN).filter((edge) => edge.cycle > begin);
  assert.deepEqual(fresh.map((edge) => edge.cycle - begin), [10]);
});

test('atomic aliases of CTRL act on the enable bits alone', () => {
  const bench = prepare('nop');
  bench.enable(1);
  bench.write(0x50202000 + CTRL, 2); // set
  assert.equal(bench.pio(CTRL), 3);
  bench.write(0x50203000 + CTRL, 1); // clear
  assert.equal(bench.pio(CTRL), 2);
});

test('a block that goes into reset forgets everything and lets its pins go', () => {
  const bench = prepare('set pins, 1');
  bench.enable(1);
  bench.run(5);
  assert.equal(bench.chip.pads.level(PIN), 1);
  bench.write(0x4000c000, 1 << 10);
  assert.equal(bench.chip.pads.level(PIN), 0, 'pulled down');
  assert.throws(() => bench.pio(CTRL), /holds in reset/);
});

// Cycles: one instruction a clock, delays, dividers, side-set, stalls. Lengths below: positive = high, negative = low.

const BLINKING = 5;
const BLINK = 'set pins, 1 [3]\nset pins, 0 [1]';

function blink(clkdiv, options = {}) {
  const bench = new Bench(options);
  bench.outputs([BLINKING]);
  bench.load(BLINK, { clkdiv, pins: pinsOf({ set: BLINKING, setCount: 1 }) });
  bench.enable(1);
  bench.run(20_000);
  return bench.levelsOf(BLINKING).slice(1);
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
  bench.outputs([BLINKING]);
  bench.load('set pins, 1\nset pins, 0', { clkdiv: 0, pins: pinsOf({ set: BLINKING, setCount: 1 }) });
  bench.enable(1);
  bench.run(4 * 65536);
  assert.deepEqual(bench.levelsOf(BLINKING), [65536, -65536, 65536]);
});

test('side-set takes effect in the first cycle even if the instruction stalls', () => {
  const bench = new Bench();
  bench.outputs([BLINKING]);
  bench.load('out x, 32 side 1 [2]\nnop side 0', {
    sideBits: 1,
    pins: pinsOf({ side: BLINKING, sideCount: 1 }),
    shift: shiftOf({ autopull: true }),
  });
  bench.enable(1);
  bench.run(50);
  assert.equal(bench.chip.pads.level(BLINKING), 1);
  bench.put(1);
  const begin = bench.chip.cycle;
  bench.run(50);
  // The word arrives: one cycle to fill the OSR, one to shift it out, two of delay, then the next instruction lowers the pin.
  assert.deepEqual(bench.recorder.of(BLINKING).map(({ cycle, level }) => [cycle - begin, level]).at(-2), [5, 0]);
});

test('side-set wins over SET on the same pin', () => {
  const bench = new Bench();
  bench.outputs([BLINKING]);
  bench.load('set pins, 0 side 1', { sideBits: 1, pins: pinsOf({ set: BLINKING, setCount: 1, side: BLINKING, sideCount: 1 }) });
  bench.enable(1);
  bench.run(10);
  assert.equal(bench.chip.pads.level(BLINKING), 1);
});

test('pulse trains from the FIFO are exact: low = x + 3, high = y + 1', () => {
  const bench = new Bench();
  bench.outputs([BLINKING]);
  bench.load('out x, 32 side 0\nout y, 32 side 0\nlow:\njmp x--, low side 0\nhigh:\njmp y--, high side 1', {
    sideBits: 1,
    pins: pinsOf({ side: BLINKING, sideCount: 1 }),
    shift: shiftOf({ autopull: true, joinTx: true }),
  });
  for (const word of [5, 0, 10, 3, 0, 100, 1000, 1]) bench.put(word);
  bench.enable(1);
  bench.run(2000);
  assert.deepEqual(bench.levelsOf(BLINKING), [1, -13, 4, -3, 101, -1003, 2]);
});

test('the highest machine wins a pin that two write in the same cycle', () => {
  const bench = new Bench();
  bench.outputs([BLINKING]);
  bench.load('set pins, 0', { machine: 0, origin: 0, pins: pinsOf({ set: BLINKING, setCount: 1 }) });
  bench.load('set pins, 1', { machine: 1, origin: 4, pins: pinsOf({ set: BLINKING, setCount: 1 }) });
  bench.enable(3);
  bench.run(10);
  assert.equal(bench.chip.pads.level(BLINKING), 1);
  assert.equal(bench.recorder.of(BLINKING).length, 1);
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

// Passing over quiet stretches must not change anything: the same edges, words and registers as cycle by cycle.

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
