# SPDX-License-Identifier: Apache-2.0
"""A capture that a budget ended goes on with a larger one, and its scene.h5 holds the bits of a capture that had that budget at once.
A resume that is refused says why in one line and leaves the log as it was, also one with a damaged end.

usage: resume_budget_test.py SYMRIG
Exit code 77: h5py is not installed.
"""

import json
import pathlib
import subprocess
import sys
import tempfile

from scene_content import content

GROOVE = "sim:vgroove-textured?size=24x28&drift=0.05&dead=0.01"
GUMMY = "sim:gummy?size=20x17&channels=3"
PLANNED = "sim:vgroove-mixed?size=16x16&exposures=auto"
DIM = "sim:gummy?size=16x16&light=0.05"  # a budget of seconds ends its exposures
SAME = ("patterns", "frames", "patterns_per_level", "leaves_per_level", "tensor_bytes", "stopped_by", "error_per_level", "estimated_error")


class Folder:
    def __init__(self, symrig, folder):
        self.symrig, self.folder = symrig, pathlib.Path(folder)

    def capture(self, rig, name, *more):
        words = ["capture", "--rig", rig, "-o", f"{name}.h5", "--json", f"{name}.json", *map(str, more)]
        return subprocess.run([self.symrig, *words], cwd=self.folder, capture_output=True, text=True, timeout=300, check=False)

    def done(self, rig, name, *more):
        outcome = self.capture(rig, name, *more)
        assert outcome.returncode == 0, (rig, name, more, outcome.stderr)
        return json.loads((self.folder / f"{name}.json").read_text())

    def log(self, name):
        return self.folder / f"{name}.h5.log"

    def clear(self):
        for path in self.folder.iterdir():
            path.unlink()

    def refused(self, rig, name, more, codes, words):
        before = self.log(name).read_bytes()
        outcome = self.capture(rig, name, "--resume", *more)
        told = (rig, name, more, outcome.returncode, outcome.stderr)
        assert outcome.returncode in codes, told
        assert outcome.stderr.count("\n") == 1 and all(word in outcome.stderr for word in words), told
        assert not ("delete" in outcome.stderr and "continue with --resume" in outcome.stderr), told  # one cause, one next step
        assert self.log(name).read_bytes() == before, ("the log has changed", *told)


def same(folder, rig, budgets):
    """Through all budgets one after another, the last of them at once beside it."""
    at_once = folder.done(rig, "once", *budgets[-1])
    for k, budget in enumerate(budgets):
        resumed = folder.done(rig, "steps", "--resume", "--keep-log", *budget)
        print(f"{rig} {budget}: {resumed['replayed']} of {resumed['patterns']} photographs from the log, {resumed['stopped_by']}")
        assert k == 0 or resumed["replayed"] > 0
    for key in SAME:
        assert at_once.get(key) == resumed.get(key), (rig, budgets, key, at_once.get(key), resumed.get(key))
    expected, found = content(folder.folder / "once.h5"), content(folder.folder / "steps.h5")
    assert expected.keys() == found.keys()
    different = [name for name in expected if expected[name] != found[name]]
    assert not different, (rig, budgets, different)
    # The log that was kept is the log of that capture: nothing has to be measured again.
    again = folder.done(rig, "steps", "--resume", *budgets[-1])
    assert again["replayed"] == again["patterns"] == at_once["patterns"], again
    folder.clear()


def goes_on(folder):
    for rig in (GROOVE, GUMMY, PLANNED, DIM):
        whole = folder.done(rig, "whole")
        n = whole["patterns"]
        folder.clear()
        at = [max(2, int(share * n)) for share in (0.21, 0.47, 0.83)]
        same(folder, rig, [["--max-patterns", at[0]], ["--max-patterns", at[1]]])
        same(folder, rig, [["--max-patterns", at[0]], ["--max-patterns", at[1]], ["--max-patterns", at[2]], []])
        seconds = whole["rig_seconds"]
        same(folder, rig, [["--max-seconds", 0.3 * seconds], ["--max-seconds", 0.7 * seconds], []])
        same(folder, rig, [["--target-error", 0.2], ["--max-patterns", at[2]], []])
        # A target that needs a second search, which the first session did not see.
        same(folder, rig, [["--target-error", 0.005, "--max-patterns", at[2]], ["--target-error", 0.005]])
        same(folder, rig, [["--target-error", 0.01, "--max-patterns", at[1]], ["--target-error", 0.01]])
        same(folder, rig, [["--max-patterns", at[1] + 1], ["--max-patterns", n + 1000, "--max-seconds", 1e6]])


def refuses(folder):
    folder.done(GROOVE, "a", "--keep-log")
    folder.refused(GROOVE, "a", ["--max-patterns", 60], {4}, ["budget"])
    folder.refused(GROOVE, "a", ["--tolerance", 0.01], {4}, ["another capture", "rule.flood_fraction"])
    folder.clear()
    n = folder.done(GROOVE, "a", "--keep-log", "--max-patterns", 90)["patterns"]
    folder.refused(GROOVE, "a", ["--max-patterns", 50], {4}, [f"{n} photographs", "larger budget"])
    folder.clear()


def reads_version_1(folder):
    """Logs of before: the same bytes, but for the version and the note on budgets."""
    patterns = folder.done(GROOVE, "a", "--keep-log")["patterns"]
    whole = folder.log("a").read_bytes()
    assert whole[8:12] == b"\2\0\0\0"
    folder.log("a").write_bytes(whole[:8] + b"\1" + whole[9 : len(whole) * 2 // 3])
    resumed = folder.done(GROOVE, "a", "--resume", "--keep-log")
    assert resumed["patterns"] == patterns and 0 < resumed["replayed"] < patterns, resumed
    assert folder.log("a").read_bytes()[:12] == whole[:8] + b"\1\0\0\0"
    assert folder.done(GROOVE, "a", "--resume")["replayed"] == patterns
    folder.clear()


def damages(whole):
    """Ends of a log as a crash, a full disk or a bad one leave them."""
    yield "torn", whole[: len(whole) - 1001]
    yield "garbage", whole + b"garbage" * 100
    yield "flipped", whole[:-5000] + bytes([whole[-5000] ^ 0x10]) + whole[-4999:]
    yield "torn head", whole[:50]


def refusing_touches_nothing(folder):
    folder.done(GROOVE, "a", "--keep-log")
    whole = folder.log("a").read_bytes()
    folder.clear()
    for what, bytes_left in damages(whole):
        print(f"refused over a log that is damaged: {what}")
        folder.log("a").write_bytes(bytes_left)
        folder.refused(GROOVE, "a", ["--tolerance", 0.01], {4}, ["a.h5.log"])
        folder.refused(GROOVE + "&seed=2", "a", [], {4}, ["a.h5.log"])
        if what != "torn head":
            folder.refused(GROOVE, "a", ["--max-patterns", 60], {4}, ["budget"])
        folder.refused("sim:nothing", "a", [], {2}, ["nothing"])
        folder.refused(GROOVE, "a", ["--max-patterns", 0], {2}, ["--max-patterns"])
        # Accepted, it goes on; the first new photograph mends it.
        patterns = folder.done(GROOVE, "a", "--resume", "--keep-log")["patterns"]
        assert folder.done(GROOVE, "a", "--resume", "--keep-log")["replayed"] == patterns
        assert what == "garbage" or len(folder.log("a").read_bytes()) == len(whole)
        folder.clear()


def main():
    with tempfile.TemporaryDirectory() as folder:
        here = Folder(str(pathlib.Path(sys.argv[1]).resolve()), folder)
        refusing_touches_nothing(here)
        reads_version_1(here)
        refuses(here)
        goes_on(here)


main()
