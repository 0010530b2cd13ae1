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


HDF5_KINDS = [
    {},
    {"dtype": ">f8"},
    {"dtype": "f4"},
    {"dtype": "i2"},
    {"chunks": (5, 7), "fletcher32": True},
    {"chunks": (16, 16), "compression": "gzip", "shuffle": True},
    {"chunks": (5, 7), "maxshape": (None, PIXELS), "compression": "gzip"},
    {"chunks": (5, 7), "maxshape": (PIXELS, None)},
    {"chunks": (3, 7), "maxshape": (None, None), "compression": "gzip"},
    {"chunks": (1, 1)},
]


@pytest.mark.parametrize("layout", ["earliest", "latest"])
@pytest.mark.parametrize("options", HDF5_KINDS)
def test_hdf5_of_h5py(options, layout, tmp_path):
    """Each index of chunks, each filter and each kind of number, in both layouts of the HDF5 library."""
    with h5py.File(tmp_path / "T.h5", "w", libver=layout) as file:
        file.create_dataset("T", data=T, **options)
        file["note"] = "not a matrix"
    assert np.array_equal(measured(tmp_path / "T.h5"), T)


def test_hdf5_through_links_and_with_parts_that_were_never_written(tmp_path):
    with h5py.File(tmp_path / "T.h5", "w") as file:
        for k in range(40):
            file[f"group/{k}"] = k
        stored = file.create_dataset("group/T", shape=T.shape, dtype="f8", chunks=(5, 5), fillvalue=2)
        stored[10:15] = T[10:15]
        file["T"] = h5py.SoftLink("/group/T")
    expected = np.full_like(T, 2)
    expected[10:15] = T[10:15]
    assert np.array_equal(measured(tmp_path / "T.h5"), expected)


def test_hdf5_that_is_not_read_is_named(tmp_path):
    with h5py.File(tmp_path / "lzf.h5", "w") as file:
        file.create_dataset("T", data=T, chunks=(5, 5), compression="lzf")
    with h5py.File(tmp_path / "link.h5", "w") as file:
        file["T"] = h5py.ExternalLink("other.h5", "T")
    with h5py.File(tmp_path / "complex.h5", "w") as file:
        file["T"] = T + 1j
    for name, why in (("lzf.h5", "stored with LZF"), ("link.h5", "link to another file"), ("complex.h5", "no real numbers")):
        with pytest.raises(symrig.Error, match=f"{name}: .*{why}"):
            symrig.open_rig(f"dense:{tmp_path}/{name}")


def test_damaged_hdf5_is_refused_or_read(tmp_path):
    """The older layout has no checksums over its structures: each number in them is tried as it is."""
    path = tmp_path / "T.h5"
    with h5py.File(path, "w") as file:
        file.create_dataset("T", data=T, chunks=(5, 7), compression="gzip")
        file.attrs["note"] = "a text"
    whole, random, outcomes = path.read_bytes(), np.random.default_rng(1), set()
    for _ in range(200):
        damaged = bytearray(whole)
        at, size = int(random.integers(2048)), int(random.choice([1, 2, 4, 8]))
        damaged[at : at + size] = int(random.choice([0, 1, 255, 2**31, 2**32 - 1, at, len(whole)])).to_bytes(8, "little")[:size]
        path.write_bytes(damaged)
        try:
            symrig.open_rig(f"dense:{path}?grid={GRID[0]}x{GRID[1]}").close()
            outcomes.add("read")
        except symrig.Error as error:
            assert "T.h5" in str(error) and "\n" not in str(error)
            outcomes.add("refused")
    assert outcomes == {"read", "refused"}


def test_sparse_matrix_of_level_7_3(tmp_path):
    """MATLAB stores a sparse T as a group. Another matrix in the file is not T."""
    path = tmp_path / "T.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        file["A"] = MATLAB
        group = file.create_group("T")
        group.attrs["MATLAB_sparse"] = np.uint64(PIXELS)
        group["data"] = np.ones(PIXELS)
        group["ir"] = np.arange(PIXELS, dtype=np.uint64)
        group["jc"] = np.arange(PIXELS + 1, dtype=np.uint64)
    with open(path, "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")
    with pytest.raises(symrig.Error, match=r"T is sparse: give full\(T\)"):
        symrig.open_rig(f"dense:{path}")


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
