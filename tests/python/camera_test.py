# SPDX-License-Identifier: Apache-2.0
"""scene.camera: T on the camera's own pixels."""

import re

import h5py
import numpy as np
import pytest

import symrig


@pytest.fixture(scope="session")
def fine(fine_file):
    return symrig.load(fine_file)


@pytest.fixture(scope="session")
def matrix(fine):
    """Column by column, from one batch of units."""
    cells = np.prod(fine.light_shape)
    units = np.eye(cells, dtype=np.float32).reshape(*fine.light_shape, cells)
    return (fine.camera @ units).reshape(-1, cells).astype(float)


def test_the_command_gives_the_same_photograph(fine, fine_file, command, tmp_path):
    for light in ("letters", "bar"):
        command("relight", fine_file, "--light", light, "-o", tmp_path / "own.pfm")
        command("relight", fine_file, "--light", light, "--cells", "-o", tmp_path / "cells.pfm")
        shown = symrig.light(light, fine.light_shape)
        assert np.array_equal(fine.camera @ shown, symrig.read_image(tmp_path / "own.pfm"))
        assert np.array_equal(fine.camera.relight(shown), symrig.read_image(tmp_path / "own.pfm"))
        assert np.array_equal(fine @ shown, symrig.read_image(tmp_path / "cells.pfm"))


def test_many_lights_are_relit_on_camera_pixels(fine, fine_file, command, tmp_path):
    lights = tmp_path / "lights"
    lights.mkdir()
    for name in ("letters", "bar"):
        symrig.write_image(lights / f"{name}.pfm", symrig.light(name, fine.light_shape))
    command("relight", fine_file, "--lights", lights, "-o", tmp_path / "out")
    for name in ("letters", "bar"):
        seen = symrig.read_image(tmp_path / "out" / f"{name}.exr")
        wanted = fine.camera @ symrig.light(name, fine.light_shape)
        assert seen.shape == (76, 76)
        assert np.abs(seen - wanted).max() <= 1e-5 * wanted.max()


def test_all_forms_of_light_agree_with_the_matrix(fine, matrix, noise):
    camera = fine.camera
    assert camera.shape == matrix.shape == (76 * 76, 256)
    assert camera.photo_shape == (76, 76) and camera.light_shape == (16, 16)
    assert "76x76" in repr(camera) and camera.nbytes > 76 * 76
    lights = noise.random((16, 16, 18)).astype(np.float32)
    photographs = camera @ lights
    assert photographs.shape == (76, 76, 18)
    assert np.array_equal(camera.relight(lights), photographs)
    for k in range(18):
        one = camera @ lights[..., k]
        # Float sums of some hundred terms, of which none is above the light of its pixel by much.
        bound = 1e-4 * np.abs(matrix).sum(axis=1).max()
        assert np.abs(one.ravel() - matrix @ lights[..., k].ravel()).max() <= bound
        assert np.abs(photographs[..., k] - one).max() <= bound


def test_the_transpose_is_the_transpose(fine, matrix, noise):
    seen = noise.random((76, 76)).astype(np.float32)
    light = fine.camera.T @ seen
    assert light.shape == (16, 16)
    wanted = matrix.T @ seen.ravel().astype(float)
    assert np.abs(light.ravel() - wanted).max() <= 1e-4 * np.abs(wanted).max()
    assert fine.camera.T.T.photo_shape == (76, 76)


def test_camera_pixels_show_what_cells_do(fine):
    """The mean over the pixels of a cell, away from the borders of cells where light changes."""
    white = fine.camera @ np.ones((16, 16), np.float32)
    flood = fine @ np.ones((16, 16), np.float32)
    assert abs(white[white > 0].mean() / flood.mean() - 1) < 0.1


def test_the_capture_knows_its_errors(fine):
    said = fine.camera.errors()
    exact = fine.camera.errors("sim:gummy?size=16x16&fine=4&camera=76x76&turn=1.5&zoom=0.784")
    assert list(said) == list(exact) and len(said) == 7
    for key, (value, half_width) in said.items():
        assert abs(value - exact[key].value) <= half_width, key
    # Cells have more to hide: the light of the borders between them.
    assert said["indirect"].value < fine.errors()["indirect"].value
    with pytest.raises(symrig.InputError, match="camera has"):
        fine.camera.errors("sim:gummy?size=16x16&fine=4&camera=80x80")


def test_chi_square_is_that_of_noise_where_the_rows_are_right(fine):
    chi_square = fine.camera.chi_square
    seen = fine.camera @ np.ones((16, 16), np.float32) > 0
    assert chi_square.shape == (76, 76)
    assert np.all((chi_square > 0) == seen)
    # Of 10 photographs each: noise alone has a mean of 1 and a scatter of 0.45; the rows have noise of their own.
    assert 0.8 < np.median(chi_square[seen]) < 2


def test_other_pictures_are_refused(fine):
    for picture in (np.ones((16, 15)), np.ones((2, 16, 16, 3))):
        with pytest.raises(symrig.InputError):
            fine.camera.relight(picture)
        with pytest.raises(symrig.InputError):
            fine.camera @ picture
    with pytest.raises(symrig.InputError):
        fine.camera.relight(np.full((16, 16), 255, np.uint8))


def test_scenes_without_such_a_camera_have_none(groove):
    assert groove.camera is None


def test_a_saved_scene_keeps_it(fine, tmp_path):
    fine.save(tmp_path / "again.h5")
    again = symrig.load(tmp_path / "again.h5")
    light = symrig.light("letters", fine.light_shape)
    assert np.array_equal(again.camera @ light, fine.camera @ light)


def test_a_capture_may_leave_it_out(fine_file, folder, tmp_path):
    rig, registration = "sim:gummy?size=16x16&fine=4&camera=76x76&turn=1.5&zoom=0.784", folder / "fine-registration.h5"
    assert symrig.capture(rig, tmp_path / "a.h5", registration=registration, cells=True).camera is None
    assert symrig.capture(rig, tmp_path / "b.h5", registration=registration).camera is not None
    with pytest.warns(UserWarning, match="without a log"):
        assert symrig.capture(rig, tmp_path / "c.h5", registration=registration, log=False).camera is None


def test_the_reader_of_the_file_format_agrees(fine, fine_file, root):
    """The code of docs/file-format.md, as it stands there."""
    page = (root / "docs/file-format.md").read_text()
    code = next(block for block in re.findall(r"```python\n(.*?)```", page, re.DOTALL) if "def apply_camera" in block)
    names = {}
    exec(code, names)
    light = symrig.light("letters", fine.light_shape)
    wanted = fine.camera @ light
    assert np.abs(names["apply_camera"](fine_file, light) - wanted).max() <= 1e-5 * wanted.max()
    with h5py.File(fine_file) as file:
        assert file.attrs["version_minor"] == 1 and "camera" in file
