// SPDX-License-Identifier: Apache-2.0
// The scripted host against a composite device: enumeration, back-pressure, STALL, toggles, pace, cable. (images/usb.cpp)

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { CYCLES_PER_MICROSECOND, CYCLES_PER_MILLISECOND } from '../clock/time.mjs';
import { boardWith, results } from '../testing/images.mjs';

const SETTLE = 5 * CYCLES_PER_MILLISECOND;
const vendorOut = (request, value = 0) => [0x40, request, value & 255, value >> 8, 0, 0, 0, 0];
const pattern = (length, seed = 1) => Buffer.from(Array.from({ length }, (_, i) => (i * 7 + seed * 13) & 255));

function connected(options) {
  const board = boardWith('usb', options);
  board.connect();
  return board;
}

function assertClean(board) {
  assert.deepEqual(board.host.errors, []);
  assert.deepEqual([...board.host.controller.lints], []);
}

test('enumeration of a composite device', () => {
  const board = boardWith('usb');
  const device = board.connect();
  assert.deepEqual([device.vendor, device.product, device.manufacturerName, device.productName, device.serial], [0x1209, 1, 'symrig', 'test unit', '0042']);
  assert.deepEqual(device.configuration.interfaces.map(({ class: kind, endpoints }) => [kind[0], endpoints.map((each) => each.address)]), [
    [0xff, [0x01, 0x81, 0x04]],
    [2, [0x82]],
    [10, [0x03, 0x83]],
  ]);
  assert.equal(board.chip.rp2040.usbCtrl.addrEndp, 5, 'SET_ADDRESS');
  assert.deepEqual(results(board), ['r'.charCodeAt(0)], 'one bus reset');
  assertClean(board);
});

test('the object store leads to the Microsoft OS 2.0 descriptors', () => {
  const board = connected();
  const { bos } = board.host.device;
  assert.equal(bos.length, 33);
  const [length, request] = [bos.readUInt16LE(29), bos[31]];
  const { status, data } = board.host.control([0xc0, request, 0, 0, 7, 0, length & 255, length >> 8]);
  assert.equal(status, 'ok');
  assert.equal(data.toString('latin1', 14, 20), 'WINUSB');
});

test('a control transfer with an OUT data stage', () => {
  const board = connected();
  const coding = Buffer.from([0x80, 0x25, 0, 0, 1, 2, 7]);
  assert.equal(board.host.control([0x21, 0x20, 0, 0, 1, 0, 7, 0], coding).status, 'ok');
  assert.deepEqual(board.host.control([0xa1, 0x21, 0, 0, 1, 0, 7, 0]).data, coding);
  assertClean(board);
});

test('an unknown request is refused by STALL, and the next one works', () => {
  const board = connected();
  assert.equal(board.host.control([0xc0, 0x77, 0, 0, 0, 0, 2, 0]).status, 'stall');
  assert.equal(board.host.control([0x80, 6, 0, 1, 0, 0, 18, 0]).data.length, 18);
});

test('long control reads end by their length or by a short packet', () => {
  const board = connected();
  const whole = board.host.control([0x80, 6, 0, 2, 0, 0, 255, 0]).data;
  assert.equal(whole.length, 105);
  assert.deepEqual(board.host.control([0x80, 6, 0, 2, 0, 0, 64, 0]).data, whole.subarray(0, 64));
});

test('bulk both ways on several endpoints', () => {
  const board = connected();
  for (let i = 0; i < 100; i++) {
    const packet = pattern(1 + (i % 64), i);
    board.host.write(1, packet);
    assert.deepEqual(board.host.read(1, 64).data, packet);
    board.host.write(3, Buffer.from(`line ${i}`));
    assert.equal(board.host.read(3, 64).data.toString(), `LINE ${i}`);
  }
  assertClean(board);
});

test('back-pressure: the host is told to wait, and nothing is lost', () => {
  const board = connected();
  board.host.control(vendorOut(4, 0)); // stop listening: one more packet is taken, then none
  const got = [];
  const done = [];
  for (let i = 0; i < 4; i++) board.host.submitOut(1, pattern(20, i), () => done.push(i));
  const listen = () => board.host.submitIn(1, 64, ({ data, status }) => status === 'ok' && (got.push(data), listen()));
  listen();
  board.run(SETTLE);
  assert.deepEqual(done, [0]);
  board.host.control(vendorOut(4, 1));
  board.run(SETTLE);
  assert.deepEqual(done, [0, 1, 2, 3]);
  assert.deepEqual(got, [0, 1, 2, 3].map((i) => pattern(20, i)));
  assertClean(board);
});

test('wrong data toggles are found in both directions', () => {
  const board = connected();
  board.host.control(vendorOut(2, 0)); // next IN of endpoint 1
  board.host.write(1, pattern(3));
  board.host.read(1, 64);
  assert.deepEqual(board.host.errors, ['endpoint 1 IN: DATA1, expected DATA0']);
  const other = connected();
  other.host.control(vendorOut(2, 1)); // takes effect with the next buffer but one
  other.host.write(1, pattern(3));
  other.host.read(1, 64);
  other.host.write(1, pattern(3));
  assert.equal(other.host.errors.length, 1);
  assert.match(other.host.errors[0], /endpoint 1 OUT: the device waits for DATA0, got DATA1/);
});

test('a halted endpoint stalls until CLEAR_FEATURE, which also starts its toggle again', () => {
  const board = connected();
  board.host.write(1, pattern(5));
  assert.equal(board.host.read(1, 64).status, 'ok');
  board.host.control(vendorOut(3));
  assert.equal(board.host.read(1, 64).status, 'stall');
  assert.equal(board.host.control([2, 1, 0, 0, 0x81, 0, 0, 0]).status, 'ok');
  board.host.write(1, pattern(6));
  assert.deepEqual(board.host.read(1, 64).data, pattern(6));
  assertClean(board);
});

test('SET_CONFIGURATION starts the toggles again', () => {
  const board = connected();
  board.host.write(1, pattern(5));
  board.host.read(1, 64);
  assert.equal(board.host.control([0, 9, 1, 0, 0, 0, 0, 0]).status, 'ok');
  board.host.write(1, pattern(5));
  assert.equal(board.host.read(1, 64).data.length, 5);
  assertClean(board);
});

test('a bulk endpoint takes what full speed can give: 19 packets of 64 bytes in a frame', () => {
  const board = connected();
  const bytes = pattern(19 * 64 * 20);
  const begin = board.cycle;
  board.host.write(4, bytes);
  const frames = (board.cycle - begin) / CYCLES_PER_MILLISECOND;
  // The device needs some 3 us to hand a buffer back, but it has two: the wire alone decides. Begin and end cut one frame each.
  assert.ok(frames >= 19 && frames <= 22, `${frames} frames`);
  const { data } = board.host.control([0xc0, 7, 0, 0, 0, 0, 4, 0]);
  assert.equal(data.readUInt32LE(), bytes.length);
  assertClean(board);
});

test('a packet of 64 bytes takes its 51 us on the wire', () => {
  const board = connected();
  const ends = [];
  const mark = () => ends.push(board.cycle);
  board.run(SETTLE);
  for (let i = 0; i < 4; i++) board.host.submitOut(4, pattern(64), mark);
  board.run(SETTLE);
  const spacing = (ends[1] - ends[0]) / CYCLES_PER_MICROSECOND;
  assert.ok(Math.abs(spacing - (77 * 1000) / 1500) < 0.1, `${spacing} us`);
});

test('frames come every millisecond, and SOF_RD counts them', () => {
  const board = connected();
  const word = (index) => board.chip.rp2040.readUint32(0x20000000 + 4 + 4 * index);
  const [number, count] = [word(200), word(201)];
  board.run(100 * CYCLES_PER_MILLISECOND);
  assert.equal(word(201) - count, 100);
  assert.equal((word(200) - number) & 0x7ff, 100);
});

test('cable out: transfers end, the device is told to suspend; cable in: it comes back as new', () => {
  const board = connected();
  let end;
  board.host.submitIn(1, 64, ({ status }) => (end = status));
  board.run(SETTLE);
  const told = [];
  board.host.listeners.add((what) => told.push(what));
  board.host.plug(false);
  assert.equal(end, 'gone');
  board.run(SETTLE);
  assert.deepEqual(results(board).map((code) => String.fromCharCode(code)), ['r', 'u']);
  board.connect();
  assert.deepEqual(told, ['detached', 'attached']);
  board.host.write(1, pattern(9));
  assert.deepEqual(board.host.read(1, 64).data, pattern(9));
  assertClean(board);
});

test('a device that drops its pull-up is enumerated again', () => {
  const board = connected();
  board.host.control(vendorOut(5));
  board.runMilliseconds(20, () => board.host.device === null);
  assert.equal(board.host.device, null);
  board.host.waitForDevice();
  board.host.write(3, Buffer.from('again'));
  assert.equal(board.host.read(3, 64).data.toString(), 'AGAIN');
  assertClean(board);
});

test('a transfer can be cancelled', () => {
  const board = connected();
  let end;
  const transfer = board.host.submitIn(1, 64, ({ status }) => (end = status));
  board.run(SETTLE);
  assert.equal(board.host.cancel(transfer), true);
  assert.equal(end, 'cancelled');
  assert.equal(board.host.cancel(transfer), false);
  board.host.write(1, pattern(4));
  assert.deepEqual(board.host.read(1, 64).data, pattern(4));
});

test('an image that arms a buffer in one write is told so', () => {
  const board = connected();
  const { rp2040 } = board.chip;
  rp2040.writeUint32(0x50100080 + 8 * 3, (1 << 10) | 5);
  assert.match([...board.host.controller.lints.keys()].join(), /endpoint 3 IN: AVAILABLE is set together with other bits/);
});

test('a watchdog reset takes the device off the bus, and it comes back', () => {
  const board = connected();
  const told = [];
  board.host.listeners.add((what) => told.push(what));
  const { rp2040 } = board.chip;
  rp2040.writeUint32(0x40010008, 0x1fffc); // PSM.WDSEL
  rp2040.writeUint32(0x40058000, 0x80000000); // watchdog, TRIGGER
  board.runMilliseconds(100, () => told.length === 2);
  assert.deepEqual(told, ['detached', 'attached']);
  assert.equal(board.chip.resetCount, 1);
  board.host.write(1, pattern(33));
  assert.deepEqual(board.host.read(1, 64).data, pattern(33));
  assertClean(board);
});

test('a bus reset in the middle of everything', () => {
  const board = connected();
  board.host.submitOut(4, pattern(5000), () => {});
  board.host.submitIn(1, 64, () => {});
  board.runMilliseconds(1.5);
  assert.ok(board.host.wait((done) => board.host.restart(done)));
  board.host.write(1, pattern(12));
  assert.deepEqual(board.host.read(1, 64).data, pattern(12));
  assert.equal(String.fromCharCode(...results(board)), 'rr');
  assertClean(board);
});
