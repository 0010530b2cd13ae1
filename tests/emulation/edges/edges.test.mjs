// SPDX-License-Identifier: Apache-2.0

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { delays, levels, pinNames, shortest, statistics, vcd } from './edges.mjs';

const edges = (...pairs) => pairs.map(([cycle, level, gpio = 1]) => ({ cycle, gpio, level }));

test('a dump has a header, the levels before, and a time for each change', () => {
  const text = vcd(edges([10, 1], [10, 1, 2], [12, 0], [12, 1, 7]), { 1: 'trigger', 2: 'my strobe' }, 0b100);
  assert.equal(text, [
    '$timescale 1 ns $end', '$scope module board $end', '$var wire 1 ! trigger $end', '$var wire 1 " my_strobe $end',
    '$upscope $end', '$enddefinitions $end', '#0', '$dumpvars', '0!', '1"', '$end', '#80', '1!', '1"', '#96', '0!', '',
  ].join('\n'));
});

test('thirty pins have thirty codes', () => {
  const text = vcd([], pinNames({ 25: 'led' }));
  const codes = [...text.matchAll(/\$var wire 1 (\S+) (\S+)/g)];
  assert.equal(new Set(codes.map((match) => match[1])).size, 30);
  assert.equal(codes[25][2], 'led');
});

test('levels, the shortest of them, jitter', () => {
  const pulse = edges([0, 1], [5, 0], [20, 1], [26, 0]);
  assert.deepEqual(levels(pulse).map(({ level, cycles }) => [level, cycles]), [[1, 5], [0, 15], [1, 6]]);
  assert.equal(shortest(pulse), 5);
  assert.equal(shortest(pulse, 0), 15);
  assert.deepEqual(statistics([5, 6]), { count: 2, min: 5, max: 6, mean: 5.5, jitter: 1 });
  assert.equal(statistics([]).count, 0);
});

test('delays pair each start with what follows before the next', () => {
  const from = edges([0, 1], [1, 0], [100, 1], [200, 1]);
  const to = edges([7, 1], [8, 0], [50, 1], [209, 1]);
  assert.deepEqual(delays(from, to), [7, 9]);
});
