"""Regions of a scene: boxes that fill space, and their order as seen from an eye."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Union

import numpy as np
import numpy.typing as npt

from .._camera import Camera

#: The lower and the upper corner of a box.
Box = tuple[tuple[float, ...], tuple[float, ...]]
#: The regions of a scene: one, by its number, or two halves of space.
Tree = Union[int, "Split"]

#: How far the outer regions reach beyond the scene, in its diagonals. Footprints do too.
_BEYOND = 4.0


@dataclass(frozen=True)
class Split:
    """A plane across an axis. Regions of `low` lie on its lower side."""

    axis: int
    place: float
    low: Tree
    high: Tree


def split(bounds: Box, weights: npt.NDArray[np.float64], count: int) -> tuple[Tree, list[Box]]:
    """Divides space into regions with about the same work.

    Args:
        bounds: The box around the scene.
        weights: Where work lies: rows of x, y, z and a weight.
        count: The number of regions.
    """
    low, high = (np.array(corner, dtype=float) for corner in bounds)
    beyond = _BEYOND * max(float(np.linalg.norm(high - low)), 1e-6)
    boxes: list[Box] = []
    outer = (low - beyond, high + beyond)
    tree = _halved(outer, (low, high), weights, count, boxes)
    return tree, boxes


def _halved(outer: Any, inner: Any, weights: Any, count: int, boxes: list[Box]) -> Tree:
    """`outer` is a region's box, and `inner` its part around the scene."""
    if count == 1:
        boxes.append((tuple(outer[0].tolist()), tuple(outer[1].tolist())))
        return len(boxes) - 1
    below = count // 2
    share = below / count
    axis, place = _plane(inner, weights, share)
    is_low = weights[:, axis] < place
    halves = []
    for side, mask, number in ((1, is_low, below), (0, ~is_low, count - below)):
        around, around_scene = ([corner.copy() for corner in box] for box in (outer, inner))
        around[side][axis] = around_scene[side][axis] = place
        halves.append(_halved(around, around_scene, weights[mask], number, boxes))
    return Split(axis, place, *halves)


def _plane(inner: Any, weights: Any, share: float) -> tuple[int, float]:
    """Returns the plane with a share of the work on its lower side: across the longest axis of
    what is drawn, midway between two of its places."""
    low, high = inner
    places = weights[:, :3]
    spans = np.ptp(places, axis=0) if len(places) > 1 else np.zeros(3)
    if not spans.any():
        axis = int(np.argmax(high - low))
        return axis, float(low[axis] + share * (high[axis] - low[axis]))
    axis = int(np.argmax(spans))
    distinct, where = np.unique(places[:, axis], return_inverse=True)
    sums = np.cumsum(np.bincount(where, weights=weights[:, 3]))
    # A plane between two places: one place at least lies on each side.
    at = int(np.argmin(np.abs(sums[:-1] - share * sums[-1])))
    return axis, float(0.5 * (distinct[at] + distinct[at + 1]))


def order(tree: Tree, camera: Camera) -> list[int]:
    """Returns the numbers of the regions, the nearest to the eye first."""
    if isinstance(tree, int):
        return [tree]
    near, far = (tree.low, tree.high) if sees_low_first(tree, camera) else (tree.high, tree.low)
    return order(near, camera) + order(far, camera)


def sees_low_first(plane: Split, camera: Camera) -> bool:
    """Whether the lower side of a plane may hide the upper one, and not the reverse."""
    eye, axis = camera.position[plane.axis], plane.axis
    if camera.height is None:
        return eye < plane.place
    return camera.focal_point[axis] >= eye


def common(box: Box, other: Box) -> Box:
    """Returns the part of a box inside another."""
    low = tuple(max(a, b) for a, b in zip(box[0], other[0], strict=True))
    high = tuple(min(a, b) for a, b in zip(box[1], other[1], strict=True))
    return low, high
