# SPDX-License-Identifier: Apache-2.0
"""Capturing from Python: the search of `symrig capture`, on a named rig or on a rig of your own."""

from __future__ import annotations

import os
from typing import Any, Callable, Dict, List, NamedTuple, Optional, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike

from . import _symrig
from ._probe import Probe, Radiance
from ._scene import Scene


class Progress(NamedTuple):
    """The state of a long job.

    Attributes:
        stage: what is done at the moment, such as "level 3".
        done: units done so far (photographs in a capture).
        expected: units expected so far; 0: not known.
        steps: steps of computing work that a capture has done in this stage. A step is a few ms. They move while
            `done` stands still.
        steps_expected: by the end of the stage; 0: not known.
    """

    stage: str
    done: int
    expected: int
    steps: int = 0
    steps_expected: int = 0


ProgressCallback = Callable[[Progress], Any]


class Rig:
    """An open rig. Use open_rig(). It works for one thread at a time, and closes at the end of a `with` block."""

    def __init__(self, opened: _symrig.Rig) -> None:
        self._open = opened

    @property
    def grid(self) -> Tuple[int, int]:
        """(rows, cols) of patterns."""
        return self._open.grid

    @property
    def camera_grid(self) -> Tuple[int, int]:
        """(rows, cols) of photographs. A rig with a registration has its photographs on the grid of patterns."""
        return self._open.camera_grid

    @property
    def channels(self) -> int:
        """Channels of a photograph."""
        return self._open.channels

    @property
    def views(self) -> Tuple[int, int]:
        """(rows, cols) of coaxial views that tile the grid."""
        return self._open.views

    @property
    def name(self) -> str:
        """The rig in one line."""
        return self._open.name

    @property
    def cost(self) -> Dict[str, float]:
        """Spent so far: "photographs", "frames" (single exposures), "seconds" on the rig's clock."""
        return self._open.cost

    def measure(self, patterns: ArrayLike) -> List[Radiance]:
        """Shows patterns and photographs the scene.

        Args:
            patterns: (rows, cols), or (count, rows, cols); values from 0 to 1.

        Returns:
            One Radiance for each pattern.

        Raises:
            InputError: patterns of another size, or values outside 0 to 1.
            DeviceError: board, camera or projector.
        """
        array = np.asarray(patterns, np.float32)
        return self._open.measure(array[np.newaxis] if array.ndim == 2 else array)

    def close(self) -> None:
        """Closes the devices."""
        self._open.close()

    def __enter__(self) -> "Rig":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<symrig.Rig: {self.name}>"


def open_rig(rig: str, *, registration: Union[str, "os.PathLike[str]"] = "") -> Rig:
    """Opens a rig by its name.

    Args:
        rig: "sim:NAME?key=value", "exec:COMMAND", "dense:T.npy?grid=ROWSxCOLS" (a matrix of yours), or a rig file such
            as "rig.toml" (docs/rig-file.md).
        registration: file of symrig.calibrate() if the camera has pixels of its own; "": the one of the rig file.

    Raises:
        UsageError, InputError, DeviceError.
    """
    return Rig(_symrig.open_rig(rig, os.fspath(registration)))


def capture(
    rig: Union[str, Rig, Probe],
    output: Union[None, str, "os.PathLike[str]"] = None,
    *,
    algorithm: str = "symrig",
    tolerance: Optional[float] = None,
    max_patterns: Optional[int] = None,
    max_seconds: Optional[float] = None,
    target_error: Optional[float] = None,
    photograph_seconds: Optional[float] = None,
    polish: Optional[int] = None,
    split: Optional[str] = None,
    dual_threshold: Optional[float] = None,
    dual_subtracts: bool = False,
    check_axis: bool = False,
    unchecked: bool = False,
    registration: Union[str, "os.PathLike[str]"] = "",
    log: bool = True,
    resume: bool = False,
    keep_log: bool = False,
    cells: bool = False,
    fit_seconds: Optional[float] = None,
    progress: Optional[ProgressCallback] = None,
    watch: Union[bool, int] = False,
    memory: Optional[int] = None,
) -> Scene:
    """Measures the light transport of a scene, as `symrig capture` does.

    Args:
        rig: name of a rig as for open_rig(), an open Rig, or a Probe of your own.
        output: scene.h5 to write; None: the scene is only returned, and there is no log.
        algorithm: "symrig", "paper", "dual" or "brute".
        tolerance: as a share of the flood-lit RMS; a smaller one needs more patterns.
        max_patterns, max_seconds, target_error: stop after so many photographs, after as long on the rig's clock, or
            when the estimated error plus its uncertainty is below a share. The scene is complete in each case. Unless
            `tolerance` is given, target_error also chooses it.
        photograph_seconds: longest total exposure of one photograph [s], if exposures are planned.
        polish: most steps of a final refit of all transport to all photographs.
        split: order of several views: "flat", "views-first", "views-last", "all-at-once", "compensated".
        dual_threshold, dual_subtracts: of the algorithm "dual".
        check_axis: first check with 8 photographs that camera and projector pixels coincide.
        unchecked: do not ask whether the first photographs contradict their patterns.
        registration: as for open_rig(), if rig is a name.
        log: keep the photographs in OUTPUT.log until OUTPUT is complete.
        resume: continue an interrupted capture from its log, if there is one.
        keep_log: do not delete the log at the end.
        cells: leave out the camera's own pixels (Scene.camera). They need a registered camera with more pixels than
            the projector has cells, an output and its log.
        fit_seconds: most seconds that the computer takes for these; if it is too little, the log stays, and resume goes on.
        progress: called with a Progress after each photograph, or the few that a rig takes together, and after each
            step of computing work, until the scene is written. If it returns False, the capture stops there.
        watch: serve the page of `symrig capture --watch`: True at a free port of 127.0.0.1, or the number of a port.
            The address is printed. Afterwards the page shows the scene, until the scene is deleted or
            scene.close_page() is called. If the capture fails, the page says why, and ends.
        memory: bytes that the process may use; what needs more is in scratch files beside the output. The result does
            not depend on it. None: half of the memory that is free.

    Returns:
        The scene. scene.facts says what the capture took.

    Raises:
        UsageError, InputError, DeviceError, LimitError.
        Interrupted: progress returned False. KeyboardInterrupt: Ctrl-C. The log keeps the photographs of both.
        Whatever measure() of a Probe raises, unchanged.
    """
    options = dict(
        algorithm=algorithm,
        tolerance=tolerance,
        max_patterns=max_patterns,
        max_seconds=max_seconds,
        target_error=target_error,
        photograph_seconds=photograph_seconds,
        polish=polish,
        memory=memory,
        split=split,
        dual_threshold=dual_threshold,
        dual_subtracts=dual_subtracts,
        check_axis=check_axis,
        unchecked=unchecked,
        log=log,
        resume=resume,
        keep_log=keep_log,
        cells=cells,
        fit_seconds=fit_seconds,
        watch=watch,
    )
    path = "" if output is None else os.fspath(output)
    if isinstance(rig, str):
        return Scene(*_symrig.capture_by_name(rig, os.fspath(registration), path, options, progress))
    opened = rig._open if isinstance(rig, Rig) else _symrig.rig_of_probe(rig)
    return Scene(*_symrig.capture_rig(opened, path, options, progress))


def _tell_address(address: str) -> None:
    """The address has a secret, so there is no other way to know it while the capture runs."""
    print(f"{address}\nOpen this address in a browser of this machine to watch.", flush=True)
