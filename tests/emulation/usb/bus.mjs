// SPDX-License-Identifier: Apache-2.0
// The full-speed wire: frames of 1 ms, one transaction after the other, each as long as its bytes take (USB 2.0, 5.8.4: a bulk
// transaction of n bytes costs n + 13 byte times of 1500 in a frame, so 19 of 64 bytes fit). Bit stuffing is left out.

import { CYCLES_PER_MICROSECOND, CYCLES_PER_MILLISECOND } from '../clock/constants.mjs';

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
