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
    "a missing command": (PAGE, "| [`fit`](#fit) | makes a first-bounce tensor from photographs that exist already |\n", "", "the command fit is only in the command"),
    "a missing option": (PAGE, " [--unchecked] [--hold-out N]", " [--unchecked]", "the synopsis of fit lacks --hold-out"),
    "an invented option": (PAGE, "symrig lint scan.toml ", "symrig lint scan.toml [--fast] ", "lint has no --fast"),
    "a missing scene": (PAGE, "| `gummy` | three translucent blobs on a dim ground |\n", "", "the scene gummy is only in the command"),
    "an invented scene": (PAGE, "| `mirror` | ", "| `jelly` | one blob |\n| `mirror` | ", "the scene jelly is only in the document"),
    "another text of a scene": (PAGE, "with a curved mirror", "with a flat mirror", "the scene mirror: the command says"),
    "a missing key": (PAGE, "| `flare` | `0` | a number from 0 to 0.5 | share of light spread by a broad camera flare |\n", "", "the scene key flare is only in the command"),
    "another default of a key": (PAGE, "| `ratio` | `8` |", "| `ratio` | `4` |", "the scene key ratio: the command says"),
    "another range of a key": (PAGE, "| `psf` | `0` | a number from 0 to 0.25 |", "| `psf` | `0` | a number from 0 to 0.5 |", "the scene key psf: the command says"),
    "a missing algorithm": (PAGE, "| `brute` | One pattern a pixel. |\n", "", "the algorithm brute is only in the command"),
    "another default of bench": (PAGE, "| `--algorithms` | `paper,symrig,dual,brute` |", "| `--algorithms` | `paper,symrig,dual` |", "`bench --algorithms` has the default paper,symrig,dual,brute"),
    "a missing light": (PAGE, "| `letters` | the word SYMRIG |\n", "", "the light letters is only in the command"),
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
