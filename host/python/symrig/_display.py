# SPDX-License-Identifier: Apache-2.0
"""How a scene looks in a notebook: its flood-lit picture, its errors, its levels."""

from __future__ import annotations

import base64
import html
from typing import TYPE_CHECKING, Any, Iterable, List

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _symrig

if TYPE_CHECKING:
    from ._scene import Scene

PICTURE_WIDTH = 256  # pixels on the page
BRIGHT_SHARE = 99.5  # percent of the values that stay below white, as in `symrig relight`


def exposure_of(picture: ArrayLike) -> float:
    """The factor that maps all values but the brightest half percent below white."""
    white = float(np.percentile(np.asarray(picture), BRIGHT_SHARE))
    return 1 / white if white > 0 else 1.0


def png(picture: ArrayLike, exposure: float = 0.0) -> bytes:
    """A linear picture as an 8-bit sRGB PNG for viewing.

    Args:
        picture: (rows, cols), or (rows, cols, 3).
        exposure: factor that maps white to 1; 0: 99.5 % of the values are below white.
    """
    array = np.asarray(picture, np.float32)
    return _symrig.display_png(array, exposure or exposure_of(array))


def show(picture: ArrayLike, exposure: float = 0.0, width: int = PICTURE_WIDTH) -> "Picture":
    """A picture that a notebook shows.

    Args:
        picture: (rows, cols), or (rows, cols, 3); linear.
        exposure: factor that maps white to 1; 0: 99.5 % of the values are below white.
        width: on the page, in pixels.
    """
    return Picture(png(picture, exposure), width)


class Picture:
    """A PNG that a notebook shows with square pixels."""

    def __init__(self, data: bytes, width: int = PICTURE_WIDTH) -> None:
        self.data, self.width = data, width

    def _repr_html_(self) -> str:
        source = base64.b64encode(self.data).decode()
        return f'<img src="data:image/png;base64,{source}" style="width:{self.width}px;image-rendering:pixelated">'


def _table(head: Iterable[str], rows: Iterable[Iterable[object]]) -> str:
    def cells(kind: str, values: Iterable[object]) -> str:
        return "".join(f'<{kind} style="text-align:right">{html.escape(str(value))}</{kind}>' for value in values)

    body = "".join(f"<tr>{cells('td', row)}</tr>" for row in rows)
    return f"<table><thead><tr>{cells('th', head)}</tr></thead><tbody>{body}</tbody></table>"


def percent(share: float) -> str:
    return "not known" if np.isnan(share) else f"{100 * share:.2g} %"


def _displayable(scene: "Scene") -> NDArray[Any]:
    flood = scene.flood_lit()
    if flood.ndim == 2 or flood.shape[2] == 3:
        return flood
    mean: NDArray[Any] = np.mean(flood, axis=2)
    return mean


def html_of(scene: "Scene") -> str:
    """Picture, errors and levels of a scene."""
    parts: List[str] = [f"<p>{html.escape(repr(scene)[1:-1])}</p>", show(_displayable(scene))._repr_html_()]
    errors = scene.errors()
    if errors:
        rows = [(name, percent(one.value), percent(one.half_width)) for name, one in errors.items()]
        parts.append(_table(("estimated error", "value", "±"), rows))
    parts.append(_table(("level", "rank 1", "low rank", "empty", "scalar", "subdivided"), scene.levels))
    cell = '<div style="display:inline-block;vertical-align:top;margin-right:1em">{}</div>'
    return "<div>" + parts[0] + "".join(cell.format(part) for part in parts[1:]) + "</div>"
