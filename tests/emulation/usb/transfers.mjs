// SPDX-License-Identifier: Apache-2.0
// Transfers on their way, as a host controller keeps them: one queue per endpoint and direction, data toggles, and which
// transaction comes next. A transfer ends with {status, data}; status is ok, stall, cancelled, gone or error.

import { CYCLES_PER_MICROSECOND, CYCLES_PER_MILLISECOND } from '../clock/time.mjs';
import { IN } from './controller.mjs';

const DATA0 = 0;
const DATA1 = 1;

export class Transfers {
  constructor(controller, bus) {
    this.controller = controller;
    this.bus = bus;
    this.queues = new Map();
    this.toggles = new Map();
    this.sizes = new Map(); // largest packet of each endpoint
    this.errors = []; // what no sound device does
    this.turn = 0;
  }

  queue(key) {
    if (!this.queues.has(key)) this.queues.set(key, []);
    return this.queues.get(key);
  }

  packetSize(key) {
    return this.sizes.get(key) ?? 64;
  }

  /** Bus reset, SET_CONFIGURATION: the toggles of all endpoints but 0 start again at DATA0. */
  resetToggles() {
    this.toggles.clear();
  }

  add(key, transfer) {
    this.queue(key).push(transfer);
    this.bus.poke();
    return transfer;
  }

  finish(key, status) {
    const transfer = this.queue(key).shift();
    transfer.done({ status, data: transfer.data });
  }

  cancel(transfer) {
    for (const queue of this.queues.values()) {
      const at = queue.indexOf(transfer);
      if (at < 0) continue;
      queue.splice(at, 1);
      transfer.cancelled = true;
      transfer.done({ status: 'cancelled', data: transfer.data });
      return true;
    }
    return false;
  }

  /** The device is gone: everything ends. */
  failAll() {
    const all = [...this.queues.values()].flat();
    this.queues.clear();
    for (const transfer of all) transfer.done({ status: 'gone', data: transfer.data });
  }

  /** Next transaction for the bus, endpoints in turn; null while the device has nothing to say. */
  next(address) {
    const keys = [...this.queues.keys()].filter((key) => this.queues.get(key).length > 0);
    for (let i = 0; i < keys.length; i++) {
      const key = keys[(this.turn + i) % keys.length];
      const transaction = this.transaction(key, this.queues.get(key)[0], address);
      if (!transaction) continue;
      this.turn = (this.turn + i + 1) % keys.length;
      return transaction;
    }
    return null;
  }

  transaction(key, transfer, address) {
    if (this.controller.address !== address) return this.silent(key, transfer);
    if (transfer.setup) return { bytes: 8, finish: () => this.endSetup(key, transfer) };
    const answer = this.controller.readiness(key);
    if (answer === 'nak') return null;
    if (answer === 'silent') return this.silent(key, transfer);
    if (answer === 'stall') return { bytes: 0, finish: () => this.end(key, transfer, 'stall') };
    if (key & IN) return { bytes: this.controller.buffer(key).bits & 0x3ff, finish: () => this.endIn(key, transfer) };
    const bytes = Math.min(this.packetSize(key), transfer.data.length - transfer.position);
    return { bytes, finish: () => this.endOut(key, transfer, bytes) };
  }

  /** No handshake at all: the host gives up. */
  silent(key, transfer) {
    return { bytes: 0, finish: () => this.end(key, transfer, 'error') };
  }

  /** Ends a transfer unless it was cancelled while its last transaction was on the wire. */
  end(key, transfer, status) {
    if (!transfer.cancelled && this.queue(key)[0] === transfer) this.finish(key, status);
  }

  endSetup(key, transfer) {
    if (transfer.cancelled) return;
    this.toggles.set(0, DATA1);
    this.toggles.set(IN, DATA1);
    this.controller.setup(transfer.setup);
    this.end(key, transfer, 'ok');
  }

  toggle(key) {
    const now = this.toggles.get(key) ?? DATA0;
    this.toggles.set(key, now ^ 1);
    return now;
  }

  endIn(key, transfer) {
    if (transfer.cancelled || this.controller.readiness(key) !== 'ready') return;
    const { data, toggle } = this.controller.takeIn(key);
    const expected = this.toggle(key);
    if (toggle !== expected) this.errors.push(`endpoint ${key & 15} IN: DATA${toggle}, expected DATA${expected}`);
    if (data.length > this.packetSize(key)) this.errors.push(`endpoint ${key & 15} IN: packet of ${data.length} bytes`);
    transfer.data = Buffer.concat([transfer.data, data]);
    if (transfer.data.length > transfer.length) return this.end(key, transfer, 'error'); // babble
    if (data.length < this.packetSize(key) || transfer.data.length === transfer.length) this.end(key, transfer, 'ok');
  }

  endOut(key, transfer, bytes) {
    if (transfer.cancelled || this.controller.readiness(key) !== 'ready') return;
    const toggle = this.toggle(key);
    const packet = transfer.data.subarray(transfer.position, transfer.position + bytes);
    if (!this.controller.giveOut(key, packet, toggle)) {
      this.errors.push(`endpoint ${key & 15} OUT: the device waits for DATA${toggle ^ 1}, got DATA${toggle}`);
    }
    transfer.position += bytes;
    if (transfer.position >= transfer.data.length) this.end(key, transfer, 'ok');
  }
}

// The full-speed wire: frames of 1 ms, one transaction after the other, each as long as its bytes take (USB 2.0, 5.8.4: a bulk
// transaction of n bytes costs n + 13 byte times of 1500 in a frame, so 19 of 64 bytes fit). Bit stuffing is left out.

const BYTES_PER_FRAME = 1500;
const START_OF_FRAME_BYTES = 6;
const OVERHEAD_BYTES = 13;
/** A host that was answered NAK asks again within about this time. */
const RETRY_CYCLES = 4 * CYCLES_PER_MICROSECOND;

const cyclesOf = (bytes) => Math.round((bytes * CYCLES_PER_MILLISECOND) / BYTES_PER_FRAME);

export class UsbBus {
  /** `next()` gives the transaction to carry out, {bytes, finish()}, or null if the device would only answer NAK. */
  constructor(chip, { onFrame, next }) {
    this.chip = chip;
    this.onFrame = onFrame;
    this.next = next;
    this.frame = 0;
    this.frameBegin = 0;
    this.running = false;
    this.busy = false;
    this.packets = 0;
    this.frameEvent = chip.createOutsideEvent(() => this.startFrame());
    this.endEvent = chip.createOutsideEvent(() => this.endTransaction());
    this.retryEvent = chip.createOutsideEvent(() => this.start());
  }

  begin() {
    this.running = true;
    this.startFrame();
  }

  stop() {
    this.running = false;
    this.busy = false;
    for (const event of [this.frameEvent, this.endEvent, this.retryEvent]) event.cancel();
  }

  startFrame() {
    this.frameBegin = this.chip.cycle;
    this.frameEvent.at(this.frameBegin + CYCLES_PER_MILLISECOND);
    this.frame = (this.frame + 1) & 0x7ff;
    this.onFrame(this.frame);
    if (!this.busy) this.retryEvent.at(this.frameBegin + cyclesOf(START_OF_FRAME_BYTES));
  }

  /** Something may have become possible: the host asks again shortly. */
  poke() {
    if (this.running && !this.busy && !this.retryEvent.pending) this.retryEvent.at(this.chip.cycle + RETRY_CYCLES);
  }

  /** Begins the next transaction, if it still fits into this frame. */
  start() {
    if (!this.running || this.busy) return;
    const transaction = this.next();
    if (!transaction) return;
    const cycles = cyclesOf(transaction.bytes + OVERHEAD_BYTES);
    if (this.chip.cycle + cycles > this.frameBegin + CYCLES_PER_MILLISECOND) return; // the next frame asks again
    this.busy = true;
    this.transaction = transaction;
    this.endEvent.at(this.chip.cycle + cycles);
  }

  endTransaction() {
    this.busy = false;
    this.packets++;
    this.transaction.finish();
    this.start();
  }
}
