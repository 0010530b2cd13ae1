// SPDX-License-Identifier: Apache-2.0
// The flash chip behind the ROM's functions: 2 MiB as on the Pico, erased to ones by sectors of 4 KiB, programmed by pages of 256
// bytes (bits only fall), and away from the address space between flash_exit_xip and flash_enter_cmd_xip.

import { CYCLES_PER_MICROSECOND } from '../clock/constants.mjs';

export const FLASH_BYTES = 2 << 20;
const SECTOR = 4096;
const PAGE = 256;
// Typical times of the W25Q16JV.
const SECTOR_ERASE_CYCLES = 45_000 * CYCLES_PER_MICROSECOND;
const PAGE_PROGRAM_CYCLES = 400 * CYCLES_PER_MICROSECOND;

const inFlash = (address) => address >>> 24 === 0x10;

export class Flash {
  constructor(chip) {
    this.chip = chip;
    this.mapped = true; // execute in place works
    this.erased = 0; // sectors
    this.programmed = 0; // pages
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
        this.mapped = false;
      },
      RE: ([offset, count]) => this.erase(offset, count),
      RP: ([offset, source, count]) => this.program(offset, source, count),
      FC: () => this.checkCaller('flash_flush_cache'),
      CX: () => {
        this.mapped = true;
      },
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
