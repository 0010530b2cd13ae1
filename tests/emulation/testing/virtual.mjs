// SPDX-License-Identifier: Apache-2.0
// A client of the virtual link, for tests.

import net from 'node:net';
import { FrameReader, frame, u64 } from '../board/link.mjs';

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
