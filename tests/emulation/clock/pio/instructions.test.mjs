// SPDX-License-Identifier: Apache-2.0
// Each instruction by its paragraph of the data sheet, in the ways that the board's programs use it.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Bench, execOf, FDEBUG, FLEVEL, IRQ, IRQ_FORCE, pinsOf, RX_STALL, RX_UNDER, shiftOf, TX_OVER, TX_STALL } from '../../testing/bench.mjs';

const PIN = 4;

function prepare(text, options = {}) {
  const bench = new Bench();
  bench.outputs([PIN, PIN + 1]);
  bench.load(text, { pins: pinsOf({ out: PIN, outCount: 2, set: PIN, setCount: 2 }), ...options });
  return bench;
}

const sm = (bench, index = 0) => bench.chip.pio[0].machines[index];

test('pull block stalls on an empty FIFO and sets TXSTALL until it is cleared', () => {
  const bench = prepare('pull block\nmov x, osr\nend:\njmp end');
  bench.enable(1);
  bench.run(10);
  assert.equal(bench.pio(FDEBUG), TX_STALL(0));
  bench.setPio(FDEBUG, TX_STALL(0));
  assert.equal(bench.pio(FDEBUG), 0);
  bench.run(1);
  assert.equal(bench.pio(FDEBUG), TX_STALL(0), 'it still stalls');
  bench.put(77);
  bench.run(5);
  bench.setPio(FDEBUG, TX_STALL(0));
  bench.run(5);
  assert.equal(bench.pio(FDEBUG), 0);
  assert.equal(sm(bench).x, 77);
});

test('pull noblock on an empty FIFO copies X and is no stall', () => {
  const bench = prepare('set x, 9\npull noblock\nmov y, osr\nend:\njmp end');
  bench.enable(1);
  bench.run(10);
  assert.equal(sm(bench).y, 9);
  assert.equal(bench.pio(FDEBUG), 0);
});

test('pull ifempty does nothing before the threshold, with or without autopull', () => {
  const bench = prepare('pull\nout x, 8\npull ifempty\nmov y, osr\nend:\njmp end', { shift: shiftOf({ pull: 16 }) });
  bench.put(0x1234);
  bench.put(0xffff);
  bench.enable(1);
  bench.run(10);
  assert.equal(sm(bench).x, 0x34);
  assert.equal(sm(bench).y, 0x12);
});

test('out by every count and direction', () => {
  for (const outRight of [true, false]) {
    const bench = prepare('pull\nout x, 12\nout y, 20\nend:\njmp end', { shift: shiftOf({ outRight }) });
    bench.put(0xabcdef12);
    bench.enable(1);
    bench.run(10);
    assert.deepEqual([sm(bench).x, sm(bench).y], outRight ? [0xf12, 0xabcde] : [0xabc, 0xdef12]);
  }
});

test('out pins and out pindirs use the OUT group only', () => {
  const bench = prepare('pull\nout pins, 4\nend:\njmp end');
  bench.put(0b1110);
  bench.enable(1);
  bench.run(10);
  assert.equal(bench.chip.pio[0].values, 0b10 << PIN, 'two pins are mapped');
});

test('autopull: an OSR that is used up costs one cycle to fill', () => {
  const bench = prepare('out pins, 1', { shift: shiftOf({ autopull: true, pull: 2 }) });
  bench.enable(1);
  bench.run(4);
  assert.equal(bench.pio(FDEBUG), TX_STALL(0));
  for (const word of [0b01, 0b01, 0b01]) bench.put(word);
  const begin = bench.chip.cycle;
  bench.run(20);
  // Fill at cycle 0, then bits 1 0 1 0 1 0 without a gap: filled again while the last bit goes out.
  assert.deepEqual(bench.recorder.of(PIN).map((edge) => edge.cycle - begin), [2, 3, 4, 5, 6, 7]);
});

test('autopull in the background, and PULL as a fence', () => {
  const bench = prepare('out x, 32\nnop [3]\npull\nmov y, osr\nend:\njmp end', { shift: shiftOf({ autopull: true }) });
  bench.put(1);
  bench.put(2);
  bench.put(3);
  bench.enable(1);
  bench.run(20);
  assert.deepEqual([sm(bench).x, sm(bench).y], [1, 2], 'PULL found the OSR full and took nothing');
  assert.equal(bench.pio(FLEVEL) & 15, 1);
});

test('out pc jumps', () => {
  const bench = prepare('pull\nout pc, 5\nset x, 1\nend:\njmp end\nset y, 7\nend2:\njmp end2');
  bench.put(4);
  bench.enable(1);
  bench.run(10);
  assert.deepEqual([sm(bench).x, sm(bench).y], [0, 7]);
});

test('out exec: one cycle for itself, its delay is ignored, that of the instruction counts, and PC waits', () => {
  const bench = prepare('pull\nout exec, 16 [7]\nset pins, 0\nend:\njmp end');
  bench.put(0xe001 | (3 << 8)); // set pins, 1 [3]
  bench.enable(1);
  bench.run(20);
  const [up, down] = bench.recorder.of(PIN);
  assert.deepEqual([up.level, down.level], [1, 0]);
  assert.equal(down.cycle - up.cycle, 4);
  assert.equal(up.cycle, 3, 'pull, out, set');
});

test('out exec of a wait stalls until the pin comes, two cycles after it', () => {
  const bench = prepare('pull\nout exec, 16\nset pins, 1\nend:\njmp end');
  bench.put(0x2080 | 9); // wait 1 gpio 9
  bench.enable(1);
  bench.run(50);
  assert.equal(bench.recorder.of(PIN).length, 0);
  bench.drive(9, 1);
  const begin = bench.chip.cycle;
  bench.run(20);
  assert.equal(bench.recorder.of(PIN)[0].cycle - begin, 4, 'two of synchroniser, the wait, the set');
});

test('mov exec and mov pc', () => {
  const bench = prepare('pull\nmov exec, osr\nset y, 3\nmov pc, y\nend:\njmp end');
  bench.put(0xe025); // set x, 5
  bench.enable(1);
  bench.run(4);
  assert.equal(sm(bench).x, 5);
  assert.equal(sm(bench).y, 3);
});

test('mov with inversion, reversal and STATUS', () => {
  const bench = prepare('set x, 5\nmov y, !x\nmov isr, ::x\nmov x, status\nend:\njmp end', { exec: execOf({ statusLevel: 1 }) });
  bench.enable(1);
  bench.run(10);
  assert.deepEqual([sm(bench).y, sm(bench).isr, sm(bench).x], [0xfffffffa, 0xa0000000, 0xffffffff]);
});

test('in from pins starts at the IN base and wraps', () => {
  const bench = prepare('in pins, 3\npush\nend:\njmp end', { pins: pinsOf({ input: 10 }), shift: shiftOf({ inRight: false }) });
  bench.drive(10, 1);
  bench.drive(12, 1);
  bench.run(5);
  bench.enable(1);
  bench.run(5);
  assert.equal(bench.get(), 0b101);
});

test('autopush stalls on a full FIFO, sets RXSTALL and loses nothing', () => {
  const bench = prepare('in x, 32\njmp x--, again\nagain:\nnop', { shift: shiftOf({ autopush: true }) });
  bench.enable(1);
  bench.run(100);
  assert.equal(bench.pio(FDEBUG), RX_STALL(0));
  const words = [];
  for (let i = 0; i < 8; i++) {
    words.push(bench.get());
    bench.run(10);
  }
  assert.deepEqual(words, [0, 1, 2, 3, 4, 5, 6, 7].map((i) => -i >>> 0));
});

test('push noblock on a full FIFO drops the word, clears the ISR and sets RXSTALL', () => {
  const bench = prepare('mov isr, !null\npush noblock');
  bench.enable(1);
  bench.run(11);
  assert.equal(bench.pio(FDEBUG), RX_STALL(0));
  assert.equal((bench.pio(FLEVEL) >>> 4) & 15, 4);
});

test('TXOVER and RXUNDER', () => {
  const bench = prepare('nop');
  for (let i = 0; i < 5; i++) bench.put(i);
  bench.get();
  assert.equal(bench.pio(FDEBUG), (TX_OVER(0) | RX_UNDER(0)) >>> 0);
  bench.setPio(FDEBUG, TX_OVER(0));
  assert.equal(bench.pio(FDEBUG), RX_UNDER(0));
});

test('jmp on every condition', () => {
  const program = 'set x, 2\nset y, 2\njmp x!=y, bad\njmp !x, bad\nloop:\njmp x--, loop\nmov isr, x\njmp pin, good\nbad:\njmp bad\ngood:\njmp good';
  const bench = prepare(program, { exec: execOf({ jumpPin: 7 }) });
  bench.drive(7, 1);
  bench.run(3);
  bench.enable(1);
  bench.run(20);
  assert.equal(sm(bench).isr, 0xffffffff, 'x-- also counts when it does not jump');
  assert.equal(bench.machine('address'), 8);
});

test('irq set, wait and clear; flags of other machines are seen one cycle later', () => {
  const bench = prepare('irq wait 4\nset pins, 1\nend:\njmp end');
  bench.enable(1);
  bench.run(10);
  assert.equal(bench.pio(IRQ), 1 << 4);
  assert.equal(bench.recorder.of(PIN).length, 0);
  bench.setPio(IRQ, 1 << 4);
  bench.run(5);
  assert.equal(bench.recorder.of(PIN).length, 1);
});

test('wait irq clears the flag; relative numbers add the index of the machine', () => {
  const bench = prepare('wait 1 irq 1 rel\nset pins, 1\nend:\njmp end');
  bench.setMachine('exec', (2 << 12) | (0 << 7), 2);
  bench.setMachine('pins', pinsOf({ set: PIN, setCount: 1 }), 2);
  bench.enable(4);
  bench.run(10);
  bench.setPio(IRQ_FORCE, 1 << 1);
  bench.run(10);
  assert.equal(bench.recorder.of(PIN).length, 0);
  bench.setPio(IRQ_FORCE, 1 << 3);
  bench.run(10);
  assert.equal(bench.recorder.of(PIN).length, 1);
  assert.equal(bench.pio(IRQ), 1 << 1);
});

test('flags 0 to 3 and FIFOs raise the two interrupt lines', () => {
  const bench = prepare('irq 2\nend:\njmp end');
  bench.setPio(0x12c, 1 << 10);
  bench.setPio(0x138, 1);
  bench.enable(1);
  bench.run(5);
  assert.equal(bench.chip.nvic.lines & (1 << 7), 1 << 7, 'PIO0_IRQ_0');
  assert.equal(bench.chip.nvic.lines & (1 << 8), 0);
  assert.equal(bench.pio(0x134), 1 << 10);
  bench.setPio(IRQ, 1 << 2);
  assert.equal(bench.chip.nvic.lines & (1 << 7), 0);
  bench.force('push');
  assert.equal(bench.chip.nvic.lines & (1 << 8), 1 << 8, 'PIO0_IRQ_1: RX 0 not empty');
});

test('joined FIFOs hold eight words, and joining empties them', () => {
  const bench = prepare('nop');
  bench.put(1);
  bench.setMachine('shift', shiftOf({ joinTx: true }));
  assert.equal(bench.pio(FLEVEL) & 15, 0);
  for (let i = 0; i < 9; i++) bench.put(i);
  assert.equal(bench.pio(FLEVEL) & 15, 8);
  assert.equal(bench.pio(FDEBUG), TX_OVER(0));
});

test('what is not modelled says so', () => {
  assert.throws(() => prepare('nop', { exec: 1 << 17 }), /OUT_STICKY/);
});
