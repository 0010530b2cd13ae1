// SPDX-License-Identifier: Apache-2.0
// Every 16-bit instruction of the table against rp2040js' own execution, and the places where that is wrong against the manual.

import assert from 'node:assert/strict';
import { createHash } from 'node:crypto';
import { test } from 'node:test';
import { Chip } from '../chip.mjs';

const CODE = 0x20000000;
const DATA = 0x20010000;
const WINDOW = 0x4000;
const STATES = 4;

/** xorshift32 */
function generator(state) {
  return () => {
    state ^= state << 13;
    state ^= state >>> 17;
    state ^= state << 5;
    return state >>> 0;
  };
}

function machine() {
  const chip = new Chip();
  const random = generator(0x12345);
  for (let at = 0; at < WINDOW; at += 4) chip.rp2040.sramView.setUint32(DATA - 0x20000000 + at, random(), true);
  return chip;
}

const isMemory = (op) => (op >>> 12 >= 5 && op >>> 12 <= 9) || op >>> 12 === 0xc || op >>> 9 === 0b1011010 || op >>> 9 === 0b1011110;
const isRegisterOffset = (op) => op >>> 12 === 5;
const isRegisterShift = (op) => [2, 3, 4, 7].some((kind) => op >>> 6 === (0b0100000000 | kind));

/** Left to rp2040js: 32-bit instructions, hints, CPS, REV, SVC, undefined and breakpoints. */
const isOther = (op) => op >>> 11 >= 29 || op >>> 8 === 0xde || op >>> 8 === 0xdf || (op >>> 12 === 0xb && !/^(b0|b2|b4|b5|bc|bd)/.test((op >>> 8).toString(16)));

/** Where both cannot agree: STM with its base in the list, BLX LR, and shapes that the manual leaves undefined. */
function isExcluded(op) {
  if (op === 0x47f0) return true;
  if (op >>> 11 === 0b11000 && (op >>> ((op >>> 8) & 7)) & 1) return true;
  if (isRegisterOffset(op) && ((op >>> 3) & 7) === ((op >>> 6) & 7)) return true;
  return op >>> 8 === 0x47 && (op & 7) !== 0;
}

function setState(chip, op, random) {
  const { core } = chip;
  for (let i = 0; i < 15; i++) core.registers[i] = isMemory(op) || i === 13 ? DATA + 0x1000 + ((random() & 0xff) << 2) : random();
  if (isRegisterOffset(op)) core.registers[(op >>> 6) & 7] = (random() & 63) << 2;
  if (isRegisterShift(op)) core.registers[(op >>> 3) & 7] = (random() & ~0xff) | (1 + (random() % 31));
  core.registers[15] = CODE;
  [core.N, core.Z, core.C, core.V] = [random() & 1, random() & 1, random() & 1, random() & 1].map(Boolean);
  core.waiting = false;
  chip.rp2040.sramView.setUint16(0, op, true);
}

function snapshot({ core, rp2040 }) {
  const { N, Z, C, V } = core;
  const data = Buffer.from(rp2040.sram.buffer, DATA - 0x20000000, WINDOW);
  return { registers: [...core.registers], N, Z, C, V, data: createHash('sha1').update(data).digest('hex') };
}

/** PUSH with LR and POP with PC cost one more than rp2040js says. */
const cyclesMissing = (op) => ((op >>> 8 === 0xb5 || op >>> 8 === 0xbd) ? 1 : 0);

test('all instructions agree with rp2040js', () => {
  const [ours, theirs] = [machine(), machine()];
  let compared = 0;
  for (let op = 0; op < 0x10000; op++) {
    if (isOther(op) || isExcluded(op)) continue;
    for (let state = 0; state < (isMemory(op) ? 1 : STATES); state++) {
      const seed = op * 8 + state + 1;
      setState(ours, op, generator(seed));
      setState(theirs, op, generator(seed));
      const cycles = ours.core.executeInstruction();
      const expected = theirs.plainInstruction();
      const name = `opcode ${op.toString(16)}, state ${state}`;
      assert.equal(cycles, expected + cyclesMissing(op), name);
      if (state === 0 || compared % 16 === 0) assert.deepEqual(snapshot(ours), snapshot(theirs), name);
      else assert.deepEqual([...ours.core.registers], [...theirs.core.registers], name);
      compared++;
    }
  }
  assert.ok(compared > 100_000, `${compared}`);
});

/** Runs one instruction on given registers and flags; gives r0 and the flags as a string of those that are set. */
function run(op, registers, flags = '') {
  const chip = machine();
  const { core } = chip;
  registers.forEach((value, i) => (core.registers[i] = value));
  for (const flag of 'NZCV') core[flag] = flags.includes(flag);
  core.registers[15] = CODE;
  chip.rp2040.sramView.setUint16(0, op, true);
  core.executeInstruction();
  return [core.registers[0], [...'NZCV'].filter((flag) => core[flag]).join('')];
}

const [LSLS, LSRS, ASRS, ADCS, SBCS, RORS] = [2, 3, 4, 5, 6, 7].map((kind) => 0x4000 | (kind << 6) | (1 << 3));

test('shifts by a register: the carry at 0, 32 and beyond', () => {
  assert.deepEqual(run(LSRS, [0x80000000, 0], ''), [0x80000000, 'N']);
  assert.deepEqual(run(LSRS, [1, 0], 'C'), [1, 'C']);
  assert.deepEqual(run(LSRS, [0x80000000, 32]), [0, 'ZC']);
  assert.deepEqual(run(LSRS, [0xffffffff, 33], 'C'), [0, 'Z']);
  assert.deepEqual(run(LSLS, [1, 32]), [0, 'ZC']);
  assert.deepEqual(run(LSLS, [0xffffffff, 33], 'C'), [0, 'Z']);
  assert.deepEqual(run(ASRS, [0x80000000, 0]), [0x80000000, 'N']);
  assert.deepEqual(run(ASRS, [0x80000000, 200]), [0xffffffff, 'NC']);
  assert.deepEqual(run(RORS, [0x80000001, 0]), [0x80000001, 'N']);
  assert.deepEqual(run(RORS, [0x80000001, 32]), [0x80000001, 'NC']);
});

test('overflow of ADCS and SBCS at the edge, as comparisons of 64-bit numbers need it', () => {
  assert.deepEqual(run(ADCS, [0, 0x7fffffff], 'C'), [0x80000000, 'NV']);
  assert.deepEqual(run(ADCS, [0xffffffff, 0xffffffff], 'C'), [0xffffffff, 'NC']);
  assert.deepEqual(run(SBCS, [5, 0x7fffffff], ''), [0x80000005, 'N']);
  assert.deepEqual(run(SBCS, [0x80000000, 0], ''), [0x7fffffff, 'CV']);
});

test('BLX LR goes where LR pointed', () => {
  const chip = machine();
  Object.assign(chip.core, { LR: CODE + 0x101, PC: CODE });
  chip.rp2040.sramView.setUint16(0, 0x47f0, true);
  chip.core.executeInstruction();
  assert.deepEqual([chip.core.PC, chip.core.LR], [CODE + 0x100, CODE + 3]);
});

test('STM writes its base back even if it is in the list', () => {
  assert.equal(run(0xc003, [DATA, 7])[0], DATA + 8);
});

test('an address that is not aligned is an error that names it', () => {
  const [strh, ldrh, str, ldr, strb] = [0x8008, 0x8808, 0x6008, 0x6808, 0x7008];
  assert.throws(() => run(str, [0, DATA + 2]), /word store at 0x20010002, which is not aligned/);
  assert.throws(() => run(ldr, [0, DATA + 1]), /word load at 0x20010001/);
  assert.throws(() => run(strh, [0, DATA + 1]), /halfword store/);
  assert.throws(() => run(ldrh, [0, DATA + 3]), /halfword load/);
  run(strb, [0, DATA + 3]);
});
