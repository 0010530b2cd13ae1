#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: Apache-2.0
"""What captures with a target error take, and what a search with the usual tolerance takes that stops when it is reached.

usage: tests/benchmark/targets.py SYMRIG [SIZE]     e.g. tests/benchmark/targets.py build/release/host/apps/symrig 64x64

Prints one Markdown table: geometric means over the scenes, and how often the target was reached.
"""

import math
import pathlib
import sys

from budgets import captured

TARGETS = (0.1, 0.05, 0.02, 0.01, 0.005)
NAMED = ("vgroove-white", "vgroove-textured", "gummy", "occluder", "mirror", "views2", "views3")
SEEDS = range(1, 21)  # of random


def scenes(size):
    return [f"sim:{name}?size={size}&seed=7" for name in NAMED] + [f"sim:random?size={size}&seed={seed}" for seed in SEEDS]


def mean(values):
    return math.exp(sum(math.log(value) for value in values) / len(values))


def stated(capture):
    return capture["estimated_error"]["frobenius"] + capture["estimated_error_uncertainty"]["frobenius"]


def row(target, way, captures):
    reached = sum(stated(one) <= target for one in captures)
    true = sum(one["error"]["frobenius"] <= target for one in captures)
    cells = [f"{mean([one['patterns'] for one in captures]):.0f}", f"{mean([one['rig_seconds'] for one in captures]):.1f}"]
    cells += [f"{mean([one['error'][name] for one in captures]):.4f}" for name in ("frobenius", "indirect", "bar_indirect")]
    return f"| {target} | {way} | " + " | ".join(cells) + f" | {reached} of {len(captures)} | {true} of {len(captures)} |"


def main():
    symrig = str(pathlib.Path(sys.argv[1]).resolve())
    size = sys.argv[2] if len(sys.argv) > 2 else "64x64"
    print(f"| target, {size} | tolerance | patterns | rig seconds | `frobenius` | `indirect` | `bar_indirect` | stated below | true below |")
    print("|---|---|---|---|---|---|---|---|---|")
    for target in TARGETS:
        for way, words in (("usual", ("--tolerance", 3e-4)), ("chosen", ())):
            print(row(target, way, [captured(symrig, scene, "--target-error", target, *words) for scene in scenes(size)]), flush=True)


if __name__ == "__main__":
    main()
