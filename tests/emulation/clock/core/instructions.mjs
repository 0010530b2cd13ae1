// SPDX-License-Identifier: Apache-2.0
// The processor's instructions by a table instead of rp2040js' chain of comparisons: twice as fast, and with its slips put right:
// carry of shifts by 0 or by more than 32, overflow of ADCS and SBCS at 0x7fffffff, BLX LR, STM's base, cycles of PUSH with LR and POP with PC.
// What is not in the table (32-bit instructions, hints, CPS, SVC, breakpoints) rp2040js executes.

import {
  addImmediate, addSubtract, addressOfPc, addressOfSp, asrImmediate, compareHigh, compareImmediate, extendRegister, lslImmediate,
  lsrImmediate, moveImmediate, moveStack, subtractImmediate, twoRegisters,
} from './arithmetic.mjs';

// Thumb branches and moves of high registers (ARMv6-M, A6.7). PC already stands behind the instruction's first half.

const conditions = [
  (c) => c.Z,
  (c) => !c.Z,
  (c) => c.C,
  (c) => !c.C,
  (c) => c.N,
  (c) => !c.N,
  (c) => c.V,
  (c) => !c.V,
  (c) => c.C && !c.Z,
  (c) => !c.C || c.Z,
  (c) => c.N === c.V,
  (c) => c.N !== c.V,
  (c) => !c.Z && c.N === c.V,
  (c) => c.Z || c.N !== c.V,
];

export function branchIf(c, op) {
  if (!conditions[(op >>> 8) & 15](c)) return 1;
  c.registers[15] += 2 + ((op << 24) >> 23);
  return 2;
}

export function branch(c, op) {
  c.registers[15] += 2 + ((op << 21) >> 20);
  return 2;
}

const high = (op) => ((op >>> 4) & 8) | (op & 7);
const valueOf = (c, index) => (index === 15 ? c.registers[15] + 2 : c.registers[index]);

/** Writes a register that may be SP (words only) or PC; its cycles. */
function writeHigh(c, index, value) {
  c.registers[index] = index === 15 ? value & ~1 : index === 13 ? value & ~3 : value;
  return index === 15 ? 2 : 1;
}

export const addHigh = (c, op) => writeHigh(c, high(op), valueOf(c, high(op)) + valueOf(c, (op >>> 3) & 15));
export const moveHigh = (c, op) => writeHigh(c, high(op), valueOf(c, (op >>> 3) & 15));

/** BX and BLX. */
export function branchExchange(c, op) {
  const target = c.registers[(op >>> 3) & 15];
  if (op & 0x80) {
    c.registers[14] = c.registers[15] | 1;
    c.registers[15] = target & ~1;
  } else {
    c.BXWritePC(target);
  }
  return 2;
}

// Thumb loads and stores (ARMv6-M, A6.7). Cycles: 2, but 1 at SIO (its own port) and 4 or 5 at APB blocks, as rp2040js has them;
// one a register and one more for lists.

const kinds = {
  word: { load: (c, address) => c.readUint32(address), store: (c, address, value) => c.writeUint32(address, value) },
  half: { load: (c, address) => c.readUint16(address), store: (c, address, value) => c.writeUint16(address, value) },
  byte: { load: (c, address) => c.readUint8(address), store: (c, address, value) => c.writeUint8(address, value) },
  signedHalf: { load: (c, address) => (c.readUint16(address) << 16) >> 16 },
  signedByte: { load: (c, address) => (c.readUint8(address) << 24) >> 24 },
};

const load = (kind, addressOf, target) => (c, op) => {
  const address = addressOf(c, op) >>> 0;
  c.registers[target(op)] = kind.load(c, address);
  return 1 + c.cyclesIO(address, false);
};

const store = (kind, addressOf, source) => (c, op) => {
  const address = addressOf(c, op) >>> 0;
  kind.store(c, address, c.registers[source(op)]);
  return 1 + c.cyclesIO(address, true);
};

const low = (op) => op & 7;
const middle = (op) => (op >>> 8) & 7;
const offset = (scale) => (c, op) => c.registers[(op >>> 3) & 7] + (((op >>> 6) & 31) << scale);
const indexed = (c, op) => c.registers[(op >>> 3) & 7] + c.registers[(op >>> 6) & 7];
const fromSp = (c, op) => c.registers[13] + ((op & 255) << 2);
const fromPc = (c, op) => ((c.registers[15] + 2) & ~3) + ((op & 255) << 2);

export const loadLiteral = load(kinds.word, fromPc, middle);
export const storeSp = store(kinds.word, fromSp, middle);
export const loadSp = load(kinds.word, fromSp, middle);
export const storeWord = store(kinds.word, offset(2), low);
export const loadWord = load(kinds.word, offset(2), low);
export const storeByte = store(kinds.byte, offset(0), low);
export const loadByte = load(kinds.byte, offset(0), low);
export const storeHalf = store(kinds.half, offset(1), low);
export const loadHalf = load(kinds.half, offset(1), low);

/** By bits 9 to 11. */
export const registerOffset = [
  store(kinds.word, indexed, low),
  store(kinds.half, indexed, low),
  store(kinds.byte, indexed, low),
  load(kinds.signedByte, indexed, low),
  load(kinds.word, indexed, low),
  load(kinds.half, indexed, low),
  load(kinds.byte, indexed, low),
  load(kinds.signedHalf, indexed, low),
];

/** Stores or loads the registers of a list from `address` on; gives the address behind them. */
function transferList(c, list, address, stores) {
  for (let register = 0; list !== 0; register++, list >>>= 1) {
    if (!(list & 1)) continue;
    if (stores) c.writeUint32(address, c.registers[register]);
    else c.registers[register] = c.readUint32(address);
    address += 4;
  }
  return address;
}

const countOf = (list) => {
  let count = 0;
  for (; list !== 0; list &= list - 1) count++;
  return count;
};

export function push(c, op) {
  const count = countOf(op & 0x1ff);
  const begin = c.registers[13] - 4 * count;
  const at = transferList(c, op & 255, begin, true);
  if (op & 0x100) c.writeUint32(at, c.registers[14]);
  c.registers[13] = begin;
  return 1 + count;
}

export function pop(c, op) {
  const at = transferList(c, op & 255, c.registers[13], false);
  const count = countOf(op & 0x1ff);
  if (!(op & 0x100)) {
    c.registers[13] = at;
    return 1 + count;
  }
  c.registers[13] = at + 4;
  c.BXWritePC(c.readUint32(at)); // may be the return from an exception
  return 3 + count;
}

export function storeMultiple(c, op) {
  const base = (op >>> 8) & 7;
  c.registers[base] = transferList(c, op & 255, c.registers[base], true);
  return 1 + countOf(op & 255);
}

/** The base keeps what was loaded into it, if it is in the list. */
export function loadMultiple(c, op) {
  const base = (op >>> 8) & 7;
  const after = transferList(c, op & 255, c.registers[base], false);
  if (!((op >>> base) & 1)) c.registers[base] = after;
  return 1 + countOf(op & 255);
}

// The processor's loads and stores: short ways to SRAM and flash, which are nearly all of them; everything else goes rp2040js' way.
// An address that is not a multiple of the access is a hard fault on silicon and an error here.
// What the MPU guards is looked at first. The short way to flash is closed while flash is away (`direct` false): then each access takes the guarded way. Flash is read through
// its cache, which takes its time.

const RAM = 0x20000000;
const RAM_BYTES = 0x42000;
const FLASH = 0x10000000;
const FLASH_BYTES = 0x1000000;

const inRam = (address) => address >= RAM && address < RAM + RAM_BYTES;
const inFlash = (address) => address >= FLASH && address < FLASH + FLASH_BYTES;

export function installAccess(chip, rp2040) {
  const state = { direct: true };
  installLoads(chip, rp2040, state);
  installStores(chip, rp2040);
  return state;
}

const misaligned = (chip, kind, address) => chip.fault(`a ${kind} at 0x${address.toString(16)}, which is not aligned`);

function installLoads(chip, rp2040, state) {
  const { core, sramView, sram } = rp2040;
  const { xip, mpu } = chip;
  core.readUint16 = (address) => {
    address >>>= 0;
    if (address >= mpu.from && address < mpu.to) mpu.check(address);
    if (address & 1) return misaligned(chip, 'halfword load', address);
    if (inRam(address)) return sramView.getUint16(address - RAM, true);
    if (inFlash(address)) xip.access(address);
    if (state.direct && inFlash(address)) return rp2040.flashView.getUint16(address - FLASH, true);
    return rp2040.readUint16(address);
  };
  core.readUint32 = (address) => {
    address >>>= 0;
    if (address >= mpu.from && address < mpu.to) mpu.check(address);
    if (address & 3) return misaligned(chip, 'word load', address);
    if (inRam(address)) return sramView.getUint32(address - RAM, true);
    if (inFlash(address)) xip.access(address);
    if (state.direct && inFlash(address)) return rp2040.flashView.getUint32(address - FLASH, true);
    return rp2040.readUint32(address);
  };
  core.readUint8 = (address) => {
    address >>>= 0;
    if (address >= mpu.from && address < mpu.to) mpu.check(address);
    if (inRam(address)) return sram[address - RAM];
    if (inFlash(address)) xip.access(address);
    return rp2040.readUint8(address);
  };
}

function installStores(chip, rp2040) {
  const { core, sramView, sram } = rp2040;
  const { mpu } = chip;
  core.writeUint32 = (address, value) => {
    address >>>= 0;
    if (address >= mpu.from && address < mpu.to) mpu.check(address);
    if (address & 3) return misaligned(chip, 'word store', address);
    if (inRam(address)) return sramView.setUint32(address - RAM, value, true);
    return rp2040.writeUint32(address, value);
  };
  core.writeUint16 = (address, value) => {
    address >>>= 0;
    if (address >= mpu.from && address < mpu.to) mpu.check(address);
    if (address & 1) return misaligned(chip, 'halfword store', address);
    if (inRam(address)) return sramView.setUint16(address - RAM, value, true);
    return rp2040.writeUint16(address, value);
  };
  core.writeUint8 = (address, value) => {
    address >>>= 0;
    if (address >= mpu.from && address < mpu.to) mpu.check(address);
    if (!inRam(address)) return rp2040.writeUint8(address, value);
    sram[address - RAM] = value;
    return undefined;
  };
}

// The table of instructions, and its installation.

const byTopFive = [
  lslImmediate, lsrImmediate, asrImmediate, addSubtract, moveImmediate, compareImmediate, addImmediate, subtractImmediate,
  undefined, loadLiteral, undefined, undefined, storeWord, loadWord, storeByte, loadByte,
  storeHalf, loadHalf, storeSp, loadSp, addressOfPc, addressOfSp, undefined, undefined,
  storeMultiple, loadMultiple, undefined, undefined, branch, undefined, undefined, undefined,
];

const HIGH = [addHigh, compareHigh, moveHigh, branchExchange];

/** Handler of an instruction by its upper ten bits. */
function handlerOf(top) {
  const opcode = top << 6;
  const topFive = byTopFive[opcode >>> 11];
  if (topFive) return topFive;
  if (opcode >>> 10 === 0b010000) return twoRegisters[top & 15];
  if (opcode >>> 10 === 0b010001) return HIGH[(opcode >>> 8) & 3];
  if (opcode >>> 12 === 0b0101) return registerOffset[(opcode >>> 9) & 7];
  if (opcode >>> 8 === 0b10110000) return moveStack;
  if (opcode >>> 8 === 0b10110010) return extendRegister;
  if (opcode >>> 9 === 0b1011010) return push;
  if (opcode >>> 9 === 0b1011110) return pop;
  if (opcode >>> 12 === 0b1101 && ((opcode >>> 8) & 15) < 14) return branchIf;
  return undefined;
}

const handlers = Array.from({ length: 1024 }, (_, top) => handlerOf(top));

/** rp2040js' own way, for the instructions that are left to it and for comparison. */
export function installInstructions(core) {
  const plain = core.executeInstruction.bind(core);
  core.executeInstruction = () => {
    const at = (core.registers[15] & ~1) >>> 0;
    const opcode = core.readUint16(at);
    const handler = handlers[opcode >>> 6];
    if (handler === undefined) return plain();
    core.registers[15] = at + 2;
    const cycles = handler(core, opcode);
    core.cycles += cycles;
    return cycles;
  };
  return plain;
}
