# SPDX-License-Identifier: Apache-2.0
"""tools/plots: the pictures of docs/images are those of the tables beside them, and points are where numbers say."""

import pathlib
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
IMAGES = ROOT / "docs" / "images"
NAMES = ["error-over-patterns.svg", "error-over-rig-seconds.svg", "time-per-photograph.svg", "memory.svg"]
HEAD = "scene,rows,cols,channels,algorithm,tolerance,patterns,rig_seconds,host_seconds,tensor_bytes,indirect,failure\n"
ROW = "gummy,{rows},{rows},1,{algorithm},{tolerance},{patterns},10,0.1,1000,{indirect},\n"


def table(*captures):
    """A table with one row for each (algorithm, patterns, indirect)."""
    return HEAD + "".join(
        ROW.format(rows=16 * (k + 1), algorithm=name, tolerance=1e-3 / (k + 1), patterns=patterns, indirect=error)
        for k, (name, patterns, error) in enumerate(captures)
    )


def draw(*arguments):
    """Exit code, message, and {name: picture}."""
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(
            [sys.executable, "-B", ROOT / "tools" / "plots", "--output", folder, *arguments], capture_output=True, text=True, check=False
        )
        return done.returncode, done.stderr, {path.name: path.read_text(encoding="utf-8") for path in pathlib.Path(folder).iterdir()}


class Plots(unittest.TestCase):
    def drawn(self, text):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "bench.csv"
            path.write_text(text, encoding="utf-8")
            return draw(path, path)

    def test_the_pictures_of_the_documents_are_current(self):
        code, _, pictures = draw()
        self.assertEqual((code, sorted(pictures)), (0, sorted(NAMES)))
        for name, picture in pictures.items():
            self.assertEqual(picture, (IMAGES / name).read_text(encoding="utf-8"), f"{name}: run tools/plots")

    def test_a_number_moves_its_point_alone(self):
        before = self.drawn(table(("symrig", 100, 0.2), ("symrig", 200, 0.1), ("symrig", 400, 0.01)))[2]
        after = self.drawn(table(("symrig", 100, 0.2), ("symrig", 200, 0.05), ("symrig", 400, 0.01)))[2]
        self.assertNotEqual(before["error-over-patterns.svg"], after["error-over-patterns.svg"])
        self.assertEqual(before["memory.svg"], after["memory.svg"])

    def test_seeds_become_one_point(self):
        one = table(("symrig", 100, 0.1))
        picture = self.drawn(one + one.splitlines(keepends=True)[1])[2]["error-over-patterns.svg"]
        self.assertEqual(picture.count("<circle"), 2)  # one in the legend, one in the panel

    def test_captures_that_failed_are_left_out(self):
        failed = "gummy,16,16,1,paper,1e-3,1,1,1,1,0.5,no board\n"
        self.assertNotIn("paper", self.drawn(table(("symrig", 100, 0.1)) + failed)[2]["error-over-patterns.svg"])

    def test_a_table_without_captures_is_refused(self):
        code, message, pictures = self.drawn(HEAD)
        self.assertEqual((code, pictures), (1, {}))
        self.assertIn("holds no capture", message)


if __name__ == "__main__":
    unittest.main()
