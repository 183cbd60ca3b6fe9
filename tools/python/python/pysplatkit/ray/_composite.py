"""Pictures of regions, composited front to back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from .._camera import Camera
from ._regions import Box

#: A pixel that transmits less light is finished, as in the engine.
_OPAQUE = 0.0005


@dataclass
class Part:
    """Rows of the picture of a region: the rectangle around what is not empty."""

    #: The number of rows and columns.
    shape: tuple[int, int]
    #: The first row and column of the rectangle.
    corner: tuple[int, int]
    #: Red, green and blue, multiplied by opacity, and opacity: (height, width, 4), 16 or 32 bits.
    color: npt.NDArray[Any]
    #: Where half of the light is absorbed: (height, width), 32 bits; infinite where less is.
    depth: npt.NDArray[np.float32]
    #: The box around what the region shows.
    box: Box

    @property
    def bytes(self) -> int:
        """The size of the arrays."""
        return int(self.color.nbytes + self.depth.nbytes)


def cropped(color: Any, depth: Any, box: Box, precision: str) -> Part:
    """Returns the part that rows of a picture are."""
    shape = color.shape[:2]
    shows = color[..., 3] > 0.0
    rows, columns = np.flatnonzero(shows.any(axis=1)), np.flatnonzero(shows.any(axis=0))
    if not rows.size:
        none = np.zeros((0, 0, 4), precision)
        return Part(shape, (0, 0), none, np.zeros((0, 0), np.float32), box)
    area = (slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1))
    kept = np.ascontiguousarray(color[area], precision)
    corner = (int(rows[0]), int(columns[0]))
    return Part(shape, corner, kept, np.ascontiguousarray(depth[area]), box)


@dataclass(frozen=True)
class Window:
    """Some rows of a picture, and where its rays run."""

    camera: Camera
    #: The width and the height of the whole picture.
    size: tuple[int, int]
    #: The first row, and the row after the last.
    rows: tuple[int, int]

    def halves(self) -> tuple[Window, Window]:
        """Returns the upper and the lower half."""
        first, end = self.rows
        middle = (first + end) // 2
        upper, lower = (first, middle), (middle, end)
        return Window(self.camera, self.size, upper), Window(self.camera, self.size, lower)

    def depths(self, box: Box, rows: Any, columns: Any) -> Any:
        """Returns the depths, along the view direction, at which the rays of pixels enter a box and
        leave it."""
        width, height = self.size
        eye, focus, up = (
            np.array(vector, dtype=float)
            for vector in (self.camera.position, self.camera.focal_point, self.camera.view_up)
        )
        ahead = (focus - eye) / np.linalg.norm(focus - eye)
        right = np.cross(ahead, up)
        right /= np.linalg.norm(right)
        down = np.cross(ahead, right)
        if self.camera.height is None:
            angle = np.radians(30.0 if self.camera.view_angle is None else self.camera.view_angle)
            pixel = 2.0 * np.tan(0.5 * angle) / height
        else:
            pixel = self.camera.height / height
        x = (columns + 0.5 - 0.5 * width) * pixel
        y = (rows + self.rows[0] + 0.5 - 0.5 * height) * pixel
        aside = x[:, None] * right + y[:, None] * down
        is_flat = self.camera.height is not None
        origins, directions = (eye + aside, ahead) if is_flat else (eye, ahead + aside)
        with np.errstate(divide="ignore", invalid="ignore"):
            a, b = ((np.array(corner) - origins) / directions for corner in box)
        enter, leave = np.nanmax(np.minimum(a, b), axis=1), np.nanmin(np.maximum(a, b), axis=1)
        return np.maximum(enter, 0.0), np.maximum(leave, 0.0)


def over(parts: Sequence[Part], window: Window) -> tuple[Any, Any]:
    """Composites the same rows of several regions, the nearest first. Returns colours and depths of
    32 bits."""
    color = np.zeros((*parts[0].shape, 4), np.float32)
    depth = np.full(parts[0].shape, np.inf, np.float32)
    for part in parts:
        (row, column), (height, width) = part.corner, part.depth.shape
        area = (slice(row, row + height), slice(column, column + width))
        _add(color[area], depth[area], part, window)
    return color, depth


def _add(color: Any, depth: Any, part: Part, window: Window) -> None:
    """Adds a part behind a rectangle of a picture."""
    before = 1.0 - color[..., 3]
    reach = np.where(before > _OPAQUE, before, 0.0)[..., None]
    color += reach * part.color.astype(np.float32)
    crosses = (before > 0.5) & (color[..., 3] >= 0.5)
    depth[crosses] = part.depth[crosses]
    # The part alone absorbs less than half: its matter counts as evenly spread.
    thin = crosses & ~np.isfinite(depth)
    rows, columns = np.nonzero(thin)
    if rows.size:
        first, beside = part.corner
        enter, leave = window.depths(part.box, rows + first, columns + beside)
        opacity = part.color[..., 3][thin].astype(np.float64)
        whole = -np.log(np.maximum(1.0 - opacity, 1e-6))
        share = np.log(2.0 * before[thin]) / np.maximum(whole, 1e-6)
        depth[thin] = enter + np.clip(share, 0.0, 1.0) * np.maximum(leave - enter, 0.0)
