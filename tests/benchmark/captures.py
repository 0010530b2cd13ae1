#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: Apache-2.0
"""Tables about captures of simulated scenes, in Markdown.

usage: tests/benchmark/captures.py TABLE SYMRIG [SIZE [FIRST-LAST]]     e.g. captures.py budgets build/release/host/apps/symrig 64x64

TABLE is one of
  budgets    errors within a share of the photographs or seconds that a capture takes without a budget, as ratios: geometric means over
             the scenes, with the worst scene in brackets
  targets    what captures with a target error take, and what a search with the usual tolerance takes that stops when it is reached:
             geometric means over the scenes, and how often the target was reached
  estimates  how often the errors that a capture states are those that it has, on the random scenes of the seeds FIRST-LAST with camera
             noise. An error below a tenth of a thousandth of the light counts as none, and is left out.
"""

import json
import math
import pathlib
import statistics
import subprocess
import sys
import tempfile

SHARES = (0.2, 0.35, 0.5, 0.7, 0.85)
TARGETS = (0.1, 0.05, 0.02, 0.01, 0.005)
ERRORS = ("frobenius", "indirect", "bar_indirect")
NONE = 1e-4  # an error that counts as none
CLOSE = 1.25


def captured(symrig, scene, *budget):
    """The capture's JSON with the errors of evaluate."""
    with tempfile.TemporaryDirectory() as folder:
        here = pathlib.Path(folder)
        for words in (["capture", "--rig", scene, "-o", "a.h5", "--no-log", "--json", "capture.json", *map(str, budget)],
                      ["evaluate", "a.h5", "--rig", scene, "--json", "errors.json"]):
            subprocess.run([symrig, *words], cwd=here, check=True, capture_output=True)
        result = json.loads((here / "capture.json").read_text())
        return result | {"error": json.loads((here / "errors.json").read_text())["error"]}


def scenes(size, named, seeds):
    return [f"sim:{name}?size={size}&seed=7" for name in named] + [f"sim:random?size={size}&seed={seed}" for seed in seeds]


def mean(values):
    """Geometric."""
    return math.exp(sum(math.log(value) for value in values) / len(values))


def mean_and_worst(ratios):
    return f"{mean(ratios):.2f} ({max(ratios):.1f})"


def budgets(symrig, size):
    named = ("vgroove-white", "vgroove-mixed", "vgroove-textured", "gummy", "occluder", "mirror", "views2")
    seeds = (1, 2, 4, 5, 7, 9, 11, 13, 15, 17, 19)  # indirect light of 3 and 8 is almost nothing
    free = {scene: captured(symrig, scene) for scene in scenes(size, named, seeds)}
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


def stated(capture):
    return capture["estimated_error"]["frobenius"] + capture["estimated_error_uncertainty"]["frobenius"]


def target_row(target, way, captures):
    reached = sum(stated(one) <= target for one in captures)
    true = sum(one["error"]["frobenius"] <= target for one in captures)
    cells = [f"{mean([one['patterns'] for one in captures]):.0f}", f"{mean([one['rig_seconds'] for one in captures]):.1f}"]
    cells += [f"{mean([one['error'][name] for one in captures]):.4f}" for name in ERRORS]
    return f"| {target} | {way} | " + " | ".join(cells) + f" | {reached} of {len(captures)} | {true} of {len(captures)} |"


def targets(symrig, size):
    everything = scenes(size, ("vgroove-white", "vgroove-textured", "gummy", "occluder", "mirror", "views2", "views3"), range(1, 21))
    print(f"| target, {size} | tolerance | patterns | rig seconds | `frobenius` | `indirect` | `bar_indirect` | stated below | true below |")
    print("|---|---|---|---|---|---|---|---|---|")
    for target in TARGETS:
        for way, words in (("usual", ("--tolerance", 3e-4)), ("chosen", ())):
            taken = [captured(symrig, scene, "--target-error", target, *words) for scene in everything]
            print(target_row(target, way, taken), flush=True)


def stated_and_true(captures, error):
    """(stated, true, half width) of the captures that state this error."""
    for one in captures:
        says, true = one["estimated_error"].get(error), one["error"].get(error)
        if says is not None and true is not None and math.isfinite(says) and true > NONE:
            yield says, true, one["estimated_error_uncertainty"][error]


def estimate_row(captures, error):
    pairs = list(stated_and_true(captures, error))
    close = sum(1 / CLOSE <= says / true <= CLOSE for says, true, _ in pairs)
    inside = sum(abs(says - true) <= half_width for says, true, half_width in pairs)
    width = statistics.median(half_width / says for says, _, half_width in pairs)
    return f"| `{error}` | {close} of {len(pairs)} | {inside} of {len(pairs)} | {width:.2f} |"


def estimates(symrig, size, seeds="1-20"):
    first, last = seeds.split("-")
    captures = [captured(symrig, f"sim:random?size={size}&seed={seed}&noise=camera") for seed in range(int(first), int(last) + 1)]
    print(f"| {size}, seeds {first} to {last} | stated / true within 0.8 to 1.25 | within the stated interval | half width / stated |")
    print("|---|---|---|---|")
    for error in ("frobenius", "flood", "indirect", "bar_indirect"):
        print(estimate_row(captures, error))
    patterns, seconds = (mean([one[key] for one in captures]) for key in ("patterns", "rig_seconds"))
    print(f"\nGeometric means: {patterns:.1f} patterns, {seconds:.2f} rig seconds.")


def main():
    tables = {"budgets": budgets, "targets": targets, "estimates": estimates}
    if len(sys.argv) < 3 or sys.argv[1] not in tables:
        sys.exit(__doc__)
    tables[sys.argv[1]](str(pathlib.Path(sys.argv[2]).resolve()), *(sys.argv[3:] or ["64x64"]))


if __name__ == "__main__":
    main()
