#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: Apache-2.0
"""usage: many_lights.py SYMRIG [ROWSxCOLUMNS [LIGHTS]]

Milliseconds a light and channel of `symrig relight --lights`, from a film of lights to each kind of output, and of one call
for each light. A captured scene of three channels; a new process each time, so start-up and reading the scene count.
A difference of two numbers of lights takes them out again."""

import pathlib
import random
import subprocess
import sys
import tempfile
import time


def film(path, rows, cols, count):
    """Random spots of light, codes of full range."""
    draw = random.Random(1)
    with open(path, "wb") as file:
        file.write(b"YUV4MPEG2 W%d H%d F25:1 Ip Cmono XCOLORRANGE=FULL\n" % (cols, rows))
        for _ in range(count):
            frame = bytearray(rows * cols)
            for _ in range(20):
                row, col = draw.randrange(rows), draw.randrange(cols)
                width = min(draw.randrange(1, 1 + cols // 4), cols - col)
                for r in range(row, min(row + rows // 8, rows)):
                    frame[r * cols + col : r * cols + col + width] = bytes([draw.randrange(256)]) * width
            file.write(b"FRAME\n" + frame)


def main():
    symrig = pathlib.Path(sys.argv[1]).resolve()
    size = sys.argv[2] if len(sys.argv) > 2 else "310x350"
    lights = int(sys.argv[3]) if len(sys.argv) > 3 else 1000
    rows, cols = map(int, size.split("x"))
    with tempfile.TemporaryDirectory() as folder:

        def seconds(*words):
            begun = time.monotonic()
            subprocess.run([symrig, *words], cwd=folder, check=True, stdout=subprocess.DEVNULL)
            return time.monotonic() - begun

        uri = f"sim:vgroove-textured?size={size}&channels=3"
        seconds("capture", "--rig", uri, "-o", "scene.h5", "--no-log")
        few = max(lights // 10, 1)
        film(f"{folder}/few.y4m", rows, cols, few)
        film(f"{folder}/all.y4m", rows, cols, lights)
        print(f"{'output':16}{'lights':>8}{'seconds':>10}{'ms a light and channel':>26}")
        for name, output, more in [("film", "out{}.y4m", []), *[(f"folder of {f}", "out-{}-" + f, ["--format", f]) for f in ("pfm", "exr", "png")]]:
            base = seconds("relight", "scene.h5", "--lights", "few.y4m", "-o", output.format("few"), *more)
            whole = seconds("relight", "scene.h5", "--lights", "all.y4m", "-o", output.format("all"), *more)
            print(f"{name:16}{lights:8}{whole:10.2f}{1000 * (whole - base) / (lights - few) / 3:26.3f}", flush=True)
        alone = sum(seconds("relight", "scene.h5", "--light", "natural", "-o", "one.pfm") for _ in range(5)) / 5
        print(f"{'one call each':16}{1:8}{alone:10.2f}{1000 * alone / 3:26.3f}")


if __name__ == "__main__":
    main()
