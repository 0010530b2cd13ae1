// SPDX-License-Identifier: Apache-2.0
// The RP2040's USB device controller as the bus sees it (data sheet, 4.1): every transaction looks at the buffer controls in the
// USB memory. rp2040js takes a buffer the moment it is armed and knows neither NAK, STALL nor data toggles.

import { CYCLES_PER_MICROSECOND } from '../clock/time.mjs';

const AVAILABLE = 1 << 10;
const STALL = 1 << 11;
const RESET_SELECT = 1 << 12;
const DATA1 = 1 << 13;
const FULL = 1 << 15;
const LENGTH = 0x3ff;

const EP_ENABLE = 0x80000000;
const EP_DOUBLE = 1 << 30;
const EP_INTERRUPT = 1 << 29;

const SIE_SETUP = 1 << 17;
const SIE_BUS_RESET = 1 << 19;
const SIE_SUSPENDED = 1 << 4;
const SIE_DATA_SEQ_ERROR = 0x80000000;
const SIE_VBUS = 1;

const CTRL_PULLUP = 1 << 16;
const CTRL_EP0_ONE_BUFFER = 1 << 29;
const CTRL_EP0_DOUBLE = 1 << 30;
const CONTROLLER_ENABLE = 1;

const MAIN_CTRL = 0x40;
const SIE_CTRL = 0x4c;
const SIE_STATUS = 0x50;
const SOF_RD = 0x48;
const USB_PWR = 0x78;
const BUFF_CPU_SHOULD_HANDLE = 0x5c;
const INTR_SOF = 1 << 17;

const TYPE_BULK = 2;
// RP2040-E15: microseconds of a frame in which no bulk IN packet should become possible.
const FRAME_END = [800, 998];

const EP0_BUFFER = 0x100;
const BUFFER_CONTROLS = 0x80;
const BUFFER_CONTROLS_END = 0x100;
const SECOND_BUFFER = 64;

export const IN = 0x80;

export class UsbController {
  /** `onChange()`: a buffer was armed or stalled, or the pull-up changed. */
  constructor(chip, onChange) {
    this.chip = chip;
    this.onChange = onChange;
    this.lints = new Map();
    this.armedAtFrameEnd = 0; // bulk IN buffers for which RP2040-E15 is a risk
    this.attach();
    chip.resetListeners.add(() => {
      this.attach();
      this.onChange();
    });
  }

  /** Hooks itself into the (new) chip's controller. */
  attach() {
    const usb = (this.usb = this.chip.rp2040.usbCtrl);
    this.view = this.chip.rp2040.usbDPRAMView;
    this.memory = this.chip.rp2040.usbDPRAM;
    this.select = new Map(); // endpoint with direction -> 0 or 1, the buffer whose turn it is
    this.done = 0; // BUFF_CPU_SHOULD_HANDLE
    this.last = new Map();
    usb.DPRAMUpdated = (offset, value) => this.bufferControlWritten(offset, value >>> 0);
    const write = usb.writeUint32.bind(usb);
    const read = usb.readUint32.bind(usb);
    usb.writeUint32 = (offset, value) => {
      if (offset === SIE_STATUS) this.setStatus(usb.rawWriteValue & SIE_SUSPENDED, false);
      write(offset, value);
      if (offset === MAIN_CTRL || offset === SIE_CTRL || offset === USB_PWR) this.onChange();
    };
    usb.readUint32 = (offset) => {
      if (offset === BUFF_CPU_SHOULD_HANDLE) return this.done;
      if (offset === SOF_RD) this.clearSof();
      return read(offset);
    };
    this.chip.usbReset = () => this.reset();
  }

  /** RESETS took the controller down: it drops off the bus. */
  reset() {
    Object.assign(this.usb, { mainCtrl: 0, sieCtrl: 0, addrEndp: 0, buffStatus: 0, intRaw: 0, intEnable: 0, intForce: 0 });
    Object.assign(this.usb, { sieStatus: 0, epStallArm: 0, sofFrameNumber: 0 });
    this.usb.checkInterrupts();
    this.select.clear();
    this.onChange();
  }

  /** On the Pico VBUS reaches GPIO24 only, so the program must override the controller's detection (USB_PWR). */
  get pulledUp() {
    const { mainCtrl, sieCtrl, sieStatus } = this.usb;
    return (mainCtrl & CONTROLLER_ENABLE) !== 0 && (sieCtrl & CTRL_PULLUP) !== 0 && (sieStatus & SIE_VBUS) !== 0;
  }

  get address() {
    return this.usb.addrEndp & 0x7f;
  }

  setStatus(bits, on) {
    if (on) this.usb.sieStatus |= bits;
    else this.usb.sieStatus &= ~bits;
    this.usb.sieStatusUpdated();
  }

  busReset() {
    this.setStatus(SIE_BUS_RESET, true);
  }

  suspend(on) {
    this.setStatus(SIE_SUSPENDED, on);
  }

  startOfFrame(number) {
    this.frameAt = this.chip.cycle;
    this.usb.sofFrameNumber = number;
    this.usb.intRaw |= INTR_SOF;
    this.usb.checkInterrupts();
  }

  clearSof() {
    this.usb.intRaw &= ~INTR_SOF;
    this.usb.checkInterrupts();
  }

  /** SETUP is always taken; it disarms the STALL of endpoint 0. */
  setup(bytes) {
    this.memory.set(bytes, 0);
    this.usb.epStallArm = 0;
    this.setStatus(SIE_SETUP, true);
  }

  controlOffset(key) {
    return BUFFER_CONTROLS + 8 * (key & 15) + (key & IN ? 0 : 4);
  }

  endpointControl(key) {
    if ((key & 15) === 0) return (EP_ENABLE | (this.usb.sieCtrl & CTRL_EP0_DOUBLE ? EP_DOUBLE : 0)) >>> 0;
    return this.view.getUint32(8 * (key & 15) + (key & IN ? 0 : 4), true);
  }

  /** The buffer that a transaction on this endpoint meets: {half, control, shift, address}. */
  buffer(key) {
    const control = this.endpointControl(key);
    const half = control & EP_DOUBLE ? (this.select.get(key) ?? 0) : 0;
    const word = this.view.getUint32(this.controlOffset(key), true);
    const base = (key & 15) === 0 ? EP0_BUFFER : control & 0xffc0;
    return { half, bits: (word >>> (16 * half)) & 0xffff, address: base + half * SECOND_BUFFER, enabled: (control & EP_ENABLE) !== 0 };
  }

  /** What the device would answer now: 'ready', 'nak', 'stall', or 'silent' if there is no such endpoint. */
  readiness(key) {
    const { bits, enabled } = this.buffer(key);
    if (!enabled) return 'silent';
    const word = this.view.getUint32(this.controlOffset(key), true);
    if (word & STALL && this.stallArmed(key)) return 'stall';
    return bits & AVAILABLE ? 'ready' : 'nak';
  }

  /** On endpoint 0 a STALL needs EP_STALL_ARM as well. */
  stallArmed(key) {
    if ((key & 15) !== 0) return true;
    return (this.usb.epStallArm & (key & IN ? 1 : 2)) !== 0;
  }

  /** IN: {data, toggle} out of the armed buffer. */
  takeIn(key) {
    const { bits, address } = this.buffer(key);
    const data = Buffer.from(this.memory.subarray(address, address + (bits & LENGTH)));
    if (!(bits & FULL)) this.lint(`endpoint ${key & 15} IN was armed without FULL`);
    this.complete(key, bits & ~AVAILABLE & ~FULL);
    return { data, toggle: bits & DATA1 ? 1 : 0 };
  }

  /** OUT: gives a packet; false if the toggle is not the one the device waits for (it is then acknowledged and dropped). */
  giveOut(key, data, toggle) {
    const { bits, address } = this.buffer(key);
    if ((bits & DATA1 ? 1 : 0) !== toggle) {
      this.setStatus(SIE_DATA_SEQ_ERROR, true);
      return false;
    }
    if (data.length > (bits & LENGTH)) this.lint(`endpoint ${key & 15} OUT got ${data.length} bytes into a buffer for ${bits & LENGTH}`);
    const length = Math.min(data.length, bits & LENGTH);
    this.memory.set(data.subarray(0, length), address);
    this.complete(key, (bits & ~AVAILABLE & ~LENGTH) | FULL | length);
    return true;
  }

  /** Hands a buffer back to the program. */
  complete(key, bits) {
    const { half } = this.buffer(key);
    const offset = this.controlOffset(key);
    const word = this.view.getUint32(offset, true);
    const next = ((word & ~(0xffff << (16 * half))) | ((bits & 0xffff) << (16 * half))) >>> 0;
    this.view.setUint32(offset, next, true);
    this.last.set(offset, next);
    const control = this.endpointControl(key);
    if (control & EP_DOUBLE) this.select.set(key, half ^ 1);
    const bit = 1 << (2 * (key & 15) + (key & IN ? 0 : 1));
    this.done = half ? this.done | bit : this.done & ~bit;
    if (this.interrupts(key, control)) this.usb.indicateBufferReady(key & 15, !(key & IN));
  }

  interrupts(key, control) {
    return (key & 15) === 0 ? (this.usb.sieCtrl & CTRL_EP0_ONE_BUFFER) !== 0 : (control & EP_INTERRUPT) !== 0;
  }

  bufferControlWritten(offset, value) {
    if (offset < BUFFER_CONTROLS || offset >= BUFFER_CONTROLS_END) return;
    const key = ((offset - BUFFER_CONTROLS) >>> 3) | (offset & 4 ? 0 : IN);
    const before = this.last.get(offset) ?? 0;
    this.last.set(offset, value);
    this.checkHandover(key, before, value);
    this.checkOwner(key, before, value);
    if (value & RESET_SELECT) this.select.set(key, 0);
    if (value & (AVAILABLE | STALL | (AVAILABLE << 16))) this.onChange(key);
  }

  /** The controller may be using an AVAILABLE buffer; EP_ABORT asks it to stop, EP_ABORT_DONE tells when it has. */
  checkOwner(key, before, value) {
    const bit = 1 << (2 * (key & 15) + (key & IN ? 0 : 1));
    const asked = (this.usb.epAbort & this.usb.epAbortDone & bit) !== 0;
    const changed = [0, 16].some((shift) => before & (AVAILABLE << shift) && ((before ^ value) >>> shift) & 0xffff);
    if (changed && !asked) this.lint(`endpoint ${key & 15} ${key & IN ? 'IN' : 'OUT'}: changed while the controller has it`);
  }

  /**
   * Data sheet 4.1.2.5.1: AVAILABLE must be set on its own, some clk_usb cycles after the rest, or the controller may see it
   * with an old length.
   */
  checkHandover(key, before, value) {
    for (const shift of [0, 16]) {
      const changed = ((before ^ value) >>> shift) & 0xffff;
      const armed = ((value >>> shift) & AVAILABLE) !== 0 && (changed & AVAILABLE) !== 0;
      if (armed) this.checkFrame(key);
      if (armed && changed & ~AVAILABLE) this.lint(`endpoint ${key & 15} ${key & IN ? 'IN' : 'OUT'}: AVAILABLE is set together with other bits`);
    }
  }

  checkFrame(key) {
    const bulk = ((this.endpointControl(key) >>> 26) & 3) === TYPE_BULK;
    if ((key & 15) === 0 || !(key & IN) || !bulk) return;
    const age = (this.chip.cycle - this.frameAt) / CYCLES_PER_MICROSECOND;
    if (age >= FRAME_END[0] && age <= FRAME_END[1]) this.armedAtFrameEnd++;
  }

  lint(text) {
    this.lints.set(text, (this.lints.get(text) ?? 0) + 1);
  }
}
