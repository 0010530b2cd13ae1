// SPDX-License-Identifier: Apache-2.0
// The cache before the flash, and what a miss costs by the set-up of the serial interface.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { FlashChip, Ssi } from '../board/flash.mjs';
import { boardWith } from '../testing/images.mjs';
import { XipCache } from './memory.mjs';

const FLASH = 0x10000000;
const WAY = 8192; // bytes

function cache(cost = 48) {
  const chip = { spent: 0, spend: (cycles) => (chip.spent += cycles) };
  const xip = new XipCache(chip, () => cost);
  const cycles = (address) => {
    const before = chip.spent;
    xip.access(address);
    return chip.spent - before;
  };
  return { xip, chip, cycles };
}

test('a miss fills one word of a line of eight bytes; two ways keep the two lines used last', () => {
  const { xip, cycles } = cache();
  assert.deepEqual([0, 2, 4, 4, 8].map((at) => cycles(FLASH + at)), [48, 0, 48, 0, 48]);
  assert.equal(cycles(FLASH + WAY), 48, 'the same set, the other way');
  assert.equal(cycles(FLASH), 0);
  assert.equal(cycles(FLASH + 2 * WAY), 48, 'takes the place of the line not used for longest');
  assert.deepEqual([cycles(FLASH), cycles(FLASH + WAY)], [0, 48]);
  assert.deepEqual([xip.readUint32(0x10), xip.readUint32(0x0c)], [10, 4]);
});

test('16 KiB fit, and a flush forgets them', () => {
  const { xip, chip, cycles } = cache();
  for (let round = 0; round < 2; round++) for (let at = 0; at < 2 * WAY; at += 4) xip.access(FLASH + at);
  assert.equal(xip.misses, (2 * WAY) / 4);
  chip.spent = 0;
  xip.write(0x04, 1);
  assert.equal(chip.spent, 1024);
  assert.equal(cycles(FLASH), 48);
  xip.write(0x10, 0);
  assert.equal(xip.readUint32(0x10), 0);
});

function ssi({ divider, control, spi, quadEnabled, continuous }) {
  const chip = new FlashChip({ quadEnabled });
  chip.continuous = Boolean(continuous);
  const made = new Ssi(() => 0, () => {}, chip);
  made.write(0x14, divider);
  made.write(0x00, control);
  made.write(0xf4, spi);
  return made;
}

const SERIAL = { control: (31 << 16) | (3 << 8), spi: (0x03 << 24) | (2 << 8) | (6 << 2) };
const QUAD = { control: (2 << 21) | (31 << 16) | (3 << 8), spi: ((0xa0 << 24) | (4 << 11) | (8 << 2) | 2) >>> 0 };

test('a word takes 64 clocks by 03h and 20 by a quad read that continues', () => {
  assert.equal(ssi({ divider: 4, ...SERIAL }).missCycles, 264);
  assert.equal(ssi({ divider: 2, ...QUAD, continuous: true }).missCycles, 48);
  assert.equal(ssi({ divider: 2, control: QUAD.control, spi: ((0xeb << 24) | (4 << 11) | (2 << 8) | (8 << 2) | 1) >>> 0 }).wordClocks, 28);
});

test('a set-up that the flash chip would not answer has a reason', () => {
  assert.equal(ssi({ divider: 4, ...SERIAL }).misfit, '');
  assert.equal(ssi({ divider: 2, ...QUAD, continuous: true }).misfit, '');
  assert.match(ssi({ divider: 2, ...QUAD }).misfit, /not in continuous read/);
  assert.match(ssi({ divider: 2, ...QUAD, continuous: true, quadEnabled: false }).misfit, /QE/);
  assert.match(ssi({ divider: 4, ...SERIAL, continuous: true }).misfit, /serial command/);
});

test('a program in flash pays for its misses once, and again after a flush', () => {
  const board = boardWith('timer', { missCycles: 264 });
  board.runMilliseconds(3);
  const { xip } = board.chip;
  const { misses } = xip;
  assert.ok(misses > 50, `${misses}`);
  board.runMilliseconds(3);
  assert.ok(xip.misses - misses < misses / 4, 'it fits the cache');
  const before = xip.misses;
  xip.flush();
  board.runMilliseconds(1);
  assert.ok(xip.misses > before);
});
