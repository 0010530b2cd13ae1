# SPDX-License-Identifier: Apache-2.0
"""dense:FILE, a matrix as a rig of the library; and the same matrix as a rig of Python."""

import hashlib
import subprocess

import numpy as np
import pytest

import symrig
from capture_test import Matrix, integers


class Seen:
    """Digests of patterns, in their order."""

    def __init__(self):
        self.digests = []

    def add(self, patterns):
        self.digests += [hashlib.sha256(np.ascontiguousarray(pattern)).hexdigest() for pattern in patterns]


class Library(symrig.Probe):
    """The library's rig; notes the patterns that pass."""

    def __init__(self, rig, seen):
        self.rig, self.grid, self.seen = rig, rig.grid, seen

    def measure(self, patterns):
        self.seen.add(patterns)
        return self.rig.measure(patterns)


class Python(Matrix):
    """The same T, multiplied by numpy."""

    def __init__(self, t, grid, seen):
        super().__init__(t, grid)
        self.seen = seen

    def measure(self, patterns):
        self.seen.add(patterns)
        return super().measure(patterns)


@pytest.mark.parametrize("grid", [(16, 16), (9, 14)])
def test_a_python_probe_is_the_library_s_bit_for_bit(grid, tmp_path):
    """T is of small integers, so a photograph is exact in any order of sums; patterns are binary."""
    t = integers(grid)
    np.save(tmp_path / "T.npy", t)
    name = f"dense:{tmp_path}/T.npy?grid={grid[0]}x{grid[1]}"
    direct = symrig.capture(name, polish=0)
    mine, theirs = Seen(), Seen()
    passed = symrig.capture(Library(symrig.open_rig(name), theirs), polish=0)
    python = symrig.capture(Python(t, grid, mine), polish=0)
    # Below 256 pixels, each pixel alone and seven photographs judge the rig afterwards. A search that has found nothing to
    # rely on looks again at five photographs that are no part of the capture.
    pixels = grid[0] * grid[1]
    judging = pixels + 7 if pixels < 256 else 0
    assert mine.digests == theirs.digests and len(mine.digests) - direct.facts["patterns"] - judging in (0, 5)
    assert direct.facts["patterns"] > 20
    for scene in (passed, python):
        assert np.array_equal(scene.to_numpy(), direct.to_numpy())
        assert scene.facts["patterns_per_level"] == direct.facts["patterns_per_level"]
    assert np.linalg.norm(direct.to_numpy() - t) < 0.05 * np.linalg.norm(t)


def test_all_forms_of_a_file_are_the_same_rig(tmp_path):
    t = integers((4, 6))
    np.save(tmp_path / "a.npy", t)
    np.save(tmp_path / "b.npy", np.asfortranarray(t.astype(float)))
    np.save(tmp_path / "c.npy", t.reshape(4, 6, 4, 6))
    with open(tmp_path / "d.npy", "wb") as file:
        np.lib.format.write_array(file, t, version=(2, 0))
    light = np.random.default_rng(0).integers(0, 2, (4, 6))
    for name in ("a.npy?grid=4x6", "b.npy?grid=4x6", "c.npy", "d.npy?grid=4x6"):
        with symrig.open_rig(f"dense:{tmp_path}/{name}") as rig:
            assert rig.grid == (4, 6)
            assert np.array_equal(rig.measure(light)[0].mean.ravel(), t @ light.ravel().astype(np.float32))
    np.save(tmp_path / "skew.npy", np.triu(t))
    skew = np.triu(t).astype(np.float32)
    with symrig.open_rig(f"dense:{tmp_path}/skew.npy?grid=4x6") as rig:
        assert np.array_equal(rig.measure(light)[0].mean.ravel(), skew @ light.ravel().astype(np.float32))
    scene = symrig.capture(f"dense:{tmp_path}/skew.npy?grid=4x6", algorithm="brute")
    assert np.array_equal(scene.to_numpy(), skew)
    np.save(tmp_path / "square.npy", integers((3, 3)))
    assert symrig.open_rig(f"dense:{tmp_path}/square.npy").grid == (3, 3)


@pytest.mark.parametrize(
    "make, query, message",
    [
        (lambda t: t, "", "has the shape"),
        (lambda t: t, "?grid=5x5", "has the shape"),
        (lambda t: t, "?grid=4", "is no size"),
        (lambda t: t[:, :3], "?grid=4x6", "has the shape"),
        (lambda t: t.astype(int), "?grid=4x6", "its numbers are '<i8'"),
        (lambda t: np.where(t == t[2, 3], np.nan, t), "?grid=4x6", r"T\[\d+, \d+\] is not a finite float"),
        (lambda t: t.astype(float) * 1e40, "?grid=4x6", "is not a finite float"),
        (lambda t: t.astype(float) * 1e-300, "?grid=4x6", "T has no value of 1e-30 or more"),
        (np.zeros_like, "?grid=4x6", "T has no value of 1e-30 or more"),
        (lambda t: np.float32(3), "", "has the shape"),
    ],
)
def test_a_wrong_matrix_is_refused(make, query, message, tmp_path):
    np.save(tmp_path / "T.npy", make(integers((4, 6))))
    with pytest.raises(symrig.Error, match=message):
        symrig.open_rig(f"dense:{tmp_path}/T.npy{query}")


def test_damaged_files_are_refused(tmp_path):
    np.save(tmp_path / "T.npy", integers((3, 4)))
    whole = (tmp_path / "T.npy").read_bytes()
    for size in (0, 5, 9, 11, 40, len(whole) - 1):
        (tmp_path / "cut.npy").write_bytes(whole[:size])
        with pytest.raises(symrig.InputError, match="cut.npy"):
            symrig.open_rig(f"dense:{tmp_path}/cut.npy?grid=3x4")
    noise = np.random.default_rng(5)
    for _ in range(200):
        head = bytearray(whole)
        head[noise.integers(0, 128)] = noise.integers(0, 256)
        (tmp_path / "flip.npy").write_bytes(head)
        try:
            symrig.open_rig(f"dense:{tmp_path}/flip.npy?grid=3x4").close()
        except symrig.Error:
            pass


def test_the_command_takes_a_matrix_and_refuses_a_skew_one(tmp_path, command):
    np.save(tmp_path / "T.npy", integers((8, 8)))
    command("capture", "--rig", "dense:T.npy", "-o", "scene.h5", cwd=tmp_path)
    command("evaluate", "scene.h5", "--rig", "dense:T.npy", cwd=tmp_path)
    np.save(tmp_path / "skew.npy", np.triu(integers((8, 8))))
    with pytest.raises(subprocess.CalledProcessError) as refusal:
        command("capture", "--rig", "dense:skew.npy", "-o", "other.h5", cwd=tmp_path)
    assert refusal.value.returncode == 4 and "is not symmetric" in refusal.value.stderr
    with pytest.raises(subprocess.CalledProcessError) as refusal:
        command("capture", "--rig", "dense:scene.h5", "-o", "scene.h5", cwd=tmp_path)
    assert refusal.value.returncode == 2 and symrig.load(tmp_path / "scene.h5").light_shape == (8, 8)
