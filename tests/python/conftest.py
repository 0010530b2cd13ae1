# SPDX-License-Identifier: Apache-2.0
import os
import pathlib
import subprocess

import numpy as np
import pytest

import symrig

GROOVE = "sim:vgroove-textured?size=32x24&exposures=4"
COLOUR = "sim:gummy?size=12x16&channels=3&exposures=4"


def pytest_configure(config):
    config.addinivalue_line("markers", "once: a build with a sanitizer leaves it out")


@pytest.fixture(scope="session")
def root():
    return pathlib.Path(os.environ["SYMRIG_ROOT"])


@pytest.fixture(scope="session")
def command():
    """Runs the symrig command."""

    def run(*words, **options):
        return subprocess.run([os.environ["SYMRIG"], *map(str, words)], check=True, capture_output=True, text=True, **options)

    return run


@pytest.fixture(scope="session")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("scenes")


@pytest.fixture(scope="session")
def groove_file(folder, command):
    """A scene of one channel, captured by the command."""
    path = folder / "groove.h5"
    command("capture", "--rig", GROOVE, "-o", path, "--polish", 0)
    return path


@pytest.fixture(scope="session")
def groove(groove_file):
    return symrig.load(groove_file)


@pytest.fixture(scope="session")
def fine_file(folder, command):
    """A scene of a camera with 4.75 pixels along the side of a cell."""
    rig, path = "sim:gummy?size=16x16&fine=4&camera=76x76&turn=1.5&zoom=0.784", folder / "fine.h5"
    command("calibrate", "--rig", rig, "-o", folder / "fine-registration.h5")
    command("capture", "--rig", rig, "--registration", folder / "fine-registration.h5", "-o", path)
    return path


@pytest.fixture(scope="session")
def colour():
    return symrig.capture(COLOUR, polish=0)


@pytest.fixture
def noise():
    return np.random.default_rng(1)
