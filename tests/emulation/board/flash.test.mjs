// SPDX-License-Identifier: Apache-2.0
// Flash through the ROM's functions (images/flash.cpp), and what must not be done.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { boardWith, results } from '../testing/images.mjs';
import { UNIQUE_ID } from './flash.mjs';

const SECTOR = 0x1f0000;

test('a firmware finds the functions, erases, programs and reads back; it takes the time that flash takes', () => {
  const board = boardWith('flash');
  board.runMilliseconds(100);
  const [missing, ones, micros, first, last, after] = results(board);
  assert.equal(missing, 0, 'an unknown code');
  assert.equal(ones, 8);
  assert.ok(micros >= 45_400 && micros <= 45_410, `${micros} us: 45 ms for the sector, 0.4 ms for the page`);
  assert.deepEqual([first, last, after], [0x09060300, 0xfdfaf7f4, 0xffffffff]);
  assert.deepEqual([board.flash.erased, board.flash.programmed], [1, 1]);
  assert.deepEqual(board.bootloader, { ledMask: 1 << 25, disabledInterfaces: 0, reason: 'the program asked for it' });
});

/** A board whose registers say that code in RAM calls, with interrupts masked, after flash_exit_xip. */
function prepared() {
  const board = boardWith('timer');
  board.runMilliseconds(1);
  const { core } = board.chip;
  Object.assign(core, { LR: 0x20000101, PM: true });
  board.flash.functions().EX();
  return { board, core, functions: board.flash.functions() };
}

test('programming only lowers bits', () => {
  const { board, functions } = prepared();
  for (const value of [0x0f, 0xfc]) {
    board.chip.rp2040.sram.fill(value, 0x8000, 0x8100);
    functions.RP([SECTOR, 0x20008000, 256]);
  }
  assert.equal(board.flash.bytes[SECTOR], 0x0c);
  functions.RE([SECTOR, 4096]);
  assert.equal(board.flash.bytes[SECTOR], 0xff);
});

test('serial commands: the unique number with the select held by hand, the status without', () => {
  const { board } = prepared();
  const { rp2040 } = board.chip;
  const [select, data, status] = [0x4001800c, 0x18000060, 0x18000028];
  const exchange = (bytes) => {
    for (const byte of bytes) rp2040.writeUint32(data, byte);
    return bytes.map(() => rp2040.readUint32(data));
  };
  rp2040.writeUint32(select, 2 << 8);
  assert.deepEqual(exchange([0x4b, 0, 0, 0]), [0, 0, 0, 0]);
  assert.equal(rp2040.readUint32(status) & 8, 0);
  assert.deepEqual(Buffer.from(exchange(Array(9).fill(0))).subarray(1), UNIQUE_ID);
  rp2040.writeUint32(select, 3 << 8);
  assert.deepEqual(exchange([0x35, 0]), [2, 2]);
  assert.deepEqual(exchange([0x9f, 0, 0, 0]), [0, 0xef, 0x40, 0x15]);
  assert.deepEqual(exchange([0x05, 0]), [0, 0]);
});

test('flash cannot be read while it is away, until a second stage has run again', () => {
  const { board } = prepared();
  const { rp2040 } = board.chip;
  assert.throws(() => rp2040.readUint32(0x10000000), /while it is not mapped/);
  assert.throws(() => board.chip.core.readUint16(0x10000100), /while it is not mapped/);
  rp2040.writeUint32(0x18000008, 0);
  rp2040.writeUint32(0x18000000, (31 << 16) | (3 << 8));
  rp2040.writeUint32(0x18000008, 1);
  assert.notEqual(rp2040.readUint32(0x10000000), 0xffffffff);
  assert.equal(board.chip.core.readUint16(0x10000100), rp2040.readUint16(0x10000100));
});

test('what would crash a real board is an error', () => {
  const { board, core, functions } = prepared();
  assert.throws(() => functions.RE([SECTOR + 256, 4096]), /not a multiple of 4096/);
  assert.throws(() => functions.RP([SECTOR, 0x20008000, 100]), /not a multiple of 256/);
  assert.throws(() => functions.RE([2 << 20, 4096]), /beyond the end/);
  assert.throws(() => functions.RP([SECTOR, 0x10000000, 256]), /from data in flash/);
  core.PM = false;
  assert.throws(() => functions.RE([SECTOR, 4096]), /interrupts on and their table in flash/);
  core.PM = true;
  core.LR = 0x10001001;
  assert.throws(() => functions.RE([SECTOR, 4096]), /called from code in flash/);
  core.LR = 0x20000101;
  functions.CX();
  assert.throws(() => functions.RE([SECTOR, 4096]), /without flash_exit_xip/);
  assert.equal(board.flash.erased, 0);
});
