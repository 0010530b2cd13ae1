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

// Protocol Buffers as far as symrig.proto uses them. The schema is read from that file, so there is no second list of fields to keep.

const VARINT = new Set(['uint32', 'uint64', 'bool']);
const FIXED = { fixed32: 4, fixed64: 8 };

/** {messages: {name: [{name, type, number}]}, enums: {name: {VALUE: number}}} */
export function parseSchema(text) {
  const messages = {};
  const enums = {};
  const plain = text.replace(/\/\/.*$/gm, '');
  for (const [, kind, name, body] of plain.matchAll(/\b(message|enum)\s+(\w+)\s*\{((?:[^{}]|\{[^{}]*\})*)\}/g)) {
    if (kind === 'enum') enums[name] = Object.fromEntries([...body.matchAll(/(\w+)\s*=\s*(\d+)\s*;/g)].map(([, key, value]) => [key, Number(value)]));
    else messages[name] = [...body.matchAll(/(\w+)\s+(\w+)\s*=\s*(\d+)\s*;/g)].map(([, type, field, number]) => ({ type, name: field, number: Number(number) }));
  }
  return { messages, enums };
}

function varint(value) {
  const bytes = [];
  for (let rest = BigInt(value); ; rest >>= 7n) {
    const low = Number(rest & 127n);
    if (rest < 128n) return Buffer.from([...bytes, low]);
    bytes.push(low | 128);
  }
}

function readVarint(bytes, at) {
  let value = 0n;
  for (let shift = 0n; ; shift += 7n) {
    if (at >= bytes.length) throw new Error('a number without end');
    const byte = bytes[at++];
    value |= BigInt(byte & 127) << shift;
    if (byte < 128) return [Number(value), at];
  }
}

const tag = (number, wireType) => varint((number << 3) | wireType);

function fixed(value, size) {
  const bytes = Buffer.alloc(size);
  if (size === 4) bytes.writeUInt32LE(Number(value));
  else bytes.writeBigUInt64LE(BigInt(value));
  return bytes;
}

export class Schema {
  constructor(text) {
    Object.assign(this, parseSchema(text));
  }

  /** An object as bytes; fields are named as in the file, enums given by name or number. */
  encode(type, value) {
    const parts = [];
    for (const [name, content] of Object.entries(value)) {
      const field = this.messages[type].find((each) => each.name === name);
      if (!field) throw new Error(`${type} has no field ${name}`);
      parts.push(this.encodeField(field, content));
    }
    return Buffer.concat(parts);
  }

  encodeField({ type, number }, content) {
    if (type in FIXED) return Buffer.concat([tag(number, type === 'fixed64' ? 1 : 5), fixed(content, FIXED[type])]);
    if (VARINT.has(type)) return Buffer.concat([tag(number, 0), varint(Number(content))]);
    if (type in this.enums) return Buffer.concat([tag(number, 0), varint(this.enums[type][content] ?? content)]);
    const bytes = type in this.messages ? this.encode(type, content) : Buffer.from(content);
    return Buffer.concat([tag(number, 2), varint(bytes.length), bytes]);
  }

  /** Every field that is there or has a default; a message that is not there is undefined. */
  decode(type, bytes) {
    const result = {};
    for (const field of this.messages[type]) if (!(field.type in this.messages)) result[field.name] = this.defaultOf(field.type);
    for (let at = 0; at < bytes.length; ) {
      let key;
      [key, at] = readVarint(bytes, at);
      const field = this.messages[type].find((each) => each.number === key >>> 3);
      let content;
      [content, at] = this.readContent(bytes, at, key & 7);
      if (field) result[field.name] = this.interpret(field.type, content);
    }
    return result;
  }

  defaultOf(type) {
    if (type === 'string') return '';
    if (type === 'bytes') return Buffer.alloc(0);
    if (type === 'bool') return false;
    return type in this.enums ? this.interpret(type, 0) : 0;
  }

  readContent(bytes, at, wireType) {
    if (wireType === 0) return readVarint(bytes, at);
    if (wireType === 5) return [bytes.readUInt32LE(at), at + 4];
    if (wireType === 1) return [bytes.readBigUInt64LE(at), at + 8];
    const [length, begin] = readVarint(bytes, at);
    if (begin + length > bytes.length) throw new Error('a field beyond the end');
    return [bytes.subarray(begin, begin + length), begin + length];
  }

  interpret(type, content) {
    if (type in this.messages) return this.decode(type, content);
    if (type in this.enums) return Object.keys(this.enums[type]).find((name) => this.enums[type][name] === content) ?? content;
    if (type === 'string') return content.toString('utf8');
    return type === 'bool' ? content === 1 : content;
  }
}
