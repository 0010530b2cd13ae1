// SPDX-License-Identifier: Apache-2.0
// Ways for outputs to become safe, and how long each takes on the image.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { CYCLES_PER_MICROSECOND, CYCLES_PER_MILLISECOND } from '../clock/time.mjs';
import { records } from '../wire/client.mjs';
import { input, INTERLOCK, outputs, PicoRig, skip } from './rig.mjs';

const ON = 0x0ff;
const LONG = 125_000_000;
const lamp = outputs.map((line) => (line.line === 2 ? { ...line, hazard: 'HAZARD_LAMP' } : line));

function running(lines = outputs, options) {
  const rig = new PicoRig();
  rig.configure(lines);
  if (options?.keepAlive) rig.client.must({ keep_alive: { ttl_ms: options.keepAlive } });
  rig.start([records.word(ON, LONG), records.end()], { autonomous: options?.autonomous ?? true });
  rig.client.run(5);
  assert.equal(rig.outputLevels, ON);
  return rig;
}

test('an urgent abort: outputs safe within 50 us of its last byte', { skip }, () => {
  const rig = running();
  rig.client.ask({ abort: {} }, { urgent: true });
  assert.equal(rig.outputLevels, 0);
  const taken = (rig.lastOutputEdge - rig.client.pipe.deliveredAt) / CYCLES_PER_MICROSECOND;
  assert.ok(taken <= 50, `${taken} us`);
  assert.equal(rig.finish(100).end, 'RUN_END_ABORTED');
});

test('an interlock that trips: outputs safe within 10 us, and a fault that names it', { skip }, () => {
  const rig = new PicoRig();
  rig.board.stimuli.drive(INTERLOCK.gpio, 0);
  rig.configure([...outputs, input(INTERLOCK.line, 'LINE_ROLE_INTERLOCK', { trip_level: true })]);
  rig.start([records.word(ON, LONG), records.end()]);
  rig.client.run(5);
  assert.equal(rig.outputLevels, ON);
  const tripped = rig.board.cycle;
  rig.board.stimuli.drive(INTERLOCK.gpio, 1);
  rig.client.run(5);
  assert.equal(rig.outputLevels, 0);
  const taken = (rig.lastOutputEdge - tripped) / CYCLES_PER_MICROSECOND;
  assert.ok(taken <= 10, `${taken} us`);
  assert.deepEqual([rig.status().state, rig.status().fault.code], ['STATE_FAULT', 'FAULT_INTERLOCK']);
});

test('an engine that is not fed: safe levels within 1 us of the end of its last word', { skip }, () => {
  const rig = new PicoRig();
  rig.configure();
  rig.start([records.loop(1_000_000, [records.word(1, 5000), records.word(3, 5000)]), records.end()]);
  rig.client.run(5);
  rig.board.chip.rp2040.writeUint32(0x50000444, 0xfff); // all DMA channels are cut off
  rig.client.run(30);
  assert.equal(rig.outputLevels, 0);
  // Line 0 is high in both words, so that its fall is the fall to safe levels; line 1 moves with every word.
  const edges = rig.board.recorder.edges;
  const safe = edges.filter((edge) => edge.gpio === 0).at(-1).cycle;
  const lastWord = edges.filter((edge) => edge.gpio === 1 && edge.cycle < safe).at(-1).cycle;
  const late = safe - lastWord - 5000;
  assert.ok(late >= 0 && late <= CYCLES_PER_MICROSECOND, `${late} cycles after the end of the last word`);
  assert.equal(rig.status().fault.code, 'FAULT_UNDERRUN');
});

test('a host that falls silent: safe within its time and 10 ms', { skip }, () => {
  const rig = running(lamp, { keepAlive: 200, autonomous: false });
  const last = rig.client.pipe.deliveredAt;
  rig.client.must({ keep_alive: { ttl_ms: 200 } });
  const begin = rig.client.pipe.deliveredAt;
  assert.ok(begin > last);
  rig.board.run(300 * CYCLES_PER_MILLISECOND, () => rig.outputLevels === 0);
  assert.equal(rig.outputLevels, 0);
  const taken = (rig.lastOutputEdge - begin) / CYCLES_PER_MILLISECOND;
  assert.ok(taken >= 199 && taken <= 210, `${taken} ms`);
});

test('a board without a cable does not pull up; a cable that is pulled ends a run within 3 ms', { skip }, () => {
  const rig = running(lamp, { keepAlive: 60_000, autonomous: false });
  const pullUp = () => (rig.board.host.controller.usb.sieCtrl >>> 16) & 1;
  assert.equal(pullUp(), 1);
  const begin = rig.board.cycle;
  rig.board.host.plug(false);
  rig.board.run(50 * CYCLES_PER_MILLISECOND, () => rig.outputLevels === 0);
  const taken = (rig.lastOutputEdge - begin) / CYCLES_PER_MILLISECOND;
  assert.ok(taken > 0 && taken < 3, `${taken} ms`);
  rig.board.runMilliseconds(5);
  assert.equal(pullUp(), 0);
  rig.connect();
  assert.equal(rig.status().fault.code, 'FAULT_LINK_LOST');
  const alone = new PicoRig().board;
  alone.host.plug(false);
  alone.runMilliseconds(100);
  assert.equal((alone.host.controller.usb.sieCtrl >>> 16) & 1, 0);
});

test('a cable that is pulled: safe within 10 ms', { skip }, () => {
  const rig = running(lamp, { keepAlive: 60_000, autonomous: false });
  const begin = rig.board.cycle;
  rig.board.host.plug(false);
  rig.board.run(50 * CYCLES_PER_MILLISECOND, () => rig.outputLevels === 0);
  const taken = (rig.lastOutputEdge - begin) / CYCLES_PER_MILLISECOND;
  assert.ok(taken > 0 && taken <= 10, `${taken} ms`);
});

test('a firmware that stands still: the watchdog lets the pins go, and the board says so when it is back', { skip }, () => {
  const rig = running();
  const { core, rp2040 } = rig.board.chip;
  rp2040.writeUint16(0x20041000, 0xe7fe); // b .
  Object.assign(core, { PC: 0x20041000, PM: true, waiting: false });
  const begin = rig.board.cycle;
  rig.board.run(1000 * CYCLES_PER_MILLISECOND, () => rig.outputLevels === 0);
  const taken = (rig.lastOutputEdge - begin) / CYCLES_PER_MILLISECOND;
  assert.ok(taken <= 500, `${taken} ms`);
  assert.equal(rig.board.chip.resetCount, 1);
  rig.board.run(100 * CYCLES_PER_MILLISECOND, () => rig.board.host.device !== null);
  rig.connect();
  assert.equal(rig.status().reset_cause, 'RESET_CAUSE_WATCHDOG');
});
