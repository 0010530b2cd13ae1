#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: Apache-2.0
"""usage: compare_captures.py FOLDER TOLERANCE

Two captures of one scene: on the bench (bench.json, bench-errors.json of `symrig capture` and `symrig evaluate`) and on the
virtual rig (virtual.json, virtual-errors.json). Fails if the bench took other numbers of patterns, or if an error against the
truth is larger than the virtual rig's by more than TOLERANCE (0.05: 5 %)."""

import json
import pathlib
import sys


def read(folder, name):
    return json.loads((folder / name).read_text(encoding="utf-8"))


def flat(errors, path=""):
    for key, value in errors.items():
        if isinstance(value, dict):
            yield from flat(value, f"{path}{key}.")
        else:
            yield path + key, value


def main():
    folder, tolerance = pathlib.Path(sys.argv[1]), float(sys.argv[2])
    bench, virtual = read(folder, "bench.json"), read(folder, "virtual.json")
    worse = []
    print(f"{'':24}{'bench':>12}{'virtual rig':>14}{'ratio':>8}")
    for key in ("patterns", "frames", "rig_seconds"):
        print(f"{key:24}{bench[key]:12.6g}{virtual[key]:14.6g}{bench[key] / virtual[key]:8.3f}")
    print(f"{'patterns_per_level':24}{bench['patterns_per_level']}  {virtual['patterns_per_level']}")
    if bench["patterns_per_level"] != virtual["patterns_per_level"]:
        worse.append("other numbers of patterns")
    theirs = dict(flat(read(folder, "virtual-errors.json")["error"]))
    for key, ours in flat(read(folder, "bench-errors.json")["error"]):
        ratio = ours / theirs[key]
        print(f"{key:24}{ours:12.5f}{theirs[key]:14.5f}{ratio:8.3f}")
        if ratio > 1 + tolerance:
            worse.append(f"{key} is {100 * (ratio - 1):.1f} % larger")
    for line in worse:
        print(f"compare_captures: {line}", file=sys.stderr)
    return 1 if worse else 0


if __name__ == "__main__":
    sys.exit(main())
