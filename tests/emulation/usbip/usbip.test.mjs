// SPDX-License-Identifier: Apache-2.0
// The USB/IP protocol, spoken by hand as Linux' vhci-hcd speaks it.

import assert from 'node:assert/strict';
import net from 'node:net';
import { after, before, test } from 'node:test';
import { boardWith } from '../testing/images.mjs';
import { serve, WallClock } from './server.mjs';

const ECONNRESET = -104;
const EPIPE = -32;
let server;
let clock;
let board;

before(async () => {
  board = boardWith('usb');
  board.connect();
  clock = new WallClock(board, (error) => {
    throw error;
  });
  server = serve(board, clock);
  await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));
});

after(() => {
  clock.stop();
  server.close();
});

/** Reads exact numbers of bytes from a socket. */
class Client {
  static async connect() {
    const client = new Client();
    client.bytes = Buffer.alloc(0);
    client.socket = net.connect(server.address().port, '127.0.0.1');
    client.socket.on('data', (bytes) => {
      client.bytes = Buffer.concat([client.bytes, bytes]);
      client.wake?.();
    });
    client.closed = new Promise((resolve) => client.socket.once('close', resolve));
    await new Promise((resolve) => client.socket.once('connect', resolve));
    client.sequence = 0;
    return client;
  }

  async take(count) {
    while (this.bytes.length < count) await new Promise((resolve) => (this.wake = resolve));
    const head = this.bytes.subarray(0, count);
    this.bytes = this.bytes.subarray(count);
    return head;
  }

  async import(busId = '1-1') {
    const request = Buffer.alloc(40);
    request.writeUInt32BE(0x01118003, 0);
    request.write(busId, 8);
    this.socket.write(request);
    const head = await this.take(8);
    return head.readUInt32BE(4) === 0 ? this.take(312) : null;
  }

  submit(endpoint, reads, { length = 0, data = Buffer.alloc(0), setup = Buffer.alloc(8), flags = 0 } = {}) {
    const head = Buffer.alloc(48);
    const sequence = ++this.sequence;
    [1, sequence, (1 << 16) | 2, +reads, endpoint, flags, reads ? length : data.length].forEach((word, i) => head.writeUInt32BE(word, 4 * i));
    Buffer.from(setup).copy(head, 40);
    this.socket.write(Buffer.concat([head, data]));
    return sequence;
  }

  unlink(target) {
    const head = Buffer.alloc(48);
    const sequence = ++this.sequence;
    [2, sequence, 0, 0, 0, target].forEach((word, i) => head.writeUInt32BE(word, 4 * i));
    this.socket.write(head);
    return sequence;
  }

  /** The next answer; `reads` tells whether its data follow. */
  async answer(reads = false) {
    const head = await this.take(48);
    const [command, sequence] = [head.readUInt32BE(0), head.readUInt32BE(4)];
    const [status, length] = [head.readInt32BE(20), head.readUInt32BE(24)];
    return { command, sequence, status, length, data: reads ? await this.take(length) : null };
  }

  async control(setup, reads, options = {}) {
    this.submit(0, reads, { setup, length: setup[6] | (setup[7] << 8), ...options });
    return this.answer(reads);
  }

  close() {
    this.socket.destroy();
    return this.closed;
  }
}

test('the list names one device with its interfaces', async () => {
  const client = await Client.connect();
  client.socket.write(Buffer.from([1, 0x11, 0x80, 5, 0, 0, 0, 0]));
  const list = await client.take(12 + 312 + 12);
  assert.equal(list.readUInt32BE(0), 0x01110005);
  assert.equal(list.readUInt32BE(8), 1);
  assert.equal(list.toString('latin1', 12 + 256, 12 + 259), '1-1');
  assert.deepEqual([list.readUInt16BE(12 + 300), list.readUInt16BE(12 + 302)], [0x1209, 1]);
  assert.deepEqual([...list.subarray(12 + 306, 12 + 312)], [0xef, 2, 1, 1, 1, 3]);
  assert.deepEqual([...list.subarray(12 + 312)], [0xff, 0, 0, 0, 2, 2, 0, 0, 10, 0, 0, 0]);
  await client.close();
});

test('a wrong bus id is refused', async () => {
  const client = await Client.connect();
  assert.equal(await client.import('9-9'), null);
  await client.closed;
});

test('import, control both ways, bulk, stall', async () => {
  const client = await Client.connect();
  assert.ok(await client.import());
  const device = await client.control([0x80, 6, 0, 1, 0, 0, 18, 0], true);
  assert.deepEqual([device.command, device.status, device.length], [3, 0, 18]);
  assert.equal(device.data.readUInt16LE(8), 0x1209);
  assert.equal((await client.control([0, 9, 1, 0, 0, 0, 0, 0], false)).status, 0);
  const coding = Buffer.from([1, 2, 3, 4, 5, 6, 7]);
  assert.equal((await client.control([0x21, 0x20, 0, 0, 1, 0, 7, 0], false, { data: coding })).status, 0);
  assert.deepEqual((await client.control([0xa1, 0x21, 0, 0, 1, 0, 7, 0], true)).data, coding);
  assert.equal((await client.control([0xc0, 0x77, 0, 0, 0, 0, 2, 0], true)).status, EPIPE);
  for (let i = 0; i < 50; i++) {
    client.submit(1, false, { data: Buffer.from(`round ${i}`) });
    assert.deepEqual({ ...(await client.answer()), data: 0 }, { command: 3, sequence: client.sequence, status: 0, length: `round ${i}`.length, data: 0 });
    client.submit(1, true, { length: 512 });
    assert.equal((await client.answer(true)).data.toString(), `round ${i}`);
  }
  assert.deepEqual(board.host.errors, []);
  await client.close();
});

test('unlink ends a transfer that waits, and not one that is over', async () => {
  const client = await Client.connect();
  await client.import();
  const waiting = client.submit(1, true, { length: 64 });
  const unlink = client.unlink(waiting);
  assert.deepEqual(await client.answer(), { command: 4, sequence: unlink, status: ECONNRESET, length: 0, data: null });
  client.submit(3, false, { data: Buffer.from('abc') });
  await client.answer();
  const over = client.submit(3, true, { length: 64 });
  assert.equal((await client.answer(true)).data.toString(), 'ABC');
  client.unlink(over);
  assert.equal((await client.answer()).status, 0);
  await client.close();
});

test('a full last packet is followed by an empty one if the host asks for that', async () => {
  const client = await Client.connect();
  await client.import();
  client.submit(1, false, { data: Buffer.alloc(64, 'q'), flags: 0x40 });
  assert.equal((await new Promise((resolve) => (client.submit(1, true, { length: 512 }), client.answer().then(resolve)))).command, 3);
  const answer = await client.answer(true);
  assert.equal(answer.data.toString(), 'q'.repeat(64), 'ended by the echo of the empty packet');
  await client.close();
});

test('a client that goes in the middle leaves the board fit for the next', async () => {
  const first = await Client.connect();
  await first.import();
  for (let i = 0; i < 5; i++) first.submit(1, true, { length: 64 });
  await first.close();
  const second = await Client.connect();
  await second.import();
  second.submit(1, false, { data: Buffer.from('second') });
  await second.answer();
  second.submit(1, true, { length: 64 });
  assert.equal((await second.answer(true)).data.toString(), 'second');
  await second.close();
});

test('a board that leaves the bus ends the connection', async () => {
  const client = await Client.connect();
  await client.import();
  board.host.plug(false);
  await client.closed;
  board.host.plug(true);
});

test('what is no USB/IP is thrown out', async () => {
  const client = await Client.connect();
  client.socket.write(Buffer.from('GET / HTTP/1.1\r\n\r\n'));
  await client.closed;
});
