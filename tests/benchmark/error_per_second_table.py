#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: Apache-2.0
"""Writes the tables of docs/research/error-per-second.md from the CSV of benchmark_error_per_second.

usage: tests/benchmark/error_per_second_table.py CSV [BEFORE [PAGE]]

BEFORE: a CSV of an earlier version, whose way "symrig, auto, polish 2" becomes the column "before". Replaces what stands between the two marks of the page. Without PAGE it prints the tables.
"""

import csv
import math
import pathlib
import statistics
import sys

BEGIN, END = "<!-- tables -->\n", "<!-- end of tables -->\n"
BEFORE = "before"
WAYS = ["paper, four", BEFORE, "symrig, four", "symrig"]
# The same at several tolerances, coarsest first.
CURVE = ["symrig, 8/3", "symrig, 4/3", "symrig", "symrig, 2/3", "symrig, 1/2"]
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


def rows_of(path):
    with open(path, encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def read(path, before):
    """{profile: {scene: {way: row}}}, in the order of the file. Scenes without all ways are left out: the run was stopped."""
    all_rows = {}
    for row in rows_of(path):
        all_rows.setdefault(row["profile"], {}).setdefault(name_of(row), {})[row["way"]] = row
    for row in rows_of(before) if before else []:
        ways = all_rows.get(row["profile"], {}).get(name_of(row))
        if row["way"] == "symrig, auto, polish 2" and ways and row["size"] == ways["symrig"]["size"]:
            ways[BEFORE] = row
    if not any(BEFORE in ways for scenes in all_rows.values() for ways in scenes.values()):
        WAYS.remove(BEFORE)
    return {
        profile: {scene: ways for scene, ways in scenes.items() if all(way in ways for way in WAYS + CURVE)}
        for profile, scenes in all_rows.items()
    }


def cost_at(ways, error, wanted, cost):
    """What the coarsest tolerance costs that leaves no larger error, between two of them by logarithms. If none does: by the square of the error."""
    points = [(number(ways[way][error]), number(ways[way][cost])) for way in CURVE]
    if points[0][0] <= wanted:
        return points[0][1]
    for (e0, c0), (e1, c1) in zip(points, points[1:]):
        if e1 <= wanted:
            return c0 * (c1 / c0) ** (math.log(e0 / wanted) / math.log(e0 / e1))
    return points[-1][1] * (points[-1][0] / wanted) ** 2


def at_equal_errors(profiles):
    """Rig seconds and patterns at which `indirect` and `bar_indirect` are both those of another way, as ratios to its own."""
    rows = []
    for profile, scenes in profiles.items():
        drawn = sum(scene.startswith("random") for scene in scenes)
        for group, chosen in ((f"{len(scenes) - drawn} named", False), (f"{drawn} random", True)):
            for way in WAYS[: WAYS.index("symrig, four")]:
                cells = []
                for cost in ("rig_seconds", "patterns"):
                    ratios = [
                        max(cost_at(ways, error, number(ways[way][error]), cost) for error in ("indirect", "bar_indirect"))
                        / number(ways[way][cost])
                        for scene, ways in scenes.items()
                        if scene.startswith("random") == chosen and number(ways[way]["indirect"]) > 0
                    ]
                    if ratios:
                        mean, worst = geometric_mean(ratios)
                        cells.append(f"{short(mean)} ({short(worst)})")
                if cells:
                    rows.append([profile, group, way, *cells])
    return table(["profile", "scenes", "at the errors of", "rig seconds", "patterns"], rows)


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
        if not values:
            continue
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
    text += (
        "### At equal errors\n\n"
        "What the default capture costs at the tolerance where both `indirect` and `bar_indirect` are those of another way.\n"
        "Ratios: geometric mean (worst).\n\n"
    )  # fmt: skip
    text += at_equal_errors(profiles) + "\n"
    text += "### Where the time goes\n\nSeconds, arithmetic means over all scenes. Host is beside the rig's time.\n\n" + times(profiles) + "\n"
    text += "### Signed error outside the bar\n\nRandom scenes, first profile.\n\n" + signed(first) + "\n" + signed_by_seed(first) + "\n"
    text += "### Estimated over true errors\n\nRandom scenes, first profile.\n\n" + estimates(first)
    return text


def main():
    if not 2 <= len(sys.argv) <= 4:
        sys.exit(__doc__)
    text = tables(read(sys.argv[1], sys.argv[2] if len(sys.argv) > 2 else ""))
    if len(sys.argv) < 4:
        print(text, end="")
        return
    page = pathlib.Path(sys.argv[3])
    old = page.read_text(encoding="utf-8")
    if BEGIN not in old or END not in old:
        sys.exit(f"{page} lacks the marks {BEGIN.strip()} and {END.strip()}")
    page.write_text(old[: old.index(BEGIN) + len(BEGIN)] + "\n" + text + "\n" + old[old.index(END) :], encoding="utf-8")


if __name__ == "__main__":
    main()
