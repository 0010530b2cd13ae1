// SPDX-License-Identifier: Apache-2.0
// Frames of the virtual link: u8 type, u32 length (little endian), payload.

const HEAD = 5;
const LONGEST = 16 << 20;

export function frame(type, ...parts) {
  const payload = Buffer.concat(parts);
  const head = Buffer.alloc(HEAD);
  head.write(type, 0, 'latin1');
  head.writeUInt32LE(payload.length, 1);
  return Buffer.concat([head, payload]);
}

export function u64(value) {
  const bytes = Buffer.alloc(8);
  bytes.writeBigUInt64LE(BigInt(value));
  return bytes;
}

/** Cuts a byte stream into messages {type, payload}. */
export class FrameReader {
  constructor() {
    this.rest = Buffer.alloc(0);
  }

  *push(bytes) {
    this.rest = Buffer.concat([this.rest, bytes]);
    while (this.rest.length >= HEAD) {
      const length = this.rest.readUInt32LE(1);
      if (length > LONGEST) throw new Error(`a message of ${length} bytes is longer than ${LONGEST}`);
      if (this.rest.length < HEAD + length) return;
      const message = { type: this.rest.toString('latin1', 0, 1), payload: this.rest.subarray(HEAD, HEAD + length) };
      this.rest = this.rest.subarray(HEAD + length);
      yield message;
    }
  }
}

// A byte pipe to the board's vendor interface: bytes wait here until the device takes them, and are fetched as it has them.

const READ_BYTES = 16384;

export class BulkPipe {
  constructor(host) {
    this.host = host;
    this.unsent = [];
    this.received = [];
    this.sending = false;
    this.deliveredAt = 0; // cycle at which the device acknowledged the last byte written
    this.onBus = (what) => (what === 'attached' ? this.open(host.device) : this.close());
    host.listeners.add(this.onBus);
  }

  get isOpen() {
    return this.in !== undefined;
  }

  /** The first vendor interface with a bulk endpoint each way. */
  open(device) {
    const bulk = device.configuration.interfaces.filter((each) => each.class[0] === 0xff).flatMap((each) => each.endpoints).filter((each) => each.type === 2);
    this.in = bulk.find((each) => each.address & 0x80)?.address;
    this.out = bulk.find((each) => !(each.address & 0x80))?.address;
    if (!this.isOpen) return;
    this.listen();
    this.send();
  }

  /** The device is gone, and with it whatever was on its way. */
  close() {
    this.in = undefined;
    this.unsent = [];
    this.sending = false;
  }

  /** Gives the interface up for another pipe. */
  release() {
    this.host.listeners.delete(this.onBus);
    this.close();
    if (this.reading) this.host.cancel(this.reading);
  }

  write(bytes) {
    if (bytes.length > 0) this.unsent.push(Buffer.from(bytes));
    this.send();
  }

  send() {
    if (!this.isOpen || this.sending || this.unsent.length === 0) return;
    this.sending = true;
    const bytes = this.unsent.shift();
    this.host.submitOut(this.out & 15, bytes, ({ status }) => {
      this.sending = false;
      this.deliveredAt = this.host.chip.cycle;
      if (status === 'ok') this.send();
    });
  }

  listen() {
    this.reading = this.host.submitIn(this.in & 15, READ_BYTES, ({ status, data }) => {
      if (data.length > 0) this.received.push(data);
      if (status === 'ok') this.listen();
    });
  }

  /** What has come so far. */
  take() {
    const bytes = Buffer.concat(this.received);
    this.received = [];
    return bytes;
  }
}
