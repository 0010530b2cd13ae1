// SPDX-License-Identifier: Apache-2.0
// UF2 files as the RP2040's ROM takes them: 512-byte blocks of 256 bytes for one flash address each.

const MAGIC = [0x0a324655, 0x9e5d5157, 0x0ab16f30];
const FAMILY_RP2040 = 0xe48bff56;
const FAMILY_PRESENT = 0x2000;
const BLOCK = 512;
const PAYLOAD = 256;
const FLASH = 0x10000000;

function checkBlock(file, at, blocks) {
  const word = (offset) => file.readUInt32LE(at + offset);
  const bad = (what) => new Error(`UF2 block ${at / BLOCK}: ${what}`);
  if (word(0) !== MAGIC[0] || word(4) !== MAGIC[1] || word(508) !== MAGIC[2]) throw bad('wrong magic number');
  if (!(word(8) & FAMILY_PRESENT) || word(28) !== FAMILY_RP2040) throw bad('not for the RP2040 family (0xe48bff56)');
  if (word(16) !== PAYLOAD) throw bad(`${word(16)} bytes of payload; the ROM takes ${PAYLOAD}`);
  if (word(12) % PAYLOAD !== 0) throw bad('address is not a multiple of 256');
  if (word(20) !== at / BLOCK || word(24) !== blocks) throw bad(`says it is ${word(20)} of ${word(24)}, is ${at / BLOCK} of ${blocks}`);
  return word(12);
}

/** [{offset, data}] of a UF2 file, offsets from the begin of flash. Throws with the block and the reason. */
export function readUf2(file) {
  if (file.length === 0 || file.length % BLOCK !== 0) throw new Error(`UF2 file of ${file.length} bytes is not made of 512-byte blocks`);
  const pages = [];
  for (let at = 0; at < file.length; at += BLOCK) {
    const address = checkBlock(file, at, file.length / BLOCK);
    if (address < FLASH || address >= FLASH + (16 << 20)) throw new Error(`UF2 block ${at / BLOCK}: address 0x${address.toString(16)} is not in flash`);
    pages.push({ offset: address - FLASH, data: file.subarray(at + 32, at + 32 + PAYLOAD) });
  }
  return pages;
}

/** A UF2 file from a flash image that begins at 0x10000000. */
export function writeUf2(image) {
  const blocks = Math.ceil(image.length / PAYLOAD);
  const file = Buffer.alloc(blocks * BLOCK);
  for (let i = 0; i < blocks; i++) {
    const at = i * BLOCK;
    const head = [MAGIC[0], MAGIC[1], FAMILY_PRESENT, FLASH + i * PAYLOAD, PAYLOAD, i, blocks, FAMILY_RP2040];
    head.forEach((word, k) => file.writeUInt32LE(word, at + 4 * k));
    image.copy(file, at + 32, i * PAYLOAD, Math.min(image.length, (i + 1) * PAYLOAD));
    file.writeUInt32LE(MAGIC[2], at + 508);
  }
  return file;
}
