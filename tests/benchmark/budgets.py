#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: Apache-2.0
"""Errors of captures within a share of the photographs or seconds that they take without a budget, as ratios.

usage: tests/benchmark/budgets.py SYMRIG [SIZE]     e.g. tests/benchmark/budgets.py build/release/host/apps/symrig 64x64

Prints one Markdown table: geometric means over the scenes, with the worst scene in brackets.
"""

import json
import math
import pathlib
import subprocess
import sys
import tempfile

SHARES = (0.2, 0.35, 0.5, 0.7, 0.85)
NAMED = ("vgroove-white", "vgroove-mixed", "vgroove-textured", "gummy", "occluder", "mirror", "views2")
SEEDS = (1, 2, 4, 5, 7, 9, 11, 13, 15, 17, 19)  # of random; indirect light of 3 and 8 is almost nothing
ERRORS = ("frobenius", "indirect", "bar_indirect")


def scenes(size):
    return [f"sim:{name}?size={size}&seed=7" for name in NAMED] + [f"sim:random?size={size}&seed={seed}" for seed in SEEDS]


def captured(symrig, scene, *budget):
    """The capture's JSON with the errors of evaluate."""
    with tempfile.TemporaryDirectory() as folder:
        here = pathlib.Path(folder)
        for words in (["capture", "--rig", scene, "-o", "a.h5", "--no-log", "--json", "capture.json", *map(str, budget)],
                      ["evaluate", "a.h5", "--rig", scene, "--json", "errors.json"]):
            subprocess.run([symrig, *words], cwd=here, check=True, capture_output=True)
        result = json.loads((here / "capture.json").read_text())
        return result | {"error": json.loads((here / "errors.json").read_text())["error"]}


def mean_and_worst(ratios):
    mean = math.exp(sum(math.log(ratio) for ratio in ratios) / len(ratios))
    return f"{mean:.2f} ({max(ratios):.1f})"


def main():
    symrig = str(pathlib.Path(sys.argv[1]).resolve())
    size = sys.argv[2] if len(sys.argv) > 2 else "64x64"
    free = {scene: captured(symrig, scene) for scene in scenes(size)}
    print(f"| budget, {size} | " + " | ".join(f"`{name}`" for name in ERRORS) + " | patterns | rig seconds |")
    print("|---|" + "---|" * (len(ERRORS) + 2))
    for option, unit, key in (("--max-seconds", "rig seconds", "rig_seconds"), ("--max-patterns", "patterns", "patterns")):
        for share in SHARES:
            ratios = {name: [] for name in (*ERRORS, "patterns", "rig_seconds")}
            for scene, whole in free.items():
                limit = share * whole[key]
                bound = captured(symrig, scene, option, max(1, int(limit)) if key == "patterns" else limit)
                for name in ERRORS:
                    ratios[name].append(bound["error"][name] / whole["error"][name])
                for name in ("patterns", "rig_seconds"):
                    ratios[name].append(bound[name] / whole[name])
            print(f"| {share} of the {unit} | " + " | ".join(mean_and_worst(each) for each in ratios.values()) + " |", flush=True)


if __name__ == "__main__":
    main()
