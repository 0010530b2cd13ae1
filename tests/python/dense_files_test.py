# SPDX-License-Identifier: Apache-2.0
"""dense:FILE with files that SciPy and h5py wrote: the rig measures the matrix that they hold."""

import h5py
import numpy as np
import pytest
from scipy.io import savemat

import symrig

GRID = (5, 7)
PIXELS = GRID[0] * GRID[1]
T = np.arange(PIXELS**2, dtype=float).reshape(PIXELS, PIXELS) % 251
# MATLAB numbers pixels column after column: row and column k of its matrix are pixel ORDER[k].
ORDER = np.arange(PIXELS).reshape(GRID).ravel(order="F")
MATLAB = T[np.ix_(ORDER, ORDER)]


def measured(path, grid=True):
    """The matrix that the rig answers, column by column."""
    with symrig.open_rig(f"dense:{path}" + (f"?grid={GRID[0]}x{GRID[1]}" if grid else "")) as rig:
        photographs = rig.measure(np.eye(PIXELS, dtype=np.float32).reshape(PIXELS, *GRID))
    return np.stack([one.mean.ravel() for one in photographs], axis=1)


@pytest.mark.parametrize("options", [{"format": "4"}, {"format": "5"}, {"format": "5", "do_compression": True}])
@pytest.mark.parametrize("kind", [np.float64, np.float32])
def test_mat_of_scipy(options, kind, tmp_path):
    path = tmp_path / "T.mat"
    savemat(path, {"T": MATLAB.astype(kind), "light_size": np.array([GRID], float)}, **options)
    assert np.array_equal(measured(path), T)
    assert np.array_equal(measured(path, grid=False), T)


def test_mat_of_four_dimensions(tmp_path):
    savemat(tmp_path / "T.mat", {"T": T.reshape(*GRID, *GRID)}, do_compression=True)
    assert np.array_equal(measured(tmp_path / "T.mat", grid=False), T)


@pytest.mark.parametrize("options", [{}, {"compression": "gzip", "shuffle": True, "chunks": (16, 16)}])
def test_hdf5_of_h5py(options, tmp_path):
    with h5py.File(tmp_path / "T.h5", "w") as file:
        file.create_dataset("T", data=T, **options)
        file["note"] = "not a matrix"
    assert np.array_equal(measured(tmp_path / "T.h5"), T)


def test_mat_of_level_7_3(tmp_path):
    """MATLAB 7.3 is HDF5 behind a block of 512 bytes; a reader of rows sees its arrays transposed."""
    path = tmp_path / "T.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        file.create_dataset("T", data=MATLAB.T, compression="gzip")
        file["light_size"] = np.array(GRID, float).reshape(2, 1)
    with open(path, "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")
    assert np.array_equal(measured(path, grid=False), T)
    assert np.array_equal(measured(path), T)


def test_an_exported_scene_is_measured_again(groove, groove_file, command, tmp_path):
    command("export", groove_file, "--dense", tmp_path / "T.mat")
    with symrig.open_rig(f"dense:{tmp_path}/T.mat") as rig:
        seen = rig.measure(symrig.light("letters", groove.light_shape))[0].mean
    light = symrig.light("letters", groove.light_shape)
    matrix = groove.to_numpy()
    limit = (light.size + 2) * 2.0**-24 * (np.abs(matrix).astype(float) @ light.ravel())
    assert np.all(np.abs(seen.ravel() - matrix @ light.ravel()) <= limit)


def test_other_files_are_refused(tmp_path):
    savemat(tmp_path / "complex.mat", {"T": T + 1j})
    savemat(tmp_path / "none.mat", {"a": np.zeros((3, 4))})
    (tmp_path / "text.npy").write_text("not a matrix")
    for name, why in (("complex.mat", "complex"), ("none.mat", "no matrix"), ("text.npy", "neither")):
        with pytest.raises(symrig.Error, match=why):
            symrig.open_rig(f"dense:{tmp_path}/{name}")
