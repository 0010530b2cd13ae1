# SPDX-License-Identifier: Apache-2.0
"""symrig: measure how a scene transports light, and relight it.

scene = symrig.load("scene.h5")
photograph = scene @ light

See docs/python.md.
"""

from . import _built
from ._board import Board, Program
from ._calibration import PixelMap, calibrate, decode, gray_code, merge
from ._capture import Progress, Rig, capture, open_rig
from ._display import Picture, png, show
from ._errors import DeviceError, Error, InputError, Interrupted, LimitError, UsageError
from ._pictures import gray, light, light_names, read_image, write_image
from ._probe import Probe, Radiance
from ._scene import Camera, Estimate, HeldOut, HeldOutError, Level, Scene, load
from ._symrig import NoiseModel
from ._symrig import version as __version__

__all__ = [
    "Board",
    "Camera",
    "DeviceError",
    "Error",
    "Estimate",
    "HeldOut",
    "HeldOutError",
    "InputError",
    "Interrupted",
    "Level",
    "LimitError",
    "NoiseModel",
    "Picture",
    "PixelMap",
    "Probe",
    "Program",
    "Progress",
    "Radiance",
    "Rig",
    "Scene",
    "UsageError",
    "calibrate",
    "capture",
    "decode",
    "gray",
    "gray_code",
    "light",
    "light_names",
    "load",
    "merge",
    "open_rig",
    "png",
    "read_image",
    "show",
    "write_image",
    "__version__",
]
