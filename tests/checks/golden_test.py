# SPDX-License-Identifier: Apache-2.0
"""tools/golden: equal folders pass; one planted difference in any kind of file is named, and the exit code is not 0.

usage: golden_test.py SYMRIG
"""

import json
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

try:
    import h5py
except ImportError:
    print("golden_test: skipped, python3-h5py is not installed")
    sys.exit(77)

GOLDEN = pathlib.Path(__file__).resolve().parents[2] / "tools" / "golden"
CASE = "no-log"  # one that takes a second


def golden(*words):
    """Exit code and printed lines."""
    done = subprocess.run([sys.executable, "-B", GOLDEN, *words], capture_output=True, text=True, check=False)
    return done.returncode, done.stdout.splitlines()


def change_byte(path):
    data = bytearray(path.read_bytes())
    data[-1] ^= 1
    path.write_bytes(data)


def change_number(path):
    numbers = json.loads(path.read_text(encoding="utf-8"))
    numbers["tensor_bytes"] += 1
    path.write_text(json.dumps(numbers), encoding="utf-8")


def change_clock(path):
    numbers = json.loads(path.read_text(encoding="utf-8"))
    numbers["seconds"]["total"] += 1
    path.write_text(json.dumps(numbers), encoding="utf-8")


def change_dataset(path):
    """The last bit of the first number of the largest dataset."""
    with h5py.File(path, "r+") as file:
        found = []
        file.visititems(lambda _, item: found.append(item) if isinstance(item, h5py.Dataset) and item.size else None)
        largest = max(found, key=lambda item: item.size)
        values = largest[...]
        values.view("uint8").reshape(-1)[0] ^= 1
        largest[...] = values


def change_picture(path):
    text = path.read_text(encoding="utf-8")
    at = text.index("base64,") + len("base64,") + 60
    path.write_text(text[:at] + ("A" if text[at] != "A" else "B") + text[at + 1 :], encoding="utf-8")


def change_word(path):
    text = path.read_text(encoding="utf-8")
    assert "Held-out" in text
    path.write_text(text.replace("Held-out", "Heldout", 1), encoding="utf-8")


PLANTED = [
    ("relit.pfm", change_byte),
    ("capture.json", change_number),
    ("scene.h5", change_dataset),
    ("report.html", change_picture),
    ("report.html", change_word),
    ("codes.txt", change_byte),
]


class Golden(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.root = pathlib.Path(folder.name)
        cls.before, cls.again, cls.after = (cls.root / name for name in ("before", "again", "after"))
        for side in (cls.before, cls.again):
            assert golden("record", SYMRIG, side, "--only", CASE)[0] == 0

    def setUp(self):
        shutil.rmtree(self.after, ignore_errors=True)
        shutil.copytree(self.before, self.after)

    def test_two_recordings_are_equal(self):
        code, printed = golden("compare", self.before, self.again)
        self.assertEqual(code, 0, printed)
        self.assertRegex(printed[-1], r"^golden: 8 files compared, 0 differences$")

    def test_each_planted_difference_is_named(self):
        for name, change in PLANTED:
            with self.subTest(f"{name}, {change.__name__}"):
                self.setUp()
                change(self.after / CASE / name)
                code, printed = golden("compare", self.before, self.after)
                self.assertEqual((code, printed[:-1]), (1, [f"{CASE}/{name}: differs"]))

    def test_a_file_of_one_side_is_named(self):
        (self.after / CASE / "relit.pfm").unlink()
        self.assertEqual(golden("compare", self.before, self.after)[1][0], f"{CASE}/relit.pfm: only in one")

    def test_a_clock_is_not_compared(self):
        change_clock(self.after / CASE / "capture.json")
        self.assertEqual(golden("compare", self.before, self.after)[0], 0)

    def test_empty_folders_are_no_pass(self):
        (self.root / "empty").mkdir()
        self.assertEqual(golden("compare", self.root / "empty", self.root / "empty")[0], 1)

    def test_a_case_that_does_not_exist_is_refused(self):
        self.assertEqual(golden("record", SYMRIG, self.root / "none", "--only", "nosuch")[0], 2)


if __name__ == "__main__":
    SYMRIG = sys.argv.pop()
    unittest.main()
