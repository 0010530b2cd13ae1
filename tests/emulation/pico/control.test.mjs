// SPDX-License-Identifier: Apache-2.0
// Endpoint 0 with a host that gives up in any stage and resets the bus at any time: each transfer that ends well has exactly the bytes that
// it had when nothing disturbed it. SYMRIG_LONG=1: 100,000 transfers.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { randomSource } from '../testing/random.mjs';
import { PicoRig, skip } from './rig.mjs';

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
