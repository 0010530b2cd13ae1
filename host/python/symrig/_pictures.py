# SPDX-License-Identifier: Apache-2.0
"""Picture files and lights."""

from __future__ import annotations

import os
from typing import Dict, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _symrig

Path = Union[str, "os.PathLike[str]"]


def read_image(path: Path) -> NDArray[np.float32]:
    """Reads an EXR, PNG or PFM file as linear values: (rows, cols), or (rows, cols, 3).

    PNG: code / largest code, without a tone curve.
    """
    return _symrig.read_image(os.fspath(path))


def write_image(path: Path, picture: ArrayLike) -> None:
    """Writes a linear picture of 1 or 3 channels atomically. The suffix chooses the format: .exr, .pfm, .png."""
    _symrig.write_image(os.fspath(path), np.asarray(picture, np.float32))


def gray(picture: ArrayLike) -> NDArray[np.float32]:
    """Luminance of a linear picture (Rec. 709): (rows, cols, 3) → (rows, cols)."""
    return _symrig.gray(np.asarray(picture, np.float32))


def light(name: Path, grid: Tuple[int, int]) -> NDArray[np.float32]:
    """A light as `symrig relight --light` reads it: (rows, cols).

    Args:
        name: a built-in light (see light_names()), or a picture file of that size.
        grid: (rows, cols), for example scene.light_shape.
    """
    return _symrig.light(os.fspath(name), grid)


def light_names() -> Dict[str, str]:
    """The built-in lights and what they are."""
    return _symrig.light_names()
