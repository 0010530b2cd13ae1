// SPDX-License-Identifier: Apache-2.0
// An interlock that opens at any moment of a request: outputs are at their safe levels 10 us later and stay there, and a request that
// would move them is not answered OK if the interlock opened before they moved. The moment is swept over the whole request.
// SYMRIG_LONG=1 sweeps in steps of 16 cycles, otherwise in steps that leave a few seconds for each request. SYMRIG_XIP_MISS sets the cycles of a
// flash miss. With SYMRIG_LEDGER the moments of several runs add up (testing/campaign.mjs).

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { CYCLES_PER_MICROSECOND } from '../clock/time.mjs';
import { Ledger, randomSource } from '../testing/campaign.mjs';
import { records, schema } from '../wire/client.mjs';
import { encodeFrame, FLAG, KIND } from '../wire/frames.mjs';
import { IMAGE, input, INTERLOCK, PicoRig, skip } from './rig.mjs';

const LONG = Boolean(process.env.SYMRIG_LONG);
const STEP = LONG ? 16 : 3001;
const SAFE_WITHIN = 10 * CYCLES_PER_MICROSECOND;
const SETTLE_MS = 3;
const ON = 0b11;

const lines = [
  { line: 0, direction: 'DIRECTION_OUTPUT', role: 'LINE_ROLE_GENERAL' },
  { line: 1, direction: 'DIRECTION_OUTPUT', role: 'LINE_ROLE_GENERAL' },
  input(INTERLOCK.line, 'LINE_ROLE_INTERLOCK', { trip_level: true }),
];
const program = [records.word(ON, 2_000_000), records.end()];

/** `prepare(rig)` brings the board to where the request is possible; `request(rig)` is the request, or a list of frames to write. */
const requests = {
  'manual set': { request: () => ({ manual_set: { mask: ON, levels: ON } }), raises: true },
  'manual set with outputs on': { prepare: raise, request: () => ({ manual_set: { mask: 1, levels: 0 } }) },
  arm: { prepare: (rig) => rig.upload(program), request: armRequest },
  'arm with outputs on': { prepare: (rig) => (rig.upload(program), raise(rig)), request: armRequest },
  start: { prepare: (rig) => (rig.upload(program), rig.arm()), request: () => ({ start: { now: true } }) },
  'start at a tick': {
    prepare: (rig) => (rig.upload(program), rig.arm()),
    request: (rig) => ({ start: { at_tick: rig.status().tick + 70_000 } }),
  },
  abort: { prepare: run, request: () => ({ abort: {} }) },
  'urgent abort': { prepare: run, request: () => ({ abort: {} }), options: { urgent: true } },
  'configure a line': { prepare: raise, request: () => ({ config_line: lines[0] }) },
  'finish a configuration': { prepare: unfinished, request: (rig) => ({ finalize_config: { hash: rig.configHash } }) },
  'reset the configuration': { prepare: raise, request: () => ({ reset_config: {} }) },
};

function raise(rig) {
  rig.client.must({ manual_set: { mask: ON, levels: ON } });
}

function run(rig) {
  rig.start(program);
  rig.client.run(0.2);
}

function unfinished(rig) {
  raise(rig);
  for (const line of lines) rig.client.must({ config_line: line });
}

function armRequest(rig) {
  return { arm: { program_hash: rig.commit.program_hash, config_hash: rig.configHash, autonomous: true } };
}

/** The board at rest, whatever came before, with its interlock closed. */
function recover(rig) {
  rig.board.stimuli.drive(INTERLOCK.gpio, 0);
  rig.client.run(0.05);
  rig.client.ask({ abort: {} }, { urgent: true });
  const { fault } = rig.status();
  if (fault) rig.client.must({ clear_fault: { code: schema.enums.FaultCode[fault.code] } });
  rig.configure(lines);
  rig.client.events.length = 0;
  rig.client.arrived.length = 0;
}

/** Cycles for which outputs were away from low, later than `from`. */
function highAfter(rig, from) {
  let last = 0;
  for (const gpio of [0, 1]) {
    const edges = rig.edges(gpio);
    edges.forEach(({ cycle, level }, i) => {
      const end = level === 1 ? (edges[i + 1]?.cycle ?? rig.board.cycle) : cycle;
      last = Math.max(last, end);
    });
    if (edges.length === 0 && (rig.outputLevels >>> gpio) & 1) last = rig.board.cycle;
  }
  return Math.max(0, last - from);
}

/** The request with the interlock opening `delay` cycles after it was handed to the bus (never, without a delay). */
function attempt(rig, kind, delay) {
  recover(rig);
  kind.prepare?.(rig);
  const request = kind.request(rig);
  rig.board.recorder.clear();
  const begin = rig.board.cycle;
  if (delay !== undefined) rig.board.stimuli.driveAt(begin + delay, INTERLOCK.gpio, 1);
  const { code } = rig.client.ask(request, kind.options);
  const answered = rig.board.cycle - begin;
  rig.client.run(SETTLE_MS);
  const rise = rig.edges(0).find((edge) => edge.level === 1);
  const result = { code, answered, rise: rise && rise.cycle - begin };
  if (delay === undefined) return result;
  const trip = begin + delay;
  return { ...result, late: highAfter(rig, trip), state: rig.status().state };
}

/** One moment: how long an output was high after the interlock, in cycles. */
function tryMoment(rig, name, delay) {
  const kind = requests[name];
  const { code, late, state, rise } = attempt(rig, kind, delay);
  const where = `${name}, interlock ${delay} cycles after the request (${code}, ${state})`;
  assert.ok(late <= SAFE_WITHIN, `${where}: an output was high ${late} cycles after the interlock opened`);
  const movedBefore = rise !== undefined && rise < delay;
  if (kind.raises && !movedBefore) assert.notEqual(code, 'CODE_OK', where);
  return late;
}

/** The moments of the whole request and of 160 us after its answer. */
function momentsOf(rig, name) {
  const plain = attempt(rig, requests[name]);
  assert.equal(plain.code, 'CODE_OK', name);
  const count = Math.ceil((plain.answered + 20_000 - 1) / STEP);
  return Array.from({ length: count }, (_, i) => 1 + i * STEP);
}

function sweep(name) {
  const rig = new PicoRig(rigOptions());
  const ledger = new Ledger(`trips, ${name}, step ${STEP}, miss ${process.env.SYMRIG_XIP_MISS ?? 'of the image'}`, IMAGE);
  const moments = momentsOf(rig, name);
  for (const delay of ledger.left(moments)) ledger.note(delay, tryMoment(rig, name, delay));
  ledger.read();
  return { tries: ledger.results.size, of: moments.length, latest: Math.max(0, ...ledger.results.values()) };
}

/** SYMRIG_XIP_MISS: cycles of a flash cache miss, for the long sweeps. */
function rigOptions() {
  return process.env.SYMRIG_XIP_MISS ? { missCycles: Number(process.env.SYMRIG_XIP_MISS) } : {};
}

for (const name of Object.keys(requests)) {
  test(`an interlock that opens during: ${name}`, { skip }, (context) => {
    const { tries, of, latest } = sweep(name);
    context.diagnostic(`${tries} of ${of} moments, the last output fell ${latest} cycles after the interlock`);
  });
}

const INPUTS = [[16, 20_000], [20, 50_000], [21, 51_000]]; // GPIO and shortest period of its edges, ns
const busyLines = [
  ...Array.from({ length: 4 }, (_, line) => ({ line, direction: 'DIRECTION_OUTPUT', role: 'LINE_ROLE_GENERAL', capture: true })),
  input(12, 'LINE_ROLE_VSYNC', { capture: true }), input(16, 'LINE_ROLE_GENERAL', { capture: true }), input(17, 'LINE_ROLE_GENERAL', { capture: true }),
  input(INTERLOCK.line, 'LINE_ROLE_INTERLOCK', { trip_level: true, capture: true }),
];
const busyPrograms = {
  words: [records.word(1, 4000), records.word(3, 4100), records.word(5, 4100)],
  'waits that time out': [records.wait(12, 'rising', 1500), records.word(1, 7000), records.word(3, 7000)],
  'outputs together': [records.word(0xf, 9000), records.word(1, 9000)],
};

for (const [name, body] of Object.entries(busyPrograms)) {
  test(`interlock to safe in 2 us while everything else interrupts: ${name}`, { skip }, (context) => {
    const rig = new PicoRig({ missCycles: 264 });
    const random = randomSource(15);
    let worst = 0;
    for (let i = 0; i < (LONG ? 1000 : 12); i++) {
      recover(rig);
      rig.configure(busyLines);
      rig.start([records.loop(1_000_000, body), records.end()]);
      for (const [gpio, period] of INPUTS) rig.board.stimuli.pulse(gpio, period + random.below(5000), 5000);
      rig.status();
      rig.board.recorder.clear();
      const trip = rig.board.cycle + 2000 + random.below(40_000);
      rig.board.stimuli.driveAt(trip, INTERLOCK.gpio, 1);
      rig.status();
      rig.client.run(1);
      for (const [gpio] of INPUTS) rig.board.stimuli.pulse(gpio, 0, 0);
      assert.equal(rig.outputLevels, 0);
      assert.equal(rig.status().fault?.code, 'FAULT_INTERLOCK');
      const after = rig.board.recorder.edges.filter(({ gpio, cycle }) => gpio < 12 && cycle > trip);
      worst = Math.max(worst, (after.at(-1)?.cycle ?? trip) - trip);
    }
    context.diagnostic(`at most ${worst} cycles`);
    assert.ok(worst <= 2 * CYCLES_PER_MICROSECOND, `${worst} cycles`);
  });
}

test('an urgent abort that arrives during a manual set: outputs that it brought down stay down', { skip }, () => {
  const rig = new PicoRig(rigOptions());
  const frame = (request, flags) => {
    if (!flags) rig.client.sent = (rig.client.sent + 1) & 0xffff;
    return encodeFrame({ kind: KIND.request, seq: rig.client.sent, ack: rig.client.expected, credit: 16, flags, body: schema.encode('Request', request) });
  };
  const longest = LONG ? 60_000 : 40_000;
  for (let delay = 0; delay < longest; delay += LONG ? 64 : 997) {
    recover(rig);
    rig.board.recorder.clear();
    rig.client.pipe.write(frame({ manual_set: { mask: ON, levels: ON } }));
    rig.client.runUntil(() => false, delay);
    rig.client.pipe.write(frame({ abort: {} }, FLAG.urgent));
    rig.client.runUntil(() => rig.client.pipe.unsent.length === 0 && !rig.client.pipe.sending, 250_000);
    const arrived = rig.client.pipe.deliveredAt;
    rig.client.run(SETTLE_MS);
    const late = highAfter(rig, arrived);
    assert.ok(late <= 50 * CYCLES_PER_MICROSECOND, `abort ${delay} cycles after the manual set: an output was high ${late} cycles after it arrived`);
  }
});
