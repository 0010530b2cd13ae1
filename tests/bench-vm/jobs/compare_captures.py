#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: Apache-2.0
"""usage: compare_captures.py FOLDER TOLERANCE [PATTERNS]

Two captures of one scene: on the bench (bench.json, bench-errors.json of `symrig capture` and `symrig evaluate`) and on the
virtual rig (virtual.json, virtual-errors.json). Fails if an error against the truth is larger than the virtual rig's by more
than TOLERANCE (0.05: 5 %). Fails if the numbers of patterns differ by more than the share PATTERNS. Without PATTERNS, they must
be equal on each level. If both have a registration (NAME-registration.json of `symrig calibrate`), it compares the maps too.

Such a comparison needs two captures with the same noise. If there are captures of the virtual rig with other noise
(virtual-N-errors.json), the bench's noise is not the virtual rig's. Then an error of the bench is one more draw
of the same quantity: it may be as large as the draws predict, and TOLERANCE larger."""

import json
import math
import pathlib
import statistics
import sys

# Of a map by its own estimate, cells. The fit chooses from few degrees of smoothness, and a tiny difference changes the choice. So
# the maps of one bench state 0.0010 to 0.0017, and a ratio would say little. At twice that, something else is wrong.
MAP_ERROR = 0.003
# One-sided 99.9 % of Student's t for 2, 3, ... degrees of freedom (Abramowitz & Stegun, table 26.10).
STUDENT = {2: 22.33, 3: 10.21, 4: 7.17, 5: 5.89, 6: 5.21, 7: 4.79, 8: 4.50, 9: 4.30, 10: 4.14}


def read(folder, name):
    return json.loads((folder / name).read_text(encoding="utf-8"))


def flat(errors, path=""):
    for key, value in errors.items():
        if isinstance(value, dict):
            yield from flat(value, f"{path}{key}.")
        else:
            yield path + key, value


def errors_of(folder, capture):
    """On the cells; and on the camera's own pixels, if it has any, as camera.NAME."""
    said = read(folder, f"{capture}-errors.json")
    return dict(flat(said["error"])) | dict(flat(said.get("camera", {}).get("error", {}), "camera."))


def largest_of(draws):
    """The largest value that one more draw may have, with a probability of 99.9 %: the prediction bound of a normal quantity of
    unknown mean and variance."""
    count = len(draws)
    return statistics.mean(draws) + STUDENT[count - 1] * statistics.stdev(draws) * math.sqrt(1 + 1 / count)


def compare_maps(folder):
    """What is wrong with the maps of the registrations, if there are any."""
    if not (folder / "bench-registration.json").exists():
        return []
    ours, theirs = (read(folder, f"{one}-registration.json")["maps"][0]["error"] for one in ("bench", "virtual"))
    print(f"{'map, stated [cells]':24}{ours:12.5f}{theirs:14.5f}{ours / theirs:8.3f}")
    return [] if ours <= MAP_ERROR else [f"the map has an error of {ours:.4f} cells, and {MAP_ERROR} is allowed"]


def compare_patterns(bench, virtual, allowed):
    """What is wrong with the numbers of patterns. allowed: a share, or None: equal on each level."""
    print(f"{'patterns_per_level':24}{bench['patterns_per_level']}  {virtual['patterns_per_level']}")
    if allowed is None:
        return [] if bench["patterns_per_level"] == virtual["patterns_per_level"] else ["other numbers of patterns"]
    apart = abs(bench["patterns"] / virtual["patterns"] - 1)
    return [] if apart <= allowed else [f"the numbers of patterns differ by {100 * apart:.1f} %"]


def main():
    folder, tolerance = pathlib.Path(sys.argv[1]), float(sys.argv[2])
    allowed = float(sys.argv[3]) if len(sys.argv) > 3 else None
    others = [path.name.removesuffix("-errors.json") for path in folder.glob("virtual-[0-9]-errors.json")]
    bench, virtual = read(folder, "bench.json"), read(folder, "virtual.json")
    print(f"{'':24}{'bench':>12}{'virtual rig':>14}{'ratio':>8}")
    for key in ("patterns", "frames", "rig_seconds"):
        print(f"{key:24}{bench[key]:12.6g}{virtual[key]:14.6g}{bench[key] / virtual[key]:8.3f}")
    worse = compare_patterns(bench, virtual, allowed) + compare_maps(folder)
    ours, theirs = errors_of(folder, "bench"), [errors_of(folder, one) for one in ("virtual", *others)]
    if any(one.keys() != ours.keys() for one in theirs):
        worse.append("other errors are given")
    for key in [key for key in ours if key in theirs[0]]:
        bound = largest_of([one[key] for one in theirs]) if others else theirs[0][key]
        ratio = ours[key] / bound
        print(f"{key:24}{ours[key]:12.5f}{bound:14.5f}{ratio:8.3f}")
        if ratio > 1 + tolerance:
            worse.append(f"{key} is {100 * (ratio - 1):.1f} % larger")
    for line in worse:
        print(f"compare_captures: {line}", file=sys.stderr)
    return 1 if worse else 0


if __name__ == "__main__":
    sys.exit(main())
