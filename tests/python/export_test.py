# SPDX-License-Identifier: Apache-2.0
"""symrig export --dense: the matrix in NumPy, SciPy's reader of MATLAB files, and Octave where it is installed."""

import shutil
import subprocess

import numpy as np
import pytest
from scipy.io import loadmat

import symrig


def test_numpy_reads_the_matrix_and_a_rig_measures_it_again(groove, groove_file, command, tmp_path):
    command("export", groove_file, "--dense", tmp_path / "T.npy")
    matrix = np.load(tmp_path / "T.npy")
    assert matrix.dtype == np.float32 and np.array_equal(matrix, groove.to_numpy())
    light = symrig.light("letters", groove.light_shape)
    with symrig.open_rig(f"dense:{tmp_path}/T.npy?grid=32x24") as rig:
        seen = rig.measure(light)[0].mean
    # The rig sums in double and rounds once; the other product is a float sum: at most (n + 2) ε Σ|T||p|.
    limit = (light.size + 2) * 2.0**-24 * (np.abs(matrix).astype(float) @ light.ravel())
    assert np.all(np.abs(seen.ravel() - matrix @ light.ravel()) <= limit)


def test_matlab_s_order(groove, groove_file, command, tmp_path):
    command("export", groove_file, "--dense", tmp_path / "T.mat")
    file = loadmat(tmp_path / "T.mat")
    assert file["light_size"].tolist() == [[32, 24]] and file["photo_size"].tolist() == [[32, 24]]
    light = symrig.light("bar", groove.light_shape)
    photograph = (file["T"] @ light.ravel(order="F")).reshape((32, 24), order="F")
    assert np.allclose(photograph, groove @ light, rtol=1e-5, atol=1e-7) and photograph.max() > 0.1
    assert np.array_equal(np.sort(file["T"], axis=None), np.sort(groove.to_numpy(), axis=None))


def test_octave_relights(groove, groove_file, command, tmp_path):
    octave = shutil.which("octave-cli")
    if octave is None:
        pytest.skip("there is no Octave")
    command("export", groove_file, "--dense", tmp_path / "T.mat")
    script = """
        load('T.mat');
        light = zeros(light_size); light(5, 3) = 1; light(20, 17) = 0.5;
        photograph = reshape(double(T) * light(:), photo_size);
        projector_view = reshape(double(T)' * light(:), light_size);
        save('-v7', 'out.mat', 'photograph', 'projector_view');
    """
    subprocess.run([octave, "--no-gui", "--eval", script], cwd=tmp_path, check=True, capture_output=True)
    light = np.zeros((32, 24))
    light[4, 2], light[19, 16] = 1, 0.5
    out = loadmat(tmp_path / "out.mat")
    assert np.allclose(out["photograph"], groove @ light, rtol=1e-5, atol=1e-7)
    assert np.allclose(out["projector_view"], groove.T @ light, rtol=1e-5, atol=1e-7)


def test_what_cannot_be_a_matrix_is_refused(colour, groove_file, command, tmp_path):
    colour.save(tmp_path / "colour.h5")
    for words, code, message in [
        ((tmp_path / "colour.h5", "--dense", "T.npy"), 2, "has 3 channels"),
        ((groove_file, "--dense", "T.txt"), 2, "suffix .npy nor .mat"),
        ((groove_file, "--dense", "T.h5"), 2, "suffix"),
        ((tmp_path / "none.h5", "--dense", "T.npy"), 4, "none.h5"),
    ]:
        with pytest.raises(subprocess.CalledProcessError) as refusal:
            command("export", *words, cwd=tmp_path)
        assert refusal.value.returncode == code and message in refusal.value.stderr
    assert not list(tmp_path.glob("T.*"))


def test_a_scene_beyond_the_limit_is_refused(command, tmp_path):
    command("capture", "--rig", "sim:plane?size=160x160&noise=off", "-o", tmp_path / "large.h5", "--max-patterns", 10)
    with pytest.raises(subprocess.CalledProcessError) as refusal:
        command("export", tmp_path / "large.h5", "--dense", tmp_path / "T.npy")
    assert refusal.value.returncode == 5 and "the limit is" in refusal.value.stderr
