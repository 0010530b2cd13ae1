// SPDX-License-Identifier: Apache-2.0
// The golden vectors of the wire (tests/golden/wire) against this second implementation.

import assert from 'node:assert/strict';
import fs from 'node:fs';
import { test } from 'node:test';
import { assembleProgram, configHash, records, schema } from './client.mjs';
import { crc32c, decodeFrame, encodeFrame, FrameCutter, stuff, unstuff } from './frames.mjs';

function vectors(name) {
  const text = fs.readFileSync(new URL(`../../golden/wire/${name}.txt`, import.meta.url), 'utf8');
  return text.split('\n').filter((line) => line && !line.startsWith('#')).map((line) => line.split(' '));
}

const bytes = (hex) => (hex === '-' ? Buffer.alloc(0) : Buffer.from(hex, 'hex'));

test('CRC-32C', () => assert.equal(crc32c(Buffer.from('123456789')), 0xe3069283));

test('frames, both ways', () => {
  const all = vectors('frames');
  assert.ok(all.length > 5);
  for (const [name, kind, seq, ack, credit, flags, body, whole] of all) {
    const frame = { kind: +kind, seq: +seq, ack: +ack, credit: +credit, flags: +flags, body: bytes(body) };
    assert.equal(encodeFrame(frame).toString('hex'), whole, name);
    assert.deepEqual(decodeFrame(bytes(whole).subarray(0, -1)), frame, name);
  }
});

test('byte stuffing of every length', () => {
  for (let length = 0; length < 600; length++) {
    const plain = Buffer.from(Array.from({ length }, (_, i) => (i * 7) % 5 && length % 3 ? i & 255 : length % 2 ? 0 : 1));
    const stuffed = stuff(plain);
    assert.ok(!stuffed.includes(0));
    assert.deepEqual(unstuff(stuffed), plain);
  }
});

test('a stream with noise gives the sound frames', () => {
  const good = encodeFrame({ kind: 5, seq: 3 });
  const cutter = new FrameCutter();
  const noise = Buffer.concat([Buffer.from([7, 7, 0, 0]), good, good.subarray(0, 5), Buffer.from([0]), good]);
  const got = [...noise].flatMap((byte) => [...cutter.push(Buffer.from([byte]))]);
  assert.equal(got.length, 2);
  assert.equal(cutter.damaged, 2);
});

test('the schema file is understood', () => {
  assert.ok(Object.keys(schema.messages).length > 30);
  const reply = schema.encode('Reply', { code: 'CODE_BAD_STATE', detail: 2 ** 40, hello: { board: 'x', schema_hash: 0x12345678, unique_id: [1, 2] } });
  const read = schema.decode('Reply', reply);
  assert.equal(read.code, 'CODE_BAD_STATE');
  assert.equal(read.detail, 2 ** 40);
  assert.equal(read.hello.schema_hash, 0x12345678);
  assert.deepEqual([...read.hello.unique_id], [1, 2]);
  assert.equal(read.status, undefined);
});

test('a program of the golden file, written here', () => {
  const [, hex, crc] = vectors('programs').find(([name]) => name === 'extremes');
  const program = assembleProgram([records.word(0xfffffff, 1), records.loop(2 ** 32, [records.word(0, 1)]), records.end()]);
  assert.equal(program.length % 8, 0);
  assert.equal(crc32c(bytes(hex)), parseInt(crc, 16));
});

test('hash of a configuration', () => {
  const output = { line: 0, direction: 'DIRECTION_OUTPUT', role: 'LINE_ROLE_PROJECTOR_TRIGGER' };
  assert.notEqual(configHash([output]), configHash([{ ...output, safe_level: true }]));
  assert.equal(configHash([output, { line: 1 }]), configHash([{ line: 1 }, output]));
});
