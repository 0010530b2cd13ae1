#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: Apache-2.0
"""How often the errors that a capture states are those that it has, on random scenes with camera noise.

usage: tests/benchmark/estimates.py SYMRIG [SIZE [FIRST-LAST]]     e.g. tests/benchmark/estimates.py build/release/host/apps/symrig 64x64 1-20

Prints one Markdown table. An error below a tenth of a thousandth of the light counts as none, and is left out.
"""

import math
import pathlib
import statistics
import sys

from budgets import captured

ERRORS = ("frobenius", "flood", "indirect", "bar_indirect")
NONE = 1e-4
CLOSE = 1.25


def pairs(captures, error):
    """(stated, true, half width) of the captures that state this error."""
    for one in captures:
        stated, true = one["estimated_error"].get(error), one["error"].get(error)
        if stated is not None and true is not None and math.isfinite(stated) and true > NONE:
            yield stated, true, one["estimated_error_uncertainty"][error]


def row(captures, error):
    all_pairs = list(pairs(captures, error))
    close = sum(1 / CLOSE <= stated / true <= CLOSE for stated, true, _ in all_pairs)
    inside = sum(abs(stated - true) <= half_width for stated, true, half_width in all_pairs)
    width = statistics.median(half_width / stated for stated, _, half_width in all_pairs)
    return f"| `{error}` | {close} of {len(all_pairs)} | {inside} of {len(all_pairs)} | {width:.2f} |"


def main():
    symrig = str(pathlib.Path(sys.argv[1]).resolve())
    size = sys.argv[2] if len(sys.argv) > 2 else "64x64"
    first, last = (sys.argv[3] if len(sys.argv) > 3 else "1-20").split("-")
    captures = [captured(symrig, f"sim:random?size={size}&seed={seed}&noise=camera") for seed in range(int(first), int(last) + 1)]
    patterns = math.exp(statistics.mean(math.log(one["patterns"]) for one in captures))
    seconds = math.exp(statistics.mean(math.log(one["rig_seconds"]) for one in captures))
    print(f"| {size}, seeds {first} to {last} | stated / true within 0.8 to 1.25 | within the stated interval | half width / stated |")
    print("|---|---|---|---|")
    for error in ERRORS:
        print(row(captures, error))
    print(f"\nGeometric means: {patterns:.1f} patterns, {seconds:.2f} rig seconds.")


if __name__ == "__main__":
    main()
