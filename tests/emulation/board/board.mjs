// SPDX-License-Identifier: Apache-2.0
// The emulated Raspberry Pi Pico: chip, flash with a firmware, boot as the ROM does it, USB cable, wires and stimuli.

import { Chip } from '../clock/chip.mjs';
import { CLOCK_HZ, CYCLES_PER_MILLISECOND } from '../clock/time.mjs';
import { EdgeRecorder } from '../edges/edges.mjs';
import { UsbHost } from '../usb/host.mjs';
import { BootRom, smallFunctions } from './bootrom.mjs';
import { Flash } from './flash.mjs';
import { boot2IsSound, readUf2 } from './image.mjs';
import { Stimuli } from './stimuli.mjs';

const BOOT2_PLACE = 0x20041f00;
const SRAM = 0x20000000;
const VECTOR_BOOT = 0xb007c0d3; // watchdog scratch 4: start at the address in scratch 7
const UNDEFINED_SRAM = 0x5a;

export class Board {
  /**
   * `uf2`: content of a UF2 file. `fastForward`, `dmaCycles` and `deliverFaults` as for Chip, `quadEnabled` and `missCycles` as for Flash. The cable is
   * out until `host.plug(true)`.
   */
  constructor(uf2, { fastForward = true, dmaCycles = 1, deliverFaults = false, quadEnabled, missCycles } = {}) {
    this.chip = new Chip({ fastForward, dmaCycles, deliverFaults, boot: () => this.boot() });
    this.flash = new Flash(this.chip, { quadEnabled, missCycles });
    this.load(uf2);
    this.recorder = new EdgeRecorder(this.chip);
    this.host = new UsbHost(this.chip);
    this.stimuli = new Stimuli(this.chip);
    this.resetMemory();
    this.boot();
  }

  load(uf2) {
    for (const { offset, data } of readUf2(uf2)) this.flash.bytes.set(data, offset);
  }

  /** SRAM holds no zeros after power-up; neither should a program count on them. */
  resetMemory() {
    this.chip.rp2040.sram.fill(UNDEFINED_SRAM);
  }

  /** After a power cycle: the flash of the former board, and all that is connected to it but the USB cable. */
  inherit(former) {
    this.flash.bytes.set(former.flash.bytes);
    this.flash.flashChip.status2 = former.flash.flashChip.status2;
    this.stimuli.inherit(former.stimuli, this.host.vbusPin);
  }

  get cycle() {
    return this.chip.cycle;
  }

  /** The frequency that the program has set up for clk_sys; all times here hold for 125 MHz. */
  get clockIsRight() {
    return this.chip.rp2040.clocks.sysFreq === CLOCK_HZ;
  }

  /** What the ROM does after a reset: second stage into SRAM, its CRC, and off it goes. */
  boot() {
    const { chip } = this;
    this.bootloader = null;
    chip.halted = false;
    this.rom = new BootRom({ ...this.flash.functions(), ...smallFunctions(chip), UB: (r) => this.enterBootloader(r[0], r[1]) });
    this.rom.install(chip);
    this.flash.install();
    if (this.bootFromVector()) return;
    if (!boot2IsSound(this.flash.bytes)) {
      this.enterBootloader(0, 0, 'the CRC of the second stage is wrong');
      return;
    }
    chip.rp2040.sram.set(this.flash.bytes.subarray(0, 256), BOOT2_PLACE - SRAM);
    Object.assign(chip.core, { SP: BOOT2_PLACE, PC: BOOT2_PLACE, LR: 0 });
  }

  /** A watchdog reset may name where to go on. */
  bootFromVector() {
    const { scratch } = this.chip.watchdog;
    const [magic, check, stack, entry] = scratch.subarray(4);
    if (magic !== VECTOR_BOOT || check !== ((entry ^ -VECTOR_BOOT) >>> 0)) return false;
    scratch[4] = 0;
    Object.assign(this.chip.core, { SP: stack, PC: entry & ~1 });
    return true;
  }

  /** reset_to_usb_boot: the program is over; the pins are let go and the device drops off the bus. */
  enterBootloader(ledMask, disabledInterfaces, reason = 'the program asked for it') {
    const { chip } = this;
    this.bootloader = { ledMask, disabledInterfaces, reason };
    chip.halted = true;
    chip.disturb();
    for (const bit of [2, 5, 8, 10, 11, 21, 24]) chip.resetBlock(bit);
    chip.core.enabledInterrupts = 0;
  }

  /** As the ROM starts a program that was copied to its drive: a watchdog reset, REASON.TIMER, no vector in the scratch registers. */
  restartFromBootloader() {
    const { chip } = this;
    const { scratch } = chip.watchdog;
    scratch[4] = 0;
    chip.rp2040.peripherals[0x40010].wdsel = 0x1ffff;
    this.resetMemory(); // the ROM used it for its own buffers
    chip.requestReset({ scratch, reason: 1 });
    chip.performReset();
  }

  run(cycles, until) {
    return this.chip.run(cycles, until);
  }

  runMilliseconds(milliseconds, until) {
    return this.run(Math.round(milliseconds * CYCLES_PER_MILLISECOND), until);
  }

  /** Cable in, and run until the device is enumerated. */
  connect() {
    this.host.plug(true);
    return this.host.waitForDevice();
  }
}
