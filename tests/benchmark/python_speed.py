# SPDX-License-Identifier: Apache-2.0
"""What Python adds to the library: to relighting, to a photograph of a Probe, and to an inversion.

usage: PYTHONPATH=build/release/host/python python3 tests/benchmark/python_speed.py scene.h5 [--grid 64x64]

Prints seconds, and beside them whether the answers are the same. The library's own seconds are measured in the same run.
"""

import argparse
import hashlib
import pathlib
import tempfile
import time

import numpy as np
from scipy.sparse.linalg import lsqr

import symrig


def best(work, seconds=3.0):
    """The shortest of many runs: other programs of the machine only add to it."""
    shortest, begin = float("inf"), time.perf_counter()
    while time.perf_counter() - begin < seconds:
        start = time.perf_counter()
        work()
        shortest = min(shortest, time.perf_counter() - start)
    return shortest


def relighting(path, rounds=400):
    """`scene @ light` against the call of the library inside it, in turns, because other programs take turns too."""
    scene = symrig.load(path)
    light = np.ascontiguousarray(symrig.light("natural", scene.light_shape))
    flat = light.ravel()
    ways = {"library": lambda: None, "scene @ light": lambda: scene @ light, "flat": lambda: scene @ flat}
    seconds = {way: [] for way in ways}
    for _ in range(rounds):
        seconds["library"].append(scene._stored.seconds_of_apply(light, 1))
        for way in list(ways)[1:]:
            start = time.perf_counter()
            ways[way]()
            seconds[way].append(time.perf_counter() - start)
    least = {way: min(values) for way, values in seconds.items()}
    middle = {way: float(np.median(values)) for way, values in seconds.items()}
    conversion = best(lambda: symrig.gray(light), 1.0)
    for way in ways:
        print(f"apply {scene.light_shape}, {way}: least {1e3 * least[way]:.3f} ms ({100 * (least[way] / least['library'] - 1):+.1f} %), "
              f"median {1e3 * middle[way]:.3f} ms ({100 * (middle[way] / middle['library'] - 1):+.1f} %)")
    print(f"both conversions and a pass over the picture: {1e3 * conversion:.3f} ms ({100 * conversion / least['library']:.1f} %)")


def planes(grid):
    """Two planes that light each other; small integers, so photographs are exact in any order of sums."""
    noise = np.random.default_rng(3)
    y, x = np.divmod(np.arange(grid[0] * grid[1], dtype=np.float32), np.float32(grid[1]))
    distance = (y[:, None] - y) ** 2 + (x[:, None] - x) ** 2
    facing = (x < grid[1] / 2)[:, None] != (x < grid[1] / 2)
    t = np.where(facing, np.floor(400 / (20 + distance)), np.float32(0)).astype(np.float32)
    np.fill_diagonal(t, noise.integers(40, 400, len(x)))
    return t


class Passed(symrig.Probe):
    """The library's rig, through Python. Counts the seconds inside the library."""

    def __init__(self, rig):
        self.rig, self.grid, self.inside, self.seen = rig, rig.grid, 0.0, hashlib.sha256()

    def measure(self, patterns):
        for pattern in patterns:
            self.seen.update(pattern)
        start = time.perf_counter()
        photographs = self.rig.measure(patterns)
        self.inside += time.perf_counter() - start
        return photographs


class Nothing(symrig.Probe):
    """Answers at once, so that a call costs what Python adds."""

    def __init__(self, grid):
        self.grid = grid

    def measure(self, patterns):
        return patterns


def capturing(grid):
    """The same matrix as a rig of the library and as one of Python; then the seconds of a call that does nothing."""
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "T.npy"
        np.save(path, planes(grid))
        name = f"dense:{path}?grid={grid[0]}x{grid[1]}"
        start = time.perf_counter()
        direct = symrig.capture(name, polish=0)
        library = time.perf_counter() - start
        with symrig.open_rig(name) as rig:
            probe = Passed(rig)
            start = time.perf_counter()
            python = symrig.capture(probe, polish=0)
            whole = time.perf_counter() - start
    light = np.random.default_rng(1).random((*grid, 16))
    same = np.array_equal(direct @ light, python @ light) and direct.levels == python.levels
    patterns = direct.facts["patterns"]
    rig = symrig._symrig.rig_of_probe(Nothing(grid))
    one = np.zeros((1, *grid), np.float32)
    call = best(lambda: rig.measure(one))
    print(f"capture {grid}: {patterns} photographs, same patterns {python.facts['patterns'] == patterns}, same tensor {same}; "
          f"library {library:.2f} s, Python {whole:.2f} s; a call of measure() and back {1e3 * call:.4f} ms a photograph")


def inverting(size):
    scene = symrig.capture(f"sim:vgroove-textured?size={size}x{size}")
    wanted = (0.2 * symrig.light("letters", scene.photo_shape) + 0.02).ravel()
    start = time.perf_counter()
    light, reason, iterations, norm = lsqr(scene, wanted, atol=1e-5, btol=1e-5, iter_lim=2000)[:4]
    seconds = time.perf_counter() - start
    residual = np.linalg.norm(scene @ light - wanted)
    print(f"lsqr {size}x{size}: {seconds:.2f} s, {iterations} iterations, reason {reason}; residual by lsqr {norm:.6g}, "
          f"by apply {residual:.6g} of {np.linalg.norm(wanted):.6g}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene")
    parser.add_argument("--grid", default="64x64")
    arguments = parser.parse_args()
    relighting(arguments.scene)
    capturing(tuple(int(size) for size in arguments.grid.split("x")))
    inverting(128)


if __name__ == "__main__":
    main()
