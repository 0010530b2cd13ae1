// SPDX-License-Identifier: Apache-2.0
// The image as a device: enumeration, upload, settings in flash, reboot.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { binaryInfo } from '../board/image.mjs';
import { CYCLES_PER_MILLISECOND } from '../clock/time.mjs';
import { records } from '../wire/client.mjs';
import { crc32c } from '../wire/frames.mjs';
import { outputs, PicoRig, skip } from './rig.mjs';

test('it enumerates as a vendor interface and a console, without a fault on the wire', { skip }, () => {
  const { board, hello } = new PicoRig();
  assert.ok(board.clockIsRight);
  assert.deepEqual(board.host.device.configuration.interfaces.map((each) => each.class[0]), [0xff, 2, 10, 0xff]);
  assert.equal(board.host.device.serial.toLowerCase(), hello.unique_id.toString('hex'));
  assert.deepEqual(board.host.errors, []);
  assert.deepEqual([...board.host.controller.lints], []);
  assert.deepEqual([...board.chip.pads.contention], []);
  assert.deepEqual([...board.chip.warnings], []);
});

test('its object store leads to descriptors that let Windows bind WinUSB', { skip }, () => {
  const { board } = new PicoRig();
  const { bos } = board.host.device;
  const platform = bos.indexOf(Buffer.from('df60ddd88945c74c9cd2659d9e648a9f', 'hex'));
  assert.ok(platform > 0);
  const [length, request] = [bos.readUInt16LE(platform + 20), bos[platform + 22]];
  const { status, data } = board.host.control([0xc0, request, 0, 0, 7, 0, length & 255, length >> 8]);
  assert.equal(status, 'ok');
  assert.equal(data.readUInt16LE(8), length);
  assert.ok(data.includes(Buffer.from('WINUSB')));
});

test('picotool takes a running board into its boot loader, or starts it again', { skip }, () => {
  const rig = new PicoRig();
  rig.configure();
  rig.start([records.word(0xff, 125_000_000), records.end()]);
  rig.client.run(2);
  assert.equal(rig.board.host.control([0x21, 2, 0, 0, 3, 0, 0, 0]).status, 'ok');
  rig.board.run(10 * CYCLES_PER_MILLISECOND, () => rig.board.chip.resetCount === 1);
  assert.equal(rig.outputLevels, 0);
  rig.board.run(200 * CYCLES_PER_MILLISECOND, () => rig.board.host.device !== null);
  rig.connect();
  assert.equal(rig.status().reset_cause, 'RESET_CAUSE_REQUEST');
  assert.equal(rig.board.host.control([0x21, 1, 0, 0, 3, 0, 0, 0]).status, 'ok');
  rig.board.run(10 * CYCLES_PER_MILLISECOND, () => rig.board.bootloader !== null);
  assert.match(rig.board.bootloader.reason, /the program asked/);
});

test('picotool finds name, version, end and pins in it', { skip }, () => {
  const rig = new PicoRig();
  const { copies, entries, pins } = binaryInfo(rig.board.flash.bytes);
  assert.equal(copies, 0);
  assert.equal(entries.get(0x02031c86), 'symrig trigger board');
  assert.equal(entries.get(0x11a9bc3a), rig.hello.firmware_version);
  assert.equal(entries.get(0xb63cffbb), 'pico');
  const end = entries.get(0x68f465de) - 0x10000000;
  assert.ok(end > 40_000 && rig.board.flash.bytes.subarray(end, end + 256).every((byte) => byte === 0xff || byte === 0));
  assert.equal(pins.mask, 0x033f1fff);
  assert.deepEqual([pins.names[0], pins.names.at(-1)], ['projector_trigger', 'led']);
});

test('it gives no bulk packet to the controller at the end of a frame (RP2040-E15)', { skip }, () => {
  const rig = new PicoRig();
  rig.configure();
  for (let i = 0; i < 150; i++) {
    rig.status();
    rig.client.run((i * 0.037) % 1);
  }
  rig.board.host.control([0x21, 0x22, 1, 0, 1, 0, 0, 0]); // a terminal is there: the log, too
  rig.client.run(20);
  assert.equal(rig.board.host.controller.armedAtFrameEnd, 0);
});

test('16,000 records are uploaded within a second of USB time', { skip }, () => {
  const rig = new PicoRig();
  rig.configure();
  // As short as a program may be that never waits for its records.
  const { refill_ticks: shortest } = rig.client.must({ capabilities: {} }).capabilities;
  const list = Array.from({ length: 15_999 }, (_, i) => records.word(i & 0xfff, shortest + (i % 7)));
  const begin = rig.board.cycle;
  const { steps } = rig.upload([...list, records.end()]);
  const milliseconds = (rig.board.cycle - begin) / CYCLES_PER_MILLISECOND;
  assert.equal(steps, 15_999);
  assert.ok(milliseconds <= 1000, `${milliseconds} ms`);
});

test('a stored configuration and label outlive a power cycle', { skip }, () => {
  const rig = new PicoRig();
  rig.configure(outputs.map((line) => (line.line === 3 ? { ...line, safe_level: true } : line)));
  rig.client.must({ store_config: { label: 'left bench' } });
  const again = rig.powerCycle();
  assert.equal(again.client.must({ capabilities: {} }).capabilities.label, 'left bench');
  assert.equal(again.status().stored_config, rig.configHash);
  assert.equal(again.outputLevels, 1 << 3, 'its safe level holds from power-up on');
});

test('it reboots when asked with its token, and only then; also into the boot loader', { skip }, () => {
  const rig = new PicoRig();
  const token = crc32c(rig.hello.unique_id);
  assert.notEqual(rig.client.ask({ reboot: { token: (token ^ 1) >>> 0 } }).code, 'CODE_OK');
  rig.client.must({ reboot: { token } });
  rig.board.run(200 * CYCLES_PER_MILLISECOND, () => rig.board.chip.resetCount === 1);
  assert.equal(rig.board.chip.resetCount, 1);
  rig.board.run(100 * CYCLES_PER_MILLISECOND, () => rig.board.host.device !== null);
  rig.connect();
  assert.equal(rig.status().reset_cause, 'RESET_CAUSE_REQUEST');
  rig.client.must({ reboot: { token, bootloader: true } });
  rig.board.run(200 * CYCLES_PER_MILLISECOND, () => rig.board.bootloader !== null);
  assert.match(rig.board.bootloader.reason, /the program asked/);
});
