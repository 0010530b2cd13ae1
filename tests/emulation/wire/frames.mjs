// SPDX-License-Identifier: Apache-2.0
// Frames of the symrig wire (protocol/PROTOCOL.md, "Frames"), written a second time, from the document alone.

const MAJOR = 1;
const HEADER = 8;

export const KIND = { request: 1, reply: 2, event: 3, data: 4, ack: 5, nak: 6 };
export const FLAG = { sync: 1, urgent: 2 };

const table = Array.from({ length: 256 }, (_, byte) => {
  let crc = byte;
  for (let bit = 0; bit < 8; bit++) crc = crc & 1 ? (crc >>> 1) ^ 0x82f63b78 : crc >>> 1;
  return crc >>> 0;
});

/** CRC-32C. */
export function crc32c(bytes) {
  let crc = 0xffffffff;
  for (const byte of bytes) crc = (crc >>> 8) ^ table[(crc ^ byte) & 255];
  return ~crc >>> 0;
}

/** COBS without the closing zero. */
export function stuff(bytes) {
  const out = [];
  let run = [];
  const flush = () => {
    out.push(run.length + 1, ...run);
    run = [];
  };
  bytes.forEach((byte, i) => {
    if (byte === 0) return flush();
    run.push(byte);
    if (run.length === 254 && i + 1 < bytes.length) flush();
    return undefined;
  });
  if (run.length === 254) out.push(255, ...run);
  else flush();
  return Buffer.from(out);
}

/** Undoes it; null if the bytes cannot come from it. */
export function unstuff(bytes) {
  const out = [];
  for (let at = 0; at < bytes.length; ) {
    const code = bytes[at];
    if (code === 0 || at + code > bytes.length) return null;
    out.push(...bytes.subarray(at + 1, at + code));
    at += code;
    if (code < 255 && at < bytes.length) out.push(0);
  }
  return Buffer.from(out);
}

export function encodeFrame({ kind, seq = 0, ack = 0, credit = 0, flags = 0, body = Buffer.alloc(0) }) {
  const head = Buffer.alloc(HEADER);
  head[0] = MAJOR;
  head[1] = kind;
  head.writeUInt16LE(seq, 2);
  head.writeUInt16LE(ack, 4);
  head[6] = credit;
  head[7] = flags;
  const crc = Buffer.alloc(4);
  crc.writeUInt32LE(crc32c(Buffer.concat([head, body])));
  return Buffer.concat([stuff(Buffer.concat([head, body, crc])), Buffer.alloc(1)]);
}

/** A frame from what stood between two zeros; null if it is damaged. */
export function decodeFrame(stuffed) {
  const bytes = unstuff(stuffed);
  if (!bytes || bytes.length < HEADER + 4 || bytes[0] !== MAJOR) return null;
  const end = bytes.length - 4;
  if (crc32c(bytes.subarray(0, end)) !== bytes.readUInt32LE(end)) return null;
  return { kind: bytes[1], seq: bytes.readUInt16LE(2), ack: bytes.readUInt16LE(4), credit: bytes[6], flags: bytes[7], body: bytes.subarray(HEADER, end) };
}

/** Cuts a stream of bytes into frames; damaged ones are counted. */
export class FrameCutter {
  constructor() {
    this.rest = Buffer.alloc(0);
    this.damaged = 0;
  }

  *push(bytes) {
    this.rest = Buffer.concat([this.rest, bytes]);
    for (let end = this.rest.indexOf(0); end >= 0; end = this.rest.indexOf(0)) {
      const frame = end > 0 ? decodeFrame(this.rest.subarray(0, end)) : undefined;
      this.rest = this.rest.subarray(end + 1);
      if (frame === null) this.damaged++;
      else if (frame) yield frame;
    }
  }
}
