# SPDX-License-Identifier: Apache-2.0
"""scene @ light: all forms of light, the transpose, and the command's answer."""

import threading
import warnings

import h5py
import numpy as np
import pytest
from scipy.sparse.linalg import LinearOperator, aslinearoperator

import symrig

EPS = 2.0**-24


def bound(matrix, light):
    """Of float sums: (|J| + leaves on the path + 4) ε Σ|T||p|. |J| and the leaves are at most the number of pixels."""
    return (2 * matrix.shape[1] + 4) * EPS * (np.abs(matrix).astype(float) @ np.abs(light.ravel()))


def test_the_command_gives_the_same_photograph(groove, groove_file, command, tmp_path):
    for light in ("letters", "natural"):
        command("relight", groove_file, "--light", light, "-o", tmp_path / "out.pfm")
        seen = symrig.read_image(tmp_path / "out.pfm")
        photograph = groove @ symrig.light(light, groove.light_shape)
        assert photograph.dtype == np.float32 and photograph.max() > 0.01
        assert np.array_equal(photograph, seen)


def test_the_dual_of_the_command_is_the_same(groove, groove_file, command, tmp_path):
    command("dual", groove_file, "--light", "bar", "-o", tmp_path / "dual.pfm")
    bar = symrig.light("bar", groove.photo_shape)
    assert np.array_equal(groove.T @ bar, symrig.read_image(tmp_path / "dual.pfm"))
    assert np.array_equal(groove.dual(bar), groove.T @ bar)


@pytest.mark.parametrize("name", ["groove", "colour"])
def test_all_forms_of_light_agree_with_the_matrix(name, request, noise):
    scene = request.getfixturevalue(name)
    matrix = scene.to_numpy()
    assert matrix.shape == scene.shape
    lights = noise.random((*scene.light_shape, 18)).astype(np.float32)  # more than one batch of 16
    photographs = scene @ lights
    assert photographs.shape == (*scene.photo_shape, 18)
    flat = scene @ lights.reshape(-1, 18)
    assert np.array_equal(flat, photographs.reshape(-1, 18))
    for k in range(18):
        limit = bound(matrix, lights[..., k])
        wanted = matrix.astype(float) @ lights[..., k].ravel()
        one = scene @ lights[..., k]
        assert one.shape == scene.photo_shape
        assert np.array_equal(scene @ lights[..., k].ravel(), one.ravel())
        assert np.all(np.abs(one.ravel() - wanted) <= limit)
        assert np.all(np.abs(photographs[..., k].ravel() - wanted) <= limit)


@pytest.mark.parametrize("name", ["groove", "colour"])
def test_the_transpose_is_the_transpose(name, request, noise):
    scene = request.getfixturevalue(name)
    matrix = scene.to_numpy().astype(float)
    picture = noise.standard_normal(scene.photo_shape).astype(np.float32)
    wanted = matrix.T @ picture.ravel()
    seen = scene.T @ picture
    assert seen.shape == scene.light_shape
    assert np.all(np.abs(seen.ravel() - wanted) <= bound(matrix.T, picture))
    several = np.stack([picture, -picture, 2 * picture], -1)
    assert np.allclose((scene.T @ several)[..., 2], 2 * seen, rtol=0, atol=4 * bound(matrix.T, picture).max())
    assert scene.T.T is scene and scene.H.shape == scene.shape[::-1]
    assert np.array_equal(scene.rmatvec(picture.ravel()), seen.ravel())


def test_a_channel_is_a_square_operator(colour, noise):
    light = noise.random(colour.light_shape)
    for k in range(3):
        channel = colour.channel(k)
        assert channel.shape == (192, 192)
        assert np.array_equal(channel @ light, (colour @ light)[..., k])
        assert np.array_equal(channel.T @ light, colour.dual(light)[..., k])
    with pytest.raises(symrig.UsageError, match="there is no channel 3"):
        colour.channel(3)


def test_it_is_a_linear_operator(groove, noise):
    assert isinstance(groove, LinearOperator) and aslinearoperator(groove) is groove
    light = noise.random(groove.shape[1])
    assert np.allclose((2 * groove) @ light, 2 * (groove @ light))
    assert np.allclose((groove * groove) @ light, groove @ (groove @ light))
    assert np.allclose(groove @ (light + 1j), groove @ light + 1j * (groove @ np.ones_like(light)), rtol=1e-5)
    assert np.array_equal(groove.matmat(np.eye(groove.shape[1])[:, :3]), groove.to_numpy()[:, :3])
    assert (groove @ np.zeros((groove.shape[1], 0))).shape == (groove.shape[0], 0)


def test_the_answer_owns_no_copy_and_lives_on(groove_file):
    scene = symrig.load(groove_file)
    photograph, held_out = scene @ np.ones(scene.light_shape, np.float32), scene.held_out
    total, first = photograph.sum(), held_out[0].photograph.copy()
    assert not held_out[0].photograph.flags.owndata and not held_out[0].photograph.flags.writeable
    assert not photograph.flags.owndata and photograph.flags.writeable
    del scene
    assert photograph.sum() == total and np.array_equal(held_out[0].photograph, first)


def test_the_interpreter_runs_on_while_a_scene_is_applied(groove):
    """Other threads apply at once and agree; with the lock held, none could run inside apply()."""
    light = np.ones(groove.light_shape, np.float32)
    wanted, seen = groove @ light, []
    threads = [threading.Thread(target=lambda: seen.extend(groove @ light for _ in range(20))) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(seen) == 80 and all(np.array_equal(one, wanted) for one in seen)


@pytest.mark.parametrize("light", [np.ones((3, 3)), np.ones(5), np.ones((2, 32, 24)), np.ones((32, 24, 2, 2))])
def test_a_light_of_another_shape_is_refused(groove, light):
    with pytest.raises(symrig.InputError) as refusal:
        groove @ light
    assert refusal.value.code == 303 and "(32, 24)" in refusal.value.next_step


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_light_that_is_no_number_is_refused(groove, bad):
    light = np.ones(groove.light_shape)
    light[3, 2] = bad
    with pytest.raises(symrig.InputError, match=r"pixel \(row 3, column 2\) of channel 0 is (NaN|infinite)") as refusal:
        groove @ light
    assert refusal.value.name == "bad_value"


def test_levels_errors_and_held_out_are_those_of_the_file(groove, groove_file, command):
    facts = groove.facts
    assert [level.rank1 for level in groove.levels] == facts["leaves_per_level"]["rank1"]
    assert [level.empty for level in groove.levels] == facts["leaves_per_level"]["empty"]
    errors = groove.errors()
    assert errors["frobenius"].value == facts["estimated_error"]["frobenius"]
    assert errors["relight bar"].half_width == facts["estimated_error_uncertainty"]["relight"]["bar"]
    with h5py.File(groove_file) as file:
        assert len(groove.held_out) == file.attrs["held_out_count"] >= 6
        assert np.array_equal(groove.held_out[2].photograph, file["held_out/2/photograph"][0])
    assert [error.name for error in groove.held_out_errors()] == [one.name for one in groove.held_out]


def test_errors_against_the_truth_are_those_of_evaluate(groove, groove_file, command, tmp_path):
    import json

    rig = "sim:vgroove-textured?size=32x24"
    command("evaluate", groove_file, "--rig", rig, "--json", tmp_path / "e.json")
    wanted = json.loads((tmp_path / "e.json").read_text())["error"]
    seen, steps = groove.errors(rig, progress=steps_of(stop_after=None)), []
    assert seen["frobenius"].value == wanted["frobenius"]
    assert seen["relight natural"].value == wanted["relight"]["natural"]
    with pytest.raises(symrig.Interrupted):
        groove.errors(rig, progress=steps_of(stop_after=3, steps=steps))
    assert len(steps) == 3
    with pytest.raises(symrig.InputError, match="the rig is 16x16"):
        groove.errors("sim:vgroove-textured?size=16x16")


def steps_of(stop_after, steps=None):
    steps = [] if steps is None else steps

    def progress(event):
        steps.append(event)
        return stop_after is None or len(steps) < stop_after

    return progress


def test_a_scene_left_in_its_file_is_the_same(groove, tmp_path):
    groove.save(tmp_path / "scene.h5")
    left = symrig.load(tmp_path / "scene.h5", memory=1)
    light = np.linspace(0, 1, groove.shape[1], dtype=np.float32)
    assert np.array_equal(left @ light, groove @ light)
    assert np.array_equal(left.T @ (left @ light), groove.T @ (groove @ light))


def test_save_and_load_is_the_same(groove, tmp_path):
    groove.save(tmp_path / "copy.h5")
    copy = symrig.load(tmp_path / "copy.h5")
    assert np.array_equal(copy.to_numpy(), groove.to_numpy()) and copy.facts == groove.facts
    with pytest.raises(symrig.UsageError, match="suffix"):
        groove.save(tmp_path / "copy.png")
    with pytest.raises(symrig.InputError) as refusal:
        symrig.load(tmp_path / "none.h5")
    assert refusal.value.code == 300
    (tmp_path / "text.h5").write_text("no scene")
    with pytest.raises(symrig.InputError) as refusal:
        symrig.load(tmp_path / "text.h5")
    assert refusal.value.code == 302


def test_a_large_scene_is_not_made_a_matrix(groove):
    with pytest.raises(symrig.LimitError, match="the limit is") as refusal:
        groove.to_numpy(max_bytes=1000)
    assert refusal.value.code == 400


def test_views(command, tmp_path):
    scene = symrig.capture("sim:views2?size=24x24&noise=off", polish=0)
    scene.save(tmp_path / "views.h5")
    assert scene.views == (2, 2)
    light = symrig.light("letters", (12, 12))
    one = scene.relight(light, from_view=(1, 0), to_view=(0, 1))
    command("relight", tmp_path / "views.h5", "--light", "letters", "--from-view", "1,0", "--to-view", "0,1", "-o", tmp_path / "o.pfm")
    assert np.array_equal(one, symrig.read_image(tmp_path / "o.pfm"))
    several = scene.relight(np.stack([light, 0 * light], -1), from_view=(1, 0), to_view=(0, 1))
    assert np.array_equal(several[..., 0], one) and not several[..., 1].any()
    with pytest.raises(symrig.UsageError, match="there is no view 2,0"):
        scene.relight(light, from_view=(2, 0))


def test_stopped_at_a_level(groove):
    coarse = groove.stopped_at(1)
    assert coarse.shape == groove.shape and coarse.nbytes < groove.nbytes
    assert not np.array_equal(coarse.flood_lit(), groove @ np.zeros(groove.light_shape))
    with pytest.raises(symrig.UsageError, match="there is no level 99"):
        groove.stopped_at(99)


def test_a_notebook_shows_picture_errors_and_levels(groove, colour):
    for scene in (groove, colour):
        page = scene._repr_html_()
        assert page.count("<img") == 1 and "data:image/png;base64," in page
        assert "frobenius" in page and "subdivided" in page
    assert "32x24" in repr(groove) and "3 channels" in repr(colour)
    assert groove.report("groove").startswith("<!")


@pytest.mark.parametrize("apply", [lambda scene, x: scene @ x, lambda scene, x: scene.relight(x), lambda scene, x: scene.dual(x), lambda scene, x: scene.T @ x, lambda scene, x: scene @ x.ravel()])
def test_codes_of_a_picture_are_no_light(groove, apply):
    light = np.linspace(0, 255, int(np.prod(groove.light_shape))).reshape(groove.light_shape)
    for codes, white in ((light.astype(np.uint8), 255), ((257 * light).astype(np.uint16), 65535)):
        with pytest.raises(symrig.InputError, match=rf"codes from 0 to {white} .*divide the picture by {white}"):
            apply(groove, codes)
    mask = (light > 100).astype(np.uint8)
    assert np.array_equal(apply(groove, mask), apply(groove, mask.astype(np.float32)))


def test_colour_that_is_lost_is_told(groove, tmp_path):
    colour = np.random.default_rng(1).uniform(0, 1, (*groove.light_shape, 3)).astype(np.float32)
    symrig.write_image(tmp_path / "colour.pfm", colour)
    symrig.write_image(tmp_path / "gray.pfm", np.repeat(symrig.gray(colour)[..., None], 3, axis=2))
    with pytest.warns(UserWarning, match="colour.pfm is in colour; its luminance is the light"):
        light = symrig.light(tmp_path / "colour.pfm", groove.light_shape)
    assert np.array_equal(light, symrig.gray(colour))
    with pytest.warns(UserWarning, match="these are 3 lights, not one in colour"):
        assert (groove @ colour).shape[-1] == 3
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        symrig.light(tmp_path / "gray.pfm", groove.light_shape)
        groove @ np.dstack([colour, colour])
