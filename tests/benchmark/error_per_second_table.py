#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: Apache-2.0
"""Writes the tables of docs/benchmarks/error-per-second.md from the CSV of benchmark_error_per_second.

usage: tests/benchmark/error_per_second_table.py CSV [PAGE]

Replaces what stands between the two marks of the page. Without PAGE it prints the tables.
"""

import csv
import math
import pathlib
import statistics
import sys

BEGIN, END = "<!-- tables -->\n", "<!-- end of tables -->\n"
WAYS = ["paper, four", "symrig, four", "symrig, auto", "symrig, auto, polish 2"]
ERRORS = ["frobenius", "flood", "indirect", "bar_indirect"]


def number(text):
    return float(text) if text else math.nan


def short(value):
    """Two or three digits, as in .0123 and 12.3."""
    if math.isnan(value):
        return "-"
    if value >= 100:
        return f"{value:.0f}"
    if value >= 1:
        return f"{value:.3g}"
    return f"{value:.2g}".replace("0.", ".", 1) if value >= 0.001 or value == 0 else f"{value:.1e}"


def name_of(row):
    return f"random {row['seed']}" if row["scene"] == "random" else row["scene"]


def read(path):
    """{profile: {scene: {way: row}}}, in the order of the file. Scenes without all ways are left out: the run was stopped."""
    all_rows = {}
    with open(path, encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            all_rows.setdefault(row["profile"], {}).setdefault(name_of(row), {})[row["way"]] = row
    return {
        profile: {scene: ways for scene, ways in scenes.items() if len(ways) == len(WAYS)}
        for profile, scenes in all_rows.items()
    }


def table(head, rows):
    return "\n".join(["| " + " | ".join(head) + " |", "|" + "---|" * len(head), *("| " + " | ".join(r) + " |" for r in rows)]) + "\n"


def captures(scenes):
    def cell(row):
        return " / ".join([row["patterns"], *(short(number(row[k])) for k in ("rig_seconds", "frobenius", "indirect", "bar_indirect"))])

    return table(["scene", *WAYS], [[scene, *(cell(ways[way]) for way in WAYS)] for scene, ways in scenes.items()])


def times(profiles):
    rows = []
    for profile, scenes in profiles.items():
        for way in WAYS:
            mean = [
                statistics.fmean(number(ways[way][f"{part}_seconds"]) for ways in scenes.values())
                for part in ("rig", "light", "camera", "projector", "host")
            ]
            rows.append([profile, way, *map(short, mean)])
    return table(["profile", "capture", "rig", "light", "camera", "projector", "host"], rows)


def geometric_mean(ratios):
    usable = [r for r in ratios if r > 0 and math.isfinite(r)]
    return (math.exp(statistics.fmean(map(math.log, usable))), max(usable)) if usable else (math.nan, math.nan)


def against_paper(profiles):
    """Ratios to `paper`: geometric mean, and the worst."""
    rows = []
    for profile, scenes in profiles.items():
        drawn = sum(scene.startswith("random") for scene in scenes)
        for group, chosen in ((f"{len(scenes) - drawn} named", False), (f"{drawn} random", True)):
            for way in WAYS[1:]:
                cells = []
                for key in ("patterns", "rig_seconds", "frobenius", "indirect", "bar_indirect"):
                    pairs = [
                        (number(ways[way][key]), number(ways[WAYS[0]][key]))
                        for scene, ways in scenes.items()
                        if scene.startswith("random") == chosen
                    ]
                    mean, worst = geometric_mean([a / b for a, b in pairs if b > 0])
                    cells.append(f"{short(mean)} ({short(worst)})")
                rows.append([profile, group, way, *cells])
    return table(["profile", "scenes", "capture", "patterns", "rig seconds", "frobenius", "indirect", "bar_indirect"], rows)


def deviation(values):
    return statistics.stdev(values) / math.sqrt(len(values)) if len(values) > 1 else math.nan


def signed(scenes):
    """The light outside the bar, over random scenes: mean signed error with its standard error, and the largest."""
    rows = []
    for way in WAYS:
        values = [number(ways[way]["signed_outside_bar"]) for scene, ways in scenes.items() if scene.startswith("random")]
        values = [v for v in values if math.isfinite(v)]
        worst = max(values, key=abs)
        rows.append([
            way,
            f"{100 * statistics.fmean(values):+.2f} ± {100 * deviation(values):.2f} %",
            f"{100 * statistics.median(values):+.2f} %",
            f"{100 * worst:+.1f} %",
            f"{sum(v < 0 for v in values)} of {len(values)}",
        ])  # fmt: skip
    return table(["capture", "mean signed error", "median", "largest", "too dark"], rows)


def estimates(scenes):
    """Estimated over true error, over random scenes."""
    rows = []
    for way in WAYS[1:]:
        for error in ERRORS:
            pairs = [
                (number(ways[way][f"estimated_{error}"]), number(ways[way][error]))
                for scene, ways in scenes.items()
                if scene.startswith("random")
            ]
            ratios = [a / b for a, b in pairs if math.isfinite(a) and b > 0]
            inside = sum(0.8 <= r <= 1.25 for r in ratios)
            mean, _ = geometric_mean(ratios)
            span = f"{short(min(ratios))} to {short(max(ratios))}" if ratios else "-"
            rows.append([way, error, short(mean), span, f"{inside} of {len(ratios)}", str(len(pairs) - len(ratios))])
    return table(["capture", "error", "geometric mean", "from, to", "within 0.8 to 1.25", "not estimated"], rows)


def signed_by_seed(scenes):
    rows = []
    for scene, ways in scenes.items():
        if scene.startswith("random"):
            values = [number(ways[way]["signed_outside_bar"]) for way in WAYS]
            rows.append([scene, *("-" if math.isnan(v) else f"{100 * v:+.2f} %" for v in values)])
    return table(["scene", *WAYS], rows)


def tables(profiles):
    text = ""
    for profile, scenes in profiles.items():
        if profile == next(iter(profiles)):
            text += f"### Every capture, {profile}\n\nPatterns / rig seconds / `frobenius` / `indirect` / `bar_indirect`.\n\n"
            text += captures(scenes) + "\n"
    first = next(iter(profiles.values()))
    text += "### Against paper\n\nRatios to `paper, four`: geometric mean (worst). Scenes whose error is 0 are left out.\n\n"
    text += against_paper(profiles) + "\n"
    text += "### Where the time goes\n\nSeconds, arithmetic means over all scenes. Host is beside the rig's time.\n\n" + times(profiles) + "\n"
    text += "### Signed error outside the bar\n\nRandom seeds 1 to 20, first profile.\n\n" + signed(first) + "\n" + signed_by_seed(first) + "\n"
    text += "### Estimated over true errors\n\nRandom seeds 1 to 20, first profile.\n\n" + estimates(first)
    return text


def main():
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    text = tables(read(sys.argv[1]))
    if len(sys.argv) == 2:
        print(text, end="")
        return
    page = pathlib.Path(sys.argv[2])
    old = page.read_text(encoding="utf-8")
    if BEGIN not in old or END not in old:
        sys.exit(f"{page} lacks the marks {BEGIN.strip()} and {END.strip()}")
    page.write_text(old[: old.index(BEGIN) + len(BEGIN)] + "\n" + text + "\n" + old[old.index(END) :], encoding="utf-8")


if __name__ == "__main__":
    main()
