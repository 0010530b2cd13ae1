// SPDX-License-Identifier: Apache-2.0
// Timers, interrupts, watchdog and memory, as a program on the processor meets them (images/*.cpp).

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { delays, levels, statistics } from '../edges/edges.mjs';
import { Bench } from '../testing/bench.mjs';
import { boardWith, results } from '../testing/images.mjs';
import { CYCLES_PER_MICROSECOND } from './time.mjs';

// A handler begins at an instruction boundary: the longest instruction here takes 4 cycles (store to a peripheral).
const BOUNDARY = 4;

test('TIMER alarms keep true microseconds: no drift, jitter of one instruction', () => {
  const board = boardWith('timer');
  board.runMilliseconds(20);
  const edges = board.recorder.of(2);
  assert.equal(edges.length, 200);
  const phases = edges.map((edge, i) => edge.cycle - edges[0].cycle - i * 50 * CYCLES_PER_MICROSECOND);
  // SysTick's handler may be in the way of the alarm's: entry, body and return, under 60 cycles.
  assert.ok(statistics(phases).jitter < 60, `phases from ${statistics(phases).min} to ${statistics(phases).max}`);
  const usual = phases.slice().sort((a, b) => a - b)[Math.floor(phases.length / 2)];
  assert.ok(phases.filter((phase) => Math.abs(phase - usual) <= BOUNDARY).length > 0.8 * phases.length);
});

test('SysTick has a period of its reload value plus one', () => {
  const board = boardWith('timer');
  board.runMilliseconds(11);
  const edges = board.recorder.of(4);
  assert.ok(edges.length > 1000);
  const last = edges.length - 1;
  const drift = edges[last].cycle - edges[0].cycle - 1000 * last;
  assert.ok(Math.abs(drift) < 60, `${drift} cycles over ${last} periods`);
  assert.equal(statistics(levels(edges).map((each) => Math.round(each.cycles / 100))).jitter, 0);
});

test('SysTick counts every cycle and reloads after 0; CVR clears it', () => {
  const bench = new Bench();
  const [csr, rvr, cvr] = [0xe000e010, 0xe000e014, 0xe000e018];
  bench.write(rvr, 99);
  bench.write(cvr, 1);
  bench.write(csr, 5);
  assert.equal(bench.read(cvr), 0);
  const seen = [1, 1, 97, 1, 1, 1].map((cycles) => (bench.run(cycles), bench.read(cvr)));
  assert.deepEqual(seen, [99, 98, 1, 0, 99, 98]);
  assert.equal(bench.read(csr), 0x10005, 'it passed 0');
  assert.equal(bench.read(csr), 5, 'reading clears that');
  bench.run(1_000_000);
  assert.equal(bench.read(cvr), 98, 'ten thousand periods later');
});

test('TIMER stands until the tick is on, counts microseconds, carries into the upper word, and can be paused', () => {
  const bench = new Bench();
  const [high, low, rawHigh, rawLow, pause] = [0x00, 0x04, 0x24, 0x28, 0x30].map((offset) => 0x40054000 + offset);
  bench.run(1000);
  assert.equal(bench.read(rawLow), 0);
  bench.write(0x4005802c, 0x200 | 12);
  bench.run(12_499);
  assert.equal(bench.read(rawLow), 99);
  bench.run(1);
  assert.equal(bench.read(rawLow), 100);
  bench.write(low, 0xfffffffe);
  bench.write(high, 6);
  bench.run(250);
  assert.deepEqual([bench.read(rawHigh), bench.read(rawLow)], [7, 0]);
  assert.deepEqual([bench.read(0x4005400c), bench.read(0x40054008)], [0, 7], 'the latched pair');
  bench.write(pause, 1);
  bench.run(10_000);
  assert.equal(bench.read(rawLow), 0);
});

test('two runs are the same, with and without fast-forward', () => {
  const hashes = [true, true, false].map((fastForward) => {
    const board = boardWith('timer', { fastForward });
    board.runMilliseconds(3);
    return board.recorder.hash();
  });
  assert.equal(hashes[0], hashes[1]);
  assert.equal(hashes[0], hashes[2]);
});

test('priorities, nesting, sleep under PRIMASK, pending and unpending', () => {
  const board = boardWith('interrupts');
  board.runMilliseconds(5);
  assert.equal(String.fromCharCode(...results(board)), 'stSg1wa23a4.');
});

test('exception entry takes 15 cycles', () => {
  const board = boardWith('timer');
  let fired = -1;
  const timer = board.chip.timer;
  const updateLines = timer.updateLines.bind(timer);
  timer.updateLines = () => {
    if (timer.raw && fired < 0) fired = board.cycle;
    updateLines();
  };
  board.runMilliseconds(1, () => board.recorder.of(2).length > 0);
  const latency = board.recorder.of(2)[0].cycle - fired;
  // Entry, then what the compiler puts before the toggle: push (up to 4), loads and the store.
  assert.ok(latency >= 15 && latency <= 15 + 2 * BOUNDARY + 16, `${latency} cycles`);
});

test('the watchdog resets the chip once each time; scratch, SRAM and the reason survive', () => {
  const board = boardWith('watchdog');
  board.runMilliseconds(50);
  assert.equal(board.chip.resetCount, 3);
  const told = results(board);
  const ofLife = (life) => told.slice(3 * life, 3 * life + 3);
  const inReset = ofLife(0)[1];
  assert.equal(told.length, 12, 'four lives: SRAM kept the count');
  assert.deepEqual([0, 1, 2, 3].map((life) => ofLife(life)[0]), [0, 1, 1, 2], 'power-up, timer, timer, forced');
  for (const life of [0, 1, 2, 3]) assert.deepEqual(ofLife(life).slice(1), [inReset, 1]);
});

test('the watchdog takes its time exactly, and a reset lets the pins go', () => {
  const board = boardWith('watchdog');
  board.runMilliseconds(50);
  const high = levels(board.recorder.of(3)).filter((each) => each.level === 1).slice(0, 2);
  for (const { cycles } of high) assert.ok(Math.abs(cycles - 500 * CYCLES_PER_MICROSECOND) < 60, `${cycles}`);
});

test('a plain store to flash is an error that names the place', () => {
  const board = boardWith('badstore');
  assert.throws(() => board.runMilliseconds(1), { name: 'EmulationFault', message: /store to flash at 0x10008000.*pc 0x10000/ });
});

test('a block in reset, ROM, the second core: errors too', () => {
  const board = boardWith('timer');
  const { rp2040 } = board.chip;
  assert.throws(() => rp2040.readUint32(0x50200000), /in reset \(bit 10\)/);
  assert.throws(() => rp2040.writeUint32(0x10, 1), /store to ROM/);
  assert.throws(() => rp2040.readUint32(0xd0000050), /second core/);
  assert.throws(() => rp2040.readUint32(0x60000000), /invalid memory/);
});

// Everything at once (images/trains.cpp): PIO fed by DMA, a busy processor, interrupts.

const lowOf = [(i) => 40 + 2 * i + 3, () => 303];
const highOf = [(i) => i + 1, (i) => 6 * i + 1];

function assertExact(edges, machine) {
  levels(edges).forEach(({ level, cycles }, i) => {
    const index = Math.floor((i + 1) / 2) % 32;
    assert.equal(cycles, (level ? highOf : lowOf)[machine](index), `stretch ${i} of machine ${machine}`);
  });
}

test('100,000 edges are exact to the cycle', () => {
  const board = boardWith('trains');
  board.runMilliseconds(45);
  const [first, second] = [board.recorder.of(2), board.recorder.of(3)];
  assert.ok(first.length + second.length > 100_000, `${first.length + second.length} edges`);
  for (const edges of [first, second]) assert.equal(edges[0].level, 1);
  assertExact(first, 0);
  assertExact(second, 1);
});

test('fast-forward and slow DMA give the same trains', () => {
  const hash = (options) => {
    const board = boardWith('trains', options);
    board.stimuli.pulse(6, 10_007, 1000);
    board.runMilliseconds(2);
    board.recorder.edges = board.recorder.edges.filter((edge) => edge.gpio !== 7 || options.withProcessor);
    return board.recorder.hash();
  };
  assert.equal(hash({ fastForward: true, withProcessor: true }), hash({ fastForward: false, withProcessor: true }));
  assert.equal(hash({ dmaCycles: 1 }), hash({ dmaCycles: 8 }), 'joined FIFOs hide eight cycles a word');
});

test('an edge interrupt is answered after entry and a few instructions, and delayed by no more than the other handler', () => {
  const board = boardWith('trains');
  board.runMilliseconds(1);
  board.stimuli.pulse(6, 10_007, 1000);
  board.runMilliseconds(5);
  const latency = statistics(delays(board.recorder.of(6), board.recorder.of(7)));
  assert.ok(latency.count > 450);
  // Entry 15 cycles; before the store the handler loads two constants and may push registers; an instruction of up to 4 is finished first.
  assert.ok(latency.min >= 15 && latency.max <= 15 + 4 + 16 + 15, `${latency.min} to ${latency.max} cycles`);
});
