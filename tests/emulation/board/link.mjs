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
