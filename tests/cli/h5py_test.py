# SPDX-License-Identifier: Apache-2.0
"""A stranger reads scene.h5: T · pattern computed by the document's own numpy code equals `symrig relight`.

usage: h5py_test.py SYMRIG FILE_FORMAT_MD
Runs the first Python block of docs/file-format.md as it is printed there. Exit code 77: h5py or numpy is not installed.
"""

import pathlib
import re
import subprocess
import sys
import tempfile

try:
    import h5py
    import numpy as np
except ImportError as missing:
    print(f"skipped: {missing}; install python3-h5py and python3-numpy")
    sys.exit(77)

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "tools"))
import command_help


def read_pfm(path):
    """Rows × columns × channels, first row on top (PFM stores the last row first)."""
    with open(path, "rb") as file:
        kind = file.readline().strip()
        cols, rows = map(int, file.readline().split())
        order = "<" if float(file.readline()) < 0 else ">"
        values = np.frombuffer(file.read(), dtype=order + "f4")
    return values.reshape(rows, cols, 3 if kind == b"PF" else 1)[::-1]


def write_pfm(path, picture):
    rows, cols = picture.shape
    head = f"Pf\n{cols} {rows}\n-1.0\n".encode()
    pathlib.Path(path).write_bytes(head + picture[::-1].astype("<f4").tobytes())


def documented_apply(document):
    """The function `apply` of the document."""
    block = re.search(r"```python\n(.*?)```", pathlib.Path(document).read_text(encoding="utf-8"), re.S)
    names = {}
    exec(block.group(1), names)  # our own document
    return names["apply"]


def check(symrig, apply, folder, rig, algorithm):
    scene, light, relit = (str(folder / name) for name in ("scene.h5", "light.pfm", "relit.pfm"))
    subprocess.run([symrig, "capture", "--rig", rig, "-o", scene, "--algorithm", algorithm], check=True, capture_output=True)
    with h5py.File(scene, "r") as file:
        grid = tuple(int(n) for n in file.attrs["projector_grid"])
        channels = int(file.attrs["channels"])
    pattern = np.random.default_rng(5).random(grid).astype("f4")
    write_pfm(light, pattern)
    subprocess.run([symrig, "relight", scene, "--light", light, "-o", relit], check=True, capture_output=True)
    measured = read_pfm(relit)
    for channel in range(channels):
        expected = apply(scene, pattern, channel)
        # symrig sums in float, numpy in double: (pixels + leaves on a path) float steps of the brightest pixel bound it.
        bound = 2.0**-24 * (pattern.size + 200) * np.abs(expected).max()
        worst = np.abs(measured[:, :, channel] - expected).max()
        print(f"{rig} {algorithm} channel {channel}: worst difference {worst:.3g}, bound {bound:.3g}, brightest {expected.max():.3g}")
        assert expected.max() > 0 and worst <= bound


def main():
    symrig, document = sys.argv[1:]
    apply = documented_apply(document)
    with tempfile.TemporaryDirectory() as folder:
        for algorithm in command_help.algorithms(symrig):
            for channels in (1, 3):
                rig = f"sim:vgroove-textured?size=12x17&noise=off&channels={channels}"
                check(symrig, apply, pathlib.Path(folder), rig, algorithm)


main()
