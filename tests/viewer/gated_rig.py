# SPDX-License-Identifier: Apache-2.0
"""A rig of 24x24 cells without noise that waits: before photograph N it needs a file gate-N, if N is one of the gates.

If the file says "fail", the rig ends with status 3.

usage: gated_rig.py FOLDER GATE...
"""

import math
import pathlib
import sys
import time
from array import array

SIDE = 24
CELLS = SIDE * SIDE
DIRECT = [0.5 + 0.2 * math.sin(0.9 * (i // SIDE)) * math.cos(0.7 * (i % SIDE)) for i in range(CELLS)]
SPOTS = ((4, 5, 20), (15, 12, 60), (20, 3, 9))
SMOOTH = [[0.06 * math.exp(-((i // SIDE - row) ** 2 + (i % SIDE - col) ** 2) / wide) for i in range(CELLS)] for row, col, wide in SPOTS]


def photograph(pattern):
    mean = [d * p for d, p in zip(DIRECT, pattern)]
    for u in SMOOTH:
        share = sum(a * p for a, p in zip(u, pattern))
        mean = [value + share * a for value, a in zip(mean, u)]
    return array("f", mean).tobytes() + array("f", [1e-10] * CELLS).tobytes() + bytes([1] * CELLS)


def main(folder, *gates):
    patterns, answers = sys.stdin.buffer, sys.stdout.buffer
    patterns.readline()
    answers.write(b"version=1 cells=%dx%d channels=1 name=gated\n" % (SIDE, SIDE))
    answers.flush()
    taken = 0
    while line := patterns.readline():
        for number in range(1, int(line.split()[1]) + 1):
            taken += 1
            gate = pathlib.Path(folder) / f"gate-{taken}"
            while str(taken) in gates and not gate.exists():
                time.sleep(0.01)
            if str(taken) in gates and gate.read_text(encoding="ascii") == "fail":
                sys.exit(3)
            record = photograph(array("f", patterns.read(4 * CELLS)))
            answers.write(b"photograph %d %d\n" % (number, len(record)) + record)
            answers.flush()


main(*sys.argv[1:])
