"""Arrays of any type and layout, in the types and the layout that the compiled half takes."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from . import _neighbours
from ._errors import ArgumentError

#: Types of samples that the library holds as they are.
_SAMPLES = {np.dtype(name) for name in ("u1", "u2", "i2", "i4", "f4")}
#: VTK's types of cells by the number of their corners.
_CELLS = {4: 10, 5: 14, 6: 13, 8: 12}
_KINDS = "booleans, integers, real or complex numbers"


def numbers(value: Any, name: str) -> npt.NDArray[Any]:
    """Returns an array of numbers in the machine's byte order. Masked values become NaN."""
    if np.ma.isMaskedArray(value):
        value = np.ma.asanyarray(value)
        mask = np.ma.getmaskarray(value)
        if mask.any():
            value = np.where(mask, np.nan, value.data)
        else:
            value = value.data
    try:
        array = np.asarray(value)
    except (TypeError, ValueError) as error:
        raise ArgumentError(f"{name} cannot be made an array: {error}") from error
    if array.ndim == 0 and array.dtype.kind == "O":
        raise _neighbours.unknown(value, name)
    if array.dtype.kind not in "biufc":
        raise ArgumentError(f"{name} has the type {array.dtype}; {_KINDS} are needed")
    if array.dtype.kind == "c":
        array = np.abs(array)
    return array.astype(array.dtype.newbyteorder("="), copy=False)


def samples(value: Any, copy: bool | None = None, axes: int = 3) -> npt.NDArray[Any]:
    """Returns the samples of a volume, [z, y, x], in one of the library's types; with four axes,
    those of its channels, one after the other.

    They are copied if `copy` is True, and if it is None where the library needs another type or
    layout.
    """
    array = numbers(value, "the volume")
    if axes == 4 and (array.ndim != 4 or array.size == 0):
        raise ArgumentError(
            f"a volume with a channel_axis has four axes with samples, not the shape {array.shape}"
        )
    if array.ndim != axes or array.size == 0:
        hint = ""
        if array.ndim == 4:
            hint = "; channel_axis=0 draws all channels, and array[0] or array[..., 0] one"
        raise ArgumentError(
            f"a volume has three axes (z, y, x) with samples, not the shape {array.shape}{hint}"
        )
    if array.dtype.kind == "b":
        array = array.view("u1")
    if array.dtype not in _SAMPLES:
        array = array.astype(_sample_type(array))
    array = np.require(array, requirements=["C", "A"])
    if copy is None:
        return array
    is_shared = np.may_share_memory(array, np.asarray(value))
    if not copy and not is_shared:
        types = ", ".join(map(str, _SAMPLES))
        raise ArgumentError(
            f"the volume cannot be drawn without a copy: that needs an aligned array in C order of "
            f"one of the types {types}"
        )
    return array.copy() if copy and is_shared else array


def _sample_type(array: npt.NDArray[Any]) -> str:
    kind, size = array.dtype.kind, array.dtype.itemsize
    if kind == "f":
        return "f4"
    if kind == "i" and size == 1:
        return "i2"
    # Wide integers keep their digits if all of them fit.
    limits = np.iinfo(np.int32)
    return "i4" if limits.min <= array.min() and array.max() <= limits.max else "f4"


def rows(value: Any, width: int, name: str, dtype: str = "f4") -> npt.NDArray[Any]:
    """Returns rows of so many numbers."""
    array = numbers(value, name)
    if array.ndim != 2 or array.shape[1] != width:
        raise ArgumentError(f"{name} has the shape {array.shape}; (n, {width}) is needed")
    return _converted(array, dtype)


def positions(value: Any, name: str) -> npt.NDArray[Any]:
    """Returns positions: 32-bit numbers if they are no wider, otherwise 64-bit numbers."""
    array = numbers(value, name)
    is_narrow = array.dtype in (np.dtype("f4"), np.dtype("f2"))
    return rows(array, 3, name, "f4" if is_narrow else "f8")


def column(value: Any, name: str) -> npt.NDArray[Any]:
    """Returns one number for each element."""
    array = numbers(value, name)
    if array.ndim == 2 and array.shape[1] == 1:
        array = array[:, 0]
    if array.ndim != 1:
        raise ArgumentError(f"{name} has the shape {array.shape}; (n,) is needed")
    return _converted(array, "f4")


def colors(value: Any, count: int, name: str = "colors") -> npt.NDArray[Any]:
    """Returns a colour of four bytes for each position: from bytes, from 16-bit integers, or from
    real numbers between 0 and 1; red, green and blue, or with opacity."""
    array = numbers(value, name)
    if array.shape in ((3,), (4,)):
        array = np.broadcast_to(array, (count, array.shape[0]))
    if array.ndim != 2 or array.shape[1] not in (3, 4):
        raise ArgumentError(f"{name} has the shape {array.shape}; (n, 3) or (n, 4) is needed")
    if array.dtype == np.uint16:
        parts = np.round(array / 257.0)
    elif array.dtype == np.uint8:
        parts = array
    elif array.dtype.kind == "f":
        if not np.all((array >= 0.0) & (array <= 1.0)):
            raise ArgumentError(f"{name} of real numbers lie between 0 and 1")
        parts = np.round(array * 255.0)
    else:
        raise ArgumentError(
            f"{name} has the type {array.dtype}; uint8, uint16 or real numbers are needed"
        )
    bytes_ = np.full((len(parts), 4), 255, np.uint8)
    bytes_[:, : array.shape[1]] = parts
    return bytes_


def faces(value: Any, count: int) -> npt.NDArray[Any]:
    """Returns triangles. Rows of more than three vertices are convex polygons, which are divided
    around their first vertex."""
    array = numbers(value, "faces")
    if array.ndim != 2 or array.shape[1] < 3 or array.dtype.kind not in "iu":
        raise ArgumentError(
            f"faces are rows of three or more whole numbers, not {array.dtype} of the shape "
            f"{array.shape}"
        )
    if array.size and (array.min() < 0 or array.max() >= count):
        bad = int(np.argmax((array < 0).any(axis=1) | (array >= count).any(axis=1)))
        raise ArgumentError(
            f"face {bad} names the vertices {array[bad].tolist()}, but they go from 0 to "
            f"{count - 1}"
        )
    width = array.shape[1]
    if width > 3:
        fan = [array[:, [0, at, at + 1]] for at in range(1, width - 1)]
        array = np.stack(fan, axis=1).reshape(-1, 3)
    return np.ascontiguousarray(array, dtype=np.uint32)


def cells(value: Any, kinds: Any) -> dict[str, npt.NDArray[Any]]:
    """Returns the kinds, the offsets and the nodes of cells: rows of nodes of one kind, or a list
    of each cell's number of nodes and its nodes."""
    array = numbers(value, "cells")
    if array.dtype.kind not in "iu" or array.ndim not in (1, 2) or array.size == 0:
        raise ArgumentError(
            f"cells are rows of whole numbers, or a list of them, not {array.dtype} of the shape "
            f"{array.shape}"
        )
    if array.min() < 0 or array.max() >= 2**32:
        raise ArgumentError("cells name a point with a number below 0 or above 32 bits")
    if array.ndim == 2:
        count, width = array.shape
        offsets = np.arange(count + 1) * width
        nodes = array.ravel()
    else:
        starts = []
        at = 0
        while at < len(array):
            starts.append(at)
            at += int(array[at]) + 1
        if at != len(array):
            raise ArgumentError(f"the last cell of the list has {at - len(array)} nodes too few")
        nodes = np.delete(array, starts)
        offsets = np.append(starts, at) - np.arange(len(starts) + 1)
        count = len(starts)
    if kinds is None:
        widths = set(np.diff(offsets).tolist())
        if len(widths) != 1 or not widths <= set(_CELLS):
            raise ArgumentError("cells of several lengths, or of a rare one, need kinds")
        kinds = _CELLS[widths.pop()]
    numbers_ = numbers(kinds, "kinds")
    if numbers_.dtype.kind not in "iu" or numbers_.shape not in ((), (1,), (count,)):
        raise ArgumentError(f"kinds is VTK's number of a type, or one for each of {count} cells")
    return raw_cells(np.broadcast_to(numbers_, (count,)), offsets, nodes)


def raw_cells(kinds: Any, offsets: Any, nodes: Any) -> dict[str, npt.NDArray[Any]]:
    """Returns the arrays of cells in the types of the library."""
    return {
        "kinds": np.ascontiguousarray(np.clip(kinds, 0, 255), np.uint8),
        "offsets": np.ascontiguousarray(offsets, np.int64),
        "nodes": np.ascontiguousarray(nodes, np.uint32),
    }


def used(nodes: npt.NDArray[Any], count: int) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
    """Returns the points that cells use, in the order of their first use, as readers of files have
    them, and the nodes by their numbers among these."""
    if nodes.size and nodes.max() >= count:
        raise ArgumentError(f"a cell refers to point {nodes.max()} of {count}")
    points, first, inverse = np.unique(nodes, return_index=True, return_inverse=True)
    order = np.argsort(first)
    numbers_ = np.empty(len(points), np.uint32)
    numbers_[order] = np.arange(len(points), dtype=np.uint32)
    return points[order], numbers_[inverse]


def _converted(array: npt.NDArray[Any], dtype: str) -> npt.NDArray[Any]:
    with np.errstate(over="ignore"):
        return np.ascontiguousarray(array, dtype=dtype)
