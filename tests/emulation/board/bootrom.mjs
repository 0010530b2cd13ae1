// SPDX-License-Identifier: Apache-2.0
// A stand-in for the boot ROM: the tables and the look-up function at their documented addresses (RP2040 data sheet, 2.8.3), and
// functions that are one breakpoint each, carried out here. No byte of the real ROM is used.

import { reverseBits } from '../clock/pio/instructions.mjs';

const STUBS = 0x100;
const TABLE = 0x200;
const BREAKPOINT = 0xbe00;
const RETURN = 0x4770; // bx lr
const TRAP = 0xbeff; // a jump to anywhere else in ROM
const ROM_BYTES = 0x4000;

const code = (letters) => letters.charCodeAt(0) | (letters.charCodeAt(1) << 8);

export class BootRom {
  /** `functions`: two letters -> (registers) => value for r0 or undefined. */
  constructor(functions) {
    this.functions = [['', (registers) => this.lookUp(registers)], ...Object.entries(functions)];
  }

  /** Fills the ROM of a chip and answers its breakpoints. */
  install(chip) {
    this.chip = chip;
    const bytes = Buffer.alloc(ROM_BYTES);
    for (let at = 0; at < ROM_BYTES; at += 2) bytes.writeUInt16LE(TRAP, at);
    bytes.writeUInt32LE(0x20042000, 0);
    bytes.write('Mu\x01\x02', 0x10, 'latin1');
    bytes.writeUInt16LE(TABLE, 0x14);
    bytes.writeUInt16LE(0, 0x16); // no data table
    bytes.writeUInt16LE(STUBS | 1, 0x18);
    this.functions.forEach((_, i) => this.writeStub(bytes, i));
    this.writeTable(bytes);
    chip.rp2040.bootrom.set(new Uint32Array(bytes.buffer, bytes.byteOffset, ROM_BYTES / 4));
    chip.rp2040.onBreak = (number) => this.call(number);
  }

  writeStub(bytes, index) {
    bytes.writeUInt16LE(BREAKPOINT | index, STUBS + 4 * index);
    bytes.writeUInt16LE(RETURN, STUBS + 4 * index + 2);
  }

  writeTable(bytes) {
    this.functions.slice(1).forEach(([letters], i) => {
      bytes.writeUInt16LE(code(letters), TABLE + 4 * i);
      bytes.writeUInt16LE((STUBS + 4 * (i + 1)) | 1, TABLE + 4 * i + 2);
    });
    bytes.writeUInt32LE(0, TABLE + 4 * (this.functions.length - 1));
  }

  /** A breakpoint: one of ours, or a real one. */
  call(number) {
    const { core } = this.chip;
    if (core.PC - 2 !== STUBS + 4 * number) return this.chip.onBreak(number);
    const result = this.functions[number][1](core.registers);
    if (result !== undefined) core.registers[0] = result;
    return undefined;
  }

  /** rom_table_lookup(table, code). */
  lookUp(registers) {
    const wanted = registers[1] & 0xffff;
    for (let at = registers[0]; ; at += 4) {
      const entry = this.chip.rp2040.readUint16(at);
      if (entry === 0) return 0;
      if (entry === wanted) return this.chip.rp2040.readUint16(at + 2);
    }
  }
}

// The ROM's small functions that a firmware may call; flash is in flash.mjs. Floating point is not provided (look-ups give 0).

function copy(chip, to, from, count) {
  for (let i = 0; i < count; i++) chip.rp2040.writeUint8(to + i, chip.rp2040.readUint8(from + i));
  return to;
}

function fill(chip, to, value, count) {
  for (let i = 0; i < count; i++) chip.rp2040.writeUint8(to + i, value & 255);
  return to;
}

function ones(value) {
  let count = 0;
  for (let rest = value >>> 0; rest; rest = (rest & (rest - 1)) >>> 0) count++;
  return count;
}

export function smallFunctions(chip) {
  return {
    P3: ([value]) => ones(value),
    R3: ([value]) => reverseBits(value),
    L3: ([value]) => Math.clz32(value),
    T3: ([value]) => (value === 0 ? 32 : 31 - Math.clz32(value & -value)),
    MS: ([to, value, count]) => fill(chip, to, value, count),
    S4: ([to, value, count]) => fill(chip, to, value, count),
    MC: ([to, from, count]) => copy(chip, to, from, count),
    C4: ([to, from, count]) => copy(chip, to, from, count),
  };
}
