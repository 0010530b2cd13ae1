#!/usr/bin/python3 -B
# SPDX-License-Identifier: Apache-2.0
"""Fits what a capture takes to grids, tolerances and numbers of views: the tables of docs/scale.md.

usage: tests/benchmark/scale.py SYMRIG FOLDER [--predict ROWSxCOLUMNS,VIEWS,TOLERANCE ...]

FOLDER keeps the numbers of each capture (JSON), so a run that was interrupted goes on. Needs 2 GB of memory and 10 GB of disk.
A power law y = c N^n t^k V^v is fitted to the logarithms: N pixels of all views, t the tolerance over 3e-4, V views.
"""

import argparse
import json
import pathlib
import re
import resource
import subprocess
import sys

import numpy as np

USUAL = 3e-4
GRIDS = ((64, 64), (128, 128), (256, 256), (512, 512), (1000, 984))
TOLERANCES = (3e-3, 1e-3, 1e-4)  # at two grids
VIEWED = ((96, 96), (192, 192), (384, 384))  # of all views together
SCENE_OF_VIEWS = {4: "views2", 9: "views3"}

# What is fitted: a name, a unit, and the number of a capture.
QUANTITIES = (
    ("patterns", "", lambda one: one["patterns"]),
    ("rig time a pattern", "s", lambda one: one["rig_seconds"] / one["patterns"]),
    ("tensor", "bytes", lambda one: one["tensor_bytes"]),
    ("processor time a pattern, with the simulation", "s", lambda one: one["processor_seconds"] / one["patterns"]),
    ("largest memory", "bytes", lambda one: one["peak_memory_bytes"]),
)


def cases():
    """(scene, rows, columns, views, tolerance)"""
    for rows, cols in GRIDS:
        yield "vgroove-textured", rows, cols, 1, USUAL
    for tolerance in TOLERANCES:
        for rows, cols in GRIDS[1:3]:
            yield "vgroove-textured", rows, cols, 1, tolerance
    for views, scene in SCENE_OF_VIEWS.items():
        for rows, cols in VIEWED:
            yield scene, rows, cols, views, USUAL


def captured(symrig, folder, case):
    """The numbers of a capture, from the folder if it was done before."""
    scene, rows, cols, views, tolerance = case
    name = f"{scene}-{rows}x{cols}-{tolerance:g}"
    numbers = folder / f"{name}.json"
    if not numbers.exists():
        rig = f"sim:{scene}?size={rows}x{cols}&seed=7"
        output = folder / f"{name}.h5"
        words = [symrig, "capture", "--rig", rig, "-o", output, "--json", f"{numbers}.new", "--tolerance", f"{tolerance:g}", "--polish", "0"]
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run(words, check=True, stdout=subprocess.DEVNULL)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        output.unlink()
        told = pathlib.Path(f"{numbers}.new")
        used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        numbers.write_text(json.dumps(json.loads(told.read_text(encoding="utf-8")) | {"processor_seconds": used}), encoding="utf-8")
        told.unlink()
    return json.loads(numbers.read_text(encoding="utf-8"))


def features(case):
    _, rows, cols, views, tolerance = case
    return np.array([1.0, np.log(rows * cols), np.log(tolerance / USUAL), np.log(views)])


class PowerLaw:
    """log y = features · w, by least squares."""

    def __init__(self, where, values):
        self.where, self.logs = np.array([features(case) for case in where]), np.log(values)
        self.w = np.linalg.lstsq(self.where, self.logs, rcond=None)[0]

    def residuals(self):
        """How many times the fit a measured value is."""
        return np.exp(self.logs - self.where @ self.w)

    def at(self, case):
        return float(np.exp(features(case) @ self.w))


def ratio(value):
    """A factor, however it points."""
    return max(value, 1 / value)


def fits(where, captures):
    return {name: PowerLaw(where, np.array([number(one) for one in captures])) for name, _, number in QUANTITIES}


def without_the_largest(where, captures, number):
    """Measured over predicted, for the largest grid by the others."""
    largest = max(range(len(where)), key=lambda k: where[k][1] * where[k][2])
    rest = [k for k in range(len(where)) if k != largest]
    law = PowerLaw([where[k] for k in rest], np.array([number(captures[k]) for k in rest]))
    return number(captures[largest]) / law.at(where[largest])


def short(value):
    return f"{value:.3g}"


def measured_table(where, captures):
    print("| scene | grid | views | tolerance | " + " | ".join(f"{name}{f', {unit}' if unit else ''}" for name, unit, _ in QUANTITIES) + " |")
    print("|" + "---|" * (4 + len(QUANTITIES)))
    for case, one in zip(where, captures):
        scene, rows, cols, views, tolerance = case
        print(f"| `{scene}` | {rows}x{cols} | {views} | {tolerance:g} | " + " | ".join(short(number(one)) for _, _, number in QUANTITIES) + " |")


def law_table(where, captures, laws):
    print("| quantity | at 1 Mpx, 3e-4, one view | pixels^ | tolerance^ | views^ | typical error | worst | largest grid by the others |")
    print("|---|---|---|---|---|---|---|---|")
    million = ("", 1000, 1000, 1, USUAL)
    for name, unit, number in QUANTITIES:
        law = laws[name]
        left = law.residuals()
        typical = np.exp(np.sqrt(np.mean(np.log(left) ** 2)))
        worst = max(left, key=ratio)
        row = [f"{short(law.at(million))} {unit}".strip(), *(f"{x:.2f}" for x in law.w[1:]), f"{typical:.2f} x", f"{worst:.2f} x"]
        print(f"| {name} | " + " | ".join(row) + f" | {without_the_largest(where, captures, number):.2f} x |")


def prediction(text):
    match = re.fullmatch(r"(\d+)x(\d+),(\d+),([\d.e-]+)", text)
    if not match:
        raise argparse.ArgumentTypeError(f"{text} is not ROWSxCOLUMNS,VIEWS,TOLERANCE")
    return "", int(match[1]), int(match[2]), int(match[3]), float(match[4])


def predicted_table(laws, wanted):
    print("| grid of all views | views | tolerance | patterns | rig hours | processor hours | tensor, GB | largest memory, GB |")
    print("|---|---|---|---|---|---|---|---|")
    for case in wanted:
        _, rows, cols, views, tolerance = case
        patterns = laws["patterns"].at(case)
        rig = patterns * laws["rig time a pattern"].at(case) / 3600
        host = patterns * laws["processor time a pattern, with the simulation"].at(case) / 3600
        cells = [short(patterns), short(rig), short(host), short(laws["tensor"].at(case) / 1e9), short(laws["largest memory"].at(case) / 1e9)]
        print(f"| {rows}x{cols} | {views} | {tolerance:g} | " + " | ".join(cells) + " |")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("symrig")
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--predict", type=prediction, nargs="*", default=[])
    words = parser.parse_args()
    words.folder.mkdir(parents=True, exist_ok=True)
    where = list(cases())
    captures = []
    for case in where:
        print("  ".join(str(part) for part in case), file=sys.stderr, flush=True)
        captures.append(captured(words.symrig, words.folder, case))
    laws = fits(where, captures)
    measured_table(where, captures)
    print()
    law_table(where, captures, laws)
    if words.predict:
        print()
        predicted_table(laws, words.predict)


if __name__ == "__main__":
    main()
