"""What objects of other packages are taken apart into: the arguments of the methods that add."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from .._errors import ArgumentError

Array = npt.NDArray[Any]


class Parts:
    """The parts of an object."""

    ARTICLE: ClassVar[str]

    @property
    def method(self) -> str:
        """The method that adds the object."""
        raise NotImplementedError


@dataclass
class Volume(Parts):
    """Samples [z, y, x] on a lattice."""

    ARTICLE = "a volume"
    samples: Any
    spacing: Sequence[float] = (1.0, 1.0, 1.0)
    origin: Sequence[float] = (0.0, 0.0, 0.0)
    #: The columns are the directions of x, y and z of the array.
    axes: Any = None
    #: Where samples are along x, y and z, if they are not evenly spaced.
    coordinates: Sequence[Any] | None = None
    value_name: str = ""
    value_unit: str = ""
    unit: str = ""
    #: The frame of a patient: lps or ras.
    frame: str | None = None

    @property
    def method(self) -> str:
        return "add_volume"


@dataclass
class Surface(Parts):
    """A mesh, or a point cloud if there are no faces."""

    ARTICLE = "a mesh or a point cloud"
    positions: Array
    faces: Array | None = None
    normals: Array | None = None
    colors: Array | None = None
    values: Array | None = None
    #: The direction that is up, if the object's format says so.
    up: str | None = None

    @property
    def method(self) -> str:
        return "add_points" if self.faces is None else "add_mesh"

    def with_given(self, normals: Any, colors: Any, values: Any) -> Surface:
        """Returns the same with other arrays where they are given."""
        given = {"normals": normals, "colors": colors, "values": values}
        return replace(self, **{name: array for name, array in given.items() if array is not None})

    def by_face(self, colors: Array | None, values: Array | None) -> Surface:
        """Returns the mesh with colours or values of its faces: no two faces share a vertex."""
        assert self.faces is not None
        at = self.faces.ravel()

        def repeated(array: Array | None) -> Array | None:
            return None if array is None else np.repeat(array, self.faces.shape[1], axis=0)  # type: ignore[union-attr]

        return Surface(
            self.positions[at],
            np.arange(len(at)).reshape(self.faces.shape),
            None if self.normals is None else self.normals[at],
            repeated(colors),
            repeated(values),
        )


@dataclass
class Cells(Parts):
    """Cells that fill space, and surfaces beside them. Kinds have VTK's numbers."""

    ARTICLE = "a set of cells"
    positions: Array
    kinds: Array
    offsets: Array
    nodes: Array
    #: None without a field.
    values: Array | None
    #: Whether the values are those of cells, not of points.
    of_cells: bool

    @property
    def method(self) -> str:
        return "add_cells"


def of_affine(samples: Any, affine: Array, **more: Any) -> Volume:
    """Returns a volume whose sample [k, j, i] is at affine · (i, j, k, 1)."""
    steps = np.asarray(affine, float)[:3, :3]
    spacing = np.linalg.norm(steps, axis=0)
    if not (np.isfinite(affine).all() and (spacing > 0).all()):
        raise ArgumentError(f"the affine of the image gives the axes no length: {affine.tolist()}")
    origin = np.asarray(affine, float)[:3, 3]
    return Volume(samples, spacing.tolist(), origin.tolist(), steps / spacing, **more)


def of_coordinates(samples: Array, places: Sequence[Any], **more: Any) -> Volume:
    """Returns a volume whose sample [k, j, i] is at (x[i], y[j], z[k]). Coordinates ascend or
    descend."""
    lines = [np.asarray(line, float) for line in places]
    for axis, line in zip("xyz", lines, strict=True):
        steps = np.diff(line)
        if not np.isfinite(line).all() or not ((steps > 0).all() or (steps < 0).all()):
            raise ArgumentError(f"the coordinates along {axis} neither ascend nor descend")
    means = [(line[-1] - line[0]) / (len(line) - 1) if len(line) > 1 else 1.0 for line in lines]
    if all(map(_is_even, lines)):
        origin = [line[0] for line in lines]
        return Volume(samples, np.abs(means).tolist(), origin, np.diag(np.sign(means)), **more)
    turned = [slice(None, None, -1) if step < 0 else slice(None) for step in means]
    lines = [line[turn] for line, turn in zip(lines, turned, strict=True)]
    return Volume(samples[tuple(turned[::-1])], coordinates=lines, **more)


def _is_even(line: Array) -> bool:
    """Whether steps differ by no more than the rounding of 32-bit coordinates."""
    even = np.linspace(line[0], line[-1], len(line))
    step = abs(line[-1] - line[0]) / max(len(line) - 1, 1)
    rounding = 4 * np.finfo(np.float32).eps * np.abs(line).max()
    return bool(np.abs(line - even).max() <= max(1e-4 * step, min(rounding, 0.05 * step)))


def chosen(arrays: Mapping[str, Any], scalar: str, what: str) -> Any:
    """Returns the array of a name."""
    if scalar in arrays:
        return arrays[scalar]
    names = ", ".join(map(repr, arrays)) or "none"
    raise ArgumentError(f"{what} has no array {scalar!r}; its arrays: {names}")


def fans(offsets: Array, nodes: Array) -> tuple[Array, Array]:
    """Returns the triangles of convex polygons, and the polygon of each triangle."""
    counts = np.diff(offsets) - 2
    owners = np.repeat(np.arange(len(counts)), np.maximum(counts, 0))
    starts = np.concatenate([[0], np.cumsum(np.maximum(counts, 0))])
    first = np.asarray(offsets)[owners]
    second = first + np.arange(len(owners)) - starts[owners] + 1
    return np.stack([nodes[first], nodes[second], nodes[second + 1]], axis=1), owners


class _Held:
    """Makes an array keep the object whose memory it shows."""

    def __init__(self, array: Array, owner: Any) -> None:
        self.__array_interface__ = array.__array_interface__
        self._kept = (array, owner)


def held(array: Array, owner: Any) -> Array:
    """Returns a view of an array that keeps an owner of its memory."""
    return np.asarray(_Held(array, owner))
