// SPDX-License-Identifier: Apache-2.0
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
