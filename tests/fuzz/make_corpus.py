#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes the seeds of the fuzz targets from the golden vectors. Run it when the vectors have grown."""
import pathlib
import struct

HERE = pathlib.Path(__file__).resolve().parent
WIRE = HERE.parent / "golden" / "wire"


def vectors(name):
    return [line.split() for line in (WIRE / name).read_text().splitlines() if line and line[0] != "#"]


def write(target, name, data):
    folder = HERE / "corpus" / target
    folder.mkdir(parents=True, exist_ok=True)
    (folder / name).write_bytes(data)


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
run = upload((0, 10), (0x40, 7), (WORD | 4, 100), (WORD | 2, 50), (0x20, 0), final=2) + KEEP_ALIVE + ARM + START
write("board", "run", run + bytes([3, 14]))
write("board", "abort", run + bytes([11, 60, 10, 1, 3, 14]))
write("board", "host_lost", run.replace(KEEP_ALIVE, bytes([6, 1])) + bytes([3, 23, 10, 3 + 4 * 5]))
write("board", "wait", upload((0x60, 200), (WORD | 4, 40), final=2) + KEEP_ALIVE + ARM + START
      + bytes([11, 50, 4, 0, 1, 3, 12]))
write("board", "reboot", run + bytes([11, 9, 10, 2, 9, 3, 10]))
write("board", "detach", run + bytes([11, 9, 10, 0, 3, 10, 10, 4]))
write("board", "noise", bytes([0, 40]) + bytes(range(1, 41)) + bytes([1, 6, 0x0A, 2, 8, 1, 0x62, 0]) + run)
