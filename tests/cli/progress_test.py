# SPDX-License-Identifier: Apache-2.0
"""The progress line on a terminal: one line that is never wider than the terminal, also when that changes. In a pipe: lines of
JSON, and a stop while the computer computes.

usage: progress_test.py SYMRIG
"""

import fcntl
import json
import os
import pathlib
import pty
import re
import select
import signal
import struct
import subprocess
import sys
import tempfile
import termios
import unicodedata

CLEAR = "\r\x1b[K"
RIG = "sim:gummy?size=112x112&noise=off"
# The example of docs/howto-own-rig.md, with 30 ms for each photograph on every computer: a sleep for each pixel's noise.
SLOW = """exec:/usr/bin/python3 -B -c '
import random, sys, time
gauss = random.gauss
random.gauss = lambda mean, sigma: (time.sleep(1e-4), gauss(mean, sigma))[1]
sys.path.insert(0, "EXAMPLES")
import rig'"""
# Long enough in the refit to be stopped there.
REFIT = "sim:vgroove-textured?size=48x48"
LONG_REFIT = ("--polish", "20")
# Its planes have too little light for the check of their order.
DIM_PLANES = "sim:vgroove-white?size=4x4&light=0.001&profile=dlpc350"


def set_columns(terminal, columns):
    fcntl.ioctl(terminal, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))


def width(text):
    return sum(2 if unicodedata.east_asian_width(letter) in "WF" else 1 for letter in text)


def read_some(terminal):
    """What was written; nothing when the command has ended."""
    try:
        return os.read(terminal, 65536)
    except OSError:
        return b""


def updates_of(symrig, columns, later_columns, rig=RIG):
    """What was written line by line, each with the width that the terminal had when it was asked last."""
    with tempfile.TemporaryDirectory() as folder:
        child, terminal = pty.fork()
        if child == 0:
            os.chdir(folder)
            os.execv(symrig, [symrig, "capture", "--rig", rig, "-o", "a.h5", "--json", "a.json"])
        set_columns(terminal, columns)
        text, resized_at = b"", None
        while True:
            more = read_some(terminal)
            if not more:
                break
            text += more
            if resized_at is None and text.count(CLEAR.encode()) >= 4:
                set_columns(terminal, later_columns)
                # What waits to be read was written at the old width, however late a busy machine reads it.
                while select.select([terminal], [], [], 0)[0] and (more := read_some(terminal)):
                    text += more
                resized_at = text.count(CLEAR.encode())
        _, status = os.waitpid(child, 0)
    return text.decode(), resized_at, os.waitstatus_to_exitcode(status)


def check(symrig, columns, later_columns):
    text, resized_at, code = updates_of(symrig, columns, later_columns)
    updates = text.split(CLEAR)
    assert code == 0, (code, text)
    assert updates[0] == "", updates[0]
    assert len(updates) > resized_at + 3, "too few updates to judge"
    shown, rest = updates[1:-1], updates[-1]
    told = [number for number, update in enumerate(shown, 1) if update.endswith("\r\n")]
    assert len(told) == 1, "the forecast is told once, in a line that stays"
    forecast = shown[told[0] - 1]
    assert re.fullmatch(r"symrig capture: about .* on the rig's clock, \d+ photographs\r\n", forecast), repr(forecast)
    assert not any(re.search(r"level \d", update) for update in shown[: told[0]]), "before the search"
    for number, update in enumerate(shown, 1):
        if number == told[0]:
            continue
        assert "\n" not in update and "\x1b" not in update, repr(update)
        # The first one may come before the terminal has its size, one while it changes.
        least = max(columns, later_columns) if number <= resized_at + 1 else later_columns
        assert number == 1 or width(update) < least, (number, update)
    assert re.match(r"a\.h5: \d+ patterns", rest), rest
    return shown


def check_warning(symrig):
    """What the rig warns of stands before the forecast, where a person can still stop, and again in the result."""
    text, _, code = updates_of(symrig, 120, 120, DIM_PLANES)
    assert code == 0, (code, text)
    warning = "warning: the order of the bit planes was not checked: the light of one plane is too little for the camera\r\n"
    early, late = text.find(CLEAR + "symrig capture: " + warning), text.rfind(warning)
    forecast = text.find("on the rig's clock")
    assert 0 <= early < forecast < late, text


def check_time_to_go(symrig, columns, told):
    examples = pathlib.Path(__file__).resolve().parents[2] / "examples/exec"
    text, _, code = updates_of(symrig, columns, columns, SLOW.replace("EXAMPLES", str(examples)))
    assert code == 0, (code, text)
    assert any(re.fullmatch(told, line) for line in text.split(CLEAR)), text


def run(symrig, folder, *words):
    done = subprocess.run([symrig, *words], cwd=folder, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, (words, done)
    return done


def events_of(text):
    return [json.loads(line) for line in text.splitlines() if line.startswith("{")]


def check_json(symrig):
    """An event a line, in a pipe: each stage to the end, photographs and steps that never fall, and no other text."""
    with tempfile.TemporaryDirectory() as folder:
        done = run(symrig, folder, "capture", "--rig", REFIT, *LONG_REFIT, "-o", "a.h5", "--progress", "json")
        silent = run(symrig, folder, "capture", "--rig", REFIT, *LONG_REFIT, "-o", "b.h5")
    assert silent.stderr == "", silent.stderr
    events = events_of(done.stderr)
    assert len(events) == len(done.stderr.splitlines()), done.stderr
    for event in events:
        assert list(event) == ["command", "stage", "unit", "done", "total", "patterns", "steps", "seconds", "seconds_to_go"], event
        assert event["command"] == "capture" and event["unit"] in ("photographs", "steps"), event
    stages = list(dict.fromkeys(event["stage"] for event in events))
    assert stages[0] == "flood-lit" and stages[-1] == "writing the scene", stages
    for stage in ("level 1", "direct light", "refit", "merging leaves", "packing the tensor", "estimated errors"):
        assert stage in stages, (stage, stages)
    for before, now in zip(events, events[1:]):
        assert now["patterns"] >= before["patterns"] and now["seconds"] >= before["seconds"], (before, now)
        if now["stage"] == before["stage"]:
            assert now["steps"] >= before["steps"] and now["done"] >= before["done"], (before, now)
    refit = [event for event in events if event["stage"] == "refit" and event["total"]]
    assert refit and all(event["unit"] == "steps" and event["done"] <= event["total"] for event in refit), refit


def check_stop_in_the_refit(symrig):
    """The log is kept, and the continued capture is the same bit by bit."""
    with tempfile.TemporaryDirectory() as folder:
        words = ["capture", "--rig", REFIT, *LONG_REFIT, "--progress", "json"]
        run(symrig, folder, *words, "-o", "whole.h5")
        child = subprocess.Popen([symrig, *words, "-o", "a.h5"], cwd=folder, stderr=subprocess.PIPE, text=True)
        for line in child.stderr:
            event = json.loads(line)
            if event["stage"] == "refit" and event["done"] > 0:
                break
        child.send_signal(signal.SIGINT)
        rest = child.stderr.read()
        assert child.wait() == 5, rest
        error = [line for line in rest.splitlines() if not line.startswith("{")]
        assert len(error) == 1 and re.search(r"stopped after \d+ photographs.*refit.*a.h5.log keeps \d+ photographs", error[0]), rest
        assert "--resume" in error[0], rest
        assert not any(event["stage"] == "writing the scene" for event in events_of(rest)), rest
        run(symrig, folder, *words, "-o", "a.h5", "--resume")
        for scene in ("whole", "a"):
            run(symrig, folder, "relight", f"{scene}.h5", "--light", "white", "-o", f"{scene}.pfm")
        here = pathlib.Path(folder)
        assert (here / "whole.pfm").read_bytes() == (here / "a.pfm").read_bytes()


def check_forms(symrig):
    failed = subprocess.run([symrig, "capture", "--rig", REFIT, "-o", "a.h5", "--progress", "no"], capture_output=True, text=True)
    assert failed.returncode == 2 and "--progress: 'no' is none of: line, json" in failed.stderr, failed


def main():
    symrig = os.path.abspath(sys.argv[1])
    check(symrig, 120, 100)
    check(symrig, 42, 30)
    check_time_to_go(symrig, 120, r"symrig capture: level \d, \d+ of \d+ photographs, .*, about .* to go")
    # Where not all has room, the time to go is what stays.
    check_time_to_go(symrig, 30, r"\d+ of \d+, about .* to go")
    check(symrig, 30, 12)
    check_warning(symrig)
    check_json(symrig)
    check_stop_in_the_refit(symrig)
    check_forms(symrig)


if __name__ == "__main__":
    main()
