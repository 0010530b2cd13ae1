// SPDX-License-Identifier: Apache-2.0

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Bench, pinsOf } from '../testing/bench.mjs';
import { Stimuli } from './stimuli.mjs';

test('a periodic pulse keeps its period to the cycle over many frames', () => {
  const bench = new Bench();
  const stimuli = new Stimuli(bench.chip);
  const period = 1e9 / 60;
  bench.run(1000);
  stimuli.pulse(16, period, 100_000);
  bench.run(60 * 2_083_400);
  const edges = bench.recorder.of(16);
  const rises = edges.filter((edge) => edge.level === 1).map((edge) => edge.cycle);
  assert.equal(rises.length, 60);
  rises.forEach((cycle, i) => assert.equal(cycle, 1000 + Math.round(((i + 1) * period) / 8)));
  assert.ok(edges.filter((edge) => edge.level === 0).every((edge, i) => edge.cycle - rises[i] === 12_500));
  stimuli.pulse(16, 0, 0);
  const count = bench.recorder.of(16).length;
  bench.run(5_000_000);
  assert.equal(bench.recorder.of(16).length, count);
});

test('a camera answers each rising edge of its trigger', () => {
  const bench = new Bench();
  const stimuli = new Stimuli(bench.chip);
  bench.outputs([0]);
  stimuli.camera(0, 17, 14_260, 5000);
  bench.load('set pins, 1 [31]\nset pins, 0 [31]\nnop [31]', { pins: pinsOf({ set: 0, setCount: 1 }), clkdiv: 100 << 16 });
  bench.enable(1);
  bench.run(50_000);
  const triggers = bench.recorder.of(0).filter((edge) => edge.level === 1).map((edge) => edge.cycle);
  const strobes = bench.recorder.of(17);
  const begins = strobes.filter((edge) => edge.level === 1).map((edge) => edge.cycle);
  assert.equal(begins.length, triggers.length);
  begins.forEach((cycle, i) => assert.equal(cycle - triggers[i], Math.round(14_260 / 8)));
  assert.equal(strobes[1].cycle - strobes[0].cycle, 625);
});
