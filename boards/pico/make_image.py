#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: Apache-2.0
"""Makes the files that users flash from the linked program.

usage: boards/pico/make_image.py FLAT.bin RECORD.json OUT.uf2 OUT.json

FLAT.bin is the flash from its first byte (objcopy -O binary). Inserts boot2's CRC, which the boot ROM requires. Writes
the UF2 and the manifest: the image's own data, sizes, hashes and the board's capability record.
"""

import hashlib
import json
import pathlib
import struct
import sys

FLASH = 0x10000000
FAMILY_RP2040 = 0xE48BFF56
BOOT2 = 252
MANIFEST = 0x1C0
PAYLOAD = 256


def crc32_mpeg(data):
    """Polynomial 04c11db7, first bit first, begins with all ones, not inverted: the boot ROM's."""
    crc = 0xFFFFFFFF
    for byte in data:
        crc ^= byte << 24
        for _ in range(8):
            crc = ((crc << 1) ^ (0x04C11DB7 if crc & 0x80000000 else 0)) & 0xFFFFFFFF
    return crc


def with_boot2_crc(flat):
    return flat[:BOOT2] + struct.pack("<I", crc32_mpeg(flat[:BOOT2])) + flat[BOOT2 + 4 :]


def uf2(flat):
    """https://github.com/microsoft/uf2: blocks of 512 bytes, each with 256 of payload and its address."""
    pages = [flat[i : i + PAYLOAD].ljust(PAYLOAD, b"\0") for i in range(0, len(flat), PAYLOAD)]
    blocks = []
    for number, page in enumerate(pages):
        head = struct.pack(
            "<8I", 0x0A324655, 0x9E5D5157, 0x2000, FLASH + number * PAYLOAD, PAYLOAD, number, len(pages), FAMILY_RP2040
        )
        blocks.append((head + page).ljust(508, b"\0") + struct.pack("<I", 0x0AB16F30))
    return b"".join(blocks)


def read_manifest(flat):
    magic, layout, _, firmware_hash, board, version = struct.unpack_from("<8sIIQ16s16s", flat, MANIFEST)
    if magic != b"SYMRIGFW" or layout != 1:
        sys.exit("make_image.py: the image has no manifest at its place: link.ld must put .manifest after .vectors")
    text = [field.split(b"\0", 1)[0].decode() for field in (board, version)]
    return {"board": text[0], "version": text[1], "firmware_hash": f"{firmware_hash:016x}"}


def main(arguments):
    if len(arguments) != 4:
        sys.exit(__doc__)
    flat_path, record_path, uf2_path, json_path = map(pathlib.Path, arguments)
    flat = with_boot2_crc(flat_path.read_bytes())
    record = json.loads(record_path.read_text(encoding="utf-8"))
    image = uf2(flat)
    manifest = {
        **read_manifest(flat),
        "image": uf2_path.name,
        "bytes": len(image),
        "sha256": hashlib.sha256(image).hexdigest(),
        "flash_bytes": len(flat),
        "flash_sha256": hashlib.sha256(flat).hexdigest(),
        "capabilities": record["capabilities"],
        "lines": record["lines"],
    }
    uf2_path.write_bytes(image)
    json_path.write_text(json.dumps(manifest, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
