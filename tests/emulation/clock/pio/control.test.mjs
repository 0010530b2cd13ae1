// SPDX-License-Identifier: Apache-2.0
// What the processor does to a state machine: forced instructions, restart, stop and go.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Bench, CTRL, pinsOf, shiftOf } from '../../testing/bench.mjs';

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
