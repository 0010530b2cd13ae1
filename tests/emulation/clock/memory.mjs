// SPDX-License-Identifier: Apache-2.0
// Which stores and loads are possible. rp2040js lets a program write to flash and ROM, and answers for blocks that are held in reset.

import { RESET_BITS } from './registers.mjs';

const RAM = 0x20000000;
const RAM_END = 0x20042000;
const FLASH = 0x10000000;
const FLASH_END = 0x14000000;
const ROM_END = 0x4000;
const SIO_FIFO = new Set([0x50, 0x54, 0x58]);

const hex = (value) => `0x${(value >>> 0).toString(16)}`;

export function guardMemory(chip, rp2040) {
  guardStores(chip, rp2040);
  guardBlocks(chip, rp2040);
  guardSecondCore(chip, rp2040.sio);
}

function guardStores(chip, rp2040) {
  const { sramView } = rp2040;
  const store = rp2040.writeUint32.bind(rp2040);
  rp2040.writeUint32 = (address, value) => {
    address >>>= 0;
    if (address >= RAM && address + 3 < RAM_END) return sramView.setUint32(address - RAM, value, true);
    if (address >= FLASH && address < FLASH_END) return chip.fault(`a store to flash at ${hex(address)}; only the ROM functions write there`);
    if (address < ROM_END) return chip.fault(`a store to ROM at ${hex(address)}`);
    return store(address, value);
  };
}

function guardBlocks(chip, rp2040) {
  rp2040.findPeripheral = (address) => {
    const key = (address >>> 14) << 2;
    const block = rp2040.peripherals[key];
    if (block === undefined) return undefined;
    const bit = RESET_BITS[key];
    if (bit !== undefined && (chip.resets.held >>> bit) & 1) {
      chip.fault(`${hex(address)} is in a block that RESETS holds in reset (bit ${bit})`);
    }
    return block;
  };
}

function guardSecondCore(chip, sio) {
  for (const name of ['readUint32', 'writeUint32']) {
    const access = sio[name].bind(sio);
    sio[name] = (offset, value) => {
      if (SIO_FIFO.has(offset)) chip.fault('the second core and its mailbox are not modelled');
      return access(offset, value);
    };
  }
}

// The cache before the flash (RP2040 data sheet, 2.6.3): 16 KiB, two ways, lines of 8 bytes, a hit in one cycle; flushed as a whole, in
// some 1,024 cycles, or by the line with a store. A miss costs what the serial interface takes for a word as the second stage has
// set it up (`missCycles`), and fills that word. Which line goes, and whether a miss fetches the whole line, the data sheet leaves
// open: here the least recently used one, and one word, which gives more misses than a whole line would.

const SETS = 1024;
const LINE_BITS = 3;
const FLUSH_CYCLES = 1024;
const COUNTER_MAX = 2 ** 32 - 1;

const CTRL = 0x00;
const FLUSH = 0x04;
const STAT = 0x08;
const CTR_HIT = 0x0c;
const CTR_ACC = 0x10;
const FLUSH_READY = 2;
const FIFO_EMPTY = 1;

export class XipCache {
  /** `missCycles()`: duration of the serial access for one word. */
  constructor(chip, missCycles = () => 0) {
    this.chip = chip;
    this.missCycles = missCycles;
    this.control = 3; // on
    this.misses = 0;
    this.clearCounters();
    this.flush();
  }

  clearCounters() {
    this.hits = 0;
    this.accesses = 0;
  }

  /** Forgets everything; the time that this takes a program is spent where FLUSH is written. */
  flush() {
    this.tags = [new Int32Array(SETS).fill(-1), new Int32Array(SETS).fill(-1)];
    this.words = [new Uint8Array(SETS), new Uint8Array(SETS)]; // bit k: word k of the line is there
    this.last = new Uint8Array(SETS); // the way used last
  }

  /** One access of the processor at a flash address; a miss takes its time. */
  access(address) {
    this.accesses++;
    const line = (address & 0xffffff) >>> LINE_BITS;
    const set = line % SETS;
    const tag = (line / SETS) | 0;
    const word = 1 << ((address >>> 2) & 1);
    const way = this.tags[0][set] === tag ? 0 : this.tags[1][set] === tag ? 1 : -1;
    if (way >= 0 && this.words[way][set] & word && this.control & 1) {
      this.hits++;
      this.last[set] = way;
      return;
    }
    this.fill(set, tag, way, word);
    this.misses++;
    this.chip.spend(this.missCycles());
  }

  fill(set, tag, found, word) {
    const way = found >= 0 ? found : this.last[set] ^ 1;
    if (found < 0) {
      this.tags[way][set] = tag;
      this.words[way][set] = 0;
    }
    this.words[way][set] |= word;
    this.last[set] = way;
  }

  readUint32(offset) {
    if (offset === CTRL) return this.control;
    if (offset === STAT) return FLUSH_READY | FIFO_EMPTY;
    if (offset === CTR_HIT) return Math.min(this.hits, COUNTER_MAX);
    if (offset === CTR_ACC) return Math.min(this.accesses, COUNTER_MAX);
    return 0;
  }

  writeUint32Atomic(offset, value, alias) {
    const before = alias ? this.readUint32(offset) : 0;
    this.write(offset, [value, before ^ value, before | value, before & ~value][alias] >>> 0);
  }

  write(offset, value) {
    if (offset === CTRL) this.control = value & 0xb;
    else if (offset === CTR_HIT) this.hits = 0;
    else if (offset === CTR_ACC) this.accesses = 0;
    else if (offset === FLUSH && value & 1) {
      this.flush();
      this.chip.spend(FLUSH_CYCLES);
    }
  }
}
