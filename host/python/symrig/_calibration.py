# SPDX-License-Identifier: Apache-2.0
"""Frames to photographs, Gray codes to pixel maps, and registrations."""

from __future__ import annotations

import json
import os
from typing import TYPE_CHECKING, Any, Dict, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _symrig
from ._probe import Photograph, Radiance

if TYPE_CHECKING:
    from ._capture import ProgressCallback

Path = Union[str, "os.PathLike[str]"]


def merge(
    frames: ArrayLike,
    exposures: Sequence[float],
    noise: _symrig.NoiseModel,
    *,
    scale: float = 1.0,
    black: Optional[Photograph] = None,
    dead: Optional[ArrayLike] = None,
) -> Radiance:
    """Merges the frames of one bracket into one photograph, weighted by their noise.

    Args:
        frames: raw codes (count, rows, cols), or (count, rows, cols, channels); 1 to 8 frames in any order.
        exposures: time that the shutter was open for each frame [s].
        noise: the sensor.
        scale: radiance of one electron per second.
        black: photograph of the dark projector, in units of the result; it is subtracted with its sign.
        dead: (rows, cols), True where a camera pixel is not usable.

    Raises:
        UsageError, InputError.
    """
    codes = np.asarray(frames)
    if codes.dtype.kind not in "ui" or codes.size and (codes.min() < 0 or codes.max() > 65535):
        raise TypeError("frames must be whole numbers from 0 to 65535")
    return _symrig.merge(codes.astype(np.uint16, copy=False), list(exposures), noise, scale, black, dead)


class PixelMap:
    """The projector position that each camera pixel sees.

    Arrays have the camera's shape (rows, cols) and cannot be written to.

    Attributes:
        row, col: projector position [px]; pixel j covers j - 1/2 to j + 1/2; 0 where mask is False.
        axes: "both", or "columns" or "rows" if the photographs have stripes of that axis alone. The other coordinate is
            NaN where mask is True, with an infinite deviation.
        row_sigma, col_sigma: their standard deviations [px].
        mask: True where the pixel is decoded.
        contrast: white minus black, in units of the photographs.
        facts: the keys of `symrig calibrate --json`.
    """

    def __init__(self, decoded: _symrig.DecodedMap) -> None:
        self._decoded = decoded
        self.row, self.col = decoded.row, decoded.col
        self.axes: str = decoded.axes
        self.row_sigma, self.col_sigma = decoded.row_sigma, decoded.col_sigma
        self.mask: NDArray[np.bool_] = decoded.mask.view(np.bool_)
        self.contrast = decoded.contrast
        self.camera: Tuple[int, int] = decoded.camera
        self.projector: Tuple[int, int] = decoded.projector
        self.decoded_share: float = decoded.decoded_share
        self.facts: Dict[str, Any] = json.loads(decoded.json)

    def save(self, path: Path) -> None:
        """Writes the map for other programs (.exr or .pfm): projector column, projector row, decoded."""
        self._decoded.save(os.fspath(path))

    def __repr__(self) -> str:
        return f"<symrig.PixelMap: camera {self.camera} -> projector {self.projector}, {100 * self.decoded_share:.1f} % decoded>"


def gray_code(projector: Tuple[int, int]) -> NDArray[np.float32]:
    """All patterns of the Gray-code sequence for a projector: (count, rows, cols), values 0 or 1.

    Column bits first, each followed by its complement; then row bits; then white; then black.
    """
    return _symrig.gray_code(projector)


def decode(
    photographs: Union[Path, ArrayLike],
    *,
    projector: Optional[Tuple[int, int]] = None,
    check_sequence: bool = True,
    mirrored: bool = False,
    progress: Optional["ProgressCallback"] = None,
) -> PixelMap:
    """Decodes a Gray-code sequence.

    Args:
        photographs: a folder of pictures (docs/howto-photographs.md), or an array (count, rows, cols) in the order of
            gray_code(projector). The complements or the row bits may be missing.
        projector: (rows, cols). A folder needs it only if the number of photographs does not tell.
        check_sequence: refuse photographs that contradict each other.
        mirrored: the photographs show a rear projection, or were taken through a mirror.
        progress: called with a Progress while a folder is read.

    Raises:
        InputError: no pixel has enough contrast, the sequence is in a wrong order, ...
    """
    if isinstance(photographs, (str, os.PathLike)):
        return PixelMap(_symrig.decode_folder(os.fspath(photographs), projector, check_sequence, mirrored, progress))
    if projector is None:
        raise TypeError("decode() of an array needs projector=(rows, cols)")
    return PixelMap(_symrig.decode_arrays(np.asarray(photographs, np.float32), projector, check_sequence, mirrored))


def calibrate(rig: str, output: Path = "", *, progress: Optional["ProgressCallback"] = None) -> Dict[str, Any]:
    """Finds where the camera's pixels look on the projector's cells (`symrig calibrate --rig RIG -o registration.h5`).

    Args:
        rig: name of a rig, as for open_rig().
        output: registration.h5 to write, for open_rig() and capture(); "": nothing is written.
        progress: called with a Progress after each photograph.

    Returns:
        The keys of `symrig calibrate --json`.
    """
    facts: Dict[str, Any] = json.loads(_symrig.calibrate(rig, os.fspath(output), progress))
    return facts
