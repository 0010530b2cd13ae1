// SPDX-License-Identifier: Apache-2.0
// Short ways for the processor to SRAM and flash, which are nearly all of its accesses; everything else goes rp2040js' way.
// They are switched off while flash is away (`direct` false): then each access takes the guarded way.

const RAM = 0x20000000;
const RAM_BYTES = 0x42000;
const FLASH = 0x10000000;
const FLASH_BYTES = 0x1000000;

export function installFastMemory(rp2040) {
  const { core, sramView, sram } = rp2040;
  const state = { direct: true };
  core.readUint16 = (address) => {
    if (state.direct && address >= FLASH && address < FLASH + FLASH_BYTES - 1) return rp2040.flashView.getUint16(address - FLASH, true);
    if (address >= RAM && address < RAM + RAM_BYTES - 1) return sramView.getUint16(address - RAM, true);
    return rp2040.readUint16(address);
  };
  core.readUint32 = (address) => {
    address >>>= 0;
    if (address >= RAM && address < RAM + RAM_BYTES - 3 && (address & 3) === 0) return sramView.getUint32(address - RAM, true);
    if (state.direct && address >= FLASH && address < FLASH + FLASH_BYTES - 3 && (address & 3) === 0) return rp2040.flashView.getUint32(address - FLASH, true);
    return rp2040.readUint32(address);
  };
  core.readUint8 = (address) => {
    if (address >= RAM && address < RAM + RAM_BYTES) return sram[address - RAM];
    return rp2040.readUint8(address);
  };
  core.writeUint32 = (address, value) => {
    address >>>= 0;
    if (address >= RAM && address < RAM + RAM_BYTES - 3 && (address & 3) === 0) sramView.setUint32(address - RAM, value, true);
    else rp2040.writeUint32(address, value);
  };
  return state;
}
