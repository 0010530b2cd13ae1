// SPDX-License-Identifier: Apache-2.0
// The image's time-stamps, and its clock.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { CYCLES_PER_MICROSECOND } from '../clock/constants.mjs';
import { statistics } from '../edges/statistics.mjs';
import { records } from '../wire/client.mjs';
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

/** Some edges at the worst moment: right after TIMER was read, as before an alarm is set. */
function edgesAtTimerReads({ chip, stimuli }, gpio) {
  const { timer } = chip;
  const read = timer.readUint32.bind(timer);
  let [reads, level] = [0, 0];
  timer.readUint32 = (offset) => {
    if (offset === 0x28 && ++reads % 7 === 0) stimuli.driveAt(chip.cycle + 1, gpio, (level ^= 1));
    return read(offset);
  };
}

test('waits that time out do so on time while edges of other lines interrupt', { skip }, () => {
  const rig = new PicoRig();
  const inA = 16;
  rig.configure([...outputs.slice(0, 1), input(VSYNC.line, 'LINE_ROLE_VSYNC'), input(inA, 'LINE_ROLE_GENERAL', { capture: true })]);
  const timeout = 1500;
  const word = 6000;
  rig.start([records.loop(100, [records.wait(VSYNC.line, 'rising', timeout), records.word(1, word / 2), records.word(0, word / 2)]), records.end()]);
  edgesAtTimerReads(rig.board, 20);
  assert.equal(rig.finish().end, 'RUN_END_COMPLETED');
  const rises = rig.edges(0).filter(({ level }) => level === 1).map(({ cycle }) => cycle);
  const late = rises.slice(1).map((cycle, i) => cycle - rises[i] - word - timeout);
  assert.equal(rises.length, 100);
  const { min, max } = statistics(late);
  assert.ok(min >= 0 && max < 4000, `${min} to ${max} cycles after the time-out`);
});
