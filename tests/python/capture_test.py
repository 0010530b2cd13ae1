# SPDX-License-Identifier: Apache-2.0
"""symrig.capture(): named rigs, rigs of your own, logs, interruptions."""

import json
import os
import signal
import socket
import subprocess
import sys
import textwrap
import threading
import urllib.error
import urllib.request
import warnings

import numpy as np
import pytest

import symrig
from conftest import GROOVE


def integers(grid, seed=3):
    """A symmetric T of two planes that light each other. Photographs of binary patterns are exact in any order of sums."""
    noise = np.random.default_rng(seed)
    y, x = np.divmod(np.arange(grid[0] * grid[1]), grid[1])
    distance = (y[:, None] - y) ** 2 + (x[:, None] - x) ** 2
    facing = (x < grid[1] // 2)[:, None] != (x < grid[1] // 2)
    t = np.where(facing, np.floor(400 / (20 + distance)), 0)
    np.fill_diagonal(t, noise.integers(40, 400, len(x)))
    assert np.array_equal(t, t.T) and 0 < t.sum(axis=1).max() < 2**24
    return t.astype(np.float32)


class Matrix(symrig.Probe):
    """A rig whose T is a matrix."""

    def __init__(self, t, grid):
        self.t, self.grid, self.patterns = t, grid, []

    def measure(self, patterns):
        self.patterns.extend(patterns.copy())
        return (patterns.reshape(len(patterns), -1) @ self.t.T).reshape(patterns.shape)


class Passed(symrig.Probe):
    """A rig of the library behind a rig of Python."""

    def __init__(self, rig):
        self.rig, self.grid, self.channels, self.views = rig, rig.grid, rig.channels, rig.views

    def measure(self, patterns):
        self.seconds = self.rig.cost["seconds"]
        return self.rig.measure(patterns)


def test_a_named_rig_is_captured_as_by_the_command(groove):
    scene = symrig.capture(GROOVE, polish=0)
    assert np.array_equal(scene.to_numpy(), groove.to_numpy())
    assert scene.facts["patterns"] == groove.facts["patterns"]
    assert scene.facts["command_line"] == "symrig.capture() of Python" and scene.facts["date"]


def test_a_python_probe_gives_the_same_tensor_as_the_library_s(groove):
    with symrig.open_rig(GROOVE) as rig:
        scene = symrig.capture(Passed(rig), polish=0)
    assert np.array_equal(scene.to_numpy(), groove.to_numpy())
    assert scene.facts["patterns_per_level"] == groove.facts["patterns_per_level"]
    with pytest.raises(symrig.UsageError, match="closed"):
        rig.measure(np.ones((32, 24)))


def test_colour_photographs_of_python(colour):
    from conftest import COLOUR

    with symrig.open_rig(COLOUR) as rig:
        scene = symrig.capture(Passed(rig), polish=0)
    assert np.array_equal(scene.to_numpy(), colour.to_numpy())


def test_seconds_are_those_of_each_capture():
    with symrig.open_rig("sim:gummy?size=32x32") as rig:
        spent = [symrig.capture(rig, max_seconds=3).facts["rig_seconds"] for _ in range(2)]
    assert all(2 < seconds <= 3 for seconds in spent), spent
    dim = symrig.capture("sim:gummy?size=32x32&light=0.05", max_seconds=6, check_axis=True).facts
    assert dim["rig_seconds"] <= 6 and dim["patterns"] > 20, dim
    with pytest.raises(symrig.LimitError, match="max_seconds 0.01 is too little"):
        symrig.capture("sim:gummy?size=32x32", max_seconds=0.01)


def test_views_of_python():
    """A fixed bracket: what a capture expects of a photograph does not reach a rig of Python, and would change the exposures."""
    name = "sim:views2?size=24x20&exposures=4"
    wanted = symrig.capture(name, polish=0)
    with symrig.open_rig(name) as rig:
        scene = symrig.capture(Passed(rig), polish=0)
    assert scene.views == wanted.views == (2, 2)
    assert np.array_equal(scene.to_numpy(), wanted.to_numpy())


ANSWERS = {
    "no array of numbers: <class 'str'>": lambda count, picture: ["x"] * count,
    "no array of numbers: <class 'object'>": lambda count, picture: [object()] * count,
    "no array of numbers: <class 'list'>": lambda count, picture: [[[1, 2], [3]]] * count,
    "no array of numbers: <class 'dict'>": lambda count, picture: [{"mean": picture}] * count,
    "no array of numbers: <class 'numpy.ndarray'>": lambda count, picture: [picture + 1j] * count,
    "the variance of photograph 0 is no array of numbers": lambda count, picture: [symrig.Radiance(picture, "much")] * count,
    "answered <class 'str'>": lambda count, picture: "x" * count,
    "answered <class 'numpy.ndarray'>": lambda count, picture: np.array(3.0),
    "answered <class 'NoneType'>": lambda count, picture: None,
}


@pytest.mark.parametrize("message", ANSWERS)
def test_an_answer_of_another_type_is_named(message):
    class Wrong(symrig.Probe):
        grid = (8, 8)

        def measure(self, patterns):
            return ANSWERS[message](len(patterns), np.zeros(self.grid, np.float32))

    with pytest.raises(symrig.InputError) as raised:
        symrig.capture(Wrong())
    assert message in str(raised.value) and raised.value.next_step


def test_seconds_of_another_type_are_named():
    rig = Matrix(integers((8, 8)), (8, 8))
    rig.seconds = "long"
    with pytest.raises(symrig.InputError, match="the rig's seconds is 'long'; keep a number there, or None"):
        symrig.capture(rig)


def test_warnings_are_those_of_the_command(tmp_path):
    class Noisy(Matrix):
        """Noise that it does not state."""

        def measure(self, patterns):
            exact = np.asarray(super().measure(patterns))
            return exact + np.random.default_rng(len(self.patterns)).normal(0, 0.02 * exact.max(), exact.shape).astype(np.float32)

    with pytest.warns(UserWarning, match="estimated errors and rank tests rely on the stated noise"):
        symrig.capture(Noisy(integers((16, 16)), (16, 16)))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scene = symrig.capture("sim:plane?size=16x16")
        scene.errors("sim:plane?size=16x16")
    with pytest.warns(UserWarning, match="captured from another scene: the scene is gummy"):
        scene.errors("sim:gummy?size=16x16")


def test_progress_counts_computing_to_the_end():
    told = []
    scene = symrig.capture("sim:vgroove-textured?size=48x48", progress=told.append)
    stages = [one.stage for one in told]
    assert stages[-1] == "estimated errors" and "refit" in stages, stages
    refit = [one for one in told if one.stage == "refit"]
    assert refit[-1].steps > 0 and refit[-1].steps <= refit[-1].steps_expected
    assert all(one.done <= scene.facts["patterns"] for one in told)


def test_a_stop_in_the_refit_keeps_the_log(tmp_path):
    output = tmp_path / "scene.h5"
    name = "sim:vgroove-textured?size=32x32"
    whole = symrig.capture(name, polish=2)
    with pytest.raises(symrig.Interrupted, match=r"while it computed \(refit\).* keeps .* continue with resume"):
        symrig.capture(name, output, polish=2, progress=lambda step: step.stage != "refit")
    scene = symrig.capture(name, output, polish=2, resume=True)
    assert scene.facts["replayed"] > 0
    assert np.array_equal(scene.flood_lit(), whole.flood_lit())


def test_progress_and_its_stop():
    steps = []
    symrig.capture("sim:plane?size=16x16", progress=steps.append)
    assert steps[-1].done > 10 and isinstance(steps[0].stage, str)
    with pytest.raises(symrig.Interrupted) as stop:
        symrig.capture("sim:gummy?size=16x16", progress=lambda step: step.done < 5)
    assert stop.value.code == 402


def test_budgets_and_other_options_are_checked_by_the_library():
    scene = symrig.capture("sim:vgroove-textured?size=16x16", max_patterns=20)
    assert scene.facts["stopped_by"] == "max_patterns" and scene.facts["patterns"] <= 20
    for options, message in [
        ({"max_patterns": 0}, "max_patterns 0 allows no measurement"),
        ({"tolerance": 2.0}, "tolerance 2"),
        ({"algorithm": "symm"}, "no algorithm 'symm'"),
        ({"split": "no"}, "no"),
        ({"tolerance": "much"}, "tolerance is 'much'"),
        ({"dual_subtracts": True}, "dual_subtracts"),
    ]:
        with pytest.raises(symrig.UsageError, match=message):
            symrig.capture("sim:plane?size=8x8", **options)


def test_a_log_is_kept_and_resumed(tmp_path):
    t, grid = integers((12, 10)), (12, 10)
    whole = symrig.capture(Matrix(t, grid), polish=0)
    output = tmp_path / "scene.h5"
    with pytest.raises(symrig.Interrupted, match="scene.h5.log keeps .* photographs: continue with resume"):
        symrig.capture(Matrix(t, grid), output, polish=0, progress=lambda step: step.done < 20)
    with pytest.raises(symrig.UsageError, match="continue with resume"):
        symrig.capture(Matrix(t, grid), output, polish=0)
    rig = Matrix(t, grid)
    scene = symrig.capture(rig, output, polish=0, resume=True)
    judging = 12 * 10 + 7  # each pixel alone, and seven photographs
    assert scene.facts["replayed"] >= 20 and len(rig.patterns) == scene.facts["patterns"] - scene.facts["replayed"] + judging
    assert np.array_equal(scene.to_numpy(), whole.to_numpy())
    assert np.array_equal(symrig.load(output).to_numpy(), whole.to_numpy())
    assert not (tmp_path / "scene.h5.log").exists()


def test_an_exception_of_measure_comes_through_and_names_the_log(tmp_path):
    class Lamp(Matrix):
        def measure(self, patterns):
            if len(self.patterns) >= 9:
                raise OSError("the lamp is off")
            return super().measure(patterns)

    t = integers((8, 8))
    with pytest.raises(OSError, match="the lamp is off") as stop:
        symrig.capture(Lamp(t, (8, 8)), tmp_path / "scene.h5")
    assert "scene.h5.log keeps 9 photographs" in stop.value.__notes__[0]
    assert not (tmp_path / "scene.h5").exists()


@pytest.mark.parametrize(
    "answer, message",
    [
        (lambda p: p[:0], "0 photographs for"),
        (lambda p: p[:, :-1], "photograph 0 is 7x8"),
        (lambda p: np.full_like(p, np.nan), "NaN"),
        (lambda p: [symrig.Radiance(one, -1.0) for one in p], "negative"),
        (lambda p: [symrig.Radiance(one, np.ones((2, 2))) for one in p], "the variance of photograph 0"),
        (lambda p: [symrig.Radiance(one, 0.0, np.ones((2, 2), bool)) for one in p], "valid"),
        (lambda p: None, "measure"),
    ],
)
def test_a_wrong_answer_is_refused(answer, message):
    class Wrong(symrig.Probe):
        grid = (8, 8)

        def measure(self, patterns):
            return answer(patterns)

    with pytest.raises(symrig.InputError, match=message):
        symrig.capture(Wrong())


@pytest.mark.parametrize(
    "attributes, message",
    [
        ({}, "the rig's grid"),
        ({"grid": (4, 4), "channels": 0}, "channels"),
        ({"grid": (4, 4), "views": (9, 1)}, "views"),
        ({"grid": "big"}, "the rig's grid is 'big'"),
    ],
)
def test_a_probe_that_describes_itself_wrongly_is_refused(attributes, message):
    probe = type("Wrong", (symrig.Probe,), attributes)()
    with pytest.raises(symrig.UsageError, match=message):
        symrig.capture(probe)


def test_a_probe_without_measure_says_so():
    class Empty(symrig.Probe):
        grid = (4, 4)

    with pytest.raises(NotImplementedError, match="Empty has no method measure"):
        symrig.capture(Empty())


def test_invalid_pixels_are_left_out():
    t = integers((8, 8))

    class Broken(Matrix):
        """One camera pixel is stuck at a million."""

        def __init__(self, stated):
            super().__init__(t, (8, 8))
            self.valid = np.ones((8, 8), bool)
            self.valid[2, 3] = not stated

        def measure(self, patterns):
            mean = super().measure(patterns)
            mean[:, 2, 3] = 1e6 if self.valid.all() else np.nan
            return [symrig.Radiance(one, 1e-6, self.valid) for one in mean]

    assert symrig.capture(Broken(stated=True)).to_numpy().max() < 2 * t.max()
    with pytest.raises(symrig.DeviceError, match="the pixel at row 2, column 3 has the same value"):
        symrig.capture(Broken(stated=False))
    assert symrig.capture(Broken(stated=False), unchecked=True).to_numpy().max() > 1e4


def test_a_rig_works_for_one_thread_at_a_time():
    inside, go_on, errors = threading.Event(), threading.Event(), []

    def progress(_):
        inside.set()
        go_on.wait()

    with symrig.open_rig("sim:plane?size=8x8") as rig:
        thread = threading.Thread(target=lambda: symrig.capture(rig, progress=progress))
        thread.start()
        inside.wait()
        try:
            rig.measure(np.ones((8, 8)))
        except symrig.UsageError as error:
            errors.append(str(error))
        go_on.set()
        thread.join()
        assert errors and "another thread uses the rig" in errors[0]
        assert len(rig.measure(np.ones((2, 8, 8)))) == 2
        assert rig.cost["photographs"] > 2


def test_ctrl_c_stops_and_keeps_the_log(tmp_path):
    """The signal comes from measure() itself, so no time decides."""
    script = textwrap.dedent(
        """
        import os, signal, symrig, numpy as np
        class Rig(symrig.Probe):
            grid, shown = (16, 16), 0
            def measure(self, patterns):
                self.shown += len(patterns)
                if self.shown == 5:
                    os.kill(os.getpid(), signal.SIGINT)
                return patterns
        try:
            symrig.capture(Rig(), "scene.h5")
        except KeyboardInterrupt as stop:
            print("stopped", getattr(stop, "__notes__", []))
        """
    )
    done = subprocess.run([sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert done.stdout.startswith("stopped ['symrig: scene.h5.log keeps"), done.stdout + done.stderr
    assert (tmp_path / "scene.h5.log").exists() and not (tmp_path / "scene.h5").exists()


def test_an_output_that_is_no_scene_is_refused_before_the_rig_is_opened(tmp_path):
    (tmp_path / "rig.toml").write_text("broken")
    with pytest.raises(symrig.UsageError, match="suffix"):
        symrig.capture(str(tmp_path / "rig.toml"), tmp_path / "scene.png")
    with pytest.raises(symrig.InputError, match="rig.toml:1"):
        symrig.open_rig(str(tmp_path / "rig.toml"))
    with pytest.raises(symrig.UsageError, match="did you mean 'gummy'"):
        symrig.open_rig("sim:gumy")


def asked(address, what=""):
    with urllib.request.urlopen(address + what, timeout=60) as answer:
        return answer.read().decode()


def address_in(captured_text):
    """What capture(watch=...) prints first."""
    return captured_text.split("\n")[0]


def test_a_page_shows_the_capture_and_then_its_scene(capsys):
    seen = []

    class Watched(Matrix):
        """Asks the page how far its own capture is."""

        def measure(self, patterns):
            if len(self.patterns) in (0, 20):
                self.address = getattr(self, "address", None) or address_in(capsys.readouterr().out)
                seen.append(json.loads(asked(self.address, "live")))
            return super().measure(patterns)

    rig = Watched(integers((16, 16)), (16, 16))
    scene = symrig.capture(rig, watch=True)
    assert scene.page == rig.address and scene.page.startswith("http://127.0.0.1:")
    assert len(seen) == 2 and not any(one["complete"] or one["failed"] for one in seen)
    assert seen[0]["done"] == 0 < seen[1]["done"]
    assert json.loads(asked(scene.page, "live"))["complete"]
    assert json.loads(asked(scene.page, "facts"))["camera"] == [16, 16]
    scene.close_page()
    assert scene.page is None
    with pytest.raises(urllib.error.URLError):
        asked(rig.address, "live")
    assert np.array_equal(scene.to_numpy(), symrig.capture(Matrix(rig.t, rig.grid)).to_numpy())


def test_a_page_says_why_a_capture_failed(capsys):
    told = []

    def look(address, asking):
        """As a page does: asks until it hears of the end."""
        while not told:
            now = json.loads(asked(address, "live"))
            asking.set()
            if now["failed"]:
                told.append(now["failed"])

    class Failing(Matrix):
        def measure(self, patterns):
            if len(self.patterns) == 10:
                asking = threading.Event()
                self.visitor = threading.Thread(target=look, args=[address_in(capsys.readouterr().out), asking])
                self.visitor.start()
                assert asking.wait(timeout=300)
                raise ValueError("the lamp is cold")
            return super().measure(patterns)

    rig = Failing(integers((16, 16)), (16, 16))
    with pytest.raises(ValueError, match="the lamp is cold"):
        symrig.capture(rig, watch=True)
    rig.visitor.join(timeout=300)
    assert told == ["ValueError: the lamp is cold"]


@pytest.mark.parametrize("watch", [0, 70000, -1, 5.5, "yes"])
def test_a_port_is_checked(watch):
    with pytest.raises(symrig.UsageError, match="watch is"):
        symrig.capture(Matrix(integers((4, 4)), (4, 4)), watch=watch)


def test_a_page_at_a_port_of_its_own():
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    scene = symrig.capture(GROOVE, max_patterns=20, watch=port)
    assert scene.page.startswith(f"http://127.0.0.1:{port}/")
    with pytest.raises(symrig.InputError, match=f"port {port}"):
        symrig.capture(GROOVE, max_patterns=20, watch=port)
