// SPDX-License-Identifier: Apache-2.0
// The flash chip behind the ROM's functions: 2 MiB as on the Pico, erased to ones by sectors of 4 KiB, programmed by pages of 256
// bytes (bits only fall), and away from the address space between flash_exit_xip and flash_enter_cmd_xip (or a second stage that is
// run again). While it is away, whatever reads it is an error.

import { CYCLES_PER_MICROSECOND } from '../clock/constants.mjs';
import { QSPI_SELECT_CONTROL, Ssi } from './ssi.mjs';

export const FLASH_BYTES = 2 << 20;
const SECTOR = 4096;
const PAGE = 256;
// Typical times of the W25Q16JV.
const SECTOR_ERASE_CYCLES = 45_000 * CYCLES_PER_MICROSECOND;
const PAGE_PROGRAM_CYCLES = 400 * CYCLES_PER_MICROSECOND;

const inFlash = (address) => address >>> 26 === 4; // 0x10 to 0x13: the four aliases

export class Flash {
  constructor(chip) {
    this.chip = chip;
    this.erased = 0; // sectors
    this.programmed = 0; // pages
  }

  /** Connects a (new) chip's serial interface. After a reset flash is there: the ROM saw to that. */
  install() {
    const { peripherals } = this.chip.rp2040;
    const pins = peripherals[0x40018];
    const ssi = new Ssi(() => pins.readUint32(QSPI_SELECT_CONTROL), (on) => this.map(on));
    const write = pins.writeUint32Atomic.bind(pins);
    pins.writeUint32Atomic = (offset, value, alias) => {
      write(offset, value, alias);
      if (offset === QSPI_SELECT_CONTROL) ssi.selectChanged();
    };
    peripherals[0x18000] = ssi;
    this.mapped = true;
  }

  /** Execute in place on or off. */
  map(on) {
    if (on === this.mapped) return;
    this.mapped = on;
    const { rp2040, access } = this.chip;
    access.direct = on;
    for (const name of ['readUint8', 'readUint16', 'readUint32']) {
      if (on) delete rp2040[name];
      else this.guard(rp2040, name);
    }
  }

  guard(rp2040, name) {
    const read = rp2040[name].bind(rp2040);
    rp2040[name] = (address) => {
      if (inFlash(address)) this.fault(`a read at 0x${(address >>> 0).toString(16)} while it is not mapped`);
      return read(address);
    };
  }

  get bytes() {
    return this.chip.rp2040.flash;
  }

  /** The ROM's functions, by their codes. */
  functions() {
    return {
      IF: () => this.checkCaller('connect_internal_flash'),
      EX: () => {
        this.checkCaller('flash_exit_xip');
        this.map(false);
      },
      RE: ([offset, count]) => this.erase(offset, count),
      RP: ([offset, source, count]) => this.program(offset, source, count),
      FC: () => this.checkCaller('flash_flush_cache'),
      CX: () => this.map(true),
    };
  }

  fault(what) {
    this.chip.fault(`flash: ${what}`);
  }

  /** While the flash is away from the address space nothing may be fetched from it. */
  checkCaller(name) {
    if (inFlash(this.chip.core.LR)) this.fault(`${name} is called from code in flash`);
  }

  checkInterrupts(name) {
    const { core, rp2040 } = this.chip;
    if (core.PM || core.enabledInterrupts === 0) return;
    if (inFlash(core.VTOR)) this.fault(`${name} with interrupts on and their table in flash`);
    for (let irq = 0; irq < 26; irq++) {
      const enabled = (core.enabledInterrupts >>> irq) & 1;
      if (enabled && inFlash(rp2040.readUint32(core.VTOR + 64 + 4 * irq))) this.fault(`${name} with interrupt ${irq} on, whose handler is in flash`);
    }
  }

  check(name, offset, count, unit) {
    this.checkCaller(name);
    this.checkInterrupts(name);
    if (this.mapped) this.fault(`${name} without flash_exit_xip before`);
    if (offset % unit || count % unit) this.fault(`${name}(${offset}, ${count}): not a multiple of ${unit}`);
    if (offset + count > FLASH_BYTES) this.fault(`${name}(${offset}, ${count}) is beyond the end of ${FLASH_BYTES} bytes`);
  }

  erase(offset, count) {
    this.check('flash_range_erase', offset, count, SECTOR);
    this.bytes.fill(0xff, offset, offset + count);
    this.erased += count / SECTOR;
    this.chip.spend((count / SECTOR) * SECTOR_ERASE_CYCLES);
  }

  program(offset, source, count) {
    this.check('flash_range_program', offset, count, PAGE);
    if (inFlash(source)) this.fault('flash_range_program from data in flash');
    for (let i = 0; i < count; i++) this.bytes[offset + i] &= this.chip.rp2040.readUint8(source + i);
    this.programmed += count / PAGE;
    this.chip.spend((count / PAGE) * PAGE_PROGRAM_CYCLES);
  }
}
