// SPDX-License-Identifier: Apache-2.0

import assert from 'node:assert/strict';
import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';
import { test } from 'node:test';
import { imageBytes } from '../testing/images.mjs';
import { Board } from './board.mjs';
import { boot2IsSound, BootDrive, crc32, readUf2, sealBoot2, writeUf2 } from './image.mjs';
import { BoardSession } from './session.mjs';

const image = () => Buffer.from(Array.from({ length: 700 }, (_, i) => i & 255));

function changed(offset, value) {
  const file = writeUf2(image());
  file.writeUInt32LE(value, offset);
  return file;
}

test('a file is made and read back', () => {
  const pages = readUf2(writeUf2(image()));
  assert.deepEqual(pages.map(({ offset }) => offset), [0, 256, 512]);
  assert.deepEqual(Buffer.concat(pages.map(({ data }) => data)).subarray(0, 700), image());
});

test('what the ROM would not take is refused with the block and the reason', () => {
  assert.throws(() => readUf2(Buffer.alloc(100)), /512-byte blocks/);
  assert.throws(() => readUf2(Buffer.alloc(0)), /512-byte blocks/);
  assert.throws(() => readUf2(changed(0, 1)), /block 0: wrong magic/);
  assert.throws(() => readUf2(changed(512 + 508, 1)), /block 1: wrong magic/);
  assert.throws(() => readUf2(changed(28, 0xe48bff59)), /RP2040 family/);
  assert.throws(() => readUf2(changed(16, 476)), /476 bytes of payload/);
  assert.throws(() => readUf2(changed(1024 + 20, 1)), /block 2: says it is 1 of 3/);
  assert.throws(() => readUf2(changed(12, 0x20000000)), /not in flash/);
});

test('the CRC of the second stage: known value, sealing, and the ROM stays in its bootloader without it', () => {
  assert.equal(crc32(Buffer.from('123456789')), 0x0376e6e7); // CRC-32/MPEG-2
  const sealed = sealBoot2(image());
  assert.ok(boot2IsSound(new Uint8Array(sealed)));
  const file = imageBytes('timer');
  file[32 + 5] ^= 1;
  const board = new Board(file);
  assert.match(board.bootloader.reason, /CRC of the second stage/);
  board.runMilliseconds(1);
  assert.equal(board.recorder.edges.length, 0);
});

test('a board in its boot loader takes a file from its drive and starts it', () => {
  const folder = fs.mkdtempSync(path.join(os.tmpdir(), 'drive-'));
  const info = path.join(folder, 'INFO_UF2.TXT');
  const session = new BoardSession(imageBytes('flash')); // ends in the boot loader
  assert.match(session.failure, /in its bootloader: the program asked/);
  const written = session.board.flash.bytes[0x1f0000 + 1];
  const drive = new BootDrive(folder, session);
  assert.ok(!fs.existsSync(info));
  drive.poll();
  assert.match(fs.readFileSync(info, 'utf8'), /Board-ID: RPI-RP2/);
  const image = imageBytes('usb');
  fs.writeFileSync(path.join(folder, 'new.uf2'), image.subarray(0, 700));
  drive.poll();
  assert.ok(session.board.bootloader, 'half a file is left alone');
  fs.writeFileSync(path.join(folder, 'new.uf2'), image);
  drive.poll();
  assert.deepEqual(fs.readdirSync(folder), []);
  assert.equal(session.board.bootloader, null);
  assert.equal(session.board.host.device.productName, 'test unit');
  assert.equal(session.board.flash.bytes[0x1f0000 + 1], written, 'the rest of flash stays');
  fs.rmSync(folder, { recursive: true });
});
