// SPDX-License-Identifier: Apache-2.0
// One emulated board behind the virtual link: what each message does. Time stands still except in 'r', and in 'd' and 'p' as far as
// enumeration needs.

import fs from 'node:fs';
import path from 'node:path';
import { CLOCK_HZ, NANOSECONDS_PER_CYCLE } from '../clock/time.mjs';
import { pinNames, vcd } from '../edges/edges.mjs';
import { Board } from './board.mjs';
import { writeFlash } from './image.mjs';
import { BulkPipe, frame, u64 } from './link.mjs';

export const VERSION = 1;
const NAME = 'pico-emulated';
const PINS = 30;
const REMOVE_ALL = 255;
const ENUMERATION_MS = 2000;
const REBOOT_MS = 50;

export class BoardSession {
  /** `vcdFile`: where to write all edges at power-off and at the end; `options` as for Board. */
  constructor(uf2, { vcdFile, name = NAME, ...options } = {}) {
    Object.assign(this, { uf2, vcdFile, name, options, powerCycles: -1 });
    this.powerUp();
  }

  /** A fresh board with its cable in; flash keeps what was written to it, and what is connected outside stays connected. */
  powerUp() {
    const former = this.board;
    this.powerCycles++;
    this.board = new Board(this.uf2, this.options);
    this.board.recorder.keep = Boolean(this.vcdFile);
    if (former) this.board.inherit(former);
    this.pipe = new BulkPipe(this.board.host);
    this.failure = null;
    this.broken = false;
    this.plug(true);
  }

  /** New firmware through the boot loader: the ROM restarts the board with it. */
  flash(uf2) {
    writeFlash(this.board.flash.bytes, uf2);
    this.uf2 = uf2;
    this.failure = null;
    this.board.restartFromBootloader();
    this.plug(this.board.host.cable);
  }

  plug(on) {
    this.board.host.plug(on);
    if (!on) return this.advance(10 * 125_000, () => false);
    this.advance(ENUMERATION_MS * 125_000, () => this.pipe.isOpen || this.board.bootloader !== null);
    if (!this.pipe.isOpen && !this.failure) this.failure = this.whyNoDevice();
    return undefined;
  }

  whyNoDevice() {
    if (this.board.bootloader) return `the board is in its bootloader: ${this.board.bootloader.reason}`;
    return this.board.host.failure ?? 'the board does not appear on USB as a vendor interface with bulk endpoints';
  }

  /** A client has gone that may have asked for the boot loader: the board gets the time to go there (it answers first). */
  goToBootloader() {
    this.advance(REBOOT_MS * 125_000, () => this.board.bootloader !== null);
  }

  /** Runs the board; what it cannot go on from is kept for every later answer. */
  advance(cycles, until) {
    if (this.broken) return;
    try {
      this.board.run(cycles, until);
    } catch (error) {
      this.broken = true;
      this.failure = error.message;
    }
  }

  get now() {
    return u64(this.board.chip.nanoseconds);
  }

  /** The answer to one message. */
  answer({ type, payload }) {
    const handler = handlers[type];
    if (!handler) return frame('x', Buffer.from(`message '${type}' is not known to version ${VERSION} of the virtual link`));
    try {
      return handler(this, payload);
    } catch (error) {
      return frame('x', Buffer.from(error.message));
    }
  }

  requireDevice() {
    if (this.broken) throw new Error(`the emulated board has stopped: ${this.failure}; power-cycle it`);
    if (!this.pipe.isOpen) throw new Error(`no connection: ${this.board.host.cable ? this.failure ?? this.whyNoDevice() : 'the USB cable is out'}`);
  }

  read(timeoutNanoseconds) {
    const cycles = Number(timeoutNanoseconds / BigInt(NANOSECONDS_PER_CYCLE));
    if (this.pipe.received.length === 0) this.advance(cycles, () => this.pipe.received.length > 0);
    const bytes = this.pipe.take();
    if (bytes.length === 0) this.requireAlive();
    return bytes;
  }

  requireAlive() {
    if (this.broken) this.requireDevice();
  }

  edges() {
    const fresh = this.board.recorder.take();
    const bytes = Buffer.alloc(10 * fresh.length);
    fresh.forEach(({ cycle, gpio, level }, i) => {
      bytes.writeBigUInt64LE(BigInt(cycle), 10 * i);
      bytes[10 * i + 8] = gpio;
      bytes[10 * i + 9] = level;
    });
    return bytes;
  }

  /** One file for each time that the board was switched on. */
  writeVcd() {
    if (!this.vcdFile) return;
    const { dir, name, ext } = path.parse(this.vcdFile);
    const file = this.powerCycles === 0 ? this.vcdFile : path.join(dir, `${name}-${this.powerCycles}${ext}`);
    fs.writeFileSync(file, vcd(this.board.recorder.edges, pinNames(), this.board.recorder.initial));
  }
}

function expectLength(payload, length, what) {
  if (payload.length !== length) throw new Error(`${what}: ${payload.length} bytes, expected ${length}`);
}

function expectPin(gpio) {
  if (gpio >= PINS) throw new Error(`GPIO${gpio} does not exist; the board has 0 to ${PINS - 1}`);
  return gpio;
}

function hello(session) {
  const version = Buffer.alloc(4);
  version.writeUInt32LE(VERSION);
  return frame('h', version, u64(CLOCK_HZ), Buffer.from(session.name));
}

function write(session, payload) {
  session.requireDevice();
  session.pipe.write(payload);
  return frame('w');
}

function read(session, payload) {
  expectLength(payload, 8, 'read');
  const bytes = session.read(payload.readBigUInt64LE());
  return frame('r', session.now, bytes);
}

function drive(session, payload) {
  expectLength(payload, 2, 'drive');
  if (payload[1] > 2) throw new Error(`level ${payload[1]}: 0, 1, or 2 to let go`);
  session.board.stimuli.drive(expectPin(payload[0]), payload[1]);
  return frame('i');
}

function jumper(session, payload) {
  expectLength(payload, 2, 'jumper');
  if (payload[0] === REMOVE_ALL && payload[1] === REMOVE_ALL) session.board.stimuli.cutWires();
  else session.board.stimuli.wire(expectPin(payload[0]), expectPin(payload[1]));
  return frame('j');
}

function pulse(session, payload) {
  expectLength(payload, 17, 'pulse');
  const period = Number(payload.readBigUInt64LE(1));
  const width = Number(payload.readBigUInt64LE(9));
  if (period !== 0 && (period < 16 || width >= period)) throw new Error(`pulse of ${width} ns every ${period} ns: not possible`);
  session.board.stimuli.pulse(expectPin(payload[0]), period, width);
  return frame('v');
}

function cable(session, payload) {
  expectLength(payload, 1, 'cable');
  session.plug(payload[0] !== 0);
  return frame('d');
}

function power(session) {
  session.writeVcd();
  session.powerUp();
  return frame('p');
}

/** The processor stands still for so long; everything else goes on. */
function stall(session, payload) {
  expectLength(payload, 8, 'stall');
  const { chip } = session.board;
  chip.disturb();
  chip.halted = true;
  session.advance(Number(payload.readBigUInt64LE() / BigInt(NANOSECONDS_PER_CYCLE)), () => !chip.halted);
  chip.halted = session.board.bootloader !== null;
  chip.disturb();
  return frame('s');
}

const handlers = {
  h: hello,
  w: write,
  r: read,
  n: (session) => frame('n', session.now),
  i: drive,
  j: jumper,
  v: pulse,
  e: (session) => frame('e', session.edges()),
  d: cable,
  p: power,
  s: stall,
};
