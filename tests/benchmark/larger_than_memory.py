#!/usr/bin/python3 -B
# SPDX-License-Identifier: Apache-2.0
"""usage: larger_than_memory.py SYMRIG [GIB [FOLDER]]

Applies a tensor that stays in its file: `symrig relight --lights --memory 1G` with a film of 16 lights, on a made-up
scene of so many GiB of factors (default 4), against a plain read of the same file. The page cache is emptied before
each of both, which needs root. Prints both speeds, their ratio, and the largest memory of the process."""

import os
import pathlib
import subprocess
import sys
import tempfile
import time

import h5py
import numpy

ROWS = COLS = 512  # a power of two: a block of level l is a run of 4^(9 - l) pixels
LEVEL = 5  # of the leaves: blocks of 256 pixels
LEAVES = 1 << 14  # written together


def head(symrig, folder):
    """A scene of that grid, whose leaves are replaced."""
    rig = f"sim:plane?size={ROWS}x{COLS}&noise=off"
    subprocess.run([symrig, "capture", "--rig", rig, "-o", folder / "large.h5", "--no-log"], check=True, stdout=subprocess.DEVNULL)


def fill(path, gib):
    """Leaves of rank 1 between random pairs of blocks, each its own factors."""
    draw = numpy.random.default_rng(1)
    pixels = 4 ** (9 - LEVEL)
    count = int(gib * 2**30 / (2 * 2 * pixels))
    with h5py.File(path, "r+", libver="latest") as file:
        leaves = file["leaves"]
        kinds = {"range": (numpy.int32, (count, 4)), "rank": (numpy.int32, (count,)), "level": (numpy.int32, (count,)),
                 "factors": (numpy.float16, (count * 2 * pixels,)), "exponents": (numpy.int32, (2 * count,))}
        for name, (kind, shape) in kinds.items():
            del leaves[name]
            leaves.create_dataset(name, shape, kind, chunks=(1 << 20,) if len(shape) == 1 else (1 << 18, 4), fletcher32=True)
        for first in range(0, count, LEAVES):
            last = min(first + LEAVES, count)
            row = draw.integers(1, 4**LEVEL, last - first)
            col = (row * draw.random(last - first)).astype(numpy.int64)
            leaves["range"][first:last] = numpy.stack([row * pixels, (row + 1) * pixels, col * pixels, (col + 1) * pixels], 1)
            leaves["rank"][first:last] = 1
            leaves["level"][first:last] = LEVEL
            # The bits of half-precision numbers from 1 to 2, evenly: ten times as fast as to draw and round them.
            bits = draw.integers(0x3C00, 0x4000, (last - first) * 2 * pixels, numpy.uint16)
            leaves["factors"][first * 2 * pixels : last * 2 * pixels] = bits.view(numpy.float16)
            leaves["exponents"][2 * first : 2 * last] = -12
    return count


def film(path):
    draw = numpy.random.default_rng(2)
    with open(path, "wb") as file:
        file.write(b"YUV4MPEG2 W%d H%d F25:1 Ip Cmono XCOLORRANGE=FULL\n" % (COLS, ROWS))
        for _ in range(16):
            file.write(b"FRAME\n" + draw.integers(0, 256, ROWS * COLS, numpy.uint8).tobytes())


def cold():
    os.sync()
    pathlib.Path("/proc/sys/vm/drop_caches").write_text("3\n")


def read_seconds(path):
    cold()
    begun = time.monotonic()
    with open(path, "rb", buffering=0) as file:
        while file.read(32 << 20):
            pass
    return time.monotonic() - begun


def main():
    symrig = pathlib.Path(sys.argv[1]).resolve()
    gib = float(sys.argv[2]) if len(sys.argv) > 2 else 4
    with tempfile.TemporaryDirectory(dir=sys.argv[3] if len(sys.argv) > 3 else None) as name:
        folder = pathlib.Path(name)
        head(symrig, folder)
        path = folder / "large.h5"
        leaves = fill(path, gib)
        film(folder / "lights.y4m")
        size = path.stat().st_size
        print(f"{leaves} leaves, {size / 2**30:.2f} GiB", flush=True)
        for _ in range(3):
            disk = size / read_seconds(path) / 2**20
            cold()
            begun = time.monotonic()
            command = [symrig, "relight", "large.h5", "--lights", "lights.y4m", "-o", "out.y4m", "--exposure", "1", "--memory", "1G"]
            process = subprocess.Popen(command, cwd=folder, stdout=subprocess.DEVNULL)
            _, status, used = os.wait4(process.pid, 0)
            if status != 0:
                sys.exit(f"relight ended with status {status}")
            speed = size / (time.monotonic() - begun) / 2**20
            (folder / "out.y4m").unlink()
            print(f"disk {disk:.0f} MiB/s, 16 lights {speed:.0f} MiB/s: {speed / disk:.2f} of the disk; "
                  f"{used.ru_maxrss / 2**10:.0f} MiB of memory", flush=True)


if __name__ == "__main__":
    main()
