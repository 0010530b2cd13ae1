#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes the seeds of the fuzz targets: by hand, and from the golden vectors of the wire.

usage: make_seeds.py --list FILE    writes a line a seed: target, name, bytes in hexadecimal
       make_seeds.py --unpack DIR   writes each seed to DIR/fuzz_TARGET/NAME, and prints the targets
"""

import pathlib
import struct
import sys

WIRE = pathlib.Path(__file__).resolve().parents[1] / "golden" / "wire"
SEEDS = []


def vectors(name):
    return [line.split() for line in (WIRE / name).read_text().splitlines() if line and line[0] != "#"]


def write(target, name, data):
    SEEDS.append((target, name, data))


def unhex(text):
    return b"" if text == "-" else bytes.fromhex(text)


for name, *_, wire in vectors("frames.txt"):
    write("frame", name, unhex(wire))
for name, body in vectors("messages.txt"):
    write("messages", name, unhex(body))
for name, program, _ in vectors("programs.txt"):
    write("program", name, b"\0" + unhex(program))


def record(op, arg, ticks):
    return struct.pack("<II", op << 28 | arg, ticks)


write("program", "lamp", b"\x0f" + record(2, 5, 0) + record(1, 4, 20) + record(1, 0, 40) + record(3, 0, 0)
      + record(6, 4, 0))
write("program", "waits", b"\0" + record(5, 1, 0) + record(4, 3 | 2 << 5, 300) + record(1, 1, 9)
      + record(4, 4 | 1 << 7, 50) + record(6, 1, 0))

KEEP_ALIVE, ARM, START = bytes([6, 200]), bytes([7]), bytes([8])


def upload(*records, final=0):
    return bytes([5, len(records)]) + b"".join(bytes(r) for r in records) + bytes([final])


WORD = 0x80
run = upload((0, 10), (0x40, 7), (WORD | 4, 100), (WORD | 2, 50), (WORD, 80), (0x20, 0), final=2) + KEEP_ALIVE + ARM + START
write("board", "run", run + bytes([3, 14]))
write("board", "abort", run + bytes([11, 60, 10, 1, 3, 14]))
write("board", "host_lost", run.replace(KEEP_ALIVE, bytes([6, 1])) + bytes([3, 23, 10, 3 + 5 * 5]))
write("board", "wait", upload((0x60, 200), (WORD | 4, 40), final=2) + KEEP_ALIVE + ARM + START
      + bytes([11, 50, 4, 3, 3, 12]))
write("board", "power_cycle", run + bytes([11, 9, 10, 2, 9, 3, 10]))
write("board", "detach", run + bytes([11, 9, 10, 0, 3, 10, 10, 5]))
write("board", "interlock", run + bytes([11, 60, 4, 5, 3, 10, 4, 2, 10, 3 + 5 * 9, 13, 5]))
write("board", "by_hand", KEEP_ALIVE + bytes([12, 0x47, 11, 100, 12, 4, 12, 0x44, 3, 12, 10, 3 + 5 * 2]))
write("board", "stored", bytes([13, 0, 13, 13, 3, 23, 9, 13, 5, 13, 2]) + run + bytes([13, 3, 13, 16]))
write("board", "bootloader", bytes([13, 1, 3, 23, 9, 10, 2, 9]))
write("board", "stall", run + bytes([11, 20, 10, 4 + 5 * 27, 3, 23, 3, 23, 3, 23, 3, 23, 9]))
write("board", "later", upload((WORD | 4, 100), final=2) + KEEP_ALIVE + ARM + bytes([14, 2, 0, 3, 14]))
write("board", "verify", upload((WORD | 4, 100), final=2) + bytes([13, 3, 13, 16, 13, 22]))
write("board", "noise", bytes([0, 40]) + bytes(range(1, 41)) + bytes([1, 6, 0x0A, 2, 8, 1, 0x62, 0]) + run)

# each kind of message behind its field number
for name, body in vectors("messages.txt"):
    data = unhex(body)
    if name.startswith("request.") and len(data) > 2 and data[0] & 7 == 2 and data[1] < 128:
        write("messages", "inner." + name.split(".")[1], bytes([data[0] >> 3]) + data[2:])

# frames at the link: what % 8 = kind, >> 3 flags; number + 3; body; ack; credit
write("link", "session", bytes([5, 0x60, 3, 1, 0, 8]) + bytes([6, 0, 3, 4, 0, 8]) * 3 + bytes([7, 3, 3, 0, 0, 8]) * 4)
write("link", "urgent", bytes([5, 0x60, 3, 1, 0, 8]) + bytes([6, 0xA0, 9, 0, 0, 0]) * 2 + bytes([0, 3, 1, 2, 0]))
write("link", "events", bytes([5, 0x60, 3, 1, 0, 8]) + bytes([2, 2, 2, 2, 3, 1, 0, 5, 4, 3, 2, 9, 5, 5, 3, 1, 9]))
write("link", "later", bytes([5, 0x60, 3, 1, 0, 8]) + bytes([6, 0, 3, 3, 0, 8, 6, 0, 3, 4, 0, 8, 4, 6, 0, 3, 4, 0, 8]))
write("link", "noise", bytes([0, 30]) + bytes(range(1, 31)))
for name, *_, wire in vectors("frames.txt"):
    data = unhex(wire)
    if len(data) < 200:
        write("link", "raw_" + name, bytes([0, len(data)]) + data)

write("settings", "empty", b"SRC1" + b"lab".ljust(24, b"\0") + bytes(4))
write("settings", "two_lines", b"SRC1" + b"rig".ljust(24, b"\0") + bytes([2, 0, 0, 0])
      + struct.pack("<BBBBBBHQQ", 1, 1, 2, 0, 1, 0, 0, 0, 0) + struct.pack("<BBBBBBHQQ", 5, 0, 6, 0, 0, 2, 0, 0, 0))

# queue - 2, refill - 1, poll (2), latency, records, records
write("refill", "short_words", bytes([14, 7, 0, 20, 50, 6, 4, 40]) + bytes([WORD | 1, 8, WORD, 8, 0x20, 0, WORD, 200, 0x40, 1, WORD, 9]))
write("refill", "waits", bytes([60, 3, 0, 90, 120, 4, 3, 100, 0x60, 30, WORD, 12, 0x20, 0, 0, 3, 0, 9]))
write("refill", "marks", bytes([6, 1, 0, 3, 9, 5, 9, 90, 0x40, 1, 0x40, 2, WORD, 7, 0x20, 0]))
write("refill", "nested", bytes([30, 9, 0, 100, 9, 9, 4, 9, 3, 8, 2, 7, WORD, 30, 0x20, 0, WORD, 11, 0x20, 0, WORD, 10, 0x20, 0]))

# one byte a host frame, then what it needs; the program between
write("reply", "honest", bytes([0] * 9 + [12]) + bytes([4, 9, WORD | 1, 20, 0x40, 1, WORD, 20, 0x20, 0]) + bytes(60))
write("reply", "spoilt", bytes([7, 3, 1, 0xFF, 2, 0x80, 3, 9, 5, 7] * 9))
write("reply", "forged", bytes([1, 4, 8, 3, 0x18, 5] * 12))
write("reply", "noise", bytes([2, 9, 0, 1, 2, 3, 4, 5, 6, 7, 0, 3, 4, 9, 5, 6, 0x0A, 2, 8, 1, 0, 0] * 6))
write("reply", "code_unknown", unhex("020900010201000007020801000000000000000001040803031805010408031805010408031805010408031805010408031805010408031805010408031805010408f803"))
write("reply", "mute", bytes([0, 0, 6, 0, 6, 0, 0, 0, 6, 6, 0, 0, 0]))

# First byte: which settings; then for each of the driver's answers how much of it is changed, where, and into what.
write("camera", "honest", bytes(8))
write("camera", "binned", bytes([7]) + bytes(8))
write("camera", "format", bytes([1]) + bytes(5) + bytes([1, 8, 0xFF, 1, 12, 0x80, 1, 16, 1]))
write("camera", "buffers", bytes([4]) + bytes(20) + bytes([1, 0, 9, 1, 8, 0xFF, 2, 4, 0x40, 64, 0x7F]))
write("camera", "noise", bytes((k * 89 + 3) % 256 for k in range(200)))


def change(at, size, number):
    return struct.pack("<HBQ", at, size - 1, number)


for file, name in enumerate(("new_matrix", "old_matrix", "matlab")):
    write("hdf5", name, bytes([file]))
write("hdf5", "new_scene", bytes([3]) + change(60, 2, 3))
write("hdf5", "old_scene", bytes([4]) + change(96, 8, 2**64 - 1) + change(200, 4, 7))


def put_list(path):
    pathlib.Path(path).write_text("".join(f"{target} {name} {data.hex() or '-'}\n" for target, name, data in SEEDS), encoding="utf-8")


def unpack(folder):
    for target, name, data in SEEDS:
        place = pathlib.Path(folder) / f"fuzz_{target}"
        place.mkdir(parents=True, exist_ok=True)
        (place / name).write_bytes(data)
    print("\n".join(sorted({f"fuzz_{target}" for target, _, _ in SEEDS})))


DO = {"--list": put_list, "--unpack": unpack}
if len(sys.argv) != 3 or sys.argv[1] not in DO:
    sys.exit(__doc__)
DO[sys.argv[1]](sys.argv[2])
