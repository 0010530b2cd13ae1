# SPDX-License-Identifier: Apache-2.0
"""Merging, decoding, calibrating, programs and boards."""

import numpy as np
import pytest

import symrig


def test_merge_weighs_frames_by_their_noise(noise):
    sensor = symrig.NoiseModel.from_electrons(full_well=20000, read_noise=6, bits=12, pedestal=64)
    light = np.linspace(2e3, 4e6, 48 * 40).reshape(48, 40)  # electrons per second
    exposures = [0.002, 0.016, 0.128]
    frames = []
    for t in exposures:
        electrons = np.minimum(noise.poisson(light * t) + noise.normal(0, 6, light.shape), 20000)
        frames.append(np.clip(np.rint(64 + sensor.gain * electrons), 0, 4095).astype(np.uint16))
    merged = symrig.merge(frames, exposures, sensor)
    assert merged.valid.all() and merged.valid.dtype == bool
    z = (merged.mean - light) / np.sqrt(merged.variance)
    # 1,920 standard normal values: the mean square scatters by sqrt(2/1920) = 0.032, and merge() states 2 % bias.
    assert abs(np.mean(z**2) - 1) < 5 * 0.032 + 0.02
    dead = np.zeros(light.shape, bool)
    dead[1, 2] = True
    some = symrig.merge(frames, exposures, sensor, scale=2.0, dead=dead)
    assert not some.valid[1, 2] and some.mean[1, 2] == 0
    assert np.allclose(some.mean[2:], 2 * merged.mean[2:])
    black = symrig.Radiance(np.full(light.shape, 100, np.float32), 25.0)
    less = symrig.merge(frames, exposures, sensor, black=black)
    assert np.allclose(less.mean, merged.mean - 100) and np.allclose(less.variance, merged.variance + 25)
    colour = symrig.merge(np.stack([frames] * 3, -1), exposures, sensor)
    assert colour.mean.shape == (48, 40, 3) and np.array_equal(colour.mean[..., 1], merged.mean)


@pytest.mark.parametrize(
    "frames, exposures, message",
    [
        (np.zeros((2, 4, 4), np.uint16), [0.1], "there are 1 exposures"),
        (np.zeros((1, 4, 4), np.uint16), [0.0], "exposure 0"),
        (np.zeros((1, 4, 4), np.uint16), [float("nan")], "exposure nan"),
        (np.zeros((4, 4), np.uint16), [0.1], "2 dimensions"),
    ],
)
def test_wrong_frames_are_refused(frames, exposures, message):
    with pytest.raises(symrig.Error, match=message):
        symrig.merge(frames, exposures, symrig.NoiseModel.from_electrons())


def test_an_impossible_sensor_is_refused():
    with pytest.raises(symrig.UsageError, match="noise model"):
        symrig.NoiseModel.from_electrons(bits=40)


def test_decode_finds_a_shift(tmp_path):
    patterns = symrig.gray_code((32, 64))
    assert patterns.shape[1:] == (32, 64) and set(np.unique(patterns)) == {0.0, 1.0}
    photographs = 0.8 * np.roll(patterns, 3, axis=2) + 0.05
    seen = symrig.decode(photographs, projector=(32, 64))
    assert seen.decoded_share > 0.8 and seen.mask.dtype == bool
    inside = seen.mask[4:-4, 8:-8]
    cols = np.broadcast_to(np.arange(64) - 3, (32, 64))[4:-4, 8:-8]
    assert np.abs(seen.col[4:-4, 8:-8] - cols)[inside].max() < 0.5
    seen.save(tmp_path / "map.exr")
    picture = symrig.read_image(tmp_path / "map.exr")
    assert np.array_equal(picture[..., 0], seen.col) and np.array_equal(picture[..., 2], seen.mask)
    (tmp_path / "photos").mkdir()
    for k, photograph in enumerate(photographs):
        symrig.write_image(tmp_path / "photos" / f"{k}.pfm", photograph)
    again = symrig.decode(tmp_path / "photos", projector=(32, 64))
    assert np.array_equal(again.col, seen.col) and again.facts["photographs"] == len(photographs)
    with pytest.raises(symrig.InputError, match="sequence of a projector"):
        symrig.decode(photographs[:-1], projector=(32, 64))
    with pytest.raises(TypeError, match="projector"):
        symrig.decode(photographs)


def test_decode_of_columns_alone(tmp_path):
    patterns = symrig.gray_code((32, 64))  # 6 pairs of columns, 5 of rows, white, black
    photographs = 0.8 * np.roll(patterns, 3, axis=2) + 0.05
    seen = symrig.decode(np.concatenate([photographs[:12], photographs[-2:]]), projector=(32, 64))
    assert seen.axes == "columns" and seen.facts["axes"] == "columns" and seen.facts["rows"] is None
    assert np.isnan(seen.row[seen.mask]).all() and np.isinf(seen.row_sigma[seen.mask]).all()
    inside = seen.mask[4:-4, 8:-8]
    assert inside.mean() > 0.8
    cols = np.broadcast_to(np.arange(64) - 3, (32, 64))[4:-4, 8:-8]
    assert np.abs(seen.col[4:-4, 8:-8] - cols)[inside].max() < 0.5
    seen.save(tmp_path / "map.exr")  # files hold no NaN
    assert (symrig.read_image(tmp_path / "map.exr")[..., 1] == np.where(seen.mask, -1, 0)).all()


def test_decode_without_complements():
    patterns = symrig.gray_code((32, 64))
    photographs = 0.8 * np.roll(patterns, 3, axis=2) + 0.05
    whole = symrig.decode(photographs, projector=(32, 64))
    seen = symrig.decode(np.concatenate([photographs[:-2:2], photographs[-2:]]), projector=(32, 64))
    assert seen.axes == "both" and np.array_equal(seen.mask, whole.mask)
    assert np.abs(seen.col - whole.col).max() < 1e-3


def test_decode_of_a_rear_projection():
    mirrored = 0.8 * symrig.gray_code((32, 64))[:, :, ::-1] + 0.05
    with pytest.raises(symrig.InputError, match="mirrored"):
        symrig.decode(mirrored, projector=(32, 64))
    seen = symrig.decode(mirrored, projector=(32, 64), mirrored=True)
    assert seen.decoded_share > 0.8
    cols = np.broadcast_to(63 - np.arange(64), (32, 64))
    assert np.abs(seen.col - cols)[seen.mask].max() < 0.5


def test_calibrate_then_capture_with_pixels_of_their_own(tmp_path):
    rig = "sim:vgroove-textured?size=16x16&camera=80x80&turn=1.5&zoom=0.78&noise=off"
    steps = []
    facts = symrig.calibrate(rig, tmp_path / "registration.h5", progress=steps.append)
    assert (tmp_path / "registration.h5").exists() and steps and facts
    with pytest.raises(symrig.InputError, match="registration"):
        symrig.capture(rig)
    scene = symrig.capture(rig, registration=tmp_path / "registration.h5", max_patterns=60)
    assert scene.light_shape == (16, 16) and scene.photo_shape == (16, 16)


def test_a_program_runs_and_gives_its_receipt(root, tmp_path):
    program = symrig.Program(root / "examples/programs/by-hand.toml")
    with symrig.Board("sim:", program) as board:
        assert board.info and not [one for one in board.lint(program) if one["severity"] == "error"]
        receipt = board.run(program)
        assert receipt == dict(receipt) and receipt
        with pytest.raises(symrig.Error) as stop:
            board.run(program, progress=lambda step: False)
        assert stop.value.code == 402 and stop.value.receipt

        def interrupted(step):
            raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt) as ctrl_c:
            board.run(program, progress=interrupted)
        assert ctrl_c.value.receipt["end"] == "aborted" and ctrl_c.value.receipt["interrupted"]
    with pytest.raises(symrig.UsageError, match="closed"):
        board.run(program)
    with pytest.raises(symrig.InputError) as refusal:
        symrig.Program(tmp_path / "none.toml")
    assert refusal.value.code == 300
    with pytest.raises(symrig.UsageError):
        symrig.Board("nonsense")


def test_pictures_and_lights(tmp_path):
    colour = np.random.default_rng(0).random((5, 7, 3), np.float32)
    symrig.write_image(tmp_path / "c.exr", colour)
    assert np.array_equal(symrig.read_image(tmp_path / "c.exr"), colour)
    assert np.allclose(symrig.gray(colour), colour @ [0.2126, 0.7152, 0.0722], rtol=1e-6)
    symrig.write_image(tmp_path / "l.pfm", colour[..., 0])
    assert np.array_equal(symrig.light(tmp_path / "l.pfm", (5, 7)), colour[..., 0])
    with pytest.raises(symrig.InputError, match="scale the picture"):
        symrig.light(tmp_path / "l.pfm", (5, 8))
    with pytest.raises(symrig.InputError, match="built-in lights"):
        symrig.light("nothing", (5, 8))
    for name in symrig.light_names():
        assert symrig.light(name, (16, 12)).shape == (16, 12)
    assert symrig.png(colour)[:4] == b"\x89PNG"
