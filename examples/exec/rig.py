#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A rig for symrig: symrig capture --rig 'exec:python3 examples/exec/rig.py' -o scene.h5

The protocol is in docs/howto-own-rig.md. Replace photograph() by a renderer or by your devices.
usage: rig.py [SEED], of noise that repeats
"""
import math
import random
import sys
from array import array

ROWS, COLS, CHANNELS = 16, 16, 1
CELLS = ROWS * COLS
ELECTRONS, READ_NOISE = 20000, 6  # of one unit of radiance; of one exposure, rms
# T = D + sum_k u_k u_k', a symmetric matrix: direct light D, and smooth indirect light of rank 2.
DIRECT = [0.5 + 0.2 * math.sin(0.9 * (i // COLS)) * math.cos(0.7 * (i % COLS)) for i in range(CELLS)]
SMOOTH = [
    [0.06 * math.exp(-((i // COLS - row) ** 2 + (i % COLS - col) ** 2) / 40) for i in range(CELLS)]
    for row, col in ((4, 5), (11, 9))
]


def radiance(pattern):
    """T times the pattern."""
    out = [d * p for d, p in zip(DIRECT, pattern)]
    for u in SMOOTH:
        share = sum(a * p for a, p in zip(u, pattern))
        out = [value + share * a for value, a in zip(out, u)]
    return out


def photograph(pattern):
    """Mean, variance and valid of each pixel, plane by plane. The variance is that of the mean's noise."""
    mean, variance = array("f"), array("f")
    for light in radiance(pattern):
        electrons = ELECTRONS * light
        electrons += random.gauss(0, math.sqrt(electrons + READ_NOISE**2))
        mean.append(electrons / ELECTRONS)
        variance.append((max(electrons, 0) + READ_NOISE**2) / ELECTRONS**2)
    return mean.tobytes() + variance.tobytes() + bytes([1] * CELLS * CHANNELS)


def main():
    patterns, answers = sys.stdin.buffer, sys.stdout.buffer
    random.seed(int(sys.argv[1]) if len(sys.argv) > 1 else None)
    if patterns.readline() != b"symrig-exec 1\n":
        sys.exit("rig.py: this is no symrig that I know")
    answers.write(b"version=1 cells=%dx%d channels=%d name=python-example\n" % (ROWS, COLS, CHANNELS))
    answers.flush()
    while line := patterns.readline():  # ends when symrig closes its end
        for number in range(1, int(line.split()[1]) + 1):  # "measure N"
            record = photograph(array("f", patterns.read(4 * CELLS)))
            answers.write(b"photograph %d %d\n" % (number, len(record)) + record)
            answers.flush()


main()
