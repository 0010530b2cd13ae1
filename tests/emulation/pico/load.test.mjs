// SPDX-License-Identifier: Apache-2.0
// Nonsense over USB: the image must neither fault nor hang, move no output, and answer a sound hello afterwards. The emulation ends with
// an error at whatever silicon would fault at.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { CYCLES_PER_MICROSECOND, CYCLES_PER_MILLISECOND } from '../clock/time.mjs';
import { randomSource } from '../testing/campaign.mjs';
import { records, schema } from '../wire/client.mjs';
import { encodeFrame } from '../wire/frames.mjs';
import { expectedEdges, input, INTERLOCK, outputEdges, outputs, PicoRig, skip } from './rig.mjs';

const KINDS = 8;
const REQUESTS = 24;

/** Some bytes for the wire: noise, a damaged frame, or a sound frame with a body of noise or of half a message. */
function nonsense(random) {
  const body = random.below(2) ? random.bytes(random.below(80)) : halfMessage(random);
  const frame = encodeFrame({
    kind: random.below(KINDS), seq: random.below(65536), ack: random.below(65536), credit: random.below(256), flags: random.below(4), body,
  });
  const choice = random.below(4);
  if (choice === 0) return random.bytes(1 + random.below(700));
  if (choice === 1) frame[random.below(frame.length)] ^= 1 << random.below(8);
  if (choice === 2) return frame.subarray(0, random.below(frame.length));
  return frame;
}

/** A request's tag and length with anything behind it. */
function halfMessage(random) {
  const inside = random.bytes(random.below(30));
  return Buffer.concat([Buffer.from([((1 + random.below(REQUESTS)) << 3) & 0x7f | 2, inside.length]), inside]);
}

function assertAlive(rig) {
  rig.client.run(60);
  rig.client.cutter.rest = Buffer.alloc(0);
  const { board } = rig.client.hello();
  assert.equal(board, 'pico');
  assert.deepEqual(rig.board.host.errors, []);
  assert.equal(rig.board.chip.resetCount, 0);
}

test('nonsense on the wire', { skip }, () => {
  const rig = new PicoRig();
  const random = randomSource(20_26);
  for (let i = 0; i < 1500; i++) {
    rig.client.pipe.write(nonsense(random));
    if (random.below(4) === 0) rig.client.run(random.below(4) / 2);
  }
  rig.board.runMilliseconds(500, () => rig.client.pipe.unsent.length === 0);
  assertAlive(rig);
  assert.equal(rig.board.recorder.edges.filter((edge) => edge.gpio < 12).length, 0, 'no output has moved');
});

/** A control request; 'silent' if there is no answer within 20 ms, where a host would give up and ask something else. */
function request({ board }, setup, data) {
  let result;
  const control = board.host.submitControl(setup, data, (end) => (result ??= end.status));
  board.runMilliseconds(20, () => result !== undefined);
  if (result !== undefined) return result;
  board.host.cancelControl(control);
  return 'silent';
}

test('nonsense on endpoint 0', { skip }, () => {
  const rig = new PicoRig();
  const random = randomSource(7);
  let stalls = 0;
  for (let i = 0; i < 600; i++) {
    const setup = random.bytes(8);
    setup[0] = [0x00, 0x80, 0x01, 0x81, 0x02, 0x82, 0x21, 0xa1, 0x40, 0xc0, 0xc1, setup[0]][random.below(12)];
    if (random.below(2)) setup[1] = random.below(16);
    const standard = (setup[0] & 0x60) === 0;
    if (standard && [3, 5, 9].includes(setup[1])) continue; // a halt, a new address or configuration would end the session by right
    setup.writeUInt16LE(random.below(300), 6);
    const end = request(rig, setup, random.bytes(setup.readUInt16LE(6)));
    if (end === 'stall') stalls++;
    // A data stage where the request has none may be met with silence: the host is at fault. The next SETUP ends that.
    else assert.ok(end === 'ok' || (end === 'silent' && !(setup[0] & 0x80)), `${setup.toString('hex')}: ${end}`);
  }
  assert.ok(stalls > 100);
  assertAlive(rig);
});

test('requests of every kind with fields at their ends', { skip }, () => {
  const rig = new PicoRig();
  const random = randomSource(99);
  const ends = [0, 1, 2, 31, 32, 255, 65_535, 2 ** 31, 2 ** 32 - 1, 2 ** 40, 2 ** 52];
  for (const { name, type } of schema.messages.Request) {
    if (name === 'reboot') continue;
    for (let i = 0; i < 6; i++) {
      const fields = {};
      for (const field of schema.messages[type]) {
        if (['string', 'bytes'].includes(field.type)) fields[field.name] = 'x'.repeat(random.below(40));
        else if (field.type === 'fixed32') fields[field.name] = random.next();
        else fields[field.name] = field.type === 'bool' ? random.below(2) : ends[random.below(ends.length)];
      }
      rig.client.ask({ [name]: fields });
    }
  }
  assertAlive(rig);
});

// Inputs that change much faster than the firmware can follow, from 31 kHz to 10 MHz, all at once: every protection works as if they
// were still.

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

// What the board counts of its own hardware's errors: words that do not fit the queue, and errors of DMA on the bus.

const TXF0 = 0x50200010;
const DMA = 0x50000000;
const READ_ADDR = 0;
const WRITE_ADDR = 4;
const DATA = 0; // the channels of the edge engine (board_pins.hpp)
const CONTROL = 1;
const NOTHING = 0x60000000; // an address without anything

const WORDS = Array.from({ length: 3000 }, (_, i) => [((i + 1) * 37) & 0xfff, 2000 + (i % 7)]);
const program = [...WORDS.map(([levels, ticks]) => records.word(levels, ticks)), records.end()];

function running() {
  const rig = new PicoRig();
  rig.configure(outputs);
  rig.start(program);
  rig.client.run(2);
  return rig;
}

const counters = (rig) => {
  const { queue_overflows: overflows, dma_errors: errors } = rig.client.must({ get_diagnostics: {} }).diagnostics;
  return { overflows, errors };
};

test('a word that is written to a full queue is lost, counted, and no output shows it', { skip }, () => {
  const rig = running();
  assert.deepEqual(counters(rig), { overflows: 0, errors: 0 });
  for (let i = 1; i <= 3; i++) {
    rig.board.chip.rp2040.writeUint32(TXF0, 0xffffffff);
    rig.client.run(1.5); // a round of the main loop looks once
    assert.deepEqual(counters(rig), { overflows: i, errors: 0 });
  }
  assert.equal(rig.finish().end, 'RUN_END_COMPLETED');
  assert.deepEqual(outputEdges(rig), expectedEdges(WORDS));
});

for (const [name, channel, register] of [['words', DATA, WRITE_ADDR], ['grants', CONTROL, READ_ADDR]]) {
  test(`an error of DMA on its way with ${name}: counted, safe levels at the end of the queue, and nothing that was not planned`, { skip }, () => {
    const rig = running();
    rig.board.chip.rp2040.writeUint32(DMA + 0x40 * channel + register, NOTHING);
    rig.client.run(200);
    const { state, fault } = rig.status();
    assert.deepEqual([state, fault.code], ['STATE_FAULT', 'FAULT_UNDERRUN']);
    assert.equal(rig.outputLevels, 0);
    assert.deepEqual(counters(rig), { overflows: 0, errors: 1 });
    const [seen, planned] = [outputEdges(rig), expectedEdges(WORDS)];
    const last = seen.at(-1)[0]; // the fall to the safe levels, at the time of a word
    const before = seen.filter(([cycle]) => cycle < last);
    assert.deepEqual(before, planned.slice(0, before.length));
    assert.ok(planned.some(([cycle]) => cycle === last), 'in the cycle of the next word');

    rig.client.must({ clear_fault: { code: schema.enums.FaultCode[fault.code] } });
    rig.configure(outputs);
    rig.start(program);
    assert.equal(rig.finish().end, 'RUN_END_COMPLETED');
    assert.deepEqual(outputEdges(rig), planned);
    assert.deepEqual(counters(rig), { overflows: 0, errors: 1 });
  });
}
