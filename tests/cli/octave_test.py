# SPDX-License-Identifier: Apache-2.0
"""host/octave/symrig_scene.m in Octave: relit and dual pictures against those of `symrig relight` and `symrig dual`.

Exit code 77: there is no Octave, or no h5py.
usage: octave_test.py SYMRIG FOLDER_OF_THE_READER
"""

import pathlib
import shutil
import subprocess
import sys
import tempfile

try:
    import h5py
    import numpy as np
except ImportError:
    sys.exit(77)

# Symmetric; colour; several views; a band; measured columns, which have no held-out photographs; few pixels, as columns.
SCENES = [
    ("sim:vgroove-textured?size=12x17", [], ""),
    ("sim:gummy?size=12x16&channels=3", [], ""),
    ("sim:views2?size=16x20&noise=off", [], ""),
    ("sim:plane?size=16x18&noise=off&psf=0.1", [], ""),
    ("sim:gummy?size=9x11", ["--algorithm", "brute"], ", [9 11]"),
    ("sim:occluder?size=8x10", ["--algorithm", "dual"], ", [8 10]"),
]

# The camera's own pixels, grey and in colour.
BENCH = "size=12x16&fine=4&camera=58x76&turn=1.5&zoom=0.784"
OWN_PIXELS = [f"sim:gummy?{BENCH}", f"sim:occluder?{BENCH}&channels=3"]


def read_pfm(path):
    data = path.read_bytes()
    kind, size, _, values = data.split(b"\n", 3)
    cols, rows = map(int, size.split())
    channels = 3 if kind == b"PF" else 1
    return np.frombuffer(values, "<f4").reshape(rows, cols, channels)[::-1].astype(float)


def write_pfm(path, picture):
    rows, cols = picture.shape
    path.write_bytes(b"Pf\n%d %d\n-1.0\n" % (cols, rows) + picture[::-1].astype("<f4").tobytes())


def absolute(scene, copy):
    """The same file with the absolute values of all parts: its pictures bound the sums of the others."""
    shutil.copy(scene, copy)
    with h5py.File(copy, "r+") as file:
        for name in ("leaves/factors", "diagonal/values", "scalars/values", "columns/values"):
            file[name][...] = np.abs(file[name][()])
        for band in file["bands"].values():
            band["values"][...] = np.abs(band["values"][()])


def octave(reader, folder, size):
    script = f"""
        addpath ('{reader}');
        scene = symrig_scene ('scene.h5'{size});
        light = load ('light.txt');
        for what = {{'relight', 'dual'}}
          picture = scene.(what{{1}}) (light);
          for channel = 1:scene.channels
            values = picture(:, :, channel);
            save ('-ascii', '-double', sprintf ('%s-%d.txt', what{{1}}, channel), 'values');
          end
        end
        printf ('%d %d %d %d', scene.camera, scene.channels, numel (scene.held_out));
        if (! isempty (scene.own))
          picture = scene.own.relight (light);
          for channel = 1:scene.channels
            values = picture(:, :, channel);
            save ('-ascii', '-double', sprintf ('own-%d.txt', channel), 'values');
          end
          printf (' %d', scene.own.camera);
        end
    """
    done = subprocess.run(["octave-cli", "--norc", "--eval", script], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return [int(word) for word in done.stdout.split()]


def check(symrig, reader, folder, rig, options, size):
    subprocess.run([symrig, "capture", "--rig", rig, "-o", "scene.h5", *options], cwd=folder, check=True, capture_output=True)
    absolute(folder / "scene.h5", folder / "absolute.h5")
    with h5py.File(folder / "scene.h5") as file:
        rows, cols = (int(v) for v in file.attrs["camera_grid"])
        stated = [rows, cols, int(file.attrs["channels"]), int(file.attrs["held_out_count"])]
    light = np.random.default_rng(1).integers(-8, 65, (rows, cols)) / 64  # exact in every file; negative light too
    np.savetxt(folder / "light.txt", light)
    write_pfm(folder / "light.pfm", light)
    write_pfm(folder / "bright.pfm", np.abs(light))
    assert octave(reader, folder, size) == stated, stated
    worst = 0
    for what in ("relight", "dual"):
        for scene, shone, out in (("scene.h5", "light.pfm", "ours.pfm"), ("absolute.h5", "bright.pfm", "most.pfm")):
            subprocess.run([symrig, what, scene, "--light", shone, "-o", out], cwd=folder, check=True, capture_output=True)
        ours, most = read_pfm(folder / "ours.pfm"), read_pfm(folder / "most.pfm")
        theirs = np.stack([np.loadtxt(folder / f"{what}-{c + 1}.txt", ndmin=2) for c in range(stated[2])], axis=2)
        # A pixel is a sum of at most n terms of each of up to 16 levels, in 32 bits: each product and each addition rounds
        # by 2^-24. Octave's sums are double. Rounding of `most` itself is in the factor 1.01.
        limit = 1.01 * (rows * cols + 16 + 2) * 2.0**-24 * most
        apart = np.abs(ours - theirs)
        assert np.all(apart <= limit), f"{rig} {what}: {np.max(apart / np.maximum(limit, 1e-300))} of the limit"
        assert np.abs(theirs).max() > 0
        worst = max(worst, float(apart.max() / np.abs(theirs).max()))
    return worst


def check_own(symrig, reader, folder, rig):
    """The camera's own pixels, of a registered bench, in each channel that a pixel sees."""
    for words in (["calibrate", "--rig", rig, "-o", "r.h5"], ["capture", "--rig", rig, "--registration", "r.h5", "-o", "scene.h5"]):
        subprocess.run([symrig, *words], cwd=folder, check=True, capture_output=True)
    with h5py.File(folder / "scene.h5") as file:
        camera, cells = file["camera"], tuple(file.attrs["camera_grid"])
        pixels, groups, grid = camera["pixels"][:], camera["groups"][:], tuple(int(v) for v in camera.attrs["grid"])
        columns = int(groups[:, 1].max())
    light = np.random.default_rng(1).integers(0, 65, cells) / 64
    np.savetxt(folder / "light.txt", light)
    write_pfm(folder / "light.pfm", light)
    assert tuple(octave(reader, folder, "")[-2:]) == grid
    subprocess.run([symrig, "relight", "scene.h5", "--light", "light.pfm", "-o", "ours.pfm"], cwd=folder, check=True, capture_output=True)
    ours, at, worst = read_pfm(folder / "ours.pfm"), 0, 0.0
    assert ours.shape[:2] == grid
    for channel, _, count in groups:
        of_group, at = pixels[at : at + count], at + count
        theirs = np.loadtxt(folder / f"own-{channel + 1}.txt", ndmin=2).flat[of_group]
        worst = max(worst, float(np.abs(ours[:, :, channel].flat[of_group] - theirs).max(initial=0)))
    # Sums of products of 32 bits: one for each cell of a column, and one for each column. Both signs occur in the columns,
    # whose sizes add up to at most the root of their number times the light.
    limit = (light.size + columns) * 2.0**-24 * np.sqrt(columns) * float(ours.max())
    assert 0 < worst <= limit, f"{rig}: {worst / limit} of the limit"
    return worst / float(ours.max())


def main(symrig, reader):
    if shutil.which("octave-cli") is None:
        return 77
    for rig, options, size in SCENES:
        with tempfile.TemporaryDirectory() as folder:
            print(f"{rig}: at most {check(symrig, reader, pathlib.Path(folder), rig, options, size):.2g} of the brightest pixel apart")
    for rig in OWN_PIXELS:
        with tempfile.TemporaryDirectory() as folder:
            print(f"{rig}: at most {check_own(symrig, reader, pathlib.Path(folder), rig):.2g} of the brightest pixel apart")
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
