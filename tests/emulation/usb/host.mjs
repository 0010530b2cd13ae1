// SPDX-License-Identifier: Apache-2.0
// A scripted USB host: cable, bus reset, enumeration, control, bulk and interrupt transfers.
// Everything happens in emulated time. `wait` runs the chip until a transfer is over, for tests that read from top to bottom.

import { CYCLES_PER_MICROSECOND, CYCLES_PER_MILLISECOND } from '../clock/time.mjs';
import { IN, UsbController } from './controller.mjs';
import { Transfers, UsbBus } from './transfers.mjs';

const DEBOUNCE_CYCLES = 10 * CYCLES_PER_MILLISECOND; // a real host takes 100 ms
const RESET_CYCLES = 10 * CYCLES_PER_MILLISECOND;
const RECOVERY_CYCLES = 10 * CYCLES_PER_MILLISECOND;
const SUSPEND_CYCLES = 3 * CYCLES_PER_MILLISECOND;
const WAIT_LIMIT = 2000 * CYCLES_PER_MILLISECOND;

export class UsbHost {
  /** `vbusPin`: GPIO that senses VBUS (24 on the Pico), or null. `autoEnumerate`: does so whenever a device appears. */
  constructor(chip, { vbusPin = 24, autoEnumerate = true } = {}) {
    this.chip = chip;
    this.vbusPin = vbusPin;
    this.autoEnumerate = autoEnumerate;
    this.controller = new UsbController(chip, () => this.deviceChanged());
    this.bus = new UsbBus(chip, { onFrame: (n) => this.controller.startOfFrame(n), next: () => this.transfers.next(this.address) });
    this.transfers = new Transfers(this.controller, this.bus);
    this.attachEvent = chip.createOutsideEvent(() => this.resetBus());
    this.readyEvent = chip.createOutsideEvent(() => this.ready());
    this.suspendEvent = chip.createOutsideEvent(() => this.controller.suspend(true));
    this.listeners = new Set(); // called with 'attached' or 'detached'
    this.cable = false;
    this.present = false;
    this.forget();
  }

  forget() {
    this.address = 0;
    this.device = null; // what enumeration found
    this.controls = [];
    this.controlBusy = false;
  }

  get errors() {
    return this.transfers.errors;
  }

  /** Cable in or out. */
  plug(on) {
    this.cable = on;
    if (this.vbusPin !== null) this.chip.pads.drive(this.vbusPin, on ? 1 : 0);
    this.deviceChanged();
  }

  /** Pull-up and cable decide whether there is a device; armed buffers let the bus go on. */
  deviceChanged() {
    const present = this.cable && this.controller.pulledUp;
    if (present === this.present) return this.bus.poke();
    this.present = present;
    if (present) {
      this.attachEvent.at(this.chip.cycle + DEBOUNCE_CYCLES);
      return undefined;
    }
    return this.lost();
  }

  lost() {
    for (const event of [this.attachEvent, this.readyEvent]) event.cancel();
    this.bus.stop();
    this.suspendEvent.at(this.chip.cycle + SUSPEND_CYCLES);
    const { device } = this;
    this.forget();
    this.transfers.failAll();
    if (device) for (const listener of this.listeners) listener('detached');
  }

  /** Bus reset: 10 ms, then 10 ms of recovery with frames running. */
  resetBus() {
    this.bus.stop();
    this.suspendEvent.cancel();
    this.forget();
    this.transfers.failAll();
    this.transfers.resetToggles();
    this.transfers.sizes.clear();
    this.controller.suspend(false);
    this.controller.busReset();
    this.resetUntil = this.chip.cycle + RESET_CYCLES;
    this.readyEvent.at(this.resetUntil);
  }

  ready() {
    if (!this.bus.running) {
      this.bus.begin();
      this.readyEvent.at(this.chip.cycle + RECOVERY_CYCLES);
      return;
    }
    if (this.autoEnumerate) runScript(enumerate(this), (device) => this.enumerated(device));
  }

  enumerated(device) {
    this.device = device;
    if (device) for (const listener of this.listeners) listener('attached');
  }

  /** A pause in a script. */
  pause(cycles) {
    return (resume) => this.chip.createOutsideEvent(resume).at(this.chip.cycle + cycles);
  }

  /** Control transfer: `done({status, data})`. They are carried out one by one. */
  submitControl(setup, data, done) {
    const control = { setup: Buffer.from(setup), data: Buffer.from(data ?? []), done };
    this.controls.push(control);
    this.startControl();
    return control;
  }

  startControl() {
    if (this.controlBusy || this.controls.length === 0) return;
    this.controlBusy = true;
    const control = this.controls[0];
    runScript(this.controlStages(control), (result) => {
      if (this.controls[0] !== control) return; // the device went away meanwhile
      this.controlBusy = false;
      this.controls.shift();
      if (result.status === 'ok') this.watchRequest(control.setup);
      control.done(result);
      this.startControl();
    });
  }

  *controlStages(control) {
    const { setup, data } = control;
    const length = setup.readUInt16LE(6);
    const stage = (transfer) => (control.stage = transfer);
    const reads = (setup[0] & IN) !== 0 && length > 0;
    yield (done) => stage(this.transfers.add(0, { setup, data: Buffer.alloc(0), done }));
    let result = { status: 'ok', data: Buffer.alloc(0) };
    if (reads) result = yield (done) => stage(this.submitIn(0, length, done));
    else if (length > 0) result = yield (done) => stage(this.submitOut(0, data, done));
    if (result.status !== 'ok') return result;
    for (const key of [0, IN]) this.transfers.toggles.set(key, 1); // the status stage is DATA1
    const status = yield (done) => stage(reads ? this.submitOut(0, Buffer.alloc(0), done) : this.submitIn(0, 0, done));
    return { status: status.status, data: reads ? result.data : Buffer.alloc(0) };
  }

  /** SET_ADDRESS, SET_CONFIGURATION, SET_INTERFACE and CLEAR_FEATURE(halt) change what the host must remember. */
  watchRequest(setup) {
    if (setup[0] === 0 && setup[1] === 5) this.address = setup[2];
    if ((setup[0] === 0 && setup[1] === 9) || (setup[0] === 1 && setup[1] === 11)) this.transfers.resetToggles();
    if (setup[0] === 2 && setup[1] === 1 && setup[2] === 0) this.transfers.toggles.delete(setup[4]);
  }

  submitIn(endpoint, length, done) {
    return this.transfers.add(endpoint | IN, { data: Buffer.alloc(0), length, done });
  }

  submitOut(endpoint, data, done) {
    return this.transfers.add(endpoint, { data: Buffer.from(data), position: 0, done });
  }

  cancel(transfer) {
    return this.transfers.cancel(transfer);
  }

  /** Ends a control transfer in whatever stage it is. */
  cancelControl(control) {
    const at = this.controls.indexOf(control);
    if (at < 0) return false;
    if (at === 0) return this.cancel(control.stage);
    this.controls.splice(at, 1);
    control.done({ status: 'cancelled', data: Buffer.alloc(0) });
    return true;
  }

  /** An OUT transfer that ends with an empty packet if its last one is full. */
  submitTerminated(endpoint, data, done) {
    const full = data.length > 0 && data.length % this.transfers.packetSize(endpoint) === 0;
    if (!full) return this.submitOut(endpoint, data, done);
    return this.submitOut(endpoint, data, (result) => (result.status === 'ok' ? this.submitOut(endpoint, Buffer.alloc(0), done) : done(result)));
  }

  /** Resets the bus of a device that is there, and enumerates it again: `done(device)`, null if that fails. */
  restart(done) {
    const listener = (what) => what === 'attached' && (this.listeners.delete(listener), done(this.device));
    this.listeners.add(listener);
    this.resetBus();
  }

  /** Runs the chip until `start(done)` has called back. */
  wait(start, limit = WAIT_LIMIT) {
    let result;
    start((value) => (result = value ?? true));
    this.chip.run(limit, () => result !== undefined);
    if (result === undefined) throw new Error(`no answer over USB within ${limit / CYCLES_PER_MICROSECOND} us`);
    return result;
  }

  control(setup, data) {
    return this.wait((done) => this.submitControl(setup, data, done));
  }

  read(endpoint, length) {
    return this.wait((done) => this.submitIn(endpoint, length, done));
  }

  write(endpoint, data) {
    return this.wait((done) => this.submitOut(endpoint, data, done));
  }

  /** Runs until the device is enumerated. */
  waitForDevice(limit = WAIT_LIMIT) {
    this.chip.run(limit, () => this.device !== null);
    if (!this.device) throw new Error(`no USB device within ${limit / CYCLES_PER_MILLISECOND} ms: ${this.failure ?? 'none attached'}`);
    return this.device;
  }
}

// What a host asks a new device, in the order Linux asks it: 8 bytes of the device descriptor, a second bus reset left out,
// address, descriptors, strings, BOS, configuration.

const GET_DESCRIPTOR = 6;
const DEVICE = 1;
const CONFIGURATION = 2;
const STRING = 3;
const BOS = 15;
const ENGLISH = 0x0409;
const ADDRESS = 5;

export function descriptorRequest(type, index, language, length) {
  return [0x80, GET_DESCRIPTOR, index, type, language & 255, language >> 8, length & 255, length >> 8];
}

/** A step of a script that must succeed. */
function* ask(host, setup) {
  const result = yield (done) => host.submitControl(setup, null, done);
  if (result.status !== 'ok') throw new Error(`${Buffer.from(setup).toString('hex')}: ${result.status}`);
  return result.data;
}

function* readStrings(host, indices) {
  const strings = [];
  for (const index of indices) {
    strings.push(index ? parseString(yield* ask(host, descriptorRequest(STRING, index, ENGLISH, 255))) : '');
  }
  return strings;
}

/** Binary object store of a device that says it is USB 2.1; null for an older one. */
function* readObjectStore(host, usb) {
  if (usb < 0x0201) return null;
  const head = yield* ask(host, descriptorRequest(BOS, 0, 0, 5));
  return yield* ask(host, descriptorRequest(BOS, 0, 0, head.readUInt16LE(2)));
}

function* configure(host, configuration) {
  for (const { endpoints } of configuration.interfaces) {
    for (const { address, packetSize } of endpoints) host.transfers.sizes.set(address, packetSize);
  }
  yield* ask(host, [0, 9, configuration.value, 0, 0, 0, 0, 0]);
}

function* conversation(host) {
  const first = yield* ask(host, descriptorRequest(DEVICE, 0, 0, 64));
  if (first.length >= 8) for (const key of [0, 0x80]) host.transfers.sizes.set(key, first[7]);
  yield* ask(host, [0, 5, ADDRESS, 0, 0, 0, 0, 0]);
  yield host.pause(2 * CYCLES_PER_MILLISECOND);
  const device = parseDevice(yield* ask(host, descriptorRequest(DEVICE, 0, 0, 18)));
  const head = yield* ask(host, descriptorRequest(CONFIGURATION, 0, 0, 9));
  const configuration = parseConfiguration(yield* ask(host, descriptorRequest(CONFIGURATION, 0, 0, head.readUInt16LE(2))));
  const [manufacturerName, productName, serial] = yield* readStrings(host, device.strings);
  const bos = yield* readObjectStore(host, device.usb);
  yield* configure(host, configuration);
  return { ...device, configuration, manufacturerName, productName, serial, bos };
}

/** The enumerated device, or null; `host.failure` then says why. */
export function* enumerate(host) {
  try {
    return yield* conversation(host);
  } catch (error) {
    host.failure = `enumeration failed: ${error.message}`;
    return null;
  }
}

// Reads descriptors (USB 2.0, 9.6).

export function parseDevice(bytes) {
  return {
    bytes,
    vendor: bytes.readUInt16LE(8),
    product: bytes.readUInt16LE(10),
    version: bytes.readUInt16LE(12),
    usb: bytes.readUInt16LE(2),
    class: [bytes[4], bytes[5], bytes[6]],
    packetSize: bytes[7],
    strings: [bytes[14], bytes[15], bytes[16]],
    configurations: bytes[17],
  };
}

/** Walks a chain of descriptors; stops with an error at one of impossible length. */
export function* walk(bytes) {
  for (let at = 0; at < bytes.length; at += bytes[at]) {
    if (bytes[at] < 2 || at + bytes[at] > bytes.length) throw new Error(`descriptor at ${at}: length ${bytes[at]} is impossible`);
    yield bytes.subarray(at, at + bytes[at]);
  }
}

/** {value, interfaces: [{number, class, endpoints: [{address, type, packetSize, interval}]}]} */
export function parseConfiguration(bytes) {
  if (bytes.length !== bytes.readUInt16LE(2)) throw new Error(`configuration says ${bytes.readUInt16LE(2)} bytes, has ${bytes.length}`);
  const interfaces = [];
  for (const part of walk(bytes)) {
    if (part[1] === 4) interfaces.push({ number: part[2], class: [part[5], part[6], part[7]], declared: part[4], endpoints: [] });
    if (part[1] !== 5) continue;
    interfaces.at(-1).endpoints.push({ address: part[2], type: part[3] & 3, packetSize: part.readUInt16LE(4), interval: part[6] });
  }
  for (const each of interfaces) {
    if (each.declared !== each.endpoints.length) throw new Error(`interface ${each.number} declares ${each.declared} endpoints, has ${each.endpoints.length}`);
  }
  return { bytes, value: bytes[5], interfaces };
}

export const parseString = (bytes) => bytes.subarray(2).toString('utf16le');

// A conversation with a device, written down as a generator: it yields functions that take a callback, and goes on with what
// that is called with. It runs from within the emulation, without promises, so that its order is the same in every run.

export function runScript(generator, done = () => {}) {
  const resume = (value) => {
    const { value: task, done: finished } = generator.next(value);
    if (finished) done(task);
    else task(resume);
  };
  resume();
}
