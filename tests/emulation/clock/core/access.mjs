// SPDX-License-Identifier: Apache-2.0
// The processor's loads and stores: short ways to SRAM and flash, which are nearly all of them; everything else goes rp2040js' way.
// An address that is not a multiple of the access is a hard fault on silicon and an error here.
// What the MPU guards is looked at first. The short way to flash is closed while flash is away (`direct` false): then each access takes the guarded way. Flash is read through
// its cache, which takes its time.

const RAM = 0x20000000;
const RAM_BYTES = 0x42000;
const FLASH = 0x10000000;
const FLASH_BYTES = 0x1000000;

const inRam = (address) => address >= RAM && address < RAM + RAM_BYTES;
const inFlash = (address) => address >= FLASH && address < FLASH + FLASH_BYTES;

export function installAccess(chip, rp2040) {
  const state = { direct: true };
  installLoads(chip, rp2040, state);
  installStores(chip, rp2040);
  return state;
}

const misaligned = (chip, kind, address) => chip.fault(`a ${kind} at 0x${address.toString(16)}, which is not aligned`);

function installLoads(chip, rp2040, state) {
  const { core, sramView, sram } = rp2040;
  const { xip, mpu } = chip;
  core.readUint16 = (address) => {
    address >>>= 0;
    if (address >= mpu.from && address < mpu.to) mpu.check(address);
    if (address & 1) return misaligned(chip, 'halfword load', address);
    if (inRam(address)) return sramView.getUint16(address - RAM, true);
    if (inFlash(address)) xip.access(address);
    if (state.direct && inFlash(address)) return rp2040.flashView.getUint16(address - FLASH, true);
    return rp2040.readUint16(address);
  };
  core.readUint32 = (address) => {
    address >>>= 0;
    if (address >= mpu.from && address < mpu.to) mpu.check(address);
    if (address & 3) return misaligned(chip, 'word load', address);
    if (inRam(address)) return sramView.getUint32(address - RAM, true);
    if (inFlash(address)) xip.access(address);
    if (state.direct && inFlash(address)) return rp2040.flashView.getUint32(address - FLASH, true);
    return rp2040.readUint32(address);
  };
  core.readUint8 = (address) => {
    address >>>= 0;
    if (address >= mpu.from && address < mpu.to) mpu.check(address);
    if (inRam(address)) return sram[address - RAM];
    if (inFlash(address)) xip.access(address);
    return rp2040.readUint8(address);
  };
}

function installStores(chip, rp2040) {
  const { core, sramView, sram } = rp2040;
  const { mpu } = chip;
  core.writeUint32 = (address, value) => {
    address >>>= 0;
    if (address >= mpu.from && address < mpu.to) mpu.check(address);
    if (address & 3) return misaligned(chip, 'word store', address);
    if (inRam(address)) return sramView.setUint32(address - RAM, value, true);
    return rp2040.writeUint32(address, value);
  };
  core.writeUint16 = (address, value) => {
    address >>>= 0;
    if (address >= mpu.from && address < mpu.to) mpu.check(address);
    if (address & 1) return misaligned(chip, 'halfword store', address);
    if (inRam(address)) return sramView.setUint16(address - RAM, value, true);
    return rp2040.writeUint16(address, value);
  };
  core.writeUint8 = (address, value) => {
    address >>>= 0;
    if (address >= mpu.from && address < mpu.to) mpu.check(address);
    if (!inRam(address)) return rp2040.writeUint8(address, value);
    sram[address - RAM] = value;
    return undefined;
  };
}
