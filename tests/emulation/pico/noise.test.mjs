// SPDX-License-Identifier: Apache-2.0
// Nonsense over USB: the image must neither fault nor hang, move no output, and answer a sound hello afterwards. The emulation ends with
// an error at whatever silicon would fault at.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { randomSource } from '../testing/random.mjs';
import { schema } from '../wire/client.mjs';
import { encodeFrame } from '../wire/frames.mjs';
import { PicoRig, skip } from './rig.mjs';

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
