// SPDX-License-Identifier: Apache-2.0
// A host's end of the wire, for tests of the emulated board: asks and waits in emulated time, takes events, uploads programs.

import fs from 'node:fs';
import { BulkPipe } from '../board/link.mjs';
import { CYCLES_PER_MILLISECOND } from '../clock/time.mjs';
import { crc32c, encodeFrame, FLAG, FrameCutter, KIND, Schema } from './frames.mjs';

export const schema = new Schema(fs.readFileSync(new URL('../../../protocol/symrig.proto', import.meta.url), 'utf8'));

const CREDIT = 16;
const CHUNK = 488;
const ANSWER_LIMIT = 500 * CYCLES_PER_MILLISECOND;

export class WireClient {
  /** `board` must be enumerated already. */
  constructor(board) {
    this.board = board;
    this.pipe = new BulkPipe(board.host);
    this.pipe.open(board.host.device);
    this.cutter = new FrameCutter();
    this.sent = 0x1000; // number of the last numbered frame
    this.expected = 0; // number of the event to come
    this.events = []; // {name, ...fields}
    this.arrived = []; // cycle at which each event came in
    this.replies = [];
    this.acknowledged = 0;
    this.naks = 0;
  }

  frame(kind, { body, flags = 0, seq = this.sent } = {}) {
    this.pipe.write(encodeFrame({ kind, seq, ack: this.expected, credit: CREDIT, flags, body }));
  }

  /** Takes what has come in. */
  receive() {
    if (this.pipe.received.length === 0) return;
    for (const frame of this.cutter.push(this.pipe.take())) this.take(frame);
  }

  take(frame) {
    if (frame.kind === KIND.event) return this.takeEvent(frame);
    if (frame.kind === KIND.nak) this.naks++;
    if (frame.kind !== KIND.reply) return (this.acknowledged = frame.ack);
    this.acknowledged = frame.flags & FLAG.urgent ? this.acknowledged : frame.ack;
    return this.replies.push({ ...schema.decode('Reply', frame.body), frame });
  }

  takeEvent({ seq, body }) {
    if (seq !== this.expected) return this.frame(KIND.nak);
    this.expected = (this.expected + 1) & 0xffff;
    const [[name, fields]] = Object.entries(schema.decode('Event', body)).filter(([, content]) => content !== undefined);
    this.events.push({ event: name, ...fields });
    this.arrived.push(this.board.cycle);
    return this.frame(KIND.ack);
  }

  /** Runs the board until `condition()`; false if that takes more than `cycles`. */
  runUntil(condition, cycles = ANSWER_LIMIT) {
    return this.board.run(cycles, () => {
      this.receive();
      return condition();
    });
  }

  run(milliseconds) {
    this.runUntil(() => false, Math.round(milliseconds * CYCLES_PER_MILLISECOND));
  }

  /** One request, `{name: fields}`; its reply, whatever its code. */
  ask(request, { sync = false, urgent = false } = {}) {
    this.replies = [];
    if (!urgent) this.sent = (this.sent + 1) & 0xffff;
    this.frame(KIND.request, { body: schema.encode('Request', request), flags: (sync ? FLAG.sync : 0) | (urgent ? FLAG.urgent : 0) });
    if (!this.runUntil(() => this.replies.length > 0)) throw new Error(`no answer to ${Object.keys(request)[0]}`);
    return this.replies[0];
  }

  /** A request that must succeed. */
  must(request, options) {
    const reply = this.ask(request, options);
    if (reply.code !== 'CODE_OK') {
      const { code, field, detail, violation } = reply;
      throw new Error(`${Object.keys(request)[0]}: ${JSON.stringify({ code, field, detail: Number(detail), violation })}`);
    }
    return reply;
  }

  /** Begins a session. A zero first: whatever was begun before is over then. */
  hello() {
    this.pipe.write(Buffer.from([0]));
    const reply = this.must({ hello: { proto_major: 1, proto_minor: 0 } }, { sync: true });
    this.expected = reply.frame.seq;
    return reply.hello;
  }

  /** Lines as ConfigLine messages; gives the configuration's hash. */
  configure(lines) {
    this.must({ reset_config: {} });
    for (const line of lines) this.must({ config_line: line });
    const hash = configHash(lines);
    this.must({ finalize_config: { hash } });
    return hash;
  }

  /** Begin, all chunks with as many on their way as the board takes, commit. */
  upload(program, id = 1) {
    const { window } = this.must({ capabilities: {} }).capabilities;
    this.must({ program_begin: { program_id: id, length: program.length } });
    for (let offset = 0; offset < program.length; offset += CHUNK) {
      this.runUntil(() => this.inFlight() < window);
      this.sendChunk(id, offset, program.subarray(offset, offset + CHUNK));
    }
    if (!this.runUntil(() => this.inFlight() === 0)) throw new Error('chunks are not acknowledged');
    return this.must({ program_commit: { program_id: id, crc32c: crc32c(program) } }).commit;
  }

  sendChunk(id, offset, bytes) {
    const head = Buffer.alloc(12);
    head.writeUInt32LE(id, 0);
    head.writeUInt32LE(offset, 4);
    head.writeUInt16LE(bytes.length, 8);
    this.sent = (this.sent + 1) & 0xffff;
    this.frame(KIND.data, { body: Buffer.concat([head, bytes]) });
  }

  inFlight() {
    return (this.sent + 1 - this.acknowledged) & 0xffff;
  }

  /** Runs until an event of this name has come in. */
  waitFor(name, milliseconds = 1000) {
    let seen = this.events.length;
    let found;
    const look = () => {
      while (!found && seen < this.events.length) if (this.events[seen++].event === name) found = this.events[seen - 1];
      return found !== undefined;
    };
    if (!this.runUntil(look, milliseconds * CYCLES_PER_MILLISECOND)) throw new Error(`no event ${name} within ${milliseconds} ms`);
    return found;
  }
}

/** PROTOCOL.md, "Hash of a configuration". */
export function configHash(lines) {
  const records = lines.slice().sort((a, b) => a.line - b.line).map((line) => {
    const record = Buffer.alloc(24);
    record[0] = line.line;
    record[1] = line.direction === 'DIRECTION_OUTPUT' ? 1 : 0;
    record[2] = schema.enums.LineRole[line.role] ?? 0;
    record[3] = schema.enums.Hazard[line.hazard] ?? 0;
    record[4] = line.safe_level ? 1 : 0;
    record[5] = (line.capture ? 1 : 0) | (line.trip_level ? 2 : 0);
    record.writeUInt16LE(line.max_duty_permille ?? 0, 6);
    record.writeBigUInt64LE(BigInt(line.max_on ?? 0), 8);
    record.writeBigUInt64LE(BigInt(line.min_off ?? 0), 16);
    return record;
  });
  return crc32c(Buffer.concat(records));
}

const EDGES = { rising: 0, falling: 1, both: 2 };

/** Programs, record by record (PROTOCOL.md, "Programs"). */
export const records = {
  word: (levels, ticks) => [0x10000000 | levels, ticks],
  loop: (rounds, body) => [[(0x20000000 | Math.floor(rounds / 2 ** 32)) >>> 0, rounds % 2 ** 32], ...body, [0x30000000, 0]],
  wait: (line, edge, ticks, abort = false) => [0x40000000 | line | (EDGES[edge] << 5) | (abort ? 0x80 : 0), ticks],
  mark: (id) => [0x50000000 | id, 0],
  end: (levels = 0) => [0x60000000 | levels, 0],
};

/** A list of records, loops nested in it, as the bytes to upload. */
export function assembleProgram(list) {
  const flat = [];
  const add = (item) => (Array.isArray(item[0]) ? item.forEach(add) : flat.push(item));
  list.forEach(add);
  const bytes = Buffer.alloc(8 * flat.length);
  flat.forEach(([word, ticks], i) => {
    bytes.writeUInt32LE(word >>> 0, 8 * i);
    bytes.writeUInt32LE(ticks >>> 0, 8 * i + 4);
  });
  return bytes;
}
