// SPDX-License-Identifier: Apache-2.0
// The second stage that the ROM loads: 252 bytes and their CRC-32 (polynomial 0x04c11db7, start all ones, nothing reflected,
// no final xor; RP2040 data sheet, 2.8.1.3.1).

const STAGE = 256;

export function crc32(bytes) {
  let crc = 0xffffffff;
  for (const byte of bytes) {
    crc = (crc ^ (byte << 24)) >>> 0;
    for (let bit = 0; bit < 8; bit++) crc = (crc & 0x80000000 ? (crc << 1) ^ 0x04c11db7 : crc << 1) >>> 0;
  }
  return crc;
}

export function boot2IsSound(flash) {
  const stage = Buffer.from(flash.buffer, flash.byteOffset, STAGE);
  return crc32(stage.subarray(0, STAGE - 4)) === stage.readUInt32LE(STAGE - 4);
}

/** Writes the CRC of an image's second stage into it. */
export function sealBoot2(image) {
  image.writeUInt32LE(crc32(image.subarray(0, STAGE - 4)), STAGE - 4);
  return image;
}
