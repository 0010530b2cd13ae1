// SPDX-License-Identifier: Apache-2.0
// Endpoint 0 with a host that gives up in any stage and resets the bus at any time: each transfer that ends well has exactly the bytes that
// it had when nothing disturbed it. SYMRIG_LONG=1: 100,000 transfers.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { CYCLES_PER_MICROSECOND } from '../clock/time.mjs';
import { statistics } from '../edges/edges.mjs';
import { randomSource } from '../testing/campaign.mjs';
import { records, schema } from '../wire/client.mjs';
import { encodeFrame, KIND } from '../wire/frames.mjs';
import { input, outputs, PicoRig, skip, VSYNC } from './rig.mjs';

const TRANSFERS = process.env.SYMRIG_LONG ? 100_000 : 2000;
const LONGEST_WAIT = 25_000; // cycles until the host gives up
const SILENT_MS = 20;

const LINE_CODING_SET = [0x21, 0x20, 0, 0, 1, 0, 7, 0];
const LINE_CODING_GET = [0xa1, 0x21, 0, 0, 1, 0, 7, 0];

const reads = [
  [0x80, 6, 0, 1, 0, 0, 18, 0], [0x80, 6, 0, 1, 0, 0, 64, 0], [0x80, 6, 0, 1, 0, 0, 8, 0], // device
  [0x80, 6, 0, 2, 0, 0, 9, 0], [0x80, 6, 0, 2, 0, 0, 255, 0], // configuration
  [0x80, 6, 0, 3, 0, 0, 255, 0], [0x80, 6, 2, 3, 9, 4, 255, 0], [0x80, 6, 3, 3, 9, 4, 255, 0], // strings
  [0x80, 6, 0, 15, 0, 0, 255, 0], // object store
  [0xc0, 0x20, 0, 0, 7, 0, 255, 0], // Windows
  [0x80, 0, 0, 0, 0, 0, 2, 0], [0x80, 8, 0, 0, 0, 0, 1, 0], // status, configuration
];
const writes = [[0x21, 0x22, 0, 0, 1, 0, 0, 0], [0x21, 0x22, 1, 0, 1, 0, 0, 0]]; // terminal ready or not
const unknown = [[0x80, 6, 0, 9, 0, 0, 20, 0], [0x40, 77, 0, 0, 0, 0, 0, 0], [0xc0, 77, 0, 0, 0, 0, 5, 0]];

/** A transfer that the host leaves alone; with `patience`, it gives up after so many cycles unless the transfer is over. */
function transfer({ board }, setup, data, patience) {
  let result;
  const control = board.host.submitControl(setup, data, (end) => (result ??= end));
  board.run(patience ?? SILENT_MS * 125_000, () => result !== undefined);
  // A SETUP on the wire ends by itself.
  if (result === undefined) board.run(SILENT_MS * 125_000, () => result !== undefined || !control.stage?.setup);
  if (result === undefined) board.host.cancelControl(control);
  return result;
}

test('transfers of endpoint 0 that are given up leave nothing behind', { skip }, (context) => {
  const rig = new PicoRig();
  const { host } = rig.board;
  const random = randomSource(1215);
  const known = new Map(reads.map((setup) => [setup, host.control(setup).data]));
  for (const [setup, data] of known) assert.ok(data.length > 0, `${setup}`);
  let codings = [host.control(LINE_CODING_GET).data.toString('hex')]; // those that the board may hold
  const counts = { ok: 0, stall: 0, cancelled: 0, resets: 0 };

  const step = () => {
    const patience = random.below(5) < 2 ? random.below(LONGEST_WAIT) : undefined;
    const kind = random.below(10);
    if (kind === 0) {
      const coding = random.bytes(7);
      const { status } = transfer(rig, LINE_CODING_SET, coding, patience);
      codings = status === 'ok' ? [coding.toString('hex')] : [...codings, coding.toString('hex')];
      return status;
    }
    if (kind === 1) {
      const { status, data } = transfer(rig, LINE_CODING_GET, [], patience);
      if (status === 'ok') assert.ok(codings.includes(data.toString('hex')), `line coding ${data.toString('hex')} of ${codings}`);
      if (status === 'ok') codings = [data.toString('hex')];
      return status;
    }
    if (kind === 2) {
      const { status } = transfer(rig, unknown[random.below(unknown.length)], [], patience);
      assert.ok(status === 'stall' || patience !== undefined, status);
      return status;
    }
    if (kind === 3) return transfer(rig, writes[random.below(writes.length)], [], patience).status;
    const setup = reads[random.below(reads.length)];
    const { status, data } = transfer(rig, setup, [], patience);
    if (status === 'ok') assert.deepEqual(data, known.get(setup), `${Buffer.from(setup).toString('hex')}`);
    return status;
  };

  for (let i = 0; i < TRANSFERS; i++) {
    const before = random.next();
    const status = step();
    counts[status] = (counts[status] ?? 0) + 1;
    assert.ok(status !== 'silent' && status !== 'error', `transfer ${i} (${before}): ${status}`);
    if (random.below(100) === 0) {
      counts.resets++;
      const device = host.wait((done) => host.restart(done));
      assert.notEqual(device, true, `after ${i} transfers: ${host.failure}`);
    }
  }
  assert.deepEqual(host.errors, []);
  assert.deepEqual([...host.controller.lints], []);
  context.diagnostic(JSON.stringify(counts));
  assert.ok(counts.cancelled > TRANSFERS / 20);
  rig.connect();
  assert.equal(rig.status().state, 'STATE_SAFE');
});

// The image's time-stamps, and its clock.

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

const TIMER_RAW_LOW = 0x28;
const TIMER0_HANDLER = 16;
const LONGEST_INTERRUPT = 1400; // cycles of the GPIO handler, for all lines at once (docs/board-pico-debug.md)

/**
 * In the alarm's own handler, an interrupt of the highest priority passes between the read of TIMER and the write of the next alarm. An
 * alarm that is near is in the past then, and the one before has fired already. The place of the read is learned from the first alarms.
 */
function interruptBeforeAlarms({ chip }) {
  const { timer, core } = chip;
  const places = new Set();
  const [read, setAlarm] = [timer.readUint32.bind(timer), timer.setAlarm.bind(timer)];
  const seen = { place: 0, interrupts: 0, past: 0 };
  timer.readUint32 = (offset) => {
    if (offset !== TIMER_RAW_LOW) return read(offset);
    [seen.place] = core.registers.slice(15);
    const micros = read(offset);
    if (core.IPSR === TIMER0_HANDLER && places.has(seen.place)) {
      seen.interrupts++;
      chip.spend(LONGEST_INTERRUPT);
    }
    return micros;
  };
  timer.setAlarm = (alarm, value) => {
    if (alarm === timer.alarms[0]) places.add(seen.place);
    if (alarm === timer.alarms[0] && value <= timer.micros) seen.past++;
    setAlarm(alarm, value);
  };
  return seen;
}

/** Requests without pause, so that a round of the main loop, which looks at waits too, takes long. */
function keepBusy({ client }, until) {
  const body = schema.encode('Request', { capabilities: {} });
  while (!until()) {
    client.sent = (client.sent + 1) & 0xffff;
    client.pipe.write(encodeFrame({ kind: KIND.request, seq: client.sent, ack: client.expected, credit: 16, flags: 0, body }));
    client.runUntil(() => client.pipe.unsent.length < 2, 125_000);
    client.replies.length = 0;
  }
}

test('waits that time out do so on time, also if an interrupt puts their alarm into the past', { skip }, () => {
  const rig = new PicoRig();
  rig.configure([...outputs.slice(0, 1), input(VSYNC.line, 'LINE_ROLE_VSYNC')]);
  const timeout = 1500;
  const word = 60_000;
  const wait = records.wait(VSYNC.line, 'rising', timeout);
  rig.start([records.loop(100, [wait, wait, wait, records.word(1, word / 2), records.word(0, word / 2)]), records.end()]);
  const seen = interruptBeforeAlarms(rig.board);
  keepBusy(rig, () => rig.client.events.some(({ event }) => event === 'run_done'));
  assert.ok(seen.interrupts >= 100 && seen.past >= 50, `${seen.past} alarms in the past`);
  const rises = rig.edges(0).filter(({ level }) => level === 1).map(({ cycle }) => cycle);
  assert.equal(rises.length, 100);
  const { min, max } = statistics(rises.slice(1).map((cycle, i) => cycle - rises[i] - word - 3 * timeout));
  assert.ok(min >= 0 && max < 3 * 4000, `${min} to ${max} cycles after three time-outs`);
});

test('edges from before a line was watched are not told, with any time', { skip }, () => {
  const rig = new PicoRig();
  rig.configure(outputs);
  for (const levels of [0xfff, 0, 0xfff, 0]) rig.client.must({ manual_set: { mask: 0xfff, levels } });
  rig.configure(outputs.map((line) => ({ ...line, capture: true })));
  rig.client.run(5);
  assert.deepEqual(rig.client.events.filter((event) => event.event === 'edge'), []);
  rig.client.must({ manual_set: { mask: 0xfff, levels: 0xfff } });
  rig.client.run(5);
  assert.equal(rig.client.events.filter((event) => event.event === 'edge').length, 12);
});
