// SPDX-License-Identifier: Apache-2.0
// Everything at once (images/trains.cpp): PIO fed by DMA, a busy processor, interrupts.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { delays, levels, statistics } from '../edges/statistics.mjs';
import { boardWith } from '../testing/images.mjs';

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
