# SPDX-License-Identifier: Apache-2.0
"""tools/check-commands on a copy of the documents with planted faults: it must name each of them, and nothing else.

usage: commands_test.py SYMRIG
"""

import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
CHECK = ROOT / "tools" / "check-commands"
PAGE, PROGRAMS, RIG = "command-line.md", "howto-programs.md", "rig-file.md"
# Page, its text, the text in place of it, what the check must print. A row ends with "\n".
PLANTED = {
    "a missing row": (PAGE, "| [`fit`](#fit) | Fit a tensor of direct and global light to Gray-code photographs already taken |\n", "", "the command fit is only in the command"),
    "an invented row": (PAGE, "| [`trace`](#trace) |", "| `jelly` | shakes |\n| [`trace`](#trace) |", "the command jelly is only in the document"),
    "a row of another section": (PAGE, "| [`view`](#view) |", "| [`view`](#report) |", "the row of view links to report"),
    "a missing section": (PAGE, "## conformance\n", "## Conformance\n", "no section on conformance"),
    "an invented section": (PAGE, "## help\n", "## wobble\n\n## help\n", "a section on wobble, which is no command"),
    "an invented option": (PAGE, "- `--size` also takes", "- `--sizes` also takes", "bench: no --sizes"),
    "an option of another command": (PAGE, "`--board` also takes a file", "`--device` also takes a file", "lint: no --device"),
    "an invented option of another command": (PAGE, "`capture --memory` puts", "`capture --room` puts", "before the sections: no --room"),
    "another command's option, called by its name": (PAGE, "`info --device serial:PATH`", "`list --camera serial:PATH`", "list info identify: no --camera"),
    "an invented short option": (PAGE, "`capture -o x.png`", "`capture -q x.png`", "before the sections: no -q"),
    "an option in a block": (PAGE, "$ symrig capture --rig sim:gummy -o gummy.h5 --progress json", "$ symrig capture --rig sim:gummy -o gummy.h5 --steps json", "Progress as JSON: no --steps"),
    "an invented key": (PAGE, "| `misalign`, `moves` |", "| `misalign`, `jumps` |", "there is no scene key jumps"),
    "a missing profile of a simulated rig": (PAGE, "| `dim` | as `standard` | 1/60 s | 0.1 |\n", "", "the profile dim is only in the command"),
    "an invented profile": (PAGE, "| `screen60` | as", "| `screen90` | 90 Hz | 4 ms | 1 |\n| `screen60` | as", "the profile screen90 is only in the document"),
    "a missing profile": (PROGRAMS, "| `lightcrafter-4500` | the same without the black | |\n", "", "the profile lightcrafter-4500 is only in the command"),
    "a missing driver": (RIG, '"v4l2"', '"video"', 'does not name "v4l2"'),
    "a missing key of a rig file": (RIG, "stamp_tolerance", "tolerance_of_stamps", "does not name stamp_tolerance"),
}  # fmt: skip


class Commands(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.docs = pathlib.Path(folder.name)
        for page in (ROOT / "docs").glob("*.md"):
            shutil.copy(page, self.docs)

    def check(self):
        done = subprocess.run([sys.executable, "-B", CHECK, SYMRIG, self.docs], capture_output=True, text=True, check=False)
        return done.returncode, done.stdout.strip().splitlines()

    def test_the_documents_pass(self):
        self.assertEqual(self.check(), (0, ["check-commands: 0 faults"]))

    def test_each_planted_fault_is_named(self):
        for name, (page, text, instead, _) in PLANTED.items():
            path = self.docs / page
            before = path.read_text(encoding="utf-8")
            self.assertIn(text, before, name)
            path.write_text(before.replace(text, instead), encoding="utf-8")
        code, printed = self.check()
        self.assertEqual((code, printed.pop()), (1, f"check-commands: {len(PLANTED)} faults"))
        for name, (_, _, _, expected) in PLANTED.items():
            self.assertEqual(sum(expected in line for line in printed), 1, name)


if __name__ == "__main__":
    SYMRIG = sys.argv.pop()
    unittest.main()
