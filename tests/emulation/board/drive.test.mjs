// SPDX-License-Identifier: Apache-2.0

import assert from 'node:assert/strict';
import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';
import { test } from 'node:test';
import { imageBytes } from '../testing/images.mjs';
import { BootDrive } from './drive.mjs';
import { BoardSession } from './session.mjs';

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
