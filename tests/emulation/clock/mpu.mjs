// SPDX-License-Identifier: Apache-2.0
// The memory protection unit (ARMv6-M, B3.5), as far as a guard needs it: regions without any access. A load or store there is a hard
// fault; in the hard fault handler itself nothing is checked (HFNMIENA 0). Other permissions are errors here.

const CTRL = 0xd94;
const NUMBER = 0xd98;
const BASE = 0xd9c;
const ATTRIBUTES = 0xda0;
const TYPE = 0xd90;
const REGIONS = 8;
const HARD_FAULT = 3;

export class Mpu {
  constructor(chip) {
    this.chip = chip;
    this.control = 0;
    this.number = 0;
    this.regions = Array.from({ length: REGIONS }, () => ({ base: 0, attributes: 0 }));
    this.guarded = []; // [begin, end) without access
    // All of them lie in this range; the processor's accesses look at it first (core/access.mjs).
    this.from = 0;
    this.to = 0;
  }

  handles(offset) {
    return offset >= TYPE && offset <= ATTRIBUTES;
  }

  read(offset) {
    const { base, attributes } = this.regions[this.number];
    return { [TYPE]: REGIONS << 8, [CTRL]: this.control, [NUMBER]: this.number, [BASE]: base | this.number, [ATTRIBUTES]: attributes }[offset];
  }

  write(offset, value) {
    if (offset === CTRL) this.control = value & 7;
    else if (offset === NUMBER) this.number = value % REGIONS;
    else if (offset === BASE) this.setBase(value);
    else if (offset === ATTRIBUTES) this.regions[this.number].attributes = value;
    this.update();
  }

  setBase(value) {
    if (value & 0x10) this.number = value & 7;
    this.regions[this.number].base = (value & ~0xff) >>> 0;
  }

  update() {
    const active = this.control & 1 ? this.regions.filter(({ attributes }) => attributes & 1) : [];
    this.guarded = active.map(({ base, attributes }) => {
      if ((attributes >>> 24) & 7) this.chip.fault('an MPU region with access is not modelled');
      return [base, base + 2 ** (((attributes >>> 1) & 31) + 1)];
    });
    if (this.guarded.length > 0 && !(this.control & 4)) this.chip.fault('an MPU without the default map is not modelled');
    this.from = Math.min(...this.guarded.map(([begin]) => begin), Infinity);
    this.to = Math.max(...this.guarded.map(([, end]) => end), 0);
  }

  /** An access between `from` and `to`: an error if a region guards the address. */
  check(address) {
    if (this.chip.core.IPSR === HARD_FAULT) return;
    for (const [begin, end] of this.guarded) if (address >= begin && address < end) this.refuse(address);
  }

  refuse(address) {
    this.chip.fault(`an access at 0x${address.toString(16)}, which the MPU guards`);
  }
}
