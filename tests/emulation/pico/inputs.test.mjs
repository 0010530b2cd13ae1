// SPDX-License-Identifier: Apache-2.0
// The image's time-stamps, and its clock.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { CYCLES_PER_MICROSECOND } from '../clock/constants.mjs';
import { statistics } from '../edges/statistics.mjs';
import { PicoRig, VSYNC, input, outputs, skip } from './rig.mjs';

test('stamps of a PIO input are right to two cycles', { skip }, () => {
  const rig = new PicoRig();
  rig.configure([...outputs, input(VSYNC.line, 'LINE_ROLE_VSYNC', { capture: true })]);
  rig.board.stimuli.pulse(VSYNC.gpio, 1_000_771, 100_000);
  rig.board.recorder.clear();
  rig.client.run(100);
  rig.board.stimuli.pulse(VSYNC.gpio, 0, 0);
  rig.client.run(20);
  const seen = rig.client.events.filter((event) => event.event === 'edge');
  const real = rig.edges(VSYNC.gpio);
  assert.equal(seen.length, real.length);
  assert.ok(seen.length >= 198);
  assert.deepEqual(seen.map((edge) => +edge.level), real.map((edge) => edge.level));
  // Board time began some cycles after power-up: the same offset for all.
  const offsets = seen.map((edge, i) => edge.tick - real[i].cycle);
  assert.ok(statistics(offsets).jitter <= 2, `${statistics(offsets).min} to ${statistics(offsets).max}`);
});

test('the clock that time_ping tells is the clock of the edges', { skip }, () => {
  const rig = new PicoRig();
  const offsets = [];
  for (let i = 0; i < 50; i++) {
    const { rx_tick: taken, tx_tick: answered } = rig.client.must({ time_ping: { host_ns: i } }).time;
    assert.ok(answered >= taken);
    assert.ok(answered - taken < 1000 * CYCLES_PER_MICROSECOND);
    assert.ok(taken < rig.board.cycle);
    offsets.push(rig.board.cycle - answered);
    rig.client.run(1 + (i % 7) / 10);
  }
  // Offset of board time to power-up, and the way of the answer: about 100 us of wire and a millisecond of main loop at most.
  assert.ok(statistics(offsets).jitter < 1200 * CYCLES_PER_MICROSECOND, `${statistics(offsets).jitter}`);
});
