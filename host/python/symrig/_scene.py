# SPDX-License-Identifier: Apache-2.0
"""The measured transport of a scene as a linear operator: photograph = scene @ light."""

from __future__ import annotations

import json
import os
import warnings
from typing import TYPE_CHECKING, Any, Dict, Generic, List, NamedTuple, Optional, Tuple, TypeVar, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse.linalg import LinearOperator

from . import _display, _symrig
from ._errors import error_of

if TYPE_CHECKING:
    from ._capture import ProgressCallback, Rig

FloatArray = NDArray[np.float32]
Grid = Tuple[int, int]
Stored = TypeVar("Stored", _symrig.StoredScene, _symrig.CameraTransport)


class Estimate(NamedTuple):
    """A relative error: value ± half_width with 95 % confidence. nan where it cannot be estimated."""

    value: float
    half_width: float


class Level(NamedTuple):
    """Stored nodes of one level of the tree; level 0 is the whole picture."""

    level: int
    rank1: int
    low_rank: int
    empty: int
    scalar: int
    subdivided: int


class HeldOut(NamedTuple):
    """A photograph that the tensor was not made from. The arrays cannot be written to."""

    name: str
    pattern: FloatArray
    photograph: FloatArray


class HeldOutError(NamedTuple):
    """Prediction error of a held-out photograph: rms in units of the photograph, and as a share of mean white."""

    name: str
    rms: float
    relative: float


def _mismatch(given: Tuple[int, ...], wanted: str) -> Exception:
    return error_of(303, "size_mismatch", f"the array has the shape {given}", f"give {wanted}")


def _refuse_codes(x: NDArray[Any]) -> None:
    """Bytes of 0 and 1 are a mask. Others are the codes of a picture file, 255 or 65535 times too bright."""
    if x.dtype.kind == "u" and x.dtype.itemsize <= 2 and x.size and x.max() > 1:
        white = np.iinfo(x.dtype).max
        raise error_of(
            304,
            "bad_value",
            f"the picture has codes from 0 to {x.max()} ({x.dtype}), but light is 1 where the projector is fully on",
            f"read the file with symrig.light(), or divide the picture by {white}",
        )


def _estimates(facts: Dict[str, Any]) -> Dict[str, Estimate]:
    """Of the keys estimated_error and estimated_error_uncertainty."""

    def flat(tree: Optional[Dict[str, Any]]) -> Dict[str, float]:
        found = dict(tree or {})
        for key, value in found.pop("relight", {}).items():
            found[f"relight {key}"] = value
        return {key: float("nan") if value is None else value for key, value in found.items()}

    widths = flat(facts.get("estimated_error_uncertainty"))
    values = flat(facts.get("estimated_error"))
    order = ["frobenius", "indirect", "flood", "relight bar", "relight random", "relight natural", "bar_indirect"]
    return {key: Estimate(values[key], widths.get(key, float("nan"))) for key in order if key in values}


class _Pictures(LinearOperator):
    """An operator between pictures. It takes pictures, batches of pictures on the last axis, and flat vectors.

    Derived classes give the shapes of pictures and say how one or many are mapped.
    """

    in_shape: Tuple[int, ...]
    out_shape: Tuple[int, ...]
    takes_light = False  # true: a picture that comes in is what the projector shows

    def __init__(self, in_shape: Tuple[int, ...], out_shape: Tuple[int, ...]) -> None:
        self.in_shape, self.out_shape = in_shape, out_shape
        super().__init__(np.dtype(np.float32), (int(np.prod(out_shape)), int(np.prod(in_shape))))

    def _one(self, picture: NDArray[Any]) -> FloatArray:
        raise NotImplementedError

    def _many(self, pictures: NDArray[Any]) -> NDArray[Any]:
        """(count, *in_shape) → (count, *out_shape)."""
        return np.stack([self._one(picture) for picture in pictures])

    def dot(self, x: Any) -> Any:
        """The product with a picture, a batch of pictures, a flat vector, a flat batch, or another operator."""
        if isinstance(x, LinearOperator) or np.isscalar(x):
            return super().dot(x)
        x = np.asarray(x)
        _refuse_codes(x)
        if x.shape == self.in_shape:
            return self._apply_one(x)
        if self.takes_light and x.shape == (*self.in_shape, 3):
            warnings.warn(
                "the last axis counts lights: these are 3 lights, not one in colour; symrig.gray(picture) is the light"
                " of a picture in colour",
                stacklevel=3,
            )
        if x.ndim == len(self.in_shape) + 1 and x.shape[:-1] == self.in_shape:
            return np.moveaxis(self._apply_many(np.moveaxis(x, -1, 0)), 0, -1)
        if x.ndim in (1, 2) and x.shape[0] == self.shape[1]:
            return super().dot(x)
        raise _mismatch(
            x.shape,
            f"a picture {self.in_shape}, pictures {(*self.in_shape, 'count')}, a vector ({self.shape[1]},)"
            f" or vectors ({self.shape[1]}, 'count')".replace("'count'", "count"),
        )

    def __matmul__(self, x: ArrayLike) -> FloatArray:
        """As dot()."""
        if type(x) is np.ndarray and x.shape == self.in_shape and x.dtype.kind == "f":
            return self._one(x)  # the short way, because it is the usual one
        product: FloatArray = self.dot(x)
        return product

    def _apply_one(self, x: NDArray[Any]) -> NDArray[Any]:
        if not np.iscomplexobj(x):
            return self._one(x)
        product: NDArray[Any] = self._one(x.real) + 1j * self._one(x.imag)
        return product

    def _apply_many(self, x: NDArray[Any]) -> NDArray[Any]:
        if not np.iscomplexobj(x):
            return self._many(x)
        products: NDArray[Any] = self._many(x.real) + 1j * self._many(x.imag)
        return products

    def _matvec(self, x: NDArray[Any]) -> NDArray[Any]:
        return self._apply_one(np.asarray(x).reshape(self.in_shape)).reshape(-1)

    def _matmat(self, x: NDArray[Any]) -> NDArray[Any]:
        pictures = np.asarray(x).T.reshape(-1, *self.in_shape)
        if len(pictures) == 0:
            return np.zeros((self.shape[0], 0), np.float32)
        return self._apply_many(pictures).reshape(len(pictures), -1).T


class _Transport(_Pictures, Generic[Stored]):
    """What T on the cells and T on the camera's own pixels have in common."""

    takes_light = True

    def __init__(self, stored: Stored) -> None:
        self._stored: Stored = stored
        camera: Grid = stored.camera_grid
        photo = camera if stored.channels == 1 else (*camera, stored.channels)
        super().__init__(stored.projector_grid, photo)

    def _one(self, picture: NDArray[Any]) -> FloatArray:
        return self._stored.apply(picture)

    def _many(self, pictures: NDArray[Any]) -> NDArray[Any]:
        return self._stored.apply_batch(pictures)

    def _transpose(self) -> "Dual":
        return Dual(self)

    _adjoint = _transpose

    @property
    def T(self) -> "Dual":
        """The transpose of T, as an operator: camera pictures → projector pictures."""
        return Dual(self)

    H = T

    @property
    def light_shape(self) -> Grid:
        """(rows, cols) of a light."""
        return self._stored.projector_grid

    @property
    def photo_shape(self) -> Tuple[int, ...]:
        """(rows, cols) of a photograph, or (rows, cols, channels)."""
        return self.out_shape

    @property
    def channels(self) -> int:
        """Channels of a photograph."""
        return self._stored.channels

    @property
    def symmetric(self) -> bool:
        """True if T = Tᵀ in each channel, as on a coaxial rig."""
        return False


class Scene(_Transport[_symrig.StoredScene]):
    """The measured light transport T of a scene: photograph = T · light.

    `scene @ light` accepts

    - a light (rows, cols) → a photograph (rows, cols), or (rows, cols, channels) in colour,
    - lights (rows, cols, count) → photographs with the count as last axis,
    - a flat vector, or a matrix whose columns are flat vectors; `picture.ravel()` is the flat form of a picture.

    Light is in units of the projector: 1 = full light. Any finite value is allowed, because T is linear.
    Photographs are radiance per unit of projector light. Numbers are 32-bit floats.

    A Scene is a scipy.sparse.linalg.LinearOperator: lsqr, svds, eigsh and gmres take it as it is.
    Applying it releases the interpreter's lock, and uses all processors.

    Error of a pixel: the rounding of T, and float sums (docs/file-format.md).
    Raises InputError for a light of another shape, or with NaN or infinity.
    """

    def __init__(self, stored: _symrig.StoredScene, page: Optional[_symrig.CapturePage] = None) -> None:
        self._page = page
        super().__init__(stored)

    # ---- relighting ----

    def relight(
        self,
        lights: ArrayLike,
        *,
        from_view: Optional[Tuple[int, int]] = None,
        to_view: Optional[Tuple[int, int]] = None,
        views: Optional[Tuple[int, int]] = None,
    ) -> FloatArray:
        """The photograph under a light, or photographs under several.

        Args:
            lights: (rows, cols), or (rows, cols, count).
            from_view: (row, col) of the only view that shines; the light then has the size of that view.
            to_view: (row, col) of the only view that sees.
            views: rows and columns of views that tile the pictures; None: those of the scene.
        """
        array = np.asarray(lights)
        _refuse_codes(array)
        if from_view is None and to_view is None and views is None:
            return self @ (array if array.ndim > 1 else array.reshape(self.in_shape))

        def one(light: NDArray[Any]) -> FloatArray:
            return self._stored.relight(light, views, from_view, to_view)

        if array.ndim == 3:
            return np.stack([one(array[..., k]) for k in range(array.shape[2])], axis=-1)
        return one(array)

    def dual(self, light: ArrayLike) -> FloatArray:
        """The scene as the projector sees it, lit from the camera (`symrig dual`).

        Args:
            light: (rows, cols) of the camera; one white light.

        Returns:
            The projector's picture, with the scene's channels.
        """
        array = np.asarray(light)
        _refuse_codes(array)
        return self._stored.dual(array)

    def channel(self, index: int) -> "Channel":
        """One channel of a colour scene, as a square operator between pictures of one channel."""
        return Channel(self, index)

    def flood_lit(self) -> FloatArray:
        """The photograph under white light."""
        return self @ np.ones(self.in_shape, np.float32)

    @property
    def camera(self) -> Optional["Camera"]:
        """T on the camera's own pixels; None if the file has none (docs/python.md)."""
        stored = self._stored.camera
        return None if stored is None else Camera(stored, self.facts.get("camera"))

    # ---- what is known of it ----

    @property
    def symmetric(self) -> bool:
        """True if T = Tᵀ in each channel, as on a coaxial rig."""
        return self._stored.symmetric

    @property
    def views(self) -> Tuple[int, int]:
        """(rows, cols) of coaxial views that tile the pictures."""
        return self._stored.views

    @property
    def nbytes(self) -> int:
        """Bytes of T in memory."""
        return self._stored.bytes

    @property
    def page(self) -> Optional[str]:
        """The address of the page of capture(watch=True); None if there is none."""
        return self._page.address if self._page else None

    def close_page(self) -> None:
        """Ends the page of capture(watch=True)."""
        self._page = None

    @property
    def compression(self) -> float:
        """Bytes of T as a dense matrix of floats, divided by nbytes."""
        return self._stored.dense_bytes / self.nbytes if self.nbytes else 0.0

    @property
    def facts(self) -> Dict[str, Any]:
        """How the scene was captured: the keys of `symrig capture --json` (docs/command-line.md)."""
        facts: Dict[str, Any] = json.loads(self._stored.capture_json)
        return facts

    @property
    def levels(self) -> List[Level]:
        """Stored nodes of each level, coarse to fine."""
        return [Level(k, *counts) for k, counts in enumerate(self._stored.levels)]

    @property
    def held_out(self) -> List[HeldOut]:
        """Photographs that no part of the tensor was made from. The arrays are views of the scene's memory."""
        return [HeldOut(*one) for one in self._stored.held_out]

    def held_out_errors(self) -> List[HeldOutError]:
        """How well the scene predicts each of its held-out photographs."""
        return [HeldOutError(*one) for one in self._stored.held_out_errors()]

    def errors(
        self, rig: Union[None, str, "Rig"] = None, *, progress: Optional["ProgressCallback"] = None
    ) -> Dict[str, Estimate]:
        """Relative errors of T, each with its interval of 95 % confidence.

        Args:
            rig: None: the errors that the capture has estimated from held-out photographs; empty if it has none.
                A simulated rig such as "sim:gummy": errors against its true transport.
                Another rig, open or by name: errors against new photographs.
            progress: called with a symrig.Progress; False stops.

        Returns:
            "frobenius", "indirect", "flood", "relight bar", "relight random", "relight natural", "bar_indirect",
            as in `symrig evaluate`.
        """
        if rig is None:
            return self._estimated_errors()
        if isinstance(rig, str) and rig.startswith("sim:"):
            values, widths = self._stored.errors_by_truth(rig, progress)
        elif isinstance(rig, str):
            from ._capture import open_rig

            with open_rig(rig) as opened:
                return self.errors(opened, progress=progress)
        else:
            values, widths = rig._open.errors(self._stored, progress)
        return {key: Estimate(value, widths[key]) for key, value in values.items()}

    def _estimated_errors(self) -> Dict[str, Estimate]:
        return _estimates(self.facts)

    # ---- other forms ----

    def to_numpy(self, max_bytes: float = 2**30) -> FloatArray:
        """T as a matrix, for small scenes.

        Returns:
            (pixels of the photograph, pixels of the light), as `scene @ light.ravel()`. Colour: rows are pixels
            with the channel last.

        Raises:
            LimitError: the matrix would have more than max_bytes.
        """
        planes = self._stored.dense(float(max_bytes))
        return np.moveaxis(planes, 0, 1).reshape(self.shape)

    def save(self, path: Union[str, "os.PathLike[str]"]) -> None:
        """Writes scene.h5 atomically (docs/file-format.md)."""
        self._stored.save(os.fspath(path))

    def stopped_at(self, level: int) -> "Scene":
        """The scene as it would be if the capture had stopped after a level [Garg06 Fig. 11]."""
        return Scene(self._stored.stopped_at(level))

    def report(self, title: str = "", *, progress: Optional["ProgressCallback"] = None) -> str:
        """The page of `symrig report`: one self-contained HTML text."""
        return self._stored.report(title, progress)

    def __repr__(self) -> str:
        light = "x".join(map(str, self.light_shape))
        photo = "x".join(map(str, self._stored.camera_grid))
        colour = f", {self.channels} channels" if self.channels != 1 else ""
        size = f"{self.nbytes / 1e6:.3g} MB, {self.compression:.3g} times smaller than its matrix"
        return f"<symrig.Scene: light {light} -> photograph {photo}{colour}, {size}>"

    def _repr_html_(self) -> str:
        return _display.html_of(self)


class Dual(_Pictures):
    """The transpose of a scene: camera pictures → projector pictures.

    `scene.T @ picture` sums over the channels, so that <scene @ x, y> = <x, scene.T @ y>. In a scene of one channel
    it is the dual picture; for colour see Scene.dual().
    """

    def __init__(self, scene: "_Transport[Any]") -> None:
        self._scene = scene
        super().__init__(scene.out_shape, scene.in_shape)

    def _one(self, picture: NDArray[Any]) -> FloatArray:
        light: FloatArray = self._scene._stored.adjoint(picture)
        return light

    def _many(self, pictures: NDArray[Any]) -> NDArray[Any]:
        if self._scene.symmetric and self._scene.channels == 1:
            return self._scene._many(pictures)  # T = Tᵀ, and a batch reads T once for 16 pictures
        return super()._many(pictures)

    def _transpose(self) -> "_Transport[Any]":
        return self._scene

    _adjoint = _transpose

    @property
    def T(self) -> "_Transport[Any]":
        """The scene itself."""
        return self._scene

    H = T


class Camera(_Transport[_symrig.CameraTransport]):
    """T on the pixels of a camera that has more of them than the projector has cells: photograph = camera @ light.

    It takes what a Scene takes. Pixels that look beside the projector's picture are 0. Of a camera with a colour
    mosaic, each pixel has light in the channel of its own filter, and relight() fills in the others.

    Error of a pixel: its coefficients have 8 bits, and 16 where these would be too coarse (docs/file-format.md).
    """

    def __init__(self, stored: _symrig.CameraTransport, facts: Optional[Dict[str, Any]] = None) -> None:
        self._facts = facts or {}
        super().__init__(stored)

    def relight(self, lights: ArrayLike) -> FloatArray:
        """The photograph under a light (rows, cols), or photographs under several (rows, cols, count).

        Of a camera with a colour mosaic it has all three colours of each pixel: those that the pixel does not see
        have the ratio to its own colour that they have in the flood-lit scene around it.
        """
        array = np.asarray(lights)
        _refuse_codes(array)
        if array.shape == self.in_shape:
            photograph: FloatArray = self._stored.relight(array[np.newaxis])[0]
            return photograph
        if array.ndim != 3 or array.shape[:2] != self.in_shape:
            raise _mismatch(array.shape, f"a light {self.in_shape}, or lights {(*self.in_shape, 'count')}")
        return np.moveaxis(self._stored.relight(np.moveaxis(array, -1, 0)), 0, -1)

    def errors(self, rig: Optional[str] = None, *, progress: Optional["ProgressCallback"] = None) -> Dict[str, Estimate]:
        """Relative errors on these pixels, with the keys of Scene.errors().

        Args:
            rig: None: as the capture has estimated them from held-out photographs. A simulated bench, such as
                "sim:gummy?camera=304x304": errors against its true transport.
            progress: called with a symrig.Progress; False stops.
        """
        if rig is None:
            return _estimates(self._facts)
        values, widths = self._stored.errors_by_truth(rig, progress)
        return {key: Estimate(value, widths[key]) for key, value in values.items()}

    @property
    def chi_square(self) -> Optional[FloatArray]:
        """(rows, cols[, channels]): mean of (photograph − row · light)² / variance over held-out photographs.

        1: only noise is left; 0: no photograph tells it, or the pixel has no row. None: the capture held out none.
        Large values show where the rows do not describe the scene: it has moved, or a pixel sees several depths.
        """
        return self._stored.chi_square

    @property
    def mosaic(self) -> str:
        """The colour filters of 2 x 2 pixels, such as "RGGB"; "" if each pixel sees all channels."""
        return self._stored.mosaic

    @property
    def nbytes(self) -> int:
        """Bytes in memory."""
        return self._stored.bytes

    def __repr__(self) -> str:
        light, photo = ("x".join(map(str, shape)) for shape in (self.light_shape, self._stored.camera_grid))
        return f"<symrig.Camera: light {light} -> photograph {photo}, {self.nbytes / 1e6:.3g} MB>"


class Channel(_Pictures):
    """One channel of a scene: (rows, cols) → (rows, cols)."""

    def __init__(self, scene: Scene, index: int) -> None:
        if not 0 <= index < scene.channels:
            raise error_of(100, "bad_argument", f"there is no channel {index}", f"channels are 0 to {scene.channels - 1}")
        self._scene, self._index = scene, index
        super().__init__(scene.in_shape, scene.out_shape[:2])

    def _one(self, picture: NDArray[Any]) -> FloatArray:
        seen = self._scene._one(picture)
        return seen if self._scene.channels == 1 else seen[..., self._index]

    def _many(self, pictures: NDArray[Any]) -> NDArray[Any]:
        seen = self._scene._many(pictures)
        return seen if self._scene.channels == 1 else seen[..., self._index]

    def _rmatvec(self, x: NDArray[Any]) -> NDArray[Any]:
        return self.T._matvec(x)

    def _transpose(self) -> "ChannelDual":
        return ChannelDual(self)

    _adjoint = _transpose

    @property
    def T(self) -> "ChannelDual":
        """The transpose."""
        return ChannelDual(self)

    H = T


class ChannelDual(_Pictures):
    """The transpose of one channel."""

    def __init__(self, channel: Channel) -> None:
        self._channel = channel
        super().__init__(channel.out_shape, channel.in_shape)

    def _one(self, picture: NDArray[Any]) -> FloatArray:
        seen = self._channel._scene._stored.dual(picture)
        return seen if seen.ndim == 2 else seen[..., self._channel._index]

    def _transpose(self) -> Channel:
        return self._channel

    _adjoint = _transpose

    @property
    def T(self) -> Channel:
        """The channel itself."""
        return self._channel

    H = T


def load(path: Union[str, "os.PathLike[str]"], memory: Optional[int] = None) -> Scene:
    """Reads scene.h5, a file of capture or fit.

    Args:
        memory: bytes of factors that may be kept in memory; more stay in the file, and are read each time that the
            scene is applied. None: half of the memory that is free.

    Raises:
        InputError: there is no such file, or it is damaged or no scene.
    """
    return Scene(_symrig.load(os.fspath(path), memory or 0))
