// SPDX-License-Identifier: Apache-2.0
// The virtual link, spoken from outside to the server as it is started by hand.

import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import fs from 'node:fs';
import net from 'node:net';
import os from 'node:os';
import path from 'node:path';
import { after, before, test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { imageFile } from '../testing/images.mjs';
import { frame, FrameReader, u64 } from './link.mjs';

const SERVER = fileURLToPath(new URL('server.mjs', import.meta.url));
let folder;
let place;
let process_;
let readyLine;

before(async () => {
  folder = fs.mkdtempSync(path.join(os.tmpdir(), 'virtual-'));
  place = path.join(folder, 'board.sock');
  const options = ['--uf2', imageFile('usb'), '--unix', place, '--vcd', path.join(folder, 'all.vcd')];
  process_ = spawn(process.execPath, [SERVER, ...options], { stdio: ['ignore', 'pipe', 'inherit'] });
  readyLine = await new Promise((resolve) => process_.stdout.once('data', (bytes) => resolve(bytes.toString())));
});

after(async () => {
  const ended = new Promise((resolve) => process_.once('exit', resolve));
  process_.kill('SIGTERM');
  await ended;
  fs.rmSync(folder, { recursive: true, force: true });
});

test('one line says that it is ready', () => {
  assert.equal(readyLine, `ready virtual:unix:${place}\n`);
});

test('hello, bytes both ways, time that stands still outside of reads', async () => {
  const client = await VirtualClient.connect({ path: place });
  const hello = await client.must('h');
  assert.equal(hello.readUInt32LE(0), 1);
  assert.equal(hello.readBigUInt64LE(4), 125_000_000n);
  assert.equal(hello.toString('utf8', 12), 'pico-emulated');
  const begin = (await client.must('n')).readBigUInt64LE();
  await client.write('one');
  assert.equal((await client.must('n')).readBigUInt64LE(), begin);
  const { now, bytes } = await client.read(5_000_000);
  assert.equal(bytes.toString(), 'one');
  assert.ok(now > Number(begin) && now < Number(begin) + 5_000_000);
  const late = await client.read(1_000_000);
  assert.equal(late.bytes.length, 0);
  assert.equal(late.now, now + 1_000_000);
  await client.close();
});

test('several writes queue; requests sent together are answered in order', async () => {
  const client = await VirtualClient.connect({ path: place });
  const big = Buffer.alloc(1000, 'x');
  const answers = await Promise.all([client.ask('w', big), client.ask('w', Buffer.from('end')), client.ask('n')]);
  assert.deepEqual(answers.map((each) => each.type), ['w', 'w', 'n']);
  let got = '';
  for (let i = 0; i < 50 && got.length < 1003; i++) got += (await client.read(2_000_000)).bytes.toString();
  assert.equal(got, `${'x'.repeat(1000)}end`);
  await client.close();
});

test('pins: drive, wire, pulse, and the edges of all', async () => {
  const client = await VirtualClient.connect({ path: place });
  await client.must('e');
  await client.must('i', Buffer.from([20, 1]));
  await client.must('j', Buffer.from([20, 21]));
  await client.must('v', Buffer.from([16]), u64(1_000_000), u64(8000));
  await client.read(2_500_000);
  await client.must('j', Buffer.from([255, 255]));
  await client.must('i', Buffer.from([20, 2]));
  await client.must('v', Buffer.from([16]), u64(0), u64(0));
  const bytes = await client.must('e');
  const edges = [];
  for (let at = 0; at < bytes.length; at += 10) edges.push([Number(bytes.readBigUInt64LE(at)), bytes[at + 8], bytes[at + 9]]);
  const begin = edges[0][0];
  assert.deepEqual(edges.map(([cycle, gpio, level]) => [cycle - begin, gpio, level]), [
    [0, 20, 1], [0, 21, 1],
    [125_000, 16, 1], [126_000, 16, 0], [250_000, 16, 1], [251_000, 16, 0],
    [312_500, 21, 0], [312_500, 20, 0],
  ]);
  assert.equal((await client.must('e')).length, 0);
  await client.close();
});

test('a power cycle begins time anew and leaves the wiring alone', async () => {
  const client = await VirtualClient.connect({ path: place });
  await client.must('i', Buffer.from([20, 1]));
  await client.must('j', Buffer.from([20, 21]));
  await client.read(50_000_000);
  const before = (await client.must('n')).readBigUInt64LE();
  await client.must('p');
  assert.ok((await client.must('n')).readBigUInt64LE() < before);
  const bytes = await client.must('e');
  const rises = [];
  for (let at = 0; at < bytes.length; at += 10) if (bytes[at + 9] === 1) rises.push(bytes[at + 8]);
  assert.ok(rises.includes(20) && rises.includes(21));
  await client.must('j', Buffer.from([255, 255]));
  await client.must('i', Buffer.from([20, 2]));
  await client.close();
});

test('cable and power; a client may go and another come', async () => {
  const first = await VirtualClient.connect({ path: place });
  await first.must('d', Buffer.from([0]));
  const refused = await first.ask('w', Buffer.from('lost'));
  assert.equal(refused.type, 'x');
  assert.match(refused.payload.toString(), /the USB cable is out/);
  await first.must('d', Buffer.from([1]));
  first.socket.destroy();
  const second = await VirtualClient.connect({ path: place });
  await second.write('second');
  assert.equal((await second.read(5_000_000)).bytes.toString(), 'second');
  await second.must('p');
  assert.ok(fs.existsSync(path.join(folder, 'all.vcd')));
  await second.write('power');
  assert.equal((await second.read(5_000_000)).bytes.toString(), 'power');
  await second.close();
});

test('what it cannot do is told and named; the connection goes on', async () => {
  const client = await VirtualClient.connect({ path: place });
  for (const [type, payload, words] of [
    ['z', [], /'z' is not known to version 1/],
    ['i', [31, 1], /GPIO31 does not exist/],
    ['i', [3, 7], /level 7/],
    ['i', [3], /1 bytes, expected 2/],
    ['v', [...Buffer.concat([Buffer.from([16]), u64(100), u64(200)])], /pulse of 200 ns every 100 ns/],
    ['r', [1], /expected 8/],
  ]) {
    const answer = await client.ask(type, Buffer.from(payload));
    assert.equal(answer.type, 'x');
    assert.match(answer.payload.toString(), words);
  }
  await client.must('n');
  await client.close();
});

test('a second client at the same time is turned away', async () => {
  const client = await VirtualClient.connect({ path: place });
  await client.must('n');
  const other = await VirtualClient.open({ path: place });
  const told = await new Promise((resolve) => other.waiting.push(resolve));
  assert.match(told.payload.toString(), /another client/);
  await client.close();
});

test('clients that come right after another are not turned away', async () => {
  for (let i = 0; i < 20; i++) {
    const client = await VirtualClient.connect({ path: place });
    client.socket.end();
  }
  const last = await VirtualClient.connect({ path: place });
  await last.close();
});

test('a recording is written when a client goes', async () => {
  const client = await VirtualClient.connect({ path: place });
  await client.must('i', Buffer.from([20, 1]));
  await client.read(100_000);
  await client.close();
  const next = await VirtualClient.connect({ path: place }); // whoever comes next finds it written
  const text = fs.readFileSync(path.join(folder, 'all-2.vcd'), 'utf8'); // after two power cycles
  assert.match(text, /\$var wire 1 \S GPIO20 \$end/);
  assert.match(text, /^#\d+\n1/m);
  await next.close();
});

// A client of the virtual link, for tests.

export class VirtualClient {
  constructor(socket) {
    this.socket = socket;
    this.waiting = [];
    const reader = new FrameReader();
    socket.on('data', (bytes) => {
      for (const message of reader.push(bytes)) this.waiting.shift()?.(message);
    });
    socket.on('close', () => {
      for (const resolve of this.waiting.splice(0)) resolve({ type: 'x', payload: Buffer.from('the connection was closed') });
    });
  }

  /** The one client, also right after another one has left. */
  static async connect(place) {
    const client = await VirtualClient.open(place);
    await client.must('n');
    return client;
  }

  /** One that may be turned away. */
  static open(place) {
    return new Promise((resolve, reject) => {
      const socket = net.connect(place, () => resolve(new VirtualClient(socket)));
      socket.on('error', reject);
    });
  }

  ask(type, ...parts) {
    return new Promise((resolve) => {
      this.waiting.push(resolve);
      this.socket.write(frame(type, ...parts));
    });
  }

  /** Asks, and insists on an answer of the same type. */
  async must(type, ...parts) {
    const answer = await this.ask(type, ...parts);
    if (answer.type !== type) throw new Error(`'${type}' was answered '${answer.type}': ${answer.payload}`);
    return answer.payload;
  }

  write(text) {
    return this.must('w', Buffer.from(text));
  }

  async read(nanoseconds) {
    const payload = await this.must('r', u64(nanoseconds));
    return { now: Number(payload.readBigUInt64LE()), bytes: payload.subarray(8) };
  }

  close() {
    return new Promise((resolve) => {
      this.socket.once('close', resolve);
      this.socket.end();
    });
  }
}
