// SPDX-License-Identifier: Apache-2.0
// The promise behind rule refill: a program that the board accepts never runs out of words. Random programs near the limit run with a cold
// cache, misses at their dearest, edges on five lines, and a host that asks without pause. Afterwards the board's own measurements must
// keep a margin of a quarter to what it declares. SYMRIG_LONG=1: 10,000 programs (SYMRIG_PROGRAMS sets another number). Each program and its
// noise follow from its number alone, so with SYMRIG_LEDGER the programs of several runs add up (testing/campaign.mjs).

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Ledger, randomSource } from '../testing/campaign.mjs';
import { assembleProgram, records, schema } from '../wire/client.mjs';
import { crc32c, encodeFrame, KIND } from '../wire/frames.mjs';
import { IMAGE, IN_A, input, INTERLOCK, outputs, PicoRig, skip, VSYNC } from './rig.mjs';

const PROGRAMS = Number(process.env.SYMRIG_PROGRAMS ?? (process.env.SYMRIG_LONG ? 10_000 : 6));
const SEED_STEP = 2654435761; // odd, so numbers below 2^32 give different seeds (Knuth's multiplicative hash)
const SEED_OF_NOISE = 0x5bd1e995;
const IN_B = { line: 17, gpio: 21 };
const STROBE = { line: 13, gpio: 17 };
const MISS = 264;
const MARGIN = 1.25;
const GRANT = 64; // records that DMA takes before it wakes the main loop
const SLOWER = 1.2; // words that last this much longer, until the board accepts the program

const asked = [{ capabilities: {} }, { get_status: {} }, { get_diagnostics: {} }, { capabilities_line: { line: 3 } }, { program_line: { line: 1 } }];

function prepared() {
  const rig = new PicoRig({ missCycles: MISS });
  const watched = { capture: true };
  rig.board.stimuli.drive(INTERLOCK.gpio, 0);
  rig.configure([
    ...outputs, input(VSYNC.line, 'LINE_ROLE_VSYNC', watched), input(STROBE.line, 'LINE_ROLE_CAMERA_STROBE', watched),
    input(INTERLOCK.line, 'LINE_ROLE_INTERLOCK', { trip_level: true, ...watched }), input(IN_A.line, 'LINE_ROLE_GENERAL', watched),
    input(IN_B.line, 'LINE_ROLE_GENERAL', watched),
  ]);
  return rig;
}

/** Records of one random stretch; `slow` stretches its longer words. */
function stretch(random, slow) {
  const long = Math.round((460 + random.below(900)) * slow);
  switch (random.below(5)) {
    case 0: // a burst and time to recover
      return [records.loop(1 + random.below(220), [records.word(random.below(4096), 6 + random.below(30))]), records.word(1, Math.round((20_000 + random.below(60_000)) * slow))];
    case 1: // steady words
      return [records.loop(100 + random.below(400), [records.word(1, long), records.word(2, long + random.below(100))])];
    case 2: // loops that hold little
      return [records.loop(60 + random.below(100), [records.loop(2, [records.loop(2, [records.word(4, 2 * long)])]), records.word(0, long)])];
    case 3: // marks
      return [records.loop(100 + random.below(300), [records.mark(random.below(1000)), records.word(8, 2 * long)])];
    default: // waits that time out
      return [records.loop(5 + random.below(20), [records.wait(VSYNC.line, 'rising', 500 + random.below(3000)), records.word(16, Math.round(8 * long))])];
  }
}

const programOf = (seed, slow) => {
  const random = randomSource(seed);
  const list = Array.from({ length: 2 + random.below(4) }, () => stretch(random, slow)).flat(1);
  return [...list, records.end()];
};

/** Uploads the program, with slower words until the board accepts it. */
function uploadLegal(rig, seed) {
  for (let slow = 1; ; slow *= SLOWER) {
    const bytes = assembleProgram(programOf(seed, slow));
    rig.client.must({ program_begin: { program_id: 1, length: bytes.length } });
    rig.client.sendChunk(1, 0, bytes);
    const { code, commit } = rig.client.ask({ program_commit: { program_id: 1, crc32c: crc32c(bytes) } });
    if (code === 'CODE_OK') return { slow, commit };
    assert.equal(code, 'CODE_BAD_PROGRAM');
    assert.ok(slow < 20, `program ${seed} is never accepted`);
  }
}

function makeNoise(rig, random) {
  const { stimuli } = rig.board;
  const period = () => 34_000 + random.below(40_000);
  stimuli.pulse(VSYNC.gpio, 20_000 + random.below(400_000), 5000);
  stimuli.pulse(STROBE.gpio, 20_000 + random.below(400_000), 5000);
  stimuli.pulse(IN_A.gpio, period(), 9000);
  stimuli.pulse(IN_B.gpio, period(), 9000);
}

/** Requests on the wire until one of them says that the run is over; the last status. */
function askWithoutPause({ client }, random) {
  let status;
  const over = () => {
    status = client.replies.findLast((reply) => reply.status)?.status ?? status;
    return status !== undefined && status.state !== 'STATE_RUNNING';
  };
  while (!over()) {
    client.sent = (client.sent + 1) & 0xffff;
    const body = schema.encode('Request', asked[random.below(asked.length)]);
    client.pipe.write(encodeFrame({ kind: KIND.request, seq: client.sent, ack: client.expected, credit: 16, flags: 0, body }));
    client.runUntil(() => client.pipe.unsent.length < 2, 125_000);
    if (client.replies.length > 50) client.replies.splice(0, 40);
  }
  return status;
}

/** Until all is answered. */
function drain({ client }) {
  do {
    client.replies.length = 0;
    client.run(1);
  } while (client.replies.length > 0 || client.pipe.unsent.length > 0);
}

/** Runs program `number` with its noise; what it showed. */
function attempt(rig, number) {
  const seed = Math.imul(number + 1, SEED_STEP) >>> 0;
  const random = randomSource(seed ^ SEED_OF_NOISE);
  const { slow, commit } = uploadLegal(rig, seed);
  rig.commit = commit;
  rig.arm();
  makeNoise(rig, random);
  rig.client.events.length = 0;
  rig.client.arrived.length = 0;
  rig.board.recorder.clear();
  rig.board.chip.xip.flush();
  rig.client.must({ start: { now: true } });
  const { state, fault, steps } = askWithoutPause(rig, random);
  assert.equal(state, 'STATE_DONE', `program ${number} (seed ${seed}, words ${slow} as long): ${fault?.code}`);
  for (const { gpio } of [VSYNC, STROBE, IN_A, IN_B]) rig.board.stimuli.pulse(gpio, 0, 0);
  drain(rig);
  const { longest_round: round, worst_refill: refill, flash_reads: reads, queue_overflows: overflows } = rig.client.must({ get_diagnostics: {} }).diagnostics;
  assert.deepEqual([reads, overflows], [0, 0], `program ${number}`);
  return { words: steps, round, refill };
}

test('a program that the board accepts never runs out of words', { skip }, (context) => {
  const rig = prepared();
  const ledger = new Ledger('refill', IMAGE);
  const numbers = Array.from({ length: PROGRAMS }, (_, number) => number);
  for (const number of ledger.left(numbers)) ledger.note(number, attempt(rig, number));
  ledger.read();
  const results = [...ledger.results.values()];
  const words = results.reduce((sum, result) => sum + result.words, 0);
  const [round, refill] = ['round', 'refill'].map((key) => results.reduce((most, result) => Math.max(most, result[key]), 0));
  const { poll_ticks: poll, refill_ticks: each } = rig.client.must({ capabilities: {} }).capabilities;
  context.diagnostic(`${results.length} of ${PROGRAMS} programs, ${words} words; longest round ${round}, slowest refill ${refill} ticks a record`);
  assert.ok(results.length > 0);
  assert.ok(MARGIN * round + GRANT * each <= poll, `${round} ticks`);
  assert.ok(MARGIN * refill <= each, `${refill} ticks a record`);
});
