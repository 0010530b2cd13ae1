// SPDX-License-Identifier: Apache-2.0
// Inputs that change much faster than the firmware can follow, from 31 kHz to 10 MHz, all at once: every protection works as if they
// were still.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { CYCLES_PER_MICROSECOND, CYCLES_PER_MILLISECOND } from '../clock/constants.mjs';
import { records } from '../wire/client.mjs';
import { INTERLOCK, PicoRig, input, outputs, skip } from './rig.mjs';

const ON = 0x0ff;
const OTHERS = [16, 17, 18, 20, 21]; // GPIOs of the other inputs
const PERIODS = [64_000, 2000, 200]; // ns, of two edges: 31 kHz to 10 MHz
const TTL = 4; // ms
const lines = [
  ...outputs.map((line) => (line.line === 2 ? { ...line, hazard: 'HAZARD_LAMP' } : line)),
  ...[12, 13, 14, 16, 17].map((line) => input(line, 'LINE_ROLE_GENERAL', { capture: true })),
  input(INTERLOCK.line, 'LINE_ROLE_INTERLOCK', { trip_level: true }),
];

/** All outputs on in a run, and all other inputs chatter. */
function chattering(period) {
  const rig = new PicoRig();
  rig.board.stimuli.drive(INTERLOCK.gpio, 0);
  rig.configure(lines);
  rig.client.must({ keep_alive: { ttl_ms: 1000 } });
  rig.start([records.word(ON, 125_000_000), records.end()], { autonomous: false });
  rig.client.must({ keep_alive: { ttl_ms: TTL } });
  const heard = rig.client.pipe.deliveredAt;
  OTHERS.forEach((gpio, k) => rig.board.stimuli.pulse(gpio, period + 8 * k, period / 2));
  rig.board.run(CYCLES_PER_MILLISECOND);
  assert.equal(rig.outputLevels, ON);
  return { rig, heard };
}

/** Later than `from`, in cycles, or fails. */
function safeAfter(rig, from, longest) {
  rig.board.run(longest + CYCLES_PER_MILLISECOND, () => rig.outputLevels === 0);
  for (const gpio of OTHERS) rig.board.stimuli.pulse(gpio, 0, 0);
  assert.equal(rig.outputLevels, 0);
  const late = rig.lastOutputEdge - from;
  assert.ok(late <= longest, `${late} cycles`);
  return late;
}

for (const period of PERIODS) {
  const name = `inputs with an edge each ${period / 2} ns`;
  test(`${name}: an interlock, safe within 10 us`, { skip }, (context) => {
    const { rig } = chattering(period);
    const opened = rig.board.cycle;
    rig.board.stimuli.drive(INTERLOCK.gpio, 1);
    context.diagnostic(`after ${safeAfter(rig, opened, 10 * CYCLES_PER_MICROSECOND)} cycles`);
    assert.equal(rig.status().fault.code, 'FAULT_INTERLOCK');
  });

  test(`${name}: an urgent abort, safe within a frame of USB and 50 us`, { skip }, (context) => {
    const { rig } = chattering(period);
    const sent = rig.board.cycle;
    assert.equal(rig.client.ask({ abort: {} }, { urgent: true }).code, 'CODE_OK');
    context.diagnostic(`after ${safeAfter(rig, sent, CYCLES_PER_MILLISECOND + 50 * CYCLES_PER_MICROSECOND)} cycles`);
  });

  test(`${name}: a silent host, safe within its time and 10 ms`, { skip }, (context) => {
    const { rig, heard } = chattering(period);
    context.diagnostic(`after ${safeAfter(rig, heard, (TTL + 10) * CYCLES_PER_MILLISECOND)} cycles`);
    assert.equal(rig.status().fault.code, 'FAULT_KEEP_ALIVE');
  });
}

test('an interlock that chatters itself: safe within 10 us of its first edge', { skip }, () => {
  const rig = new PicoRig();
  rig.board.stimuli.drive(INTERLOCK.gpio, 0);
  rig.configure(lines);
  rig.client.must({ keep_alive: { ttl_ms: 1000 } });
  rig.start([records.word(ON, 125_000_000), records.end()], { autonomous: false });
  const begin = rig.board.cycle;
  rig.board.stimuli.pulse(INTERLOCK.gpio, 1000, 500);
  const late = safeAfter(rig, begin + CYCLES_PER_MICROSECOND, 10 * CYCLES_PER_MICROSECOND);
  assert.ok(late >= 0);
  rig.client.run(5);
  assert.equal(rig.status().fault.code, 'FAULT_INTERLOCK');
});
