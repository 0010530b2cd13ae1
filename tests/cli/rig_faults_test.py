#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Each fault of a rig, through each command that measures with one: the cause is named, or the result is right.

rig_faults_test.py SYMRIG
"""
import importlib.util
import json
import os
import subprocess
import sys
import tempfile

SYMRIG = os.path.abspath(sys.argv[1])
RIG = os.path.join(os.path.dirname(os.path.abspath(__file__)), "faulty_rig.py")
REFUSED = 3  # exit code of a device
RIGHT = None  # exit code 0, and the result is as exact as it states

# What the message says of the cause: by `capture` with and without --check-axis, and by `align`.
TABLE = {
    "none": (RIGHT, RIGHT),
    "dark": ("cap on the lens", "cap on the lens"),
    "capped": ("cap on the lens", "cap on the lens"),
    "room": ("lamp is off", "lamp is off"),
    "inverted": ("black for white", "black for white"),
    "inverted_black": ("black for white", "black for white"),
    "late": ("1 photograph late", "late or twice"),
    "doubled=3": ("1 photograph late", "late or twice"),
    "once=4": ("late or twice", "late or twice"),
    "once=7": ("late or twice", None),
    "lost=1": ("frame without light", None),
    "lost=6": ("frame without light", None),
    "frozen": ("same photograph again", "same photograph again"),
    "mirrored": ("mirrored left to right", "mirrored left to right"),
    "flipped": ("mirrored top to bottom", "mirrored top to bottom"),
    "turned": ("turned upside down", "turned upside down"),
    "quarter": ("turned by a quarter", "turned by a quarter"),
    "transposed": ("transposed", "transposed"),
    "slanted": ("another order", "another order"),
    "moved=3": ("not aligned", None),
    "ambient=0.05": ("light of other sources", None),
    "ambient_drift=0.05": ("light of other sources", None),
    "black_level=0.05": ("black level", None),
    "black_level=-0.02": ("black level", None),
    "clipped=0.5": ("clips", None),
    "clipped=0.1": ("clips", None),
    "gamma=2.2": ("not linear", None),
    "gamma=0.7": ("not linear", None),
    "auto_exposure": ("automatic exposure", "automatic exposure"),
    "flicker=0.2": ("lamp that flickers", None),
    "sharpened=0.3": ("sharpening", None),
    "stuck=0.9": ("stuck", None),
    "stuck_sure=0.9": ("stuck", None),
    "stuck_row=0.3": ("stuck", None),
    "dead_row": ("dead row", None),
    "dead_column": ("dead column", None),
    "cut_black": (RIGHT, RIGHT),
    "drift=0.02": (RIGHT, RIGHT),
    "flicker=0.003": (RIGHT, RIGHT),
    "drift=0.05": (RIGHT, RIGHT),
    "once=30": ("late or twice", None),
    "doubled=30": ("late or twice", None),
    "lost=25": ("frame without light", None),
    "moves=3": ("has moved", None),
    "black_level=0.002": ("black level", None),
    "black_level=-0.002": ("black level", None),
    "blended=0.1": ("not settled", None),
    "gamma=1.1": ("not linear", None),
    "sharpened=0.05": ("sharpening", None),
    "mirrored_stated": (RIGHT, RIGHT),
}

WITHOUT_CHECKS = ("none", "capped", "room", "inverted", "late", "mirrored", "quarter", "gamma=2.2", "stuck=0.9")
# So few pixels that random patterns do not tell their order.
SEARCHED_FEW = ("none", "mirrored", "flipped", "turned", "quarter", "transposed", "moved=3", "inverted_black", "sharpened=0.3")
# One photograph of a few pixels alone.
ONE_OF_FEW = {"once=30": "late or twice", "lost=30": "without light"}
# Not square: another order of pixels is no turned picture.
OBLONG = ("none", "quarter", "transposed", "slanted", "moved=3")
OTHERS_FEW = ("none", "mirrored", "quarter", "moved=3")
# One photograph of many that is wrong: brute force has no second one of it.
ONE_OF_BRUTE = {"once=30": "late or twice", "doubled=30": "late", "lost=25": "lacks", "moves=3": "has moved", "blended=0.1": "not settled"}

if importlib.util.find_spec("numpy") is None:
    print("numpy is missing: skipped")
    sys.exit(77)

failures = []


def symrig(*words):
    done = subprocess.run([SYMRIG, *words], capture_output=True, text=True, timeout=300, check=False)
    return done.returncode, (done.stdout + done.stderr).strip()


def rig(fault, size="24x24"):
    return f"exec:/usr/bin/python3 {RIG} {fault} 1 {size}"


def expect(true, what, text):
    if not true:
        failures.append(what)
        print(f"{what}: {text}", flush=True)


def expect_cause(what, words, outcome):
    code, text = outcome
    expect(code == REFUSED, what, f"exit code {code}: {text}")
    expect(words in text, what, f"'{words}' is not in: {text}")
    expect(text.count("; or ") <= 2, what, f"more than three causes: {text}")


def expect_right(what, outcome):
    code, text = outcome
    expect(code == 0, what, f"exit code {code}: {text}")
    if code != 0:
        return
    code, text = symrig("evaluate", "a.h5", "--rig", rig("none"), "--json", "e.json")
    expect(code == 0, what, text)
    with open("a.json") as file:
        stated = json.load(file)
    with open("e.json") as file:
        measured = json.load(file)
    error, sure = stated["estimated_error"], stated["estimated_error_uncertainty"]
    for name in ("random", "natural"):
        most = error["relight"][name] + sure["relight"][name]
        is_now = measured["error"]["relight"][name] - measured["error_uncertainty"]["relight"][name]
        expect(is_now <= most, what, f"relight {name}: {is_now} of {most}")


def capture(fault, words, *options):
    what = " ".join(["capture", fault, *options])
    for name in ("a.h5", "a.h5.log"):
        if os.path.exists(name):
            os.remove(name)
    outcome = symrig("capture", "--rig", rig(fault), "-o", "a.h5", "--json", "a.json", *options)
    if words is RIGHT:
        return expect_right(what, outcome)
    expect_cause(what, words, outcome)
    # The photographs of a whole search stay, and the message says where.
    kept = os.path.exists("a.h5.log")
    expect(not os.path.exists("a.h5") and kept == ("a.h5.log" in outcome[1]), what, "a file is left")


def capture_without_checks(fault, words, *options, size="24x24"):
    """There are no held-out photographs, so some are taken at the end. The others are of no use if these are wrong."""
    what = " ".join(["capture", size, fault, *options])
    for name in ("b.h5", "b.h5.log"):
        if os.path.exists(name):
            os.remove(name)
    outcome = symrig("capture", "--rig", rig(fault, size), "-o", "b.h5", *options)
    if words is RIGHT:
        return expect(outcome[0] == 0, what, outcome[1])
    expect_cause(what, words, outcome)
    kept = os.path.exists("b.h5.log")
    expect(not os.path.exists("b.h5") and kept == ("b.h5.log" in outcome[1]), what, "a file is left")


def one_dark_photograph(fault):
    """With one photograph nobody can tell: the message says so."""
    outcome = symrig("capture", "--rig", rig(fault), "-o", "a.h5", "--no-log", "--algorithm", "dual")
    expect_cause(f"capture {fault} by dual", "late, or a projector that shows black for white", outcome)


def align(fault, words):
    outcome = symrig("align", "--rig", rig(fault), "--updates", "1")
    if words is RIGHT:
        # 5: what it measures is not good enough; it names no cause.
        return expect(outcome[0] in (0, 5), "align " + fault, outcome[1])
    expect_cause("align " + fault, words, outcome)


with tempfile.TemporaryDirectory() as folder:
    os.chdir(folder)
    for fault, (of_capture, of_align) in TABLE.items():
        capture(fault, of_capture)
        capture(fault, of_capture, "--check-axis")
        align(fault, of_align)
    for fault in WITHOUT_CHECKS:
        # The first photograph of a late camera is dark: of one, nobody can tell more.
        by_paper = "one photograph late" if fault == "late" else TABLE[fault][0]
        capture_without_checks(fault, TABLE[fault][0], "--algorithm", "brute")
        capture_without_checks(fault, TABLE[fault][0], "--algorithm", "brute", "--check-axis")
        capture_without_checks(fault, by_paper, "--algorithm", "paper")
    for fault, words in ONE_OF_BRUTE.items():
        capture_without_checks(fault, words, "--algorithm", "brute")
    # 49 random pixels tell no order, but each pixel alone does.
    for fault, (words, _) in TABLE.items():
        capture_without_checks(fault, ONE_OF_BRUTE.get(fault, words), size="7x7")
    for fault in SEARCHED_FEW:
        capture_without_checks(fault, TABLE[fault][0], size="8x8")
    for fault, words in ONE_OF_FEW.items():
        for size in ("8x8", "10x12", "16x16", "20x24"):
            capture_without_checks(fault, words, size=size)
    for fault in OBLONG:
        for size in ("7x6", "10x12", "20x24"):
            capture_without_checks(fault, TABLE[fault][0], size=size)
    for fault in OTHERS_FEW:
        for algorithm in ("paper", "dual"):
            capture_without_checks(fault, TABLE[fault][0], "--algorithm", algorithm, size="7x7")
    for fault in ("late", "inverted"):
        one_dark_photograph(fault)
print(f"{3 * len(TABLE) + 3 * len(WITHOUT_CHECKS) + len(ONE_OF_BRUTE) + len(TABLE) + len(SEARCHED_FEW) + 4 * len(ONE_OF_FEW) + 3 * len(OBLONG) + 2 * len(OTHERS_FEW) + 2} cells, {len(failures)} failures")
sys.exit(1 if failures else 0)
