# SPDX-License-Identifier: Apache-2.0
"""What answers patterns with photographs: a rig of your own (Probe), and its photographs (Radiance)."""

from __future__ import annotations

from typing import Any, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float32]


class Radiance(NamedTuple):
    """One photograph: radiance per unit of projector light, with its uncertainty.

    All three arrays have the shape (rows, cols), or (rows, cols, channels) in colour.

    Attributes:
        mean: radiance. It is signed, because the black level is subtracted. Do not clip it.
        variance: variance of the mean, in squared units of it; one number for all pixels is allowed.
        valid: True where the mean can be trusted; None means everywhere.
    """

    mean: FloatArray
    variance: Union[FloatArray, float] = 0.0
    valid: Optional[NDArray[np.bool_]] = None


Photograph = Union[Radiance, ArrayLike]


class Probe:
    """A rig of your own. Derive from it, set `grid`, and write measure(). symrig.capture() then measures with it.

    Attributes:
        grid: (rows, cols) of patterns and photographs.
        channels: channels of a photograph; patterns always have one (white light).
        views: (rows, cols) of coaxial views that tile the grid.
        together: patterns that one call of measure() may get while a log is kept. A killed process loses that
            many photographs.
        seconds: time on the rig's clock so far, kept by measure(); None: the rig has no clock. Without a clock,
            max_seconds of a capture has no effect.
        name: one line with everything that the photographs depend on. A log continues only on a rig of that name.
    """

    grid: Tuple[int, int] = (0, 0)
    channels: int = 1
    views: Tuple[int, int] = (1, 1)
    together: int = 1
    seconds: Optional[float] = None

    @property
    def name(self) -> str:
        """The class; replace it where photographs depend on more."""
        return f"python:{type(self).__name__}"

    def measure(self, patterns: FloatArray) -> Union[Sequence[Photograph], NDArray[Any]]:
        """Shows each pattern and returns what the camera saw.

        Args:
            patterns: (count, rows, cols), values from 0 to 1.

        Returns:
            One photograph for each pattern: an array of shape (count, rows, cols), with channels last in colour; or a
            list of Radiance. A plain array is taken for exact: variance 0. Give the variance of a real camera,
            because rank tests and estimated errors rely on it.
        """
        raise NotImplementedError(f"{type(self).__name__} has no method measure()")
